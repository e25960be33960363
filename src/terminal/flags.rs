//! Flags that both command lines have: threads, how much is printed, a scan and how it is read.

#![allow(
    rustdoc::broken_intra_doc_links,
    reason = "the words are those of --help, units in brackets"
)]

use std::path::PathBuf;

use anyhow::anyhow;
use clap::Args;

use super::{Failure, Outcome, names, print};
use crate::base::frame::{PLATE_RADIUS_M, SPECIMEN_SIDE_M};
use crate::base::units::{LIKELY_SCALES, M_PER_MM};
use crate::intake::hints::{parse_crop, parse_place, parse_up};
use crate::intake::rim::parse_warp_toward;
use crate::io::{
    DepthSource, Format, Intrinsics, ReadOptions, files_of, intrinsics, is_views_folder,
};
use crate::scan::{Crop, LengthUnit, MarkColor, ScanOptions, WarpToward};

/// How much is printed on stderr.
#[derive(Debug, Args)]
pub struct Talk {
    /// Print only warnings and errors on stderr
    #[arg(long, short, global = true, display_order = 101, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Print each step and its time on stderr, even if stderr is not a terminal
    #[arg(long, short, global = true, display_order = 102)]
    pub verbose: bool,
}

impl Talk {
    /// Holds from here on.
    pub fn apply(&self) {
        print::talk(self.quiet, self.verbose);
    }
}

/// How many threads are used.
#[derive(Clone, Debug, Args)]
pub struct ThreadFlags {
    /// Number of threads at most, or 0 for one per core. No result depends on it; one drape is
    /// computed on one
    #[arg(long, global = true, display_order = 100, value_name = "N", default_value = "0", value_parser = threads)]
    pub threads: usize,
}

impl ThreadFlags {
    /// Limits what runs on rayon's pool, which all computing does; 0 leaves one thread per core.
    ///
    /// # Errors
    /// A pool that cannot be made.
    pub fn apply(&self) -> Outcome {
        if self.threads > 0 {
            rayon::ThreadPoolBuilder::new().num_threads(self.threads).build_global()?;
        }
        Ok(())
    }
}

/// A scan, and how it is read.
#[derive(Clone, Debug, Args)]
pub struct ScanFlags {
    /// The scan: PLY, OBJ, PCD, STL, GLB, E57, LAS, LAZ, XYZ, 16-bit depth PNG, views.json or its
    /// folder. `estimate` also takes a rim that `boundary` wrote; `-` with --format is the standard
    /// input
    #[arg(value_name = "INPUT")]
    pub input: PathBuf,
    /// More recordings of the same drape, unmoved, each in any frame; all are registered
    #[arg(value_name = "PASS")]
    pub passes: Vec<PathBuf>,
    /// Format of INPUT, for any file name
    #[arg(long, value_name = "NAME", value_parser = names::format(), ignore_case = true)]
    pub format: Option<Format>,
    #[command(flatten)]
    pub read: ReadFlags,
}

