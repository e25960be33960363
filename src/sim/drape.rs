//! From a fabric to its drape at rest: drop, fall, settle, equilibrium.
//!
//! In: a fabric (SI), a drop (how the flat specimen is let go), options. Out: the
//! sheet at rest with its rim and a report: why it stopped, the force residual,
//! whether the equilibrium is stable, which branch it is on (nodes, energy).
//!
//! The fall is integrated on a coarse grid with large implicit Euler steps, one
//! Newton iteration each: it only has to choose a branch. The sheet is then
//! carried to the fine grid and settles by proximal steps that lengthen until
//! they are Newton steps on the exact energy.

use std::sync::Arc;

use rand::RngExt as _;

use crate::base::{Boundary, Vector3, seed};
use crate::fabric::Fabric;
use crate::geom::Mesh;
use crate::sim::energy::plate::Plate;
use crate::sim::grid::Grid;
use crate::sim::model::{Guide, Model};
use crate::sim::newton::{Inertia, Memory, Newton};
use crate::sim::self_contact::count_intersections;

/// How the specimen is simulated. Lengths in metres, times in seconds.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SimOptions {
    /// Side of the square specimen.
    pub side_m: f64,
    /// Vertices on a side of the grid that rests (61: 5 mm).
    pub vertices: usize,
    /// Vertices on a side of the grid that falls.
    pub fall_vertices: usize,
    /// The plate.
    pub plate: Plate,
    /// Time step of the fall.
    pub fall_step_s: f64,
    /// Longest fall, in steps.
    pub fall_steps: usize,
    /// Longest motion on the fine grid before Newton steps are tried, in steps.
    pub settle_steps: usize,
    /// At rest when no vertex feels more than this fraction of its cell's weight ...
    pub residual: f64,
    /// ... and the last Newton step moved no vertex more than this.
    pub step_m: f64,
    /// Ends as [`Stop::Slow`] when a cycle of the descent lowers the energy by less
    /// than this fraction; 0 goes on to the residual's limit.
    pub energy_drop: f64,
    /// Factorisations on the fine grid before it is given up.
    pub iterations: usize,
}

impl Default for SimOptions {
    fn default() -> Self {
        Self {
            side_m: crate::base::frame::SPECIMEN_SIDE_M,
            vertices: 61,
            fall_vertices: 31,
            plate: Plate::default(),
            fall_step_s: 1.0 / 50.0,
            fall_steps: 70,
            settle_steps: 4,
            residual: 1e-3,
            step_m: 1e-6,
            energy_drop: 0.0,
            iterations: 200,
        }
    }
}

/// How the flat specimen is let go.
#[derive(Clone, Debug, PartialEq)]
pub enum DropStart {
    /// Level, with a fixed unevenness of 0.2 mm that breaks the symmetry.
    Canonical,
    /// Corners lifted, sheet tilted, uneven and a little off centre, all drawn
    /// from this seed: samples the branches.
    Perturbed(u64),
    /// Led by springs to a scanned rim (simulation frame), then released: the
    /// equilibrium nearest to what was scanned.
    Guided(Box<Boundary>),
}

/// A drop.
#[derive(Clone, Debug, PartialEq)]
pub struct Drop {
    /// How the specimen is let go.
    pub start: DropStart,
}

impl Drop {
    /// The canonical drop.
    #[must_use]
    pub fn canonical() -> Self {
        Self { start: DropStart::Canonical }
    }
}

/// Why the search for rest ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// Residual and step are below their limits and the equilibrium is stable.
    AtRest,
    /// Residual and step are below their limits, but the tangent is not positive
    /// definite.
    Unstable,
    /// The energy hardly falls any more, but a residual is left.
    Slow,
    /// The iterations ran out.
    Iterations,
}

impl Stop {
    /// The word used in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::AtRest => "at_rest",
            Self::Unstable => "unstable",
            Self::Slow => "slow",
            Self::Iterations => "iterations",
        }
    }
}

