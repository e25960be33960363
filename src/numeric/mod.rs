//! Numerical tools: sparse factorisation on a fixed pattern.

pub mod sparse;
