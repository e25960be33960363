//! The version: the program, the model that it ships, the simulator's numerics, and the commit.

use std::sync::LazyLock;

use git_version::git_version;

use scan2params::estimate::shipped_model;
use scan2params::sim::NUMERICS_VERSION;

/// The commit of the checkout that this was built from, `-modified` if that was changed; empty
/// where there was none. Of the whole package only the program depends on it, so that a commit does
/// not compile the library again.
pub(super) const COMMIT: &str = git_version!(
    args = ["--always", "--exclude=*", "--abbrev=12", "--dirty=-modified"],
    fallback = ""
);

/// `version`: what `--version` prints.
pub(super) fn print() -> super::Outcome {
    println!("scan2params {}", long());
    Ok(())
}

/// Version, model, numerics and commit, a line each.
pub(super) fn long() -> &'static str {
    static TEXT: LazyLock<String> = LazyLock::new(text);
    &TEXT
}

fn text() -> String {
    let [id, sha256] = shipped_model();
    let mut text = format!(
        "{}\nmodel {id} (SHA-256 {})\nsimulator numerics {NUMERICS_VERSION}",
        env!("CARGO_PKG_VERSION"),
        sha256.get(..12).unwrap_or(&sha256)
    );
    if !COMMIT.is_empty() {
        text += &format!("\ncommit {COMMIT}");
    }
    text
}
