//! Jobs from end to end: a scan or many in, parameters, verdict, pages and other files out.

#[path = "../program/mod.rs"]
mod program;
#[path = "../promises/mod.rs"]
mod promises;
#[path = "../schema_support/mod.rs"]
mod schema_support;

mod batch;
mod combine;
mod committed;
mod export;
mod kit;
mod main_job;
mod refine;
mod report_page;
mod schemas;
mod verdict;
