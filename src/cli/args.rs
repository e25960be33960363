//! Flags and verbs. A flag means here what the parameter of the same name means
//! in the library.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{ArgGroup, Args, Parser, Subcommand, ValueEnum};

use super::version;
use scan2params::calibrate::effect::Effect;
use scan2params::calibrate::manifest::Face;
use scan2params::dataset::augment::{Form, Unit};
use scan2params::exchange::{Scene, Target};
use scan2params::fabric::{DEFAULT_PRIOR, Fabric, MEASURED_PRIOR};
use scan2params::io::files_of;
use scan2params::scan::MarkColor;
use scan2params::sensor::{Profile, StandKind, Surroundings};
use scan2params::terminal::experiment::ExperimentFlags;
use scan2params::terminal::flags::{ReadFlags, ScanFlags, Talk, ThreadFlags};
use scan2params::terminal::value::{effect, energy_drop, percent, sensor_edge};
use scan2params::terminal::{Outcome, names};

/// From a depth-sensor scan of a draped cloth to the parameters with which a
/// simulator reproduces it.
#[derive(Debug, Parser)]
#[command(name = "scan2params", version, long_version = version::long(), about, max_term_width = 100)]
#[command(
    override_usage = "scan2params <SCAN> --density <G_PER_M2> [OPTIONS]\n       scan2params <COMMAND> [OPTIONS]"
)]
pub(crate) struct Arguments {
    #[command(flatten)]
    pub(crate) talk: Talk,
    /// File with defaults of flags, or "" for none. If not given: the file that SCAN2PARAMS_CONFIG
    /// names, else scan2params.toml in this folder, else the user's config.toml (`scan2params
    /// config` shows which)
    #[arg(long, global = true, display_order = 103, value_name = "FILE.toml", value_parser = clap::builder::OsStringValueParser::new())]
    pub(crate) config: Option<OsString>,
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
    /// Register views or passes of one drape and write them as one cloud.
    Merge(Merge),
    /// Estimate every scan of a folder, or continue an interrupted run.
    Batch(Batch),
    /// Fit fabrics to measured drapes and predict the held-out drapes.
    Calibrate(Calibrate),
    /// Scan drapes with a virtual depth camera.
    Augment(Augment),
    /// Combine the results of repeated drapes of one fabric into means and intervals.
    Combine(Combine),
    /// Write templates, drawings of the stand, and the protocol of the experiment.
    Kit(Kit),
    /// Simulate the drape of one fabric and write the sheet as OBJ.
    Simulate(Box<Simulate>),
    /// Fill a folder with simulated drapes of fabrics drawn from a prior.
    Generate(Generate),
    /// Write a fabric for another program: CLO, Blender, Newton, MuJoCo, ARCSim, U3M, USD, JSON,
    /// CSV.
    Export(Export),
    /// Convert a stiffness or a density to another unit, a params.json to all of them, or a
    /// measured fabric to one that can be simulated.
    Convert(Convert),
    /// Show the file of defaults, and the value of each flag of a command line.
    Config(Config),
    /// Print the script that completes commands, flags and values in a shell.
    Completions(Completions),
    /// Print the manual, or write a page for each command.
    Man(Man),
    /// Print the version, as --version does.
    #[command(hide = true)]
    Version,
}

impl Command {
    /// Limits the threads of the verbs that compute.
    pub(crate) fn use_threads(&self) -> Outcome {
        let given = match self {
            Self::Estimate(given) => &given.threads,
            Self::Inspect(given) => &given.threads,
            Self::Boundary(given) => &given.threads,
            Self::Merge(given) => &given.threads,
            Self::Batch(given) => &given.threads,
            Self::Calibrate(given) => &given.threads,
            Self::Augment(given) => &given.threads,
            Self::Simulate(given) => &given.threads,
            Self::Generate(given) => &given.threads,
            Self::Combine(_)
            | Self::Kit(_)
            | Self::Export(_)
            | Self::Convert(_)
            | Self::Config(_)
            | Self::Completions(_)
            | Self::Man(_)
            | Self::Version => return Ok(()),
        };
        given.apply()
    }
}

