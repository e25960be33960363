//! Results for people and programs: the table, params.json, the pictures, the files.

pub mod files;
pub mod inspection;
pub mod json;
pub mod overlay;
pub mod table;
pub mod verdict;
