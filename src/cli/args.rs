//! Flags and verbs. A flag means here what the parameter of the same name means
//! in the library.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

use crate::fabric::Fabric;
use crate::scan::{LengthUnit, ScanOptions, WarpToward};

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
    /// Estimate the six stiffnesses of the fabric in a scan (the default verb).
    Estimate(Estimate),
    /// Print and draw what is found in a scan.
    Inspect(Inspect),
    /// Write the rim of a scan as 244 points.
    Boundary(Boundary),
    /// Scan a drape with a virtual depth camera.
    Augment(Augment),
    /// Measure what this program promises, and print the tables.
    #[command(subcommand)]
    Evaluate(Evaluate),
    /// Drape one fabric and write the sheet as OBJ.
    Simulate(Simulate),
    /// Fill a folder with simulated drapes of fabrics drawn from a prior.
    Generate(Generate),
}

/// Verbs: anything else in the first place is the input of `estimate`.
const VERBS: [&str; 8] =
    ["estimate", "inspect", "boundary", "simulate", "generate", "augment", "evaluate", "help"];

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

/// How a scan is read.
#[derive(Debug, Args)]
pub(crate) struct ScanFlags {
    /// The scan: PLY, OBJ, PCD, STL, XYZ
    #[arg(value_name = "INPUT")]
    pub(crate) input: PathBuf,
    /// Where the warp points in the scan's frame: +x, -y, ..., three numbers x,y,z,
    /// or a bearing in degrees (counter-clockwise from above, from the scan's x axis)
    #[arg(long, value_name = "DIRECTION", value_parser = warp_toward, allow_hyphen_values = true)]
    pub(crate) warp_toward: Option<WarpToward>,
    /// Unit of the file's coordinates; guessed from the scene if not given
    #[arg(long, value_parser = unit, value_name = "m|mm")]
    pub(crate) unit: Option<LengthUnit>,
    /// Seed of the plane search
    #[arg(long, default_value_t = 0)]
    pub(crate) seed: u64,
}

impl ScanFlags {
    pub(crate) fn options(&self) -> ScanOptions {
        ScanOptions {
            unit: self.unit,
            warp_toward: self.warp_toward,
            seed: self.seed,
            ..ScanOptions::default()
        }
    }
}

fn unit(text: &str) -> Result<LengthUnit, String> {
    match text {
        "m" => Ok(LengthUnit::Metre),
        "mm" => Ok(LengthUnit::Millimetre),
        _ => Err("give m or mm".into()),
    }
}

fn warp_toward(text: &str) -> Result<WarpToward, String> {
    let axis = |sign: f64, name: &str| match name {
        "x" => Some([sign, 0.0, 0.0]),
        "y" => Some([0.0, sign, 0.0]),
        "z" => Some([0.0, 0.0, sign]),
        _ => None,
    };
    let named = match text.split_at_checked(1) {
        Some(("+", name)) => axis(1.0, name),
        Some(("-", name)) => axis(-1.0, name),
        _ => axis(1.0, text),
    };
    if let Some(direction) = named {
        return Ok(WarpToward::Direction(direction));
    }
    let numbers: Option<Vec<f64>> = text
        .split(',')
        .map(|part| part.trim().parse().ok().filter(|v: &f64| v.is_finite()))
        .collect();
    match numbers.as_deref() {
        Some([degrees]) => Ok(WarpToward::BearingDeg(*degrees)),
        Some(&[x, y, z]) if [x, y, z] != [0.0; 3] => Ok(WarpToward::Direction([x, y, z])),
        _ => Err("give +x, -x, +y, ..., x,y,z or a bearing in degrees".into()),
    }
}

