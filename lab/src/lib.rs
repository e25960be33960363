//! The laboratory: what scan2params promises, measured, for docs/validation.
//!
//! Two rooms above those of scan2params, and the program `scan2params-lab`, whose verbs are the
//! measurements: `sealed < evaluate < command`. `tests/house/layering.rs` holds the order.

pub mod evaluate;
pub mod sealed;
