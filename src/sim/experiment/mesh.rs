//! Whether a fabric's folds are coarse enough for a mesh.

use crate::base::frame::GRAVITY_M_S2;
use crate::fabric::Fabric;

/// Something about a drape that its reader should know.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MeshWarning {
    /// The fabric's folds are as fine as the mesh.
    #[error(
        "the shortest bending length is {length_mm:.1} mm, below {limit_mm:.1} mm, two cells of \
         {cell_mm:.1} mm: the folds depend on the mesh; use at least {vertices} vertices a side"
    )]
    TooCoarse {
        /// The fabric's shortest bending length \[mm\].
        length_mm: f64,
        /// The least bending length for this mesh, which is two cells \[mm\].
        limit_mm: f64,
        /// Side of a cell \[mm\].
        cell_mm: f64,
        /// Vertices a side from which on the mesh is fine enough.
        vertices: usize,
    },
}

/// Number of cells that a bending length must span: from there on a cantilever's droop is within 4
/// % of the elastica's, within 2 % with the fold correction (`docs/validation/simulator.md`,
/// "Physics").
pub const CELLS_PER_BENDING_LENGTH: f64 = 2.0;

/// The shortest of a fabric's three bending lengths (B / (D g))^(1/3) \[m\].
#[must_use]
pub fn bending_length_m(fabric: &Fabric) -> f64 {
    let rigidity = fabric.bending_weft_nm.min(fabric.bending_warp_nm).min(fabric.bending_bias_nm);
    (rigidity / (fabric.density_kg_m2 * GRAVITY_M_S2)).cbrt()
}

/// Warnings about draping `fabric` on a grid of `vertices` a side whose cells have sides of
/// `cell_m` metres; none if the mesh is fine enough.
#[must_use]
pub fn mesh_warnings(fabric: &Fabric, cell_m: f64, vertices: usize) -> Vec<MeshWarning> {
    let length_m = bending_length_m(fabric);
    let limit_m = CELLS_PER_BENDING_LENGTH * cell_m;
    // a bending length of exactly two cells is enough, for any last bit
    if length_m >= limit_m * (1.0 - 1e-9) {
        return Vec::new();
    }
    let cells = (vertices - 1) as f64 * limit_m / length_m;
    vec![MeshWarning::TooCoarse {
        length_mm: length_m * 1e3,
        limit_mm: limit_m * 1e3,
        cell_mm: cell_m * 1e3,
        vertices: cells.ceil() as usize + 1,
    }]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_too_coarse_is_told_with_value_limit_and_remedy() {
        let fabric = Fabric::from_paper_units([1e5, 1e5, 1e5, 100.0, 200.0, 150.0, 200.0]);
        let length_m = bending_length_m(&fabric);
        assert!((length_m - (1e-7_f64 / (0.2 * GRAVITY_M_S2)).cbrt()).abs() < 1e-12);
        let warnings = mesh_warnings(&fabric, 0.005, 61);
        let [MeshWarning::TooCoarse { limit_mm, vertices, .. }] = warnings[..] else {
            panic!("{warnings:?}")
        };
        assert!((limit_mm - 10.0).abs() < 1e-12);
        let cell_m = 0.3 / (vertices - 1) as f64;
        assert_eq!(mesh_warnings(&fabric, cell_m, vertices), []);
        assert_eq!(mesh_warnings(&fabric, 0.3 / (vertices - 2) as f64, vertices - 1).len(), 1);
        assert!(warnings[0].to_string().contains("vertices a side"), "{}", warnings[0]);
    }
}
