//! The layers of `src/lib.rs`, held: no upward import, and no printing below `cli`.
//!
//! Reads the sources as tokens, so that comments, doc links and strings do not
//! count, and grouped imports, inline paths and `super::super` do. Test modules
//! are not exempt from the order. Not seen: paths that a macro puts together, and
//! a layer reached through another's re-export.

use std::collections::BTreeSet;
use std::fmt;
use std::path::{Path, PathBuf};

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
    &["sensor"],
    &["dataset"],
    &["estimate"],
    &["refine"],
    &["calibrate"],
    &["job"],
    &["report"],
    &["batch"],
    &["evaluate"],
    &["cli"],
];

/// Upward imports that are allowed: file, layer, reason. An entry that no longer
/// matches an import fails the test.
const EXCEPTIONS: &[(&str, &str, &str)] = &[];

/// Fewer files than this means that the search went wrong.
const LEAST_FILES: usize = 50;

const PRINTING: [&str; 5] = ["print", "println", "eprint", "eprintln", "dbg"];

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
fn only_the_command_line_prints() {
    let sources = sources();
    let tests: BTreeSet<_> = sources.iter().flat_map(test_files).collect();
    let faults: Vec<_> = sources
        .iter()
        .filter(|source| rank(source.layer()).is_some_and(|r| r + 1 < ORDER.len()))
        .filter(|source| !tests.contains(&source.module))
        .flat_map(|source| prints(source).into_iter().map(|line| format!("{}:{line}", source.file)))
        .collect();
    assert!(faults.is_empty(), "printed outside cli:\n{}", faults.join("\n"));
}

#[test]
fn the_order_here_is_that_of_lib_rs_and_covers_every_folder() {
    let lib = std::fs::read_to_string(src().join("lib.rs")).unwrap();
    let said = lib.replace("//!", " ").split_whitespace().collect::<Vec<_>>().join(" ");
    let order = ORDER.iter().map(|layers| layers.join(", ")).collect::<Vec<_>>().join(" < ");
    assert!(said.contains(&format!("`{order}`")), "lib.rs does not say: {order}");
    for source in sources().iter().filter(|s| !s.module.is_empty()) {
        assert!(rank(source.layer()).is_some(), "{}: not in a known layer", source.file);
    }
}

/// One source file.
struct Source {
    /// Path from the package's root, with slashes.
    file: String,
    /// Module path below the crate: `["sim", "grid"]`; empty for lib.rs and main.rs.
    module: Vec<String>,
    tokens: Vec<Token>,
}

impl Source {
    fn new(file: &str, text: &str) -> Self {
        let inner = file.trim_start_matches("src/").trim_end_matches(".rs");
        let mut module: Vec<String> = inner.split('/').map(String::from).collect();
        let last = module.last().map(String::as_str);
        if last == Some("mod") || matches!(inner, "lib" | "main") {
            module.pop();
        }
        Self { file: file.into(), module, tokens: tokens(text) }
    }

