//! Flags and verbs. A flag means here what the parameter of the same name means
//! in the library.

use std::ffi::OsString;
use std::path::PathBuf;

use anyhow::anyhow;
use clap::{Args, Parser, Subcommand, ValueEnum};

use super::Failure;
use super::experiment::ExperimentFlags;
use super::version;
use scan2params::base::frame::{PLATE_RADIUS_M, SPECIMEN_SIDE_M};
use scan2params::base::units::{LIKELY_SCALES, M_PER_MM};
use scan2params::calibrate::effect::{EFFECTS, Effect};
use scan2params::calibrate::manifest::Face;
use scan2params::dataset::augment::{Form, Unit};
use scan2params::exchange::Target;
use scan2params::fabric::{DEFAULT_PRIOR, Fabric, MEASURED_PRIOR};
use scan2params::intake::hints::{parse_crop, parse_place, parse_up};
use scan2params::intake::rim::parse_warp_toward;
use scan2params::io::{
    DepthSource, Format, Intrinsics, ReadOptions, files_of, intrinsics, is_views_folder,
};
use scan2params::scan::{Crop, LengthUnit, MarkColor, ScanOptions, WarpToward};

/// From a depth-sensor scan of a draped cloth to the parameters with which a
/// simulator reproduces it.
#[derive(Debug, Parser)]
#[command(name = "scan2params", version, long_version = version::long(), about, max_term_width = 100)]
pub(crate) struct Arguments {
    #[command(flatten)]
    pub(crate) talk: Talk,
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// How much is said on stderr.
#[derive(Debug, Args)]
pub(crate) struct Talk {
    /// Say nothing on stderr but warnings and errors
    #[arg(long, short, global = true, display_order = 101, conflicts_with = "verbose")]
    pub(crate) quiet: bool,
    /// Say on stderr what is done and when, also where it is no terminal
    #[arg(long, short, global = true, display_order = 102)]
    pub(crate) verbose: bool,
    /// Defaults of flags; without it SCAN2PARAMS_CONFIG names the file, else scan2params.toml in this folder,
    /// else config.toml of the user (`scan2params config` says which). "" for none
    #[arg(long, global = true, display_order = 103, value_name = "FILE.toml", value_parser = clap::builder::OsStringValueParser::new())]
    pub(crate) config: Option<OsString>,
}

/// How many threads are used.
#[derive(Clone, Debug, Args)]
pub(crate) struct ThreadFlags {
    /// Threads at most; 0: one per core. No result depends on it; one drape is computed on one
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
    /// Bring views or passes of one drape together and write them as one cloud.
    Merge(Merge),
    /// Estimate every scan of a folder; taken up again where it was interrupted.
    Batch(Batch),
    /// Fit fabrics to measured drapes, predict the drapes held out, and show what is left.
    Calibrate(Calibrate),
    /// Scan drapes with a virtual depth camera.
    Augment(Augment),
    /// Combine repeated drapes of one fabric: mean, scatter, intervals, folds, drapes that lie apart.
    Combine(Combine),
    /// Write what is needed to make the experiment: templates, stand, protocol.
    Kit(Kit),
    /// Measure what this program promises, and print the tables.
    Evaluate(EvaluateGiven),
    /// Drape one fabric and write the sheet as OBJ.
    Simulate(Box<Simulate>),
    /// Fill a folder with simulated drapes of fabrics drawn from a prior.
    Generate(Generate),
    /// Write a fabric for another program: CLO, Blender, Newton, MuJoCo, ARCSim, U3M, USD, JSON, CSV.
    Export(Export),
    /// Convert a stiffness or a density to another unit, or a params.json to all of them.
    Convert(Convert),
    /// Say which file gives defaults, and what a command line comes to with it.
    Config(Config),
    /// Print what completes the commands and flags of this program in a shell.
    Completions(Completions),
    /// Print the manual, or write a page for each command.
    Man(Man),
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
            | Self::Man(_) => return 0,
        };
        given.threads
    }
}

#[derive(Debug, Args)]
pub(crate) struct Combine {
    /// Results of drapes of one fabric as `estimate --out` and `batch` write them, or folders of them
    #[arg(required = true, value_name = "PARAMS.json|FOLDER")]
    pub(crate) inputs: Vec<PathBuf>,
    /// The combination as JSON, which `simulate --params` reads
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
    /// The experiment: `square` for scans, `cusick` for silhouettes that `calibrate` takes
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
    /// A command line of this program: each of its flags is printed with its value and where that is from
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
    /// Folder for a page of each command, in place of printing the first
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
    /// The scan: PLY, OBJ, PCD, STL, GLB, E57, LAS, LAZ, XYZ, 16-bit depth PNG, views.json or its folder;
    /// `estimate` also takes a rim that `boundary` wrote; `-` with --format: the standard input
    #[arg(value_name = "INPUT")]
    pub(crate) input: PathBuf,
    /// More recordings of the same drape as it lies there, in any frame: they are brought together
    #[arg(value_name = "PASS")]
    pub(crate) passes: Vec<PathBuf>,
    /// Format of INPUT, whatever its name: ply, obj, pcd, stl, glb, e57, las, laz, xyz or png
    #[arg(long, value_name = "NAME", value_parser = format)]
    pub(crate) format: Option<Format>,
    #[command(flatten)]
    pub(crate) read: ReadFlags,
}

