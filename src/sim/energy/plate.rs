//! Contact with the plate and Coulomb friction on it.
//!
//! The plate is a disc with a fully rounded edge (a torus rim), its top face at
//! y = 0. Cloth is sampled at points inside the cells, each carrying the area
//! around it, closely near the plate's edge, so that the edge bears on the cloth
//! between the vertices too: contact at vertices alone chatters there.
//!
//! Normal pressure at signed distance d of a sample to the plate:
//! `p = k (gap - d)^2` for d < gap, potential `k (gap - d)^3 / 3` per area, which is
//! C2. k is scaled by the fabric's weight, so that the depth is about the same for
//! all: 0.03 mm of the 1 mm gap on the flat, more at the edge where the overhang
//! bears. Within 0.3 mm of the plate, where cloth comes that is stiff or falls hard, the
//! clamped logarithm of Li et al. 2020 is added, and [`Energy::max_step`] keeps steps
//! short of the surface, so that nothing gets through. The logarithm alone with a gap of
//! 0.5 mm was tried: the descent needed several times the iterations.
//!
//! Friction: each sample in contact is tied to an anchor on the plate. The force
//! grows with the tangential distance from the anchor to mu N at `slip_m` (the C1
//! form of Li et al. 2020, "Incremental potential contact", eq. 22) and stays
//! there; when a step ends farther away the anchor follows. Sticking cloth thus
//! rests (viscous friction would let it creep). N and the normal are those of the
//! step's start.

use nalgebra::Matrix3;

use super::Energy;
use crate::base::Vector3;
use crate::base::frame::GRAVITY_M_S2;
use crate::numeric::sparse::BlockPattern;
use crate::sim::grid::{CELL_PAIRS, Grid};
use crate::sim::hessian_form::HessianForm;
use crate::sim::plate::Plate;

/// A point of a cell that may touch the plate.
#[derive(Clone, Copy, Debug)]
struct Sample {
    cell: u32,
    weights: [f64; 4],
    area_m2: f64,
}

/// What friction remembers of a sample.
#[derive(Clone, Copy, Debug)]
struct Grip {
    anchor: Option<Vector3>,
    normal: Vector3,
    force_n: f64,
}

/// The contact of a specimen with the plate: its samples and the grips of friction.
#[derive(Clone, Debug)]
pub struct PlateContact {
    plate: Plate,
    stiffness_pa_m: f64,
    samples: Vec<Sample>,
    grips: Vec<Grip>,
}

/// Part of the gap within which a wall rises that no weight gets through ...
const WALL: f64 = 0.3;
/// ... and its weight: at a tenth of the gap it bears ten times what the cubic does at none.
const WALL_WEIGHT: f64 = 12.0;
/// Part of the wall's reach below which it continues as a parabola.
const LEAST_WALL: f64 = 0.05;
/// Part of its distance from the plate that a sample keeps in a step.
const KEPT: f64 = 0.2;

/// Rounds over all samples in which cloth is pushed out of the plate.
const PUSHES: usize = 100;

/// Pressure at the depth scale: the overhang's weight on a strip of the edge,
/// measured in the sheet's own pressure rho g.
const EDGE_PRESSURE_RATIO: f64 = 300.0;
/// Depth at which the edge bears, as a fraction of the gap (empirical).
const EDGE_DEPTH: f64 = 0.5;

