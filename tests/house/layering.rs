//! The walls inside `src` and `lab/src`, held: no upward import, no circle between files, and no
//! printing below `terminal`.
//!
//! `layering_support` says what is read of the sources, and what is not seen. Test
//! modules are not exempt from the order.

use std::collections::BTreeSet;
use std::fmt;

use crate::layering_support::circles::{Imports, circles, imports};
use crate::layering_support::{Source, is_root, sources, src};

/// The layers, low to high; those on one line are siblings and may not import
/// each other.
const ORDER: &[&[&str]] = &[
    &["base"],
    &["geom", "numeric"],
    &["picture"],
    &["io"],
    &["fabric"],
    &["sim"],
    &["scan"],
    &["intake"],
    &["sensor"],
    &["dataset"],
    &["estimate"],
    &["inverse"],
    &["refine", "calibrate"],
    &["job"],
    &["report"],
    &["exchange"],
    &["batch"],
    &["combine"],
    &["kit"],
    &["sealed"],
    &["evaluate"],
    &["terminal"],
    &["cli", "command"],
];

/// Those of them that are the laboratory's, in `lab/src`.
const LABORATORY: [&str; 3] = ["sealed", "evaluate", "command"];

/// Upward imports that are allowed: file, layer, reason. An entry that no longer
/// matches an import fails the test.
const EXCEPTIONS: &[(&str, &str, &str)] = &[];

/// Circles that are still there: files of which each imports every other, directly or
/// by way of the rest. Part of an entry may be gone; an entry of which nothing is left
/// fails the test.
const CIRCLES: &[&[&str]] = &[];

/// Fewer files than this means that the search went wrong.
const LEAST_FILES: usize = 50;

/// Fewer imports of one file by another mean that the search went wrong.
const LEAST_IMPORTS: usize = 300;

#[test]
fn no_layer_imports_from_above() {
    let sources = sources();
    assert!(sources.len() >= LEAST_FILES, "only {} files found", sources.len());
    let mut used = BTreeSet::new();
    let mut faults = Vec::new();
    for source in &sources {
        for fault in upward_imports(source) {
            let known =
                EXCEPTIONS.iter().position(|(f, l, _)| *f == fault.file && *l == fault.layer);
            match known {
                Some(index) => drop(used.insert(index)),
                None => faults.push(fault.to_string()),
            }
        }
    }
    assert!(faults.is_empty(), "upward imports:\n{}", faults.join("\n"));
    for (index, exception) in EXCEPTIONS.iter().enumerate() {
        assert!(used.contains(&index), "no longer needed: {exception:?}");
    }
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    let imports = imports(&sources());
    assert!(imports.len() >= LEAST_IMPORTS, "only {} imports found", imports.len());
    let found = circles(&imports);
    let known = |circle: &BTreeSet<String>| {
        CIRCLES.iter().any(|files| circle.iter().all(|file| files.contains(&file.as_str())))
    };
    let new: Vec<_> = found.iter().filter(|c| !known(c)).map(|c| described(c, &imports)).collect();
    assert!(new.is_empty(), "files that import each other:\n{}", new.join("\n"));
    for files in CIRCLES {
        let left = |circle: &BTreeSet<String>| circle.iter().all(|f| files.contains(&f.as_str()));
        assert!(found.iter().any(left), "no longer a circle, take it from CIRCLES: {files:?}");
    }
}

/// A circle with the places that make it one.
fn described(circle: &BTreeSet<String>, imports: &Imports) -> String {
    let inside = imports.iter().filter(|((a, b), _)| circle.contains(a) && circle.contains(b));
    let places = inside.map(|((file, other), at)| {
        format!("    {file}:{} names {}, which is in {other}", at.line, at.path)
    });
    format!("  {circle:?}\n{}", places.collect::<Vec<_>>().join("\n"))
}

#[test]
fn only_the_command_lines_print() {
    let sources = sources();
    let tests: BTreeSet<_> = sources.iter().flat_map(|source| &source.test_modules).collect();
    let faults: Vec<_> = sources
        .iter()
        .filter(|source| rank(source.layer()) < rank("terminal") && !source.module.is_empty())
        .filter(|source| !tests.contains(&source.module))
        .flat_map(|source| source.prints.iter().map(|line| format!("{}:{line}", source.file)))
        .collect();
    assert!(faults.is_empty(), "printed below terminal:\n{}", faults.join("\n"));
}

