//! Work in progress.

/// Changes whenever the simulator's numbers change: datasets and models carry
/// it, and a model trained on other numbers is refused.
pub const NUMERICS_VERSION: u32 = 1;
