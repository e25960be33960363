//! The repository itself: layers, documents, the package, the table of promises.

#[path = "../layering_support/mod.rs"]
mod layering_support;
#[path = "../program/mod.rs"]
mod program;
#[path = "../promises/mod.rs"]
mod promises;

mod command_pages;
mod doc_links;
mod features;
mod layering;
mod model_card;
mod packaging;
mod promise_table;
