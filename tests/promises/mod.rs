//! The promises of README.md and docs/validation, as docs/promises.toml holds them: tests
//! take their limits from there by [`hold`], and `tests/house/promise_table.rs` renders them into
//! docs/validation.

#![allow(dead_code)]

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use serde::Deserialize;

/// One measurable claim and its limit.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Promise {
    /// By which tests ask for it.
    pub id: String,
    /// What is measured, of what.
    pub claim: String,
    /// Unit of the numbers; empty for a share or a factor.
    #[serde(default)]
    pub unit: String,
    /// Largest value that keeps the promise.
    pub at_most: Option<f64>,
    /// Least value that keeps the promise.
    pub at_least: Option<f64>,
    /// What was measured when the limit was set.
    pub observed: f64,
    /// Why the limit stands farther off than [`MARGIN`], where it does.
    pub margin: Option<String>,
    /// What a planted fault scores, or why none was planted.
    pub planted: String,
    /// The test that holds it, `program/file::name` below tests/, or with its whole path
    /// `src/path.rs::name`, `lab/tests/lab/file.rs::name`; none where
    /// a test would take too long.
    pub test: Option<String>,
    /// The limit as the file of the test has it, where the test does not take it from here.
    pub in_test: Option<String>,
    /// The command that measures it, where it is not the test.
    pub command: Option<String>,
}

/// Numbers in README.md, with the promises that they come from or the reason why they are
/// no measurements.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Said {
    /// As README.md has them, line breaks as spaces.
    pub words: String,
    /// The promises whose numbers these are, rounded to the digits that are shown.
    #[serde(default)]
    pub promises: Vec<String>,
    /// What else these numbers are.
    pub given: Option<String>,
}

/// The whole table.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// The promises, as they are rendered.
    pub promise: Vec<Promise>,
    /// The numbers of README.md.
    pub readme: Vec<Said>,
}

/// A limit is at most so many times farther from perfect than what was observed, or says why.
pub const MARGIN: f64 = 1.5;

/// The repository's root: of the checkout that the tests are run in, also where they were compiled
/// in another one. The laboratory's package lies one folder below.
pub fn root() -> &'static Path {
    static ROOT: OnceLock<PathBuf> = OnceLock::new();
    ROOT.get_or_init(|| {
        let package =
            std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or(env!("CARGO_MANIFEST_DIR").into());
        let package = PathBuf::from(package);
        if package.ends_with("lab") { package.parent().unwrap().to_owned() } else { package }
    })
}

/// The table, read once.
pub fn table() -> &'static Table {
    static TABLE: OnceLock<Table> = OnceLock::new();
    TABLE.get_or_init(|| {
        let path: PathBuf = root().join("docs/promises.toml");
        let text = std::fs::read_to_string(&path).unwrap();
        toml::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    })
}

/// The promise of this id.
///
/// # Panics
/// Where docs/promises.toml has none.
pub fn promise(id: &str) -> &'static Promise {
    let found = table().promise.iter().find(|promise| promise.id == id);
    found.unwrap_or_else(|| panic!("docs/promises.toml has no promise `{id}`: add it"))
}

impl Promise {
    /// Whether this value keeps it.
    pub fn is_kept_by(&self, value: f64) -> bool {
        value.is_finite()
            && self.at_most.is_none_or(|most| value <= most)
            && self.at_least.is_none_or(|least| value >= least)
    }

    /// The limit in words.
    pub fn limit(&self) -> String {
        match (self.at_least.map(shown), self.at_most.map(shown)) {
            (Some(least), Some(most)) => format!("{least} to {most}"),
            (None, Some(most)) => format!("≤ {most}"),
            (Some(least), None) => format!("≥ {least}"),
            (None, None) => "none".to_owned(),
        }
    }
}

/// A number as it is read easily: tiny ones with their power of ten.
pub fn shown(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-3 { format!("{value:e}") } else { value.to_string() }
}

/// Fails unless `value`, in the promise's unit, keeps it; prints both for the record.
///
/// # Panics
/// Where the promise is broken, or there is none of this id.
pub fn hold(id: &str, value: f64) {
    let promise = promise(id);
    let Promise { claim, unit, observed, .. } = promise;
    let limit = promise.limit();
    println!("promise {id}: {value:.4} {unit} (limit {limit}, observed {observed})");
    assert!(
        promise.is_kept_by(value),
        "{claim}: {value:.4} {unit}, promised is {limit}, observed was {observed} ({id} in \
         docs/promises.toml)"
    );
}
