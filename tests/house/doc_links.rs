//! Links of the documents: each leads to a file that is there, and to a heading of it.

use std::fs;
use std::path::{Path, PathBuf};

use crate::promises::root;

/// The documents: those of the root, and all below docs, fixtures and scripts.
fn documents() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![root().join("docs"), root().join("fixtures"), root().join("scripts")];
    found.extend(markdown(root()));
    while let Some(folder) = folders.pop() {
        found.extend(markdown(&folder));
        let below = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        folders.extend(below.filter(|path| path.is_dir() && !path.ends_with("node_modules")));
    }
    found
}

fn markdown(folder: &Path) -> impl Iterator<Item = PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.filter(|path| path.extension().is_some_and(|ending| ending == "md"))
}

/// A text without what stands in fences.
fn prose(text: &str) -> String {
    let mut fenced = false;
    let lines = text.lines().filter(|line| {
        let is_fence = line.trim_start().starts_with("```");
        fenced ^= is_fence;
        !fenced && !is_fence
    });
    lines.map(|line| format!("{line}\n")).collect()
}

/// The targets of `[...](target)`.
fn links(text: &str) -> Vec<String> {
    let parts = text.split("](").skip(1);
    parts.filter_map(|part| Some(part.split_once(')')?.0.to_owned())).collect()
}

/// The anchors of a document's headings, as they are made of their words.
fn anchors(text: &str) -> Vec<String> {
    let headings = text.lines().filter(|line| line.starts_with('#'));
    let words = headings.map(|line| line.trim_start_matches('#').trim().to_lowercase());
    let kept = |c: char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_');
    words
        .map(|line| line.chars().filter(|c| kept(*c)).collect::<String>().replace(' ', "-"))
        .collect()
}

/// What is wrong with a link of a document; nothing is said of what lies elsewhere.
fn fault(document: &Path, link: &str) -> Option<String> {
    if link.contains("://") || link.starts_with("mailto:") {
        return None;
    }
    let (file, anchor) = link.split_once('#').map_or((link, None), |(f, a)| (f, Some(a)));
    let path = match file {
        "" => document.to_owned(),
        file => document.parent().unwrap().join(file),
    };
    if !path.exists() {
        return Some(format!("{}: {link}: no such file", document.display()));
    }
    let anchor = anchor.filter(|_| path.extension().is_some_and(|ending| ending == "md"))?;
    let known = anchors(&prose(&fs::read_to_string(&path).unwrap()));
    let is_known = known.iter().any(|known| known == anchor);
    (!is_known).then(|| format!("{}: {link}: no such heading", document.display()))
}

#[test]
fn every_link_leads_to_a_file_and_a_heading() {
    let documents = documents();
    assert!(documents.len() > 30, "only {} documents: the search is broken", documents.len());
    let (mut count, mut faults) = (0, Vec::new());
    for document in &documents {
        for link in links(&prose(&fs::read_to_string(document).unwrap())) {
            count += 1;
            faults.extend(fault(document, &link));
        }
    }
    assert!(count > 100, "only {count} links: the search is broken");
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn a_link_to_nothing_is_found() {
    let readme = root().join("README.md");
    assert_eq!(fault(&readme, "docs/formats.md#the-verdict"), None);
    assert_eq!(fault(&readme, "https://example.org/nothing"), None);
    for link in ["docs/nothing.md", "docs/formats.md#nothing", "#nothing"] {
        assert!(fault(&readme, link).is_some(), "{link}");
    }
    assert_eq!(links("a [b](c.md) and ![d](e.png#f)"), ["c.md", "e.png#f"]);
    assert_eq!(anchors("# A file's `name`, twice\n"), ["a-files-name-twice"]);
}