/// A drape with its report.
#[derive(Clone, Debug)]
pub struct Drape {
    /// The grid it was simulated on.
    pub grid: Arc<Grid>,
    /// Vertex positions, simulation frame \[m\].
    pub positions_m: Vec<Vector3>,
    /// The rim.
    pub boundary: Boundary,
    /// Why it stopped.
    pub stop: Stop,
    /// Largest net force on a vertex \[N\].
    pub residual_n: f64,
    /// Elastic and gravitational energy, zero for the flat sheet at y = 0 \[J\].
    pub energy_j: f64,
    /// Folds: maxima of the rim's distance from the axis.
    pub nodes: usize,
    /// Pairs of triangles that intersect, by a test independent of the contact's.
    pub intersections: usize,
    /// Least distance of the sheet from the plate's surface \[m\].
    pub plate_clearance_m: f64,
    /// Newton iterations, coarse and fine together.
    pub factorisations: usize,
}

impl Drape {
    /// The sheet as triangles.
    #[must_use]
    pub fn mesh(&self) -> Mesh {
        self.grid.mesh(&self.positions_m)
    }
}

/// Drapes `fabric`.
#[must_use]
pub fn drape(fabric: &Fabric, drop: &Drop, options: &SimOptions) -> Drape {
    let fine = Grid::shared(options.vertices, options.side_m);
    let coarse = Grid::shared(options.fall_vertices.min(options.vertices), options.side_m);
    let (fallen, spent) = fall(fabric, drop, &coarse, options);
    let start = if coarse.n == fine.n { fallen } else { refine(&fine, &coarse, &fallen) };
    rest(fabric, &fine, start, spent, options)
}

/// Reach of self-contact in cells: wide on the coarse grid, so that layers are
/// still apart when carried to the fine one; at rest 1 mm on the 5 mm grid, two
/// thicknesses of a knit.
const FALL_GAP: f64 = 0.3;
const REST_GAP: f64 = 0.2;

/// Carries the sheet to the fine grid, as smoothly as its layers stay apart.
fn refine(fine: &Grid, coarse: &Grid, x: &[Vector3]) -> Vec<Vector3> {
    let triangles = fine.triangles();
    let mut best: Option<(usize, Vec<Vector3>)> = None;
    for smoothness in [1.0, 0.7, 0.4, 0.0] {
        let y = fine.prolong(coarse, x, smoothness);
        let crossings = count_intersections(&triangles, &y);
        if best.as_ref().is_none_or(|(least, _)| crossings < *least) {
            best = Some((crossings, y));
        }
        if crossings == 0 {
            break;
        }
    }
    best.map(|(_, y)| y).unwrap_or_default()
}

/// The fall on the coarse grid: implicit Euler, one Newton iteration a step.
fn fall(
    fabric: &Fabric,
    drop: &Drop,
    grid: &Arc<Grid>,
    options: &SimOptions,
) -> (Vec<Vector3>, usize) {
    let mut model = Model::new(grid, fabric, options.plate, FALL_GAP);
    let mut newton = Newton::new(&model);
    let mut x = start_positions(drop, grid, options);
    if let DropStart::Guided(rim) = &drop.start {
        model.guide = guide(grid, rim, fabric);
    }
    let pace = Pace { first_s: options.fall_step_s, growth: 1.2, longest_s: options.fall_step_s };
    evolve(&mut model, &mut newton, &mut x, pace, options.fall_steps);
    (x, newton.factorisations)
}

/// How the time step of a motion grows.
#[derive(Clone, Copy)]
struct Pace {
    first_s: f64,
    growth: f64,
    longest_s: f64,
}