#[derive(Debug, Args)]
pub(crate) struct Combine {
    /// Results of drapes of one fabric, as `estimate --out` and `batch` write them, or folders of
    /// them
    #[arg(required = true, value_name = "PARAMS.json|FOLDER")]
    pub(crate) inputs: Vec<PathBuf>,
    /// File for the combination as JSON, which `simulate --params` reads
    #[arg(long, short, value_name = "FILE.json")]
    pub(crate) out: Option<PathBuf>,
    /// Print JSON instead of the table
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Kit {
    /// Folder for the files
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// The experiment: `square` for scans, `cusick` for silhouettes for `calibrate`
    #[arg(long, value_enum, default_value = "square")]
    pub(crate) bench: KitBench,
    /// Colour of the mark on the specimen, as `estimate --mark` takes it
    #[arg(long, value_name = "COLOUR", default_value = "red", value_parser = mark_name)]
    pub(crate) mark: (String, MarkColor),
}

/// The colour of a mark with its name.
fn mark_name(text: &str) -> Result<(String, MarkColor), String> {
    text.parse()
        .map(|color| (text.to_owned(), color))
        .map_err(|error: <MarkColor as std::str::FromStr>::Err| error.to_string())
}

/// [`scan2params::kit::Kind`] as a flag.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum KitBench {
    Square,
    Cusick,
}

#[derive(Debug, Args)]
pub(crate) struct Config {
    /// A command line of this program; each of its flags is printed with its value and the source
    /// of that value
    #[arg(value_name = "COMMAND", trailing_var_arg = true, allow_hyphen_values = true)]
    pub(crate) line: Vec<OsString>,
}

#[derive(Debug, Args)]
pub(crate) struct Completions {
    /// The shell
    pub(crate) shell: clap_complete::Shell,
}

#[derive(Debug, Args)]
pub(crate) struct Man {
    /// Folder for one page per command; without it the first page is printed
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

/// Which face of a specimen is up.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Side {
    Up,
    Down,
}

impl From<Side> for Face {
    fn from(side: Side) -> Self {
        match side {
            Side::Up => Self::Up,
            Side::Down => Self::Down,
        }
    }
}

impl Estimate {
    /// All files that are read: none of them may be written over.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        let more = self.with.iter();
        let more = more.flat_map(|scan| files_of(scan).unwrap_or_else(|_| vec![scan.clone()]));
        let more = more.chain(self.effects.clone()).chain(self.lab.clone());
        self.scan.files().into_iter().chain(more).collect()
    }
}

/// An areal density in g/m^2; what range it may lie in is the library's to say.
fn density(text: &str) -> Result<f64, String> {
    let remedy = "give a number of g/m^2 alone, with a decimal point, like 182.5; `scan2params convert \
                  5.4 oz/yd^2 --to g/m^2` makes one of another unit";
    text.trim().parse().map_err(|_| remedy.to_owned())
}

