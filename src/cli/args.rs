//! Flags and verbs. A flag means here what the parameter of the same name means
//! in the library.

use std::ffi::OsString;
use std::path::PathBuf;

use anyhow::anyhow;
use clap::{ArgGroup, Args, Parser, Subcommand, ValueEnum};

use super::Failure;
use super::experiment::ExperimentFlags;
use super::names;
use super::version;
use scan2params::base::frame::{PLATE_RADIUS_M, SPECIMEN_SIDE_M};
use scan2params::base::units::{LIKELY_SCALES, M_PER_MM};
use scan2params::calibrate::effect::{EFFECTS, Effect};
use scan2params::calibrate::manifest::Face;
use scan2params::dataset::augment::{Form, Unit};
use scan2params::exchange::{Scene, Target};
use scan2params::fabric::{DEFAULT_PRIOR, Fabric, MEASURED_PRIOR, UNION_PRIOR};
use scan2params::intake::hints::{parse_crop, parse_place, parse_up};
use scan2params::intake::rim::parse_warp_toward;
use scan2params::io::{
    DepthSource, Format, Intrinsics, ReadOptions, files_of, intrinsics, is_views_folder,
};
use scan2params::scan::{Crop, LengthUnit, MarkColor, ScanOptions, WarpToward};
use scan2params::sensor::{Profile, StandKind, Surroundings};

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
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// How much is printed on stderr.
#[derive(Debug, Args)]
pub(crate) struct Talk {
    /// Print only warnings and errors on stderr
    #[arg(long, short, global = true, display_order = 101, conflicts_with = "verbose")]
    pub(crate) quiet: bool,
    /// Print each step and its time on stderr, even if stderr is not a terminal
    #[arg(long, short, global = true, display_order = 102)]
    pub(crate) verbose: bool,
    /// File with defaults of flags, or "" for none. If not given: the file that SCAN2PARAMS_CONFIG
    /// names, else scan2params.toml in this folder, else the user's config.toml (`scan2params
    /// config` shows which)
    #[arg(long, global = true, display_order = 103, value_name = "FILE.toml", value_parser = clap::builder::OsStringValueParser::new())]
    pub(crate) config: Option<OsString>,
}

