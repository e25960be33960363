//! Measured drapes: what their outlines say, how well they are known, and the fabric whose drapes lie closest.
//!
//! Flow: `manifest` (what was measured of which fabric) -> `silhouette` (a picture to an outline) -> `measures`
//! (drape coefficient, folds, amplitudes; the same for simulated drapes) -> `floor` (captures against captures, faces,
//! specimens) -> `fit` (the fabric shared by all drapes, each held on its own branch; `believed` before it, `trial` a
//! drape seen from above, `squares` the least squares) -> `trace` (which effects of `effect` the residual asks for; they are
//! added by a fit again) -> `run` (all of it for a manifest).

pub mod believed;
pub mod effect;
pub mod fit;
pub mod floor;
pub mod manifest;
pub mod measures;
pub mod run;
pub mod silhouette;
pub mod squares;
pub mod trace;
pub mod trial;
