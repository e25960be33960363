//! Flags and verbs. A flag means here what the parameter of the same name means
//! in the library.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

use crate::fabric::Fabric;

/// From a depth-sensor scan of a draped cloth to the parameters with which a
/// simulator reproduces it.
#[derive(Debug, Parser)]
#[command(name = "scan2params", version, about, max_term_width = 100)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Drape one fabric and write the sheet as OBJ.
    Simulate(Simulate),
    /// Fill a folder with simulated drapes of fabrics drawn from a prior.
    Generate(Generate),
}

/// Verbs: anything else in the first place is the input of `estimate`.
const VERBS: [&str; 7] =
    ["estimate", "inspect", "boundary", "simulate", "generate", "augment", "help"];

/// Puts the verb `estimate` in front of an input file given without a verb.
pub(crate) fn with_default_verb(arguments: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    let mut arguments: Vec<_> = arguments.into_iter().collect();
    let info = ["-h", "--help", "-V", "--version"];
    let verb_needed = arguments
        .get(1)
        .is_some_and(|first| !VERBS.iter().chain(&info).any(|known| first.as_os_str() == *known));
    if verb_needed {
        arguments.insert(1, "estimate".into());
    }
    arguments
}

/// The seven parameters of a fabric, in the paper's units.
#[derive(Debug, Args)]
pub(crate) struct FabricFlags {
    /// Weft stretch stiffness S^u [g/s^2]
    #[arg(long, value_name = "S", required_unless_present = "params")]
    pub(crate) stretch_weft: Option<f64>,
    /// Warp stretch stiffness S^v [g/s^2]
    #[arg(long, value_name = "S", required_unless_present = "params")]
    pub(crate) stretch_warp: Option<f64>,
    /// Shear stiffness H [g/s^2]
    #[arg(long, value_name = "H", required_unless_present = "params")]
    pub(crate) shear: Option<f64>,
    /// Weft bending stiffness B^u [g mm^2 s^-2 rad^-1]
    #[arg(long, value_name = "B", required_unless_present = "params")]
    pub(crate) bending_weft: Option<f64>,
    /// Warp bending stiffness B^v [g mm^2 s^-2 rad^-1]
    #[arg(long, value_name = "B", required_unless_present = "params")]
    pub(crate) bending_warp: Option<f64>,
    /// Bias (45 degrees) bending stiffness B^h [g mm^2 s^-2 rad^-1]
    #[arg(long, value_name = "B", required_unless_present = "params")]
    pub(crate) bending_bias: Option<f64>,
    /// Areal density D [g/m^2]
    #[arg(long, value_name = "D", required_unless_present = "params")]
    pub(crate) density: Option<f64>,
    /// Take them from a params.json that `estimate` wrote; flags override
    #[arg(long, value_name = "FILE")]
    pub(crate) params: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct Simulate {
    #[command(flatten)]
    pub(crate) fabric: FabricFlags,
    /// Seed of a perturbed drop; without it the canonical drop
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    /// Vertices on a side of the specimen
    #[arg(long, default_value_t = 61, value_parser = clap::value_parser!(u64).range(21..=241))]
    pub(crate) vertices: u64,
    /// Threads (one drape uses one)
    #[arg(long, default_value_t = 1)]
    pub(crate) threads: usize,
    /// The sheet as OBJ, mm, simulation frame
    #[arg(long, short, value_name = "DRAPE.obj")]
    pub(crate) out: PathBuf,
    /// Print the report as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Generate {
    /// Folder of Parquet files; an interrupted run is taken up again
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Drapes of the whole run
    #[arg(long, default_value_t = 2000)]
    pub(crate) count: u64,
    /// Seed of the whole run
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Mixture that the fabrics are drawn from
    #[arg(long, default_value = "knit-2020")]
    pub(crate) prior: String,
    /// Make part i of N only
    #[arg(long, value_name = "i/N", default_value = "0/1")]
    pub(crate) shard: crate::dataset::Shard,
    /// Drops of each fabric
    #[arg(long, default_value_t = 1)]
    pub(crate) drops_per_fabric: u64,
    /// Drapes at once; 0: one per core
    #[arg(long, default_value_t = 0)]
    pub(crate) threads: usize,
}

impl FabricFlags {
    /// The fabric of the flags alone, if all are given.
    pub(crate) fn fabric(&self) -> Option<Fabric> {
        Some(Fabric::from_paper_units([
            self.stretch_weft?,
            self.stretch_warp?,
            self.shear?,
            self.bending_weft?,
            self.bending_warp?,
            self.bending_bias?,
            self.density?,
        ]))
    }
}