/// How many threads are used.
#[derive(Clone, Debug, Args)]
pub(crate) struct ThreadFlags {
    /// Number of threads at most, or 0 for one per core. No result depends on it; one drape is
    /// computed on one
    #[arg(long, global = true, display_order = 100, value_name = "N", default_value = "0", value_parser = threads)]
    pub(crate) threads: usize,
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
    /// Measure the accuracy of this program and print the tables.
    #[command(hide = true)]
    Evaluate(EvaluateGiven),
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
    /// How many threads are wanted, of those that compute.
    pub(crate) fn threads(&self) -> usize {
        let given = match self {
            Self::Estimate(given) => &given.threads,
            Self::Inspect(given) => &given.threads,
            Self::Boundary(given) => &given.threads,
            Self::Merge(given) => &given.threads,
            Self::Batch(given) => &given.threads,
            Self::Calibrate(given) => &given.threads,
            Self::Augment(given) => &given.threads,
            Self::Evaluate(given) => &given.threads,
            Self::Simulate(given) => &given.threads,
            Self::Generate(given) => &given.threads,
            Self::Combine(_)
            | Self::Kit(_)
            | Self::Export(_)
            | Self::Convert(_)
            | Self::Config(_)
            | Self::Completions(_)
            | Self::Man(_)
            | Self::Version => return 0,
        };
        given.threads
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

/// `evaluate`.
#[derive(Debug, Args)]
pub(crate) struct EvaluateGiven {
    #[command(flatten)]
    pub(crate) threads: ThreadFlags,
    #[command(subcommand)]
    pub(crate) what: Evaluate,
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

/// A scan, and how it is read.
#[derive(Clone, Debug, Args)]
pub(crate) struct ScanFlags {
    /// The scan: PLY, OBJ, PCD, STL, GLB, E57, LAS, LAZ, XYZ, 16-bit depth PNG, views.json or its
    /// folder. `estimate` also takes a rim that `boundary` wrote; `-` with --format is the standard
    /// input
    #[arg(value_name = "INPUT")]
    pub(crate) input: PathBuf,
    /// More recordings of the same drape, unmoved, each in any frame; all are registered
    #[arg(value_name = "PASS")]
    pub(crate) passes: Vec<PathBuf>,
    /// Format of INPUT, for any file name
    #[arg(long, value_name = "NAME", value_parser = names::format(), ignore_case = true)]
    pub(crate) format: Option<Format>,
    #[command(flatten)]
    pub(crate) read: ReadFlags,
}

impl ScanFlags {
    /// What the flags say of the file.
    pub(crate) fn read_options(&self) -> Result<ReadOptions, Failure> {
        if self.input.as_os_str() == "-" && self.format.is_none() {
            let why = "`-` is the standard input, which needs a format, as in `- --format ply`";
            return Err(Failure::usage(anyhow!(why)));
        }
        if self.input.is_dir() && !is_views_folder(&self.input) {
            let why = "is a folder, not a scan; `batch FOLDER` estimates every scan in it (a folder of views has a \
                       views.json, or camera-intrinsics.txt, *.depth.png and *.pose.txt)";
            return Err(anyhow!("{}: {why}", self.input.display()).into());
        }
        let name = self.input.file_name().unwrap_or_default().to_string_lossy();
        if name.ends_with(".params.json") {
            let why = "is a fabric that was found already, no scan; `export`, `convert`, `combine` and \
                       `simulate --params` take it, and here the scan is wanted";
            return Err(Failure::usage(anyhow!("{}: {why}", self.input.display())));
        }
        Ok(ReadOptions { format: self.format, passes: self.passes.clone(), ..self.read.read()? })
    }

    /// The files that are read: no result may be one of them.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        // A list of views that cannot be read is an error when it is read.
        let of = |input: &PathBuf| files_of(input).unwrap_or_else(|_| vec![input.clone()]);
        let scans = std::iter::once(&self.input).chain(&self.passes);
        scans.flat_map(of).chain(self.read.intrinsics.clone()).collect()
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

/// How scans are read.
#[derive(Clone, Debug, Args)]
pub(crate) struct ReadFlags {
    /// Where the warp points in the scan's frame: +x, -y, ..., three numbers x,y,z,
    /// or a bearing in degrees (counter-clockwise from above, from the scan's x axis)
    #[arg(long, value_name = "DIRECTION", value_parser = parse_warp_toward, allow_hyphen_values = true)]
    pub(crate) warp_toward: Option<WarpToward>,
    /// Colour of a mark in the middle of the side to which the warp runs, on the
    /// specimen itself: red, orange, yellow, green, cyan, blue, magenta or #rrggbb
    #[arg(long, value_name = "COLOUR", conflicts_with = "warp_toward")]
    pub(crate) mark: Option<MarkColor>,
    /// Unit of the file's coordinates. If not given, guessed from scene and plate
    #[arg(long, value_parser = names::unit(), value_name = "UNIT")]
    pub(crate) unit: Option<LengthUnit>,
    /// Factor by which all lengths of the scan are divided: 1.012 for a scan that is 1.2 % too
    /// large. Positions in other flags are in the divided lengths
    #[arg(long, value_name = "SCALE", value_parser = rescale)]
    pub(crate) rescale: Option<f64>,
    /// Part of the scan that is used: a radius about the plate [mm], or two opposite corners
    /// X1,Y1,Z1,X2,Y2,Z2 of a box in the file's frame and unit
    #[arg(long, value_name = "RADIUS_MM|BOX", value_parser = parse_crop, allow_hyphen_values = true)]
    pub(crate) crop: Option<Crop>,
    /// Up in the scan's frame, to within 20 degrees: x, -x, y, -y, z, -z, or three numbers X,Y,Z.
    /// If not given, found from the cloth
    #[arg(long, value_name = "AXIS", value_parser = parse_up, allow_hyphen_values = true)]
    pub(crate) up: Option<[f64; 3]>,
    /// Position of the plate, to within 100 mm, in the file's frame and unit. If not given, found
    /// from the cloth
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_place, allow_hyphen_values = true)]
    pub(crate) plate_near: Option<[f64; 3]>,
    /// Side of the square specimen [mm]; `estimate` and `batch` take 300 only
    #[arg(long, value_name = "MM", default_value_t = SPECIMEN_SIDE_M / M_PER_MM)]
    pub(crate) specimen_size: f64,
    /// Radius of the plate [mm]; `estimate` and `batch` take 50 only
    #[arg(long, value_name = "MM", default_value_t = PLATE_RADIUS_M / M_PER_MM)]
    pub(crate) plate_radius: f64,
    /// Seed of the plane search
    #[arg(long, default_value_t = 0)]
    pub(crate) seed: u64,
    /// Camera of depth images: Open3D JSON, ROS camera_info YAML, or nine numbers
    #[arg(long, value_name = "FILE", conflicts_with_all = ["fx", "fy", "cx", "cy"])]
    pub(crate) intrinsics: Option<PathBuf>,
    /// Focal length of depth images in x [pixels]
    #[arg(long, value_name = "PIXELS", requires_all = ["fy", "cx", "cy"])]
    pub(crate) fx: Option<f64>,
    /// Focal length in y [pixels]
    #[arg(long, value_name = "PIXELS", requires = "fx")]
    pub(crate) fy: Option<f64>,
    /// Principal point in x [pixels]
    #[arg(long, value_name = "PIXELS", requires = "fx", allow_negative_numbers = true)]
    pub(crate) cx: Option<f64>,
    /// Principal point in y [pixels]
    #[arg(long, value_name = "PIXELS", requires = "fx", allow_negative_numbers = true)]
    pub(crate) cy: Option<f64>,
    /// Source of the depth images, which gives their unit
    #[arg(long, value_name = "NAME", value_parser = names::depth_source(), conflicts_with = "depth_scale")]
    pub(crate) sensor: Option<DepthSource>,
    /// Depth units per metre in depth images
    #[arg(long, value_name = "UNITS_PER_METRE", default_value_t = 1000.0)]
    pub(crate) depth_scale: f64,
    /// Drop pixels of depth images with fewer than three of eight neighbours within
    /// this depth [mm]
    #[arg(long, value_name = "MM")]
    pub(crate) drop_jumps: Option<f64>,
}

impl ReadFlags {
    /// What the flags say of depth images.
    pub(crate) fn read(&self) -> Result<ReadOptions, Failure> {
        let positive = |flag: &str, value: f64| {
            if value.is_finite() && value > 0.0 {
                return Ok(value);
            }
            Err(Failure::usage(anyhow!("--{flag} is {value}; give a positive number")))
        };
        let of_flags = match (self.fx, self.fy, self.cx, self.cy) {
            (Some(fx), Some(fy), Some(cx), Some(cy)) => {
                let pinhole = Intrinsics::pinhole([fx, fy], [cx, cy]);
                Some(pinhole.map_err(|fault| Failure::usage(anyhow!("--fx ...: {fault}")))?)
            }
            _ => None,
        };
        let of_file = self.intrinsics.as_ref().map(intrinsics::read).transpose()?;
        let max_jump_m = self.drop_jumps.map(|mm| positive("drop-jumps", mm)).transpose()?;
        Ok(ReadOptions {
            intrinsics: of_file.or(of_flags),
            depth_scale: match self.sensor {
                Some(sensor) => sensor.units_per_metre,
                None => positive("depth-scale", self.depth_scale)?,
            },
            max_jump_m: max_jump_m.map(|mm| mm * M_PER_MM),
            rescale: self.rescale,
            ..ReadOptions::default()
        })
    }

    pub(crate) fn options(&self) -> Result<ScanOptions, Failure> {
        let [side_m, radius_m] = [self.specimen_size, self.plate_radius].map(|mm| mm * M_PER_MM);
        let experiment = ScanOptions::for_experiment(side_m, radius_m).map_err(Failure::usage)?;
        let options = ScanOptions {
            unit: self.unit,
            warp_toward: self.warp_toward,
            mark: self.mark,
            crop: self.crop,
            up: self.up,
            plate_near: self.plate_near,
            seed: self.seed,
            ..experiment
        };
        options.check_hints().map_err(Failure::usage)?;
        Ok(options)
    }
}

/// An areal density in g/m^2; what range it may lie in is the library's to say.
fn density(text: &str) -> Result<f64, String> {
    let remedy = "give a number of g/m^2 alone, with a decimal point, like 182.5; `scan2params convert \
                  5.4 oz/yd^2 --to g/m^2` makes one of another unit";
    text.trim().parse().map_err(|_| remedy.to_owned())
}

fn key_value(text: &str) -> Result<(String, String), String> {
    let pair = text.split_once('=').ok_or("give STAGE.NAME=VALUE")?;
    Ok((pair.0.to_owned(), pair.1.to_owned()))
}

/// A number of threads that a machine can have; 0 stands for one per core.
fn threads(text: &str) -> Result<usize, String> {
    const MOST: usize = 1024;
    let threads: Option<usize> = text.parse().ok();
    threads.filter(|&threads| threads <= MOST).ok_or_else(|| format!("give 0 to {MOST}"))
}

/// Vertices a side of a fit's grids; fewer than the least show no folds.
fn grids(text: &str) -> Result<[usize; 2], String> {
    const LEAST: usize = 21;
    let counts: Option<Vec<usize>> = text.split(',').map(|count| count.parse().ok()).collect();
    match counts.as_deref() {
        Some(&[first, last]) if first.min(last) >= LEAST => Ok([first, last]),
        _ => Err(format!("give two counts, {LEAST} or more each: 61,111")),
    }
}

/// A scale that a scan can have; others are units.
fn rescale(text: &str) -> Result<f64, String> {
    let scale: Option<f64> = text.trim().parse().ok();
    let likely = scale.filter(|scale| LIKELY_SCALES.contains(scale));
    let [least, most] = [LIKELY_SCALES.start(), LIKELY_SCALES.end()];
    likely.ok_or_else(|| format!("give {least} to {most}, like 1.012; units are for --unit"))
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

/// A scanner's edge relative to the cloth's, and its standard deviation [mm].
fn sensor_edge(text: &str) -> Result<[f64; 2], String> {
    let both: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match both.as_deref() {
        Some(&[mm]) if mm.abs() <= 5.0 => Ok([mm, 0.1]),
        Some(&[mm, sigma]) if mm.abs() <= 5.0 && (0.01..=5.0).contains(&sigma) => Ok([mm, sigma]),
        _ => Err("give -5 to 5 mm, and after a comma a standard deviation of 0.01 to 5".into()),
    }
}

/// An effect by its name.
fn effect(text: &str) -> Result<&'static Effect, String> {
    let names = || EFFECTS.map(|effect| effect.name).join(", ");
    Effect::named(text).ok_or_else(|| format!("no such effect; the effects are {}", names()))
}

/// Of itself, that a cycle of the descent lowers the energy by: beyond a thousandth a sheet is
/// nowhere near rest.
fn energy_drop(text: &str) -> Result<f64, String> {
    let value: Option<f64> = text.parse().ok();
    value.filter(|v| (0.0..=1e-3).contains(v)).ok_or_else(|| "give 0 to 1e-3".into())
}

/// A share in per cent of which a quarter is already absurd.
fn percent(text: &str) -> Result<f64, String> {
    let value: Option<f64> = text.parse().ok();
    value.filter(|v| (0.0..=25.0).contains(v)).ok_or_else(|| "give 0 to 25".into())
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

/// `evaluate follow`.
#[derive(Debug, clap::Args)]
pub(crate) struct Follow {
    /// Prior of the fabrics. If not given, `knit-2020`, then `measured`
    #[arg(long, value_parser = names::prior())]
    pub(crate) prior: Option<String>,
    /// Walks of each prior
    #[arg(long, default_value_t = 4)]
    pub(crate) count: u64,
    /// First walk, to continue an interrupted run
    #[arg(long, default_value_t = 0)]
    pub(crate) first: u64,
    /// Seed of fabrics, drops and directions
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Distance of the neighbour: root mean square of the seven logarithms
    #[arg(long, default_value_t = 0.25)]
    pub(crate) step: f64,
    /// How often a step that leaves its branch is repeated as two halves
    #[arg(long, default_value_t = 0)]
    pub(crate) halvings: u32,
    /// End with a line of JSON for each prior
    #[arg(long)]
    pub(crate) json: bool,
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

#[derive(Debug, Subcommand)]
pub(crate) enum Evaluate {
    /// Rim error against the truth, reported sigmas and refusals: drapes x sensors x seeds.
    Scan {
        /// Drapes as `simulate` writes them, or folders of them
        #[arg(required = true, value_name = "DRAPE.obj|DIR")]
        drapes: Vec<PathBuf>,
        /// Sensor profiles, each with options of the scene after an @, in any order, as in
        /// structured-light@post@below@views8: @top (only the view from above), @below (views from
        /// 40, 5 and -25 degrees instead of 30), @viewsN (N views), @views (every pixel of the
        /// depth images instead of a fused cloud), @post (a plate 6 mm thick on a thin post, no
        /// floor), @pedestal (a column nearly as wide as the plate), @thickN (a plate N mm thick),
        /// @plateN (a plate of N mm radius, for a drape simulated on one), @floorN (a floor N mm
        /// below the plate, 0 for none), @off (the specimen 51 mm off the scanner's axis)
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
        /// Another value of a tuned constant of the scan path, as in `sheet.knot_m=4.5e-3`;
        /// src/scan/tuning.rs lists them. May be repeated
        #[arg(long, value_name = "STAGE.NAME=VALUE", value_parser = key_value)]
        tune: Vec<(String, String)>,
    },
    /// Accuracy, widths and coverage of the estimate on unseen rims, clean and with the scan noise
    /// of the training, by bending length, with a baseline that ignores the scan.
    Estimate(Box<HeldOut>),
    /// Drapes simulated again with the fabrics estimated from their rims: the paper's Figs. 8 and
    /// 9.
    Redrape(Redrape),
    /// The estimate on canonical and on perturbed drops, clean and scanned, of the shipped network
    /// and of others.
    Sensors(Sensors),
    /// Rims of random scenes: sensor x stand x surroundings x fabric x views x unit. Or refusals of
    /// scenes with a known fault.
    Scenes(Box<Scenes>),
    /// Registration of views and passes that are off by up to 20 mm and 5 degrees: their distances
    /// afterwards.
    Views(Views),
    /// The paper's Table 3 and ours from the model's record, each with the size of its data.
    Table3 {
        /// Recompute ours on this folder of `generate`, of another seed than the model's
        #[arg(value_name = "DRAPES")]
        drapes: Option<PathBuf>,
        /// Print the lines as JSON
        #[arg(long)]
        json: bool,
    },
    /// Times of the stages from a scan's file to its rim: processor time of all threads and wall
    /// time. RAYON_NUM_THREADS=1 uses one thread.
    Stages {
        #[command(flatten)]
        scan: Box<ScanFlags>,
        /// Runs; the one with the least processor time is printed
        #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..))]
        repeat: u64,
    },
    /// The simulator against known answers: strips, friction, meshes, Cusick drapes.
    Physics(Physics),
    /// Ends of the drapes of many fabrics, including the corners of Table 2's box.
    Soak {
        /// Prior of the fabrics
        #[arg(long, default_value = DEFAULT_PRIOR, value_parser = names::prior())]
        prior: String,
        /// Fabrics; every eighth is a corner of the box
        #[arg(long, default_value_t = 1024)]
        count: u64,
        /// First fabric, to continue an interrupted run
        #[arg(long, default_value_t = 0)]
        first: u64,
        /// Seed of fabrics and drops
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Version of the numerics: 4 or 3
        #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(3..=4))]
        numerics: u32,
    },
    /// Drapes continued to a neighbouring fabric and back, compared with fresh drapes.
    Follow(Follow),
    /// Processor time and end of drapes over fabrics of the prior.
    Speed {
        /// Fabrics
        #[arg(long, default_value_t = 20)]
        count: u64,
        /// Seed of fabrics and drops
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Simulate as `generate` does, not to full rest
        #[arg(long)]
        dataset: bool,
        /// Vertices per side, one or several; several show how the cost grows
        #[arg(long, value_delimiter = ',', default_value = "61")]
        vertices: Vec<usize>,
        /// Version of the numerics: 4 or 3
        #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(3..=4))]
        numerics: u32,
    },
    /// Figures of the verdict for valid scans and for scans with a known fault.
    Verdict(Verdict),
    /// Distance of the rim at rest from the true one, for scanned drapes of known fabrics that
    /// start from the scanned sheet, guided by the scanned rim, or from the true sheet.
    Start(Start),
    /// Scanned drapes of known fabrics, estimated and refined: rims, errors, intervals, time.
    Refine(Refine),
    /// True fabrics and those found from one scan in experiments that the fit has not seen: Cusick
    /// drape, circle skirt, hung square, cantilever.
    Transfer(Transfer),
    /// Sealed cases: drapes of known fabrics with random effects that `calibrate` does not know.
    /// Effects found, false alarms, errors of held-out drapes.
    Calibrate(SealedCases),
    /// Motion of the rim of one drape with a small change of each parameter.
    Sensitivities {
        /// Seed of the fabric and the drop
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Fabric of the prior
        #[arg(long, default_value_t = 0)]
        index: u64,
    },
}

/// `evaluate estimate`.
#[derive(Debug, Args)]
pub(crate) struct HeldOut {
    /// A folder of `generate` with another seed than the model's. Several drops of a fabric are
    /// also combined, as by `combine`
    #[arg(value_name = "DRAPES", required_unless_present = "count")]
    pub(crate) drapes: Option<PathBuf>,
    /// Simulate drapes of this many fabrics of the model's prior, as `generate` does
    #[arg(long, conflicts_with = "drapes", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) count: Option<u64>,
    /// Seed of their fabrics and drops, and of the scan noise
    #[arg(long, default_value_t = 2)]
    pub(crate) seed: u64,
    /// Draw the fabrics evenly from the prior's whole box instead: most resemble none of the
    /// prior's fabrics
    #[arg(long, requires = "count")]
    pub(crate) anywhere: bool,
    /// A network of scripts/train.py instead of the shipped one, with its .json next to it
    #[arg(long, value_name = "FILE.onnx")]
    pub(crate) model: Option<PathBuf>,
    /// Folder for two pictures: answers over truths, and correlations of the stiffnesses
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print the scores as JSON
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) experiment: ExperimentFlags,
}

/// `evaluate redrape`.
#[derive(Debug, Args)]
pub(crate) struct Redrape {
    /// Prior of the fabrics; `knit-2020` is the paper's
    #[arg(long, default_value = DEFAULT_PRIOR, value_parser = names::prior())]
    pub(crate) prior: String,
    /// Fabrics; the paper has 200
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) count: u64,
    /// The first of them
    #[arg(long, default_value_t = 0)]
    pub(crate) first: u64,
    /// Seed of the fabrics
    #[arg(long, default_value_t = 11)]
    pub(crate) seed: u64,
    /// A network of scripts/train.py instead of the shipped one, with its .json next to it
    #[arg(long, value_name = "FILE.onnx")]
    pub(crate) model: Option<PathBuf>,
    /// End all drapes as `generate --energy-drop` does, 1e-4 as its falls: 0 for full rest
    #[arg(long, value_name = "SHARE", default_value = "0", value_parser = energy_drop)]
    pub(crate) energy_drop: f64,
    /// Fit a linear regression to this folder of `generate`, and drape its answers too
    #[arg(long, value_name = "FOLDER")]
    pub(crate) train: Option<PathBuf>,
    /// Drape the true fabric with all stiffnesses so much higher too: what the drop itself makes of
    /// an error
    #[arg(long, value_name = "PERCENT", value_parser = percent)]
    pub(crate) off: Option<f64>,
    /// Refine the network's answers on the rims, and drape these too: some ten drapes each
    #[arg(long)]
    pub(crate) refine: bool,
    /// Folder for the histogram, `redrape.png`
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Also print the sums as JSON, on the last line
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Sensors {
    /// Prior of the fabrics
    #[arg(long, default_value = UNION_PRIOR, value_parser = names::prior())]
    pub(crate) prior: String,
    /// Inputs of the estimate: `rim` for exact rims, and sensor profiles, as for `evaluate scan`
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "rim,structured-light,truedepth,consumer",
        value_name = "PROFILES"
    )]
    pub(crate) profiles: Vec<String>,
    /// Fabrics, each with a canonical and a perturbed drop
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) count: u64,
    /// The first of them
    #[arg(long, default_value_t = 0)]
    pub(crate) first: u64,
    /// Seed of fabrics, drops and scans
    #[arg(long, default_value_t = 13)]
    pub(crate) seed: u64,
    /// More networks of scripts/train.py to compare with the shipped one, each with its .json next
    /// to it
    #[arg(long, value_name = "FILE.onnx")]
    pub(crate) model: Vec<PathBuf>,
    /// Also print the cells as JSON, on the last line
    #[arg(long)]
    pub(crate) json: bool,
}

