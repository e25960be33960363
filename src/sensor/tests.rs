use super::profile::{CONSUMER, IDEAL, STRUCTURED_LIGHT, TRUEDEPTH};
use super::*;
use crate::base::{Isometry3, Point3, Vector3};
use crate::geom::{Mesh, MeshIndex};

/// A 61 x 61 drape without a simulator: a flat disc on the plate, a rounded
/// edge, then a cone with `folds` folds whose depth grows towards the rim; along
/// the radius, lengths are nearly kept, but not around it (sides of 222 mm).
fn synthetic_drape(folds: f64) -> Mesh {
    const N: usize = 61;
    let half = 0.15;
    let at = |i: usize| -half + 2.0 * half * i as f64 / (N - 1) as f64;
    let vertex = |x: f64, z: f64| {
        let (r, azimuth) = (x.hypot(z), z.atan2(x));
        let out = (r - 0.05).max(0.0);
        // The slope turns from flat to steep over 20 mm of cloth.
        let steep: f64 = 1.25;
        let bent = (out / 0.02).min(1.0) * steep;
        let arc = 0.02 / steep;
        let straight = (out - 0.02).max(0.0);
        let radius = r.min(0.05) + arc * bent.sin() + straight * steep.cos();
        let drop = arc * (1.0 - bent.cos()) + straight * steep.sin();
        let wave = 0.12 * straight * (folds * azimuth).cos();
        Point3::new((radius + wave) * azimuth.cos(), 0.0003 - drop, (radius + wave) * azimuth.sin())
    };
    let vertices = (0..N * N).map(|k| vertex(at(k / N), at(k % N))).collect();
    let mut triangles = Vec::new();
    for i in 0..N - 1 {
        for j in 0..N - 1 {
            let [a, b, c, d] = [i * N + j, i * N + j + 1, (i + 1) * N + j, (i + 1) * N + j + 1];
            let [a, b, c, d] = [a, b, c, d].map(|v| v as u32);
            triangles.extend([[a, b, c], [b, d, c]]);
        }
    }
    Mesh { vertices, triangles }
}

fn scene() -> Scene {
    Scene::modified_cusick(synthetic_drape(7.0))
}

/// A profile with few pixels, for tests of the flow.
fn small(profile: Profile) -> Profile {
    Profile { camera: Camera { width: 200, height: 150, focal_px: 190.0 }, ..profile }
}

/// Distance from the nearest surface of the scene.
fn off_surface_m(scene: &Scene, cloth: &MeshIndex, p: &Point3) -> f64 {
    let r = p.x.hypot(p.z);
    let cylinder = |radius: f64, bottom: f64, top: f64| {
        let (out, above) = (r - radius, (p.y - top).max(bottom - p.y));
        if out < 0.0 && above < 0.0 { -out.max(above) } else { out.max(0.0).hypot(above.max(0.0)) }
    };
    let stand = &scene.stand;
    let thickness = stand.plate_thickness_m;
    [
        (cloth.nearest(p) - p).norm(),
        (p.y - stand.floor_y_m).abs(),
        cylinder(stand.plate_radius_m, -thickness, 0.0),
        cylinder(stand.pedestal_radius_m, stand.floor_y_m, -thickness),
    ]
    .into_iter()
    .fold(f64::INFINITY, f64::min)
}

#[test]
fn points_without_noise_lie_on_the_surfaces() {
    let scene = scene();
    let cloth = MeshIndex::new(&scene.drape).unwrap();
    for unit_m in [1.0, 1e-3] {
        let profile = Profile { unit_m, ..small(IDEAL) };
        let scan = scan(&scene, &default_ring(), &profile, 5).unwrap();
        assert!(scan.cloud.points.len() > 5_000, "{}", scan.cloud.points.len());
        let worst = scan
            .cloud
            .points
            .iter()
            .map(|p| off_surface_m(&scene, &cloth, &scan.truth.to_simulation_m(p)))
            .fold(0.0, f64::max);
        assert!(worst < 1e-9, "{worst} m");
    }
}

