//! What is measured of a drape: its outline in a picture from straight above, or its rim in a scan.

use super::effect::{Lies, View};
use super::measures::each_bearing;
use super::options::FitOptions;
use super::pose::{Pose, plan_of};
use super::prediction::{Compared, Prediction, compared};
use crate::base::boundary::POINTS;
use crate::base::{Boundary, Outline, Surface, Vector3};
use crate::numeric::moments::mean;
use crate::scan::EdgeShift;
use crate::sim::drop::rim_depth_m;
use crate::sim::{DropStart, Experiment, HeldRim, HeldSurface};

/// A drape that is fitted or predicted.
#[derive(Clone, Debug)]
pub struct Target {
    /// The outline \[m\]: of a picture around its centroid, of a scan in its frame.
    pub outline: Outline,
    /// The rim, where it was scanned or given.
    pub rim: Option<Box<Rim>>,
    /// Bearing of the warp, from +x towards +z, if it is known \[rad\].
    pub warp_rad: Option<f64>,
    /// Whether the specimen is turned over.
    pub turned_over: bool,
    /// How far it has settled, see [`Lies`].
    pub settled: f64,
    /// One over the camera's height above the plate's face, as far as it is known \[1/m\]; 0 from
    /// afar.
    pub per_height: f64,
    /// Specimen and plate.
    pub bench: Experiment,
    /// What finer cells move its drape by, once that is known.
    pub finer: Option<Box<Finer>>,
    /// Which specimen it is, if that is known.
    pub specimen: Option<String>,
}

/// How a tied sheet moves from the fit's cells to finer ones.
#[derive(Clone, Debug)]
pub struct Finer {
    /// Moves of the rim's points \[m\].
    pub rim: Vec<Vector3>,
    /// Moves of the places that are compared ([`compared`]) \[m\].
    pub places: Vec<Vector3>,
    /// How far cloth lies along these moves: mean and standard deviation of the prior.
    pub fabric_prior: [f64; 2],
}

/// A rim in space, simulation frame.
#[derive(Clone, Debug)]
pub struct Rim {
    /// The rim.
    pub boundary: Boundary,
    /// The whole sheet, if it was scanned.
    pub sheet: Option<Surface>,
    /// By how much farther out the scan had its edge than the rim has it; `None` of a rim that was
    /// given.
    pub edge: Option<EdgeShift>,
}

/// Rounds in which depth and distance from the axis follow each other; each leaves a tenth or so.
const DEPTH_ROUNDS: usize = 5;
/// Bearings at which the outline of a rim is taken.
const BEARINGS: usize = 720;

impl Target {
    /// Of an outline anywhere in its picture, face up.
    #[must_use]
    pub fn of(outline: &Outline, warp_rad: Option<f64>, bench: &Experiment) -> Self {
        let [cx, cz] = outline.centroid_m();
        let outline = outline.mapped(|[x, z]| [x - cx, z - cz]);
        let (rim, turned_over, settled, per_height) = (None, false, 0.0, 0.0);
        Self {
            outline,
            rim,
            warp_rad,
            turned_over,
            settled,
            per_height,
            bench: *bench,
            finer: None,
            specimen: None,
        }
    }

    /// Of a rim whose frame has the warp along x, face up; `None` where seen from above it does not
    /// go around the plate.
    #[must_use]
    pub fn of_rim(rim: Rim, bench: &Experiment) -> Option<Self> {
        let outline = rim.from_above()?;
        let of_outline = Self::of(&outline, Some(0.0), bench);
        Some(Self { outline, rim: Some(Box::new(rim)), ..of_outline })
    }

    /// The pose before anything is fitted.
    #[must_use]
    pub fn first_pose(&self) -> Pose {
        let cells = self.finer.as_ref().map_or(0.0, |finer| finer.fabric_prior[0]);
        Pose { rotation_rad: self.warp_rad.unwrap_or(0.0), cells, ..Pose::default() }
    }

    /// What of a drape is held against it.
    pub(super) fn compared(&self) -> Compared {
        match self.rim.as_deref() {
            Some(Rim { sheet: Some(_), .. }) => Compared::Sheet,
            _ => Compared::Rim,
        }
    }

    /// Whether a drape is tied to what was scanned: to a sheet, or to a rim without one.
    pub(super) fn is_held(&self, options: &FitOptions) -> bool {
        self.rim.is_some() && options.scan_hold_sag_m > 0.0
    }

    /// Force of the springs that tie a drape to what was scanned, root mean square, as a share of
    /// the cloth's weight; 0 where none do.
    pub(super) fn tied_share(
        &self,
        prediction: &Prediction,
        view: View,
        options: &FitOptions,
    ) -> f64 {
        match self.start(view, options) {
            Some(DropStart::HeldSurface(held)) => share_of(&held, &prediction.places),
            Some(DropStart::HeldRim(held)) => {
                let both = held.rim.positions_m().zip(&prediction.rim);
                let squared: Vec<f64> = both
                    .map(|(to, at)| (to.coords * (1.0 + held.farther) - at).norm_squared())
                    .collect();
                // each vertex of the border is tied as strongly as a cell weighs
                let grid = &prediction.drape.grid;
                let share = grid.border().len() as f64 / grid.cells.len() as f64;
                mean(&squared).sqrt() / held.sag_m * share
            }
            _ => 0.0,
        }
    }