/// `evaluate views`.
#[derive(Debug, Args)]
pub(crate) struct Views {
    /// Folder of drapes, as `evaluate scenes --make-drapes` fills it
    #[arg(long, value_name = "FOLDER")]
    pub(crate) drapes: PathBuf,
    /// Scenes: single views and passes in turn
    #[arg(long, default_value_t = 40, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) count: u64,
    /// The first scene
    #[arg(long, default_value_t = 0)]
    pub(crate) first: u64,
    /// Seed of the scenes
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Sensor profiles, in turn; as for `augment --profile`
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "structured-light,handheld,phone,d435",
        value_name = "PROFILES"
    )]
    pub(crate) sensors: Vec<String>,
    /// Views of a turntable instead, without poses; every other scene gives the step
    #[arg(long)]
    pub(crate) turntable: bool,
    /// Also print the records as JSON, on the last line
    #[arg(long)]
    pub(crate) json: bool,
}

/// `evaluate scenes`.
#[derive(Debug, Args)]
pub(crate) struct Scenes {
    /// Folder of drapes for all runs: OBJ files of a square grid of vertices, mm, simulation frame
    #[arg(long, value_name = "FOLDER")]
    pub(crate) drapes: PathBuf,
    /// Only fill the folder with N fabrics, half of the prior `measured`, half of `knit-2020`.
    /// Existing files are kept. A drape takes minutes
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) make_drapes: Option<u64>,
    /// Vertices per side of the new drapes
    #[arg(long, default_value_t = 101, value_parser = clap::value_parser!(u32).range(61..=241))]
    pub(crate) vertices: u32,
    /// Scenes
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) count: u64,
    /// The first scene, or the first fabric for --make-drapes: several runs may share the work
    #[arg(long, default_value_t = 0)]
    pub(crate) first: u64,
    /// Seed of the scenes, or of the fabrics for --make-drapes
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Sensor profiles, in turn; as for `augment --profile`
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "handheld,phone,d435",
        value_name = "PROFILES"
    )]
    pub(crate) sensors: Vec<String>,
    /// Scenes that must be refused, each cause in turn: half a drape, a touching fold, a crease,
    /// passes apart, a missing side, too coarse, a wrong focal length, no plate, a table, a board,
    /// a box, two drapes
    #[arg(long)]
    pub(crate) broken: bool,
    /// Also read each cloud without its floor, cropped to the drape, with more boxes, and rotated
    #[arg(long)]
    pub(crate) invariance: bool,
    /// Accept every rim that is found, so that limits can be judged by both error rates
    #[arg(long)]
    pub(crate) relaxed: bool,
    /// Folder for every scan with its truth, to inspect failures
    #[arg(long, value_name = "FOLDER")]
    pub(crate) write: Option<PathBuf>,
    /// Also print the records as JSON, on the last line
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Verdict {
    /// Prior of the fabrics
    #[arg(long, default_value = DEFAULT_PRIOR, value_parser = names::prior())]
    pub(crate) prior: String,
    /// Sensor profile; as for `evaluate scan`
    #[arg(long, default_value = "structured-light")]
    pub(crate) profile: String,
    /// Fabrics
    #[arg(long, default_value_t = 24)]
    pub(crate) count: u64,
    /// The first of them
    #[arg(long, default_value_t = 0)]
    pub(crate) first: u64,
    /// Seed of fabrics, drops and scans
    #[arg(long, default_value_t = 7)]
    pub(crate) seed: u64,
    /// True radius of the plate [mm]; the estimate assumes 50
    #[arg(long, default_value_t = 50.0)]
    pub(crate) plate_radius: f64,
    /// The scan is larger by this factor
    #[arg(long, default_value_t = 1.0)]
    pub(crate) scale: f64,
    /// The scan is higher by this factor
    #[arg(long, default_value_t = 1.0)]
    pub(crate) vertical_scale: f64,
    /// The density that is given is larger by this factor
    #[arg(long, default_value_t = 1.0)]
    pub(crate) density_factor: f64,
}

