//! Drapes and scans whose truth is known: simulated drapes, and points sampled
//! evenly from one, its floor and its pedestal.

#![allow(dead_code)]

use std::sync::OnceLock;

use rand::RngExt as _;
use rand_distr::{Distribution, Normal};
use scan2params::base::boundary::POINTS_PER_SIDE;
use scan2params::base::{Boundary, Isometry3, Point3, Vector3, seed};
use scan2params::dataset::drapes::dataset_options;
use scan2params::fabric::Fabric;
use scan2params::geom::Cloud;
use scan2params::sim::grid::Grid;
use scan2params::sim::{Drop, DropStart, Numerics, SimOptions, drape};

/// Vertices along a side of a drape.
pub const SIDE: usize = POINTS_PER_SIDE;
const STEP_M: f64 = 0.005;

/// How the tests' drapes are made. They are shapes to scan, and the promises of the scan path are
/// about these very shapes: under numerics 4 other drops have other folds, some of which hide
/// behind each other.
pub fn shapes() -> SimOptions {
    SimOptions { numerics: Numerics::THREE, ..dataset_options() }
}

/// A drape: vertex `ix * 61 + iz` has the flat position (-150 + 5 ix, -150 + 5 iz) mm.
#[derive(Clone)]
pub struct Drape {
    pub vertices: Vec<Point3>,
}

/// The fabric of [`stiff_knit`] in the paper's units.
pub const STIFF_KNIT: [f64; 7] = [240e3, 310e3, 90e3, 5200.0, 3600.0, 4100.0, 260.0];

/// A drape of a stiff knit, simulated once for all tests of a program.
pub fn stiff_knit() -> &'static Drape {
    static DRAPE: OnceLock<Drape> = OnceLock::new();
    DRAPE.get_or_init(|| Drape::simulated(2, STIFF_KNIT))
}

/// A drape of the paper's mean knit, simulated once for all tests of a program.
pub fn mean_knit() -> &'static Drape {
    static DRAPE: OnceLock<Drape> = OnceLock::new();
    let knit = [131e3, 164e3, 75e3, 1120.0, 1371.0, 1245.0, 214.0];
    DRAPE.get_or_init(|| Drape::simulated(1, knit))
}

impl Drape {
    /// A drape simulated on a coarser grid, smoothly refined.
    pub fn simulated(drop_seed: u64, paper_units: [f64; 7]) -> Self {
        let fabric = Fabric::from_paper_units(paper_units);
        let drop = Drop { start: DropStart::Perturbed(drop_seed) };
        let coarse = drape(&fabric, &drop, &shapes());
        let fine = Grid::shared(SIDE, 0.3);
        let x = fine.prolong(&coarse.grid, &coarse.positions_m, 1.0);
        Self { vertices: x.into_iter().map(Point3::from).collect() }
    }

    /// A drape from an OBJ in mm with the same vertex order.
    pub fn from_obj(path: &std::path::Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap();
        let vertices = text
            .lines()
            .filter_map(|line| line.strip_prefix("v "))
            .map(|line| {
                let v: Vec<f64> = line
                    .split_whitespace()
                    .take(3)
                    .map(|t| t.parse::<f64>().unwrap() * 1e-3)
                    .collect();
                Point3::new(v[0], v[1], v[2])
            })
            .collect();
        Self { vertices }
    }

    /// The true rim in the boundary vector's order.
    pub fn rim(&self) -> Boundary {
        let points = (0..244).map(|i| {
            let [x, z] = Boundary::flat_xz_m(i, 0.3);
            let (ix, iz) =
                (((x + 0.15) / STEP_M).round() as usize, ((z + 0.15) / STEP_M).round() as usize);
            self.vertices[ix * SIDE + iz]
        });
        Boundary::exact(points).unwrap()
    }

    /// Mean length of the cloth along x and along z [mm].
    pub fn widths_mm(&self) -> [f64; 2] {
        let row = |k: usize, along_x: bool| -> f64 {
            let at = |i: usize| {
                if along_x { self.vertices[i * SIDE + k] } else { self.vertices[k * SIDE + i] }
            };
            (1..SIDE).map(|i| (at(i) - at(i - 1)).norm()).sum()
        };
        [true, false].map(|x| (0..SIDE).map(|k| row(k, x)).sum::<f64>() * 1e3 / SIDE as f64)
    }

    /// Unit vector from the cloth outward at rim point `i`, across its side.
    pub fn outward(&self, i: usize) -> Vector3 {
        let [x, z] = Boundary::flat_xz_m(i, 0.3);
        let (ix, iz) =
            (((x + 0.15) / STEP_M).round() as usize, ((z + 0.15) / STEP_M).round() as usize);
        let (jx, jz) = match i / SIDE {
            0 => (ix - 1, iz),
            1 => (ix, iz - 1),
            2 => (ix + 1, iz),
            _ => (ix, iz + 1),
        };
        (self.vertices[ix * SIDE + iz] - self.vertices[jx * SIDE + jz]).normalize()
    }

