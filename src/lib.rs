//! From a depth-sensor scan of a draped cloth specimen to the six stiffnesses
//! with which a cloth simulator reproduces the drape.
//!
//! Data flows one way through the layers, low to high; a module imports only
//! from layers before its own (`tests/layering.rs` holds that):
//!
//! `base < geom, numeric < io < fabric < sim < scan < sensor < dataset <
//! estimate < refine < calibrate < report < cli`
//!
//! SI units inside (metres, kilograms, seconds, radians). Millimetres, grams
//! and degrees exist at the edges only: [`io`], [`report`] and [`cli`].
//! The simulation frame is described in [`base::frame`].

pub mod base;
pub mod cli;
pub mod dataset;
pub mod estimate;
pub mod fabric;
pub mod geom;
pub mod io;
pub mod numeric;
pub mod refine;
pub mod report;
pub mod scan;
pub mod sensor;
pub mod sim;