#[derive(Clone, Debug, Args)]
pub(crate) struct Estimate {
    // First: what is required stands first in the help.
    /// Areal density of the fabric [g/m^2], 1 to 2000: cut 100 x 100 mm and weigh it in g; times
    /// 100 is g/m^2
    #[arg(long, value_name = "G_PER_M2", value_parser = density)]
    pub(crate) density: f64,
    #[command(flatten)]
    pub(crate) scan: ScanFlags,
    #[command(flatten)]
    pub(crate) threads: ThreadFlags,
    /// Folder for params.json, boundary.csv, boundary.png and report.html. The released drape is
    /// then simulated as with --release. A refused scan gives the picture that `inspect` draws
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print params.json instead of the table
    #[arg(long)]
    pub(crate) json: bool,
    /// Only the network's answer, in two seconds: wider intervals, bending off by 3 to 7 %
    #[arg(long)]
    pub(crate) quick: bool,
    /// Simulate the released drape, which no spring ties to the scan, also without --out
    #[arg(long)]
    pub(crate) release: bool,
    /// Scans of other drapes of the same fabric: one fabric is fitted to all of them. Weft and warp
    /// must be known in each, by its mark or by --warp-toward, which then applies to all
    #[arg(long, value_name = "SCAN", conflicts_with = "quick", num_args = 1..)]
    pub(crate) with: Vec<PathBuf>,
    /// Effects of the cloth beyond the seven parameters, from a params.json that `calibrate` wrote.
    /// The simulator uses them; the network does not know them
    #[arg(long, value_name = "FABRIC.params.json")]
    pub(crate) effects: Option<PathBuf>,
    /// Face of that cloth that is up
    #[arg(long, value_enum, default_value_t = Side::Up, requires = "effects")]
    pub(crate) face: Side,
    /// Exit with code 4 if the verdict is `do not use`; results are still written
    #[arg(long)]
    pub(crate) strict: bool,
    /// Write no report.html in --out
    #[arg(long)]
    pub(crate) no_report: bool,
    /// The laboratory's fields for report.html: specimen_id, composition, construction, thickness,
    /// face, warp_marked, conditioning, scanner, operator, date, remarks; missing ones are left
    /// blank
    #[arg(long, value_name = "FILE.toml|json", requires = "out", conflicts_with = "no_report")]
    pub(crate) lab: Option<PathBuf>,
    /// Simulate the standard Cusick test of the estimated fabric for report.html
    #[arg(long, requires = "out", conflicts_with = "no_report")]
    pub(crate) cusick: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Inspect {
    #[command(flatten)]
    pub(crate) scan: ScanFlags,
    #[command(flatten)]
    pub(crate) threads: ThreadFlags,
    /// Picture of the rim that was found: from above, from the side, flattened
    #[arg(long, short, value_name = "FILE.png")]
    pub(crate) out: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Merge {
    /// File for the cloud, in the frame and the unit of the first pass, or in metres for views
    #[arg(long, short, value_name = "FILE.ply")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) scan: ScanFlags,
    #[command(flatten)]
    pub(crate) threads: ThreadFlags,
}

#[derive(Debug, Args)]
pub(crate) struct Boundary {
    /// File for the rim: index, side, x, y, z, sigma [mm], observed
    #[arg(long, short, value_name = "FILE.csv")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) scan: ScanFlags,
    #[command(flatten)]
    pub(crate) threads: ThreadFlags,
}

#[derive(Debug, Args)]
#[command(group = ArgGroup::new("densities").args(["density", "density_csv"]).required(true).multiple(true))]
pub(crate) struct Batch {
    /// Folder of scans, with all folders in it
    #[arg(value_name = "FOLDER")]
    pub(crate) folder: PathBuf,
    /// Areal density of the scans [g/m^2], 1 to 2000; the scans in the table of --density-csv have
    /// their own
    #[arg(long, value_name = "G_PER_M2", value_parser = density)]
    pub(crate) density: Option<f64>,
    /// Table `file,density_g_m2[,warp_toward]` with one row per scan
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) density_csv: Option<PathBuf>,
    /// Folder of results. If not given, `FOLDER-results` in the current folder
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) read: ReadFlags,
    /// Only the network's answers: two seconds per scan, wider intervals
    #[arg(long)]
    pub(crate) quick: bool,
    /// Simulate the released drape of each fabric, which no spring ties to the scan
    #[arg(long)]
    pub(crate) release: bool,
    /// Do only part i of N: several machines share DIR, and `--merge` writes the tables in the end
    #[arg(long, value_name = "i/N")]
    pub(crate) shard: Option<scan2params::base::Shard>,
    /// Write the tables and the page from the results of all shards, without any scan
    #[arg(long, conflicts_with = "shard")]
    pub(crate) merge: bool,
    #[command(flatten)]
    pub(crate) threads: ThreadFlags,
    /// Exit with code 3 if a verdict is `do not use`, as for scans without an estimate
    #[arg(long)]
    pub(crate) strict: bool,
    /// Print JSON lines instead of a table
    #[arg(long)]
    pub(crate) json: bool,
    /// Write no report.html, neither for the batch nor for its scans
    #[arg(long)]
    pub(crate) no_report: bool,
    /// Print the scans with their densities, and do nothing else
    #[arg(long)]
    pub(crate) dry_run: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Calibrate {
    /// Table with a row per file: file, kind (silhouette, scan, boundary), fabric, specimen, face
    /// (up, down), capture, density_g_m2, experiment (cusick, square), mm_per_pixel, role (fit,
    /// holdout), warp_toward (bearing in the picture in degrees, anticlockwise from the right; of a
    /// scan as --warp-toward, or mark:COLOUR), observation (1, 2, ... of one drape that settles),
    /// camera_height_mm (above the plate); what is empty is unknown
    #[arg(value_name = "MANIFEST.csv")]
    pub(crate) manifest: PathBuf,
    /// Folder for calibration.json, report.html and a picture of each drape
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Prior of the fabrics
    #[arg(long, default_value = MEASURED_PRIOR, value_parser = names::prior())]
    pub(crate) prior: String,
    /// Vertices on a side of the drapes
    #[arg(long, default_value_t = 61, value_parser = clap::value_parser!(u32).range(31..=201))]
    pub(crate) vertices: u32,
    /// Standard deviation of mm_per_pixel, one scale for all pictures of a fabric [%]. If not
    /// given, the scale is exact, and a wrong scale is one of the effects
    #[arg(long, value_name = "PERCENT", value_parser = percent)]
    pub(crate) scale_sigma: Option<f64>,
    /// For scans: distance by which the scanner shows edges too far out, and its standard deviation
    /// (default 0.1) [mm], as `sensor_edge` reports it for specimens of measured size. If not
    /// given, it is fitted
    #[arg(long, value_name = "MM[,SIGMA]", value_parser = sensor_edge, allow_hyphen_values = true)]
    pub(crate) sensor_edge_mm: Option<[f64; 2]>,
    /// Stiffness of the springs that tie drapes to their outlines: share of the hanging cloth's
    /// weight per millimetre [%], 15 if not given (3.3 for scanned sheets); 0 releases all drapes
    #[arg(long, value_name = "PERCENT", value_parser = hold)]
    pub(crate) hold: Option<f64>,
    /// Effects to leave out, by their names in calibration.json
    #[arg(long, value_name = "EFFECT,...", value_delimiter = ',', value_parser = effect)]
    pub(crate) without: Vec<&'static Effect>,
    /// Print calibration.json instead of the table
    #[arg(long)]
    pub(crate) json: bool,
    /// Write no report.html
    #[arg(long)]
    pub(crate) no_report: bool,
    #[command(flatten)]
    pub(crate) threads: ThreadFlags,
}

/// A share of a weight for each millimetre, of which a few per cent hold any fold.
fn hold(text: &str) -> Result<f64, String> {
    let percent: f64 = text.parse().map_err(|_| format!("`{text}` is no number"))?;
    let fits = (0.0..=100.0).contains(&percent);
    if fits { Ok(percent) } else { Err(format!("{percent} is outside 0 to 100 %")) }
}

#[derive(Debug, Args)]
pub(crate) struct Augment {
    /// A drape as `simulate` writes it (OBJ, mm, simulation frame), a params.json that is simulated
    /// first, a folder of *.obj and *.params.json, or a folder of `generate --sheets`
    #[arg(value_name = "DRAPE.obj|FOLDER")]
    pub(crate) input: PathBuf,
    /// File for one scan, or folder for any number; the truth is written next to each
    #[arg(long, short, value_name = "FILE.ply|DIR")]
    pub(crate) out: PathBuf,
    /// Form of the scans: fused clouds, 16-bit depth images with poses, or the rims that
    /// `boundary` finds
    #[arg(long = "as", value_name = "FORM", value_enum, default_value = "ply")]
    pub(crate) form: AugmentForm,
    /// Kind of sensor; phone, d435 and handheld have the noise of real recordings
    #[arg(long, default_value = "structured-light", value_parser = names::profile())]
    pub(crate) profile: Profile,
    /// Support of the plate; its sizes are random for each scan. If not given, the stand of the
    /// experiment
    #[arg(long, value_name = "STAND", conflicts_with = "even", value_parser = names::stand())]
    pub(crate) stand: Option<StandKind>,
    /// Surroundings, random for each scan: no floor (bare), a table, a wide floor (open), or a wide
    /// floor with clutter, a hand, a wall or a lamp
    #[arg(long, value_name = "SCENE", conflicts_with = "even", value_parser = names::surroundings())]
    pub(crate) scene: Option<Surroundings>,
    /// Radius of the plate's rounded edge [mm]. If not given, random from 1 to 5 for a --stand
    #[arg(long, value_name = "MM", conflicts_with = "even", value_parser = rounding_mm)]
    pub(crate) rounded: Option<f64>,
    /// Unit of the clouds; `either` takes one at random for each
    #[arg(long, value_enum, default_value = "profile")]
    pub(crate) unit: AugmentUnit,
    /// No camera: this many points spread evenly over cloth and floor, in metres, with
    /// the profile's noise; for measuring speed. Needs --out FILE.ply
    #[arg(long, value_name = "POINTS", conflicts_with = "mark")]
    pub(crate) even: Option<usize>,
    /// Colour a mark on each drape, in the middle of the side to which the warp runs;
    /// depth images have no colours
    #[arg(long, value_name = "COLOUR")]
    pub(crate) mark: Option<MarkColor>,
    /// Seed of the noise, the scanner's frame and the positions of the cameras
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Variants of each drape
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) count: u64,
    #[command(flatten)]
    pub(crate) threads: ThreadFlags,
}

