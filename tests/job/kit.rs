//! The kit's files, read back: lengths in SVG and PDF, the parts as the package's own reader sees
//! them, tables by the readers that take them, limits against what a refused scan says, and the
//! stand under a drape before a virtual scanner.

use crate::program;
use std::collections::HashMap;
use std::fs;
use std::path::Path;
use std::process::Output;

use scan2params::base::Point3;
use scan2params::calibrate::manifest::{self, Face, Role};
use scan2params::dataset::drapes::dataset_options;
use scan2params::fabric::params;
use scan2params::geom::Mesh;
use scan2params::kit::{self, Bench, File, Kind, Mark, checklist::checklist, solid};
use scan2params::scan::{ScanError, ScanOptions};
use scan2params::sensor::{self, Profile, Scene, Stand, default_ring};
use scan2params::sim::{Drop, DropStart, drape};
use scan2params::{boundary_from_scan, read_scan};

fn files(kind: Kind) -> HashMap<String, Vec<u8>> {
    let mark = Mark { name: "red".to_owned(), ink: [220, 40, 40] };
    kit::files(kind, &mark).into_iter().map(|File { name, bytes }| (name, bytes)).collect()
}

fn program(line: &str) -> Output {
    let mut command = program::program();
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(line.split_whitespace());
    command.output().unwrap()
}

fn said(run: &Output) -> String {
    String::from_utf8_lossy(&run.stderr).into_owned()
}

// ---- SVG

/// Points of the path with an id [mm]; the document's user unit must be a millimetre.
struct Svg(String);

impl Svg {
    fn with<T>(&self, id: &str, read: impl Fn(roxmltree::Node) -> T) -> T {
        let document = roxmltree::Document::parse(&self.0).unwrap();
        let root = document.root_element();
        let number = |name: &str| -> f64 {
            root.attribute(name).unwrap().strip_suffix("mm").unwrap().parse().unwrap()
        };
        let view = format!("0 0 {} {}", number("width"), number("height"));
        assert_eq!(root.attribute("viewBox"), Some(view.as_str()));
        let node = document.descendants().find(|n| n.attribute("id") == Some(id));
        read(node.unwrap_or_else(|| panic!("no `{id}`")))
    }

    fn points(&self, id: &str) -> Vec<[f64; 2]> {
        self.with(id, |node| {
            let path = node.attribute("d").unwrap().replace(['M', 'L', 'Z'], " ");
            let numbers: Vec<f64> = path.split_whitespace().map(|n| n.parse().unwrap()).collect();
            numbers.as_chunks::<2>().0.to_vec()
        })
    }

    fn circle(&self, id: &str) -> [f64; 3] {
        self.with(id, |node| ["cx", "cy", "r"].map(|a| node.attribute(a).unwrap().parse().unwrap()))
    }
}