impl ScanFlags {
    /// What the flags say of the file.
    ///
    /// # Errors
    /// An input that is no scan, and what [`ReadFlags::read`] refuses.
    pub fn read_options(&self) -> Result<ReadOptions, Failure> {
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
    pub fn files(&self) -> Vec<PathBuf> {
        // A list of views that cannot be read is an error when it is read.
        let of = |input: &PathBuf| files_of(input).unwrap_or_else(|_| vec![input.clone()]);
        let scans = std::iter::once(&self.input).chain(&self.passes);
        scans.flat_map(of).chain(self.read.intrinsics.clone()).collect()
    }
}

/// How scans are read.
#[derive(Clone, Debug, Args)]
pub struct ReadFlags {
    /// Where the warp points in the scan's frame: +x, -y, ..., three numbers x,y,z,
    /// or a bearing in degrees (counter-clockwise from above, from the scan's x axis)
    #[arg(long, value_name = "DIRECTION", value_parser = parse_warp_toward, allow_hyphen_values = true)]
    pub warp_toward: Option<WarpToward>,
    /// Colour of a mark in the middle of the side to which the warp runs, on the
    /// specimen itself: red, orange, yellow, green, cyan, blue, magenta or #rrggbb
    #[arg(long, value_name = "COLOUR", conflicts_with = "warp_toward")]
    pub mark: Option<MarkColor>,
    /// Unit of the file's coordinates. If not given, guessed from scene and plate
    #[arg(long, value_parser = names::unit(), value_name = "UNIT")]
    pub unit: Option<LengthUnit>,
    /// Factor by which all lengths of the scan are divided: 1.012 for a scan that is 1.2 % too
    /// large. Positions in other flags are in the divided lengths
    #[arg(long, value_name = "SCALE", value_parser = rescale)]
    pub rescale: Option<f64>,
    /// Part of the scan that is used: a radius about the plate [mm], or two opposite corners
    /// X1,Y1,Z1,X2,Y2,Z2 of a box in the file's frame and unit
    #[arg(long, value_name = "RADIUS_MM|BOX", value_parser = parse_crop, allow_hyphen_values = true)]
    pub crop: Option<Crop>,
    /// Up in the scan's frame, to within 20 degrees: x, -x, y, -y, z, -z, or three numbers X,Y,Z.
    /// If not given, found from the cloth
    #[arg(long, value_name = "AXIS", value_parser = parse_up, allow_hyphen_values = true)]
    pub up: Option<[f64; 3]>,
    /// Position of the plate, to within 100 mm, in the file's frame and unit. If not given, found
    /// from the cloth
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_place, allow_hyphen_values = true)]
    pub plate_near: Option<[f64; 3]>,
    /// Side of the square specimen [mm]; `estimate` and `batch` take 300 only
    #[arg(long, value_name = "MM", default_value_t = SPECIMEN_SIDE_M / M_PER_MM)]
    pub specimen_size: f64,
    /// Radius of the plate [mm]; `estimate` and `batch` take 50 only
    #[arg(long, value_name = "MM", default_value_t = PLATE_RADIUS_M / M_PER_MM)]
    pub plate_radius: f64,
    /// Seed of the plane search
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Camera of depth images: Open3D JSON, ROS camera_info YAML, or nine numbers
    #[arg(long, value_name = "FILE", conflicts_with_all = ["fx", "fy", "cx", "cy"])]
    pub intrinsics: Option<PathBuf>,
    /// Focal length of depth images in x [pixels]
    #[arg(long, value_name = "PIXELS", requires_all = ["fy", "cx", "cy"])]
    pub fx: Option<f64>,
    /// Focal length in y [pixels]
    #[arg(long, value_name = "PIXELS", requires = "fx")]
    pub fy: Option<f64>,
    /// Principal point in x [pixels]
    #[arg(long, value_name = "PIXELS", requires = "fx", allow_negative_numbers = true)]
    pub cx: Option<f64>,
    /// Principal point in y [pixels]
    #[arg(long, value_name = "PIXELS", requires = "fx", allow_negative_numbers = true)]
    pub cy: Option<f64>,
    /// Source of the depth images, which gives their unit
    #[arg(long, value_name = "NAME", value_parser = names::depth_source(), conflicts_with = "depth_scale")]
    pub sensor: Option<DepthSource>,
    /// Depth units per metre in depth images
    #[arg(long, value_name = "UNITS_PER_METRE", default_value_t = 1000.0)]
    pub depth_scale: f64,
    /// Drop pixels of depth images with fewer than three of eight neighbours within
    /// this depth [mm]
    #[arg(long, value_name = "MM")]
    pub drop_jumps: Option<f64>,
}

impl ReadFlags {
    /// What the flags say of depth images.
    ///
    /// # Errors
    /// Numbers that cannot be, and a camera's file that cannot be read.
    pub fn read(&self) -> Result<ReadOptions, Failure> {
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

    /// What the flags say of the search for the rim.
    ///
    /// # Errors
    /// Hints that cannot be.
    pub fn options(&self) -> Result<ScanOptions, Failure> {
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

/// A number of threads that a machine can have; 0 stands for one per core.
fn threads(text: &str) -> Result<usize, String> {
    const MOST: usize = 1024;
    let threads: Option<usize> = text.parse().ok();
    threads.filter(|&threads| threads <= MOST).ok_or_else(|| format!("give 0 to {MOST}"))
}

/// A scale that a scan can have; others are units.
fn rescale(text: &str) -> Result<f64, String> {
    let scale: Option<f64> = text.trim().parse().ok();
    let likely = scale.filter(|scale| LIKELY_SCALES.contains(scale));
    let [least, most] = [LIKELY_SCALES.start(), LIKELY_SCALES.end()];
    likely.ok_or_else(|| format!("give {least} to {most}, like 1.012; units are for --unit"))
}
