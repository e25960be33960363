//! Work in progress.

pub mod self_contact;
