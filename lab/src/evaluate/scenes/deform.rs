//! Drapes made wrong: a fold whose layers touch, and a crease.
//!
//! In: a drape on a square grid of vertices (simulation frame \[m\]), random numbers. Out: the same
//! grid, its vertices moved. Lengths are put right after the fold is pressed together; a crease
//! makes the cloth longer across by 1 to 2 mm, as a real one takes it up.

use rand::RngExt as _;

use super::spread::Lengths;
use scan2params::base::frame::{PLATE_RADIUS_M, SPECIMEN_SIDE_M};
use scan2params::base::{Point3, Vector3, seed};
use scan2params::dataset::drape_file::rim_of;
use scan2params::geom::Mesh;
use scan2params::geom::adjacency::area_vector2;

/// The layers of a pressed fold lie this far from its middle plane \[m\].
const HALF_GAP_M: f64 = 0.3e-3;
/// They touch on the cloth's outer part, from here on along the flat specimen \[m\].
const PRESSED_FROM_M: f64 = 0.095;
/// Least depth of a fold that is pressed: the rim's radius at its crest over that at the valleys
/// \[m\].
const LEAST_DEPTH_M: f64 = 0.012;
const ROUNDS: usize = 200;

/// Where a vertex of a grid lies on the flat specimen (x, z) \[m\].
fn material(k: usize, n: usize) -> [f64; 2] {
    let at = |k: usize| SPECIMEN_SIDE_M * (k as f64 / (n - 1) as f64 - 0.5);
    [at(k / n), at(k % n)]
}

/// Presses one fold together, from the rim 40 mm or more up the cloth; `false` where none is deep
/// enough.
pub(super) fn touching_fold(mesh: &mut Mesh, rng: &mut seed::Rng) -> bool {
    let Some(folds) = rim_of(mesh).map(|rim| folds(&rim.positions_m().collect::<Vec<_>>())) else {
        return false;
    };
    if folds.is_empty() {
        return false;
    }
    let fold = folds[rng.random_range(0..folds.len())];
    let lengths = Lengths::of(mesh);
    let n = mesh.vertices.len().isqrt();
    let frame = fold.frame();
    // The fold's own cloth: what sticks out beyond its valleys, far from the plate.
    let presses = |k: usize, p: &Point3| {
        let [x, z] = material(k, n);
        let (out, aside) = frame.place(p);
        x.hypot(z) > PRESSED_FROM_M
            && out > fold.pressed_from_m()
            && aside.abs() < fold.half_width_m
    };
    let pressed: Vec<bool> = mesh.vertices.iter().enumerate().map(|(k, p)| presses(k, p)).collect();
    let sides: Vec<f64> = mesh.vertices.iter().map(|p| frame.place(p).1.signum()).collect();
    let free = |k: usize| {
        let [x, z] = material(k, n);
        x.hypot(z) > PLATE_RADIUS_M + 5e-3
    };
    for round in 0..ROUNDS {
        // Closed over the first half of the rounds.
        let share = (2.0 * round as f64 / ROUNDS as f64).min(1.0);
        let most = HALF_GAP_M + (1.0 - share) * fold.half_width_m;
        for (k, p) in mesh.vertices.iter_mut().enumerate().filter(|(k, _)| pressed[*k]) {
            let aside = frame.place(p).1;
            let want = sides[k] * (sides[k] * aside).clamp(HALF_GAP_M, most);
            *p += frame.aside * (want - aside);
        }
        lengths.restore(&mut mesh.vertices, |k| f64::from(u8::from(free(k))));
    }
    for (k, p) in mesh.vertices.iter_mut().enumerate().filter(|(k, _)| pressed[*k]) {
        let aside = frame.place(p).1;
        *p += frame.aside * (sides[k] * HALF_GAP_M - aside);
    }
    true
}

/// A fold that sticks out of the rim.
#[derive(Clone, Copy, Debug)]
struct Fold {
    /// Bearing of its crest \[rad\].
    bearing_rad: f64,
    /// Radii of the crest and of the higher valley next to it \[m\].
    radii_m: [f64; 2],
    /// Half the distance of the two valleys \[m\].
    half_width_m: f64,
}

/// The upright plane through a fold's crest and the plate's axis.
struct Frame {
    out: Vector3,
    aside: Vector3,
}

impl Frame {
    /// How far out a point lies, and how far aside.
    fn place(&self, p: &Point3) -> (f64, f64) {
        (p.coords.dot(&self.out), p.coords.dot(&self.aside))
    }
}

impl Fold {
    fn frame(&self) -> Frame {
        let (sin, cos) = self.bearing_rad.sin_cos();
        Frame { out: Vector3::new(cos, 0.0, sin), aside: Vector3::new(-sin, 0.0, cos) }
    }

    /// The fold is pressed together beyond a third of its depth.
    fn pressed_from_m(&self) -> f64 {
        self.radii_m[1] + (self.radii_m[0] - self.radii_m[1]) / 3.0
    }
}

