//! Drapes read back from files: the mesh and its true rim.
//!
//! In: an OBJ as `simulate` writes it (mm, simulation frame). Out: the mesh in metres, and the
//! rim if the mesh is a square grid of vertices.

use std::path::Path;

use crate::base::units::M_PER_MM;
use crate::base::{Boundary, Point3, Vector3};
use crate::geom::Mesh;
use crate::io::{ReadError, read_scan};
use crate::sim::grid::Grid;

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
    /// It does not say where its vertices lie on the flat specimen.
    #[error(
        "{path}: {fault}; give a mesh of the whole specimen in mm, simulation frame: the grid that \
         `simulate` writes, or an OBJ whose texture coordinates run from 0 to 1, or over the \
         specimen's mm, along warp and weft from the corner (-x, -z)"
    )]
    NoSheet {
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