    pub fn triangles() -> Vec<[usize; 3]> {
        let mut out = Vec::new();
        for ix in 0..SIDE - 1 {
            for iz in 0..SIDE - 1 {
                let k = ix * SIDE + iz;
                out.push([k, k + 1, k + SIDE]);
                out.push([k + 1, k + SIDE + 1, k + SIDE]);
            }
        }
        out
    }
}

/// The flat position (x, z) of a drape's vertex \[m\].
pub fn flat_m(vertex: usize) -> [f64; 2] {
    [vertex / SIDE, vertex % SIDE].map(|k| k as f64 * STEP_M - 0.15)
}

/// How a drape is sampled.
#[derive(Clone, Copy)]
pub struct Sampling {
    pub cloth_points: usize,
    pub floor_points: usize,
    pub outliers: usize,
    pub noise_m: f64,
    /// Points of this sector (degrees from, to) of the hanging cloth are left out.
    pub missing_deg: Option<(f64, f64)>,
    pub units_per_metre: f64,
    pub seed: u64,
}

impl Default for Sampling {
    fn default() -> Self {
        Self {
            cloth_points: 120_000,
            floor_points: 60_000,
            outliers: 200,
            noise_m: 0.15e-3,
            missing_deg: None,
            units_per_metre: 1.0,
            seed: 1,
        }
    }
}

impl Sampling {
    /// Half as dense, with a quarter of the floor: for what is asked of a scan beside its rim's
    /// exact place.
    pub fn thin() -> Self {
        Self { cloth_points: 60_000, floor_points: 15_000, ..Self::default() }
    }
}

/// A random rigid motion.
pub fn random_pose(run_seed: u64) -> Isometry3 {
    let mut rng = seed::rng(run_seed, "pose", 0);
    let mut next = || rng.random::<f64>() - 0.5;
    let axis = Vector3::new(next(), next(), next()).normalize() * (6.0 * next());
    Isometry3::new(Vector3::new(next(), next(), next()), axis)
}

/// Points of the drape, floor (y = -250 mm), pedestal and outliers, moved by
/// `scan_from_sim`, in the sampling's unit.
pub fn scan(drape: &Drape, sampling: &Sampling, scan_from_sim: &Isometry3) -> Cloud {
    scan_where(drape, sampling, scan_from_sim, |_, _| true)
}

/// [`scan`] of the cloth's points alone that are kept, by their flat position (x, z) and
/// their place without noise \[m\].
pub fn scan_where(
    drape: &Drape,
    sampling: &Sampling,
    scan_from_sim: &Isometry3,
    keep: impl Fn([f64; 2], &Point3) -> bool,
) -> Cloud {
    let mut rng = seed::rng(sampling.seed, "scan", 0);
    let noise = Normal::new(0.0, sampling.noise_m.max(1e-12)).unwrap();
    let mut points = Vec::new();
    let triangles = Drape::triangles();
    for _ in 0..sampling.cloth_points {
        let t = triangles[(rng.random::<f64>() * triangles.len() as f64) as usize];
        let [a, b, c] = t.map(|k| drape.vertices[k]);
        let (mut s, mut q) = (rng.random::<f64>(), rng.random::<f64>());
        if s + q > 1.0 {
            (s, q) = (1.0 - s, 1.0 - q);
        }
        let p = a + (b - a) * s + (c - a) * q;
        let [a, b, c] = t.map(flat_m);
        let flat = [0, 1].map(|k| a[k] + (b[k] - a[k]) * s + (c[k] - a[k]) * q);
        if !keep(flat, &p) {
            continue;
        }
        if let Some((from, to)) = sampling.missing_deg {
            let bearing = (-p.z).atan2(p.x).to_degrees().rem_euclid(360.0);
            // folds of stiff cloth swing in under the plate's edge
            let hangs = p.x.hypot(p.z) > 0.052 || p.y < -0.01;
            if hangs && bearing > from && bearing < to {
                continue;
            }
        }
        points.push(p);
    }
    for _ in 0..sampling.floor_points {
        points.push(Point3::new(
            0.7 * rng.random::<f64>() - 0.35,
            -0.25,
            0.7 * rng.random::<f64>() - 0.35,
        ));
    }
    for _ in 0..sampling.floor_points / 10 {
        let angle = std::f64::consts::TAU * rng.random::<f64>();
        points.push(Point3::new(
            0.03 * angle.cos(),
            -0.25 + 0.15 * rng.random::<f64>(),
            0.03 * angle.sin(),
        ));
    }
    for p in &mut points {
        *p += Vector3::new(noise.sample(&mut rng), noise.sample(&mut rng), noise.sample(&mut rng));
    }
    for _ in 0..sampling.outliers {
        let mut next = || rng.random::<f64>() - 0.5;
        points.push(Point3::new(0.6 * next(), 0.5 * next(), 0.6 * next()));
    }
    let points = points
        .into_iter()
        .map(|p| scan_from_sim * p * 1.0)
        .map(|p| p * sampling.units_per_metre)
        .collect();
    Cloud { points, ..Cloud::default() }
}
