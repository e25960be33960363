//! The library's features, held: what a feature compiles uses no module and no crate that it does
//! not bring. Here the sources are read; `scripts/check_features.sh --all` compiles the library with
//! no feature and with each. Not seen: features of crates, such as `jpeg` of `image`.

use std::collections::{BTreeMap, BTreeSet};

use crate::layering_support::{Mention, Role, Source, is_root, sources};

/// What the features of Cargo.toml bring.
struct Features {
    /// The features that each brings, itself among them.
    brought: BTreeMap<String, BTreeSet<String>>,
    /// The features that bring each optional crate.
    crates: BTreeMap<String, BTreeSet<String>>,
}

impl Features {
    fn of(manifest: &str) -> Self {
        let manifest: toml::Table = manifest.parse().unwrap();
        let listed = |list: &toml::Value| -> Vec<String> {
            list.as_array().unwrap().iter().map(|entry| entry.as_str().unwrap().into()).collect()
        };
        let features: BTreeMap<String, Vec<String>> = manifest["features"]
            .as_table()
            .unwrap()
            .iter()
            .map(|(name, list)| (name.clone(), listed(list)))
            .collect();
        let mut brought = BTreeMap::new();
        let mut crates: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for name in features.keys() {
            let mut all = BTreeSet::from([name.clone()]);
            let mut open = vec![name];
            while let Some(list) = open.pop().and_then(|name| features.get(name)) {
                for entry in list {
                    if let Some(krate) = entry.strip_prefix("dep:") {
                        crates.entry(krate.replace('-', "_")).or_default().insert(name.clone());
                    } else if features.contains_key(entry) && all.insert(entry.clone()) {
                        open.push(entry);
                    }
                }
            }
            brought.insert(name.clone(), all);
        }
        Self { brought, crates }
    }

    /// All features that are on wherever these are.
    fn with(&self, features: &[String]) -> BTreeSet<&str> {
        let brought = features.iter().filter_map(|name| self.brought.get(name)).flatten();
        brought.map(String::as_str).collect()
    }
}

/// The mentions of modules and crates that some features do not bring, as they are compiled with no
/// others than those that the file or the place asks for.
fn faults(features: &Features, sources: &[Source]) -> Vec<String> {
    let gated: Vec<_> = sources.iter().flat_map(|source| &source.gated).collect();
    // What a module asks for, with all above it.
    let asked = |module: &[String]| -> Vec<String> {
        let above = gated.iter().filter(|(gate, _)| module.starts_with(gate));
        above.flat_map(|(_, features)| features.clone()).collect()
    };
    let tests: BTreeSet<_> = sources.iter().flat_map(|source| &source.test_modules).collect();
    let library = |source: &&Source| {
        let of_the_program = source.module.is_empty() || source.layer() == "cli";
        let for_tests =
            (1..=source.module.len()).any(|n| tests.contains(&source.module[..n].to_vec()));
        !of_the_program && !for_tests && source.file.starts_with("src/")
    };
    let mut faults = Vec::new();
    for source in sources.iter().filter(library) {
        let own: BTreeSet<&str> = source.mentions.iter().filter_map(imported).collect();
        for mention in source.mentions.iter().filter(|mention| !mention.test) {
            let here = [asked(&source.module), mention.features.clone()].concat();
            let on = features.with(&here);
            let missing =
                |needed: &[String]| needed.iter().any(|feature| !on.contains(feature.as_str()));
            let first = mention.path[0].as_str();
            // A single word in code is a variable's name.
            let named = mention.path.len() > 1 || mention.role != Role::Code;
            let brings = features.crates.get(first).filter(|_| named && !own.contains(first));
            let lacks_crate = brings
                .is_some_and(|brings| !brings.iter().any(|feature| on.contains(feature.as_str())));
            let lacks_module = is_root(first) && missing(&asked(&mention.path[1..]));
            if lacks_crate || lacks_module {
                let path = mention.path.join("::");
                faults
                    .push(format!("{}:{}: {path} with {here:?} alone", source.file, mention.line));
            }
        }
    }
    faults
}

/// The name under which a file imports something from below a crate's root.
fn imported(mention: &Mention) -> Option<&str> {
    match &mention.role {
        Role::Import(name) | Role::ReExport(name) if mention.path.len() > 1 => Some(name),
        _ => None,
    }
}

#[test]
fn what_a_feature_compiles_uses_nothing_that_it_does_not_bring() {
    let features = Features::of(include_str!("../../Cargo.toml"));
    let sources = sources();
    let optional = sources.iter().flat_map(|source| &source.mentions);
    let optional =
        optional.filter(|mention| features.crates.contains_key(&mention.path[0])).count();
    assert!(optional > 100, "only {optional} uses of optional crates found");
    let faults = faults(&features, &sources);
    assert!(faults.is_empty(), "not brought:\n{}", faults.join("\n"));
}

#[test]
fn a_crate_or_a_module_that_is_not_brought_is_caught() {
    let features = Features::of(
        "[features]\nlow = [\"dep:one-crate\"]\nhigh = [\"low\", \"dep:two\"]\nother = []",
    );
    let root = "#[cfg(feature = \"low\")]\npub mod low;\n#[cfg(feature = \"high\")]\npub mod high;\npub mod plain;";
    let caught = |file: &str, text: &str| {
        let sources = [Source::new("src/lib.rs", root), Source::new(file, text)];
        faults(&features, &sources).len()
    };
    let low = "src/low/a.rs";
    for text in
        ["use two::X;", "fn f() { two::g() }", "use crate::high::X;", "fn f(x: crate::high::X) {}"]
    {
        assert_eq!(caught(low, text), 1, "{text}");
        assert_eq!(caught("src/high/a.rs", text), 0, "{text}");
        assert_eq!(
            caught(low, &format!("#[cfg(feature = \"high\")]\nmod m {{ {text} }}")),
            0,
            "{text}"
        );
        assert_eq!(caught(low, &format!("#[cfg(test)]\nmod m {{ {text} }}")), 0, "{text}");
        assert_eq!(
            caught(low, &format!("#[cfg(feature = \"other\")]\nmod m {{ {text} }}")),
            1,
            "{text}"
        );
    }
    assert_eq!(caught("src/plain.rs", "use one_crate::X; use crate::low::Y;"), 2);
    assert_eq!(caught(low, "use one_crate::X; use crate::plain::Y; use std::two;"), 0);
    assert_eq!(caught(low, "use super::two; fn f() { two::g() }"), 0);
}