#[derive(Debug, Args)]
pub(crate) struct Start {
    /// Priors of the fabrics
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "measured,knit-2020",
        value_name = "PRIORS",
        value_parser = names::prior()
    )]
    pub(crate) priors: Vec<String>,
    /// Sensor profile; as for `evaluate scan`
    #[arg(long, default_value = "structured-light")]
    pub(crate) profile: String,
    /// Fabrics of each prior, each scanned once; a scan takes half a minute
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) count: u64,
    /// The first of them
    #[arg(long, default_value_t = 0)]
    pub(crate) first: u64,
    /// Seed of fabrics, drops and scans
    #[arg(long, default_value_t = 7)]
    pub(crate) seed: u64,
    /// Folder for a picture of each answered scan: the true rim and those at rest
    #[arg(long, value_name = "DIR")]
    pub(crate) pictures: Option<PathBuf>,
    /// Also print the sums as JSON, on the last line
    #[arg(long)]
    pub(crate) json: bool,
}

/// `evaluate transfer`.
#[derive(Debug, Args)]
pub(crate) struct Transfer {
    /// Folder that keeps true drapes and results: a fabric that is there is not computed again
    #[arg(long, value_name = "DIR")]
    pub(crate) keep: PathBuf,
    /// Sum up the fabrics that are there and compute no others: what an ended run has
    #[arg(long)]
    pub(crate) kept: bool,
    /// Priors of the fabrics
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "measured,knit-2020",
        value_name = "PRIORS",
        value_parser = names::prior()
    )]
    pub(crate) priors: Vec<String>,
    /// Sensor profiles, as for `evaluate scan`
    #[arg(long, value_delimiter = ',', default_value = "handheld,phone", value_name = "PROFILES")]
    pub(crate) profiles: Vec<String>,
    /// Fabrics of each prior, each scanned once by every sensor
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) count: u64,
    /// The first of them
    #[arg(long, default_value_t = 0)]
    pub(crate) first: u64,
    /// Seed of fabrics, drops and scans
    #[arg(long, default_value_t = 47)]
    pub(crate) seed: u64,
    /// Drops of each disc
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=64))]
    pub(crate) drops: u64,
    /// Vertices per side of the scanned drapes, more than the fit uses
    #[arg(long, default_value_t = 121, value_parser = clap::value_parser!(u64).range(41..=241))]
    pub(crate) truth_vertices: u64,
    /// Pictures of so many of the fabrics that differ most, into the folder
    #[arg(long, default_value_t = 3)]
    pub(crate) pictures: usize,
    /// Also print the rows as JSON, on the last line
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Refine {
    /// Priors of the fabrics
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "measured,knit-2020",
        value_name = "PRIORS",
        value_parser = names::prior()
    )]
    pub(crate) priors: Vec<String>,
    /// Draw the fabrics evenly from the priors' whole boxes instead: most resemble none of the
    /// priors' fabrics
    #[arg(long)]
    pub(crate) anywhere: bool,
    /// Sensor profiles, as for `evaluate scan`, or `rim` for exact rims without a sheet
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "structured-light,truedepth",
        value_name = "PROFILES"
    )]
    pub(crate) profiles: Vec<String>,
    /// Fabrics of each prior, each scanned by every sensor
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) count: u64,
    /// The first of them
    #[arg(long, default_value_t = 0)]
    pub(crate) first: u64,
    /// Seed of fabrics, drops and scans
    #[arg(long, default_value_t = 7)]
    pub(crate) seed: u64,
    /// Drops of each fabric, which are refined together
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=16))]
    pub(crate) drops: u64,
    /// Use the canonical drop, as the paper does, instead of perturbed drops
    #[arg(long, conflicts_with = "drops")]
    pub(crate) canonical: bool,
    /// Vertices per side of the true drapes, more than the fit uses
    #[arg(long, default_value_t = 121, value_parser = clap::value_parser!(u64).range(41..=241))]
    pub(crate) truth_vertices: u64,
    /// Vertices per side of the fit's drapes, of the first and of the last steps. If not given,
    /// those of `estimate`
    #[arg(long, value_parser = grids, value_name = "FIRST,LAST")]
    pub(crate) vertices: Option<[usize; 2]>,
    /// Number of drapes of a fit at most. If not given, that of `estimate`
    #[arg(long, value_name = "DRAPES")]
    pub(crate) evaluations: Option<usize>,
    /// Start the fit at the mean fabric of the prior, not at the network's answer, which stays the
    /// fit's prior
    #[arg(long)]
    pub(crate) from_prior: bool,
    /// Folder that keeps the true drapes for later runs; on fine cells one takes up to minutes
    #[arg(long, value_name = "DIR")]
    pub(crate) keep: Option<PathBuf>,
    /// Also print the sums as JSON, on the last line
    #[arg(long)]
    pub(crate) json: bool,
}

