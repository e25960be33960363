//! A scanned sheet laid on the grid: the start of a drape that is guided by the whole surface.
//!
//! In: a [`Surface`] (simulation frame), and the model with its grid and plate. Out: positions that
//! are clear of the plate and free of intersections, the springs that hold a sheet with an error
//! there until it is released, and weak ones that keep it tied. A sheet without error, such as a
//! simulated one, needs none to be laid: its strain is a drape's.
//!
//! A scan's sheet dips into the plate by its error, and may cross itself where folds touch. Samples
//! in the plate are pushed out along its normal, each with the vertices of its cell and no others.
//! Where triangles cross, the cloth around them is smoothed (each vertex moves halfway to the mean
//! of its neighbours), over a neighbourhood that grows until nothing crosses; the springs then pull
//! the layers back towards the sheet, with contact between them. Where that leaves crossings, the
//! cloth hung within the plate, as that of a smaller plate does, and what pushed it out up here and
//! down there tore it apart: it begins again with all cloth that hangs moved outwards. Where even
//! that leaves crossings, they stay and are counted in the drape.
//!
//! Dropped: raising the whole sheet until the plate bears no more than its weight. Stiff cloth
//! arches over the plate and touches it in few places, so that their error raises all of it.

use crate::base::frame::GRAVITY_M_S2;
use crate::base::{Surface, SurfacePoint, Vector3};
use crate::fabric::Fabric;
use crate::sim::experiment::{Experiment, Specimen};
use crate::sim::grid::Grid;
use crate::sim::guide::{Guide, Target, known};
use crate::sim::model::Model;
use crate::sim::plate::Plate;
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
    /// By how much farther from the frame's origin it was laid than the surface is given, as a
    /// share.
    farther: f64,
}

impl Laid {
    /// The springs that hold the vertices where the surface has them until they are released;
    /// `None` for a sheet without error.
    pub fn springs(&self) -> Option<Guide> {
        let springs = || Guide {
            targets: self.targets.clone(),
            stiffness_n_m: self.cell_n / SAG_M,
            outwards_m: 0.0,
            farther: self.farther,
        };
        (!self.is_exact).then(springs)
    }

    /// Springs that keep the cloth tied, by its area: the weight of a piece stretches those on it
    /// by `sag_m` \[m\].
    pub fn hold(&self, grid: &Grid, sag_m: f64) -> Guide {
        let by_area = |t: &Target| Target { weight: t.weight * grid.share(t.vertex), ..*t };
        Guide {
            targets: self.targets.iter().map(by_area).collect(),
            stiffness_n_m: self.cell_n / sag_m,
            outwards_m: 0.0,
            farther: self.farther,
        }
    }
}

/// Lays `surface` on the grid of `model`, `farther` from the frame's origin than it is given by
/// this share.
pub(super) fn initialise(
    (surface, farther): (&Surface, f64),
    experiment: &Experiment,
    fabric: &Fabric,
    model: &Model,
) -> Laid {
    let (grid, specimen) = (&*model.grid, &experiment.specimen);
    let places: Vec<SurfacePoint> =
        (0..grid.vertices()).map(|v| surface.at(shares(grid, specimen, v))).collect();
    let mut x: Vec<Vector3> =
        places.iter().map(|p| p.position_m.coords * (1.0 + farther)).collect();
    grid.park_outside(&mut x);
    let scanned = x.clone();
    let mut smoothed = untangle(model, &mut x);
    if crosses(grid, &x) {
        x = scanned;
        move_off(&experiment.plate, &mut x);
        smoothed = untangle(model, &mut x);
    }
    let is_exact = places.iter().all(|p| p.sigma_m == 0.0) && !smoothed.contains(&true);
    let target = |vertex: usize| {
        let place = &places[vertex];
        let known = known(place.sigma_m);
        let weight = if smoothed[vertex] { SMOOTHED_WEIGHT * known } else { known };
        Target { vertex, position_m: place.position_m.coords, along: None, weight }
    };
    let targets = (0..grid.vertices()).filter(|&v| grid.share(v) > 0.0).map(target).collect();
    let cell_n = fabric.density_kg_m2 * grid.spacing_m.powi(2) * GRAVITY_M_S2;
    Laid { x, targets, is_exact, cell_n, farther }
}

/// How far a cell's weight stretches a holding spring \[m\]. Swept from 0.03 to 3 mm on 14 virtual
/// scans: the 95th percentile at rest is 1.8 to 2 mm throughout, the median least at 0.3 mm.
pub(super) const SAG_M: f64 = 0.3e-3;
/// Share of its stiffness that a spring keeps where the sheet crossed itself: one of the layers is
/// wrong there.
const SMOOTHED_WEIGHT: f64 = 0.1;

/// Where a vertex lies on the flat specimen, as shares of its extents along warp and weft. The grid
/// says the place, since its lines need not be even.
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

fn crosses(grid: &Grid, x: &[Vector3]) -> bool {
    !intersecting(&grid.triangles(), x).is_empty()
}

