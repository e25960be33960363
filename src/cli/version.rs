//! The version: the program, the model that it ships, the simulator's numerics, and the commit.

use std::sync::LazyLock;

use git_version::git_version;

use scan2params::terminal::version;

/// The commit of the checkout that this was built from, `-modified` if that was changed; empty
/// where there was none. Of the whole package only the program depends on it, so that a commit does
/// not compile the library again.
const COMMIT: &str = git_version!(
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
    static TEXT: LazyLock<String> =
        LazyLock::new(|| version::long(env!("CARGO_PKG_VERSION"), COMMIT));
    &TEXT
}
