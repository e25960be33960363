//! What is found in a scan on the way to its rim, kept small: for pictures and reports,
//! above all of scans that are refused.
//!
//! Each step notes what it has found before the next one may refuse.

use super::error::{PlateCandidate, ScanError};
use super::measured::MeasuredSize;
use super::options::ScanOptions;
use super::scene::Scene;
use super::steps::{Assessed, Edged, Isolated, Local, Parameterised, Plated, Registered, Relaxed};
use super::unit::LengthUnit;
use crate::base::{BoundaryPoint, Isometry3, Point3, Vector3};

/// Points that are kept of a scene, and of what is found in it.
const MOST_SHOWN: usize = 40_000;

/// What was found so far. What no step came to is `None`, or empty.
#[derive(Clone, Debug)]
pub struct Found {
    /// Side of the specimen that was looked for \[m\].
    pub specimen_side_m: f64,
    /// Radius of the plate that was looked for \[m\].
    pub plate_radius_m: f64,
    /// The file's unit, given or guessed.
    pub unit: Option<LengthUnit>,
    /// Points of the scene, some of them, in the scan's own frame \[m\]; in the file's
    /// unit as long as that is not known.
    pub scene: Vec<Point3>,
    /// The plate.
    pub plate: Option<FoundPlate>,
    /// What looked most like a plate where none was found.
    pub plate_candidate: Option<PlateCandidate>,
    /// The place of the plate, where it is hardly likelier a drape than anything else.
    pub unlikely: Option<PlateCandidate>,
    /// The local frame from the scan's, both in metres: origin at the centre of the plate's
    /// top face, y up, bearing 0 along x.
    pub local_from_scan: Option<Isometry3>,
    /// Height of the floor at the plate's axis, local frame \[m\].
    pub floor_height_m: Option<f64>,
    /// Points of the cloth, some of them, local frame \[m\].
    pub cloth: Vec<Point3>,
    /// Typical distance between raw points of the cloth \[m\].
    pub point_spacing_m: Option<f64>,
    /// The cloth in the plane of its parameterisation, some points \[m\].
    pub flat: Vec<[f64; 2]>,
    /// The square that the cloth makes in that plane, for any size of the specimen.
    pub outline: Option<FoundSquare>,
    /// The specimen's square in that plane, of the size that was given.
    pub square: Option<FoundSquare>,
    /// The rim, local frame; with flags and sigmas if the last step came to them.
    pub rim: Vec<BoundaryPoint>,
}

/// A refused scan: why, and what was found until then.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{error}")]
pub struct Refusal {
    /// What was measured, the limit, the place, the remedy.
    pub error: ScanError,
    /// What was found before.
    pub found: Box<Found>,
}

/// A plate, scan's frame.
#[derive(Clone, Copy, Debug)]
pub struct FoundPlate {
    /// Centre of the cloth on it \[m\].
    pub centre: Point3,
    /// Up.
    pub up: Vector3,
    /// Radius at which the cloth leaves it \[m\].
    pub radius_m: f64,
    /// Noise of single points \[m\].
    pub noise_m: f64,
}

/// A square in the plane of the parameterisation.
#[derive(Clone, Copy, Debug)]
pub struct FoundSquare {
    /// Its corners, one after another \[m\].
    pub corners: [[f64; 2]; 4],
    /// Its side \[m\].
    pub side_m: f64,
}

/// Every n-th of the items, at most [`MOST_SHOWN`].
fn some<T: Copy>(all: &[T]) -> Vec<T> {
    all.iter().step_by(all.len().div_ceil(MOST_SHOWN).max(1)).copied().collect()
}

/// A step of which something is noted.
pub(super) trait Note {
    /// Notes it.
    fn note(&self, found: &mut Found);
}

impl Found {
    /// Notes what a step has found, and hands the step on.
    pub(super) fn note<T: Note>(&mut self, step: T) -> T {
        step.note(self);
        step
    }

    /// The points of a file, whose unit is not known yet.
    pub(super) fn of_file(points: &[Point3], options: &ScanOptions) -> Self {
        let mut scene = some(points);
        scene.retain(|p| p.iter().all(|c| c.is_finite()));
        Self {
            specimen_side_m: options.specimen_side_m,
            plate_radius_m: options.plate_radius_m,
            unit: None,
            scene,
            plate: None,
            plate_candidate: None,
            unlikely: None,
            local_from_scan: None,
            floor_height_m: None,
            cloth: Vec::new(),
            point_spacing_m: None,
            flat: Vec::new(),
            outline: None,
            square: None,
            rim: Vec::new(),
        }
    }

    /// The size of cloth and plate, if both were measured.
    pub(super) fn size(&self) -> Option<MeasuredSize> {
        let (side_m, plate) = (self.outline?.side_m, self.plate?);
        let FoundPlate { radius_m: plate_radius_m, noise_m, .. } = plate;
        Some(MeasuredSize { side_m, plate_radius_m, noise_m })
    }

    /// Notes what a refusal says of the scan.
    pub(super) fn note_refusal(&mut self, error: &ScanError) {
        let ScanError::NoPlate { why, unit, .. } = error.follows() else { return };
        self.plate_candidate = why.candidate().cloned();
        if self.unit.replace(*unit).is_none() {
            self.scene.iter_mut().for_each(|p| *p *= unit.metres());
        }
    }
}

impl Note for Scene {
    fn note(&self, found: &mut Found) {
        found.unit = Some(self.unit);
        found.scene = some(&self.points);
    }
}

impl Note for Plated {
    fn note(&self, found: &mut Found) {
        found.unit = Some(self.scene.unit);
        found.scene = some(&self.scene.points);
        let (centre, up) = (self.plate.centre, self.plate.up.into_inner());
        let (radius_m, noise_m) = (self.plate.radius_m, self.plate.noise_m);
        found.plate = Some(FoundPlate { centre, up, radius_m, noise_m });
        found.unlikely.clone_from(&self.unlikely);
    }
}

impl Note for Local {
    fn note(&self, found: &mut Found) {
        found.local_from_scan = Some(self.bench.local_from_scan);
        found.floor_height_m = self.bench.floor.map(|floor| floor.height_m);
    }
}

impl Note for Isolated {
    fn note(&self, found: &mut Found) {
        found.cloth = some(&self.cloth.surface);
        found.point_spacing_m = Some(self.cloth.raw_spacing_m);
    }
}

impl Note for Parameterised {
    fn note(&self, found: &mut Found) {
        found.flat = some(&self.surface.flat);
    }
}

impl Note for Relaxed {
    fn note(&self, found: &mut Found) {
        found.flat = some(&self.surface.flat);
        found.outline = self.outline.map(|outline| FoundSquare {
            corners: outline.square.corners(outline.side_m),
            side_m: outline.side_m,
        });
    }
}

impl Note for Registered<'_> {
    fn note(&self, found: &mut Found) {
        let side_m = self.side_m;
        found.flat = some(&self.cloth.surface.flat);
        found.square = Some(FoundSquare { corners: self.cloth.square.corners(side_m), side_m });
    }
}

impl Note for Edged<'_> {
    fn note(&self, found: &mut Found) {
        found.rim.clone_from(&self.rim.points);
    }
}

impl Note for Assessed<'_> {
    fn note(&self, found: &mut Found) {
        found.rim.clone_from(&self.edged.rim.points);
    }
}
