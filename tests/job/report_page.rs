//! The pages: one file each that asks for nothing, escapes what users named, says what it must in
//! its order, and is small; and the script that they carry is the one that `scripts/viewer` says it
//! is.

use crate::program;
use crate::schema_support;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Output;

use scan2params::Fabric;
use scan2params::calibrate::comparison::Comparison;
use scan2params::calibrate::effect::{Cloth, EFFECTS, FIELDS, FieldOf, Layer};
use scan2params::calibrate::explain::{Cause, Explanation, Explanations};
use scan2params::calibrate::fabric_prior::FabricPrior;
use scan2params::calibrate::field::{Field, FieldLayer};
use scan2params::calibrate::fit::Fitted;
use scan2params::calibrate::floor::{Pairing, Spread};
use scan2params::calibrate::found::FoundEffect;
use scan2params::calibrate::manifest::{Bench, Entry, Face, Kind, Role};
use scan2params::calibrate::measured::Measured;
use scan2params::calibrate::measures::{FoldRule, Measures};
use scan2params::calibrate::pose::Pose;
use scan2params::calibrate::prediction::outline_of;
use scan2params::calibrate::residuals::Row;
use scan2params::calibrate::result::{After, ComparedDrape, FabricResult, Verdict};
use scan2params::calibrate::run::{Calibration, Refused};
use scan2params::fabric::{Mixture, STIFFNESSES, TABLE_2, sha256_hex};
use scan2params::refine::{Ended, RefinedStiffness};
use scan2params::report::calibration::write;
use scan2params::report::page::calibration::{Source, page};
use scan2params::report::page::provenance::InputFile;
use scan2params::sim::experiment::{CURL_NODES, NodeField};
use scan2params::{Drop, Experiment, SimOptions, drape};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn program(arguments: &[&str]) -> Output {
    program::program().args(arguments).output().unwrap()
}

/// Letters of the longest text that is no base64.
const LONGEST_WORD: usize = 200;

/// What holds of every page: no address but the names of XML's forms, nothing that loads anything,
/// every drawing named, every section reached, no number that is none.
fn check(page: &str) {
    for scheme in ["http://", "https://"] {
        for (at, _) in page.match_indices(scheme) {
            let address: String = page[at..].chars().take(40).collect();
            assert!(address.starts_with("http://www.w3.org/"), "{address}");
        }
    }
    for loads in ["<link rel=\"stylesheet\"", "<script src", "@import", "url(", "<iframe", "srcset"]
    {
        assert!(!page.contains(loads), "{loads}");
    }
    assert!(page.contains("default-src 'none'"));
    let own = page.split("<script>").next().unwrap();
    let sources = own.split(" src=\"").skip(1).map(|rest| rest.split('"').next().unwrap());
    assert!(sources.clone().all(|source| source.starts_with("data:")));
    for drawing in own.split("<svg").skip(1) {
        let head = drawing.split('>').next().unwrap();
        let named = head.contains("aria-label=\"") && head.contains("role=\"img\"");
        assert!(named || head.contains("aria-hidden=\"true\""), "{head}");
    }
    // the letters of a picture or of a sheet's numbers may spell anything
    let base64 = |c: char| c.is_ascii_alphanumeric() || matches!(c, '+' | '/' | '=');
    let word = |word: &&str| word.len() < LONGEST_WORD;
    assert!(own.split(|c| !base64(c)).filter(word).all(|word| !word.contains("NaN")));
    assert!(!own.contains(">inf"));
    let ids: Vec<&str> =
        own.split(" id=\"").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
    let known: BTreeSet<&str> = ids.iter().copied().collect();
    assert_eq!(known.len(), ids.len(), "{ids:?}");
    for target in own.split("href=\"#").skip(1).map(|rest| rest.split('"').next().unwrap()) {
        assert!(known.contains(target), "{target}");
    }
    for landmark in ["<main", "<nav aria-label", "<header", "<footer", "<html lang"] {
        assert!(own.contains(landmark), "{landmark}");
    }
    assert!(own.contains("Simulation parameters, not measured mechanical properties"));
}