#[test]
fn the_order_here_is_that_of_lib_rs_and_covers_every_folder() {
    let lib = std::fs::read_to_string(src().join("lib.rs")).unwrap();
    let said = lib.replace("//!", " ").split_whitespace().collect::<Vec<_>>().join(" ");
    let library = |layer: &&str| !LABORATORY.contains(layer);
    let layers = ORDER.iter().map(|layers| layers.iter().copied().filter(library).collect());
    let layers: Vec<Vec<&str>> = layers.filter(|layers: &Vec<&str>| !layers.is_empty()).collect();
    let order = layers.iter().map(|layers| layers.join(", ")).collect::<Vec<_>>().join(" < ");
    assert!(said.contains(&format!("`{order}`")), "lib.rs does not say: {order}");
    let lab = std::fs::read_to_string(src().join("../lab/src/lib.rs")).unwrap();
    let order = LABORATORY.join(" < ");
    assert!(lab.contains(&format!("`{order}`")), "lab/src/lib.rs does not say: {order}");
    for source in sources().iter().filter(|s| !s.module.is_empty()) {
        assert!(rank(source.layer()).is_some(), "{}: not in a known layer", source.file);
        let is_there = source.file.starts_with("lab/") == LABORATORY.contains(&source.layer());
        assert!(is_there, "{}: its folder is another crate's", source.file);
    }
}

struct Fault {
    file: String,
    line: usize,
    layer: String,
    why: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: {}", self.file, self.line, self.why)
    }
}

fn rank(layer: &str) -> Option<usize> {
    ORDER.iter().position(|layers| layers.contains(&layer))
}

fn upward_imports(source: &Source) -> Vec<Fault> {
    // lib.rs and main.rs are above every layer
    let Some(own) = rank(source.layer()) else { return Vec::new() };
    let fault = |line, layer: &str, why: String| Fault {
        file: source.file.clone(),
        line,
        layer: layer.into(),
        why,
    };
    let mut faults = Vec::new();
    for (line, target) in layers_named(source) {
        match rank(&target) {
            _ if target == source.layer() => {}
            Some(other) if other < own => {}
            Some(_) => {
                faults.push(fault(line, &target, format!("{} uses {target}", source.layer())))
            }
            None => faults.push(fault(line, &target, format!("crate::{target} is not a layer"))),
        }
    }
    faults
}

/// The first segment below the crate of every path that starts with `crate`, the name of one of
/// the libraries, `self` or `super`, with its line. `*` stands for the crate as a whole.
fn layers_named(source: &Source) -> Vec<(usize, String)> {
    let relative = |path: &[String]| match path {
        [only] => ["crate", "super"].contains(&only.as_str()),
        [first, ..] => is_root(first) || ["self", "super"].contains(&first.as_str()),
        [] => false,
    };
    let named = source.mentions.iter().filter(|m| relative(&m.path));
    named.map(|m| (m.line, below_crate(&m.scope, &m.path))).collect()
}

/// The first segment below the crate of `path` as written in module `scope`.
fn below_crate(scope: &[String], path: &[String]) -> String {
    let mut at = scope.to_vec();
    for segment in path {
        match segment.as_str() {
            root if is_root(root) => at.clear(),
            "self" => {}
            "super" => drop(at.pop()),
            other => at.push(other.into()),
        }
    }
    at.into_iter().next().unwrap_or_else(|| "*".into())
}

/// The layers that a snippet in `file` uses upwards, each once.
fn caught(file: &str, text: &str) -> Vec<String> {
    let mut layers: Vec<_> =
        upward_imports(&Source::new(file, text)).into_iter().map(|f| f.layer).collect();
    layers.dedup();
    layers
}

#[test]
fn an_upward_import_is_caught_in_every_form() {
    for text in [
        "use crate::sim::Drape;",
        "use crate::{base::Boundary, sim::{Drape, Drop as Fall}, geom};",
        "use crate::{\n    base,\n    sim,\n};",
        "pub(crate) use crate::sim as other;",
        "use ::core::fmt; fn f() -> crate::sim::Drape { todo!() }",
        "fn f() { let x = 'c'; g::<crate :: sim::Drape>(\"crate::cli\") }",
        "use super::super::sim;",
        "#[cfg(test)]\nmod tests { use crate::sim::drape; }",
        "mod inner { use super::super::super::sim::Drape; }",
        "fn f<'a>(x: &'a str) -> crate::sim::Drape { x }",
        "/* crate::cli /* nested */ crate::cli */ use crate::sim;",
    ] {
        assert_eq!(caught("src/io/ply.rs", text), ["sim"], "{text}");
    }
    assert_eq!(caught("src/base/mod.rs", "use crate::{io::{self, Fault}, sim};"), ["io", "sim"]);
}

