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
//! [`columns`] has the columns, one row per drape, with their units; the files have them as
//! metadata, too. `README.md` is the data card of the folder, written once. With
//! [`GenerateOptions::sheets`] the folder `sheets` has each drape's mesh and fabric.
//!
//! A drape that did not converge is a row like any other (`converged` false):
//! what is left out of a training is decided where it is trained, and can be
//! counted. Times are not in it: they differ from run to run.

pub mod augment;
mod card;
pub mod columns;
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
mod sheets;
mod table;
mod walk;

pub use card::CARD_FILE;
pub use error::GenerateError;
pub use generate::{Progress, Summary, generate};
pub use manifest::{MANIFEST_FILE, Manifest};
pub use options::GenerateOptions;
pub use row::{Ending, Row, Sample, Simulated, SimulatedRow};
pub use sheets::SHEETS_FOLDER;
pub use table::{TableError, read_file, read_folder};
pub use walk::Walks;