fn svg(files: &HashMap<String, Vec<u8>>, name: &str) -> Svg {
    Svg(String::from_utf8(files[name].clone()).unwrap())
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[test]
fn the_templates_have_their_lengths_as_svg() {
    let files = files(Kind::Square);
    let specimen = svg(&files, "specimen.svg");
    let cut = specimen.points("cut");
    assert_eq!(cut.len(), 4);
    for k in 0..4 {
        assert!((distance(cut[k], cut[(k + 1) % 4]) - 300.0).abs() < 1e-3);
    }
    assert!((distance(cut[0], cut[2]) - distance(cut[1], cut[3])).abs() < 1e-3);
    let [x, y, radius] = specimen.circle("plate");
    assert!((radius - 50.0).abs() < 1e-3);
    // the plate's centre is the square's
    for corner in &cut {
        assert!((distance(*corner, [x, y]) - 212.132).abs() < 1e-2);
    }
    // the mark: 12 inwards from the middle of the side to which the warp points, 80 along it
    let mark = specimen.points("mark");
    let ends = |k: usize| {
        let of = || mark.iter().map(|p| p[k]);
        [of().fold(f64::INFINITY, f64::min), of().fold(0.0, f64::max)]
    };
    let ([left, right], [top, bottom]) = (ends(0), ends(1));
    assert!((right - left - 12.0).abs() < 1e-3 && (bottom - top - 80.0).abs() < 1e-3);
    assert!((right - cut[1][0]).abs() < 1e-3 && (0.5 * (top + bottom) - y).abs() < 1e-3);

    let card = svg(&files, "placement.svg");
    assert!((card.circle("hole")[2] - 51.0).abs() < 1e-3);
    let cloth = card.points("cloth");
    assert!((distance(cloth[0], cloth[1]) - 300.0).abs() < 1e-3);
    assert!(
        (distance(cloth[0], card.circle("hole").first_chunk().copied().unwrap()) - 212.132).abs()
            < 1e-2
    );
    let edge = card.points("card");
    assert!((distance(edge[0], edge[1]) - 340.0).abs() < 1e-3);

    let cusick = self::files(Kind::Cusick);
    let disc = svg(&cusick, "specimen.svg");
    assert!(
        (disc.circle("cut")[2] - 150.0).abs() < 1e-3
            && (disc.circle("plate")[2] - 90.0).abs() < 1e-3
    );
    assert!((svg(&cusick, "placement.svg").circle("hole")[2] - 91.0).abs() < 1e-3);
    let target = svg(&cusick, "target.svg").points("target");
    assert!((distance(target[0], target[1]) - 120.0).abs() < 1e-3);
}

#[test]
fn the_drawing_is_of_the_parts_that_are_printed() {
    for kind in [Kind::Square, Kind::Cusick] {
        let files = files(kind);
        let bench = Bench::of(kind);
        let stand = svg(&files, "stand.svg");
        let wide = |id: &str| {
            let points = stand.points(id);
            let of = || points.iter().map(|p| p[0]);
            of().fold(0.0, f64::max) - of().fold(f64::INFINITY, f64::min)
        };
        for part in solid::parts(&bench) {
            let [radius_m, _] = part.extent_m();
            // at a scale of 1:2 the width on paper is the radius
            assert!((wide(part.name) - 1e3 * radius_m).abs() < 1e-3, "{}", part.name);
        }
        assert!((wide("ruler-100-mm") - 100.0).abs() < 1e-3);
        assert!((wide("ruler-1-inch") - 25.4).abs() < 1e-3);
        // its numbers are those of the parts
        let text = &stand.0;
        let height = format!(">{:.1}<", 1e3 * bench.top_m());
        assert!(text.contains(&height) && text.contains(">R 2.0 all round<"), "{height}");
    }
}

// ---- PDF

/// A page of a PDF whose content is not compressed.
struct Page {
    size_mm: [f64; 2],
    /// Subpaths that are painted, mm from the upper left corner.
    paths: Vec<Vec<[f64; 2]>>,
    texts: Vec<String>,
}

/// Reads what these tests need of a PDF: page sizes, and paths through the current transformation.
fn pages(bytes: &[u8]) -> Vec<Page> {
    let text: String = bytes.iter().map(|&b| char::from(b)).collect();
    let numbers = |text: &str| -> Vec<f64> {
        text.split(|c: char| c.is_whitespace() || c == '[').filter_map(|n| n.parse().ok()).collect()
    };
    let mut sizes = text.split("/MediaBox").skip(1).map(|rest| {
        let size = numbers(rest.split(']').next().unwrap());
        [size[2], size[3]].map(|points| points / 72.0 * 25.4)
    });
    let streams = text.split("stream\n").skip(1).step_by(2);
    streams
        .map(|stream| page(stream.split("\nendstream").next().unwrap(), sizes.next().unwrap()))
        .collect()
}

fn page(content: &str, size_mm: [f64; 2]) -> Page {
    let mut page = Page { size_mm, paths: Vec::new(), texts: Vec::new() };
    let (mut matrix, mut kept) = ([1.0, 0.0, 0.0, 1.0, 0.0, 0.0], Vec::new());
    let (mut stack, mut path): (Vec<f64>, Vec<Vec<[f64; 2]>>) = (Vec::new(), Vec::new());
    let mm = 25.4 / 72.0;
    for line in content.lines() {
        if let Some(words) = line.strip_suffix(" Tj") {
            page.texts.push(words.trim_matches(['(', ')']).replace("\\(", "(").replace("\\)", ")"));
            continue;
        }
        for word in line.split_whitespace() {
            if let Ok(number) = word.parse() {
                stack.push(number);
                continue;
            }
            let at = |m: [f64; 6], x: f64, y: f64| {
                let (px, py) = (m[0] * x + m[2] * y + m[4], m[1] * x + m[3] * y + m[5]);
                [px * mm, size_mm[1] - py * mm]
            };
            match word {
                "q" => kept.push(matrix),
                "Q" => matrix = kept.pop().unwrap(),
                "cm" => {
                    let [a, b, c, d, e, f] = stack[..6].try_into().unwrap();
                    let m = matrix;
                    matrix = [
                        m[0] * a + m[2] * b,
                        m[1] * a + m[3] * b,
                        m[0] * c + m[2] * d,
                        m[1] * c + m[3] * d,
                        m[0] * e + m[2] * f + m[4],
                        m[1] * e + m[3] * f + m[5],
                    ];
                }
                "m" => path.push(vec![at(matrix, stack[0], stack[1])]),
                "l" => path.last_mut().unwrap().push(at(matrix, stack[0], stack[1])),
                "c" => path.last_mut().unwrap().push(at(matrix, stack[4], stack[5])),
                "S" | "f" | "B" => page.paths.append(&mut path),
                "n" => path.clear(),
                _ => {}
            }
            stack.clear();
        }
    }
    page
}

fn has_square(page: &Page, side: f64) -> bool {
    page.paths.iter().any(|p| {
        p.len() == 4 && (0..4).all(|k| (distance(p[k], p[(k + 1) % 4]) - side).abs() < 0.01)
    })
}

fn has_line(page: &Page, length: f64) -> bool {
    page.paths.iter().any(|p| p.len() == 2 && (distance(p[0], p[1]) - length).abs() < 1e-3)
}

fn has_circle(page: &Page, diameter: f64) -> bool {
    // eight arcs: opposite ends are a diameter apart
    page.paths.iter().any(|p| p.len() == 9 && (distance(p[0], p[4]) - diameter).abs() < 0.01)
}

#[test]
fn pages_are_at_full_size_and_can_be_checked_with_a_ruler() {
    let files = files(Kind::Square);
    for (name, size, count) in [
        ("A2", [420.0, 594.0], 2),
        ("A3", [297.0, 420.0], 4),
        ("A4", [210.0, 297.0], 8),
        ("Letter", [215.9, 279.4], 8),
    ] {
        let bytes = &files[&format!("templates-{name}.pdf")];
        assert!(String::from_utf8_lossy(bytes).contains("/PrintScaling /None"));
        let pages = pages(bytes);
        assert_eq!(pages.len(), count, "{name}");
        for (k, page) in pages.iter().enumerate() {
            assert!(
                (page.size_mm[0] - size[0]).abs() < 0.01
                    && (page.size_mm[1] - size[1]).abs() < 0.01
            );
            assert!(has_line(page, 100.0) && has_line(page, 25.4), "{name} {k}");
            assert!(has_square(page, 300.0), "{name} {k}");
            let is_card = k >= count / 2;
            assert_eq!(
                (has_square(page, 340.0), has_circle(page, 102.0)),
                (is_card, is_card),
                "{name} {k}"
            );
            assert!(has_circle(page, if is_card { 102.0 } else { 100.0 }), "{name} {k}");
        }
    }
    let cusick = self::files(Kind::Cusick);
    let discs = pages(&cusick["templates-A2.pdf"]);
    assert!(
        has_circle(&discs[0], 300.0)
            && has_circle(&discs[0], 180.0)
            && has_square(&discs[2], 120.0)
    );
}

/// The strip that two tiles share shows the same crosses: laid on each other, the drawing goes on.
#[test]
fn tiles_meet_in_their_crosses() {
    let files = files(Kind::Square);
    let tiles = pages(&files["templates-A4.pdf"]);
    // Where the square's first corner lies on each page says how far the tile is shifted.
    let corner = |page: &Page| {
        let square = page.paths.iter().find(|p| {
            p.len() == 4 && (0..4).all(|k| (distance(p[k], p[(k + 1) % 4]) - 300.0).abs() < 0.01)
        });
        square.unwrap()[0]
    };
    let shift = [0, 1].map(|k| corner(&tiles[0])[k] - corner(&tiles[1])[k]);
    assert!((shift[0] - 180.0).abs() < 0.01 && shift[1].abs() < 0.01, "{shift:?}");
    let down = [0, 1].map(|k| corner(&tiles[0])[k] - corner(&tiles[2])[k]);
    assert!(down[0].abs() < 0.01 && (down[1] - 249.0).abs() < 0.01, "{down:?}");
    let crosses = |page: &Page, x: f64| {
        let circles =
            page.paths.iter().filter(|p| p.len() == 9 && (distance(p[0], p[4]) - 4.0).abs() < 1e-3);
        circles.filter(|p| (0.5 * (p[0][0] + p[4][0]) - x).abs() < 0.01).count()
    };
    // 10 mm of margin; the shared strip is the last 10 of 190 mm on the left tile, the first on the
    // right one
    assert_eq!((crosses(&tiles[0], 195.0), crosses(&tiles[1], 15.0)), (4, 4));
    let titles: Vec<bool> =
        tiles.iter().map(|p| p.texts.iter().any(|t| t.contains("row 2 of 2"))).collect();
    assert_eq!(titles, [false, false, true, true, false, false, true, true]);
}

// ---- STL

/// How often each edge is run through in each direction, and the volume [file units].
fn closed_volume(points: &[Point3], triangles: &[[u32; 3]]) -> f64 {
    let mut runs: HashMap<[u32; 2], i32> = HashMap::new();
    for t in triangles {
        for k in 0..3 {
            let [a, b] = [t[k], t[(k + 1) % 3]];
            assert!(a != b, "a triangle without area");
            *runs.entry([a, b]).or_default() += 1;
        }
    }
    for ([a, b], count) in &runs {
        assert_eq!(
            (*count, runs.get(&[*b, *a])),
            (1, Some(&1)),
            "an edge that is not shared by two"
        );
    }
    let corner = |v: u32| points[v as usize].coords;
    triangles.iter().map(|&[a, b, c]| corner(a).dot(&corner(b).cross(&corner(c))) / 6.0).sum()
}

#[test]
fn parts_are_closed_and_have_radius_and_volume_in_millimetres() {
    let folder = tempfile::tempdir().unwrap();
    for kind in [Kind::Square, Kind::Cusick] {
        let bench = Bench::of(kind);
        let files = files(kind);
        for part in solid::parts(&bench) {
            let name = format!("{}.stl", part.name);
            let path = folder.path().join(&name);
            fs::write(&path, &files[&name]).unwrap();
            let (cloud, _) = read_scan(&path).unwrap();
            let volume_mm3 = closed_volume(&cloud.points, &cloud.triangles);
            let share = volume_mm3 / (1e9 * part.volume_m3());
            assert!((0.9997..1.0).contains(&share), "{name}: {share}");
            let [radius_m, height_m] = part.extent_m();
            let radius = cloud.points.iter().map(|p| p.x.hypot(p.y)).fold(0.0, f64::max);
            let [low, high] =
                [f64::min, f64::max].map(|f| cloud.points.iter().map(|p| p.z).fold(0.0, f));
            assert!((radius - 1e3 * radius_m).abs() < 1e-4, "{name}: {radius}");
            assert!(low == 0.0 && (high - 1e3 * height_m).abs() < 1e-4, "{name}");
            // stands on a flat face
            let below = cloud.points.iter().filter(|p| p.z == 0.0).count();
            assert!(below >= solid::AROUND, "{name}");
        }
    }
}

/// A part at its place under the plate's top, simulation frame [m].
fn placed(part: &solid::Part, foot_m: f64, upside_down: bool, into: &mut Mesh) {
    let first = into.vertices.len() as u32;
    let mesh = part.mesh();
    let sign = if upside_down { -1.0 } else { 1.0 };
    into.vertices
        .extend(mesh.vertices.iter().map(|p| Point3::new(p.x, foot_m + sign * p.z, sign * -p.y)));
    into.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + first)));
}

