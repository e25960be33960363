//! The parts of the stand as closed meshes, each as it is printed: standing on a flat face at z =
//! 0, z up.
//!
//! In: a [`Bench`]. Out: solids of revolution \[m\]. The plate is two halves that part where it is
//! widest, so that its rounded edge has no overhang; a spigot of the post aligns them. Vertices lie
//! on the true surface: chords are at most 0.01 mm inside it.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::bench::Bench;
use crate::base::Point3;
use crate::geom::Mesh;

/// Vertices around.
pub const AROUND: usize = 240;
/// Chords along a quarter of the plate's edge.
const ALONG_EDGE: u32 = 16;

/// A part to print.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Name of its file, without ending.
    pub name: &'static str,
    /// How often it is printed.
    pub count: usize,
    /// What it is, and how its faces lie.
    pub what: &'static str,
    /// Closed outline of its half section: distance from the axis and height \[m\],
    /// counter-clockwise.
    pub profile: Vec<[f64; 2]>,
}

impl Part {
    /// The part as a closed mesh.
    #[must_use]
    pub fn mesh(&self) -> Mesh {
        revolved(&self.profile, AROUND)
    }

    /// Largest distance from the axis, and height \[m\].
    #[must_use]
    pub fn extent_m(&self) -> [f64; 2] {
        [0, 1].map(|k| self.profile.iter().map(|p| p[k]).fold(0.0, f64::max))
    }

    /// Its volume \[m^3\], of the true round (Pappus).
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        let next = self.profile.iter().cycle().skip(1);
        let moment = |([r, h], [s, k]): (&[f64; 2], &[f64; 2])| (r * k - s * h) * (r + s) / 6.0;
        TAU * self.profile.iter().zip(next).map(moment).sum::<f64>()
    }
}

/// The parts of a bench.
#[must_use]
pub fn parts(bench: &Bench) -> Vec<Part> {
    let piece =
        |name, count, what, spigot_m| Part { name, count, what, profile: post(bench, spigot_m) };
    let mut parts = vec![
        Part {
            name: "plate-top",
            count: 1,
            what: "upper half of the plate, its face up; printed with the rounded edge up",
            profile: plate_half(bench, true),
        },
        Part {
            name: "plate-bottom",
            count: 1,
            what: "lower half, glued under it; printed with the rounded edge up",
            profile: plate_half(bench, false),
        },
        piece(
            "post-upper",
            1,
            "upper end of the post; its spigot goes through the lower half into the upper one",
            bench.edge_radius_m + 0.9 * bench.blind_m(),
        ),
    ];
    if bench.post_pieces > 1 {
        let more = bench.post_pieces - 1;
        parts.push(piece("post-lower", more, "under it", bench.spigot_m));
    }
    parts.push(Part {
        name: "base",
        count: 1,
        what: "foot; tape it to the table, or put a weight on it that stays below the cloth",
        profile: base(bench),
    });
    parts
}

/// Half of the plate, its parting plane at z = 0: with the blind hole of the upper half, or the
/// hole through the lower.
fn plate_half(bench: &Bench, upper: bool) -> Vec<[f64; 2]> {
    let (hole, edge) = (bench.hole_radius_m, bench.edge_radius_m);
    let mut outline = vec![[hole, 0.0]];
    outline.extend((0..=ALONG_EDGE).map(|k| {
        let (sin, cos) = (FRAC_PI_2 * f64::from(k) / f64::from(ALONG_EDGE)).sin_cos();
        // The last cosine is 6e-17.
        let cos = if k == ALONG_EDGE { 0.0 } else { cos };
        [bench.plate_radius_m - edge + edge * cos, edge * sin]
    }));
    if upper {
        outline.extend([[0.0, edge], [0.0, bench.blind_m()], [hole, bench.blind_m()]]);
    } else {
        outline.push([hole, edge]);
    }
    outline
}

/// A piece of the post: a socket below, whose roof is a cone that prints without supports, a spigot
/// above.
fn post(bench: &Bench, spigot_m: f64) -> Vec<[f64; 2]> {
    let (hole, socket) = (bench.hole_radius_m, bench.socket_m);
    let (radius, length, spigot) = (bench.post_radius_m, bench.post_piece_m, bench.spigot_radius_m);
    vec![
        [hole, 0.0],
        [radius, 0.0],
        [radius, length],
        [spigot, length],
        [spigot, length + spigot_m],
        [0.0, length + spigot_m],
        [0.0, socket + hole],
        [hole, socket],
    ]
}

/// The foot with the spigot that carries the post.
fn base(bench: &Bench) -> Vec<[f64; 2]> {
    let (radius, high, spigot) = (bench.base_radius_m, bench.base_m, bench.spigot_radius_m);
    let top = high + bench.spigot_m;
    vec![[0.0, 0.0], [radius, 0.0], [radius, high], [spigot, high], [spigot, top], [0.0, top]]
}