/// That some texts stand in a page in this order.
fn in_order(page: &str, texts: &[&str]) {
    let mut from = 0;
    for text in texts {
        let found = page[from..].find(text);
        from += found.unwrap_or_else(|| panic!("`{text}` is not behind the ones before it"));
    }
}

#[test]
fn the_script_of_the_pages_is_the_one_that_its_lock_names() {
    let read = |path: &str| std::fs::read_to_string(root().join(path)).unwrap();
    let bundle = read("src/report/page/viewer/viewer.min.js");
    let lock: serde_json::Value =
        serde_json::from_str(&read("src/report/page/viewer/viewer.lock.json")).unwrap();
    let package: serde_json::Value =
        serde_json::from_str(&read("scripts/viewer/package.json")).unwrap();
    let rebuild = "run `npm ci && npm run build` in scripts/viewer";
    assert_eq!(lock["sha256"], sha256_hex(bundle.as_bytes()).as_str(), "{rebuild}");
    let source = read("scripts/viewer/viewer.js");
    assert_eq!(lock["source_sha256"], sha256_hex(source.as_bytes()).as_str(), "{rebuild}");
    for name in ["three", "esbuild"] {
        assert_eq!(lock[name], package["devDependencies"][name], "{rebuild}");
    }
    assert!(bundle.starts_with("/*! three.js") && bundle.contains("The MIT License"));
    assert!(bundle.contains("three.js authors") && !bundle.to_lowercase().contains("</script"));
}

/// A folder with the fixture's scan under a name that a page must escape, and the laboratory's
/// fields.
fn named(folder: &Path) -> [PathBuf; 2] {
    let scan = folder.join("a <b> & \"c'.ply");
    std::fs::copy(root().join("fixtures/scans/mean_structured-light.ply"), &scan).unwrap();
    let lab = folder.join("lab.toml");
    let fields = "specimen_id = \"K <7>\"\ncomposition = \"60 % cotton & 40 % PES\"\n";
    std::fs::write(&lab, fields).unwrap();
    [scan, lab]
}

#[test]
fn a_scan_has_its_page_and_none_where_it_is_not_wanted() {
    let folder = tempfile::tempdir().unwrap();
    let [scan, lab] = named(folder.path());
    let out = folder.path().join("out");
    let [scan, lab, to] = [&scan, &lab, &out].map(|path| path.to_str().unwrap());
    let job = [scan, "--density", "214", "--quick", "--warp-toward", "-x", "--out", to];
    let run = program(&[&job[..], &["--lab", lab]].concat());
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let page = std::fs::read_to_string(out.join("a <b> & \"c'.report.html")).unwrap();
    println!("{} bytes", page.len());
    assert!(page.len() < 1_500_000, "{}", page.len());
    check(&page);
    let order = [
        "a &lt;b&gt; &amp; &quot;c",
        "id=\"verdict\"",
        "id=\"next\"",
        "id=\"parameters\"",
        "fSuK",
        "id=\"overlay\"",
        "id=\"along\"",
        "id=\"space\"",
        "id=\"quality\"",
        "id=\"coefficient\"",
        "Square, as scanned",
        "id=\"laboratory\"",
        "K &lt;7&gt;",
        "60 % cotton &amp; 40 % PES",
        "not given",
        "id=\"provenance\"",
    ];
    in_order(&page, &order);
    assert!(!page.contains("a <b>") && !page.contains("K <7>"));
    assert!(!page.contains("Standard Cusick, simulated"), "not asked for");
    // what params.json says
    let params = std::fs::read_to_string(out.join("a <b> & \"c'.params.json")).unwrap();
    let params: serde_json::Value = serde_json::from_str(&params).unwrap();
    let hash = sha256_hex(&std::fs::read(scan).unwrap());
    assert!(page.contains(&hash) && page.contains(params["model"]["sha256"].as_str().unwrap()));
    let bending = params["parameters"]["bending_weft"]["value"].as_f64().unwrap();
    assert!(page.contains(&format!("{bending:.0}<")), "{bending}");
    let error = params["released_drape"]["rim_mean_mm"].as_f64().unwrap();
    assert!(page.contains(&format!("{error:.2} mm")), "{error}");

    let wrong = folder.path().join("lab.json");
    std::fs::write(&wrong, "{ \"specimen\": \"7\" }").unwrap();
    let run = program(&[&job[..], &["--lab", wrong.to_str().unwrap()]].concat());
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(run.status.code() == Some(2) && said.contains("specimen_id"), "{said}");
    std::fs::remove_dir_all(&out).unwrap();
    let run = program(&[&job[..], &["--no-report"]].concat());
    assert!(run.status.success());
    assert!(std::fs::read_dir(&out).unwrap().all(|file| {
        let path = file.unwrap().path();
        path.extension().is_none_or(|ending| ending != "html")
    }));
}

