//! What a drape costs, beside a plain loop of implicit Euler steps and beside a sheet that is led
//! there from a neighbouring fabric.
//!
//!     cargo bench --bench drape
//!
//! The plain loop is what one would write first: the same energies without self-contact, steps of
//! 10 ms, one Newton iteration and one fresh Cholesky factor in double precision a step, until no
//! vertex feels more than the limit of a drape at rest. Before the timings the bench prints how far
//! the loop got in its 3,000 steps and the ratio of one run of each. A neighbouring fabric lies
//! 0.25 away, the root mean square of the seven logarithms; the sheet is led to four and back.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Matrix3;
use scan2params::base::Vector3;
use scan2params::base::clock::thread_cpu_s;
use scan2params::fabric::Fabric;
use scan2params::numeric::sparse::Factor;
use scan2params::sim::grid::Grid;
use scan2params::sim::model::{Model, Tangent};
use scan2params::sim::{Drop, Experiment, FollowOptions, Follower, HessianForm, SimOptions, drape};

/// Time step \[s\].
const STEP_S: f64 = 0.01;
/// Fraction of the velocity left after a step, as in the fall of a drape.
const DAMPING: f64 = 0.97;
/// Steps before the loop gives up.
const STEPS: usize = 3000;

/// Steps taken and the largest net force on a vertex over a cell's weight.
fn plain_euler(fabric: &Fabric, vertices: usize) -> (usize, f64) {
    let experiment = Experiment::default();
    let grid = Grid::of(&experiment.specimen, vertices);
    let mut model = Model::new(&grid, fabric, &experiment, 0.2);
    let cell_n = fabric.density_kg_m2 * grid.spacing_m.powi(2) * 9.80665;
    let bump = |v: usize| 0.2e-3 * ((v * v) as f64).sin();
    let mut x: Vec<Vector3> = (0..grid.vertices())
        .map(|v| grid.flat(v) + Vector3::new(0.0, 1e-3 + bump(v), 0.0))
        .collect();
    let mut velocity = vec![Vector3::zeros(); x.len()];
    let mut gradient = velocity.clone();
    let mut tangent = Tangent::default();
    let mut factor = Factor::<f64>::new(&grid.analysis);
    let mut residual = f64::INFINITY;
    for step in 0..STEPS {
        model.plate.renew(&grid, &x);
        model.gradient(&x, &mut gradient);
        residual = gradient.iter().map(Vector3::norm).fold(0.0, f64::max) / cell_n;
        if residual < SimOptions::default().residual {
            return (step, residual);
        }
        model.hessian(&x, HessianForm::Projected, &mut tangent);
        for (v, m) in model.weight.mass_kg.iter().enumerate() {
            let inertia = Matrix3::identity() * (m / (STEP_S * STEP_S));
            grid.analysis.pattern().add_diagonal(&mut tangent.values, v, &inertia);
        }
        let mut direction: Vec<Vector3> = (0..x.len())
            .map(|v| velocity[v] * (model.weight.mass_kg[v] / STEP_S) - gradient[v])
            .collect();
        if !factor.factorize(&tangent.values) {
            return (step, residual);
        }
        factor.solve(&mut direction);
        for ((p, u), d) in x.iter_mut().zip(&mut velocity).zip(&direction) {
            *p += d;
            *u = d * (DAMPING / STEP_S);
        }
    }
    (STEPS, residual)
}

fn options(vertices: usize) -> SimOptions {
    SimOptions { vertices, fall_vertices: vertices.min(31), ..SimOptions::default() }
}

/// Processor time of some work on this thread \[s\]; NaN where the system does not tell it.
fn cpu_s<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let begun = thread_cpu_s();
    let result = work();
    (result, begun.zip(thread_cpu_s()).map_or(f64::NAN, |(a, b)| b - a))
}

/// Fabrics 0.25 away, some parameters up and some down.
fn neighbours(fabric: &Fabric) -> Vec<Fabric> {
    let values = fabric.in_si();
    let signs = [0b000_1111, 0b011_0011, 0b101_0101, 0b110_1001];
    let changed = |sign: &u32| {
        let up = |k: usize| if sign >> k & 1 == 1 { 0.25_f64 } else { -0.25 };
        Fabric::from_si(std::array::from_fn(|k| values[k] * up(k).exp())).project_bending().0
    };
    signs.iter().map(changed).collect()
}

/// Processor times of leading the sheet to the neighbours and back, in rising order \[s\].
fn led_s(follower: &mut Follower, fabric: &Fabric) -> Vec<f64> {
    let mut times = Vec::new();
    for to in neighbours(fabric).iter().flat_map(|neighbour| [neighbour, fabric]) {
        let (followed, time_s) = cpu_s(|| follower.follow_fabric(to, &FollowOptions::default()));
        assert!(followed.is_ok_and(|followed| followed.reached == 1.0));
        times.push(time_s);
    }
    times.sort_by(f64::total_cmp);
    times
}

fn drapes(criterion: &mut Criterion) {
    let stiff = Fabric::from_paper_units([240e3, 310e3, 90e3, 5200.0, 3600.0, 4100.0, 260.0]);
    let fabrics = [("mean", Fabric::mean_knit()), ("stiff", stiff)];
    for (name, fabric) in &fabrics {
        for vertices in [31, 61] {
            let (ours, ours_s) = cpu_s(|| drape(fabric, &Drop::canonical(), &options(vertices)));
            let ((steps, residual), plain_s) = cpu_s(|| plain_euler(fabric, vertices));
            println!(
                "{name}, {vertices} vertices a side: drape {ours_s:.2} s ({}, self-contact), plain \
                 Euler {plain_s:.2} s ({steps} steps, residual {residual:.1e} of a cell's weight, \
                 no self-contact), ratio {:.1}",
                ours.stop.name(),
                plain_s / ours_s
            );
            let mut follower = Follower::drop(fabric, &Drop::canonical(), &options(vertices));
            let led_s = led_s(&mut follower, fabric);
            let median_s = 0.5 * (led_s[3] + led_s[4]);
            println!(
                "    led to a neighbouring fabric: {median_s:.2} s in the median, {:.2} at most, \
                 {:.2} and {:.2} of the drape",
                led_s[7],
                median_s / ours_s,
                led_s[7] / ours_s
            );
        }
    }
    let mut group = criterion.benchmark_group("drape");
    group.sample_size(10);
    for (name, fabric) in &fabrics {
        group.bench_function(format!("{name}, 31 vertices a side"), |bench| {
            bench.iter(|| drape(black_box(fabric), &Drop::canonical(), &options(31)));
        });
        let mut follower = Follower::drop(fabric, &Drop::canonical(), &options(31));
        let to = [neighbours(fabric)[0], *fabric];
        group.bench_function(format!("{name}, 31 vertices a side, led there and back"), |bench| {
            bench.iter(|| to.map(|to| follower.follow_fabric(&to, &FollowOptions::default())));
        });
    }
    group.finish();
}

criterion_group!(benches, drapes);
criterion_main!(benches);
