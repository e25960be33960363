//! From a depth-sensor scan of a draped cloth specimen to the six stiffnesses
//! with which a cloth simulator reproduces the drape.
//!
//! A scan of a 300 x 300 mm specimen on a plate of radius 50 mm becomes a boundary of 244
//! points, and with the areal density the boundary becomes a fabric:
//!
//! ```
//! # #[cfg(feature = "estimate")]
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use scan2params::{Estimator, Orientation, ScanOptions, WarpToward};
//! use scan2params::{boundary_from_scan, read_scan};
//!
//! let (cloud, _notes) = read_scan("fixtures/scans/mean_structured-light.ply")?;
//! let warp_toward = Some(WarpToward::Direction([-1.0, 0.0, 0.0]));
//! let scanned = boundary_from_scan(&cloud, &ScanOptions { warp_toward, ..Default::default() })?;
//!
//! let known = scanned.orientation == Orientation::Given;
//! let estimate = Estimator::shipped()?.estimate(&scanned.boundary, 0.214, known)?;
//! let [low, high] = estimate.interval90;
//! println!(
//!     "bending stiffness along the weft: {:.2e} N m, {:.2e} to {:.2e} with 90 %",
//!     estimate.fabric.bending_weft_nm, low.bending_weft_nm, high.bending_weft_nm
//! );
//! # // the fabric of this fixture, fixtures/drapes/mean.params.json
//! # let truth = 1119.74e-9;
//! # assert!(low.bending_weft_nm < truth && truth < high.bending_weft_nm);
//! # Ok(())
//! # }
//! # #[cfg(not(feature = "estimate"))]
//! # fn main() {}
//! ```
//!
//! And back: the simulator drapes a fabric, from stiffnesses in the units of the paper or in SI.
//!
//! ```
//! use scan2params::{Drop, Fabric, SimOptions, Stop, drape};
//!
//! // stretch along weft and warp, shear [g/s^2]; bending along weft, warp, bias
//! // [g mm^2 s^-2 rad^-1]; density [g/m^2]
//! let fabric = Fabric::from_paper_units([131e3, 164e3, 75e3, 1120.0, 1371.0, 1245.0, 214.0]);
//! let options = SimOptions { vertices: 31, ..SimOptions::default() };
//! let drape = drape(&fabric, &Drop::canonical(), &options);
//!
//! assert_eq!(drape.stop, Stop::AtRest);
//! let lowest_m = drape.boundary.positions_m().map(|p| p.y).fold(0.0, f64::min);
//! assert!((-0.17..-0.10).contains(&lowest_m));
//! ```
//!
//! [`Job`] does all of it for a file, as the program's main job. Poor convergence is a
//! result with a reason ([`Stop`]); a scan that cannot be trusted is an error that says what was
//! measured, the limit and the remedy ([`ScanError`]).
//!
//! # Features
//!
//! The readers, the simulator and the scan path are always there. By default the whole program
//! is; a library takes what it needs with `default-features = false`. The last column counts
//! the crates compiled on Linux.
//!
//! | feature | what it adds | heavy crates | crates |
//! |---|---|---|---|
//! | `none` | [`base`], [`geom`], [`numeric`], [`io`], [`fabric`], [`sim`], [`scan`], [`sensor`], [`refine`], [`exchange`] | | 139 |
//! | `estimate` | [`estimate`], [`job`] | ort, tract | 198 |
//! | `calibrate` | [`calibrate`] | image | 145 |
//! | `dataset` | [`dataset`] | arrow, parquet | 159 |
//! | `picture` | [`picture`] | image, plotters, a font | 150 |
//! | `report` | `calibrate`, `estimate`, `picture`, and [`report`], [`batch`], [`combine`] | statrs | 221 |
//! | `kit` | `report`, and [`kit`] | pdf-writer, pulldown-cmark | 225 |
//! | `terminal` | `calibrate`, `estimate`, and [`terminal`] | clap | 224 |
//! | `cli` | all of it, and the program | | 267 |
//!
//! # Layers
//!
//! Data flows one way through the layers, low to high; a module imports only
//! from layers before its own, and no files import each other in a circle
//! (`tests/house/layering.rs` holds that):
//!
//! `base < geom, numeric < picture < io < fabric < sim < scan < intake < sensor < dataset <
//! estimate < inverse < refine, calibrate < job < report < exchange < batch < combine < kit <
//! terminal < cli`
//!
//! # Units
//!
//! SI units inside (metres, kilograms, seconds, radians). Millimetres, grams
//! and degrees exist at the edges only: [`io`], [`report`] and the
//! command line.
//! The simulation frame is described in [`base::frame`].

#![cfg_attr(docsrs, feature(doc_cfg))]

pub mod base;
#[cfg(feature = "report")]
pub mod batch;
#[cfg(feature = "calibrate")]
pub mod calibrate;
#[cfg(feature = "report")]
pub mod combine;
#[cfg(feature = "dataset")]
pub mod dataset;
#[cfg(feature = "estimate")]
pub mod estimate;
pub mod exchange;
pub mod fabric;
pub mod geom;
pub mod intake;
// part of it is for `calibrate` alone
#[cfg_attr(not(feature = "calibrate"), allow(dead_code, unused_imports))]
mod inverse;
pub mod io;
#[cfg(feature = "estimate")]
pub mod job;
#[cfg(feature = "kit")]
pub mod kit;
pub mod numeric;
#[cfg(feature = "picture")]
pub mod picture;
pub mod refine;
#[cfg(feature = "report")]
pub mod report;
pub mod scan;
pub mod sensor;
pub mod sim;
#[cfg(feature = "terminal")]
pub mod terminal;

pub use base::{Boundary, BoundaryPoint, Isometry3, Point3, Vector3};
#[cfg(feature = "estimate")]
pub use estimate::{Estimate, EstimateError, Estimator};
pub use fabric::Fabric;
pub use geom::{Cloud, Mesh};
pub use io::{ReadError, ReadOptions, WriteError, read_scan, read_scan_with};
#[cfg(feature = "estimate")]
pub use job::{Job, JobError, Outcome};
pub use refine::{ReleasedDrape, StartedFrom, released_drape};
pub use scan::boundary_from_scan;
pub use scan::{LengthUnit, Orientation, ScanError, ScanOptions, ScannedBoundary, WarpToward};
pub use sim::drape::drape;
pub use sim::{Drape, Drop, DropStart, Experiment, SimOptions, Stop};