impl ScanFlags {
    /// What the flags say of the file.
    pub(crate) fn read_options(&self) -> Result<ReadOptions, Failure> {
        if self.input.as_os_str() == "-" && self.format.is_none() {
            let why = "`-` is the standard input, which does not say its format: give it, as in `- --format ply`";
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
    /// Unit of the file's coordinates; guessed from the sizes of scene and plate if not given
    #[arg(long, value_parser = unit, value_name = "m|mm|cm|in")]
    pub(crate) unit: Option<LengthUnit>,
    /// Scale of the scan, by which all its lengths are divided: 1.012 of one that is 1.2 % too large, as a verdict says.
    /// Places of other flags are then in the divided lengths
    #[arg(long, value_name = "SCALE", value_parser = rescale)]
    pub(crate) rescale: Option<f64>,
    /// Part of the scan that is looked at: a radius about the plate [mm], or two opposite corners X1,Y1,Z1,X2,Y2,Z2
    /// of a box in the file's frame and unit
    #[arg(long, value_name = "RADIUS_MM|BOX", value_parser = parse_crop, allow_hyphen_values = true)]
    pub(crate) crop: Option<Crop>,
    /// Which way is up in the scan's frame, to 20 degrees: x, -x, y, -y, z, -z, or three numbers X,Y,Z; found from
    /// the cloth if not given
    #[arg(long, value_name = "AXIS", value_parser = parse_up, allow_hyphen_values = true)]
    pub(crate) up: Option<[f64; 3]>,
    /// Where the plate is, to 100 mm, in the file's frame and unit; found from the cloth if not given
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
    /// Where depth images are from, which says their unit: d4xx, d405, k4a, tum, polycam
    #[arg(long, value_name = "NAME", value_parser = depth_source, conflicts_with = "depth_scale")]
    pub(crate) sensor: Option<DepthSource>,
    /// Units of depth in a metre, in depth images
    #[arg(long, value_name = "UNITS_PER_METRE", default_value_t = 1000.0)]
    pub(crate) depth_scale: f64,
    /// Drop pixels of depth images that fewer than three of their eight neighbours
    /// follow within this depth [mm]
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

/// A format that bytes can be in: a set of views is files.
fn format(text: &str) -> Result<Format, String> {
    let format = Format::named(text).filter(|format| *format != Format::Views);
    format.ok_or_else(|| "give ply, obj, pcd, stl, glb, e57, las, laz, xyz or png".into())
}

/// An areal density in g/m^2; what range it may lie in is the library's to say.
fn density(text: &str) -> Result<f64, String> {
    let remedy = "give a number of g/m^2 alone, with a decimal point, like 182.5; `scan2params convert \
                  5.4 oz/yd^2 --to g/m^2` makes one of another unit";
    text.trim().parse().map_err(|_| remedy.to_owned())
}

fn depth_source(text: &str) -> Result<DepthSource, String> {
    let names = DepthSource::ALL.map(|source| source.name).join(", ");
    DepthSource::named(text).ok_or_else(|| format!("give one of {names}, or --depth-scale"))
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

fn unit(text: &str) -> Result<LengthUnit, String> {
    LengthUnit::named(text).ok_or_else(|| "give m, mm, cm, in, ft, um or 0.1mm".into())
}

#[derive(Clone, Debug, Args)]
pub(crate) struct Estimate {
    #[command(flatten)]
    pub(crate) scan: ScanFlags,
    #[command(flatten)]
    pub(crate) threads: ThreadFlags,
    /// Areal density of the fabric [g/m^2], 1 to 2000
    #[arg(long, value_name = "G_PER_M2", value_parser = density)]
    pub(crate) density: f64,
    /// Folder for params.json, boundary.csv, boundary.png and report.html; it is then found out as well what the fabric's
    /// sheet does when nothing holds it to the scan. Of a refused scan the picture that `inspect` draws
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print params.json instead of the table
    #[arg(long)]
    pub(crate) json: bool,
    /// The network's answer alone, in two seconds: wider intervals, bending off by 5 to 8 %
    #[arg(long)]
    pub(crate) quick: bool,
    /// Find out what the fabric's sheet does when nothing holds it to the scan (the released drape) even without --out
    #[arg(long)]
    pub(crate) release: bool,
    /// Other scans of the same fabric, dropped anew: one fabric is found from all of them. Weft and warp must be
    /// known in each, by its mark or by --warp-toward, which then holds for all
    #[arg(long, value_name = "SCAN", conflicts_with = "quick", num_args = 1..)]
    pub(crate) with: Vec<PathBuf>,
    /// Effects that the cloth is known to have beyond the seven parameters, from a params.json that `calibrate` wrote: the
    /// simulator drapes it with them. The network knows nothing of them
    #[arg(long, value_name = "FABRIC.params.json")]
    pub(crate) effects: Option<PathBuf>,
    /// Which face of that cloth is up
    #[arg(long, value_enum, default_value_t = Side::Up, requires = "effects")]
    pub(crate) face: Side,
    /// Exit with code 4 where the verdict is `do not use`; results are written all the same
    #[arg(long)]
    pub(crate) strict: bool,
    /// No report.html in --out
    #[arg(long)]
    pub(crate) no_report: bool,
    /// The laboratory's fields for report.html: specimen_id, composition, construction, thickness, face, warp_marked,
    /// conditioning, scanner, operator, date, remarks; blank lines for what is not given
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
    /// Picture of what was found: from above, from the side, flattened
    #[arg(long, short, value_name = "FILE.png")]
    pub(crate) out: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Merge {
    #[command(flatten)]
    pub(crate) scan: ScanFlags,
    #[command(flatten)]
    pub(crate) threads: ThreadFlags,
    /// The cloud, in the frame and the unit of the first pass; of views in metres
    #[arg(long, short, value_name = "FILE.ply")]
    pub(crate) out: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct Boundary {
    #[command(flatten)]
    pub(crate) scan: ScanFlags,
    #[command(flatten)]
    pub(crate) threads: ThreadFlags,
    /// The rim: index, side, x, y, z, sigma [mm], observed
    #[arg(long, short, value_name = "FILE.csv")]
    pub(crate) out: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct Batch {
    /// Folder of scans; folders in it are looked into
    #[arg(value_name = "FOLDER")]
    pub(crate) folder: PathBuf,
    /// Table `file,density_g_m2[,warp_toward]` with a row per scan
    #[arg(long, value_name = "FILE.csv", required_unless_present = "density")]
    pub(crate) density_csv: Option<PathBuf>,
    /// Areal density of the scans that the table does not name [g/m^2], 1 to 2000
    #[arg(long, value_name = "G_PER_M2", value_parser = density)]
    pub(crate) density: Option<f64>,
    /// Folder of results; `FOLDER-results` in the current folder if not given
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) read: ReadFlags,
    /// The network's answers alone: two seconds a scan, wider intervals
    #[arg(long)]
    pub(crate) quick: bool,
    /// Find out what each fabric's sheet does when nothing holds it to the scan (the released drape)
    #[arg(long)]
    pub(crate) release: bool,
    /// Do part i of N only: several machines share DIR, and `--merge` writes the tables in the end
    #[arg(long, value_name = "i/N")]
    pub(crate) shard: Option<scan2params::base::Shard>,
    /// Write the tables and the page of what all shards have done, and do no scan
    #[arg(long, conflicts_with = "shard")]
    pub(crate) merge: bool,
    #[command(flatten)]
    pub(crate) threads: ThreadFlags,
    /// Exit with code 3 where a verdict is `do not use`, as for scans without an estimate
    #[arg(long)]
    pub(crate) strict: bool,
    /// Print JSON lines instead of CSV
    #[arg(long)]
    pub(crate) json: bool,
    /// No report.html of the batch and of its scans
    #[arg(long)]
    pub(crate) no_report: bool,
    /// Print what would be done, and do nothing
    #[arg(long)]
    pub(crate) dry_run: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Calibrate {
    /// Table with a row per file: file, kind (silhouette, scan, boundary), fabric, specimen, face (up, down), capture,
    /// density_g_m2, experiment (cusick, square), mm_per_pixel, role (fit, holdout), warp_toward (bearing in the
    /// picture in degrees, anticlockwise from the right; of a scan as --warp-toward, or mark:COLOUR), observation (1, 2, ... of
    /// one drape that settles), camera_height_mm (above the plate); what is empty is unknown
    #[arg(value_name = "MANIFEST.csv")]
    pub(crate) manifest: PathBuf,
    /// Folder for calibration.json, report.html and a picture of each drape
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// What is believed of fabrics: `measured`, `knit-2020` or `union`
    #[arg(long, default_value = MEASURED_PRIOR)]
    pub(crate) prior: String,
    /// Vertices on a side of the drapes
    #[arg(long, default_value_t = 61, value_parser = clap::value_parser!(u32).range(31..=201))]
    pub(crate) vertices: u32,
    /// Standard deviation of the pictures' scale beside mm_per_pixel, one scale for all pictures of a fabric [%]; taken as
    /// exact if not given, and then looked for as an effect
    #[arg(long, value_name = "PERCENT", value_parser = percent)]
    pub(crate) scale_sigma: Option<f64>,
    /// Of scans, by how much the scanner has edges farther out than the cloth ends, and its standard deviation (0.1 if not given) [mm],
    /// as `sensor_edge` of specimens tells it whose size was measured; looked for within what scanners do if not given
    #[arg(long, value_name = "MM[,SIGMA]", value_parser = sensor_edge, allow_hyphen_values = true)]
    pub(crate) sensor_edge_mm: Option<[f64; 2]>,
    /// How strongly drapes are held across their outlines: share of the hanging cloth's weight for each millimetre [%], 15 if
    /// not given; 0 lets them go, and scanned sheets, which are held by 3.3 % otherwise
    #[arg(long, value_name = "PERCENT", value_parser = hold)]
    pub(crate) hold: Option<f64>,
    /// Effects that are not looked for, by their names in calibration.json
    #[arg(long, value_name = "EFFECT,...", value_delimiter = ',', value_parser = effect)]
    pub(crate) without: Vec<&'static Effect>,
    /// Print calibration.json instead of the table
    #[arg(long)]
    pub(crate) json: bool,
    /// No report.html
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

/// A scanner's edge beside the cloth's, and its standard deviation [mm].
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

/// Of itself, that a cycle of the descent lowers the energy by: beyond a thousandth a sheet is nowhere near rest.
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
    /// A drape as `simulate` writes it (OBJ, mm, simulation frame), a params.json that
    /// is simulated first, or a folder of *.obj and *.params.json
    #[arg(value_name = "DRAPE.obj|FOLDER")]
    pub(crate) input: PathBuf,
    /// One scan, or a folder for any number; the truth is written beside each
    #[arg(long, short, value_name = "FILE.ply|DIR")]
    pub(crate) out: PathBuf,
    /// What is written: fused clouds, 16-bit depth images with poses, or the rims that
    /// `boundary` finds
    #[arg(long = "as", value_name = "FORM", value_enum, default_value = "ply")]
    pub(crate) form: AugmentForm,
    /// Kind of sensor: ideal, structured-light, truedepth, consumer, phone, d435, handheld; the last three have the noise
    /// of real recordings
    #[arg(long, default_value = "structured-light")]
    pub(crate) profile: String,
    /// What carries the plate: post, can, column, box, glass; its sizes are drawn for each scan. The stand of the experiment if
    /// not given
    #[arg(long, value_name = "STAND", conflicts_with = "even")]
    pub(crate) stand: Option<String>,
    /// What is around: bare (no floor), table, open (a wide floor), and on a wide floor clutter, hand, wall, lamp; drawn for
    /// each scan
    #[arg(long, value_name = "SCENE", conflicts_with = "even")]
    pub(crate) scene: Option<String>,
    /// Radius to which the plate's edge is rounded [mm]; 1 to 5 drawn for a --stand if not given
    #[arg(long, value_name = "MM", conflicts_with = "even", value_parser = rounding_mm)]
    pub(crate) rounded: Option<f64>,
    /// Unit of the clouds; `either` draws one for each
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
    /// Seed of noise, of the scanner's frame and of where the cameras stand
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
    /// Shipped prior that the fabrics are drawn from: `knit-2020` or `measured`; both if not given
    #[arg(long)]
    pub(crate) prior: Option<String>,
    /// Walks of each prior
    #[arg(long, default_value_t = 4)]
    pub(crate) count: u64,
    /// First walk, to go on with a run that was broken off
    #[arg(long, default_value_t = 0)]
    pub(crate) first: u64,
    /// Seed of fabrics, drops and directions
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// How far away the neighbour is: root mean square of the seven logarithms
    #[arg(long, default_value_t = 0.25)]
    pub(crate) step: f64,
    /// How often a step that leaves its branch is tried again as two halves
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
        /// Sensor profiles, and behind them what else is said of the scene, each after an @ and
        /// in any order, as in structured-light@post@below@views8:
        /// @top (the view from above alone), @below (views from 40, 5 and -25 degrees, 30 if not
        /// said), @viewsN (N views), @views (every pixel of the depth images in place of a fused
        /// cloud), @post (a plate 6 mm thick on a thin post, no floor), @pedestal (a column nearly
        /// as wide as the plate), @thickN (a plate N mm thick), @plateN (a plate of N mm radius,
        /// for a drape simulated on one), @floorN (a floor N mm below the plate, 0 for none),
        /// @off (the specimen 51 mm off the scanner's axis)
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
        /// A tuned constant of the scan path in place of the one that ships, as in
        /// `sheet.knot_m=4.5e-3`; src/scan/tuning.rs lists them. May be given often
        #[arg(long, value_name = "STAGE.NAME=VALUE", value_parser = key_value)]
        tune: Vec<(String, String)>,
    },
    /// Accuracy, widths and coverage of the estimate on rims that the model has not seen, clean and with the scan noise
    /// of its training, by bending length, beside a baseline that ignores the scan.
    Estimate(Box<HeldOut>),
    /// Fabrics that fall again with what is estimated from their rims: the paper's Figs. 8 and 9.
    Redrape(Redrape),
    /// The estimate on canonical and on perturbed drops, seen clean and by sensors, of the shipped network and of others beside it
    Sensors(Sensors),
    /// Scenes drawn blind: sensor x stand x surroundings x fabric x views x unit, each through the scan path; or scenes that are
    /// wrong in a known way, and what the refusals say of them
    Scenes(Box<Scenes>),
    /// Views and passes that miss each other by up to 20 mm and 5 degrees, brought together: how far apart they lie after
    Views(Views),
    /// The paper's Table 3 beside ours from the model's record, each with the size of its data.
    Table3 {
        /// Recompute ours on this folder of `generate`, of another seed than the model's
        #[arg(value_name = "DRAPES")]
        drapes: Option<PathBuf>,
        /// Print the lines as JSON
        #[arg(long)]
        json: bool,
    },
    /// Where the time of one scan goes, from file to rim: stage, processor time of all
    /// threads, time on the wall. RAYON_NUM_THREADS=1 keeps it to one thread.
    Stages {
        #[command(flatten)]
        scan: Box<ScanFlags>,
        /// Runs; the one with the least processor time is printed
        #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..))]
        repeat: u64,
    },
    /// The simulator against known answers: strips, friction, meshes, Cusick drapes.
    Physics(Physics),
    /// Drapes of many fabrics, the corners of Table 2's box among them: how they end.
    Soak {
        /// Shipped prior that the fabrics are drawn from: `knit-2020`, `measured` or `union`
        #[arg(long, default_value = DEFAULT_PRIOR)]
        prior: String,
        /// Fabrics; every eighth is a corner of the box
        #[arg(long, default_value_t = 1024)]
        count: u64,
        /// First fabric, to go on with a soak that was broken off
        #[arg(long, default_value_t = 0)]
        first: u64,
        /// Seed of fabrics and drops
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Numerics: 4, or the earlier 3
        #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(3..=4))]
        numerics: u32,
    },
    /// Drapes that are followed to a neighbouring fabric and back, beside fresh ones.
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
        /// Vertices a side, one or several; several give the growth of the cost
        #[arg(long, value_delimiter = ',', default_value = "61")]
        vertices: Vec<usize>,
        /// Numerics: 4, or the earlier 3
        #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(3..=4))]
        numerics: u32,
    },
    /// What scans look like to the verdict, honest ones and ones that are wrong in a known way.
    Verdict(Verdict),
    /// Where scanned drapes of known fabrics come to rest from the scanned sheet, led by the
    /// scanned rim, and from the true sheet: distance of the rim at rest from the true one.
    Start(Start),
    /// Scanned drapes of known fabrics, estimated and refined: rims, errors, intervals, time.
    Refine(Refine),
    /// Sealed cases: drapes of known fabrics with effects that are drawn by seed and that `calibrate` is not
    /// told of, seen as silhouettes and calibrated. What was named, false alarms, errors held out.
    Calibrate(SealedCases),
    /// How far the rim of one drape moves with a small change of each parameter.
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
    /// A folder of `generate`, of another seed than the model's; with several drops of a fabric also what `combine` makes of them
    #[arg(value_name = "DRAPES", required_unless_present = "count")]
    pub(crate) drapes: Option<PathBuf>,
    /// Drape so many fabrics of the model's prior afresh, as `generate` does
    #[arg(long, conflicts_with = "drapes", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) count: Option<u64>,
    /// Seed of their fabrics and drops, and of the scan noise
    #[arg(long, default_value_t = 2)]
    pub(crate) seed: u64,
    /// Draw them evenly from the prior's whole box instead: most are like none of its fabrics
    #[arg(long, requires = "count")]
    pub(crate) anywhere: bool,
    /// A network of scripts/train.py in place of the shipped one; its .json lies beside it
    #[arg(long, value_name = "FILE.onnx")]
    pub(crate) model: Option<PathBuf>,
    /// Folder for two pictures: answers over truths, and how stiffnesses go with each other
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
    /// Shipped prior that the fabrics are drawn from: `knit-2020`, as the paper's, `measured` or `union`
    #[arg(long, default_value = DEFAULT_PRIOR)]
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
    /// A network of scripts/train.py in place of the shipped one; its .json lies beside it
    #[arg(long, value_name = "FILE.onnx")]
    pub(crate) model: Option<PathBuf>,
    /// End all drapes as `generate --energy-drop` does, 1e-4 as its falls: 0 for full rest
    #[arg(long, value_name = "SHARE", default_value = "0", value_parser = energy_drop)]
    pub(crate) energy_drop: f64,
    /// Fit a linear regression to this folder of `generate`, and drape its answers too
    #[arg(long, value_name = "FOLDER")]
    pub(crate) train: Option<PathBuf>,
    /// Drape the true fabric with all stiffnesses so much higher too: what the drop itself makes of an error
    #[arg(long, value_name = "PERCENT", value_parser = percent)]
    pub(crate) off: Option<f64>,
    /// Refine the network's answers on the rims, and drape these too: some ten drapes each
    #[arg(long)]
    pub(crate) refine: bool,
    /// Folder for the histogram, `redrape.png`
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print the sums as one line of JSON as well, the last
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Sensors {
    /// Shipped prior that the fabrics are drawn from: `knit-2020`, `measured` or `union`
    #[arg(long, default_value = "union")]
    pub(crate) prior: String,
    /// How the drapes are seen: `rim` for rims as they are, and sensor profiles, as for `evaluate scan`
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "rim,structured-light,truedepth,consumer",
        value_name = "PROFILES"
    )]
    pub(crate) profiles: Vec<String>,
    /// Fabrics, each dropped canonically and in a way of its own
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) count: u64,
    /// The first of them
    #[arg(long, default_value_t = 0)]
    pub(crate) first: u64,
    /// Seed of fabrics, drops and scans
    #[arg(long, default_value_t = 13)]
    pub(crate) seed: u64,
    /// A network of scripts/train.py to ask beside the shipped one, any number; its .json lies beside it
    #[arg(long, value_name = "FILE.onnx")]
    pub(crate) model: Vec<PathBuf>,
    /// Print the cells as one line of JSON as well, the last
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
    /// Views of a turntable instead, without poses; the step is said in every other scene
    #[arg(long)]
    pub(crate) turntable: bool,
    /// Print the records as one line of JSON as well, the last
    #[arg(long)]
    pub(crate) json: bool,
}

/// `evaluate scenes`.
#[derive(Debug, Args)]
pub(crate) struct Scenes {
    /// Folder of drapes that is kept from run to run; OBJ files of a square grid of vertices, mm, simulation frame
    #[arg(long, value_name = "FOLDER")]
    pub(crate) drapes: PathBuf,
    /// Only fill the folder with so many fabrics, half from the prior `measured`, half from `knit-2020`; those that are there are
    /// kept. A drape takes minutes
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) make_drapes: Option<u64>,
    /// Vertices a side of the drapes that are made
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
    /// Scenes that are to be refused, each cause in its turn: half a drape, a touching fold, a crease, passes apart, a missing
    /// side, too coarse, a wrong focal length, no plate, a table, a board, a box, two drapes
    #[arg(long)]
    pub(crate) broken: bool,
    /// Also ask each cloud without its floor, cropped to the drape, with more boxes, and turned
    #[arg(long)]
    pub(crate) invariance: bool,
    /// Answer whatever comes to a rim, so that limits can be judged by both rates
    #[arg(long)]
    pub(crate) relaxed: bool,
    /// Folder for every scan with its truth, so that a failure can be opened
    #[arg(long, value_name = "FOLDER")]
    pub(crate) write: Option<PathBuf>,
    /// Print the records as one line of JSON as well, the last
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Verdict {
    /// Shipped prior that the fabrics are drawn from: `knit-2020`, `measured` or `union`
    #[arg(long, default_value = DEFAULT_PRIOR)]
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
    /// Radius of the plate that the cloth lies on [mm]; the main job is not told
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
    /// Shipped priors that the fabrics are drawn from
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "measured,knit-2020",
        value_name = "PRIORS"
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
    /// Print the sums as one line of JSON as well, the last
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Refine {
    /// Shipped priors that the fabrics are drawn from
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "measured,knit-2020",
        value_name = "PRIORS"
    )]
    pub(crate) priors: Vec<String>,
    /// Draw them evenly from the priors' whole boxes instead: most are like none of their fabrics
    #[arg(long)]
    pub(crate) anywhere: bool,
    /// Sensor profiles, as for `evaluate scan`; `rim` for rims as they are, without a sheet
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
    /// Let the fabrics fall as the paper does, all alike, in place of perturbed drops
    #[arg(long, conflicts_with = "drops")]
    pub(crate) canonical: bool,
    /// Vertices a side of the true drapes, finer than any that the fit uses
    #[arg(long, default_value_t = 121, value_parser = clap::value_parser!(u64).range(41..=241))]
    pub(crate) truth_vertices: u64,
    /// Vertices a side of the fit's drapes, of the first steps and of the last; those of `estimate` unless they are
    /// given
    #[arg(long, value_parser = grids, value_name = "FIRST,LAST")]
    pub(crate) vertices: Option<[usize; 2]>,
    /// Most drapes of a fit, likewise
    #[arg(long, value_name = "DRAPES")]
    pub(crate) evaluations: Option<usize>,
    /// Begin at the mean fabric of the prior, not at what the network says; what is believed stays the network's
    #[arg(long)]
    pub(crate) from_prior: bool,
    /// Folder that keeps the true drapes from run to run; on fine cells they take up to minutes
    #[arg(long, value_name = "DIR")]
    pub(crate) keep: Option<PathBuf>,
    /// Print the sums as one line of JSON as well, the last
    #[arg(long)]
    pub(crate) json: bool,
}

/// `evaluate calibrate`.
#[derive(Debug, Args)]
pub(crate) struct SealedCases {
    /// Sealed cases, of ten four with one effect, three with none, two with one that is on no list, one
    /// with two
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) count: u64,
    /// The first of them
    #[arg(long, default_value_t = 0)]
    pub(crate) first: u64,
    /// Seed of fabrics, effects, drops and pictures
    #[arg(long, default_value_t = 7)]
    pub(crate) seed: u64,
    /// Squares that are scanned, by this sensor profile, and read by the whole scan path, in place of discs seen from above
    #[arg(long, value_name = "PROFILE")]
    pub(crate) scans: Option<String>,
    /// One specimen that is dropped N times, its face up, in place of several with both faces; of `--scans`
    #[arg(long, value_name = "N", requires = "scans", value_parser = clap::value_parser!(u64).range(1..=12))]
    pub(crate) drops: Option<u64>,
    /// Vertices a side of the true drapes, finer than any that the fit uses
    #[arg(long, default_value_t = 121, value_parser = clap::value_parser!(u64).range(41..=241))]
    pub(crate) truth_vertices: u64,
    /// Vertices a side of the fit's drapes
    #[arg(long, default_value_t = 61, value_parser = clap::value_parser!(u32).range(31..=201))]
    pub(crate) vertices: u32,
    /// What the calibration believes of fabrics; the cases' are of `measured` or of `knit-2020`
    #[arg(long, default_value = "union")]
    pub(crate) prior: String,
    /// By how much the scanner has edges farther out than the cloth ends, and its standard deviation (0.1 if not given) [mm], as
    /// `sensor_edge` of specimens tells it whose size was measured; of the scans of `--scans`
    #[arg(long, value_name = "MM[,SIGMA]", value_parser = sensor_edge, allow_hyphen_values = true, requires = "scans")]
    pub(crate) sensor_edge_mm: Option<[f64; 2]>,
    /// Effects that the calibration does not look for, so that those of the list are on none for it
    #[arg(long, value_name = "EFFECT,...", value_delimiter = ',', value_parser = effect)]
    pub(crate) without: Vec<&'static Effect>,
    /// Folder that keeps the cases from run to run, a folder each with pictures, manifest.csv and
    /// sealed.json (on fine cells a drape takes up to minutes), and what was said: the same program with the same options
    /// goes on where it was broken off, or only adds up
    #[arg(long, value_name = "DIR")]
    pub(crate) keep: Option<PathBuf>,
    /// Print the sums as one line of JSON as well, the last
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Physics {
    /// What to run, all if not given
    #[arg(value_enum)]
    pub(crate) parts: Vec<PhysicsPart>,
    /// Folder for charts and pictures
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Folder of measured data; what needs it is left out without it
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
}

#[derive(Debug, Args)]
pub(crate) struct Simulate {
    #[command(flatten)]
    pub(crate) fabric: FabricFlags,
    #[command(flatten)]
    pub(crate) experiment: ExperimentFlags,
    /// Which face of the cloth is up, where `--params` has effects that a face has: those of `calibrate`
    #[arg(long, value_enum, default_value_t = Side::Up, requires = "params")]
    pub(crate) face: Side,
    /// Seed of a perturbed drop; without it the canonical drop
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    /// No drop: start from this mesh of the specimen (OBJ or PLY, mm, simulation frame), as
    /// `simulate` wrote it with any number of vertices, or an OBJ whose texture coordinates
    /// run along warp and weft from the corner (-x, -z), from 0 to 1 or in mm
    #[arg(long, value_name = "SHEET.obj", conflicts_with = "seed")]
    pub(crate) start: Option<PathBuf>,
    /// Vertices on a side of the specimen
    #[arg(long, default_value_t = 61, value_parser = clap::value_parser!(u64).range(21..=241))]
    pub(crate) vertices: u64,
    /// Numerics: 4, which the network was trained on, or the earlier 3
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(3..=4))]
    pub(crate) numerics: u32,
    #[command(flatten)]
    pub(crate) threads: ThreadFlags,
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
    #[arg(long, default_value_t = 2000, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) count: u64,
    /// Seed of the whole run
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Shipped prior that the fabrics are drawn from: `knit-2020`, `measured` or `union`
    #[arg(long, default_value = DEFAULT_PRIOR)]
    pub(crate) prior: String,
    /// Make part i of N only
    #[arg(long, value_name = "i/N", default_value = "0/1")]
    pub(crate) shard: scan2params::base::Shard,
    /// Drops of each fabric
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) drops_per_fabric: u64,
    /// Lead each sheet from fabric to neighbouring fabric, ROWS drapes to a fall (a divisor of 64)
    #[arg(
        long, value_name = "ROWS", num_args = 0..=1, require_equals = true,
        default_missing_value = "16", conflicts_with = "drops_per_fabric",
        value_parser = clap::value_parser!(u64).range(1..)
    )]
    pub(crate) walk: Option<u64>,
    /// Let every sheet fall canonically, as the paper's do; else each falls in a way of its own
    #[arg(long, conflicts_with_all = ["drops_per_fabric", "walk"])]
    pub(crate) canonical: bool,
    /// End a drape when a cycle of the descent lowers the energy by less than this share of itself: 0 for full rest
    /// [default: 1e-4, of a walk 1e-5]
    #[arg(long, value_name = "SHARE", value_parser = energy_drop)]
    pub(crate) energy_drop: Option<f64>,
    /// Vertices on a side of the drapes; of the shipped model's drapes four in five have the default, the others 91 and 121
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
    /// The fabric, as `estimate` wrote it: params.json
    #[arg(value_name = "PARAMS.json")]
    pub(crate) params: PathBuf,
    /// What it is written for
    #[arg(long, value_name = "TARGET", value_parser = target)]
    pub(crate) to: Target,
    /// The file: .jfab for clo, .py for blender, .xml for mujoco, .u3m (and FILE.fab.json beside it) for
    /// u3m, .usda for usd, .json for newton, arcsim and json, .csv for csv
    #[arg(long, short, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// Name of the material there; that of PARAMS.json if not given
    #[arg(long)]
    pub(crate) name: Option<String>,
    /// Length of the edges of the cloth's mesh there [mm]: blender needs it, newton for its solver VBD; the
    /// specimen of mujoco and usd is made with it, 10 if not given
    #[arg(long, value_name = "MM")]
    pub(crate) edge_mm: Option<f64>,
    /// Triangles of the cloth's mesh in newton and arcsim: irregular, or square cells along the yarns with all
    /// diagonals one way
    #[arg(long, value_enum, default_value_t = MeshKind::Irregular)]
    pub(crate) mesh: MeshKind,
    /// Thickness of the fabric [mm], which no drape shows, for clo, u3m and usd
    #[arg(long, value_name = "MM")]
    pub(crate) thickness_mm: Option<f64>,
    /// Friction of the fabric, which no drape shows, for clo, blender, mujoco, u3m and usd
    #[arg(long, value_name = "COEFFICIENT")]
    pub(crate) friction: Option<f64>,
    /// Exchange weft and warp, for clo, whose order is second-hand
    #[arg(long)]
    pub(crate) swap_warp_weft: bool,
    /// Export a result whose verdict is `do not use` as well
    #[arg(long)]
    pub(crate) force: bool,
}