impl PlateContact {
    /// The contact of a specimen that touches nothing yet. Cells of `grid` whose material lies
    /// within 1.5 radii of the grid's middle get 3 x 3 samples at a mean spacing of 5 mm, and in
    /// proportion to that, the others one.
    #[must_use]
    pub fn new(grid: &Grid, plate: Plate, density_kg_m2: f64) -> Self {
        let mut samples = Vec::new();
        for (k, (corners, fraction)) in grid.cells.iter().zip(&grid.volume_fraction).enumerate() {
            let cell_area = grid.cell_area_m2() * (fraction * grid.cell_size(k));
            let centre = (grid.flat(corners[0] as usize) + grid.flat(corners[3] as usize)) * 0.5;
            let [x, z] = grid.middle_m();
            let near = (centre - Vector3::new(x, 0.0, z)).norm() < 1.5 * plate.radius_m;
            let m = if near { (600.0 * grid.spacing_m).round().max(1.0) as usize } else { 1 };
            for s in 0..m * m {
                let at = |t: usize| (t as f64 + 0.5) / m as f64;
                let (a, b) = (at(s / m), at(s % m));
                let weights = [(1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b];
                let area_m2 = cell_area / (m * m) as f64;
                samples.push(Sample { cell: k as u32, weights, area_m2 });
            }
        }
        let stiffness_pa_m = stiffness_pa_m(&plate, density_kg_m2);
        let none = Grip { anchor: None, normal: Vector3::zeros(), force_n: 0.0 };
        Self { plate, stiffness_pa_m, grips: vec![none; samples.len()], samples }
    }

    /// The contact of a specimen that has no plate and is held elsewhere: no samples, no energy.
    #[must_use]
    pub fn none() -> Self {
        let plate = Plate::default();
        let (samples, grips) = (Vec::new(), Vec::new());
        Self { plate, stiffness_pa_m: 0.0, samples, grips }
    }

    fn position(grid: &Grid, x: &[Vector3], sample: &Sample) -> Vector3 {
        let corners = &grid.cells[sample.cell as usize];
        (0..4).map(|k| x[corners[k] as usize] * sample.weights[k]).sum()
    }

    fn grip_hessian(&self, grip: &Grip, offset: &Vector3, form: HessianForm) -> Matrix3<f64> {
        let u = tangential(offset, &grip.normal);
        let length = u.norm();
        let scale = self.plate.friction * grip.force_n;
        let across = Matrix3::identity() - grip.normal * grip.normal.transpose();
        let slope = slip_slope(length, self.plate.slip_m);
        let mut second = across * (scale * slope);
        if length > 0.0 {
            // d/du of slope(u) u: slope + slope' u along u; slope' < 0
            let along = u * u.transpose() / (length * length);
            let drop = slip_drop(length, self.plate.slip_m);
            let drop = match form {
                HessianForm::Projected => drop.max(-slope),
                HessianForm::Exact => drop,
            };
            second += along * (scale * drop);
        }
        second
    }

    /// This contact with its grips, but with another plate and density, on cells whose areas are
    /// `area_ratio` times the present ones. What presses a sample grows with its area and weight.
    #[must_use]
    pub fn changed(&self, plate: Plate, density_kg_m2: f64, area_ratio: f64) -> Self {
        let resized = |s: &Sample| Sample { area_m2: s.area_m2 * area_ratio, ..*s };
        let stiffness_pa_m = stiffness_pa_m(&plate, density_kg_m2);
        let heavier = stiffness_pa_m / self.stiffness_pa_m * area_ratio;
        let pressed = |grip: &Grip| Grip { force_n: grip.force_n * heavier, ..*grip };
        Self {
            stiffness_pa_m,
            plate,
            samples: self.samples.iter().map(resized).collect(),
            grips: self.grips.iter().map(pressed).collect(),
        }
    }

    /// Takes the grips of another contact, whose samples are the same points of the cloth, pressed
    /// as much harder as this contact's weight and areas are larger.
    #[cfg(test)]
    pub fn take_grips(&mut self, other: &Self) {
        let samples = self.samples.iter().zip(&other.samples);
        self.grips = samples
            .zip(&other.grips)
            .map(|((own, from), grip)| {
                let heavier =
                    self.stiffness_pa_m * own.area_m2 / (other.stiffness_pa_m * from.area_m2);
                Grip { force_n: grip.force_n * heavier, ..*grip }
            })
            .collect();
    }

    /// Moves every anchor of friction to where `place` puts it, as if the specimen had been laid
    /// elsewhere on the plate.
    pub fn move_anchors(&mut self, place: impl Fn(Vector3) -> Vector3) {
        for anchor in self.grips.iter_mut().filter_map(|grip| grip.anchor.as_mut()) {
            *anchor = place(*anchor);
        }
    }

    /// Takes the state `x` as the start of the next step: normal forces and
    /// normals are renewed, slipped anchors follow, lost contacts are forgotten.
    /// Returns the largest change of a normal force times friction \[N\].
    pub fn renew(&mut self, grid: &Grid, x: &[Vector3]) -> f64 {
        self.renew_by(grid, x, 1.0)
    }

    /// As [`Self::renew`], normal forces only this `part` of the way to what they are at `x`.
    /// Returns the largest change that the whole way would be, times friction \[N\].
    pub fn renew_by(&mut self, grid: &Grid, x: &[Vector3], part: f64) -> f64 {
        let mut largest = 0.0_f64;
        for (sample, grip) in self.samples.iter().zip(&mut self.grips) {
            let p = Self::position(grid, x, sample);
            let before = grip.force_n;
            let contact =
                self.plate.distance(&p, self.plate.gap_m).filter(|c| c.d < self.plate.gap_m);
            let Some(c) = contact else {
                largest = largest.max(before);
                *grip = Grip { anchor: None, normal: Vector3::zeros(), force_n: 0.0 };
                continue;
            };
            let slope = barrier(c.d, self.plate.gap_m)[1];
            let force_n = -slope * sample.area_m2 * self.stiffness_pa_m;
            grip.force_n = if part == 1.0 { force_n } else { before + part * (force_n - before) };
            grip.normal = c.normal;
            largest = largest.max((force_n - before).abs());
            let anchor = grip.anchor.unwrap_or(p);
            let u = tangential(&(p - anchor), &c.normal);
            let excess = (u.norm() - self.plate.slip_m).max(0.0);
            let kept = if excess > 0.0 { u * (self.plate.slip_m / u.norm()) } else { u };
            grip.anchor = Some(p - kept);
        }
        largest * self.plate.friction
    }

    /// Sets the coefficient of friction, and lets friction grip anew, unloaded, where the cloth
    /// lies at the next renewal.
    pub fn set_friction(&mut self, friction: f64) {
        self.plate.friction = friction;
        self.grips.iter_mut().for_each(|grip| grip.anchor = None);
    }

    /// The coefficient of friction.
    #[must_use]
    pub fn friction(&self) -> f64 {
        self.plate.friction
    }

    /// Where between two fractions of a step the distance falls to `least_m`.
    fn bisect(&self, start: &Vector3, step: &Vector3, least_m: f64, between: [f64; 2]) -> f64 {
        let [mut free, mut inside] = between;
        for _ in 0..8 {
            let middle = 0.5 * (free + inside);
            let at = self.plate.distance(&(start + step * middle), self.plate.gap_m);
            if at.is_some_and(|at| at.d < least_m) {
                inside = middle;
            } else {
                free = middle;
            }
        }
        free
    }

    /// Moves the vertices of the cells whose samples lie in the plate, or nearer to it than
    /// `least_m`, along its normal until they do not; cloth in the upper half of the plate goes up.
    /// Other vertices stay.
    pub fn push_out(&self, grid: &Grid, x: &mut [Vector3], least_m: f64) {
        for _ in 0..PUSHES {
            let mut clear = true;
            for sample in &self.samples {
                let p = Self::position(grid, x, sample);
                let Some(at) = self.plate.distance(&p, least_m).filter(|at| at.d < least_m) else {
                    continue;
                };
                clear = false;
                // what is left of it after its own vertices have moved by their weights
                let squares: f64 = sample.weights.iter().map(|w| w * w).sum();
                let push = at.normal * ((1.001 * least_m - at.d) / squares);
                for (&v, w) in grid.cells[sample.cell as usize].iter().zip(sample.weights) {
                    x[v as usize] += push * w;
                }
            }
            if clear {
                return;
            }
        }
    }

    /// The least signed distance of a sample from the plate's surface \[m\]: positive if no cloth
    /// is inside the plate, infinite if none is within 10 mm.
    #[must_use]
    pub fn clearance_m(&self, grid: &Grid, x: &[Vector3]) -> f64 {
        self.samples
            .iter()
            .filter_map(|s| self.plate.distance(&Self::position(grid, x, s), 1e-2))
            .map(|c| c.d)
            .fold(f64::INFINITY, f64::min)
    }
}

impl Energy for PlateContact {
    /// That of the contact and, with the grips as they are, of friction.
    fn energy_j(&self, grid: &Grid, x: &[Vector3]) -> f64 {
        let mut energy = 0.0;
        for (sample, grip) in self.samples.iter().zip(&self.grips) {
            let p = Self::position(grid, x, sample);
            if let Some(c) = self.plate.distance(&p, self.plate.gap_m) {
                energy += sample.area_m2 * self.stiffness_pa_m * barrier(c.d, self.plate.gap_m)[0];
            }
            if let Some(anchor) = grip.anchor {
                let u = tangential(&(p - anchor), &grip.normal).norm();
                energy += self.plate.friction * grip.force_n * slip_potential(u, self.plate.slip_m);
            }
        }
        energy
    }

