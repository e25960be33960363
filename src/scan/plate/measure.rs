//! Measures the plate around a candidate: plane, edge, circle, noise.
//!
//! Centre: on each bearing the cloth leaves the plate tangentially with a
//! curvature k, so its depth below the plane is k (r - R)^2 / 2 and sqrt(depth)
//! is a straight line in r that vanishes at the edge R; the centre is that of the
//! circle through the edges of all bearings.

use nalgebra::{DMatrix, DVector, UnitVector3};
use rayon::prelude::*;

use super::super::hints::Hints;
use super::super::options::ScanOptions;
use super::super::plane::{horizontal_axes, principal};
use super::super::tuning::PlateTuning;
use super::layer;
use super::placed::Placed;
use super::seek::Candidate;
use super::skirt::Skirt;
use crate::base::{Point3, Vector3};
use crate::numeric::robust;

/// The plate as the cloth on it shows it.
#[derive(Clone, Debug)]
pub(in crate::scan) struct Plate {
    /// Centre of the flat disc, on the cloth's surface \[m\].
    pub centre: Point3,
    /// Up: the disc's normal, away from where the cloth hangs.
    pub up: UnitVector3<f64>,
    /// Radius at which the cloth leaves the plane \[m\].
    pub radius_m: f64,
    /// Scatter of that radius over the bearings \[m\].
    pub radius_scatter_m: f64,
    /// Robust standard deviation of the raw points about the disc's plane \[m\].
    pub noise_m: f64,
    /// Standard error of the centre in the plane, per axis \[m\].
    pub centre_sigma_m: f64,
    /// Standard error of the disc's tilt \[rad\].
    pub tilt_sigma_rad: f64,
    /// Whether radius and axis were read from a sheet: raw points show stiff cloth's 4 to 17 mm too
    /// small.
    pub from_sheet: bool,
}

/// Finds the plate's tilt, height and noise anew about the centre that it has: cloth arches over it
/// evenly, so that about the true centre only a plane is odd.
pub(in crate::scan) fn level(points: &[Point3], plate: &mut Plate, options: &ScanOptions) {
    let (radius_m, tuning) = (options.plate_radius_m, &options.tuning.plate);
    let (up, most) = (plate.up.into_inner(), tuning.most_near[1]);
    let mut around = Around::new(points, plate.centre, up, radius_m, most, tuning);
    around.noise_m = plate.noise_m;
    for _ in 0..2 {
        around.uncover(true);
        let Some(Arch { slope, height_m, .. }) = around.arch(EVEN_AND_PLANE) else { return };
        let [u, v] = around.axes();
        around.up = (around.up - u * slope[0] - v * slope[1]).normalize();
        around.centre += around.up * height_m;
    }
    let Some(Arch { scatter_m, .. }) = around.arch(QUARTIC) else { return };
    (plate.centre, plate.up) = (around.centre, UnitVector3::new_normalize(around.up));
    plate.noise_m = scatter_m;
}

/// Powers of the level coordinates that a surface over the plate is made of: all up to the
/// fourth,
const QUARTIC: &[(i32, i32)] = &[
    (0, 0),
    (1, 0),
    (0, 1),
    (2, 0),
    (1, 1),
    (0, 2),
    (4, 0),
    (3, 1),
    (2, 2),
    (1, 3),
    (0, 4),
    (3, 0),
    (2, 1),
    (1, 2),
    (0, 3),
];
/// and of these a plane and what is even.
const EVEN_AND_PLANE: &[(i32, i32)] = QUARTIC.split_at(11).0;

/// A surface over the plate.
struct Arch {
    /// Its slope at the centre.
    slope: [f64; 2],
    /// Its height there \[m\].
    height_m: f64,
    /// Robust scatter of the points about it \[m\].
    scatter_m: f64,
}

/// The points around a candidate, and what is known of its place.
struct Around<'a> {
    /// The points, as scanned.
    all: Vec<Point3>,
    /// Those that nothing covers.
    open: Vec<Point3>,
    centre: Point3,
    up: Vector3,
    noise_m: f64,
    radius_m: f64,
    tuning: &'a PlateTuning,
}

/// Plane from the inner disc's raw points, then the circle through the edges; `None` where there is
/// no plate that the caller allows.
pub(in crate::scan) fn measure(
    points: &[Point3],
    rough: &Candidate,
    hints: &Hints,
    options: &ScanOptions,
) -> Option<Plate> {
    let (radius_m, tuning) = (options.plate_radius_m, &options.tuning.plate);
    let most = tuning.most_near[0];
    let mut around = Around::new(points, rough.centre, rough.up, radius_m, most, tuning);
    let nominal = Circle { centre: [0.0; 2], radius_m, scatter_m: 0.5 * radius_m };
    let (mut circle, mut tilt_sigma_rad) = (nominal, 0.0);
    for step in 0..tuning.measurements {
        // What is covered depends on the place, which settles after a step or two.
        if step % 2 == 0 {
            around.uncover(step > 0);
        }
        tilt_sigma_rad = around.fit_plane()?;
        let [u, v] = around.axes();
        let edges = around.leaving_edges();
        let Some(found) = circle_through(&edges, tuning.least_edges) else { break };
        let [x, z] = found.centre;
        around.centre += u * x + v * z;
        circle = found;
    }
    let plate = Plate {
        centre: around.centre,
        up: UnitVector3::new_normalize(around.up),
        radius_m: circle.radius_m,
        radius_scatter_m: circle.scatter_m,
        // Each bearing tells one direction; edges of the same fold go together.
        centre_sigma_m: circle.scatter_m / (tuning.bearings as f64 / 4.0).sqrt() * 0.5,
        noise_m: around.arch(QUARTIC).map_or(around.noise_m, |arch| arch.scatter_m),
        tilt_sigma_rad,
        from_sheet: false,
    };
    hints.allow(&plate.centre, &plate.up).then_some(plate)
}

