//! The numbers that a verdict is made of, gathered from the parts of a job.

use super::super::{NotTaken, Refinement};
use crate::base::boundary::{Orientation, POINTS, POINTS_PER_SIDE, SIDES};
use crate::base::frame::GRAVITY_M_S2;
use crate::base::units::N_M_PER_G_S2;
use crate::base::{Boundary, Point3};
use crate::estimate::{Estimate, EstimateWarning};
use crate::fabric::{Likeness, STIFFNESSES};
use crate::intake::Rim;
use crate::intake::rim::GivenWarp;
use crate::refine::{RefinedStiffness, ReleasedDrape, ScanFit};
use crate::scan::{ScanOptions, ScannedBoundary};
use crate::sim::Stop;
use crate::sim::drape::count_nodes;
use crate::sim::experiment::bending_length_m;

/// What a verdict is made of. Lengths in metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Figures {
    /// What the experiment was said to be.
    pub given: Given,
    /// Lengths of the four sides: along the cloth in a scan, along the chords between the points
    /// in a rim from a file.
    pub sides_m: [f64; SIDES],
    /// Noise: of single points of a scan, the mean of the sigmas of a rim from a file.
    pub noise_m: f64,
    /// What the scan shows beside the rim; `None` for a rim from a file.
    pub scan: Option<OnPlate>,
    /// Share of the rim's points that were observed.
    pub observed_fraction: f64,
    /// The longest bridged arc.
    pub longest_gap_m: f64,
    /// Folds of the rim.
    pub folds: usize,
    /// Whether weft and warp are known.
    pub orientation: Orientation,
    /// Angle between the direction given for the warp and the axis taken for it \[rad\].
    pub warp_off_rad: Option<f64>,
    /// Whether a direction was given for the warp of a rim whose file says it.
    pub warp_unused: bool,
    /// The estimate, if there is one.
    pub answer: Option<Answer>,
    /// What refining found, if it was asked for.
    pub refining: Option<Refining>,
    /// Tilt of the plate that refining found \[rad\]; 0 without it.
    pub tilt_rad: f64,
    /// The released drape, if there is one.
    pub released: Option<Fit>,
}

/// What the experiment was said to be, and the limits beyond which a scan is refused.
#[derive(Clone, Debug, PartialEq)]
pub struct Given {
    /// Side of the square specimen.
    pub side_m: f64,
    /// Radius of the plate.
    pub plate_radius_m: f64,
    /// Least share of the rim that must be observed.
    pub least_observed: f64,
    /// Longest arc that is bridged.
    pub longest_gap_m: f64,
    /// Largest distance of cloth and sheet.
    pub most_misfit_m: f64,
    /// Largest area of unexplained cloth \[m^2\].
    pub most_unexplained_m2: f64,
}

/// What a scan shows beside the rim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnPlate {
    /// Radius at which the cloth leaves the plate.
    pub radius_m: f64,
    /// Its standard error.
    pub radius_sigma_m: f64,
    /// Offset of the specimen's centre from the plate's axis on the flat cloth.
    pub centre_offset_m: f64,
    /// Root mean square distance of cloth and sheet.
    pub misfit_m: f64,
    /// Largest area of cloth near a point of the rim that the sheet does not explain \[m^2\].
    pub unexplained_m2: f64,
    /// Length of the cloth from edge to opposite edge along warp and weft, where both edges
    /// were seen.
    pub widths_m: [Option<f64>; 2],
}

/// What the estimate says.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// Bending length of the middle of the three bending stiffnesses.
    pub bending_length_m: f64,
    /// Stretch of cloth under its own weight over the specimen's half side, along weft and
    /// warp, with the lower ends of the intervals of S^u and S^v \[-\].
    pub stretch: [f64; 2],
    /// The six stiffnesses.
    pub parameters: [Parameter; STIFFNESSES],
    /// Density and the ends of what the model was trained on \[g/m^2\], if it lies outside.
    pub density_outside_g_m2: Option<(f64, [f64; 2])>,
    /// Root mean square distance of the rim from those of the training.
    pub novelty_m: f64,
    /// What 99 of 100 drapes like those of the training stay below.
    pub novelty_limit_m: f64,
    /// Where the fabric lies in the model's prior; `None` for a model that has none.
    pub prior: Option<InPrior>,
    /// Whether the bending stiffnesses had to be made those of one plate: B^h as estimated and as
    /// raised \[g mm^2 s^-2 rad^-1\].
    pub bending_raised: Option<[f64; 2]>,
}

/// Where a fabric lies in the prior that the model was trained on.
#[derive(Clone, Debug, PartialEq)]
pub struct InPrior {
    /// Whether the answer's intervals stand on that prior: not those of a fabric that was refined.
    pub network: bool,
    /// Whether the fabric is like any part of it.
    pub like: bool,
    /// Distance from the part that it is likeliest of, in standard deviations of the part and the
    /// interval.
    pub distance: f64,
    /// What 99 of 100 of that part's own fabrics stay below.
    pub limit: f64,
    /// All of it in words ([`Likeness::words`]).
    pub words: String,
}

