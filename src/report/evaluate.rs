//! Measurements of what the program promises, for `evaluate` and docs/validation.md.
//!
//! In: drapes with known truth, or a prior. Out: one row per case, as numbers; a
//! refusal is a row too.

use std::path::Path;

use crate::base::units::M_PER_MM;
use crate::base::{Boundary, Point3, Vector3};
use crate::fabric::{Fabric, Mixture, MixtureError};
use crate::geom::Mesh;
use crate::io::{ReadError, read_scan};
use crate::scan::{ScanError, ScanOptions, WarpToward, boundary_from_scan};
use crate::sensor::{Profile, Scene, SceneError, default_ring, scan};
use crate::sim::grid::Grid;
use crate::sim::{Drape, Drop, DropStart, SimOptions, drape};

/// Why a drape file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum DrapeFileError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// It is no drape.
    #[error("{path}: {fault}; give a drape as `simulate` writes it: OBJ, mm, simulation frame")]
    NoDrape {
        /// The file.
        path: String,
        /// What is wrong with it.
        fault: String,
    },
}

/// The drape of an OBJ in mm, simulation frame, in metres.
///
/// # Errors
/// When the file cannot be read, has no faces, or is not of a drape's size.
pub fn read_drape(path: &Path) -> Result<Mesh, DrapeFileError> {
    let (cloud, _) = read_scan(path)?;
    let no_drape =
        |fault: String| Err(DrapeFileError::NoDrape { path: path.display().to_string(), fault });
    if cloud.triangles.is_empty() {
        return no_drape("no faces".into());
    }
    let reach = cloud.points.iter().map(|p| p.coords.norm()).fold(0.0, f64::max);
    if !(100.0..500.0).contains(&reach) {
        return no_drape(format!("reaches {reach:.3} from the origin, not 100 to 500"));
    }
    let vertices = cloud.points.iter().map(|p| Point3::from(p.coords * M_PER_MM)).collect();
    Ok(Mesh { vertices, triangles: cloud.triangles })
}

/// The true rim of a drape on a square grid of vertices; `None` for another mesh.
#[must_use]
pub fn rim_of(mesh: &Mesh) -> Option<Boundary> {
    let n = mesh.vertices.len().isqrt();
    if n < 5 || n * n != mesh.vertices.len() {
        return None;
    }
    let grid = Grid::shared(n, crate::base::frame::SPECIMEN_SIDE_M);
    let x: Vec<Vector3> = mesh.vertices.iter().map(|p| p.coords).collect();
    Some(grid.boundary(&x))
}

/// The rim error of one virtual scan.
#[derive(Clone, Copy, Debug)]
pub struct RimError {
    /// Mean distance of corresponding points \[m\].
    pub mean_m: f64,
    /// Largest distance \[m\].
    pub largest_m: f64,
    /// Share of the 244 points within 2 sigma of the truth, per coordinate.
    pub within_two_sigma: f64,
    /// Share of the points observed.
    pub observed: f64,
}

/// Scans `mesh` with `profile` and holds the rim found against `truth`.
///
/// # Errors
/// When the mesh makes no scene. A refused scan is an answer.
pub fn rim_error(
    mesh: &Mesh,
    truth: &Boundary,
    profile: &Profile,
    seed: u64,
) -> Result<Result<RimError, ScanError>, SceneError> {
    let made = scan(&Scene::modified_cusick(mesh.clone()), &default_ring(), profile, seed)?;
    let warp = made.truth.simulation_from_scanner.inverse() * Vector3::x();
    let options = ScanOptions {
        warp_toward: Some(WarpToward::Direction(warp.into())),
        ..ScanOptions::default()
    };
    Ok(boundary_from_scan(&made.cloud, &options).map(|found| {
        let points = found.boundary.points();
        let (mut largest_m, mut within) = (0.0_f64, 0);
        for (point, q) in points.iter().zip(truth.positions_m()) {
            let error = point.position_m - q;
            largest_m = largest_m.max(error.norm());
            within += error.iter().filter(|e| e.abs() <= 2.0 * point.sigma_m).count();
        }
        RimError {
            mean_m: found.boundary.mean_distance_m(truth),
            largest_m,
            within_two_sigma: within as f64 / (3 * points.len()) as f64,
            observed: found.quality.observed_fraction,
        }
    }))
}

/// One timed drape.
#[derive(Clone, Debug)]
pub struct TimedDrape {
    /// The fabric.
    pub fabric: Fabric,
    /// Its drape.
    pub drape: Drape,
    /// Processor time \[s\]; `None` where the system does not tell it.
    pub cpu_s: Option<f64>,
}

/// Drapes fabric `index` of the prior `knit-2020` with a perturbed drop.
///
/// # Errors
/// When the prior gives no fabric inside its range.
pub fn timed_drape(
    run_seed: u64,
    index: u64,
    options: &SimOptions,
) -> Result<TimedDrape, MixtureError> {
    let fabric = Mixture::knit_2020().sample(run_seed, index)?;
    let before = thread_cpu_s();
    let drape = drape(&fabric, &Drop { start: DropStart::Perturbed(run_seed ^ index) }, options);
    let cpu_s = before.zip(thread_cpu_s()).map(|(before, after)| after - before);
    Ok(TimedDrape { fabric, drape, cpu_s })
}

/// The fabric of [`timed_drape`] with another drop.
///
/// # Errors
/// As there.
pub fn another_drop(
    run_seed: u64,
    index: u64,
    options: &SimOptions,
) -> Result<Drape, MixtureError> {
    let fabric = Mixture::knit_2020().sample(run_seed, index)?;
    Ok(drape(&fabric, &Drop { start: DropStart::Perturbed(!(run_seed ^ index)) }, options))
}

/// Processor time of this thread so far \[s\], where the system tells it (Linux).
#[must_use]
pub fn thread_cpu_s() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split(' ').next()?.parse::<f64>().ok()? * 1e-9)
}