/// Implicit Euler from rest, one Newton iteration with the projected Hessian a
/// step, until the sheet is slow or the steps run out. Its numerical damping is
/// what brings the sheet to rest.
fn evolve(model: &mut Model, newton: &mut Newton, x: &mut [Vector3], pace: Pace, steps: usize) {
    let grid = Arc::clone(&model.grid);
    let mut velocity = vec![Vector3::zeros(); x.len()];
    let mut free_flight = x.to_vec();
    let mut before = x.to_vec();
    let mut dt_s = pace.first_s;
    for step in 0..steps {
        for ((y, p), u) in free_flight.iter_mut().zip(x.iter()).zip(&velocity) {
            *y = p + u * dt_s;
        }
        model.plate.renew(&grid, x);
        model.self_contact.update(x, 0.0);
        before.copy_from_slice(x);
        let inertia = Inertia { dt_s, free_flight: Some(&free_flight) };
        let mut done = newton.iterate(model, x, inertia, true);
        for _ in 1..ITERATIONS_A_STEP {
            // a pair in the way stops the whole sheet: go on until its barrier acts
            if done.fraction > 0.5 || !done.definite {
                break;
            }
            model.forget_foreseen();
            done = newton.iterate(model, x, inertia, true);
        }
        let mut fastest = 0.0_f64;
        for ((u, p), q) in velocity.iter_mut().zip(x.iter()).zip(&before) {
            *u = (p - q) * (DAMPING / dt_s);
            fastest = fastest.max(u.norm());
        }
        if step > 10 && done.fraction > 0.5 && fastest < SLOW_M_S {
            break;
        }
        dt_s =
            if done.fraction < 0.3 { dt_s * 0.5 } else { (dt_s * pace.growth).min(pace.longest_s) };
    }
}

/// Newton iterations in a step that self-contact cuts short.
const ITERATIONS_A_STEP: usize = 4;
/// Fraction of the velocity that is left after a step.
const DAMPING: f64 = 0.97;
/// Speed below which a motion is over \[m/s\].
const SLOW_M_S: f64 = 0.01;

/// Springs from the border to the scanned rim, ten times the weight per metre.
fn guide(grid: &Grid, rim: &Boundary, fabric: &Fabric) -> Guide {
    let points: Vec<_> = rim.positions_m().collect();
    let border = grid.border();
    let per_side = grid.n - 1;
    let scale = (crate::base::boundary::POINTS_PER_SIDE - 1) as f64 / per_side as f64;
    let target = |k: usize| {
        let along = (k % per_side) as f64 * scale;
        let index = k / per_side * crate::base::boundary::POINTS_PER_SIDE + along.floor() as usize;
        let next = points[(index + 1) % points.len()];
        (points[index] + (next - points[index]) * along.fract()).coords
    };
    let weight = fabric.density_kg_m2 * grid.spacing_m.powi(2) * crate::base::frame::GRAVITY_M_S2;
    Guide {
        targets: border.iter().enumerate().map(|(k, &v)| (v, target(k))).collect(),
        stiffness_n_m: weight * 500.0,
    }
}

/// The sheet as it is let go, just above the plate.
fn start_positions(drop: &Drop, grid: &Grid, options: &SimOptions) -> Vec<Vector3> {
    let half = 0.5 * options.side_m;
    let mut waves = Vec::new();
    let (mut tilt, mut offset) = ([0.0, 0.0, 0.0], Vector3::zeros());
    match drop.start {
        DropStart::Canonical | DropStart::Guided(_) => {
            waves.extend([(0.2e-3, 1.3, 2.1, 0.4), (0.1e-3, 3.2, -1.7, 1.9)]);
        }
        DropStart::Perturbed(drop_seed) => {
            let mut rng = seed::rng(drop_seed, "drop", 0);
            let mut uniform = |limit: f64| rng.random_range(-limit..limit);
            tilt = [uniform(0.02), uniform(0.02), uniform(0.03)];
            offset = Vector3::new(uniform(1e-3), 0.0, uniform(1e-3));
            for _ in 0..6 {
                waves.push((uniform(1e-3), uniform(6.0), uniform(6.0), uniform(3.2)));
            }
        }
    }
    let shape = |p: Vector3| {
        let (x, z) = (p.x / half, p.z / half);
        // lifted by the square of the distance, so that the plate's part stays flat
        let lift =
            (x * tilt[0] + z * tilt[1] + x * z * tilt[2]) * p.norm_squared() / (2.0 * half * half);
        let uneven: f64 =
            waves.iter().map(|(a, kx, kz, phase)| a * (kx * x + kz * z + phase).sin()).sum();
        p + offset + Vector3::new(0.0, lift + uneven, 0.0)
    };
    let mut x: Vec<_> = (0..grid.vertices()).map(|v| shape(grid.flat(v))).collect();
    let reach = options.plate.radius_m + grid.spacing_m;
    let lowest =
        x.iter().filter(|p| p.x.hypot(p.z) < reach).map(|p| p.y).fold(f64::INFINITY, f64::min);
    for p in &mut x {
        p.y += options.plate.gap_m - lowest;
    }
    x
}

