//! From a depth-sensor scan of a draped cloth specimen to the six stiffnesses
//! with which a cloth simulator reproduces the drape.
//!
//! Data flows one way through the layers, low to high; a module imports only
//! from layers before its own (`tests/layering.rs` holds that):
//!
//! `base < geom, numeric < picture < io < fabric < sim < scan < sensor < dataset < estimate <
//! refine < calibrate < job < report < batch < evaluate < cli`
//!
//! SI units inside (metres, kilograms, seconds, radians). Millimetres, grams
//! and degrees exist at the edges only: [`io`], [`report`] and the
//! command line.
//! The simulation frame is described in [`base::frame`].

pub mod base;
pub mod batch;
pub mod dataset;
pub mod estimate;
pub mod evaluate;
pub mod fabric;
pub mod geom;
pub mod io;
pub mod job;
pub mod numeric;
pub mod picture;
pub mod refine;
pub mod report;
pub mod scan;
pub mod sensor;
pub mod sim;