/// A closed outline in the half plane (distance from the axis, height), counter-clockwise, turned
/// about the z axis.
fn revolved(profile: &[[f64; 2]], around: usize) -> Mesh {
    let mut mesh = Mesh::default();
    let mut rings: Vec<Vec<u32>> = Vec::with_capacity(profile.len());
    for &[radius, height] in profile {
        let first = u32::try_from(mesh.vertices.len()).unwrap_or(u32::MAX);
        if radius == 0.0 {
            mesh.vertices.push(Point3::new(0.0, 0.0, height));
            rings.push(vec![first; around]);
            continue;
        }
        let place = |k: usize| {
            let (sin, cos) = (TAU * k as f64 / around as f64).sin_cos();
            Point3::new(radius * cos, radius * sin, height)
        };
        mesh.vertices.extend((0..around).map(place));
        rings.push((first..).take(around).collect());
    }
    for (a, &[from, _]) in profile.iter().enumerate() {
        let b = (a + 1) % profile.len();
        let to = profile[b][0];
        for k in 0..around {
            let next = (k + 1) % around;
            if to != 0.0 {
                mesh.triangles.push([rings[a][k], rings[b][next], rings[b][k]]);
            }
            if from != 0.0 {
                mesh.triangles.push([rings[a][k], rings[a][next], rings[b][next]]);
            }
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::super::bench::Kind;
    use super::*;

    /// Volume of a closed mesh, positive if its triangles face outwards.
    fn volume(mesh: &Mesh) -> f64 {
        let corner = |v: u32| mesh.vertices[v as usize].coords;
        let signed = |[a, b, c]: &[u32; 3]| corner(*a).dot(&corner(*b).cross(&corner(*c))) / 6.0;
        mesh.triangles.iter().map(signed).sum()
    }

    #[test]
    fn a_cylinder_and_a_ring_have_their_volumes_and_face_outwards() {
        let polygon = AROUND as f64 / TAU * (TAU / AROUND as f64).sin();
        for (profile, truth) in [
            (vec![[0.0, 0.0], [2.0, 0.0], [2.0, 3.0], [0.0, 3.0]], TAU / 2.0 * 4.0 * 3.0),
            (vec![[1.0, 0.0], [2.0, 0.0], [2.0, 3.0], [1.0, 3.0]], TAU / 2.0 * 3.0 * 3.0),
        ] {
            let found = volume(&revolved(&profile, AROUND));
            assert!((found / (truth * polygon) - 1.0).abs() < 1e-12, "{found} of {truth}");
            let part = Part { name: "", count: 1, what: "", profile };
            assert!((part.volume_m3() / truth - 1.0).abs() < 1e-12);
        }
    }

    /// A disc with a half torus around it, less what the spigot takes: in closed form.
    #[test]
    fn the_plate_is_the_simulator_s() {
        for kind in [Kind::Square, Kind::Cusick] {
            let bench = Bench::of(kind);
            let parts = parts(&bench);
            let (radius, edge) = (bench.plate_radius_m, bench.edge_radius_m);
            let pi = TAU / 2.0;
            let half_circle = 0.5 * pi * edge * edge;
            let centroid = radius - edge + 4.0 * edge / (3.0 * pi);
            let whole = pi * (radius - edge).powi(2) * 2.0 * edge + TAU * half_circle * centroid;
            let holes = pi * bench.hole_radius_m.powi(2) * (edge + bench.blind_m());
            let printed = volume(&parts[0].mesh()) + volume(&parts[1].mesh());
            // chords: 1.1e-4 around, less along the edge
            assert!((printed / (whole - holes) - 1.0).abs() < 3e-4, "{printed} {whole}");
            // every vertex of the edge lies on the simulator's round edge
            for [r, h] in &parts[0].profile[1..=ALONG_EDGE as usize + 1] {
                assert!(((r - (radius - edge)).hypot(*h) - edge).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn spigots_fit_their_holes() {
        let bench = Bench::of(Kind::Square);
        let through = parts(&bench)[2].extent_m()[1] - bench.post_piece_m;
        assert!(through > bench.edge_radius_m && through < bench.edge_radius_m + bench.blind_m());
        assert!(bench.spigot_m < bench.socket_m && bench.spigot_radius_m < bench.hole_radius_m);
        // walls stay: the cone of the socket ends far below the spigot
        assert!(bench.socket_m + bench.hole_radius_m < 0.2 * bench.post_piece_m);
        assert!(bench.blind_m() < bench.edge_radius_m);
    }
}