#[test]
fn a_batch_has_its_page_with_those_of_its_scans() {
    let folder = tempfile::tempdir().unwrap();
    let [scan, _] = named(folder.path());
    let scans = folder.path().join("scans & more");
    std::fs::create_dir(&scans).unwrap();
    std::fs::rename(&scan, scans.join("a <b> & 1.ply")).unwrap();
    std::fs::write(scans.join("bad <1>.ply"), "ply\nformat ascii 1.0\n").unwrap();
    let out = folder.path().join("out");
    let [from, to] = [&scans, &out].map(|path| path.to_str().unwrap());
    let job = ["batch", from, "--density", "214", "--quick", "--warp-toward", "-x", "--out", to];
    let run = program(&job);
    assert_eq!(run.status.code(), Some(3), "{}", String::from_utf8_lossy(&run.stderr));
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    let whole = read("report.html");
    check(&whole);
    let order = [
        "scans &amp; more",
        "id=\"scans\"",
        "a &lt;b&gt; &amp; 1.ply",
        "id=\"overlays\"",
        "id=\"failures\"",
        "bad &lt;1&gt;.ply",
    ];
    in_order(&whole, &order);
    assert!(whole.contains("href=\"files/a%20%3Cb%3E%20%26%201.ply.report.html\""));
    assert!(whole.contains("data:image/svg+xml;base64,") && !whole.contains("bad <1>"));
    let own = read("files/a <b> & 1.ply.report.html");
    println!("{} and {} bytes", whole.len(), own.len());
    check(&own);
    assert!(!own.contains("<canvas") && own.contains("class=\"still\"") && own.len() < 400_000);
    // taken up again, the same bytes
    let again = program(&job);
    assert!(String::from_utf8_lossy(&again.stderr).contains("1 kept"));
    assert_eq!(read("report.html"), whole);
    std::fs::remove_dir_all(&out).unwrap();
    program(&[&job[..], &["--no-report"]].concat());
    assert!(!out.join("report.html").exists() && out.join("results.csv").exists());
    assert_eq!(std::fs::read_dir(out.join("files")).unwrap().count(), 3);
}

/// A measured drape, which is a simulated one moved outwards, beside that one.
fn comparison(up: bool, out_m: f64, drape: &scan2params::Drape) -> Comparison {
    let simulated = outline_of(drape);
    let measured = simulated.mapped(|[x, z]| {
        let far = x.hypot(z);
        [x * (1.0 + out_m / far), z * (1.0 + out_m / far)]
    });
    let rule = FoldRule::default();
    let row = |k: i32| {
        let bearing_rad = f64::from(k).to_radians() * 1.5;
        Row { bearing_rad, outwards_m: out_m, across_m: out_m.abs() }
    };
    let rows = (0..240).map(row);
    Comparison {
        drape: drape.clone(),
        pose: Pose::default(),
        rms_m: out_m.abs(),
        rows: rows.collect(),
        measures: Measures::of(&simulated, &Experiment::standard_cusick(), &rule),
        measured,
        simulated,
        springs_share: if up { 0.01 } else { 0.02 },
        released_rms_m: None,
    }
}

fn fitted() -> Fitted {
    let fabric = Fabric::mean_knit();
    let si = fabric.in_si();
    let of = |k: usize| RefinedStiffness {
        key: TABLE_2[k].key,
        value: si[k],
        interval90: [si[k] / 1.5, si[k] * 1.5],
        shown: 0.15 * k as f64,
        at_limit: k == 0,
    };
    Fitted {
        cloth: Cloth::plain(fabric),
        stiffnesses: std::array::from_fn::<_, STIFFNESSES, _>(of),
        intervals90: Vec::new(),
        at_limit: Vec::new(),
        drapes: Vec::new(),
        cost: 10.0,
        misfit: 1.2,
        ended: Ended::Converged,
        simulated: 40,
    }
}

