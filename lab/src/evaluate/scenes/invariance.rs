//! The same cloud cropped, added to and turned: what is not the drape should not move its rim.
//!
//! In: a scanned scene and what was found in it. Out: a [`Variant`] each: whether the outcome is
//! the same, and how far the rim moves. Both rims are in the simulation frame.

use nalgebra::{Translation3, UnitQuaternion};
use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};
use serde::Serialize;

use super::super::scan::deformed_m;
use super::broken::{keep, name_of};
use super::made::Made;
use scan2params::base::units::M_PER_MM;
use scan2params::base::{Boundary, Isometry3, Point3, Vector3, seed};
use scan2params::geom::adjacency::spread;
use scan2params::scan::{ScanError, ScannedBoundary};
use scan2params::sensor::{Solid, VirtualScan};

/// Points so near above the floor go with it \[m\].
const FLOOR_M: f64 = 6e-3;
/// What is left beyond the cloth's reach \[m\].
const BEYOND_M: f64 = 0.01;

/// One variant of a cloud.
#[derive(Clone, Debug, Serialize)]
pub struct Variant {
    /// What was done: `no_floor`, `drape_alone`, `clutter` or `turned`.
    pub name: &'static str,
    /// Whether a rim was found in both, or neither for the same reason.
    pub same: bool,
    /// The refusal's variant; null if a rim was found.
    pub error: Option<String>,
    /// Mean and largest distance of corresponding points of the two rims \[mm\]; null without both.
    pub rim_shift_mm: Option<[f64; 2]>,
    /// Mean distance of the two but for a rigid motion \[mm\]; null without both.
    pub deformed_mm: Option<f64>,
}

/// All variants of a scan in which `base` was found.
pub(super) fn variants(
    made: &Made,
    base: &Result<ScannedBoundary, ScanError>,
    find: impl Fn(&VirtualScan) -> Result<ScannedBoundary, ScanError>,
) -> Vec<Variant> {
    let mut all = Vec::new();
    if made.floor_y_m.is_some() {
        all.push(("no_floor", without_floor(made)));
    }
    all.push(("drape_alone", drape_alone(made)));
    if made.floor_y_m.is_some() {
        all.push(("clutter", with_clutter(made)));
    }
    all.push(("turned", turned(made)));
    let ask = |(name, scan): (&'static str, VirtualScan)| {
        let found = find(&scan);
        let error = found.as_ref().err().map(name_of);
        let same = error == base.as_ref().err().map(name_of);
        let rims = base.as_ref().ok().zip(found.as_ref().ok());
        let rims = rims.map(|(a, b)| (&a.boundary, &b.boundary));
        let shift = |(a, b): (&Boundary, &Boundary)| {
            let pairs = a.positions_m().zip(b.positions_m());
            let largest_m = pairs.map(|(p, q)| (p - q).norm()).fold(0.0, f64::max);
            [a.mean_distance_m(b), largest_m].map(|m| m / M_PER_MM)
        };
        let deformed_mm = rims.map(|(a, b)| deformed_m(b, a) / M_PER_MM);
        Variant { name, same, error, rim_shift_mm: rims.map(shift), deformed_mm }
    };
    all.into_iter().map(ask).collect()
}

/// The scan without its views, which take memory.
fn cloud_of(made: &Made) -> VirtualScan {
    let VirtualScan { ref cloud, truth, .. } = made.scan;
    VirtualScan { views: Vec::new(), cloud: cloud.clone(), truth }
}

/// The points that fit where they lie in the simulation frame.
fn kept(made: &Made, fits: impl Fn(&Point3) -> bool) -> VirtualScan {
    let mut scan = cloud_of(made);
    let truth = scan.truth;
    keep(&mut scan, |p| fits(&truth.to_simulation_m(p)));
    scan
}

fn without_floor(made: &Made) -> VirtualScan {
    let floor_y_m = made.floor_y_m.unwrap_or(f64::NEG_INFINITY);
    kept(made, |p| p.y > floor_y_m + FLOOR_M)
}

/// An upright cylinder around the drape and its stand, as people crop.
fn drape_alone(made: &Made) -> VirtualScan {
    let out = |p: &Point3| p.x.hypot(p.z);
    let reach_m = made.mesh.vertices.iter().map(out).fold(0.0, f64::max) + BEYOND_M;
    kept(made, |p| out(p) < reach_m)
}

/// Two more boxes on the floor, as dense as the cloud, 300 to 500 mm from the axis.
fn with_clutter(made: &Made) -> VirtualScan {
    let mut scan = cloud_of(made);
    let mut rng = seed::rng(made.drawn.seed, "invariance-clutter", 0);
    let floor_y_m = made.floor_y_m.unwrap_or(-0.3);
    let profile = &made.drawn.profile;
    let from_simulation = scan.truth.simulation_from_scanner.inverse();
    for _ in 0..2 {
        let (away, turn) =
            (rng.random_range(0.30..0.50), rng.random_range(0.0..std::f64::consts::TAU));
        let sides = [0; 3].map(|_| rng.random_range(0.06..0.20));
        let at = [away * turn.cos(), away * turn.sin()];
        let block = Solid::standing_block(at, floor_y_m, sides, rng.random_range(0.0..3.0));
        let mesh = block.block_mesh().unwrap_or_default();
        let noise_m = profile.axial_sigma_m(0.4, 0.0);
        // What stands on the floor is not seen from below.
        let seen = spread(&mesh, profile.spacing_m).filter(|s| s.at.y > floor_y_m + 1e-3);
        for sample in seen {
            let noise = Vector3::from_fn(|_, _| -> f64 { StandardNormal.sample(&mut rng) });
            let at = from_simulation * (sample.at + noise * noise_m);
            scan.cloud.points.push(at / scan.truth.unit_m);
            if !scan.cloud.colors.is_empty() {
                scan.cloud.colors.push([140, 110, 80]);
            }
        }
    }
    scan
}

/// The cloud in another frame of the scanner's.
fn turned(made: &Made) -> VirtualScan {
    let mut scan = cloud_of(made);
    let mut rng = seed::rng(made.drawn.seed, "invariance-turn", 0);
    let normals = nalgebra::Vector4::from_fn(|_, _| -> f64 { StandardNormal.sample(&mut rng) });
    let rotation = UnitQuaternion::from_quaternion(nalgebra::Quaternion::from(normals));
    let shift = Vector3::from_fn(|_, _| rng.random_range(-0.3..0.3));
    let motion = Isometry3::from_parts(Translation3::from(shift), rotation);
    let unit_m = scan.truth.unit_m;
    for point in &mut scan.cloud.points {
        *point = (motion * (*point * unit_m)) / unit_m;
    }
    scan.truth.simulation_from_scanner *= motion.inverse();
    scan
}