/// `evaluate calibrate`.
#[derive(Debug, Args)]
pub(crate) struct SealedCases {
    /// Number of sealed cases. Of ten cases, four have one effect, three none, two an unlisted one,
    /// one has two effects
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) count: u64,
    /// The first of them
    #[arg(long, default_value_t = 0)]
    pub(crate) first: u64,
    /// Seed of fabrics, effects, drops and pictures
    #[arg(long, default_value_t = 7)]
    pub(crate) seed: u64,
    /// Scan squares with this sensor profile, instead of discs as silhouettes from above
    #[arg(long, value_name = "PROFILE")]
    pub(crate) scans: Option<String>,
    /// With --scans: one specimen dropped N times with its face up, instead of several with both
    /// faces
    #[arg(long, value_name = "N", requires = "scans", value_parser = clap::value_parser!(u64).range(1..=12))]
    pub(crate) drops: Option<u64>,
    /// Vertices per side of the true drapes, more than the fit uses
    #[arg(long, default_value_t = 121, value_parser = clap::value_parser!(u64).range(41..=241))]
    pub(crate) truth_vertices: u64,
    /// Vertices per side of the fit's drapes
    #[arg(long, default_value_t = 61, value_parser = clap::value_parser!(u32).range(31..=201))]
    pub(crate) vertices: u32,
    /// Prior of the calibration; the cases' fabrics are of `measured` or `knit-2020`
    #[arg(long, default_value = UNION_PRIOR, value_parser = names::prior())]
    pub(crate) prior: String,
    /// With --scans: distance by which the scanner shows edges too far out, and its standard
    /// deviation (default 0.1) [mm], as for `calibrate`
    #[arg(long, value_name = "MM[,SIGMA]", value_parser = sensor_edge, allow_hyphen_values = true, requires = "scans")]
    pub(crate) sensor_edge_mm: Option<[f64; 2]>,
    /// Effects that the calibration leaves out, and that are thus unlisted for it
    #[arg(long, value_name = "EFFECT,...", value_delimiter = ',', value_parser = effect)]
    pub(crate) without: Vec<&'static Effect>,
    /// Folder that keeps the cases: for each a folder with pictures, manifest.csv, sealed.json and
    /// the results. The same program with the same options continues there, or only adds up
    #[arg(long, value_name = "DIR")]
    pub(crate) keep: Option<PathBuf>,
    /// Also print the sums as JSON, on the last line
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Physics {
    /// Parts to run. If not given, all
    #[arg(value_enum)]
    pub(crate) parts: Vec<PhysicsPart>,
    /// Folder for charts and pictures
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Folder of measured data. If not given, the parts that need it are left out
    #[arg(long, value_name = "DIR")]
    pub(crate) data: Option<PathBuf>,
    /// Fabrics of `meshes`, 1 to 3
    #[arg(long, default_value_t = 3)]
    pub(crate) mesh_fabrics: usize,
    /// Measured fabrics of `cusick`, each also with its softening
    #[arg(long, default_value_t = 12)]
    pub(crate) cusick_fabrics: usize,
    /// Drops of each fabric of `effects`
    #[arg(long, default_value_t = 4)]
    pub(crate) effect_drops: u64,
}

/// Parts of `evaluate physics`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum PhysicsPart {
    /// Cantilever strips against the heavy elastica.
    Cantilever,
    /// Hanging strips against their extension.
    Hanging,
    /// A piece of cloth on a tilted plate.
    Friction,
    /// Square drapes on cells of 10, 5 and 2.5 mm (minutes).
    Meshes,
    /// Standard Cusick drapes of measured fabrics (minutes; needs --data).
    Cusick,
    /// Standard Cusick drapes with asymmetric bending and, with --data, hysteresis (minutes).
    Effects,
    /// Four sections of a real Cusick drape (minutes; needs --data).
    Sections,
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
    #[arg(long, value_name = "UNIT", requires = "unit")]
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
