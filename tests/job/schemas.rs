//! docs/schemas against what the program writes, and against faults that they must not let through.

use crate::committed::job;
use crate::program;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::schema_support::{faults, folder, json, must_fit, names, schema};
use scan2params::job::verdict::Code;
use serde_json::{Value, json};

/// Verbs with `--json`, with the schemas of what they print.
const PRINTED: [(&str, &str); 7] = [
    ("estimate", "params"),
    ("inspect", "inspect"),
    ("batch", "batch-line"),
    ("calibrate", "calibration"),
    ("combine", "combine"),
    ("simulate", "simulate"),
    ("convert", "convert"),
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A folder in which `fixtures` lies, and the program in it.
struct Bench(tempfile::TempDir);

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::os::unix::fs::symlink(root().join("fixtures"), folder.path().join("fixtures"))
            .unwrap();
        Self(folder)
    }

    fn at(&self, path: &str) -> std::path::PathBuf {
        self.0.path().join(path)
    }

    fn run(&self, line: &str) -> (Option<i32>, String) {
        let mut program = program::program();
        let run =
            program.args(line.split_whitespace()).current_dir(self.0.path()).output().unwrap();
        assert!(
            run.status.code().is_some_and(|code| [0, 3, 4].contains(&code)),
            "{line}: {}",
            String::from_utf8_lossy(&run.stderr)
        );
        (run.status.code(), String::from_utf8(run.stdout).unwrap())
    }

    /// What a command prints fits a schema.
    fn prints(&self, schema: &str, line: &str) -> Value {
        let (_, text) = self.run(line);
        let document = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{line}: {e}"));
        must_fit(schema, &document);
        document
    }
}

#[test]
fn scans_rims_and_drapes_are_answered_as_their_schemas_say() {
    let bench = Bench::new();
    let scan = "fixtures/scans/stiff_structured-light.ply";
    let printed = &job("stiff_structured-light").result;
    must_fit("params", printed);
    assert!(
        printed["released_drape"].is_object() && printed["tied_drape"].is_null(),
        "{printed:#}"
    );
    bench.prints("params", &format!("{scan} --density 260 --quick --warp-toward 30 --json"));
    // a rim from a file: no quality, weft and warp unknown or known
    let rim =
        bench.prints("params", "fixtures/drapes/woven.boundary.csv --density 180 --quick --json");
    assert!(rim["quality"].is_null() && rim["read"].is_null());
    bench.prints("inspect", &format!("inspect {scan} --unit mm --json"));
    bench.prints(
        "simulate",
        "simulate --params fixtures/drapes/mean.params.json --vertices 21 --out d.obj --json",
    );
    bench.run("augment d.obj --profile structured-light --as depth --out aug");
    must_fit("views", &json(&bench.at("aug/d-0/views.json")));
    must_fit("truth", &json(&bench.at("aug/d-0.truth.json")));
    for entry in std::fs::read_dir(root().join("fixtures/scans")).unwrap() {
        let path = entry.unwrap().path();
        if path.to_string_lossy().ends_with(".truth.json") {
            must_fit("truth", &json(&path));
        }
    }
}

#[test]
fn batches_combinations_and_fabrics_elsewhere_are_as_their_schemas_say() {
    let bench = Bench::new();
    std::fs::create_dir(bench.at("scans")).unwrap();
    std::fs::write(bench.at("scans/few.xyz"), "0 0 0\n1 0 0\n0 1 0\n").unwrap();
    std::fs::write(bench.at("scans/none.ply"), "no scan").unwrap();
    for name in ["a", "b"] {
        let rim = root().join("fixtures/drapes/woven.boundary.csv");
        std::fs::copy(rim, bench.at(&format!("scans/{name}.csv"))).unwrap();
    }
    std::fs::write(
        bench.at("densities.csv"),
        "file,density_g_m2\na.csv,180\nb.csv,181\nfew.xyz,100\n",
    )
    .unwrap();
    let (code, printed) = bench
        .run("batch scans --density-csv densities.csv --quick --out results --no-report --json");
    assert_eq!(code, Some(3));
    let files = ["results/results.jsonl", "results/journal.jsonl"]
        .map(|file| std::fs::read_to_string(bench.at(file)).unwrap());
    let mut ended = BTreeSet::new();
    for line in printed.lines().chain(files.iter().flat_map(|text| text.lines())) {
        let row: Value = serde_json::from_str(line).unwrap();
        must_fit("batch-line", &row);
        ended.insert(row["status"].as_str().unwrap().to_owned());
    }
    // `usage` too: none.ply has no density
    assert_eq!(ended.iter().map(String::as_str).collect::<Vec<_>>(), ["ok", "refused", "usage"]);

    let files = "results/files/a.csv.params.json results/files/b.csv.params.json";
    let printed = bench.prints("combine", &format!("combine {files} --out fabric.json --json"));
    assert_eq!(printed, json(&bench.at("fabric.json")));
    bench.prints("combine", "combine results/files/a.csv.params.json --json");
    bench.prints("convert", "convert 0.0114 gfcm2/cm --to uNm --json");
    bench.prints("convert", "convert fabric.json --json");
    bench.prints("convert", "convert fixtures/formats/invented.u3m --json");
    for from in
        ["fabric.json", "results/files/a.csv.params.json", "fixtures/drapes/woven.params.json"]
    {
        bench.run(&format!("export {from} --to json --out e.json --force"));
        must_fit("export-json", &json(&bench.at("e.json")));
    }
    must_fit("dataset", &json(&root().join("fixtures/rims/manifest.json")));
}

