//! Results for people and programs: the table, params.json, the pictures, the files.

pub mod calibration;
pub mod cusick;
pub mod files;
pub mod inspection;
pub mod json;
pub mod overlay;
pub mod page;
mod pane;
pub mod section;
pub(crate) mod simulated;
pub mod table;
pub mod verdict;