/// Triangles of a mesh elsewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum MeshKind {
    /// Without a common direction.
    Irregular,
    /// Square cells along the yarns, all diagonals one way.
    Grid,
}

fn target(text: &str) -> Result<Target, String> {
    let names = Target::ALL.map(Target::name).join(", ");
    let named = Target::ALL.into_iter().find(|target| target.name().eq_ignore_ascii_case(text));
    named
        .ok_or_else(|| format!("give one of {names} (Marvelous Designer takes clo, Browzwear u3m)"))
}

#[derive(Debug, Args)]
pub(crate) struct Convert {
    /// A number, or a params.json, which is printed in the units of the paper, in SI, in those of textile
    /// laboratories and in CLO's
    #[arg(value_name = "VALUE|PARAMS.json", allow_negative_numbers = true)]
    pub(crate) what: String,
    /// The number's unit. Stretch and shear: "g/s^2", "N/m", "gf/cm", "gf/(cm deg)" (KES shear), clo-slider.
    /// Bending: "g mm^2 s^-2 rad^-1", "N m", "uN m", "gf cm^2/cm" (KES), "dyn cm", mm (bending length, with
    /// --density). Density: "g/m^2", "kg/m^2", "g/cm^2", "g/mm^2", "mg/cm^2", "oz/yd^2"
    #[arg(value_name = "UNIT", requires = "to")]
    pub(crate) unit: Option<String>,
    /// The unit to convert to
    #[arg(long, value_name = "UNIT", requires = "unit")]
    pub(crate) to: Option<String>,
    /// Areal density, for bending lengths [g/m^2]
    #[arg(long, value_name = "G_PER_M2", value_parser = density)]
    pub(crate) density: Option<f64>,
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}