    fn add_gradient(&self, grid: &Grid, x: &[Vector3], gradient: &mut [Vector3]) {
        for (sample, grip) in self.samples.iter().zip(&self.grips) {
            let p = Self::position(grid, x, sample);
            let mut force = Vector3::zeros();
            if let Some(c) = self.plate.distance(&p, self.plate.gap_m) {
                let slope = barrier(c.d, self.plate.gap_m)[1];
                force += c.normal * (sample.area_m2 * self.stiffness_pa_m * slope);
            }
            if let Some(anchor) = grip.anchor {
                let u = tangential(&(p - anchor), &grip.normal);
                let slope = slip_slope(u.norm(), self.plate.slip_m);
                force += u * (self.plate.friction * grip.force_n * slope);
            }
            if force != Vector3::zeros() {
                let corners = &grid.cells[sample.cell as usize];
                for (&v, w) in corners.iter().zip(sample.weights) {
                    gradient[v as usize] += force * w;
                }
            }
        }
    }

    /// The projected form leaves out the curvature of the plate's surface, which is negative there.
    fn add_hessian(&self, grid: &Grid, x: &[Vector3], form: HessianForm, values: &mut [f64]) {
        let pattern = grid.analysis.pattern();
        for (sample, grip) in self.samples.iter().zip(&self.grips) {
            let p = Self::position(grid, x, sample);
            let mut second = Matrix3::zeros();
            let mut any = false;
            if let Some(c) = self.plate.distance(&p, self.plate.gap_m)
                && c.d < self.plate.gap_m
            {
                any = true;
                let [_, slope, rise] = barrier(c.d, self.plate.gap_m);
                let k = sample.area_m2 * self.stiffness_pa_m;
                second += c.normal * c.normal.transpose() * (k * rise);
                if form == HessianForm::Exact {
                    second += c.curvature * (k * slope);
                }
            }
            if let Some(anchor) = grip.anchor {
                any = true;
                second += self.grip_hessian(grip, &(p - anchor), form);
            }
            if !any {
                continue;
            }
            let corners = &grid.cells[sample.cell as usize];
            for (k, &v) in corners.iter().enumerate() {
                let block = second * sample.weights[k].powi(2);
                pattern.add_diagonal(values, v as usize, &block);
            }
            let slots = &grid.cell_slots[sample.cell as usize];
            for (slot, (r, c)) in slots.iter().zip(CELL_PAIRS) {
                let block = second * (sample.weights[r] * sample.weights[c]);
                BlockPattern::add_block(values, *slot, &block);
            }
        }
    }