#[test]
fn the_crate_as_a_whole_and_unknown_layers_are_caught() {
    assert_eq!(caught("src/io/ply.rs", "use crate::*;"), ["*"]);
    assert_eq!(caught("src/io/ply.rs", "use crate as all;"), ["*"]);
    assert_eq!(caught("src/io/mod.rs", "use super::*;"), ["*"]);
    assert_eq!(caught("src/io/ply.rs", "use crate::{self, base};"), ["*"]);
    assert_eq!(caught("src/io/ply.rs", "use crate::elsewhere::X;"), ["elsewhere"]);
}

#[test]
fn what_calibrates_may_not_know_of_sealed_cases() {
    for text in ["use crate::sealed::Case;", "fn f() { let _ = crate::sealed::read(x); }"] {
        assert_eq!(caught("src/calibrate/run.rs", text), ["sealed"], "{text}");
        assert!(caught("lab/src/evaluate/calibrate.rs", text).is_empty(), "{text}");
    }
    // In the laboratory's crate as in the library's, by whatever name it is called.
    assert_eq!(caught("lab/src/sealed/make.rs", "use crate::evaluate::scan;"), ["evaluate"]);
    assert_eq!(
        caught("lab/src/evaluate/scan.rs", "use scan2params::terminal::print;"),
        ["terminal"]
    );
}

#[test]
fn siblings_may_not_import_each_other() {
    assert_eq!(caught("src/geom/mesh.rs", "use crate::numeric::robust;"), ["numeric"]);
    assert_eq!(caught("src/numeric/robust.rs", "use crate::geom::Mesh;"), ["geom"]);
}

#[test]
fn what_is_no_upward_import_passes() {
    for text in [
        "//! crate::cli\n// use crate::sim;\n/// [`crate::sim`]\nstruct S;",
        "/* crate::sim */",
        r##"const A: &str = "crate::sim"; const B: &str = r#"" crate::sim"#;"##,
        "use crate::{base::{Boundary, units}, geom::Mesh, io};",
        "use super::{error::At, tokens}; use self::inner::X; use super::super::io::Fault;",
        "pub(crate) fn f(self) {} pub(super) struct S; pub(in crate::io) struct T;",
        "mod tests { use super::super::error; use super::*; use super::super::super::base; }",
        "fn f() { let q = '\\''; let c = '\"'; } // \" crate::sim",
        "use other::sim; use sim::x; use other::{crate_sim, sim};",
    ] {
        assert!(caught("src/io/ply.rs", text).is_empty(), "{text}");
    }
    assert!(caught("src/lib.rs", "pub use crate::sim::drape;").is_empty());
}

const NONE: [usize; 0] = [];

#[test]
fn printing_is_caught_outside_tests_only() {
    let lines = |text: &str| Source::new("src/sim/drape.rs", text).prints;
    assert_eq!(lines("fn f() {\n    println!(\"x\");\n}"), [2]);
    assert_eq!(lines("#[cfg(test)]\nmod tests { fn f() { println!() } }\nfn g() { dbg!(1) }"), [3]);
    assert_eq!(lines("#[cfg(test)]\n#[allow(x)]\nfn f() { eprintln!() }"), NONE);
    assert_eq!(lines("#[cfg(test)]\nuse a::{b, c};\nfn f() { eprint!() }"), [3]);
    assert_eq!(lines("#[cfg(feature)]\nfn f() { print!() }"), [2]);
    assert_eq!(lines("#[cfg(all(test, unix))]\nfn f() { print!() }"), NONE);
    assert_eq!(lines("fn f() { std::println!() }\nfn g() { maybe!(x => println!()) }"), [1, 2]);
    assert_eq!(lines("impl A {\n    #[cfg(test)]\n    fn f() { print!() }\n}"), NONE);
    assert_eq!(lines("// println!()\nfn f() { writeln!(o, \"print!\") }"), NONE);
    let text = "#[cfg(test)]\nmod tests;\nmod b;";
    let files = Source::new("src/sim/contact.rs", text).test_modules;
    assert_eq!(files, [["sim", "contact", "tests"]]);
}