/// Equilibrium on the fine grid: proximal steps that lengthen into Newton steps.
fn rest(
    fabric: &Fabric,
    grid: &Arc<Grid>,
    start: Vec<Vector3>,
    spent: usize,
    options: &SimOptions,
) -> Drape {
    let mut model = Model::new(grid, fabric, options.plate, REST_GAP);
    let mut newton = Newton::new(&model);
    let mut x = start;
    lift_clear(&model, grid, &mut x);
    let cell_weight_n =
        fabric.density_kg_m2 * grid.spacing_m.powi(2) * crate::base::frame::GRAVITY_M_S2;
    let limit_n = options.residual * cell_weight_n;
    let (stop, residual_n) = settle(&mut model, &mut newton, &mut x, limit_n, options);
    Drape {
        boundary: grid.boundary(&x),
        stop,
        residual_n,
        energy_j: model.body_energy_j(&x),
        nodes: count_nodes(&grid.boundary(&x)),
        intersections: count_intersections(&grid.triangles(), &x),
        plate_clearance_m: model.plate.clearance_m(grid, &x),
        factorisations: newton.factorisations + spent,
        grid: Arc::clone(grid),
        positions_m: x,
    }
}

/// Motion with momentum until the sheet is slow, then Newton steps with the exact
/// Hessian; where that is indefinite the sheet is not at a minimum and moves on.
fn settle(
    model: &mut Model,
    newton: &mut Newton,
    x: &mut [Vector3],
    limit_n: f64,
    options: &SimOptions,
) -> (Stop, f64) {
    let grid = Arc::clone(&model.grid);
    let mut residual_n = f64::INFINITY;
    let pace = Pace { first_s: 0.01, growth: 1.2, longest_s: 0.05 };
    let budget = newton.factorisations + options.iterations;
    evolve(model, newton, x, pace, options.settle_steps);
    let mut last_j = model.energy_j(x);
    let mut memory = Memory::default();
    while newton.factorisations < budget {
        for _ in 0..20 {
            model.plate.renew(&grid, x);
            model.self_contact.update(x, 0.0);
            model.forget_foreseen();
            let done = newton.quasi_newton(model, x, &mut memory, QUASI_STEPS, limit_n);
            let now_j = model.energy_j(x);
            let drop = (last_j - now_j) / now_j.abs();
            last_j = now_j;
            residual_n = done.residual_n;
            if done.fraction > 0.0 && done.definite && drop < options.energy_drop {
                return (Stop::Slow, residual_n);
            }
            if done.fraction == 0.0 || !done.definite {
                // wedged between layers: let the barrier push them apart
                evolve(model, newton, x, Pace { first_s: 2e-3, ..pace }, UNWEDGE_STEPS);
                memory.clear();
                break;
            }
            if done.residual_n < 100.0 * limit_n {
                break;
            }
        }
        for _ in 0..NEWTON_STEPS {
            let grip_change_n = model.plate.renew(&grid, x);
            model.self_contact.update(x, 0.0);
            let still = Inertia { dt_s: f64::INFINITY, free_flight: None };
            let done = newton.iterate(model, x, still, false);
            residual_n = done.residual_n;
            if !done.definite || done.fraction < 0.05 {
                break;
            }
            if residual_n < limit_n && done.step_m < options.step_m && grip_change_n < limit_n {
                let stable = newton.is_stable(model, x);
                return (if stable { Stop::AtRest } else { Stop::Unstable }, residual_n);
            }
        }
        memory.clear();
    }
    (Stop::Iterations, residual_n)
}

