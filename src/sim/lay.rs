//! A scanned sheet laid on the grid: the start of a drape that is led by the whole surface.
//!
//! In: a [`Surface`] (simulation frame), and the model with its grid and plate. Out: positions that
//! are clear of the plate and free of intersections, the springs that hold a sheet with an error
//! there until it is let go, and weak ones that go on holding it. A sheet without error, such as a simulated one,
//! needs none to be laid: its strain is a drape's.
//!
//! A scan's sheet dips into the plate by its error, and may cross itself where folds touch. Samples
//! in the plate are pushed out along its normal, each with the vertices of its cell and no others.
//! Where triangles cross, the cloth around them is smoothed (each vertex moves halfway to the mean
//! of its neighbours), over a neighbourhood that grows until nothing crosses; the springs then pull
//! the layers back towards the sheet, with contact between them. Where even that leaves
//! crossings, they stay and are counted in the drape.
//!
//! Dropped: raising the whole sheet until the plate bears no more than its weight. Stiff cloth
//! arches over the plate and touches it in few places, so that their error raises all of it.

use crate::base::frame::GRAVITY_M_S2;
use crate::base::{Surface, SurfacePoint, Vector3};
use crate::fabric::Fabric;
use crate::sim::experiment::Specimen;
use crate::sim::grid::Grid;
use crate::sim::guide::{Guide, Target, known};
use crate::sim::model::Model;
use crate::sim::self_contact::intersecting;

/// A sheet on the grid.
pub(super) struct Laid {
    /// Positions of the vertices, clear of the plate and of each other as far as could be \[m\].
    pub x: Vec<Vector3>,
    /// Where the surface has each vertex of the cloth, weighted by how well it is known there.
    targets: Vec<Target>,
    /// Whether the surface has no error and lies as it is.
    is_exact: bool,
    /// Weight of a cell \[N\].
    cell_n: f64,
}

impl Laid {
    /// The springs that hold the vertices where the surface has them until they are let go; `None` for a sheet without
    /// error.
    pub fn springs(&self) -> Option<Guide> {
        let springs = || Guide {
            targets: self.targets.clone(),
            stiffness_n_m: self.cell_n / SAG_M,
            outwards_m: 0.0,
        };
        (!self.is_exact).then(springs)
    }

    /// Springs that go on holding the cloth, by its area: the weight of a piece stretches those on it by `sag_m` \[m\].
    pub fn hold(&self, grid: &Grid, sag_m: f64) -> Guide {
        let by_area = |t: &Target| Target { weight: t.weight * grid.share(t.vertex), ..*t };
        Guide {
            targets: self.targets.iter().map(by_area).collect(),
            stiffness_n_m: self.cell_n / sag_m,
            outwards_m: 0.0,
        }
    }
}

/// Lays `surface` on the grid of `model`.
pub(super) fn lay(surface: &Surface, specimen: &Specimen, fabric: &Fabric, model: &Model) -> Laid {
    let grid = &*model.grid;
    let places: Vec<SurfacePoint> =
        (0..grid.vertices()).map(|v| surface.at(shares(grid, specimen, v))).collect();
    let mut x: Vec<Vector3> = places.iter().map(|p| p.position_m.coords).collect();
    grid.park_outside(&mut x);
    let smoothed = untangle(model, &mut x);
    let is_exact = places.iter().all(|p| p.sigma_m == 0.0) && !smoothed.contains(&true);
    let target = |vertex: usize| {
        let place = &places[vertex];
        let known = known(place.sigma_m);
        let weight = if smoothed[vertex] { SMOOTHED_WEIGHT * known } else { known };
        Target { vertex, position_m: place.position_m.coords, along: None, weight }
    };
    let targets = (0..grid.vertices()).filter(|&v| grid.share(v) > 0.0).map(target).collect();
    let cell_n = fabric.density_kg_m2 * grid.spacing_m.powi(2) * GRAVITY_M_S2;
    Laid { x, targets, is_exact, cell_n }
}

/// How far a cell's weight stretches a holding spring \[m\]. Swept from 0.03 to 3 mm on 14 virtual
/// scans: the 95th percentile at rest is 1.8 to 2 mm throughout, the median least at 0.3 mm.
pub(super) const SAG_M: f64 = 0.3e-3;
/// Share of its stiffness that a spring keeps where the sheet crossed itself: one of the layers is
/// wrong there.
const SMOOTHED_WEIGHT: f64 = 0.1;

/// Where a vertex lies on the flat specimen, as shares of its extents along warp and weft. The grid
/// is asked for the place, since its lines need not be even.
fn shares(grid: &Grid, specimen: &Specimen, vertex: usize) -> [f64; 2] {
    let flat = grid.flat(vertex);
    // the sides along z lean towards +x by the skew
    let along_z = flat.z;
    let along_x = flat.x - along_z * specimen.skew_rad.tan();
    [along_x / specimen.warp_m + 0.5, along_z / specimen.weft_m + 0.5]
}

/// Brings the sheet out of the plate and apart from itself. Tells which vertices were smoothed.
fn untangle(model: &Model, x: &mut [Vector3]) -> Vec<bool> {
    let grid = &*model.grid;
    let triangles = grid.triangles();
    let mut smoothed = vec![false; x.len()];
    model.plate.push_out(grid, x, CLEAR_M);
    for round in 0..ROUNDS {
        let crossing = intersecting(&triangles, x);
        if crossing.is_empty() {
            break;
        }
        let mut near = vec![false; x.len()];
        for &v in crossing.iter().flatten().flat_map(|&t| &triangles[t as usize]) {
            near[v as usize] = true;
        }
        for _ in 0..=round / 2 {
            near = spread(grid, &near);
        }
        for _ in 0..SWEEPS {
            smooth(grid, x, &near);
        }
        smoothed.iter_mut().zip(&near).for_each(|(all, now)| *all |= now);
        model.plate.push_out(grid, x, CLEAR_M);
    }
    smoothed
}

/// The vertices marked and their neighbours.
fn spread(grid: &Grid, marked: &[bool]) -> Vec<bool> {
    let mut wider = marked.to_vec();
    for cell in &grid.cells {
        if cell.iter().any(|&v| marked[v as usize]) {
            cell.iter().for_each(|&v| wider[v as usize] = true);
        }
    }
    wider
}

/// Moves the marked vertices halfway to the mean of their neighbours along the grid's lines.
fn smooth(grid: &Grid, x: &mut [Vector3], marked: &[bool]) {
    let mut sums = vec![(Vector3::zeros(), 0.0); x.len()];
    for &[a, b, c, d] in &grid.cells {
        for (p, q) in [(a, b), (c, d), (a, c), (b, d)] {
            let (p, q) = (p as usize, q as usize);
            sums[p] = (sums[p].0 + x[q], sums[p].1 + 1.0);
            sums[q] = (sums[q].0 + x[p], sums[q].1 + 1.0);
        }
    }
    for (v, (sum, count)) in sums.into_iter().enumerate() {
        if marked[v] && count > 0.0 {
            x[v] = (x[v] + sum / count) * 0.5;
        }
    }
}

/// Distance from the plate to which samples in it or near it are brought \[m\].
const CLEAR_M: f64 = 0.1e-3;
/// Rounds of smoothing what crosses; every second one reaches a cell farther.
const ROUNDS: usize = 24;
/// Moves towards the mean of the neighbours in a round.
const SWEEPS: usize = 3;
