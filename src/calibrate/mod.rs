//! Measured drapes: what their outlines say, how well they are known, and the fabric whose drapes lie closest.

pub mod manifest;
pub mod measures;
pub mod silhouette;