/// A plate's rounding, 0 for a sharp edge.
fn rounding_mm(text: &str) -> Result<f64, String> {
    const MOST_MM: f64 = 10.0;
    let value: f64 = text.parse().map_err(|_| format!("`{text}` is no number"))?;
    let fits = (0.0..=MOST_MM).contains(&value);
    if fits { Ok(value) } else { Err(format!("{value} mm; it must lie in 0 to {MOST_MM} mm")) }
}

/// [`Form`] as a flag.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum AugmentForm {
    Ply,
    Depth,
    Boundary,
}

impl From<AugmentForm> for Form {
    fn from(form: AugmentForm) -> Self {
        match form {
            AugmentForm::Ply => Self::Ply,
            AugmentForm::Depth => Self::Depth,
            AugmentForm::Boundary => Self::Boundary,
        }
    }
}

/// [`Unit`] as a flag.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum AugmentUnit {
    Profile,
    M,
    Mm,
    Either,
}

impl From<AugmentUnit> for Unit {
    fn from(unit: AugmentUnit) -> Self {
        match unit {
            AugmentUnit::Profile => Self::OfProfile,
            AugmentUnit::M => Self::Metre,
            AugmentUnit::Mm => Self::Millimetre,
            AugmentUnit::Either => Self::Either,
        }
    }
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
    #[arg(long, value_name = "D", required_unless_present = "params", value_parser = density)]
    pub(crate) density: Option<f64>,
    /// File with the seven parameters, as `estimate` writes it: params.json. Flags override it
    #[arg(long, value_name = "FILE")]
    pub(crate) params: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct Simulate {
    /// File for the sheet: OBJ, mm, simulation frame
    #[arg(long, short, value_name = "DRAPE.obj")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) fabric: FabricFlags,
    /// Face of the cloth that is up, for effects that `calibrate` wrote into `--params`
    #[arg(long, value_enum, default_value_t = Side::Up, requires = "params")]
    pub(crate) face: Side,
    /// Seed of a perturbed drop. If not given, the canonical drop
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    /// Start from this mesh of the specimen instead of a drop: OBJ or PLY, mm, simulation frame.
    /// Either `simulate` wrote it, with any number of vertices, or it is an OBJ whose texture
    /// coordinates run along warp and weft from the corner (-x, -z), from 0 to 1 or in mm
    #[arg(long, value_name = "SHEET.obj", conflicts_with = "seed")]
    pub(crate) start: Option<PathBuf>,
    /// Vertices on a side of the specimen
    #[arg(long, default_value_t = 61, value_parser = clap::value_parser!(u64).range(21..=241))]
    pub(crate) vertices: u64,
    /// Version of the numerics: 4, of the network's training data, or 3
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(3..=4))]
    pub(crate) numerics: u32,
    #[command(flatten)]
    pub(crate) threads: ThreadFlags,
    /// File for the rim as 244 points: index, side, x, y, z, sigma [mm], observed
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) boundary: Option<PathBuf>,
    /// Print the report as JSON
    #[arg(long)]
    pub(crate) json: bool,
    // Last: its heading is that of all flags after it.
    #[command(flatten)]
    pub(crate) experiment: ExperimentFlags,
}

