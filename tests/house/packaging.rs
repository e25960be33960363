//! What is said of the package: the oldest Rust is the same everywhere and is enough for every
//! crate of the lock file; the changelog has what a release needs.

use std::process::Command;

use crate::promises::root;
use serde_json::Value;

fn text(path: &str) -> Option<String> {
    std::fs::read_to_string(root().join(path)).ok()
}

/// `1.92` and `1.92.0` as numbers.
fn version(text: &str) -> [u32; 2] {
    let mut parts = text.split('.').map(|part| part.parse().unwrap());
    [parts.next().unwrap(), parts.next().unwrap()]
}

/// What stands between two texts.
fn between<'a>(text: &'a str, before: &str, after: &str) -> &'a str {
    let rest = text.split_once(before).unwrap_or_else(|| panic!("no `{before}`")).1;
    rest.split_once(after).unwrap_or_else(|| panic!("no `{after}` behind `{before}`")).0
}

/// The packages that are compiled here, development's too, with the oldest Rust that each asks for.
fn packages() -> Vec<(String, Option<String>)> {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let said = Command::new(rustc).arg("-vV").output().unwrap().stdout;
    let host = between(&String::from_utf8(said).unwrap(), "host: ", "\n").to_owned();
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    // Those of other platforms need not be on this machine.
    cargo.args(["metadata", "--locked", "--format-version=1", "--filter-platform", &host]);
    let run = cargo.current_dir(root()).output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let found: Value = serde_json::from_slice(&run.stdout).unwrap();
    let packages = found["packages"].as_array().unwrap().iter();
    packages
        .map(|p| {
            let name =
                format!("{} {}", p["name"].as_str().unwrap(), p["version"].as_str().unwrap());
            (name, p["rust_version"].as_str().map(str::to_owned))
        })
        .collect()
}

#[test]
fn the_oldest_rust_is_stated_alike_and_is_enough_for_every_crate() {
    let manifest = text("Cargo.toml").unwrap();
    let stated = between(&manifest, "\nrust-version = \"", "\"");
    assert_eq!(between(&text("README.md").unwrap(), "With Rust ", " or later"), stated);
    if let Some(clippy) = text("clippy.toml") {
        assert!(!clippy.contains("msrv") || between(&clippy, "msrv = \"", "\"") == stated);
    }
    let packages = packages();
    assert!(packages.len() > 200, "only {} packages: the search is broken", packages.len());
    let asking: Vec<_> =
        packages.iter().filter_map(|(name, rust)| Some((name, rust.as_ref()?))).collect();
    assert!(asking.len() > 100, "only {} state a Rust", asking.len());
    let newer: Vec<_> = asking.iter().filter(|(_, rust)| version(rust) > version(stated)).collect();
    assert!(newer.is_empty(), "rust-version is {stated}, but these ask for more: {newer:?}");
    // It is not higher than it needs to be.
    let most = asking.iter().filter(|(name, _)| !name.starts_with("scan2params"));
    let most = most.max_by_key(|(_, rust)| version(rust)).unwrap();
    assert_eq!(version(most.1), version(stated), "the newest Rust that is asked for is {most:?}");
}

#[test]
fn the_changelog_has_what_changes_numbers_under_a_heading_of_its_own() {
    let changelog = text("CHANGELOG.md").unwrap();
    let manifest = text("Cargo.toml").unwrap();
    let own = between(&manifest, "\nversion = \"", "\"");
    let numerics = format!("numerics {}", scan2params::sim::NUMERICS_VERSION);
    assert!(changelog.contains("## [Unreleased]") || changelog.contains(&format!("## [{own}]")));
    let releases: Vec<&str> = changelog.split("\n## [").skip(1).collect();
    assert!(!releases.is_empty());
    for release in &releases {
        let name = release.split(']').next().unwrap();
        let sections: Vec<&str> =
            release.lines().filter_map(|line| line.strip_prefix("### ")).collect();
        let known = ["Numbers", "Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"];
        assert!(sections.iter().all(|section| known.contains(section)), "{name}: {sections:?}");
        assert_eq!(sections.first(), Some(&"Numbers"), "{name}: what changes numbers comes first");
    }
    // The newest entry that changes numbers names the simulator and the model that are shipped.
    let [model, _] = scan2params::estimate::shipped_model();
    assert!(changelog.contains(&numerics) && changelog.contains(&model), "{numerics}, {model}");
}