/// The drape of a fixture's fabric on the printed parts, scanned: the rim is found as well as on
/// the stand that the fixtures have.
#[test]
fn a_drape_on_the_printed_stand_is_answered() {
    let stiff = Path::new("fixtures/drapes/stiff.params.json");
    let fabric = params::fabric(stiff, [None; 7]).unwrap();
    let made = drape(&fabric, &Drop { start: DropStart::Perturbed(2) }, &dataset_options());
    let bench = Bench::of(Kind::Square);
    let parts = solid::parts(&bench);
    let by_name = |name: &str| parts.iter().find(|part| part.name == name).unwrap();
    let mut mesh = made.mesh();
    let middle = -bench.edge_radius_m;
    placed(by_name("plate-top"), middle, false, &mut mesh);
    placed(by_name("plate-bottom"), middle, true, &mut mesh);
    let below = -bench.plate_m() - bench.post_piece_m;
    placed(by_name("post-upper"), below, false, &mut mesh);
    placed(by_name("post-lower"), below - bench.post_piece_m, false, &mut mesh);
    placed(by_name("base"), -bench.top_m(), false, &mut mesh);
    // The mesh is the stand: what the scene adds is the table, and a needle inside the post.
    let stand = Stand {
        plate_radius_m: 1.1e-3,
        plate_thickness_m: 1.0e-4,
        pedestal_radius_m: 1.0e-3,
        floor_y_m: -bench.top_m() - 2.0e-4,
        floor_radius_m: 0.4,
        ..Stand::MODIFIED_CUSICK
    };
    let scenes = [Scene::modified_cusick(made.mesh()), Scene::on(mesh, stand)];
    let profile = Profile::named("structured-light").unwrap();
    let off_mm = scenes.each_ref().map(|scene| {
        let scan = sensor::scan(scene, &default_ring(), &profile, 11).unwrap();
        let found = boundary_from_scan(&scan.cloud, &ScanOptions::default()).unwrap();
        // Which side the warp runs to was not said.
        let turned = (0..4).map(|quarters| found.boundary.rotated(quarters));
        turned.map(|rim| 1e3 * rim.mean_distance_m(&made.boundary)).fold(f64::INFINITY, f64::min)
    });
    println!("{:.2} mm, on the fixtures' stand {:.2}", off_mm[1], off_mm[0]);
    assert!(off_mm[1] < off_mm[0] + 0.2, "{off_mm:?}");
}