#[derive(Debug, Args)]
pub(crate) struct Estimate {
    #[command(flatten)]
    pub(crate) scan: ScanFlags,
    /// Areal density of the fabric [g/m^2], 1 to 2000
    #[arg(long, value_name = "G_PER_M2")]
    pub(crate) density: f64,
    /// Folder for params.json, boundary.csv and boundary.png; the estimate is then
    /// draped again and held against the scan
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print params.json instead of the table
    #[arg(long)]
    pub(crate) json: bool,
    /// Drape the estimate again even without --out
    #[arg(long)]
    pub(crate) resimulate: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Inspect {
    #[command(flatten)]
    pub(crate) scan: ScanFlags,
    /// Picture of what was found: top, side, unrolled
    #[arg(long, short, value_name = "FILE.png")]
    pub(crate) out: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Boundary {
    #[command(flatten)]
    pub(crate) scan: ScanFlags,
    /// The rim: index, side, x, y, z, sigma [mm], observed
    #[arg(long, short, value_name = "FILE.csv")]
    pub(crate) out: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct Augment {
    /// A drape as `simulate` writes it: OBJ, mm, simulation frame
    #[arg(value_name = "DRAPE.obj")]
    pub(crate) input: PathBuf,
    /// The scan; its true frame and unit go to <stem>.truth.json beside it
    #[arg(long, short, value_name = "FILE.ply")]
    pub(crate) out: PathBuf,
    /// Kind of sensor: ideal, structured-light, truedepth, consumer
    #[arg(long, default_value = "structured-light")]
    pub(crate) profile: String,
    /// Seed of noise and of the scanner's frame
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
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

#[derive(Debug, Subcommand)]
pub(crate) enum Evaluate {
    /// Rim error against the truth, stated sigmas and refusals: drapes x sensors x seeds.
    Scan {
        /// Drapes as `simulate` writes them, or folders of them
        #[arg(required = true, value_name = "DRAPE.obj|DIR")]
        drapes: Vec<PathBuf>,
        /// Sensor profiles; with @top, the view from above alone
        #[arg(
            long,
            value_delimiter = ',',
            default_value = "structured-light,truedepth,consumer,structured-light@top"
        )]
        profiles: Vec<String>,
        /// Scans of each drape with each profile
        #[arg(long, default_value_t = 2)]
        seeds: u64,
        /// The first of the seeds
        #[arg(long, default_value_t = 1)]
        first_seed: u64,
        /// Folder for a picture of each rim found, on the true one
        #[arg(long, value_name = "DIR")]
        pictures: Option<PathBuf>,
    },
    /// How far the rims of `generate` are from those of full rest on the default grid,
    /// and how far two drops of one fabric are from each other.
    Dataset {
        /// Fabrics
        #[arg(long, default_value_t = 8)]
        count: u64,
        /// Seed of fabrics and drops
        #[arg(long, default_value_t = 1)]
        seed: u64,
    },
    /// Processor time and end of drapes over fabrics of the prior.
    Speed {
        /// Fabrics
        #[arg(long, default_value_t = 20)]
        count: u64,
        /// Seed of fabrics and drops
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Simulate as `generate` does: coarser, and not to full rest
        #[arg(long)]
        dataset: bool,
    },
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
    /// The rim as 244 points as well: index, side, x, y, z, sigma [mm], observed
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) boundary: Option<PathBuf>,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_input_without_a_verb_is_estimated() {
        let given = |words: &[&str]| {
            let words = words.iter().map(OsString::from);
            with_default_verb(words)
                .into_iter()
                .map(|w| w.into_string().unwrap())
                .collect::<Vec<_>>()
        };
        assert_eq!(given(&["s", "a.ply", "--density", "180"])[1], "estimate");
        assert_eq!(given(&["s", "simulate"])[1], "simulate");
        assert_eq!(given(&["s", "--help"]), ["s", "--help"]);
        assert_eq!(given(&["s"]), ["s"]);
    }

    #[test]
    fn every_verb_is_known_to_the_default_verb() {
        use clap::CommandFactory as _;
        for verb in Arguments::command().get_subcommands() {
            assert!(VERBS.contains(&verb.get_name()), "{}", verb.get_name());
        }
        Arguments::command().debug_assert();
    }

    #[test]
    fn directions_and_bearings() {
        assert_eq!(warp_toward("+x"), Ok(WarpToward::Direction([1.0, 0.0, 0.0])));
        assert_eq!(warp_toward("-z"), Ok(WarpToward::Direction([0.0, 0.0, -1.0])));
        assert_eq!(warp_toward("0.5,0,-2"), Ok(WarpToward::Direction([0.5, 0.0, -2.0])));
        assert_eq!(warp_toward("-35"), Ok(WarpToward::BearingDeg(-35.0)));
        for wrong in ["", "+w", "1,2", "0,0,0", "nan"] {
            assert!(warp_toward(wrong).is_err(), "{wrong}");
        }
    }
}