impl InPrior {
    fn of(likeness: &Likeness) -> Option<Self> {
        let likeliest = likeness.likeliest()?;
        Some(Self {
            network: true,
            like: !likeness.is_outside(),
            distance: likeliest.distance,
            limit: likeliest.limit,
            words: likeness.words(),
        })
    }
}

/// One stiffness of an answer, in the paper's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Its key in params.json.
    pub key: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The estimate.
    pub value: f64,
    /// The 90 % interval.
    pub interval90: [f64; 2],
    /// Ends of what the model was trained on; value and interval are cut there.
    pub trained: [f64; 2],
    /// The end at or beyond which the value lies, if it does: 0 for the lower.
    pub pinned: Option<usize>,
}

/// What refining found.
#[derive(Clone, Debug, PartialEq)]
pub enum Refining {
    /// The answer is the network's.
    Left(NotTaken),
    /// The fabric is the answer.
    Taken {
        /// What the drape shows of each of the six.
        shown: [Shown; STIFFNESSES],
        /// What the fit leaves, in standard deviations of scan and simulator.
        misfit: f64,
    },
}

/// What a drape shows of one stiffness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown {
    /// Its key in params.json.
    pub key: &'static str,
    /// Share of the variance before that the drape took away.
    pub share: f64,
}

impl Refining {
    fn of(refinement: &Refinement) -> Self {
        match (refinement.taken(), refinement.not_taken()) {
            (Some(taken), _) => {
                let of = |s: RefinedStiffness| Shown { key: s.key, share: s.shown };
                let refined = taken.refined();
                Self::Taken { shown: refined.stiffnesses.map(of), misfit: refined.misfit }
            }
            (None, Some(why)) => Self::Left(why),
            (None, None) => unreachable!("taken or not"),
        }
    }
}

/// The released drape beside the scanned rim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Mean distance of corresponding rim points.
    pub mean_m: f64,
    /// Its folds.
    pub folds: usize,
    /// Why the search for rest ended.
    pub stop: Stop,
    /// Largest net force on a vertex \[N\].
    pub residual_n: f64,
    /// Pairs of triangles that intersect.
    pub intersections: usize,
}

impl Figures {
    /// The figures of what was found in a scan.
    #[must_use]
    pub fn of_scan(scanned: &ScannedBoundary, options: &ScanOptions) -> Self {
        let q = &scanned.quality;
        Self {
            given: Given::of(options, [q.noise_m, q.sheet_rms_on_plate_m, q.surface_spacing_m]),
            sides_m: q.side_lengths_m,
            noise_m: q.noise_m,
            scan: Some(on_plate(scanned)),
            observed_fraction: q.observed_fraction,
            longest_gap_m: q.longest_gap_m,
            folds: count_nodes(&scanned.boundary),
            orientation: scanned.orientation,
            warp_off_rad: scanned.warp_off_rad,
            warp_unused: false,
            answer: None,
            refining: None,
            tilt_rad: 0.0,
            released: None,
        }
    }

    /// The figures of a rim, from a scan or from a file.
    #[must_use]
    pub fn of_rim(rim: &Rim, options: &ScanOptions) -> Self {
        let (boundary, warp) = match rim {
            Rim::Scanned { scanned, .. } => return Self::of_scan(scanned, options),
            Rim::Given { boundary, warp, .. } => (boundary, *warp),
        };
        Self {
            given: Given::of(options, [0.0; 3]),
            sides_m: side_chords_m(boundary),
            noise_m: boundary.mean_sigma_m(),
            scan: None,
            observed_fraction: rim.observed_fraction(),
            longest_gap_m: longest_gap_m(boundary),
            folds: count_nodes(boundary),
            orientation: rim.orientation(),
            warp_off_rad: rim.warp_off_rad(),
            warp_unused: warp == GivenWarp::FileNotFlag,
            answer: None,
            refining: None,
            tilt_rad: 0.0,
            released: None,
        }
    }

    /// The same figures with those of the estimate, of where it lies in the model's prior, and of
    /// its drape where there is one.
    #[must_use]
    pub fn answered(
        self,
        estimate: &Estimate,
        likeness: Option<&Likeness>,
        released: Option<&ReleasedDrape>,
    ) -> Self {
        let answer = Some(Answer::of(estimate, likeness, self.given.side_m));
        Self { answer, released: released.map(Fit::of), ..self }
    }

    /// The same figures with those of the refinement. Where it was taken, the ends of the training
    /// are no ends of the answer, and its intervals do not stand on the model's prior.
    #[must_use]
    pub fn refined(mut self, refinement: &Refinement) -> Self {
        let refining = Refining::of(refinement);
        if let (Refining::Taken { .. }, Some(answer)) = (&refining, &mut self.answer) {
            for parameter in &mut answer.parameters {
                (parameter.trained, parameter.pinned) = ([0.0, f64::INFINITY], None);
            }
            if let Some(prior) = &mut answer.prior {
                prior.network = false;
            }
        }
        let tilts = refinement.result.iter().flat_map(|refined| &refined.scans);
        let tilt_rad = tilts.map(ScanFit::tilt_rad).fold(0.0, f64::max);
        Self { refining: Some(refining), tilt_rad, ..self }
    }
}