#[test]
fn hidden_surfaces_are_not_seen() {
    let scene = scene();
    let top = [*Ring::default().poses().last().unwrap()];
    let scan = scan(&scene, &top, &small(IDEAL), 5).unwrap();
    // From the top, cloth hides the plate, the pedestal and the floor below it.
    let points = scan.cloud.points.iter().map(|p| scan.truth.to_simulation_m(p));
    let below_the_cloth = points.filter(|p| p.x.hypot(p.z) < 0.05 && p.y < -1e-9);
    assert_eq!(below_the_cloth.count(), 0);
    let side = CameraPose::look_at(Point3::new(0.5, -0.08, 0.0), Point3::new(0.0, -0.08, 0.0));
    let scan = super::scan(&scene, &[side], &small(IDEAL), 5).unwrap();
    let points = scan.cloud.points.iter().map(|p| scan.truth.to_simulation_m(p));
    let behind = points.filter(|p| p.x < -0.03 && p.y > -0.04 && p.y < -0.01);
    assert_eq!(behind.count(), 0, "the far side of the drape shows from the near side");
}

#[test]
fn the_rim_is_seen_all_round_by_the_default_ring() {
    let scene = scene();
    let profile = Profile { spacing_m: 0.002, ..IDEAL };
    let scan = scan(&scene, &default_ring(), &profile, 5).unwrap();
    let points: Vec<Point3> =
        scan.cloud.points.iter().map(|p| scan.truth.to_simulation_m(p)).collect();
    let rim = (0..61).flat_map(|i| [i, 60 * 61 + i, 61 * i, 61 * i + 60]);
    let (mut seen, mut all) = (0, 0);
    for vertex in rim {
        let at = scene.drape.vertices[vertex];
        seen += usize::from(points.iter().any(|p| (p - at).norm() < 0.003));
        all += 1;
    }
    assert!(seen * 100 >= all * 97, "{seen} of {all} rim points within 3 mm of the scan");
}

#[test]
fn same_seed_same_bytes_whatever_the_threads() {
    let scene = scene();
    let poses = &default_ring()[..3];
    let profile = small(CONSUMER);
    let with_threads = |threads, seed| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| scan(&scene, poses, &profile, seed).unwrap())
    };
    let one = with_threads(1, 9);
    let bits = |scan: &VirtualScan| -> Vec<u64> {
        let points = scan.cloud.points.iter().flat_map(|p| p.iter().map(|c| c.to_bits()));
        let depths = scan.views.iter().flat_map(|v| v.depth_m.iter().map(|d| d.to_bits()));
        points.chain(depths).collect()
    };
    for threads in [1, 2, 5] {
        let again = with_threads(threads, 9);
        assert_eq!(bits(&one), bits(&again), "{threads} threads");
        assert_eq!(one.truth, again.truth);
    }
    assert_ne!(bits(&one), bits(&with_threads(1, 10)));
}

