//! The version: the program, the model that it ships, the simulator's numerics, and the commit.

use crate::estimate::shipped_model;
use crate::sim::NUMERICS_VERSION;

/// Version, model, numerics, and commit where there is one, a line each.
pub fn long(version: &str, commit: &str) -> String {
    let [id, sha256] = shipped_model();
    let mut text = format!(
        "{version}\nmodel {id} (SHA-256 {})\nsimulator numerics {NUMERICS_VERSION}",
        sha256.get(..12).unwrap_or(&sha256)
    );
    if !commit.is_empty() {
        text += &format!("\ncommit {commit}");
    }
    text
}