    /// No sample loses more than `1 - KEPT` of its distance from the plate on the way; those inside
    /// it already are free.
    fn max_step(&self, grid: &Grid, x: &[Vector3], dx: &[Vector3], limit: f64) -> f64 {
        let mut limit = limit;
        for sample in &self.samples {
            let step = Self::position(grid, dx, sample);
            let length_m = step.norm() * limit;
            let start = Self::position(grid, x, sample);
            let near = self.plate.distance(&start, length_m.max(self.plate.gap_m));
            let Some(d_m) = near.map(|at| at.d).filter(|&d| d > 0.0 && d < length_m / KEPT) else {
                continue;
            };
            // how long the way is tells how often to look
            let looks = (length_m / (0.5 * self.plate.edge_radius_m)).ceil().max(1.0);
            let mut reached = 0.0;
            while reached < limit {
                let next = (reached + limit / looks).min(limit);
                let at = self.plate.distance(&(start + step * next), self.plate.gap_m);
                if at.is_some_and(|at| at.d < KEPT * d_m) {
                    break;
                }
                reached = next;
            }
            if reached < limit {
                limit = self.bisect(&start, &step, KEPT * d_m, [reached, reached + limit / looks]);
            }
        }
        limit
    }
}

/// Depth below the gap at which a sheet lies flat on `plate` under its own weight \[m\].
#[must_use]
pub fn resting_depth_m(plate: &Plate) -> f64 {
    EDGE_DEPTH * plate.gap_m / EDGE_PRESSURE_RATIO.sqrt()
}

/// k \[Pa/m^2\]: the pressure over the square of the depth at which the plate's edge bears the
/// overhang at half the gap.
fn stiffness_pa_m(plate: &Plate, density_kg_m2: f64) -> f64 {
    let pressure = EDGE_PRESSURE_RATIO * density_kg_m2 * GRAVITY_M_S2;
    pressure / -barrier(EDGE_DEPTH * plate.gap_m, plate.gap_m)[1]
}

/// The potential per k and its first and second derivative by d \[m^3, m^2, m\].
fn barrier(d: f64, gap: f64) -> [f64; 3] {
    if d >= gap {
        return [0.0; 3];
    }
    let depth = gap - d;
    let cubic = [depth.powi(3) / 3.0, -depth * depth, 2.0 * depth];
    let [wall, wall1, wall2] = wall(d, WALL * gap);
    let weight = WALL_WEIGHT * gap;
    [cubic[0] + weight * wall, cubic[1] + weight * wall1, cubic[2] + weight * wall2]
}

/// The clamped logarithm -(d - reach)^2 ln(d / reach) with its derivatives; below a
/// twentieth of `reach`, where steps do not lead but a start may lie, its parabola.
fn wall(d: f64, reach: f64) -> [f64; 3] {
    if d >= reach {
        return [0.0; 3];
    }
    let at = d.max(LEAST_WALL * reach);
    let (over, log) = (at - reach, (at / reach).ln());
    let first = -2.0 * over * log - over * over / at;
    let second = -2.0 * log - 4.0 * over / at + (over / at).powi(2);
    let below = d - at;
    [-over * over * log + (first + 0.5 * second * below) * below, first + second * below, second]
}

fn tangential(v: &Vector3, normal: &Vector3) -> Vector3 {
    v - normal * normal.dot(v)
}

/// Potential per friction force \[m\]: rises to slope 1 at `slip`.
pub(super) fn slip_potential(u: f64, slip: f64) -> f64 {
    if u < slip { u * u / slip - u.powi(3) / (3.0 * slip * slip) } else { u - slip / 3.0 }
}

/// Derivative of [`slip_potential`] divided by u \[1/m\].
pub(super) fn slip_slope(u: f64, slip: f64) -> f64 {
    if u < slip { 2.0 / slip - u / (slip * slip) } else { 1.0 / u }
}

/// u times the derivative of [`slip_slope`] \[1/m\].
pub(super) fn slip_drop(u: f64, slip: f64) -> f64 {
    if u < slip { -u / (slip * slip) } else { -1.0 / u }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::seed;
    use crate::sim::Experiment;
    use crate::sim::numerics::Grading;
    use rand::RngExt as _;
    use std::sync::Arc;

    /// A sheet over the plate with samples in contact on the flat and the edge,
    /// grips under load and partly slipped.
    fn scene() -> (Arc<Grid>, PlateContact, Vec<Vector3>) {
        scene_at(0.45e-3)
    }

    /// The same so low that samples lie in the wall, in its parabola and inside the plate.
    fn scene_in_the_wall() -> (Arc<Grid>, PlateContact, Vec<Vector3>) {
        scene_at(0.03e-3)
    }

    /// The sheet's flat part at this height above the plate.
    fn scene_at(height_m: f64) -> (Arc<Grid>, PlateContact, Vec<Vector3>) {
        let grid = Grid::shared(25, 0.12);
        let mut contact = PlateContact::new(&grid, Plate::default(), 0.2);
        let mut rng = seed::rng(5, "plate", 0);
        let mut x: Vec<_> = (0..grid.vertices())
            .map(|v| {
                let p = grid.flat(v);
                let over = (p.norm() - 0.047).max(0.0);
                p * 1.0 + Vector3::new(0.0, height_m - 8.0 * over * over, 0.0)
            })
            .collect();
        contact.renew(&grid, &x);
        for p in &mut x {
            *p += Vector3::from_fn(|_, _| rng.random_range(-0.08e-3..0.08e-3));
        }
        (grid, contact, x)
    }

    /// The largest error of the gradient's components against differences of the energy, over
    /// its largest force.
    fn gradient_error((grid, contact, x): &(Arc<Grid>, PlateContact, Vec<Vector3>)) -> f64 {
        let mut g = vec![Vector3::zeros(); x.len()];
        contact.add_gradient(grid, x, &mut g);
        let norm = g.iter().map(Vector3::norm).fold(0.0, f64::max);
        assert!(contact.energy_j(grid, x).is_finite() && norm > 0.0);
        let (mut touched, mut worst) = (0, 0.0_f64);
        for v in (0..x.len()).step_by(7) {
            for c in 0..3 {
                let step = 2e-9;
                let moved = |by: f64| {
                    let mut y = x.clone();
                    y[v][c] += by;
                    contact.energy_j(grid, &y)
                };
                let numeric = (moved(step) - moved(-step)) / (2.0 * step);
                touched += usize::from(g[v][c] != 0.0);
                worst = worst.max((numeric - g[v][c]).abs() / norm);
            }
        }
        assert!(touched > 30, "{touched}");
        worst
    }

    #[test]
    fn gradient_is_the_difference_quotient_of_the_energy() {
        // Observed 1.1e-8 and 6e-10, the energy's rounding; a wrong sign in the wall's slope scores
        // 0.1 (logarithm) and 0.3 (ratio) in the wall and nothing in the gap.
        for (name, scene) in [("gap", scene()), ("wall", scene_in_the_wall())] {
            let error = gradient_error(&scene);
            assert!(error < 2e-7, "{name}: {error:e}");
        }
    }

    /// The largest error of the Hessian along five directions against differences of the gradient,
    /// over its largest product.
    fn hessian_error((grid, contact, x): &(Arc<Grid>, PlateContact, Vec<Vector3>)) -> f64 {
        let pattern = grid.analysis.pattern();
        let mut values = vec![0.0; pattern.nonzeros()];
        contact.add_hessian(grid, x, HessianForm::Exact, &mut values);
        let mut rng = seed::rng(6, "plate", 0);
        let mut worst = 0.0_f64;
        for _ in 0..5 {
            let direction: Vec<_> =
                x.iter().map(|_| Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0))).collect();
            let step = 1e-9;
            let at = |by: f64| {
                let y: Vec<_> = x.iter().zip(&direction).map(|(p, d)| p + d * by).collect();
                let mut g = vec![Vector3::zeros(); x.len()];
                contact.add_gradient(grid, &y, &mut g);
                g
            };
            let (plus, minus) = (at(step), at(-step));
            let mut product = vec![Vector3::zeros(); x.len()];
            pattern.multiply(&values, &direction, &mut product);
            let scale = product.iter().map(Vector3::norm).fold(0.0, f64::max);
            let errors = (0..x.len())
                .map(|v| ((plus[v] - minus[v]) / (2.0 * step) - product[v]).norm() / scale);
            worst = errors.fold(worst, f64::max);
        }
        worst
    }

    #[test]
    fn hessian_is_the_difference_quotient_of_the_gradient() {
        // Observed 4e-9 and 8e-10; a wrong sign in the wall scores 0.15 and 0.8 in its slope, 0.03
        // in its curvature.
        for (name, scene) in [("gap", scene()), ("wall", scene_in_the_wall())] {
            let error = hessian_error(&scene);
            assert!(error < 1e-7, "{name}: {error:e}");
        }
    }

    #[test]
    fn the_scene_in_the_wall_has_samples_in_every_case_of_the_pressure() {
        let (grid, contact, x) = scene_in_the_wall();
        let gap = contact.plate.gap_m;
        let reach = WALL * gap;
        let limits = [f64::NEG_INFINITY, 0.0, LEAST_WALL * reach, reach, gap];
        let depths: Vec<f64> = contact
            .samples
            .iter()
            .map(|sample| PlateContact::position(&grid, &x, sample))
            .filter_map(|p| contact.plate.distance(&p, gap).map(|at| at.d))
            .collect();
        for range in limits.windows(2) {
            let count = depths.iter().filter(|d| (range[0]..range[1]).contains(d)).count();
            assert!(count > 20, "{count} samples in {range:?}");
        }
    }

    /// Depths on both sides of every case boundary of the pressure: where contact begins, where
    /// the wall rises, where the wall's parabola takes over, and the plate's surface.
    fn depths_m(gap: f64) -> Vec<f64> {
        let reach = WALL * gap;
        let mut depths: Vec<f64> = (-20..=120).map(|k| f64::from(k) * 0.01 * gap).collect();
        for boundary in [gap, reach, LEAST_WALL * reach, 0.0] {
            for off in [1e-6, 1e-4, 1e-2] {
                depths.extend([boundary - off * reach, boundary + off * reach]);
            }
        }
        depths
    }

    #[test]
    fn slope_and_curvature_of_the_pressure_are_difference_quotients_everywhere() {
        // Observed: the slope within 1.3e-9 of itself; the curvature within 4.3e-5, where the
        // difference straddles a jump of the third derivative. A wrong sign planted in one term of
        // value, slope or curvature scores at least 1.2 in one of the two.
        for gap in [1e-3, 0.3e-3] {
            for d in depths_m(gap) {
                let step = 1e-6 * gap;
                let [_, slope, rise] = barrier(d, gap);
                let (above, below) = (barrier(d + step, gap), barrier(d - step, gap));
                let slope_error = ((above[0] - below[0]) / (2.0 * step) - slope).abs();
                let rise_error = ((above[1] - below[1]) / (2.0 * step) - rise).abs();
                assert!(slope_error < 1e-8 * slope.abs().max(gap * gap), "{d:e}: {slope_error:e}");
                assert!(rise_error < 2e-4 * rise.abs().max(gap), "{d:e}: {rise_error:e}");
            }
        }
    }

    #[test]
    fn the_samples_carry_the_whole_cloth_and_lie_closest_around_the_plate() {
        let mut experiment = Experiment::default();
        experiment.specimen.offset_m = [0.03, -0.01];
        let grid = Grid::graded(&experiment, 31, &Grading::EDGE);
        let contact = PlateContact::new(&grid, experiment.plate, 0.2);
        let area: f64 = contact.samples.iter().map(|s| s.area_m2).sum();
        assert!((area / 0.09 - 1.0).abs() < 1e-12, "{area}");
        let x: Vec<_> =
            (0..grid.vertices()).map(|v| experiment.specimen.place(grid.flat(v))).collect();
        for sample in &contact.samples {
            let p = PlateContact::position(&grid, &x, sample);
            let close = sample.area_m2 < 0.5 * grid.cell_area_m2() / 9.0;
            assert!(close || p.norm() > experiment.plate.radius_m, "{p}");
        }
    }

    #[test]
    fn a_sheet_pressed_into_the_plate_is_pushed_out_and_reported() {
        let (grid, contact, mut x) = scene();
        let above = contact.energy_j(&grid, &x);
        for p in &mut x {
            p.y -= 1e-3;
        }
        assert!(contact.energy_j(&grid, &x) > above);
        assert!(contact.clearance_m(&grid, &x) < 0.0);
        let mut g = vec![Vector3::zeros(); x.len()];
        contact.add_gradient(&grid, &x, &mut g);
        assert!(g[grid.vertices() / 2].y < 0.0, "the force is up, the gradient down");
    }
}