    fn layer(&self) -> &str {
        self.module.first().map_or("", String::as_str)
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
    for (line, target) in crate_paths(source) {
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

/// The first segment below the crate of every path that starts with `crate`,
/// `self` or `super`, with its line. `*` stands for the crate as a whole.
fn crate_paths(source: &Source) -> Vec<(usize, String)> {
    let tokens = &source.tokens;
    let mut found = Vec::new();
    // inline modules around the present token; other braces are None
    let mut braces: Vec<Option<String>> = Vec::new();
    let mut i = 0;
    while i < tokens.len() {
        let text = |k: usize| tokens.get(k).map_or("", |t| t.text.as_str());
        let before = if i == 0 { "" } else { text(i - 1) };
        match text(i) {
            "mod" if text(i + 2) == "{" => {
                braces.push(Some(text(i + 1).into()));
                i += 3;
                continue;
            }
            "{" => braces.push(None),
            "}" => drop(braces.pop()),
            start @ ("crate" | "super" | "self") if before != "::" => {
                let visibility = before == "(" && text(i + 1) == ")";
                if text(i + 1) == "::" || (start != "self" && !visibility) {
                    let mut paths = Vec::new();
                    let line = tokens[i].line;
                    i = expand(tokens, i, &[], &mut paths);
                    let inline = braces.iter().flatten().cloned();
                    let here: Vec<_> = source.module.iter().cloned().chain(inline).collect();
                    found.extend(paths.iter().map(|path| (line, below_crate(&here, path))));
                    continue;
                }
            }
            _ => {}
        }
        i += 1;
    }
    found
}

/// The first segment below the crate of `path` as written in module `here`.
fn below_crate(here: &[String], path: &[String]) -> String {
    let mut at = here.to_vec();
    for segment in path {
        match segment.as_str() {
            "crate" => at.clear(),
            "self" => {}
            "super" => drop(at.pop()),
            other => at.push(other.into()),
        }
    }
    at.into_iter().next().unwrap_or_else(|| "*".into())
}

/// Expands the path or import tree at `i` into plain paths; returns the place
/// after it.
fn expand(
    tokens: &[Token],
    mut i: usize,
    prefix: &[String],
    paths: &mut Vec<Vec<String>>,
) -> usize {
    let text = |k: usize| tokens.get(k).map_or("", |t| t.text.as_str());
    let mut path = prefix.to_vec();
    loop {
        match text(i) {
            "{" => {
                i += 1;
                while i < tokens.len() && text(i) != "}" {
                    i = expand(tokens, i, &path, paths);
                    if text(i) == "as" {
                        i += 2;
                    }
                    if text(i) == "," {
                        i += 1;
                    }
                }
                return i + 1;
            }
            word if is_word(word) || word == "*" => path.push(word.into()),
            // a turbofish, or nothing that is known: the path ends here
            other => {
                paths.push(path);
                return if matches!(other, "}" | ",") { i } else { i + 1 };
            }
        }
        i += 1;
        if text(i) != "::" {
            paths.push(path);
            return i;
        }
        i += 1;
    }
}

fn is_word(text: &str) -> bool {
    text.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Lines of printing macros outside `#[cfg(test)]`.
fn prints(source: &Source) -> Vec<usize> {
    let (code, _) = without_tests(source);
    code.windows(2)
        .filter(|pair| PRINTING.contains(&pair[0].text.as_str()) && pair[1].text == "!")
        .map(|pair| pair[0].line)
        .collect()
}

/// Modules that the file declares as `#[cfg(test)] mod name;`.
fn test_files(source: &Source) -> Vec<Vec<String>> {
    let child = |name: String| source.module.iter().cloned().chain([name]).collect();
    without_tests(source).1.into_iter().map(child).collect()
}

/// The tokens outside items marked `#[cfg(test)]`, and the names of the modules
/// in files of their own that are so marked.
fn without_tests(source: &Source) -> (Vec<&Token>, Vec<String>) {
    const MARK: [&str; 7] = ["#", "[", "cfg", "(", "test", ")", "]"];
    let tokens = &source.tokens;
    let (mut code, mut files) = (Vec::new(), Vec::new());
    let mut i = 0;
    while i < tokens.len() {
        let marked = tokens[i..].iter().map(|t| t.text.as_str()).take(MARK.len()).eq(MARK);
        if !marked {
            code.push(&tokens[i]);
            i += 1;
            continue;
        }
        i += MARK.len();
        if tokens.get(i).is_some_and(|t| t.text == "mod")
            && tokens.get(i + 2).is_some_and(|t| t.text == ";")
        {
            files.push(tokens[i + 1].text.clone());
        }
        i = item_end(tokens, i);
    }
    (code, files)
}

/// The place after the item at `i`: its closing brace, or its semicolon.
fn item_end(tokens: &[Token], mut i: usize) -> usize {
    let mut depth = 0_usize;
    while let Some(token) = tokens.get(i) {
        i += 1;
        match token.text.as_str() {
            "{" | "(" | "[" => depth += 1,
            ")" | "]" => depth -= 1,
            "}" => {
                depth -= 1;
                if depth == 0 {
                    break;
                }
            }
            ";" if depth == 0 => break,
            _ => {}
        }
    }
    i
}

/// A word, `::`, or a single other character.
#[derive(Debug)]
struct Token {
    text: String,
    line: usize,
}

/// Splits Rust source; comments, strings and characters are left out.
fn tokens(text: &str) -> Vec<Token> {
    let chars: Vec<char> = text.chars().collect();
    let at = |k: usize| chars.get(k).copied().unwrap_or('\0');
    let mut tokens = Vec::new();
    let (mut i, mut line, mut counted) = (0, 1, 0);
    while i < chars.len() {
        line += chars[counted..i].iter().filter(|c| **c == '\n').count();
        counted = i;
        match at(i) {
            '/' if at(i + 1) == '/' => {
                while i < chars.len() && at(i) != '\n' {
                    i += 1;
                }
            }
            '/' if at(i + 1) == '*' => i = after_block_comment(&chars, i),
            '"' => i = after_string(&chars, i),
            '\'' if at(i + 1) == '\\' => {
                i += 3;
                while i < chars.len() && at(i) != '\'' {
                    i += 1;
                }
                i += 1;
            }
            '\'' if at(i + 2) == '\'' => i += 3,
            ':' if at(i + 1) == ':' => {
                tokens.push(Token { text: "::".into(), line });
                i += 2;
            }
            c if c.is_alphanumeric() || c == '_' => {
                let start = i;
                while at(i).is_alphanumeric() || at(i) == '_' {
                    i += 1;
                }
                let word: String = chars[start..i].iter().collect();
                let hashes = (i..).take_while(|&k| at(k) == '#').count();
                let raw = matches!(word.as_str(), "r" | "br" | "cr");
                if raw && at(i + hashes) == '"' {
                    i = after_raw_string(&chars, i + hashes + 1, hashes);
                } else {
                    tokens.push(Token { text: word, line });
                }
            }
            c => {
                if !c.is_whitespace() {
                    tokens.push(Token { text: c.into(), line });
                }
                i += 1;
            }
        }
    }
    tokens
}

fn after_block_comment(chars: &[char], mut i: usize) -> usize {
    let mut depth = 0;
    while i < chars.len() {
        match (chars[i], chars.get(i + 1)) {
            ('/', Some('*')) => (depth, i) = (depth + 1, i + 2),
            ('*', Some('/')) => (depth, i) = (depth - 1, i + 2),
            _ => i += 1,
        }
        if depth == 0 {
            break;
        }
    }
    i
}

fn after_string(chars: &[char], quote: usize) -> usize {
    let mut i = quote + 1;
    while i < chars.len() && chars[i] != '"' {
        i += if chars[i] == '\\' { 2 } else { 1 };
    }
    i + 1
}

fn after_raw_string(chars: &[char], mut i: usize, hashes: usize) -> usize {
    let ends = |i: usize| {
        chars[i] == '"' && (1..=hashes).all(|k| chars.get(i + k).is_some_and(|c| *c == '#'))
    };
    while i < chars.len() && !ends(i) {
        i += 1;
    }
    i + 1 + hashes
}

fn src() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// All `.rs` files below `src`.
fn sources() -> Vec<Source> {
    let mut found = Vec::new();
    let mut folders = vec![src()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let inner = path.strip_prefix(env!("CARGO_MANIFEST_DIR")).unwrap();
                let file: Vec<_> = inner.iter().map(|part| part.to_str().unwrap()).collect();
                let text = std::fs::read_to_string(&path).unwrap();
                found.push(Source::new(&file.join("/"), &text));
            }
        }
    }
    found
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
fn siblings_may_not_import_each_other() {
    assert_eq!(caught("src/geom/mesh.rs", "use crate::numeric::robust;"), ["numeric"]);
    assert_eq!(caught("src/numeric/robust.rs", "use crate::geom::Mesh;"), ["geom"]);
}

#[test]
fn what_is_no_upward_import_passes() {
    for text in [
        "// use crate::sim;\n/// [`crate::sim`]\n//! crate::cli",
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

#[test]
fn printing_is_caught_outside_tests_only() {
    let lines = |text: &str| prints(&Source::new("src/sim/drape.rs", text));
    assert_eq!(lines("fn f() {\n    println!(\"x\");\n}"), [2]);
    assert_eq!(lines("#[cfg(test)]\nmod tests { fn f() { println!() } }\nfn g() { dbg!(1) }"), [3]);
    assert_eq!(lines("#[cfg(test)]\n#[allow(x)]\nfn f() { eprintln!() }"), []);
    assert_eq!(lines("#[cfg(test)]\nuse a::{b, c};\nfn f() { eprint!() }"), [3]);
    assert_eq!(lines("#[cfg(feature)]\nfn f() { print!() }"), [2]);
    assert_eq!(lines("// println!()\nfn f() { writeln!(o, \"print!\") }"), []);
    let files = test_files(&Source::new("src/sim/contact.rs", "#[cfg(test)]\nmod tests;\nmod b;"));
    assert_eq!(files, [["sim", "contact", "tests"]]);
}