#[derive(Debug, Args)]
pub(crate) struct Generate {
    /// Folder for the Parquet files; the same command continues an interrupted run
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Drapes of the whole run
    #[arg(long, default_value_t = 2000, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) count: u64,
    /// Seed of the whole run
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Prior of the fabrics
    #[arg(long, default_value = DEFAULT_PRIOR, value_parser = names::prior())]
    pub(crate) prior: String,
    /// Do only part i of N
    #[arg(long, value_name = "i/N", default_value = "0/1")]
    pub(crate) shard: scan2params::base::Shard,
    /// Drops of each fabric
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) drops_per_fabric: u64,
    /// Continue each sheet from fabric to neighbouring fabric, ROWS drapes per drop (a divisor of
    /// 64)
    #[arg(
        long, value_name = "ROWS", num_args = 0..=1, require_equals = true,
        default_missing_value = "16", conflicts_with = "drops_per_fabric",
        value_parser = clap::value_parser!(u64).range(1..)
    )]
    pub(crate) walk: Option<u64>,
    /// Use the canonical drop for every sheet, as the paper does, instead of perturbed drops
    #[arg(long, conflicts_with_all = ["drops_per_fabric", "walk"])]
    pub(crate) canonical: bool,
    /// Write each drape's sheet as well: DIR/sheets/drape-NNNNNNNN.ply (mm, simulation frame) with
    /// its params.json, which `augment DIR` scans
    #[arg(long)]
    pub(crate) sheets: bool,
    /// End a drape when a cycle of the descent lowers the energy by less than this share: 0 for
    /// full rest [default: 1e-4, with --walk 1e-5]
    #[arg(long, value_name = "SHARE", value_parser = energy_drop)]
    pub(crate) energy_drop: Option<f64>,
    /// Vertices on a side of the drapes; the shipped model's training drapes have 61 (four in
    /// five), 91 and 121
    #[arg(long, default_value_t = 61, value_parser = clap::value_parser!(u32).range(31..=241))]
    pub(crate) vertices: u32,
    #[command(flatten)]
    pub(crate) threads: ThreadFlags,
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