impl Given {
    /// For a scan of this noise, which leaves `on_plate_m` of itself on the smoothed surface, whose
    /// points are `spacing_m` apart.
    fn of(options: &ScanOptions, [noise_m, on_plate_m, spacing_m]: [f64; 3]) -> Self {
        Self {
            side_m: options.specimen_side_m,
            plate_radius_m: options.plate_radius_m,
            least_observed: options.least_observed(noise_m),
            longest_gap_m: options.longest_gap_m(noise_m),
            most_misfit_m: options.most_misfit_m(on_plate_m),
            most_unexplained_m2: options.most_unexplained_m2(spacing_m),
        }
    }
}

fn on_plate(scanned: &ScannedBoundary) -> OnPlate {
    let q = &scanned.quality;
    OnPlate {
        radius_m: q.plate_radius_m,
        radius_sigma_m: q.plate_radius_scatter_m / BEARINGS_OF_ONE_PLATE.sqrt(),
        centre_offset_m: q.centre_offset_m,
        misfit_m: q.sheet_rms_m,
        unexplained_m2: q.unexplained_m2,
        widths_m: q.widths_m,
    }
}

/// Bearings on which the plate's edge is found independently of each other: 36 are looked at,
/// and those of one fold err together (`scan::plate` counts four as one).
const BEARINGS_OF_ONE_PLATE: f64 = 9.0;

impl Answer {
    fn of(estimate: &Estimate, likeness: Option<&Likeness>, side_m: f64) -> Self {
        let fabric = &estimate.fabric;
        let hanging_n_m = fabric.density_kg_m2 * GRAVITY_M_S2 * 0.5 * side_m;
        let all = estimate.parameters();
        let stretch = [0, 1].map(|i| hanging_n_m / (all[i].interval90[0] * N_M_PER_G_S2));
        let (mut density_outside_g_m2, mut bending_raised) = (None, None);
        let mut pinned = [None; STIFFNESSES];
        for warning in &estimate.warnings {
            match *warning {
                EstimateWarning::DensityOutsideTraining { value, min, max } => {
                    density_outside_g_m2 = Some((value, [min, max]));
                }
                EstimateWarning::AtRangeEnd { key, end } => {
                    if let Some(i) = all.iter().position(|p| p.key == key) {
                        pinned[i] = Some(usize::from(end == "upper"));
                    }
                }
                EstimateWarning::Bending(crate::fabric::Warning::BendingProjected { from, to }) => {
                    bending_raised = Some([from, to]);
                }
                EstimateWarning::Bending(_)
                | EstimateWarning::NovelRim { .. }
                | EstimateWarning::OrientationAmbiguous => {}
            }
        }
        Self {
            bending_length_m: bending_length_m(fabric),
            stretch,
            parameters: std::array::from_fn(|i| Parameter {
                key: all[i].key,
                unit: all[i].unit,
                value: all[i].value,
                interval90: all[i].interval90,
                trained: all[i].trained,
                pinned: pinned[i],
            }),
            density_outside_g_m2,
            novelty_m: estimate.novelty.rms_m,
            novelty_limit_m: estimate.novelty.limit_m,
            prior: likeness.and_then(InPrior::of),
            bending_raised,
        }
    }
}

impl Fit {
    fn of(released: &ReleasedDrape) -> Self {
        let drape = &released.drape;
        Self {
            mean_m: released.mean_distance_m,
            folds: drape.nodes,
            stop: drape.stop,
            residual_n: drape.residual_n,
            intersections: drape.intersections,
        }
    }
}

/// Lengths of the four sides along the chords between their points.
fn side_chords_m(rim: &Boundary) -> [f64; SIDES] {
    let points: Vec<Point3> = rim.positions_m().collect();
    std::array::from_fn(|side| {
        let side = &points[side * POINTS_PER_SIDE..(side + 1) * POINTS_PER_SIDE];
        side.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
    })
}

/// The longest run of points that were not observed, from the observed point before it to the
/// one after it; the whole rim if none was observed.
fn longest_gap_m(rim: &Boundary) -> f64 {
    let points = rim.points();
    let step_m =
        |i: usize| (points[(i + 1) % POINTS].position_m - points[i % POINTS].position_m).norm();
    let Some(first) = points.iter().position(|p| p.observed) else {
        return (0..POINTS).map(step_m).sum();
    };
    let (mut longest_m, mut run_m, mut hidden) = (0.0_f64, 0.0, false);
    for i in first..first + POINTS {
        run_m += step_m(i);
        if points[(i + 1) % POINTS].observed {
            if hidden {
                longest_m = longest_m.max(run_m);
            }
            (run_m, hidden) = (0.0, false);
        } else {
            hidden = true;
        }
    }
    longest_m
}
