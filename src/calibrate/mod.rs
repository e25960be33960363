//! Measured drapes: what their outlines say, how well they are known, and the fabric whose drapes
//! lie closest.
//!
//! Flow: `manifest` (what was measured of which fabric) -> `silhouette` (a picture to an outline)
//! -> `measures` (drape coefficient, folds, amplitudes; the same for simulated drapes) -> `floor`
//! (captures against captures, faces, specimens) -> `fit` (the fabric shared by all drapes, each
//! kept on its own branch) -> `explain` (which effects of `effect` explain the drapes) -> `predict`
//! (drapes held out) -> `residual_size` (the size of what remains, and its correlation length) ->
//! `run` (all of it for a manifest). `cloth_file` is the fabric found, for other verbs.
//!
//! Parts of `fit`: `fabric_prior` is its prior and `first_fabric` its start. `continuation` brings
//! sheets to rest, `prediction` is a drape's outline and rim with their moves. `target` and `pose`
//! say what was measured and how it lies there. `residuals` are the distances between the two,
//! `equations` the least squares of them, `comparison` a drape with its measured outline. `options`
//! say how well all this is known.
//!
//! Parts of `explain`: `evidence` weighs effects, `specimens` tells specimens apart, `found` is
//! what it found. `field` maps where on the cloth the rest would come from, as even as `smooth`
//! says. The fit of softening begins where `softened` says.

pub mod cloth_file;
pub mod comparison;
mod continuation;
pub mod effect;
mod equations;
mod evidence;
pub mod explain;
pub mod fabric_prior;
pub mod field;
mod first_fabric;
pub mod fit;
pub mod floor;
pub mod found;
pub mod manifest;
pub mod measured;
pub mod measures;
pub mod options;
pub mod pose;
pub mod predict;
pub mod prediction;
pub mod residual_size;
pub mod residuals;
pub mod result;
pub mod run;
pub mod silhouette;
mod smooth;
mod softened;
mod specimens;
pub mod target;

/// Raised where the same files give other numbers than before, so that nothing made by an earlier
/// version is kept.
pub const VERSION: u32 = 15;