impl<'a> Around<'a> {
    fn new(
        points: &[Point3],
        centre: Point3,
        up: Vector3,
        radius_m: f64,
        most: usize,
        tuning: &'a PlateTuning,
    ) -> Self {
        let reach_m = radius_m * tuning.reach_radii;
        let near: Vec<Point3> =
            points.par_iter().copied().filter(|p| (p - centre).norm() < reach_m).collect();
        let stride = near.len().div_ceil(most).max(1);
        let all = near.into_iter().step_by(stride).collect();
        Self { all, open: Vec::new(), centre, up, noise_m: tuning.flat_rms_m, radius_m, tuning }
    }

    /// Two level axes.
    fn axes(&self) -> [Vector3; 2] {
        let (u, v) = horizontal_axes(&self.up, &Vector3::x());
        [u, v]
    }

    /// Finds out which points nothing covers: neither the uppermost layer nor, where the
    /// noise is known, the cloth farther out.
    fn uncover(&mut self, noise_is_known: bool) {
        let ([u, v], Self { centre, up, radius_m, tuning, .. }) = (self.axes(), &*self);
        let placed = |p: &Point3| Placed::of(p, centre, [&u, up, &v]);
        let all: Vec<Placed> = self.all.iter().map(placed).collect();
        let covered = layer::covered(&all, *radius_m, tuning);
        let open = self.all.iter().zip(covered).filter(|(_, covered)| !covered);
        let mut open: Vec<Point3> = open.map(|(p, _)| *p).collect();
        if noise_is_known {
            let low = open.iter().map(placed).filter(|p| p.height_m < 0.2 * radius_m);
            let skirt = Skirt::new(low, *radius_m, tuning);
            let margin_m = tuning.outside_higher_m.max(tuning.outside_noises * self.noise_m);
            open.retain(|p| {
                let p = placed(p);
                let near_edge = (0.5..tuning.side_radii).contains(&(p.radius_m() / radius_m));
                !(near_edge && skirt.is_higher_outside(&p, margin_m))
            });
        }
        self.open = open;
    }

    /// Lays the plane through the inner disc; the standard error of its tilt \[rad\].
    fn fit_plane(&mut self) -> Option<f64> {
        let Self { centre, up, radius_m, tuning, .. } = *self;
        let inner_m = tuning.disc_radii * radius_m;
        let level_m = |d: &Vector3| (d - up * d.dot(&up)).norm();
        let thick_m = (3.0 * self.noise_m).max(0.3e-3);
        let disc = |p: &&Point3| {
            let d = **p - centre;
            level_m(&d) < inner_m && d.dot(&up).abs() < thick_m
        };
        let (mean, axis, variances) = principal(self.open.iter().filter(disc).copied())?;
        let count = self.open.iter().filter(disc).count() as f64;
        let up = if axis.dot(&up) < 0.0 { -axis } else { axis };
        let centre = centre - up * (centre - mean).dot(&up);
        let inner = self.open.iter().map(|p| p - centre);
        let inner = inner.filter(|d| (d - up * d.dot(&up)).norm() < inner_m);
        let heights = inner.map(|d| d.dot(&up)).filter(|height| height.abs() < 0.2 * radius_m);
        self.noise_m = robust::sigma(&heights.collect::<Vec<f64>>())?;
        (self.centre, self.up) = (centre, up);
        Some(variances[0].sqrt() / (0.4 * radius_m) / count.sqrt())
    }

