//! Cloth that lies over something else than a plate, and lengths put right after a deformation.
//!
//! In: what is under the cloth. Out: a sheet of 61 x 61 vertices, simulation frame \[m\], at rest
//! on it. Points with lengths between them (Mueller et al., "Position based dynamics", 2007): no
//! fabric's drape, and good enough for a scene that must be refused.

use scan2params::base::frame::SPECIMEN_SIDE_M;
use scan2params::base::{Point3, Vector3};
use scan2params::geom::Mesh;
use scan2params::sensor::Solid;

/// What is under the cloth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Under {
    /// A box of these sides \[m\].
    Box([f64; 3]),
    /// A ball of this radius \[m\].
    Ball(f64),
    /// The floor alone.
    Floor,
}

const VERTICES: usize = 61;
/// The cloth lies this far off what it lies on \[m\].
const GAP_M: f64 = 1e-3;
const STEPS: usize = 400;
const STEP_S: f64 = 1.0 / 240.0;
const ITERATIONS: usize = 20;

/// The sheet, the solid that it lies on, and the floor's height \[m\].
pub(super) fn spread_over(under: Under) -> (Mesh, Option<Solid>, f64) {
    let (solid, floor_y) = match under {
        Under::Box(sides) => {
            (Some(Solid::standing_block([0.0; 2], -sides[1], sides, 0.0)), -sides[1])
        }
        Under::Ball(radius) => {
            let middle = Point3::new(0.0, -radius, 0.0);
            (Some(Solid::Capsule { ends: [middle; 2], radius }), -2.0 * radius)
        }
        Under::Floor => (None, 0.0),
    };
    let mut mesh = flat(GAP_M);
    if let Some(solid) = &solid {
        fall(&mut mesh, solid, floor_y);
    }
    // Rays tell the cloth from the floor where both are as far apart as a cloth is thick.
    (mesh, solid, floor_y - GAP_M)
}

/// The flat specimen at a height.
fn flat(y: f64) -> Mesh {
    let at = |k: usize| SPECIMEN_SIDE_M * (k as f64 / (VERTICES - 1) as f64 - 0.5);
    let vertex = |k: usize| Point3::new(at(k / VERTICES), y, at(k % VERTICES));
    let cell = |k: usize| {
        let corner = k / (VERTICES - 1) * VERTICES + k % (VERTICES - 1);
        let [a, b, c, d] = [0, 1, VERTICES, VERTICES + 1].map(|step| (corner + step) as u32);
        [[a, b, c], [b, d, c]]
    };
    let cells = (VERTICES - 1) * (VERTICES - 1);
    Mesh {
        vertices: (0..VERTICES * VERTICES).map(vertex).collect(),
        triangles: (0..cells).flat_map(cell).collect(),
    }
}

/// Lengths between vertices that share a triangle.
pub(super) struct Lengths(Vec<(usize, usize, f64)>);

impl Lengths {
    /// Of a sheet as it is.
    pub(super) fn of(mesh: &Mesh) -> Self {
        let mut pairs: Vec<(usize, usize)> = mesh
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .map(|(a, b)| (a.min(b) as usize, a.max(b) as usize))
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        let length = |(a, b): (usize, usize)| (a, b, (mesh.vertices[a] - mesh.vertices[b]).norm());
        Self(pairs.into_iter().map(length).collect())
    }

    /// Of a flat square grid along its threads alone: the cells may shear.
    fn along_threads(mesh: &Mesh) -> Self {
        let cell_m = SPECIMEN_SIDE_M / (VERTICES - 1) as f64;
        let mut all = Self::of(mesh);
        all.0.retain(|(_, _, length)| *length < 1.1 * cell_m);
        all
    }

    /// Moves the vertices once towards these lengths; those of no weight stay.
    pub(super) fn restore(&self, vertices: &mut [Point3], weight: impl Fn(usize) -> f64) {
        for &(a, b, length) in &self.0 {
            let (wa, wb) = (weight(a), weight(b));
            let between = vertices[b] - vertices[a];
            let now = between.norm();
            if wa + wb == 0.0 || now == 0.0 {
                continue;
            }
            let pull = between * ((now - length) / now / (wa + wb));
            vertices[a] += pull * wa;
            vertices[b] -= pull * wb;
        }
    }