#[derive(Debug, Args)]
pub(crate) struct Export {
    /// The fabric, as `estimate` writes it: params.json
    #[arg(value_name = "PARAMS.json")]
    pub(crate) params: PathBuf,
    /// Program or format of the file
    #[arg(long, value_name = "TARGET", value_parser = names::target(), ignore_case = true)]
    pub(crate) to: Target,
    /// File to write, with the ending of its target
    #[arg(long, short, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// Write the whole experiment, which the program brings to rest: plate, cloth, gravity,
    /// friction and solver settings, for mujoco, newton and blender
    #[arg(long, value_name = "SCENE", value_parser = names::scene())]
    pub(crate) scene: Option<Scene>,
    /// Name of the material. If not given, that of PARAMS.json
    #[arg(long)]
    pub(crate) name: Option<String>,
    /// Length of the edges of the cloth's mesh in the program [mm]. blender needs it, and newton
    /// for its solver VBD; mujoco, usd and --scene mesh the specimen with it (default 10)
    #[arg(long, value_name = "MM")]
    pub(crate) edge_mm: Option<f64>,
    /// Triangles of the cloth's mesh in newton and arcsim
    #[arg(long, value_enum, default_value_t = MeshKind::Irregular)]
    pub(crate) mesh: MeshKind,
    /// Thickness of the fabric [mm], which a drape cannot show, for clo, u3m and usd
    #[arg(long, value_name = "MM")]
    pub(crate) thickness_mm: Option<f64>,
    /// Friction of the fabric, which a drape cannot show, for clo, blender, mujoco, u3m, usd and
    /// --scene (default there 0.3)
    #[arg(long, value_name = "COEFFICIENT")]
    pub(crate) friction: Option<f64>,
    /// Exchange weft and warp, for clo, whose order is not verified
    #[arg(long)]
    pub(crate) swap_warp_weft: bool,
    /// Export a result even if its verdict is `do not use`
    #[arg(long)]
    pub(crate) force: bool,
}