/// `tests/job/refine.rs` holds what a refined answer writes, `tests/job/report_page.rs` what
/// `calibrate` writes.
#[test]
fn every_verb_with_json_has_a_schema_and_every_schema_an_example() {
    let bench = Bench::new();
    let (_, help) = bench.run("--help");
    let verbs = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let verbs = verbs.take_while(|line| !line.is_empty()).filter_map(|line| {
        let is_entry = line.starts_with("  ") && !line.starts_with("   ");
        line.split_whitespace().next().filter(|_| is_entry)
    });
    let verbs: BTreeSet<&str> = verbs.collect();
    assert!(verbs.len() > 14, "{verbs:?}");
    let has_json = |verb: &str| bench.run(&format!("{verb} --help")).1.contains("      --json");
    let with: BTreeSet<&str> =
        verbs.into_iter().filter(|verb| *verb != "help" && has_json(verb)).collect();
    assert_eq!(with, PRINTED.iter().map(|(verb, _)| *verb).collect());
    let names = names();
    for (_, schema) in PRINTED {
        assert!(names.iter().any(|name| name == schema), "{schema}");
    }
    let examples: BTreeSet<String> = examples().into_iter().map(|(schema, ..)| schema).collect();
    assert_eq!(examples, names.into_iter().collect());
}

/// Schema, file and content of each example; `NAME.VARIANT.json` is one of NAME.
fn examples() -> Vec<(String, String, Value)> {
    let entries = std::fs::read_dir(folder().join("examples")).unwrap();
    let mut examples: Vec<_> = entries
        .map(|entry| {
            let path = entry.unwrap().path();
            let file = path.file_name().unwrap().to_string_lossy().into_owned();
            (file.split('.').next().unwrap().to_owned(), file, json(&path))
        })
        .collect();
    examples.sort_by(|a, b| a.1.cmp(&b.1));
    examples
}

/// Every place in a document, as pointers; of a list of numbers the first.
fn places(value: &Value, place: &str, all: &mut Vec<String>) {
    all.push(place.to_owned());
    let below: Vec<(String, &Value)> = match value {
        Value::Object(object) => object.iter().map(|(k, v)| (k.clone(), v)).collect(),
        Value::Array(entries) => {
            let numbers = entries.iter().all(|entry| entry.is_number());
            let shown = if numbers { entries.len().min(1) } else { entries.len() };
            entries[..shown].iter().enumerate().map(|(k, v)| (k.to_string(), v)).collect()
        }
        _ => Vec::new(),
    };
    for (step, value) in below {
        let step = step.replace('~', "~0").replace('/', "~1");
        places(value, &format!("{place}/{step}"), all);
    }
}

/// Each kind of fault: how many there are, and how many are refused.
type Verdicts = BTreeMap<&'static str, [usize; 2]>;

