//! Measured drapes: what their outlines say, how well they are known, and the fabric whose drapes
//! lie closest.
//!
//! Flow: `manifest` (what was measured of which fabric) -> `silhouette` (a picture to an outline)
//! -> `measures` (drape coefficient, folds, amplitudes; the same for simulated drapes) -> `floor`
//! (captures against captures, faces, specimens) -> `fit` (the fabric shared by all drapes, each
//! held on its own branch; `believed` before it, `first_fabric` where it begins, `lead` how sheets
//! are led, `trial` a drape as it is seen, `target` and `pose` what was measured and how it lies
//! there, `seen` the one beside the other, `squares` the least squares, `beside` a drape beside
//! what was measured, `options` how well all this is known) -> `explain` (which effects of `effect`
//! explain the drapes, by `evidence`, specimens told apart by `specimens`, what is `found`; `field`
//! where on the cloth the rest would come from, as even as `smooth` says; the fit of softening
//! begins where `softened` says) -> `predict` (drapes held out) -> `left` (what stays, and over
//! which length of rim it is alike) -> `run` (all of it for a manifest); `cloth_file` the fabric
//! found, for other verbs.

pub mod believed;
pub mod beside;
pub mod cloth_file;
pub mod effect;
mod evidence;
pub mod explain;
pub mod field;
mod first_fabric;
pub mod fit;
pub mod floor;
pub mod found;
mod lead;
pub mod left;
pub mod manifest;
pub mod measured;
pub mod measures;
pub mod options;
pub mod pose;
pub mod predict;
pub mod result;
pub mod run;
pub mod seen;
pub mod silhouette;
mod smooth;
mod softened;
mod specimens;
mod squares;
pub mod target;
pub mod trial;

/// Raised where the same files give other numbers than before, so that nothing made by an earlier
/// version is kept.
pub const VERSION: u32 = 15;