    /// Where the cloth leaves the plane, per bearing, in the plane's axes.
    fn leaving_edges(&self) -> Vec<[f64; 2]> {
        let ([u, v], Self { centre, up, radius_m, noise_m, .. }) = (self.axes(), self);
        let bearings = self.tuning.bearings;
        // The slope of sqrt(depth) is read between these depths: above the noise,
        // and not so deep that the curvature has changed.
        let depths_m = [(0.02 * radius_m).max(2.5 * noise_m), (0.16 * radius_m).max(5.0 * noise_m)];
        let mut sectors: Vec<Vec<[f64; 2]>> = vec![Vec::new(); bearings];
        for p in self.open.iter().map(|p| Placed::of(p, centre, [&u, up, &v])) {
            let depth_m = -p.height_m;
            if depth_m > depths_m[0] && depth_m < depths_m[1] {
                sectors[p.sector(bearings)].push([p.radius_m(), depth_m.sqrt()]);
            }
        }
        let mut edges = Vec::new();
        for (sector, samples) in sectors.iter().enumerate() {
            if samples.len() < 6 {
                continue;
            }
            // r = edge + slope * sqrt(depth): the radius is the noisy one where the
            // cloth is steep, so it is regressed on the depth.
            let n = samples.len() as f64;
            let mean = |k: usize| samples.iter().map(|s| s[k]).sum::<f64>() / n;
            let (r, q) = (mean(0), mean(1));
            let (sqq, sqr) = samples.iter().fold((0.0, 0.0), |(a, b), s| {
                (a + (s[1] - q) * (s[1] - q), b + (s[1] - q) * (s[0] - r))
            });
            let edge = r - q * (sqr / sqq.max(1e-12)).max(0.0);
            if edge > 0.5 * radius_m && edge < 1.6 * radius_m {
                let angle = (sector as f64 + 0.5) / bearings as f64 * std::f64::consts::TAU;
                edges.push([edge * angle.cos(), edge * angle.sin()]);
            }
        }
        edges
    }

    /// The surface of these powers through the points on the plate, robustly: stiff cloth arches
    /// over the plate, which is not noise.
    fn arch(&self, powers: &[(i32, i32)]) -> Option<Arch> {
        let ([u, v], Self { centre, up, radius_m, tuning, .. }) = (self.axes(), self);
        let terms = powers.len();
        let rows: Vec<(DVector<f64>, f64)> = self
            .open
            .iter()
            .map(|p| (p - centre) / *radius_m)
            .filter(|d| (d - up * d.dot(up)).norm() < tuning.disc_radii && d.dot(up).abs() < 0.2)
            .map(|d| {
                let (x, z) = (d.dot(&u), d.dot(&v));
                let row = DVector::from_fn(terms, |k, _| x.powi(powers[k].0) * z.powi(powers[k].1));
                (row, d.dot(up) * *radius_m)
            })
            .collect();
        let mut found = DVector::zeros(terms);
        let mut scatter_m = f64::INFINITY;
        for _ in 0..3 {
            let mut normal = DMatrix::identity(terms, terms) * 1e-9;
            let mut right = DVector::zeros(terms);
            for (row, height) in &rows {
                let off = (height - row.dot(&found)).abs();
                let weight = (1.5 * scatter_m / off.max(1e-9)).min(1.0);
                normal.syger(weight, row, row, 1.0);
                right.axpy(weight * height, row, 1.0);
            }
            normal.fill_upper_triangle_with_lower_triangle();
            found = normal.cholesky()?.solve(&right);
            let off: Vec<f64> = rows.iter().map(|(row, height)| height - row.dot(&found)).collect();
            scatter_m = robust::sigma(&off)?.max(1e-6);
        }
        let slope = [found[1], found[2]].map(|m| m / radius_m);
        Some(Arch { slope, height_m: found[0], scatter_m })
    }
}

/// A circle through points of a plane \[m\].
struct Circle {
    centre: [f64; 2],
    radius_m: f64,
    /// Robust scatter of the radii.
    scatter_m: f64,
}

/// The circle through points \[m\], robustly; `None` of fewer than `least`.
fn circle_through(points: &[[f64; 2]], least: usize) -> Option<Circle> {
    if points.len() < least {
        return None;
    }
    let mut centre = [0.0, 0.0];
    let mut radius = 0.0;
    let mut scatter = 0.0;
    for _ in 0..30 {
        let polar: Vec<[f64; 2]> = points
            .iter()
            .map(|p| {
                let (x, z) = (p[0] - centre[0], p[1] - centre[1]);
                [x.hypot(z), z.atan2(x)]
            })
            .collect();
        let radii: Vec<f64> = polar.iter().map(|p| p[0]).collect();
        radius = robust::median(radii.clone())?;
        scatter = robust::sigma(&radii)?.max(1e-5);
        // Gauss-Newton on the centre with Huber weights; the radius is the median.
        let mut normal = [[1e-12, 0.0], [0.0, 1e-12]];
        let mut right = [0.0, 0.0];
        for p in &polar {
            let residual = p[0] - radius;
            let weight = (1.5 * scatter / residual.abs().max(1e-9)).min(1.0);
            let direction = [p[1].cos(), p[1].sin()];
            for a in 0..2 {
                right[a] += weight * direction[a] * residual;
                for b in 0..2 {
                    normal[a][b] += weight * direction[a] * direction[b];
                }
            }
        }
        let det = normal[0][0] * normal[1][1] - normal[0][1] * normal[1][0];
        centre[0] += (right[0] * normal[1][1] - right[1] * normal[0][1]) / det;
        centre[1] += (right[1] * normal[0][0] - right[0] * normal[1][0]) / det;
    }
    Some(Circle { centre, radius_m: radius, scatter_m: scatter })
}
