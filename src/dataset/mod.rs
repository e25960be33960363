//! Training data: drapes of fabrics drawn from a prior, in Parquet.
//!
//! In: [`GenerateOptions`] and a simulator (a function from a fabric to a
//! [`SimulatedRow`]). Out: a folder with one Parquet file per chunk of
//! consecutive samples and a `manifest.json` that says how they were made.
//!
//! Sample k is the same bytes for any shard, order and thread, so a
//! folder can be filled by many machines, and an interrupted run continues where it
//! was: the rows of a chunk lie in `drapes-NNNNNN.partial` until it is complete. A kill
//! loses the samples under way (one a thread), a power cut the chunks under way.
//!
//! Where it fails: one process at a time makes a shard; another is refused and told who
//! does (`shard-I-of-N.lock`). Of shardings that overlap both make the same bytes, twice.
//!
//! With [`Walks`] sheets are continued from fabric to fabric ([`drapes::walk`]): row k is then of
//! fabric `fabric_index` of the prior in the order of the walks, and a walk is lost as a whole
//! where a kill meets it.
//!
//! Columns, one row per drape:
//!
//! | column | type | unit |
//! |---|---|---|
//! | `index`, `fabric_index` | int64 | |
//! | `stretch_weft`, `stretch_warp`, `shear` | double | g/s^2 |
//! | `bending_weft`, `bending_warp`, `bending_bias` | double | g mm^2 s^-2 rad^-1 |
//! | `density` | double | g/m^2 |
//! | `boundary_mm` | 2928 bytes: 732 little-endian f32, x y z per point, in the order of [`crate::base::boundary`] | mm |
//! | `at_rest`, `stable` | boolean | |
//! | `stop` | string: why the simulation ended | |
//! | `node_count` | int32 | |
//! | `energy_j` | double | J |
//! | `residual_n` | double | N |
//! | `walked` | boolean: continued from the row before, not dropped; absent in files without walks | |
//!
//! A drape that did not come to rest is a row like any other (`at_rest` false):
//! what is left out of a training is decided where it is trained, and can be
//! counted. Times are not in it: they differ from run to run.

pub mod augment;
pub mod drape_file;
pub mod drapes;
mod error;
mod fabrics;
mod generate;
mod manifest;
mod options;
mod row;
pub mod setting;
pub mod sheet_file;
mod table;
mod walk;

pub use error::GenerateError;
pub use generate::{Progress, Summary, generate};
pub use manifest::{MANIFEST_FILE, Manifest};
pub use options::GenerateOptions;
pub use row::{Row, Sample, SimulatedRow};
pub use table::{TableError, read_file, read_folder};
pub use walk::Walks;