/// Moves all cloth outwards that hangs, so far that none of it hangs within the plate, and what
/// lies on the plate the less the nearer it is to the axis: a map of the plan onto itself, which
/// lets nothing cross that did not before.
fn move_off(plate: &Plate, x: &mut [Vector3]) {
    let Plate { radius_m, edge_radius_m: edge_m, .. } = *plate;
    // how far from the axis cloth hangs within the plate, and by how much too near to it
    let hung = x.iter().filter_map(|p| {
        let (rho_m, above_middle_m) = (p.x.hypot(p.z), p.y + edge_m);
        let edge_at_m =
            radius_m - edge_m + (edge_m.powi(2) - above_middle_m.powi(2)).max(0.0).sqrt();
        // what lies a little below the face lies on it
        let hangs = above_middle_m.abs() < HANGS * edge_m && rho_m < edge_at_m;
        hangs.then_some([rho_m, edge_at_m - rho_m])
    });
    let [nearest_m, within_m] =
        hung.fold([radius_m, 0.0], |[near, most], [rho, by]| [near.min(rho), most.max(by)]);
    let by_m = within_m.min(MOST_OFF_M);
    let [from_m, to_m] = [0.5 * radius_m, nearest_m.max(radius_m - MOST_OFF_M)];
    for p in x.iter_mut() {
        let rho_m = p.x.hypot(p.z);
        let part = ((rho_m - from_m) / (to_m - from_m)).clamp(0.0, 1.0);
        let factor = 1.0 + by_m * part * part * (3.0 - 2.0 * part) / rho_m.max(f64::MIN_POSITIVE);
        (p.x, p.z) = (p.x * factor, p.z * factor);
    }
}

/// Part of the plate's half thickness about its middle within which cloth counts as hanging.
const HANGS: f64 = 0.75;
/// Farthest that cloth is moved off the plate \[m\].
const MOST_OFF_M: f64 = 8e-3;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::options::{SimOptions, Stop};
    use crate::sim::{Drop, DropStart, drape};

    /// A sheet that hangs from a plate 3 mm smaller: rays of cloth over its edge and down.
    fn hung_within() -> Vec<Vector3> {
        let mut x = Vec::new();
        for bearing in (0..60).map(|k| f64::from(k) * std::f64::consts::TAU / 60.0) {
            for step in 0..40 {
                let s = f64::from(step) * 1.5e-3;
                let [rho, y] = if s < 47e-3 { [s, 0.0] } else { [47e-3, 47e-3 - s] };
                x.push(Vector3::new(rho * bearing.cos(), y, rho * bearing.sin()));
            }
        }
        x
    }

    #[test]
    fn what_hangs_within_the_plate_is_moved_off_it_and_nothing_passes_through_anything() {
        let (plate, before) = (Plate::default(), hung_within());
        let mut after = before.clone();
        move_off(&plate, &mut after);
        let rho = |p: &Vector3| p.x.hypot(p.z);
        let edge_m = plate.edge_radius_m;
        for (a, b) in before.iter().zip(&after) {
            assert!((a.y - b.y).abs() < 1e-15 && rho(b) >= rho(a) - 1e-15);
            if rho(a) < 0.5 * plate.radius_m {
                assert!((a - b).norm() < 1e-15);
            }
            let above_m = b.y + edge_m;
            if above_m.abs() < HANGS * edge_m {
                let edge_at_m = plate.radius_m - edge_m + (edge_m.powi(2) - above_m.powi(2)).sqrt();
                assert!(rho(b) > edge_at_m - 1e-12, "{} within {edge_at_m}", rho(b));
            }
        }
        // along each ray what was farther out is farther out still
        for (a, b) in before.windows(2).zip(after.windows(2)) {
            if rho(&a[1]) > rho(&a[0]) {
                assert!(rho(&b[1]) > rho(&b[0]));
            }
        }
        // what hangs off the plate already stays where it is
        let mut off = vec![Vector3::new(52e-3, -2e-3, 0.0), Vector3::new(20e-3, -0.3e-3, 0.0)];
        let were = off.clone();
        move_off(&plate, &mut off);
        assert_eq!(off, were);
    }

    #[test]
    fn a_sheet_scanned_on_a_smaller_plate_comes_to_rest_on_a_larger_one() {
        let fabric = Fabric::from_paper_units([33e3, 24e3, 5.5e3, 3900.0, 14e3, 2100.0, 87.5]);
        let mut on_smaller = SimOptions::default();
        on_smaller.experiment.plate.radius_m -= 3.5e-3;
        let scanned = drape(&fabric, &Drop { start: DropStart::Perturbed(3) }, &on_smaller);
        let larger = SimOptions::default();
        let (grid, experiment) = (&scanned.grid, &larger.experiment);
        let model = Model::with_numerics(grid, &fabric, experiment, 0.2, larger.numerics);
        // pushed out of the plate alone it is torn apart
        let mut x = scanned.positions_m.clone();
        untangle(&model, &mut x);
        let torn = crosses(grid, &x);
        let surface = Surface::exact(scanned.positions_m.iter().map(|p| (*p).into())).unwrap();
        let laid = initialise((&surface, 0.0), experiment, &fabric, &model);
        assert!(torn && !crosses(grid, &laid.x), "{torn}");
        let led = drape(&fabric, &Drop { start: DropStart::Surface(Box::new(surface)) }, &larger);
        assert_eq!((led.stop, led.intersections), (Stop::AtRest, 0));
    }
}