fn entry(line: usize, face: Face, role: Role) -> Entry {
    Entry {
        line,
        name: format!("pictures/<{line}> & more.png"),
        path: PathBuf::from("nowhere.png"),
        kind: Kind::Silhouette,
        fabric: "f <1>".to_owned(),
        specimen: Some(format!("s{line}")),
        face: Some(face),
        capture: None,
        density_kg_m2: None,
        bench: Some(Bench::Cusick),
        pixel_m: Some(1e-3),
        role,
        warp_toward: None,
        observation: None,
        camera_height_m: None,
    }
}

/// A fabric with drapes of both faces, fitted and held out, an effect and what it gained.
fn calibrated() -> Calibration {
    let experiment = Experiment::standard_cusick();
    let options =
        SimOptions { experiment, vertices: 31, fall_vertices: 21, ..SimOptions::default() };
    let drape = drape(&Fabric::mean_knit(), &Drop::canonical(), &options);
    let all = [
        (Face::Up, Role::Fit),
        (Face::Down, Role::Fit),
        (Face::Up, Role::Holdout),
        (Face::Down, Role::Holdout),
    ];
    let drapes = |out_m: f64| -> Vec<ComparedDrape> {
        let of = |(measured, (face, _)): (usize, &(Face, Role))| {
            let comparison =
                Ok(comparison(*face == Face::Up, out_m + 1e-4 * measured as f64, &drape));
            ComparedDrape { measured, comparison }
        };
        all.iter().enumerate().map(of).collect()
    };
    let outline = comparison(true, 3e-3, &drape).measured;
    let measures = Measures::of(&outline, &experiment, &FoldRule::default());
    let measured = all.iter().enumerate().map(|(k, (face, role))| Measured {
        entry: entry(k + 2, *face, *role),
        outline: outline.clone(),
        rim: None,
        bench: experiment,
        measures: measures.clone(),
        warp_rad: None,
    });
    let numbers = EFFECTS[0].numbers.iter().map(|number| (number, 8.0, [5.0, 11.0])).collect();
    let effects = vec![FoundEffect { effect: &EFFECTS[0], numbers, group: vec!["edge_curl"] }];
    let fabric = FabricResult {
        name: "f <1>".to_owned(),
        fabric_prior: FabricPrior::of(&Mixture::measured(), None).unwrap(),
        measured: measured.collect(),
        floor: vec![Spread {
            pairing: Pairing::Captures,
            pairs: 6,
            median_m: 1e-3,
            quantiles_m: [0.8e-3, 1.6e-3],
            turned_median_m: 0.9e-3,
        }],
        fitted: Ok(fitted()),
        drapes: drapes(3e-3),
        explanations: Some(Explanations(vec![
            Explanation { cause: Cause::Effects(vec![&EFFECTS[0]]), probability: 0.96 },
            Explanation { cause: Cause::Nothing, probability: 0.03 },
            Explanation { cause: Cause::Else, probability: 0.01 },
        ])),
        fields: vec![field(), weight()],
        after: Some(After { effects, fitted: fitted(), drapes: drapes(1e-3) }),
        verdict: Verdict::Found,
    };
    let why = "no <figure>; take another".to_owned();
    Calibration {
        fabrics: vec![fabric],
        refused: vec![Refused { line: 9, name: "x<y>.png".into(), why }],
    }
}

/// A field that is strongest at a node between plate and rim, along the warp, of what turns over.
fn field() -> Field {
    let mut layers: Vec<FieldLayer> = FIELDS[0].1.iter().map(layer(1.0)).collect();
    layers[1].values.nodes[3][1] = -20.0;
    Field { name: "curvature", layers, step: 15.0, is_even: false, ln_gain: 8.0 }
}

/// One of weight that explains nothing.
fn weight() -> Field {
    let layers = FIELDS[1].1.iter().map(layer(0.1)).collect();
    Field { name: "weight", layers, step: 0.3, is_even: false, ln_gain: 0.3 }
}