/// The rim's folds that are deep enough, in its order.
fn folds(rim: &[Point3]) -> Vec<Fold> {
    const NEAR: usize = 8;
    let count = rim.len();
    let radius = |k: usize| rim[k % count].x.hypot(rim[k % count].z);
    let extreme = |k: usize, sign: f64| {
        (1..=NEAR).all(|d| {
            let here = sign * radius(k + count);
            here >= sign * radius(k + count + d) && here > sign * radius(k + count - d)
        })
    };
    let valleys: Vec<usize> = (0..count).filter(|&k| extreme(k, -1.0)).collect();
    let crests = (0..count).filter(|&k| extreme(k, 1.0));
    let fold = |k: usize| {
        let after = *valleys.iter().find(|&&v| v > k).or(valleys.first())?;
        let before = *valleys.iter().rev().find(|&&v| v < k).or(valleys.last())?;
        let radii_m = [radius(k), radius(after).max(radius(before))];
        let half_width_m = 0.5 * (rim[after] - rim[before]).norm();
        let bearing_rad = rim[k].z.atan2(rim[k].x);
        let deep = radii_m[0] - radii_m[1] > LEAST_DEPTH_M;
        (deep && after != before).then_some(Fold { bearing_rad, radii_m, half_width_m })
    };
    crests.filter_map(fold).collect()
}

/// A sharp ridge of 2 to 4 mm along a straight line of the hanging cloth, 90 to 140 mm long.
pub(super) fn crease(mesh: &mut Mesh, rng: &mut seed::Rng) {
    const HALF_WIDTH_M: f64 = 6e-3;
    let n = mesh.vertices.len().isqrt();
    let height = rng.random_range(2e-3..4e-3) * if rng.random() { 1.0 } else { -1.0 };
    let half_length = rng.random_range(0.045..0.07);
    let turn = rng.random_range(0.0..std::f64::consts::TAU);
    let away = rng.random_range(0.095..0.115);
    let middle = [away * turn.cos(), away * turn.sin()];
    let along = turn + std::f64::consts::FRAC_PI_2 + rng.random_range(-0.5..0.5);
    let along = [along.cos(), along.sin()];
    let normals = vertex_normals(mesh);
    for (k, p) in mesh.vertices.iter_mut().enumerate() {
        let [x, z] = material(k, n);
        let (dx, dz) = (x - middle[0], z - middle[1]);
        let (on, off) = (dx * along[0] + dz * along[1], dz * along[0] - dx * along[1]);
        let ridge = (1.0 - off.abs() / HALF_WIDTH_M).max(0.0);
        // Full over the middle, flat at its ends.
        let tapered = (4.0 * (1.0 - on.abs() / half_length)).clamp(0.0, 1.0);
        *p += normals[k] * (height * ridge * tapered);
    }
}

fn vertex_normals(mesh: &Mesh) -> Vec<Vector3> {
    let mut sums = vec![Vector3::zeros(); mesh.vertices.len()];
    for (face, corners) in mesh.triangles.iter().enumerate() {
        let own = area_vector2(mesh, face);
        corners.iter().for_each(|v| sums[*v as usize] += own);
    }
    sums.into_iter().map(|n| n.try_normalize(0.0).unwrap_or_else(Vector3::y)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn soft() -> Mesh {
        crate::evaluate::scenes::tests::kept().swap_remove(1).mesh
    }

    #[test]
    fn a_pressed_fold_has_its_layers_on_each_other_and_keeps_its_lengths() {
        let before = soft();
        let mut after = before.clone();
        assert!(touching_fold(&mut after, &mut seed::rng(2, "test", 0)));
        let moved: Vec<usize> = (0..before.vertices.len())
            .filter(|&k| (after.vertices[k] - before.vertices[k]).norm() > 1e-3)
            .collect();
        assert!(moved.len() > 20, "{} vertices moved", moved.len());
        // Points of one layer whose nearest point of the other lies within a millimetre.
        let n = before.vertices.len().isqrt();
        let apart = |a: usize, b: usize| {
            let ([ax, az], [bx, bz]) = (material(a, n), material(b, n));
            (ax - bx).hypot(az - bz)
        };
        let touches = |a: &&usize| {
            moved.iter().any(|&b| {
                apart(**a, b) > 0.02 && (after.vertices[**a] - after.vertices[b]).norm() < 3e-3
            })
        };
        let touching = moved.iter().filter(touches).count();
        assert!(touching > 20, "{touching} of {} vertices touch", moved.len());
        let lengths = Lengths::of(&before);
        let strain = lengths.strain_of(&after.vertices, 0.98);
        assert!(strain < 0.1, "{strain}");
    }

    #[test]
    fn a_crease_moves_the_cloth_by_its_height_and_no_more() {
        let before = soft();
        let mut after = before.clone();
        crease(&mut after, &mut seed::rng(2, "test", 0));
        let moved = before.vertices.iter().zip(&after.vertices).map(|(a, b)| (b - a).norm());
        let moved: Vec<f64> = moved.collect();
        let most = moved.iter().copied().fold(0.0, f64::max);
        assert!((1e-3..4e-3).contains(&most), "{most}");
        let count = moved.iter().filter(|m| **m > 0.0).count();
        assert!((20..300).contains(&count), "{count} vertices");
    }
}