/// Steps of motion that free layers wedged against each other.
const UNWEDGE_STEPS: usize = 5;
/// Quasi-Newton iterations on one factor.
const QUASI_STEPS: usize = 15;
/// Newton steps in a row before the sheet is set in motion again.
const NEWTON_STEPS: usize = 20;

/// Raises the sheet until nothing lies inside the plate: the carried-over sheet
/// may dip into it between the coarse grid's samples.
fn lift_clear(model: &Model, grid: &Grid, x: &mut [Vector3]) {
    for _ in 0..50 {
        if model.plate.clearance_m(grid, x) > 0.05e-3 {
            return;
        }
        x.iter_mut().for_each(|p| p.y += 0.1e-3);
    }
}

/// Maxima of the rim's distance from the axis, after smoothing over 45 mm.
fn count_nodes(rim: &Boundary) -> usize {
    let rho: Vec<f64> = rim.positions_m().map(|p| p.x.hypot(p.z)).collect();
    let n = rho.len();
    let smooth: Vec<f64> =
        (0..n).map(|i| (0..9).map(|k| rho[(i + n + k - 4) % n]).sum::<f64>() / 9.0).collect();
    (0..n)
        .filter(|&i| {
            let window = (1..=6)
                .all(|k| smooth[i] > smooth[(i + k) % n] && smooth[i] >= smooth[(i + n - k) % n]);
            window && smooth[i] > smooth.iter().copied().fold(f64::INFINITY, f64::min) + 1e-3
        })
        .count()
}

#[cfg(test)]
mod bench {
    use super::*;
    fn cpu() -> f64 {
        let t = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
        t.split(' ').next().unwrap().parse::<f64>().unwrap() * 1e-9
    }
    #[test]
    fn prior() {
        let mix = crate::fabric::Mixture::knit_2020();
        let n: u64 = std::env::var("N").map_or(12, |v| v.parse().unwrap());
        let mut o = SimOptions::default();
        let get = |k: &str, d: usize| std::env::var(k).map_or(d, |v| v.parse().unwrap());
        o.fall_steps = get("FALL", o.fall_steps);
        o.settle_steps = get("SETTLE", o.settle_steps);
        for k in 0..n {
            let f = mix.sample(11, k).unwrap();
            let mut last: Option<Boundary> = None;
            let lb = ((f.bending_weft_nm * f.bending_warp_nm).sqrt() / (f.density_kg_m2 * 9.8))
                .cbrt()
                * 1e3;
            let mut line = format!("{k:3} c{lb:5.1}mm S{:7.1}", f.stretch_weft_n_m);
            for (v, c, drop) in [(41, 31, 1e-4), (41, 25, 1e-4), (41, 21, 2e-4)] {
                o.energy_drop = drop;
                o.vertices = v;
                o.fall_vertices = c;
                let t = cpu();
                let d = drape(&f, &Drop { start: DropStart::Perturbed(k) }, &o);
                let t = cpu() - t;
                let rim = last.as_ref().map_or(0.0, |l| l.mean_distance_m(&d.boundary) * 1e3);
                line += &format!(
                    " | {:?} {t:.2}s n{} f{} hits {} E {:.4e} rim {rim:.3}",
                    d.stop, d.nodes, d.factorisations, d.intersections, d.energy_j
                );
                last.get_or_insert(d.boundary);
            }
            eprintln!("{line}");
        }
    }
}