fn layer(error: f64) -> impl Fn(&(FieldOf, Layer)) -> FieldLayer {
    move |(of, layer)| FieldLayer {
        of: *of,
        layer: *layer,
        values: NodeField::default(),
        errors: NodeField { nodes: [[error; CURL_NODES]; CURL_NODES] },
    }
}

#[test]
fn a_calibration_has_its_page_with_before_and_after() {
    let calibration = calibrated();
    schema_support::must_fit(
        "calibration",
        &scan2params::report::calibration::json_of(&calibration),
    );
    let fitted = calibration.fabrics[0].fitted.as_ref().unwrap();
    // pictures of a knit on cells of 10 mm
    let doubts = calibration.fabrics[0].doubts();
    assert_eq!(doubts.iter().map(|doubt| doubt.code).collect::<Vec<_>>(), ["cells_too_coarse"]);
    let fabric = scan2params::calibrate::cloth_file::text(fitted, false, &doubts);
    schema_support::must_fit("calibrated-fabric", &fabric);
    let manifest =
        vec![InputFile { name: "my/m & n.csv".into(), sha256: "00ff".into(), bytes: 12 }];
    let source = Source { manifest, settings: serde_json::json!({ "prior": "measured" }) };
    let of = |calibration: &Calibration| {
        let folder = tempfile::tempdir().unwrap();
        let section = write(&calibration.fabrics[0], folder.path()).unwrap();
        page(&[section], &calibration.refused, &source)
    };
    let whole = of(&calibration);
    println!("{} bytes", whole.len());
    check(&whole);
    for said in ["natural curvature 96", "Doubtful: cells of", "nothing beyond the plain model 3"] {
        assert!(whole.contains(said), "{said}");
    }
    let order = [
        "m &amp; n.csv",
        "Fabric f &lt;1&gt;",
        "An effect is found",
        "natural curvature",
        "What to do next",
        "Parameters of the plain model",
        "Parameters with the effects",
        "Not told apart from",
        "edge curl",
        "What explains the drapes",
        "Fields that would explain the residual",
        "strongest along the warp, turns over, \u{2212}20.00 \u{b1} 1.00 1/m, at 75 mm along the warp and \u{2212}75 mm along the weft",
        "No field of weight is needed",
        "Drapes held out",
        "Drape coefficient, measured against simulated",
        "By role and face",
        "Drape by drape",
        "Face up",
        "Face down",
        "How well the outlines are known",
        "What these data cannot decide",
        "id=\"refused\"",
        "x&lt;y&gt;.png",
        "no &lt;figure&gt;",
    ];
    in_order(&whole, &order);
    assert!(whole.contains("3.25 mm off without it and 1.25 mm with it"), "the held-out pairs");
    assert_eq!(
        whole.matches("class=\"before\"").count(),
        4 * 2 + 1,
        "outline and residual of each, and the legend"
    );
    assert_eq!(whole.matches("class=\"after\"").count(), 4 * 2 + 1);
    assert!(!whole.contains("f <1>") && !whole.contains("<2> &"));
    assert!(!whole.contains("<script"));
    assert!(whole.matches("class=\"square down\"").count() > 100);
    // a field that explains nothing is said to, and not drawn
    let mut chance = calibration.clone();
    chance.fabrics[0].fields = vec![Field { ln_gain: 0.5, ..field() }];
    let page_of_chance = of(&chance);
    check(&page_of_chance);
    assert!(page_of_chance.contains("No field of natural curvature is needed"));
    assert!(!page_of_chance.contains("class=\"square"));
    // a fabric that was not fitted, and one without effects
    let mut failed = calibration.clone();
    failed.fabrics[0].after = None;
    failed.fabrics[0].verdict = Verdict::Undecided;
    check(&of(&failed));
    failed.fabrics[0].fitted = Err(scan2params::calibrate::fit::FitError::Nothing);
    schema_support::must_fit("calibration", &scan2params::report::calibration::json_of(&failed));
    failed.fabrics[0].drapes.clear();
    failed.fabrics[0].explanations = None;
    schema_support::must_fit("calibration", &scan2params::report::calibration::json_of(&failed));
    let none = of(&failed);
    check(&none);
    assert!(
        none.contains("Not fitted: no outline to fit") && none.contains("No drape was held out")
    );
}
