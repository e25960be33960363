//! What params.json says of the fit.

use serde::Serialize;

use crate::base::units::M_PER_MM;
use crate::fabric::{STIFFNESSES, Stiffnesses};
use crate::job;
use crate::refine::{self, ArcResidual, Ended, Nuisance, Refined, RefinedStiffness, StartedFrom};
use crate::sim::Stop;

/// What refining found. Without a fit only the first four keys are there.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(extend("dependentRequired" = { "ended": [
    "stiffnesses", "correlation_ln", "start", "drapes", "on_branch", "tied_drape", "released_drape", "arcs", "bench", "with"
] })))]
pub struct Refinement {
    /// Whether `parameters` are the refined values.
    pub taken: bool,
    /// What the network reported for the first scan.
    pub network: Stiffnesses<Before>,
    /// Time on the wall \[s\].
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub wall_s: f64,
    /// Why nothing was fitted; null where something was.
    pub error: Option<String>,
    /// The fit; its fields stand in the place of this one.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub fit: Option<Fit>,
}

/// A fit.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Fit {
    /// Why the fit ended.
    pub ended: Ended,
    /// What the drape shows of each stiffness.
    pub stiffnesses: Stiffnesses<Shown>,
    /// Correlations of the logarithms of the six stiffnesses, in the order of `parameters` as
    /// docs/symbols.md has it \[-\].
    pub correlation_ln: [[f64; STIFFNESSES]; STIFFNESSES],
    /// The first start that came to rest.
    #[cfg_attr(test, schemars(extend("enum" = ["estimate", "stiffer", "softer"])))]
    pub start: &'static str,
    /// Drapes simulated, all scans together \[count\].
    pub drapes: usize,
    /// The first scan; its fields stand in the place of this one.
    #[serde(flatten)]
    pub first: ScanFit,
    /// The other scans of `--with`.
    pub with: Vec<Companion>,
}

/// A stiffness before refining.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Before {
    /// The value, in the unit of `parameters` \[`unit`\].
    pub value: f64,
    /// 90 % interval \[`unit`\].
    pub interval90: [f64; 2],
}

/// What the drape shows of a stiffness.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Shown {
    /// Share of what was uncertain that the drape took away \[-\].
    #[cfg_attr(test, schemars(range(max = 1)))]
    pub shown: f64,
    /// Whether it ended at the end of what refining allows.
    pub at_limit: bool,
}

/// Another scan of the same fabric.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Companion {
    /// The scan, as it was named.
    pub file: String,
    /// It beside its drapes; its fields stand in the place of this one.
    #[serde(flatten)]
    pub scan: ScanFit,
}

/// A scan beside the drapes of the fabric found.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ScanFit {
    /// Whether the tied drape has the scan's arrangement of folds.
    pub on_branch: bool,
    /// The tied drape of this scan.
    pub tied_drape: TiedDrape,
    /// The released drape of this scan; null if it was not asked for.
    pub released_drape: Option<ReleasedDrape>,
    /// Eight halves of sides from the first corner on.
    pub arcs: [Arc; 8],
    /// How cloth and plate lay, as found.
    pub bench: Bench,
}

/// Half a side of the rim.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Arc {
    /// Mean distance of the two rims \[mm\].
    pub mean_mm: f64,
    /// The same in standard deviations of scan and simulator \[-\].
    pub sigmas: f64,
}

/// How cloth and plate lay, as found.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Bench {
    /// Offset along x \[mm\].
    pub offset_x: BenchNumber,
    /// Offset along z \[mm\].
    pub offset_z: BenchNumber,
    /// Rotation about the vertical \[deg\].
    pub rotation: BenchNumber,
    /// Fall of the plate towards +x \[deg\].
    pub tilt_down_x: BenchNumber,
    /// Fall of the plate towards +z \[deg\].
    pub tilt_down_z: BenchNumber,
    /// Height of the plate \[mm\].
    pub plate_height: BenchNumber,
    /// Place of the plate's axis beside the scan's, along x \[mm\].
    pub axis_x: BenchNumber,
    /// Place of the plate's axis beside the scan's, along z \[mm\].
    pub axis_z: BenchNumber,
}

/// One number of how the cloth lay.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct BenchNumber {
    /// As found \[`unit`\].
    pub value: f64,
    /// Standard deviation allowed before \[`unit`\].
    pub sigma_before: f64,
    /// Unit of both.
    #[cfg_attr(test, schemars(extend("enum" = ["mm", "deg"])))]
    pub unit: &'static str,
}

