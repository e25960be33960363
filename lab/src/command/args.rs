//! Flags and verbs. A flag means here what the parameter of the same name means in the library.

use std::path::PathBuf;
use std::sync::LazyLock;

use clap::{Args, Parser, Subcommand};

use scan2params::calibrate::effect::Effect;
use scan2params::fabric::{DEFAULT_PRIOR, UNION_PRIOR};
use scan2params::terminal::experiment::ExperimentFlags;
use scan2params::terminal::flags::{ScanFlags, Talk, ThreadFlags};
use scan2params::terminal::value::{effect, energy_drop, percent, sensor_edge};
use scan2params::terminal::{names, version};

/// Measure the accuracy of scan2params and print the tables of docs/validation.
#[derive(Debug, Parser)]
#[command(name = "scan2params-lab", version, long_version = long_version(), about, max_term_width = 100)]
pub(crate) struct Arguments {
    #[command(flatten)]
    pub(crate) talk: Talk,
    #[command(flatten)]
    pub(crate) threads: ThreadFlags,
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// Version, model and numerics, a line each.
fn long_version() -> &'static str {
    static TEXT: LazyLock<String> = LazyLock::new(|| version::long(env!("CARGO_PKG_VERSION"), ""));
    &TEXT
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
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
    /// Scans of what is not quite the experiment, through the whole main job: is anything called
    /// reliable that is wrong, and is what is refused called by its cause?
    Altered(Altered),
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
    /// Figures of the verdict for valid scans and for scans of a wrong scale.
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

/// `scan2params-lab estimate`.
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

/// `scan2params-lab redrape`.
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
    /// Inputs of the estimate: `rim` for exact rims, and sensor profiles, as for `scan`
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

/// `scan2params-lab views`.
#[derive(Debug, Args)]
pub(crate) struct Views {
    /// Folder of drapes, as `scenes --make-drapes` fills it
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

/// `scan2params-lab altered`.
#[derive(Debug, Args)]
pub(crate) struct Altered {
    /// Folder of drapes, as `scenes --make-drapes` fills it; drapes of other benches are kept in
    /// its folder `altered`
    #[arg(long, value_name = "FOLDER")]
    pub(crate) drapes: PathBuf,
    /// Scans, with each alteration in turn
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) count: u64,
    /// The first scan
    #[arg(long, default_value_t = 0)]
    pub(crate) first: u64,
    /// Seed of the scans
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// These alterations alone, or `valid` for none
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    pub(crate) only: Vec<String>,
    /// Sensor profiles, in turn; as for `augment --profile`
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "handheld,phone,d435",
        value_name = "PROFILES"
    )]
    pub(crate) sensors: Vec<String>,
}

/// `scan2params-lab scenes`.
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

/// `scan2params-lab follow`.
#[derive(Debug, Args)]
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

#[derive(Debug, Args)]
pub(crate) struct Verdict {
    /// Prior of the fabrics
    #[arg(long, default_value = DEFAULT_PRIOR, value_parser = names::prior())]
    pub(crate) prior: String,
    /// Sensor profile; as for `scan`
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
    /// The scan is larger by this factor
    #[arg(long, default_value_t = 1.0)]
    pub(crate) scale: f64,
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
    /// Sensor profile; as for `scan`
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
    /// Sensor profiles, as for `scan`, or `rim` for exact rims without a sheet
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

/// `scan2params-lab transfer`.
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
    /// Sensor profiles, as for `scan`
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

/// `scan2params-lab calibrate`.
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

/// Parts of `scan2params-lab physics`.
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

fn key_value(text: &str) -> Result<(String, String), String> {
    let pair = text.split_once('=').ok_or("give STAGE.NAME=VALUE")?;
    Ok((pair.0.to_owned(), pair.1.to_owned()))
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