/// A small part of a sheet, seen from `distance_m` at `tilt_rad`: depth by this
/// profile less exact depth \[m\].
fn errors_on_a_sheet_m(profile: &Profile, distance_m: f64, tilt_rad: f64) -> Vec<f64> {
    let place = Isometry3::new(Vector3::y() * 0.15, Vector3::z() * tilt_rad);
    let corner = |x: f64, z: f64| place * Point3::new(x, 0.0, z);
    let drape = Mesh {
        vertices: vec![corner(-0.2, -0.2), corner(0.2, -0.2), corner(0.2, 0.2), corner(-0.2, 0.2)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let scene = Scene::modified_cusick(drape);
    let center = place * Point3::origin();
    let pose = [CameraPose::look_at(center + Vector3::y() * distance_m, center)];
    let ideal = Profile { camera: profile.camera, ..IDEAL };
    let measured = scan(&scene, &pose, profile, 3).unwrap();
    let exact = scan(&scene, &pose, &ideal, 3).unwrap();
    let pairs = measured.views[0].depth_m.iter().zip(&exact.views[0].depth_m);
    pairs.map(|(measured, exact)| measured - exact).filter(|e| e.is_finite()).collect()
}

/// The profile with its axial noise alone, in a view so narrow that depth and
/// incidence hardly vary.
fn axial_only(profile: &Profile) -> Profile {
    Profile {
        camera: Camera { width: 200, height: 150, focal_px: 20_000.0 },
        axial_m: profile.axial_m,
        axial_growth_per_m: profile.axial_growth_per_m,
        axial_best_m: profile.axial_best_m,
        axial_incidence_m15: profile.axial_incidence_m15,
        ..IDEAL
    }
}

#[test]
fn measured_noise_is_the_stated_noise() {
    for profile in [STRUCTURED_LIGHT, TRUEDEPTH, CONSUMER] {
        for (distance_m, tilt_deg) in [(0.4, 0.0), (0.6, 0.0), (0.8, 0.0), (0.5, 40.0), (0.5, 70.0)]
        {
            let tilt_rad = f64::to_radians(tilt_deg);
            let errors = errors_on_a_sheet_m(&axial_only(&profile), distance_m, tilt_rad);
            let n = errors.len() as f64;
            assert_eq!(n, 30_000.0);
            let mean = errors.iter().sum::<f64>() / n;
            let sigma = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
            let want = profile.axial_sigma_m(distance_m, tilt_rad);
            // The sampling error of a standard deviation is sigma / sqrt(2 n); the
            // view is 0.6 degrees wide, within which sigma varies by up to 2 %.
            let slack = 4.0 * want / (2.0 * n).sqrt() + 0.003 * want;
            let name = profile.name;
            assert!((sigma - want).abs() < slack, "{name} {distance_m} m: {sigma} against {want}");
            assert!(mean.abs() < 4.0 * want / n.sqrt(), "{name}: bias {mean}");
        }
    }
}

#[test]
fn lateral_noise_moves_rays_by_the_stated_pixels() {
    // On a sheet tilted by t, a ray moved by s pixels across the tilt's axis
    // changes the depth by about z^2 tan(t) / (z focal) s.
    let (z, tilt_rad) = (0.5, 45_f64.to_radians());
    let profile = Profile { lateral_px: 0.8, ..axial_only(&IDEAL) };
    let errors = errors_on_a_sheet_m(&profile, z, tilt_rad);
    let n = errors.len() as f64;
    let sigma = (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
    let want = 0.8 * z * tilt_rad.tan() / profile.camera.focal_px;
    assert!((sigma / want - 1.0).abs() < 0.02, "{sigma} against {want}");
}

#[test]
fn outliers_drop_out_and_steps_come_as_often_as_stated() {
    let base = axial_only(&IDEAL);
    let outliers = Profile { outlier_fraction: 0.01, outlier_reach_m: 0.05, ..base.clone() };
    let errors = errors_on_a_sheet_m(&outliers, 0.5, 0.0);
    let hit = errors.iter().filter(|e| e.abs() > 1e-9).count() as f64 / errors.len() as f64;
    assert!((hit - 0.01).abs() < 4.0 * (0.01_f64 / 30_000.0).sqrt(), "{hit}");
    assert!(errors.iter().all(|e| e.abs() <= 0.05));

    let [begin, end] = [60_f64.to_radians(), 80_f64.to_radians()];
    let grazing = Profile { grazing_rad: [begin, end], ..base.clone() };
    let left =
        |tilt_deg: f64| errors_on_a_sheet_m(&grazing, 0.5, tilt_deg.to_radians()).len() as f64;
    assert_eq!(left(55.0), 30_000.0);
    assert!((left(70.0) / 30_000.0 - 0.5).abs() < 0.02, "{}", left(70.0));
    assert_eq!(left(82.0), 0.0);

    let steps = Profile { disparity_step_per_m: 0.003, depth_unit_m: 1e-4, ..base };
    let errors = errors_on_a_sheet_m(&steps, 0.5, 30_f64.to_radians());
    let most = 0.5 * 0.003 * 0.51 * 0.51 + 0.5e-4;
    assert!(errors.iter().all(|e| e.abs() <= most), "beyond half a step");
    assert!(errors.iter().any(|e| e.abs() > 0.5 * most));
}

/// Two sheets, one above the other; the upper one ends in the middle of the view.
fn two_sheets(profile: &Profile) -> DepthImage {
    let vertices = [(-0.2, 0.0, 0.1), (-0.2, 0.2, 0.05)].map(|(x0, x1, y)| {
        [[x0, -0.2], [x1, -0.2], [x1, 0.2], [x0, 0.2]].map(|[x, z]| Point3::new(x, y, z))
    });
    let triangles = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
    let scene = Scene::modified_cusick(Mesh { vertices: vertices.concat(), triangles });
    let pose = [CameraPose::look_at(Point3::new(0.0, 0.5, 0.0), Point3::new(0.0, 0.1, 0.0))];
    scan(&scene, &pose, profile, 3).unwrap().views.remove(0)
}

#[test]
fn flying_pixels_lie_between_the_two_surfaces_at_the_edge() {
    let camera = Camera { width: 100, height: 80, focal_px: 400.0 };
    let profile = Profile { camera, flying_fraction: 0.5, ..IDEAL };
    let view = two_sheets(&profile);
    let flying = |d: &f64| (*d - 0.4).abs() > 1e-9 && (*d - 0.45).abs() > 1e-9;
    let fliers: Vec<(usize, f64)> =
        view.depth_m.iter().copied().enumerate().filter(|(_, d)| flying(d)).collect();
    assert!(fliers.iter().all(|(_, d)| (0.4..=0.45).contains(d)));
    let columns: Vec<usize> = fliers.iter().map(|(i, _)| i % 100).collect();
    assert!(columns.iter().all(|c| (49..=50).contains(c)), "{columns:?}");
    // Two columns of 80 pixels at a chance of 0.5: 80 +- 6.3.
    assert!((55..=105).contains(&fliers.len()), "{}", fliers.len());
}

#[test]
fn edges_recede_and_spread_by_the_stated_pixels() {
    let camera = Camera { width: 100, height: 80, focal_px: 400.0 };
    let near_columns = |edge_erosion_px| {
        let profile = Profile { camera, edge_erosion_px, ..IDEAL };
        let view = two_sheets(&profile);
        view.depth_m[4000..4100].iter().filter(|d| (*d - 0.4).abs() < 1e-9).count()
    };
    assert_eq!(near_columns(0), 50);
    assert_eq!(near_columns(2), 48);
    assert_eq!(near_columns(-2), 52);
}

#[test]
fn the_truth_reads_back_from_its_file() {
    let poses = &default_ring()[..2];
    let mut scene = scene();
    scene.mark_warp_side([220, 40, 40]).unwrap();
    let scan = scan(&scene, poses, &small(STRUCTURED_LIGHT), 4).unwrap();
    assert!(scan.cloud.colors.iter().any(|c| c[0] > 80 && c[1] < c[0] / 2), "the mark is seen");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    scan.write(&path).unwrap();
    let (cloud, _) = crate::io::read_scan(&path).unwrap();
    assert_eq!(cloud.colors, scan.cloud.colors);
    let text = std::fs::read(folder.path().join("a.truth.json")).unwrap();
    let truth: Truth = serde_json::from_slice(&text).unwrap();
    for (a, b) in cloud.points.iter().zip(&scan.cloud.points) {
        // Floats of up to half a metre: 3e-8 m.
        let (a, b) = (truth.to_simulation_m(a), scan.truth.to_simulation_m(b));
        assert!((a - b).norm() < 2e-7);
    }
}

#[test]
fn a_scene_that_is_none_is_refused() {
    let profile = small(IDEAL);
    let refused = |scene: &Scene| scan(scene, &[], &profile, 1).unwrap_err();
    let empty = Scene::modified_cusick(Mesh::default());
    assert_eq!(refused(&empty), SceneError::NoMesh(crate::geom::MeshError::NoTriangles));
    let stand = Stand { floor_y_m: -0.05, ..Stand::MODIFIED_CUSICK };
    let low = Scene { stand, ..scene() };
    assert!(refused(&low).to_string().contains("floor_y_m is -0.05 m"));
    let mut broken = scene();
    broken.drape.vertices[3].y = f64::NAN;
    assert_eq!(refused(&broken), SceneError::NotFinite(3));
}