    /// What a drape of a scanned sheet or of a rim starts from; tied to it, if it is, at the scale
    /// that a view has. `None` of a picture.
    pub(super) fn start(&self, view: View, options: &FitOptions) -> Option<DropStart> {
        let rim = self.rim.as_deref()?;
        let held = self.is_held(options);
        Some(match (&rim.sheet, held) {
            (Some(sheet), true) => DropStart::HeldSurface(Box::new(HeldSurface {
                surface: sheet.clone(),
                sag_m: options.scan_hold_sag_m,
                farther: farther(view),
            })),
            (Some(sheet), false) => DropStart::Surface(Box::new(sheet.clone())),
            (None, true) => DropStart::HeldRim(Box::new(HeldRim {
                rim: rim.boundary.clone(),
                sag_m: options.rim_hold_sag_m,
                farther: farther(view),
            })),
            (None, false) => DropStart::Guided(Box::new(rim.boundary.clone())),
        })
    }

    /// The standard deviations of its pose.
    pub(super) fn pose_sigma(&self, options: &FitOptions) -> Pose {
        if self.rim.is_some() {
            let cells = self.finer.as_ref().map_or(0.0, |finer| finer.fabric_prior[1]);
            return Pose { cells, ..options.scan_pose_sigma };
        }
        match self.warp_rad {
            Some(_) => options.pose_sigma,
            None => Pose { rotation_rad: options.unknown_bearing, ..options.pose_sigma },
        }
    }

    /// One over the camera's height, that which is known and what an effect adds \[1/m\].
    #[must_use]
    pub fn seen_from(&self, view: View) -> f64 {
        self.per_height + view.per_height
    }

    /// The outline in the plan of the simulation frame, as a pose has it whose scale is the true
    /// one: what looks smaller since it hangs lower is drawn outwards again, its depth that of
    /// nearly straight cloth.
    #[must_use]
    pub fn in_plan(&self, posed: &Pose, view: View) -> Outline {
        let per_height = self.seen_from(view);
        self.outline.mapped(|p| {
            let [x, z] = plan_of(p, posed);
            let seen_m = x.hypot(z);
            let closer = |m: f64| seen_m * (1.0 + per_height * rim_depth_m(&self.bench, m));
            let larger = (0..DEPTH_ROUNDS).fold(seen_m, |m, _| closer(m)) / seen_m.max(1e-9);
            [x * larger, z * larger]
        })
    }

    /// How the specimen lies in a pose.
    #[must_use]
    pub fn lies(&self, pose: &Pose) -> Lies {
        let face = if self.turned_over { -1.0 } else { 1.0 };
        Lies { face, bearing_rad: pose.rotation_rad, settled: self.settled }
    }
}

/// How much farther from the frame's origin than it was scanned a sheet lies at the scale of a
/// view, as a share.
pub(super) fn farther(view: View) -> f64 {
    (-view.ln_scale).exp_m1()
}

/// Force of the springs that hold a sheet whose compared places lie there, root mean square, as a
/// share of the sheet's weight.
fn share_of(held: &HeldSurface, places: &[Vector3]) -> f64 {
    let points = held.surface.points();
    let both = compared().map(|[i, j]| &points[i * Surface::SIDE + j]).zip(places);
    let both = both.filter(|(point, _)| point.observed);
    let squared: Vec<f64> = both
        .map(|(p, place)| (p.position_m.coords * (1.0 + held.farther) - place).norm_squared())
        .collect();
    if squared.is_empty() { 0.0 } else { mean(&squared).sqrt() / held.sag_m }
}

impl Rim {
    /// The farthest cloth at each bearing, of the rim and of the sheet; `None` where some bearing
    /// has none.
    #[must_use]
    pub fn from_above(&self) -> Option<Outline> {
        let mut farthest = [0.0_f64; BEARINGS];
        let step = std::f64::consts::TAU / BEARINGS as f64;
        let mut edge = |a: [f64; 2], b: [f64; 2]| {
            each_bearing(a, b, step, |k, distance_m, _| {
                let best = &mut farthest[k.rem_euclid(BEARINGS as isize) as usize];
                *best = best.max(distance_m);
            });
        };
        let rim: Vec<[f64; 2]> = self.boundary.positions_m().map(|p| [p.x, p.z]).collect();
        (0..POINTS).for_each(|k| edge(rim[k], rim[(k + 1) % POINTS]));
        if let Some(sheet) = &self.sheet {
            let side = sheet.side();
            let at = |i: usize, j: usize| {
                let p = sheet.points()[i * side + j].position_m;
                [p.x, p.z]
            };
            for i in 0..side {
                for j in 1..side {
                    edge(at(i, j - 1), at(i, j));
                    edge(at(j - 1, i), at(j, i));
                }
            }
        }
        let point = |(k, distance_m): (usize, &f64)| {
            let (sin, cos) = (step * k as f64).sin_cos();
            [distance_m * cos, distance_m * sin]
        };
        let all = farthest.iter().all(|distance_m| *distance_m > 0.0);
        all.then(|| Outline::new(farthest.iter().enumerate().map(point).collect()).ok())?
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Point3;

    #[test]
    fn a_level_rim_is_its_own_outline() {
        let at = |k: usize| Boundary::flat_xz_m(k, 0.3);
        let points = (0..POINTS).map(|k| Point3::new(at(k)[0], -0.04, at(k)[1]));
        let rim = Rim { boundary: Boundary::exact(points).unwrap(), sheet: None, edge: None };
        let outline = rim.from_above().unwrap();
        // a square of 300 mm, but for its corners between two bearings
        assert!((outline.area_m2() - 0.09).abs() < 1e-4, "{}", outline.area_m2());
        let comparison = rim.boundary.positions_m().map(|p| Point3::new(p.x + 1.0, p.y, p.z));
        let comparison =
            Rim { boundary: Boundary::exact(comparison).unwrap(), sheet: None, edge: None };
        assert!(comparison.from_above().is_none());
    }
}
