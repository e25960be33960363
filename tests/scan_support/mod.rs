//! Drapes and scans whose truth is known: a quick position-based drape of the
//! 300 mm square over the 50 mm plate, and points sampled from it, its floor and
//! its pedestal. Not physics to fit parameters to; a shape to find a rim on.

#![allow(dead_code)]

use rand::RngExt as _;
use rand_distr::{Distribution, Normal};
use scan2params::base::boundary::POINTS_PER_SIDE;
use scan2params::base::{Boundary, Isometry3, Point3, Vector3, seed};
use scan2params::geom::Cloud;

/// Vertices along a side of the synthetic drape.
pub const SIDE: usize = POINTS_PER_SIDE;
const STEP_M: f64 = 0.005;
const PLATE_M: f64 = 0.050;

/// A drape: vertex `ix * 61 + iz` has the flat position (-150 + 5 ix, -150 + 5 iz) mm.
#[derive(Clone)]
pub struct Drape {
    pub vertices: Vec<Point3>,
}

impl Drape {
    /// Position-based drape; `bend` (about 0.02 soft to 0.5 stiff) sets the folds.
    pub fn synthetic(run_seed: u64, bend: f64) -> Self {
        let mut rng = seed::rng(run_seed, "drape", 0);
        let at = |k: usize| ((k / SIDE) as f64 * STEP_M - 0.15, (k % SIDE) as f64 * STEP_M - 0.15);
        let mut x: Vec<Vector3> = (0..SIDE * SIDE)
            .map(|k| {
                let (u, v) = at(k);
                let r = u.hypot(v);
                let folds = 0.01 * (7.0 * v.atan2(u) + run_seed as f64).cos();
                let y = if r > PLATE_M {
                    -0.3 * (r - PLATE_M) + folds * (r - PLATE_M) / 0.1
                } else {
                    0.0
                };
                Vector3::new(u, y + 1e-4 * (rng.random::<f64>() - 0.5), v)
            })
            .collect();
        let pinned: Vec<bool> = (0..SIDE * SIDE).map(|k| at(k).0.hypot(at(k).1) < 0.047).collect();
        for (k, p) in x.iter_mut().enumerate() {
            if pinned[k] {
                p.y = 0.0;
            }
        }
        let mut links: Vec<(usize, usize, f64, f64)> = Vec::new();
        for ix in 0..SIDE {
            for iz in 0..SIDE {
                let mut link = |dx: usize, dz: i64, stiffness: f64| {
                    let (jx, jz) = (ix + dx, iz as i64 + dz);
                    if jx < SIDE && (0..SIDE as i64).contains(&jz) {
                        let rest = STEP_M * ((dx * dx) as f64 + (dz * dz) as f64).sqrt();
                        links.push((ix * SIDE + iz, jx * SIDE + jz as usize, rest, stiffness));
                    }
                };
                link(1, 0, 1.0);
                link(0, 1, 1.0);
                link(1, 1, 0.6);
                link(1, -1, 0.6);
                link(3, 0, bend);
                link(0, 3, bend);
                link(2, 2, bend);
                link(2, -2, bend);
            }
        }
        let mut velocity = vec![Vector3::zeros(); x.len()];
        let dt = 4e-3;
        for step in 0..700 {
            let before = x.clone();
            for k in 0..x.len() {
                if !pinned[k] {
                    velocity[k].y -= 9.8 * dt;
                    velocity[k] *= if step < 500 { 0.985 } else { 0.93 };
                    x[k] += velocity[k] * dt;
                }
            }
            for sweep in 0..14 {
                let order: Box<dyn Iterator<Item = &(usize, usize, f64, f64)>> = if sweep % 2 == 0 {
                    Box::new(links.iter())
                } else {
                    Box::new(links.iter().rev())
                };
                for &(i, j, rest, stiffness) in order {
                    let d = x[j] - x[i];
                    let length = d.norm().max(1e-9);
                    let (wi, wj) =
                        (f64::from(u8::from(!pinned[i])), f64::from(u8::from(!pinned[j])));
                    if wi + wj == 0.0 {
                        continue;
                    }
                    let move_by = d * ((length - rest) / length * stiffness / (wi + wj));
                    x[i] += move_by * wi;
                    x[j] -= move_by * wj;
                }
                for k in 0..x.len() {
                    let r = x[k].x.hypot(x[k].z);
                    if !pinned[k] && r < PLATE_M && x[k].y < 0.0 {
                        if x[k].y > -0.003 && r < PLATE_M - 0.002 {
                            x[k].y = 0.0;
                        } else {
                            let push = PLATE_M / r.max(1e-6);
                            x[k].x *= push;
                            x[k].z *= push;
                        }
                    }
                }
            }
            for k in 0..x.len() {
                velocity[k] = (x[k] - before[k]) / dt;
            }
        }
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
        if let Some((from, to)) = sampling.missing_deg {
            let bearing = (-p.z).atan2(p.x).to_degrees().rem_euclid(360.0);
            if p.x.hypot(p.z) > 0.052 && bearing > from && bearing < to {
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
