//! A calibrated fabric as text.

use serde::{Deserialize, Serialize};
use serde_json::Value;

/// What is shown of a fabric, as text: enough to put the whole together again without its drapes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// The fabric.
    pub name: String,
    /// Its part of calibration.json.
    pub json: Value,
    /// Its part of the table.
    pub table: String,
    /// Its part of the page.
    pub page: String,
    /// Drapes that were simulated beside measured ones.
    pub drapes: usize,
    /// Whether a fabric was fitted.
    pub fitted: bool,
    /// Names of its files in the folder of results.
    pub files: Vec<String>,
}
