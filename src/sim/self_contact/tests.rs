//! What self-contact promises, checked against brute force, finite
//! differences and an independent intersection count.

use super::barrier::{self, Pair};
use super::distance::{PairKind, closest, hessian_distance_sq};
use super::elements::{MOLLIFIER_SIN_SQ, REST_FACTOR, WEIGHT_AREA_M2};
use super::*;
use nalgebra::{Rotation3, SVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeSet;

const GAP_M: f64 = 1e-3;

fn v(x: f64, y: f64, z: f64) -> Vector3 {
    Vector3::new(x, y, z)
}

fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

fn noise(rng: &mut ChaCha8Rng, size: f64) -> Vector3 {
    v(rng.random_range(-size..size), rng.random_range(-size..size), rng.random_range(-size..size))
}

/// Flat sheet of `n x n` vertices; its diagonals alternate if asked for.
fn sheet(n: usize, cell_m: f64, alternate: bool) -> (Vec<[u32; 3]>, Vec<Vector3>) {
    let x = (0..n * n).map(|k| v((k % n) as f64 * cell_m, (k / n) as f64 * cell_m, 0.0)).collect();
    let mut triangles = Vec::new();
    for j in 0..n - 1 {
        for i in 0..n - 1 {
            let a = (j * n + i) as u32;
            let (b, c, d) = (a + 1, a + n as u32 + 1, a + n as u32);
            if alternate && (i + j) % 2 == 1 {
                triangles.extend([[a, b, d], [b, c, d]]);
            } else {
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    (triangles, x)
}

/// `n x n` vertices below, `m x m` rotated, shifted and lifted above.
fn two_sheets(n: usize, m: usize, shift: Vector3, angle: f64) -> (Vec<[u32; 3]>, Vec<Vector3>) {
    let (mut triangles, mut x) = sheet(n, 5e-3, false);
    let (upper, flat) = sheet(m, 5e-3, false);
    triangles.extend(upper.iter().map(|t| t.map(|i| i + (n * n) as u32)));
    let rotation = Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
    x.extend(flat.iter().map(|p| rotation * p + shift));
    (triangles, x)
}

/// Random smooth crumpling: free of intersections because every step is cut by
/// `max_step`.
fn crumpled(n: usize, seed: u64, steps: usize) -> (Vec<[u32; 3]>, Vec<Vector3>, SelfContact) {
    let (triangles, rest) = sheet(n, 5e-3, false);
    let mut contact = SelfContact::new(&triangles, &rest, SelfContactParams::default());
    let mut x = rest;
    let mut rng = rng(seed);
    for p in &mut x {
        *p += noise(&mut rng, 1e-3);
    }
    for _ in 0..steps {
        let centre = x.iter().sum::<Vector3>() / x.len() as f64;
        let (wave, phase) = (noise(&mut rng, 400.0), rng.random_range(0.0..6.0));
        let push = noise(&mut rng, 0.01);
        let dx: Vec<_> = x
            .iter()
            .map(|p| {
                (centre - p) * 0.2 + push * (wave.dot(p) + phase).sin() + noise(&mut rng, 3e-4)
            })
            .collect();
        contact.update_along(&x, &dx);
        let t = contact.max_step(&x, &dx);
        assert!(t > 0.0);
        for (p, d) in x.iter_mut().zip(&dx) {
            *p += d * t;
        }
    }
    (triangles, x, contact)
}

fn pair_of(kind: PairKind) -> Pair {
    let mollify_below_m4 = match kind {
        PairKind::PointTriangle => 0.0,
        PairKind::EdgeEdge => MOLLIFIER_SIN_SQ * 5e-3_f64.powi(4),
    };
    Pair { kind, vertices: [0, 1, 2, 3], stiffness_n_m: 0.1, mollify_below_m4 }
}

/// One configuration in every distance type, about half a gap apart, then the
/// case boundaries, then nearly parallel edges.
fn typed_configurations() -> Vec<(&'static str, PairKind, [Vector3; 4])> {
    use PairKind::{EdgeEdge, PointTriangle};
    let h = 0.45e-3;
    let (a, b, c) = (v(0.0, 0.0, 0.0), v(5e-3, 0.0, 0.2e-3), v(0.3e-3, 5e-3, 0.0));
    let point = |x: f64, y: f64, z: f64| [v(x, y, z), a, b, c];
    let crossing = |s: f64, t: f64, angle: f64| {
        let dir = v(angle.cos(), angle.sin(), 0.03) * 5e-3;
        let at = v(5e-3 * s, 0.0, 0.0);
        [
            v(0.0, 0.0, 0.0),
            v(5e-3, 0.0, 0.0),
            at + v(0.0, 0.0, h) - dir * t,
            at + v(0.0, 0.0, h) + dir * (1.0 - t),
        ]
    };
    let apart = |r: Vector3, dir: Vector3| [v(0.0, 0.0, 0.0), v(5e-3, 0.0, 0.0), r, r + dir];
    vec![
        ("face", PointTriangle, point(1.5e-3, 1.2e-3, h)),
        ("side ab", PointTriangle, point(2.0e-3, -0.3e-3, h)),
        ("side bc", PointTriangle, point(2.9e-3, 2.7e-3, h)),
        ("side ca", PointTriangle, point(-0.2e-3, 2.0e-3, h)),
        ("corner a", PointTriangle, point(-0.3e-3, -0.3e-3, h)),
        ("corner b", PointTriangle, point(5.3e-3, -0.2e-3, 0.4e-3)),
        ("corner c", PointTriangle, point(0.3e-3, 5.4e-3, 0.3e-3)),
        ("face | side", PointTriangle, point(2.0e-3, 0.0, h)),
        ("side | corner", PointTriangle, point(0.0, -0.3e-3, h)),
        ("face | corner", PointTriangle, point(0.0, 0.0, h)),
        ("edges cross", EdgeEdge, crossing(0.4, 0.6, 1.1)),
        ("edges cross at 6 deg", EdgeEdge, crossing(0.4, 0.6, 0.1)),
        ("mollified 1 deg", EdgeEdge, crossing(0.4, 0.6, 0.018)),
        ("mollified 1 deg, low", EdgeEdge, crossing(0.5, 0.3, -0.012)),
        ("cross | end", EdgeEdge, crossing(0.4, 0.0, 1.1)),
        ("end on edge", EdgeEdge, apart(v(2e-3, 0.3e-3, 0.4e-3), v(1e-3, 4e-3, 2e-3))),
        ("edge on end", EdgeEdge, apart(v(5.3e-3, -2e-3, 0.4e-3), v(0.1e-3, 4e-3, 0.1e-3))),
        ("end on end", EdgeEdge, apart(v(5.3e-3, 0.2e-3, 0.4e-3), v(4e-3, 1e-3, 2e-3))),
        (
            "end on end, mollified",
            EdgeEdge,
            apart(v(5.3e-3, 0.2e-3, 0.4e-3), v(5e-3, 0.0, 0.05e-3)),
        ),
        (
            "end on end, other way",
            EdgeEdge,
            apart(v(-4.3e-3, -2.0e-3, 0.4e-3), v(4e-3, 2.2e-3, 0.0)),
        ),
    ]
}

fn shifted(x: &[Vector3; 4], dof: usize, by: f64) -> [Vector3; 4] {
    let mut x = *x;
    x[dof / 3][dof % 3] += by;
    x
}

fn flat(parts: [Vector3; 4]) -> SVector<f64, 12> {
    SVector::from_fn(|row, _| parts[row / 3][row % 3])
}

/// Central differences, relative to the largest force: observed 1e-10 to 4e-10,
/// 7e-9 where the mollifier acts, no worse across case boundaries. A planted
/// sign on one corner that carries force scores 1.2 to 2.
#[test]
fn gradient_matches_differences_in_every_distance_type() {
    for (name, kind, x) in typed_configurations() {
        let pair = pair_of(kind);
        let (_, parts) = barrier::gradient(&pair, &x, GAP_M).expect(name);
        let analytic = flat(parts);
        let h = 1e-8;
        let differences = SVector::<f64, 12>::from_fn(|dof, _| {
            let up = barrier::energy_j(&pair, &shifted(&x, dof, h), GAP_M);
            let down = barrier::energy_j(&pair, &shifted(&x, dof, -h), GAP_M);
            (up - down) / (2.0 * h)
        });
        let worst = (analytic - differences).amax() / analytic.amax();
        assert!(worst < 3e-8, "{name}: {worst:e}");
    }
}

/// The exact Hessian, away from case boundaries. Observed up to 7e-9.
#[test]
fn exact_hessian_matches_differences_and_projection_is_semidefinite() {
    for (name, kind, x) in typed_configurations() {
        let pair = pair_of(kind);
        let exact = barrier::hessian(&pair, &x, GAP_M, HessianForm::Exact).expect(name);
        assert!((exact - exact.transpose()).amax() < 1e-12 * exact.amax(), "{name}: symmetry");
        if !name.contains('|') {
            let h = 1e-9;
            for dof in 0..12 {
                let force = |by: f64| {
                    flat(barrier::gradient(&pair, &shifted(&x, dof, by), GAP_M).expect(name).1)
                };
                let column = (force(h) - force(-h)) / (2.0 * h);
                let worst = (exact.column(dof) - column).amax() / exact.amax();
                assert!(worst < 1e-7, "{name}, column {dof}: {worst:e}");
            }
        }
        let projected = barrier::hessian(&pair, &x, GAP_M, HessianForm::Projected).expect(name);
        let least = projected.symmetric_eigenvalues().min();
        assert!(least > -1e-12 * projected.amax(), "{name}: {least:e}");
        // It keeps what matters: stiffness along the gradient.
        let (_, g) = barrier::gradient(&pair, &x, GAP_M).expect(name);
        let g = flat(g).normalize();
        let (kept, full) = (g.dot(&(projected * g)), g.dot(&(exact * g)));
        assert!(kept > 0.8 * full, "{name}: {kept} of {full}");
    }
}

/// Squared distance against a fine search over both elements, and its Hessian
/// on random corners (all types occur).
#[test]
fn distances_are_minima_and_case_changes_are_continuous() {
    let mut rng = rng(3);
    let mut types = BTreeSet::new();
    for trial in 0..400 {
        let kind = if trial % 2 == 0 { PairKind::PointTriangle } else { PairKind::EdgeEdge };
        let x: [Vector3; 4] = std::array::from_fn(|_| noise(&mut rng, 1.0));
        let at = closest(kind, &x);
        types.insert((kind, at.weights.map(|w| w != 0.0)));
        let rebuilt: Vector3 = (0..4).map(|i| x[i] * at.weights[i]).sum();
        assert!((rebuilt - at.separation).norm() < 1e-12);
        let n = 60;
        let mut best = f64::INFINITY;
        for i in 0..=n {
            for j in 0..=n {
                let (s, t) = (i as f64 / n as f64, j as f64 / n as f64);
                let r = match kind {
                    PairKind::PointTriangle if i + j <= n => {
                        x[0] - x[1] * (1.0 - s - t) - x[2] * s - x[3] * t
                    }
                    PairKind::PointTriangle => continue,
                    PairKind::EdgeEdge => x[0] * (1.0 - s) + x[1] * s - x[2] * (1.0 - t) - x[3] * t,
                };
                best = best.min(r.norm());
            }
        }
        let distance = at.distance_sq.sqrt();
        assert!(distance <= best + 1e-12 && best - distance < 0.1, "{distance} {best}");
        let (hessian, h) = (hessian_distance_sq(kind, &x, &at), 1e-6);
        for dof in 0..12 {
            let gradient = |by: f64| {
                let moved = closest(kind, &shifted(&x, dof, by));
                flat(moved.weights.map(|w| moved.separation * (2.0 * w)))
            };
            let change = (gradient(h) - gradient(-h)) / (2.0 * h);
            let scale = hessian.amax();
            assert!((hessian.column(dof) - change).amax() < 1e-4 * scale, "trial {trial}");
        }
    }
    assert!(types.len() >= 7 + 7, "{types:?}"); // 7 point-triangle types, 9 edge-edge
}

#[test]
fn energy_and_forces_do_not_see_a_rigid_motion() {
    let rotation = Rotation3::from_euler_angles(0.4, -1.1, 2.0);
    let shift = v(0.3, -0.2, 0.7);
    for (name, kind, x) in typed_configurations() {
        if name.contains('|') {
            continue;
        }
        let pair = pair_of(kind);
        let (e0, g0) = barrier::gradient(&pair, &x, GAP_M).expect(name);
        let (e1, g1) =
            barrier::gradient(&pair, &x.map(|p| rotation * p + shift), GAP_M).expect(name);
        assert!((e0 - e1).abs() < 1e-10 * e0, "{name}");
        let scale = flat(g0).amax();
        for i in 0..4 {
            assert!((rotation * g0[i] - g1[i]).norm() < 1e-9 * scale, "{name}");
        }
        let torque: Vector3 = (0..4).map(|i| x[i].cross(&g0[i])).sum();
        assert!(g0.iter().sum::<Vector3>().norm() < 1e-12 * scale, "{name}: net force");
        assert!(torque.norm() < 1e-12 * scale, "{name}: net torque {torque}");
    }
}

/// The jump of the force when two facing edges pass through parallel, as a
/// fraction of the force: 0 with the mollifier, of order 1 without.
#[test]
fn parallel_edges_need_the_mollifier() {
    let edges = |angle: f64| {
        let half = v(angle.cos(), angle.sin(), 0.0) * 2.5e-3;
        let up = v(0.0, 0.0, 0.5e-3);
        [
            v(-2.5e-3, 0.0, 0.0),
            v(2.5e-3, 0.0, 0.0),
            up - half + v(0.5e-3, 2e-8, 0.0),
            up + half + v(0.5e-3, 2e-8, 0.0),
        ]
    };
    let jump = |pair: &Pair| {
        let force =
            |angle: f64| flat(barrier::gradient(pair, &edges(angle), GAP_M).expect("near").1);
        let (left, right) = (force(-3e-5), force(3e-5));
        (left - right).amax()
            / flat(barrier::gradient(&pair_of_plain(), &edges(3e-5), GAP_M).expect("near").1).amax()
    };
    let with = jump(&pair_of(PairKind::EdgeEdge));
    let without = jump(&pair_of_plain());
    assert!(with < 0.02, "{with}");
    assert!(without > 0.1, "{without}");
}

fn pair_of_plain() -> Pair {
    Pair { mollify_below_m4: 0.0, ..pair_of(PairKind::EdgeEdge) }
}

#[test]
fn a_flat_sheet_has_no_contact() {
    for (n, cell_m) in [(61, 5e-3), (121, 2.5e-3), (31, 10e-3)] {
        for alternate in [false, true] {
            let (triangles, x) = sheet(n, cell_m, alternate);
            let mut contact = SelfContact::new(&triangles, &x, SelfContactParams::default());
            contact.update(&x, 0.5e-3);
            assert_eq!((contact.pair_count(), contact.energy_j(&x)), (0, 0.0), "{n} {cell_m}");
            assert_eq!(contact.min_distance_m(&x), f64::INFINITY);
            assert_eq!(count_intersections(&triangles, &x), 0);
            let down = vec![v(0.0, 0.0, -0.1); x.len()];
            contact.update_along(&x, &down);
            assert_eq!(contact.pair_count(), 0, "a fall is no relative motion");
            assert_eq!(contact.max_step(&x, &down), 1.0);
        }
    }
}

type Key = (PairKind, [u32; 4]);

fn key(kind: PairKind, vertices: [u32; 4]) -> Key {
    let [a, b, c, d] = vertices;
    match kind {
        PairKind::PointTriangle => {
            let mut t = [b, c, d];
            t.sort();
            (kind, [a, t[0], t[1], t[2]])
        }
        PairKind::EdgeEdge => {
            let (e, f) = ([a.min(b), a.max(b)], [c.min(d), c.max(d)]);
            let (e, f) = (e.min(f), e.max(f));
            (kind, [e[0], e[1], f[0], f[1]])
        }
    }
}

/// All pairs without a common vertex, straight from the triangles.
fn every_pair(triangles: &[[u32; 3]]) -> BTreeSet<Key> {
    let mut edges = BTreeSet::new();
    let mut points = BTreeSet::new();
    for t in triangles {
        for i in 0..3 {
            edges.insert([t[i].min(t[(i + 1) % 3]), t[i].max(t[(i + 1) % 3])]);
            points.insert(t[i]);
        }
    }
    let mut pairs = BTreeSet::new();
    for e in &edges {
        for f in edges.range(*e..).filter(|f| !f.contains(&e[0]) && !f.contains(&e[1])) {
            pairs.insert(key(PairKind::EdgeEdge, [e[0], e[1], f[0], f[1]]));
        }
    }
    for t in triangles {
        for p in points.iter().filter(|p| !t.contains(p)) {
            pairs.insert(key(PairKind::PointTriangle, [*p, t[0], t[1], t[2]]));
        }
    }
    pairs
}

#[test]
fn the_cache_holds_exactly_the_pairs_of_a_brute_force_search() {
    for seed in 0..4 {
        let (triangles, x, mut contact) = crumpled(11, seed, 12);
        let all = every_pair(&triangles);
        let distance = |(kind, vertices): &Key| {
            closest(*kind, &vertices.map(|i| x[i as usize])).distance_sq.sqrt()
        };
        for reach_m in [0.0, 0.4e-3, 3e-3, 20e-3] {
            contact.update(&x, reach_m);
            let cached: Vec<_> =
                contact.found.pairs.iter().map(|p| key(p.kind, p.vertices)).collect();
            let expected: BTreeSet<_> =
                all.iter().filter(|k| distance(k) < GAP_M + reach_m).copied().collect();
            assert_eq!(cached.len(), expected.len(), "each once; seed {seed}, reach {reach_m}");
            assert_eq!(cached.into_iter().collect::<BTreeSet<_>>(), expected);
            assert!(expected.len() > 20, "a test needs contacts: {}", expected.len());
        }
        // Along a step: all that comes within the gap at any time is there.
        let mut rng = rng(seed + 50);
        let dx: Vec<_> =
            x.iter().map(|p| noise(&mut rng, 4e-3) - p * 0.3 + v(0.0, 0.0, 0.2)).collect();
        contact.update_along(&x, &dx);
        let cached: BTreeSet<_> =
            contact.found.pairs.iter().map(|p| key(p.kind, p.vertices)).collect();
        let mut needed = 0;
        for k in &all {
            let nearest_m = (0..=20)
                .map(|i| {
                    closest(k.0, &k.1.map(|j| x[j as usize] + dx[j as usize] * (i as f64 / 20.0)))
                        .distance_sq
                        .sqrt()
                })
                .fold(f64::INFINITY, f64::min);
            if nearest_m < GAP_M {
                needed += 1;
                assert!(cached.contains(k), "missed {k:?} at {nearest_m}");
            }
        }
        assert!(needed > 50);
    }
}

/// Holes, uneven cells, sheets above each other at rest: the patches then tell
/// little, and nothing may be lost. The second mesh is uneven inside a square, so
/// that a block of it is convex although its triangles leave their cells.
#[test]
fn no_pair_is_lost_on_an_irregular_mesh() {
    let mut rng = rng(21);
    let (mut triangles, mut rest) = two_sheets(9, 7, v(4e-3, 3e-3, 6e-3), 0.4);
    triangles.retain(|t| !t.contains(&30) && !t.contains(&51));
    triangles.swap(0, 5);
    rest.iter_mut().for_each(|p| *p += noise(&mut rng, 0.8e-3).component_mul(&v(1.0, 1.0, 0.0)));
    no_pair_is_lost(&triangles, &rest, &mut rng);
    for _ in 0..4 {
        let (triangles, mut rest) = sheet(5, 5e-3, true);
        for p in &mut rest {
            if p.x > 1e-3 && p.x < 19e-3 && p.y > 1e-3 && p.y < 19e-3 {
                *p += noise(&mut rng, 1.6e-3).component_mul(&v(1.0, 1.0, 0.0));
            }
        }
        no_pair_is_lost(&triangles, &rest, &mut rng);
    }
}

fn no_pair_is_lost(triangles: &[[u32; 3]], rest: &[Vector3], rng: &mut ChaCha8Rng) {
    let mut contact = SelfContact::new(triangles, rest, SelfContactParams::default());
    let all = every_pair(triangles);
    let at_rest = |k: &Key| closest(k.0, &k.1.map(|i| rest[i as usize])).distance_sq.sqrt();
    for radius_m in [4e-3, 12e-3, 0.5] {
        // rolled up around an axis askew to the mesh
        let rolled = |p: &Vector3, rotation: f64| {
            let (along, across) = (p.x + 0.5 * p.y, p.y - 0.5 * p.x);
            let (sin, cos) = (along / radius_m + rotation).sin_cos();
            v((radius_m + p.z + 0.05 * along) * sin, across, (radius_m + p.z + 0.05 * along) * cos)
        };
        let x: Vec<_> = rest.iter().map(|p| rolled(p, 0.0)).collect();
        let distance = |k: &Key| closest(k.0, &k.1.map(|i| x[i as usize])).distance_sq.sqrt();
        for reach_m in [0.0, 2e-3, 6e-3] {
            contact.update(&x, reach_m);
            let cached: Vec<_> =
                contact.found.pairs.iter().map(|p| key(p.kind, p.vertices)).collect();
            let expected: BTreeSet<_> = all
                .iter()
                .filter(|k| distance(k) < GAP_M + reach_m && at_rest(k) >= REST_FACTOR * GAP_M)
                .copied()
                .collect();
            assert_eq!(cached.len(), expected.len(), "radius {radius_m}, reach {reach_m}");
            assert_eq!(cached.into_iter().collect::<BTreeSet<_>>(), expected);
        }
        // a rotation by half a radian with noise
        let dx: Vec<_> =
            rest.iter().zip(&x).map(|(p, x)| rolled(p, 0.5) - x + noise(rng, 2e-3)).collect();
        contact.update_along(&x, &dx);
        let cached: BTreeSet<_> =
            contact.found.pairs.iter().map(|p| key(p.kind, p.vertices)).collect();
        for k in all.iter().filter(|k| at_rest(k) >= REST_FACTOR * GAP_M) {
            let nearest_m = (0..=20)
                .map(|i| {
                    let at = |j: u32| x[j as usize] + dx[j as usize] * (f64::from(i) / 20.0);
                    closest(k.0, &k.1.map(at)).distance_sq.sqrt()
                })
                .fold(f64::INFINITY, f64::min);
            assert!(nearest_m >= GAP_M || cached.contains(k), "missed {k:?} at {nearest_m}");
        }
    }
}

/// The energy and gradient of the cache against all pairs, after moving as
/// far as the cache covers.
#[test]
fn energy_stays_complete_while_the_cache_covers_the_motion() {
    let (triangles, mut x, mut contact) = crumpled(11, 7, 12);
    contact.update(&x, 2e-3);
    let mut rng = rng(8);
    for p in &mut x {
        *p += noise(&mut rng, 1.0).normalize() * 1e-4;
    }
    let mut expected = 0.0;
    for (kind, vertices) in every_pair(&triangles) {
        let corners = vertices.map(|i| x[i as usize]);
        if closest(kind, &corners).distance_sq < GAP_M * GAP_M {
            let pair =
                contact.found.pairs.iter().find(|p| key(p.kind, p.vertices) == (kind, vertices));
            expected += barrier::energy_j(pair.expect("cached"), &corners, GAP_M);
        }
    }
    let mut gradient = vec![Vector3::zeros(); x.len()];
    let energy_j = contact.add_gradient(&x, &mut gradient);
    assert!(expected > 0.0 && (energy_j - expected).abs() < 1e-12 * expected);
    assert_eq!(energy_j, contact.energy_j(&x));
    let mut blocks = Vec::new();
    contact.blocks(&x, HessianForm::Projected, &mut blocks);
    assert_eq!(blocks.len(), contact.active_count(&x));
    // The global gradient, by differences along a random direction.
    let direction: Vec<_> = x.iter().map(|_| noise(&mut rng, 1.0)).collect();
    let at = |h: f64| {
        contact.energy_j(&x.iter().zip(&direction).map(|(p, d)| p + d * h).collect::<Vec<_>>())
    };
    let slope: f64 = gradient.iter().zip(&direction).map(|(g, d)| g.dot(d)).sum();
    let change = (at(1e-9) - at(-1e-9)) / 2e-9;
    assert!((slope - change).abs() < 1e-5 * slope.abs(), "{slope} {change}");
}

/// Steps of 1 mm to 0.2 m, far beyond the distances, from contact-rich states.
#[test]
fn steps_cut_by_max_step_never_intersect() {
    let mut cut = 0;
    for seed in 0..6 {
        let (triangles, mut x, mut contact) = crumpled(13, seed, 6);
        let mut rng = rng(seed + 100);
        for step in 0..12 {
            let size = 10_f64.powf(rng.random_range(-3.0..-0.7));
            let dx: Vec<_> = x.iter().map(|_| noise(&mut rng, size)).collect();
            let by_ball = step % 3 == 2;
            if by_ball {
                contact.update(&x, 2e-3);
            } else {
                contact.update_along(&x, &dx);
            }
            let before = every_distance(&contact, &x);
            let t = contact.max_step(&x, &dx);
            assert!(t > 0.0 && t <= 1.0);
            cut += usize::from(t < 1.0);
            for fraction in [0.3, 0.7, 1.0] {
                let y: Vec<_> = x.iter().zip(&dx).map(|(p, d)| p + d * (t * fraction)).collect();
                assert_eq!(count_intersections(&triangles, &y), 0, "seed {seed} step {step}");
                for (a, b) in before.iter().zip(every_distance(&contact, &y)) {
                    assert!(b >= 0.0999 * a, "{b} of {a}");
                }
            }
            for (p, d) in x.iter_mut().zip(&dx) {
                *p += d * t;
            }
        }
        // The full steps would have intersected: the test can fail.
        let wild: Vec<_> = x.iter().map(|p| p + noise(&mut rng, 0.01)).collect();
        assert!(count_intersections(&triangles, &wild) > 0);
    }
    assert!(cut > 30, "{cut}");
}

fn every_distance(contact: &SelfContact, x: &[Vector3]) -> Vec<f64> {
    contact.found.pairs.iter().map(|p| closest(p.kind, &p.corners(x)).distance_sq.sqrt()).collect()
}

#[test]
fn a_cache_that_does_not_cover_a_step_gives_zero() {
    let (triangles, x) = two_sheets(5, 5, v(1e-3, 2e-3, 2e-3), 0.1);
    let mut contact = SelfContact::new(&triangles, &x, SelfContactParams::default());
    let dx = vec![v(1e-3, 0.0, 0.0); x.len()];
    assert_eq!(contact.max_step(&x, &dx), 0.0);
    contact.update(&x, 1e-3);
    assert!((contact.max_step(&x, &dx) - 0.5).abs() < 1e-6);
    contact.update(&x, 2e-3);
    assert_eq!(contact.max_step(&x, &dx), 1.0);
    contact.update_along(&x, &dx);
    assert_eq!(contact.max_step(&x, &dx), 1.0);
    let other = vec![v(0.0, 1e-3, 0.0); x.len()];
    assert_eq!(contact.max_step(&x, &other), 0.0);
}

/// Newton with dense factors: 10 x 10 vertices pinned below, 5 x 5 above them
/// pressed down with `pressure_pa`. Gives the rest distance of the two planes
/// over the gap. Tangential motion is held by a weak spring.
fn pressed(pressure_pa: f64, shift: Vector3, angle: f64) -> f64 {
    let (n, m) = (10, 5);
    let (triangles, rest) = two_sheets(n, m, v(12e-3, 11e-3, 2.2e-3) + shift, angle);
    let mut contact = SelfContact::new(&triangles, &rest, SelfContactParams::default());
    let mut x = rest.clone();
    let (lower, dofs) = (n * n, 3 * m * m);
    // Rest weights, from the points' areas.
    let load_n: Vec<f64> =
        contact.elements.point_weight.iter().map(|w| w * WEIGHT_AREA_M2 * pressure_pa).collect();
    let held_n_m = 0.05;
    for _ in 0..200 {
        let mut grad = vec![Vector3::zeros(); x.len()];
        contact.update(&x, 0.0);
        contact.add_gradient(&x, &mut grad);
        let mut blocks = Vec::new();
        contact.blocks(&x, HessianForm::Projected, &mut blocks);
        let mut matrix = nalgebra::DMatrix::<f64>::identity(dofs, dofs) * held_n_m;
        for block in &blocks {
            for (i, &a) in block.vertices.iter().enumerate() {
                for (j, &b) in block.vertices.iter().enumerate() {
                    if a as usize >= lower && b as usize >= lower {
                        let at = (3 * (a as usize - lower), 3 * (b as usize - lower));
                        let mut part = matrix.view_mut(at, (3, 3));
                        part += block.hessian.fixed_view::<3, 3>(3 * i, 3 * j);
                    }
                }
            }
        }
        let force = nalgebra::DVector::from_fn(dofs, |row, _| {
            let vertex = lower + row / 3;
            let pull = if row % 3 == 2 {
                load_n[vertex]
            } else {
                held_n_m * (x[vertex] - rest[vertex])[row % 3]
            };
            -grad[vertex][row % 3] - pull
        });
        let step = matrix.cholesky().expect("positive definite").solve(&force);
        let mut dx = vec![Vector3::zeros(); x.len()];
        for row in 0..dofs {
            dx[lower + row / 3][row % 3] = step[row];
        }
        contact.update_along(&x, &dx);
        let total = |x: &[Vector3]| {
            let pull = (lower..x.len()).map(|i| {
                let moved = x[i] - rest[i];
                load_n[i] * x[i].z + 0.5 * held_n_m * (moved.x.powi(2) + moved.y.powi(2))
            });
            contact.energy_j(x) + pull.sum::<f64>()
        };
        let mut t = contact.max_step(&x, &dx);
        assert!(t > 0.0);
        let (start, slope) = (total(&x), -force.dot(&step));
        loop {
            let y: Vec<_> = x.iter().zip(&dx).map(|(p, d)| p + d * t).collect();
            if total(&y) <= start + 1e-4 * t * slope || t < 1e-8 {
                x = y;
                break;
            }
            t *= 0.5;
        }
        assert_eq!(count_intersections(&triangles, &x), 0);
        if force.amax() < 1e-3 * pressure_pa * WEIGHT_AREA_M2 {
            let heights = x[lower..].iter().map(|p| p.z).sum::<f64>() / (m * m) as f64;
            return heights / contact.params().gap_m;
        }
    }
    panic!("not at rest at {pressure_pa} Pa");
}

/// 0.5 Pa is 0.05 kg/m^2, 4 Pa is 0.4 kg/m^2, 40 Pa is 1e-3 N per vertex, and
/// 40 kPa would be a person standing on it. The order of pressures is the order
/// of distances. Observed: 0.90-0.92, 0.74-0.78, 0.37, below 5e-4.
#[test]
fn pressed_sheets_rest_within_the_gap_and_never_pass() {
    for (shift, angle) in
        [(v(1.3e-3, 2.1e-3, 0.0), 0.2), (Vector3::zeros(), 0.0), (v(2.5e-3, 0.0, 0.0), 0.0)]
    {
        let heights: Vec<_> =
            [0.5, 4.0, 40.0, 4e4].iter().map(|p| pressed(*p, shift, angle)).collect();
        assert!(heights.windows(2).all(|w| w[1] < w[0]), "{heights:?}");
        assert!(heights[0] < 1.0 && heights[2] > 0.25, "{heights:?}");
        assert!(heights[3] > 0.0);
    }
}

#[test]
fn count_intersections_knows_the_answers() {
    let two = |a: [Vector3; 3], b: [Vector3; 3]| {
        let x: Vec<_> = a.into_iter().chain(b).collect();
        count_intersections(&[[0, 1, 2], [3, 4, 5]], &x)
    };
    let base = [v(0.0, 0.0, 0.0), v(1.0, 0.0, 0.0), v(0.0, 1.0, 0.0)];
    let moved = |by: Vector3| base.map(|p| p + by);
    let upright = |z: f64| [v(0.2, 0.2, z - 0.5), v(0.3, 0.2, z + 0.5), v(0.2, 0.3, z + 0.5)];
    assert_eq!(two(base, upright(0.0)), 1, "crossing");
    assert_eq!(two(upright(0.0), base), 1, "crossing, other order");
    assert_eq!(two(base, upright(0.6)), 0, "above");
    assert_eq!(two(base, moved(v(0.0, 0.0, 0.1))), 0, "parallel");
    assert_eq!(two(base, moved(v(1.5, 0.0, 0.0))), 0, "coplanar, separate");
    assert_eq!(
        two(base, [v(1.0, 1.0, 0.0), v(0.9, 0.2, 0.0), v(0.2, 0.9, 0.0)]),
        0,
        "coplanar, boxes overlap"
    );
    // One plane up to rounding, sides in line with sides: once counted as touching.
    let tilt = |p: Vector3| v(p.x * 5e-3 + 0.017, p.y * 5e-3 + 0.011, 0.002075 - p.x * 1.25e-4);
    let stair = [v(1.0, 0.0, 0.0), v(2.0, 0.0, 0.0), v(2.0, 1.0, 0.0)];
    assert_eq!(
        two(
            [v(0.0, 0.0, 0.0), v(1.0, 1.0, 0.0), v(0.0, 1.0, 0.0)].map(tilt),
            stair.map(|p| tilt(p + v(0.01, 0.0, 0.0)))
        ),
        0
    );
    assert_eq!(two(base, moved(v(0.2, 0.1, 0.0))), 1, "coplanar, overlapping");
    assert_eq!(two(base, base.map(|p| p * 0.3 + v(0.1, 0.1, 0.0))), 1, "coplanar, one inside");
    let ring = [v(0.5, -0.5, -0.1), v(0.5, 1.5, -0.1), v(0.5, 0.3, 5.0)];
    assert_eq!(two(base, ring), 1, "sides of the first through the second");
    assert_eq!(
        count_intersections(
            &[[0, 1, 2], [0, 3, 4]],
            &[base[0], base[1], base[2], v(1.0, 1.0, -1.0), v(1.0, 1.0, 1.0)]
        ),
        0,
        "a common vertex is left out"
    );
    let (triangles, mut x) = two_sheets(9, 9, v(1.1e-3, 0.7e-3, 1e-3), 0.3);
    assert_eq!(count_intersections(&triangles, &x), 0);
    let poke = 40;
    x[poke].z = 1.5e-3;
    assert!(count_intersections(&triangles, &x) > 0, "a vertex poked through");
}