    /// The relative change that this share of the lengths does not exceed.
    #[cfg(test)]
    pub(super) fn strain_of(&self, vertices: &[Point3], share: f64) -> f64 {
        let strain = |&(a, b, length): &(usize, usize, f64)| {
            ((vertices[a] - vertices[b]).norm() / length - 1.0).abs()
        };
        let strains = self.0.iter().map(strain).collect();
        scan2params::numeric::robust::quantile(strains, share).unwrap_or(f64::NAN)
    }
}

/// Lets the sheet fall onto the solid and the floor, with friction.
fn fall(mesh: &mut Mesh, solid: &Solid, floor_y: f64) {
    const DAMPED: f64 = 0.97;
    const RUBBED: f64 = 0.5;
    let lengths = Lengths::along_threads(mesh);
    let mut before = mesh.vertices.clone();
    for _ in 0..STEPS {
        let start = mesh.vertices.clone();
        for (now, old) in mesh.vertices.iter_mut().zip(&before) {
            *now += (*now - old) * DAMPED - Vector3::y() * (9.81 * STEP_S * STEP_S);
        }
        let mut touches = vec![false; mesh.vertices.len()];
        for _ in 0..ITERATIONS {
            lengths.restore(&mut mesh.vertices, |_| 1.0);
            for (now, touches) in mesh.vertices.iter_mut().zip(&mut touches) {
                *touches |= keep_out(now, solid, floor_y);
            }
        }
        // Friction once a step: more often, it would hold against the lengths.
        let moved = mesh.vertices.iter_mut().zip(&start).zip(touches);
        for ((now, old), _) in moved.filter(|(_, touches)| *touches) {
            *now += Vector3::new(old.x - now.x, 0.0, old.z - now.z) * RUBBED;
        }
        before = start;
    }
    // Without the weight the lengths come right; the last word is the contact's.
    for _ in 0..STEPS {
        lengths.restore(&mut mesh.vertices, |_| 1.0);
        for now in &mut mesh.vertices {
            keep_out(now, solid, floor_y);
        }
    }
}

/// Moves a vertex out of the solid and the floor; whether it was in one.
fn keep_out(now: &mut Point3, solid: &Solid, floor_y: f64) -> bool {
    let inside = GAP_M - solid.distance_m(now);
    if inside > 0.0 {
        *now += outward(solid, now) * inside;
    }
    let sunk = now.y < floor_y + GAP_M;
    now.y = now.y.max(floor_y + GAP_M);
    inside > 0.0 || sunk
}

/// The direction in which the distance from a solid grows.
fn outward(solid: &Solid, at: &Point3) -> Vector3 {
    const STEP_M: f64 = 1e-5;
    let slope = |step: Vector3| solid.distance_m(&(at + step)) - solid.distance_m(&(at - step));
    let along = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| slope(axis * STEP_M));
    Vector3::from(along).try_normalize(0.0).unwrap_or_else(Vector3::y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cloth_over_a_box_and_a_ball_hangs_down_and_lies_outside_of_them() {
        for under in [Under::Box([0.12, 0.1, 0.1]), Under::Ball(0.06)] {
            let (mesh, solid, floor_y) = spread_over(under);
            let solid = solid.unwrap();
            let deepest = mesh.vertices.iter().map(|p| solid.distance_m(p)).fold(1.0, f64::min);
            assert!(deepest > 0.5e-3, "{under:?}: {deepest}");
            let lowest = mesh.vertices.iter().map(|p| p.y).fold(1.0, f64::min);
            assert!(lowest < -0.05 && lowest > floor_y, "{under:?}: {lowest}");
            let strain = Lengths::along_threads(&flat(0.0)).strain_of(&mesh.vertices, 0.95);
            assert!(strain < 0.15, "{under:?}: {strain}");
        }
    }
}
