//! What every program's scene is made of: plate, cloth, friction.

use super::cloth_mesh::ClothMesh;
use crate::base::frame::GRAVITY_M_S2;
use crate::exchange::exported::{ExchangeError, Options};
use crate::exchange::target::Scene;
use crate::fabric::params::Params;
use crate::sim::experiment::{Experiment, Outline};
use crate::sim::plate::Plate;

/// Length of the cloth's edges where it is not given \[m\].
const EDGE_M: f64 = 0.010;
/// Limits of the edges \[m\]: the cloth has 60 to 40,000 vertices.
const EDGES_M: [f64; 2] = [1.5e-3, 40e-3];
/// Share of its speed that cloth loses to the air in a second \[1/s\], a choice: the rest does not
/// depend on it.
pub(super) const DRAG_PER_S: f64 = 6.0;
/// Corners around the plate's edge, and steps over its rounding.
const AROUND: usize = 96;
const OVER: usize = 6;

/// What every program's file is made of.
pub(super) struct Bench {
    pub(super) scene: Scene,
    pub(super) plate: Plate,
    pub(super) friction: f64,
    pub(super) cloth: ClothMesh,
    /// Mass of the cloth \[kg\].
    pub(super) mass_kg: f64,
}

impl Bench {
    pub(super) fn new(
        scene: Scene,
        params: &Params,
        options: &Options,
    ) -> Result<Self, ExchangeError> {
        let edge_m = options.edge_m.unwrap_or(EDGE_M);
        if !(EDGES_M[0]..=EDGES_M[1]).contains(&edge_m) {
            let value = edge_m * 1e3;
            let limits = "1.5 to 40 mm with --scene";
            return Err(ExchangeError::Given { flag: "--edge-mm", value, limits });
        }
        let Experiment { specimen, plate, .. } = scene.experiment();
        let cloth = match specimen.outline {
            Outline::Rectangle => ClothMesh::square(specimen.warp_m, edge_m),
            Outline::Disc => ClothMesh::disc(0.5 * specimen.warp_m, edge_m),
        };
        let mass_kg = params.fabric.density_kg_m2 * cloth.area_m2();
        let friction = options.friction.unwrap_or(plate.friction);
        Ok(Self { scene, plate, friction, cloth, mass_kg })
    }

    /// Height above the plate at which the cloth rests \[m\].
    pub(super) fn rest_height_m(&self) -> f64 {
        0.5 * self.plate.gap_m
    }

    /// The cloth's vertices before the fall \[m\]: the lowest lies at `lowest_m`.
    pub(super) fn start_m(&self, lowest_m: f64) -> Vec<[f64; 3]> {
        let rise_m = self.cloth.unevenness_m();
        let least_m = rise_m.iter().copied().fold(f64::INFINITY, f64::min);
        let flat_m = self.cloth.points_m.iter().zip(rise_m);
        flat_m.map(|(&[x, y], rise)| [x, y, lowest_m + rise - least_m]).collect()
    }

    /// Vertices of the plate's surface moved outwards by `offset_m` \[m\]: rings from the top face
    /// over the rounded edge to the lower face.
    pub(super) fn plate_m(&self, offset_m: f64) -> Vec<[f64; 3]> {
        let Plate { radius_m, edge_radius_m, .. } = self.plate;
        let round_m = edge_radius_m + offset_m;
        let ring = |over: usize| {
            let (sin, cos) = (std::f64::consts::PI * over as f64 / OVER as f64).sin_cos();
            let (r, z) = (radius_m - edge_radius_m + round_m * sin, round_m * cos - edge_radius_m);
            (0..AROUND).map(move |k| {
                let (sin, cos) = (std::f64::consts::TAU * k as f64 / AROUND as f64).sin_cos();
                [r * cos, r * sin, z]
            })
        };
        (0..=OVER).flat_map(ring).collect()
    }

    /// Faces of the plate of `plate_m`, outwards.
    pub(super) fn plate_faces() -> Vec<Vec<usize>> {
        let at = |over: usize, k: usize| over * AROUND + k % AROUND;
        let band = (0..OVER).flat_map(|over| {
            (0..AROUND).map(move |k| {
                vec![at(over, k), at(over + 1, k), at(over + 1, k + 1), at(over, k + 1)]
            })
        });
        let top = (0..AROUND).map(|k| at(0, k)).collect();
        let bottom = (0..AROUND).rev().map(|k| at(OVER, k)).collect();
        [top, bottom].into_iter().chain(band).collect()
    }

    /// What is written down with every scene.
    pub(super) fn notes(&self, params: &Params, options: &Options) -> Vec<String> {
        let mut notes = vec![format!(
            "scene {}: {} vertices, edges of {:.2} mm, {:.2} g; z is up, x the warp, y the weft, in metres",
            self.scene.name(),
            self.cloth.points_m.len(),
            self.cloth.mean_edge_m() * 1e3,
            self.mass_kg * 1e3
        )];
        if options.friction.is_none() {
            notes.push(format!(
                "friction {} between cloth and plate is this simulator's; a drape does not show it",
                self.friction
            ));
        }
        let bending_length_m = least_bending_length_m(params);
        if 2.0 * self.cloth.mean_edge_m() > bending_length_m {
            notes.push(format!(
                "edges of {:.1} mm are coarse for a bending length of {:.1} mm; give --edge-mm {:.1}",
                self.cloth.mean_edge_m() * 1e3,
                bending_length_m * 1e3,
                (0.5e3 * bending_length_m).max(EDGES_M[0] * 1e3)
            ));
        }
        notes
    }
}

/// The least of the bending lengths along weft, warp and bias \[m\].
fn least_bending_length_m(params: &Params) -> f64 {
    let fabric = &params.fabric;
    let least = fabric.bending_weft_nm.min(fabric.bending_warp_nm).min(fabric.bending_bias_nm);
    (least / (fabric.density_kg_m2 * GRAVITY_M_S2)).cbrt()
}