/// The circles among made-up files below `src`, without their folder.
fn circles_of(files: &[(&str, &str)]) -> Vec<Vec<String>> {
    let root = ("src/lib.rs", "pub mod sim;");
    let all = files.iter().chain([&root]);
    let sources: Vec<_> = all.map(|(f, text)| Source::new(f, text)).collect();
    let short = |file: String| file.trim_start_matches("src/sim/").to_owned();
    circles(&imports(&sources)).into_iter().map(|c| c.into_iter().map(short).collect()).collect()
}

#[test]
fn a_circle_is_caught_in_every_form() {
    let a_needs_b = "use super::b::B; pub struct A; pub fn g() {}";
    for (parent, b) in [
        ("mod a; mod b;", "use crate::sim::a::A; pub struct B;"),
        ("mod a; mod b;", "pub struct B(super::a::A);"),
        ("mod a; mod b;", "use super::a; pub struct B; fn f() { a::g() }"),
        ("mod a; mod b;", "pub struct B; fn f() { assert!(x, \"{}\", super::a::g()) }"),
        ("mod a; mod b;", "#[error(\"{}\", super::a::g())] pub struct B;"),
        ("mod a; mod b;", "use super::a::*; pub struct B;"),
        ("mod a; mod b;", "pub struct B; mod inner { use super::super::a::A; }"),
        ("mod a; mod b; pub use a::A;", "use super::A; pub struct B;"),
        ("mod a; mod b; pub use a::{A as Other};", "use crate::sim::Other; pub struct B;"),
        ("mod a; mod b; pub use a::*;", "use crate::sim::A; pub struct B;"),
        ("mod a; mod b; pub use b::B as C; pub use a::A;", "use super::*; pub struct B; impl A {}"),
    ] {
        let files = [("src/sim/mod.rs", parent), ("src/sim/a.rs", a_needs_b), ("src/sim/b.rs", b)];
        assert_eq!(circles_of(&files), [["a.rs", "b.rs"]], "{parent} {b}");
    }
    let ring = [("src/sim/a.rs", a_needs_b), ("src/sim/c.rs", "use super::a::A; struct C;")];
    let b = ("src/sim/b.rs", "use super::c::C; pub struct B;");
    let all = [("src/sim/mod.rs", "mod a; mod b; mod c;"), ring[0], b, ring[1]];
    assert_eq!(circles_of(&all), [["a.rs", "b.rs", "c.rs"]]);
}

#[test]
fn a_child_that_uses_its_parent_is_a_circle_if_the_parent_uses_the_child() {
    let child = ("src/sim/a.rs", "use super::Stop; pub struct A;");
    let of = |parent| circles_of(&[("src/sim/mod.rs", parent), child]);
    assert_eq!(of("mod a; pub struct Stop; fn f(x: a::A) {}"), [["a.rs", "mod.rs"]]);
    assert_eq!(of("mod a; pub use a::A; pub struct Stop; fn f(x: A) {}"), [["a.rs", "mod.rs"]]);
    assert_eq!(of("mod a; use a::A; pub struct Stop;"), [["a.rs", "mod.rs"]]);
    assert_eq!(of("mod a; pub use a::A; pub struct Stop;"), [[""; 0]; 0]);
}

#[test]
fn what_is_no_circle_passes() {
    let a = ("src/sim/a.rs", "use super::b::B; pub struct A; pub fn g() {}");
    for b in [
        "/// [`super::a::A`]\npub struct B;",
        "pub struct B; #[cfg(test)] mod tests { use crate::sim::a::A; }",
        "use crate::sim::a; pub struct B;",
        "pub(in crate::sim) struct B; fn f(a: u8) { \"super::a::A\"; a.g(); }",
        "use other::a::A; pub struct B;",
    ] {
        let files = [("src/sim/mod.rs", "mod a; mod b; pub use a::A;"), a, ("src/sim/b.rs", b)];
        assert!(circles_of(&files).is_empty(), "{b}");
    }
    let tests = ("src/sim/b.rs", "use super::a::A; pub struct B;");
    let parent = ("src/sim/mod.rs", "mod a; #[cfg(test)] mod b;");
    assert!(circles_of(&[parent, a, tests]).is_empty());
}