/// A document with one fault after the other; the same list as in scripts/check_schemas.py.
fn planted(schema: &str, document: &Value) -> Verdicts {
    let others = [
        ("string", json!("a")),
        ("number", json!(0.5)),
        ("null", Value::Null),
        ("object", json!({ "odd": 1 })),
    ];
    let mut verdicts = Verdicts::new();
    let mut tell = |kind, changed: &Value| {
        let of = verdicts.entry(kind).or_insert([0, 0]);
        of[0] += 1;
        of[1] += usize::from(!faults(schema, changed).is_empty());
    };
    let mut all = Vec::new();
    places(document, "", &mut all);
    for place in &all {
        let mut changed = document.clone();
        if let Some(object) = changed.pointer_mut(place).unwrap().as_object_mut() {
            let keys: Vec<String> = object.keys().cloned().collect();
            object.insert("not_a_key".into(), 1.into());
            tell("one more key", &changed);
            for key in keys {
                let mut changed = document.clone();
                changed.pointer_mut(place).unwrap().as_object_mut().unwrap().remove(&key);
                tell("one key less", &changed);
            }
        }
        for (kind, other) in others.iter().filter(|_| !place.is_empty()) {
            let mut changed = document.clone();
            *changed.pointer_mut(place).unwrap() = other.clone();
            tell(kind, &changed);
        }
    }
    verdicts
}

#[test]
fn planted_faults_are_refused_exactly_where_the_reference_implementation_refuses_them() {
    let mut found = String::from("example, kind of fault, planted, refused\n");
    for (schema, file, document) in examples() {
        must_fit(&schema, &document);
        for (kind, [planted, refused]) in planted(&schema, &document) {
            found += &format!("{file}, {kind}, {planted}, {refused}\n");
            assert!(refused > 0, "{file}: no fault of the kind `{kind}` is refused");
        }
    }
    let path = root().join("tests/schema_support/verdicts.txt");
    let expected = std::fs::read_to_string(path).unwrap();
    assert_eq!(found, expected, "after a change of a schema run scripts/check_schemas.py --write");
}

#[test]
fn a_missing_key_a_wrong_type_and_an_unknown_key_are_named_with_their_place() {
    let (_, _, params) = examples().into_iter().find(|(_, file, _)| file == "params.json").unwrap();
    let said = |change: &dyn Fn(&mut Value)| {
        let mut changed = params.clone();
        change(&mut changed);
        faults("params", &changed).join("\n")
    };
    let missing = said(&|v| drop(v["density"].as_object_mut().unwrap().remove("unit")));
    assert_eq!(missing, "/density: `unit` is missing");
    let wrong = said(&|v| v["parameters"]["shear"]["value"] = json!("70964"));
    assert!(wrong.starts_with("/parameters/shear/value: \"70964\" is against type"), "{wrong}");
    let unknown = said(&|v| v["verdict"]["colour"] = json!("green"));
    assert_eq!(unknown, "/verdict/colour: no key of this object");
    let version = said(&|v| v["schema_version"] = json!(4));
    assert!(version.contains("against const: 3"), "{version}");
}

/// Walks the properties of a schema.
fn properties(value: &Value, place: &str, tell: &mut dyn FnMut(&str, &Value)) {
    let Some(object) = value.as_object() else {
        for (k, entry) in value.as_array().into_iter().flatten().enumerate() {
            properties(entry, &format!("{place}/{k}"), tell);
        }
        return;
    };
    for (key, part) in object {
        let place = format!("{place}/{key}");
        if matches!(key.as_str(), "properties" | "$defs") {
            for (name, part) in part.as_object().unwrap() {
                tell(&format!("{place}/{name}"), part);
                properties(part, &format!("{place}/{name}"), tell);
            }
        } else {
            properties(part, &place, tell);
        }
    }
}

#[test]
fn every_field_is_described_and_every_number_has_its_unit() {
    for name in names() {
        let schema = schema(&name);
        assert!(schema["$schema"].as_str().unwrap().contains("2020-12"), "{name}");
        let mut undescribed = Vec::new();
        properties(schema, &name, &mut |place, part| {
            let says = part["description"].as_str().unwrap_or_default();
            let kinds = [&part["type"], &part["items"]["type"]].map(ToString::to_string).concat();
            let is_number = kinds.contains("number") || kinds.contains("integer");
            let has_unit = says.contains('[') && says.contains(']');
            if says.len() < 5 || is_number && !has_unit {
                undescribed.push(format!("{place}: {says}"));
            }
        });
        assert!(undescribed.is_empty(), "{undescribed:#?}");
    }
}

#[test]
fn every_ground_of_a_verdict_is_in_the_schema_and_in_the_formats() {
    let text = |file: &str| std::fs::read_to_string(root().join("docs").join(file)).unwrap();
    let (schema, formats) = (text("schemas/params.schema.json"), text("formats.md"));
    for name in Code::ALL.iter().map(|code| code.name()) {
        assert!(schema.contains(&format!("\"{name}\"")), "{name}");
        assert!(formats.contains(&format!("`{name}`")), "{name}");
    }
}