/// The fabric's sheet, tied to the scan by weak springs. Its distances say how well the fabric
/// explains the scan.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct TiedDrape {
    /// Mean distance of its rim from the scanned one \[mm\].
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub rim_mean_mm: f64,
    /// Largest distance of the two rims \[mm\].
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub rim_largest_mm: f64,
    /// Root mean square distance of the sheet from the scanned one, all scans together, in standard
    /// deviations of scan and simulator \[1\].
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub misfit_sigma: f64,
    /// Force of the springs, root mean square, as a share of the sheet's weight \[1\].
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub springs_carry: f64,
    /// Folds of its rim \[count\].
    pub folds: usize,
}

/// What the fabric's sheet does when nothing holds it to the scan.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ReleasedDrape {
    /// Mean distance of its rim from the scanned one \[mm\].
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub rim_mean_mm: f64,
    /// Largest distance of the two rims \[mm\].
    #[cfg_attr(test, schemars(range(min = 0)))]
    pub rim_largest_mm: f64,
    /// Folds of its rim \[count\].
    pub folds: usize,
    /// What it was started from before it was released: the scanned sheet or its rim.
    pub started_from: StartedFrom,
    /// Why the search for rest ended.
    pub stop: Stop,
    /// Pairs of triangles that cross \[count\].
    pub intersections: usize,
}

impl Refinement {
    pub(super) fn of(found: &job::Refinement) -> Self {
        let before = found.network.parameters();
        let before = before.map(|p| Before { value: p.value, interval90: p.interval90 });
        Self {
            taken: found.taken().is_some(),
            network: before.into(),
            wall_s: found.wall_s,
            error: found.result.as_ref().err().map(ToString::to_string),
            fit: found.result.as_ref().ok().and_then(|refined| Fit::of(refined, found)),
        }
    }
}

impl Fit {
    /// `None` of a fit to no scan.
    fn of(refined: &Refined, found: &job::Refinement) -> Option<Self> {
        let mut scans = refined.scans.iter().map(|scan| ScanFit::of(scan, refined.misfit));
        let first = scans.next()?;
        let with = found.companions.iter().zip(scans).map(|(companion, scan)| Companion {
            file: companion.path.display().to_string(),
            scan,
        });
        let shown = |s: &RefinedStiffness| Shown { shown: s.shown, at_limit: s.at_limit };
        Some(Self {
            ended: refined.ended,
            stiffnesses: refined.stiffnesses.each_ref().map(shown).into(),
            correlation_ln: refined.correlation,
            start: refined.start,
            drapes: refined.drapes,
            first,
            with: with.collect(),
        })
    }
}

impl ScanFit {
    fn of(scan: &refine::ScanFit, misfit: f64) -> Self {
        let arc = |arc: &ArcResidual| Arc { mean_mm: arc.mean_m / M_PER_MM, sigmas: arc.sigmas };
        Self {
            on_branch: scan.on_branch,
            tied_drape: TiedDrape::of(scan, misfit),
            released_drape: scan.released.as_ref().map(ReleasedDrape::of),
            arcs: scan.arcs.each_ref().map(arc),
            bench: Bench::of(scan.bench),
        }
    }
}

impl Bench {
    fn of(numbers: [Nuisance; 8]) -> Self {
        let [offset_x, offset_z, rotation, tilt_down_x, tilt_down_z, plate_height, axis_x, axis_z] =
            numbers;
        let length = |of: Nuisance| BenchNumber::of(&of, "mm", 1.0 / M_PER_MM);
        let angle = |of: Nuisance| BenchNumber::of(&of, "deg", 1_f64.to_degrees());
        Self {
            offset_x: length(offset_x),
            offset_z: length(offset_z),
            rotation: angle(rotation),
            tilt_down_x: angle(tilt_down_x),
            tilt_down_z: angle(tilt_down_z),
            plate_height: length(plate_height),
            axis_x: length(axis_x),
            axis_z: length(axis_z),
        }
    }
}

impl BenchNumber {
    fn of(number: &Nuisance, unit: &'static str, scale: f64) -> Self {
        Self { value: number.value * scale, sigma_before: number.sigma * scale, unit }
    }
}

impl TiedDrape {
    pub(super) fn of(fit: &refine::ScanFit, misfit: f64) -> Self {
        Self {
            rim_mean_mm: fit.tied_mean_m / M_PER_MM,
            rim_largest_mm: fit.tied_largest_m / M_PER_MM,
            misfit_sigma: misfit,
            springs_carry: fit.springs_share,
            folds: fit.nodes[1],
        }
    }
}

impl ReleasedDrape {
    pub(super) fn of(released: &refine::ReleasedDrape) -> Self {
        Self {
            rim_mean_mm: released.mean_distance_m / M_PER_MM,
            rim_largest_mm: released.largest_distance_m / M_PER_MM,
            folds: released.drape.nodes,
            started_from: released.started_from,
            stop: released.drape.stop,
            intersections: released.drape.intersections,
        }
    }
}