// ---- tables and text

#[test]
fn example_tables_are_read_by_those_that_they_are_for() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("cusick");
    let run = program(&format!("kit --bench cusick --out {}", out.display()));
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    let entries = manifest::read(out.join("manifest.example.csv")).unwrap();
    assert_eq!(entries.len(), 5);
    assert!(
        entries.iter().any(|e| e.role == Role::Holdout)
            && entries.iter().any(|e| e.face == Some(Face::Down))
    );
    assert_eq!(entries[0].pixel_m, Some(0.2143e-3));

    let out = folder.path().join("square");
    let run = program(&format!("kit --out {} --quiet", out.display()));
    assert_eq!((run.status.code(), said(&run)), (Some(0), String::new()));
    let listed = String::from_utf8(run.stdout).unwrap();
    let listed: Vec<&str> = listed.lines().collect();
    assert_eq!(listed.len(), fs::read_dir(&out).unwrap().count());
    assert!(listed.iter().all(|path| Path::new(path).is_file()));
    // Scans named as the protocol says, with its table: `batch` finds a density for each.
    let scans = folder.path().join("scans");
    fs::create_dir(&scans).unwrap();
    let table = fs::read_to_string(out.join("densities.example.csv")).unwrap();
    for row in table.lines().filter(|row| row.contains(".ply")) {
        fs::write(scans.join(row.split(',').next().unwrap()), "x").unwrap();
    }
    let table = out.join("densities.example.csv");
    let run =
        program(&format!("batch {} --density-csv {} --dry-run", scans.display(), table.display()));
    let planned = String::from_utf8(run.stdout.clone()).unwrap();
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    assert_eq!(planned.matches(": 182.5 g/m^2").count(), 5, "{planned}");
}

