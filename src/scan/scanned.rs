//! What a scan gives: its rim in the simulation frame, how good it is, and what it was
//! found from.

use nalgebra::{Translation3, UnitQuaternion};

use super::found::Found;
use super::options::ScanOptions;
use super::quality::Quality;
use super::shift::EdgeShift;
use super::steps::{Assessed, Edged, Oriented, Registered};
use super::surface::{self, Sampled};
use super::unit::LengthUnit;
use crate::base::boundary::{Orientation, POINTS_PER_SIDE, SIDES};
use crate::base::{Boundary, Isometry3, Point3, Surface, Vector3};

/// Raw points this close to the nominal edge or beyond it are shown as the edge's [m].
const SHOWN_EDGE_M: f64 = 2e-3;

/// The rim of a scan.
#[derive(Clone, Debug)]
pub struct ScannedBoundary {
    /// 244 points, simulation frame.
    pub boundary: Boundary,
    /// The whole sheet, simulation frame, 61 x 61 places; its sides are the rim.
    pub surface: Surface,
    /// Whether weft and warp are known.
    pub orientation: Orientation,
    /// Angle between the direction that was given for the warp and the specimen's axis that
    /// was taken for it \[rad\], at most an eighth of a turn; `None` if none was given.
    pub warp_off_rad: Option<f64>,
    /// The simulation frame from the scan's, both in metres.
    pub sim_from_scan: Isometry3,
    /// The file's unit, given or guessed.
    pub unit: LengthUnit,
    /// How much to trust it.
    pub quality: Quality,
    /// By how much the scan had its edges farther out than the rim has them.
    pub edge_shift: EdgeShift,
    /// What was found on the way, for comparing surfaces.
    pub evidence: Evidence,
    /// The same of every step, as a refusal has it, for pictures.
    pub found: Found,
}

/// Intermediate products, simulation frame \[m\].
#[derive(Clone, Debug)]
pub struct Evidence {
    /// Smoothed points of the cloth.
    pub cloth: Vec<Point3>,
    /// Material coordinates (x, z) of those points \[m\].
    pub material: Vec<[f64; 2]>,
    /// Raw points within 2 mm of the measured edge.
    pub edge_points: Vec<Point3>,
    /// The corners: ends of sides 0 to 3.
    pub corners: [Point3; 4],
}

impl ScannedBoundary {
    /// Takes the rim into the simulation frame.
    pub(super) fn of(assessed: Assessed, found: Found, options: &ScanOptions) -> Self {
        let quality = Quality::of(&assessed, options);
        let sim_from_local = sim_from_local(&assessed.edged, options);
        let surface = sheet(&assessed.edged, sim_from_local, options);
        let Assessed { edged: Edged { registered, near_edge, mut rim, shift, .. }, .. } = assessed;
        let Registered { cloth, material, .. } = registered;
        let Oriented { bench, surface: points, warp_off_rad, .. } = cloth;
        for point in &mut rim.points {
            point.position_m = sim_from_local * point.position_m;
        }
        let corner = |side: usize| rim.points[POINTS_PER_SIDE * side + POINTS_PER_SIDE - 1];
        let corners: [Point3; SIDES] = std::array::from_fn(|side| corner(side).position_m);
        let nominal_m = 0.5 * options.specimen_side_m;
        let on_edge = |m: [f64; 2]| m[0].abs().max(m[1].abs()) > nominal_m - SHOWN_EDGE_M;
        let on_edge = near_edge.iter().filter(|e| on_edge(e.material));
        let evidence = Evidence {
            cloth: points.points.iter().map(|p| sim_from_local * p).collect(),
            material,
            edge_points: on_edge.map(|e| sim_from_local * e.at).collect(),
            corners,
        };
        let boundary =
            Boundary::new(rim.points).unwrap_or_else(|_| unreachable!("four sides of 61 points"));
        let sim_from_scan = sim_from_local * bench.local_from_scan;
        let known = warp_off_rad.is_some();
        let orientation = if known { Orientation::Given } else { Orientation::Ambiguous };
        let unit = bench.unit;
        Self {
            boundary,
            surface,
            orientation,
            warp_off_rad,
            sim_from_scan,
            unit,
            quality,
            edge_shift: shift,
            evidence,
            found,
        }
    }
}

/// The sheet that the rim was traced on, sampled.
fn sheet(edged: &Edged, sim_from_local: Isometry3, options: &ScanOptions) -> Surface {
    let Edged { registered, rim, .. } = edged;
    let cloth = &registered.cloth;
    surface::sample(&Sampled {
        sheet: registered.sheet(),
        rim,
        material: &registered.material,
        spacing_m: cloth.cloth.spacing_m,
        noise_m: cloth.noise_m(),
        on_plate_m: registered.misfit.on_plate_m,
        side_m: options.specimen_side_m,
        sim_from_local,
        tuning: &options.tuning.uncertainty,
    })
}

/// The simulation frame from the local one: the plate's axis and face, and the warp along x.
fn sim_from_local(edged: &Edged, options: &ScanOptions) -> Isometry3 {
    let Edged { registered, origin, .. } = edged;
    let rotation_rad = -registered.cloth.square.rotation_rad;
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), rotation_rad);
    let rise_m = options.cloth_height_m - origin.face_y_m;
    let to_axis = Translation3::new(-origin.axis[0], rise_m, -origin.axis[1]);
    Isometry3::from_parts(Translation3::identity(), rotation) * to_axis
}
