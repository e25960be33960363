//! Sealed cases: measured drapes, as `calibrate` reads them, whose fabric and whose effects are
//! known to nobody but this module and `scan2params-lab calibrate`.
//!
//! Flow: `case` (what is drawn from a seed: a fabric, effects, specimens) -> `effect` (what each
//! effect makes of the experiment) -> `make` (the drapes on fine cells, their pictures, the
//! manifest, and the truth in another file; `left` what six stiffnesses and the poses leave of the
//! effects). `region` says where on the specimen an effect acts.
//!
//! In: a seed and a number. Out: a folder with pictures and `manifest.csv`, which `calibrate` is
//! given, and `sealed.json`, which it never reads. `calibrate` cannot import this module
//! (`tests/house/layering.rs`).

mod case;
mod effect;
mod make;
mod region;
mod remaining;

pub use case::{Case, CaseError, Kind, Plan};
pub use effect::{Cloth, Effect, LISTED, UNLISTED};
pub use make::{MakeError, MakeOptions, Sealed, SealedDrape, make, read};