/// What is refused carries the limits that the protocol prints.
#[test]
fn refused_scans_name_the_limits_of_the_protocol() {
    let text = String::from_utf8(files(Kind::Square)["protocol.md"].clone()).unwrap();
    let (cloud, _) = read_scan("fixtures/scans/stiff_structured-light.ply").unwrap();
    let refused = |change: &dyn Fn(&mut Vec<Point3>)| {
        let mut changed = cloud.clone();
        changed.colors.clear();
        change(&mut changed.points);
        boundary_from_scan(&changed, &ScanOptions::default()).unwrap_err()
    };
    let mut limits = vec![];
    match refused(&|points| points.truncate(1000)) {
        ScanError::TooFewPoints { limit, .. } => {
            limits.push(format!("fewer than {limit} usable points"))
        }
        other => panic!("{other}"),
    }
    match refused(&|points| points.iter_mut().for_each(|p| *p *= 1.08)) {
        ScanError::WrongSize { least_mm, .. } => limits.push(format!("less than {least_mm:.1} or")),
        other => panic!("{other}"),
    }
    // a sector of the hanging cloth is gone, seen from the plate's axis in the scanner's frame
    let up = boundary_from_scan(&cloud, &ScanOptions::default()).unwrap().quality.up;
    let up = scan2params::Vector3::from(up);
    let middle = cloud.points.iter().fold(scan2params::Vector3::zeros(), |sum, p| sum + p.coords)
        / cloud.points.len() as f64;
    let side = up.cross(&scan2params::Vector3::new(0.31, 0.74, -0.59)).normalize();
    match refused(&|points| points.retain(|p| (p.coords - middle).dot(&side) < 0.12)) {
        ScanError::Gap { limit_mm, .. } => {
            limits.push(format!("longer than {limit_mm:.0} mm out of sight"))
        }
        ScanError::TooLittleRim { limit_percent, .. } => {
            limits.push(format!("less than {limit_percent:.0} % of the rim seen"))
        }
        ScanError::HiddenRim { limit_percent, .. } => {
            limits.push(format!("on more than {limit_percent:.0} % of the bearings"))
        }
        other => panic!("{other}"),
    }
    for limit in &limits {
        assert!(text.contains(limit), "{limit} is not in the protocol");
    }
    for item in checklist(&ScanOptions::default()) {
        assert!(text.contains(&item.refused), "{}", item.code);
    }
}

#[test]
fn a_kit_goes_where_it_may() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "x").unwrap();
    let run = program(&format!("kit --out {}", file.display()));
    assert_eq!(run.status.code(), Some(2), "{}", said(&run));
    assert!(said(&run).contains("is a file; give a folder"), "{}", said(&run));
    let run = program(&format!("kit --out {} --mark grey", folder.path().display()));
    assert_eq!(run.status.code(), Some(2), "{}", said(&run));
    let out = folder.path().join("blue");
    let run = program(&format!("kit --out {} --mark blue", out.display()));
    assert_eq!(run.status.code(), Some(0), "{}", said(&run));
    let protocol = fs::read_to_string(out.join("protocol.md")).unwrap();
    assert!(protocol.contains("--mark blue") && protocol.contains("paint in blue"), "{protocol}");
    assert!(!protocol.contains("--mark red"), "{protocol}");
}