/// Triangles of a mesh elsewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum MeshKind {
    /// Triangles without a common direction.
    Irregular,
    /// Square cells along the yarns, all diagonals one way.
    Grid,
}

#[derive(Debug, Args)]
pub(crate) struct Convert {
    /// A number; a params.json, which is printed in the units of the paper, SI, textile
    /// laboratories and CLO; or a fabric that Browzwear's tester measured (.u3m, or its physics
    /// JSON), whose values are printed as given and as its raw series have them
    #[arg(value_name = "VALUE|FILE", allow_negative_numbers = true)]
    pub(crate) what: String,
    /// The number's unit. Stretch and shear: "g/s^2", "N/m", "gf/cm", "gf/(cm deg)" (KES shear),
    /// clo-slider. Bending: "g mm^2 s^-2 rad^-1", "N m", "uN m", "gf cm^2/cm" (KES), "dyn cm", mm
    /// (bending length, with --density). Density: "g/m^2", "kg/m^2", "g/cm^2", "g/mm^2", "mg/cm^2",
    /// "oz/yd^2"
    #[arg(value_name = "UNIT", requires = "to")]
    pub(crate) unit: Option<String>,
    /// The unit to convert to
    #[arg(long, value_name = "UNIT")]
    pub(crate) to: Option<String>,
    /// Areal density, for bending lengths, and for a measured fabric without mass [g/m^2]
    #[arg(long, value_name = "G_PER_M2", value_parser = density)]
    pub(crate) density: Option<f64>,
    /// Of a measured fabric: file to write it to, for `simulate --params`
    #[arg(long, short, value_name = "PARAMS.json")]
    pub(crate) out: Option<PathBuf>,
    /// Of a measured fabric: the values to write, those that the tester gives or those from its
    /// raw series; where one is missing, the other [default: given]
    #[arg(long, value_enum, value_name = "WHICH", requires = "out")]
    pub(crate) values: Option<MeasuredValues>,
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// Which values of a measured fabric are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum MeasuredValues {
    /// Those that the tester gives.
    Given,
    /// Those from its raw series.
    Recomputed,
}
