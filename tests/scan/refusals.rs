//! Every reason to refuse a scan, provoked: each scene has one fault, and the refusal names
//! that and no other, with what was measured beyond its limit.

use std::sync::OnceLock;

use crate::scan_support::{Drape, SIDE, Sampling, flat_m, scan, scan_where, stiff_knit as drape};
use scan2params::base::{Isometry3, Point3, Vector3};
use scan2params::geom::{Cloud, Mesh};
use scan2params::scan::{
    MarkColor, NoDrape, ScanError, ScanOptions, ScannedBoundary, WarpToward, boundary_from_scan,
};
use scan2params::sensor::{self, Profile, Scene, Stand};

/// The scans lie in the simulation frame, so that bearings can be held.
fn pose() -> Isometry3 {
    Isometry3::identity()
}

fn options() -> ScanOptions {
    ScanOptions { warp_toward: Some(WarpToward::BearingDeg(0.0)), ..ScanOptions::default() }
}

fn refusal_with(cloud: &Cloud, options: &ScanOptions) -> ScanError {
    match boundary_from_scan(cloud, options) {
        Ok(found) => panic!("answered: {:?}", found.quality),
        Err(refusal) => {
            println!("{refusal:?}: {refusal}");
            refusal
        }
    }
}

fn refusal(cloud: &Cloud) -> ScanError {
    refusal_with(cloud, &options())
}

/// A scan without the points of the cloth that are not kept.
fn kept(keep: impl Fn([f64; 2], &Point3) -> bool) -> Cloud {
    scan_where(drape(), &Sampling::thin(), &pose(), keep)
}

/// Bearing of a place \[degrees\].
fn bearing_deg(p: &Point3) -> f64 {
    (-p.z).atan2(p.x).to_degrees().rem_euclid(360.0)
}

/// Whether a bearing lies within `wide_deg` of `middle_deg`.
fn within(p: &Point3, middle_deg: f64, wide_deg: f64) -> bool {
    let off = (bearing_deg(p) - middle_deg + 540.0).rem_euclid(360.0) - 180.0;
    // folds of stiff cloth swing in under the plate's edge
    off.abs() < 0.5 * wide_deg && (p.x.hypot(p.z) > 0.052 || p.y < -0.01)
}

/// What is found of the scene without a fault, once for all tests of a program.
pub fn whole() -> &'static ScannedBoundary {
    static FOUND: OnceLock<ScannedBoundary> = OnceLock::new();
    FOUND.get_or_init(|| boundary_from_scan(&kept(|_, _| true), &options()).unwrap())
}

#[test]
fn the_scene_itself_is_answered() {
    let error_mm = 1e3 * whole().boundary.mean_distance_m(&drape().rim());
    assert!(error_mm < 0.5, "{error_mm} mm");
}

#[test]
fn too_few_points() {
    let few = Sampling { cloth_points: 800, floor_points: 100, ..Sampling::default() };
    let refusal = refusal(&scan(drape(), &few, &pose()));
    assert!(
        matches!(refusal, ScanError::TooFewPoints { points, limit } if points < limit),
        "{refusal:?}"
    );
}

#[test]
fn a_scene_of_no_size() {
    let mut cloud = kept(|_, _| true);
    // in nanometres
    cloud.points.iter_mut().for_each(|p| *p *= 1e9);
    assert!(matches!(refusal(&cloud), ScanError::Size { .. }));
}

#[test]
fn coordinates_in_coarse_steps() {
    let mut cloud = kept(|_, _| true);
    cloud.points.iter_mut().for_each(|p| p.iter_mut().for_each(|c| *c = (*c * 1e2).round() / 1e2));
    let refusal = refusal(&cloud);
    assert!(matches!(&refusal, ScanError::TooCoarse { step, .. } if step == "10 mm"), "{refusal}");
}

#[test]
fn no_plate() {
    let floor_and_pedestal = scan_where(drape(), &Sampling::default(), &pose(), |_, _| false);
    assert!(matches!(refusal(&floor_and_pedestal), ScanError::NoPlate { .. }));
}

#[test]
fn two_drapes_in_one_file() {
    let beside = Isometry3::new(Vector3::new(0.25, 0.0, -0.3), Vector3::y() * 0.7);
    let mut both = kept(|_, _| true);
    both.points.extend(scan_where(drape(), &Sampling::thin(), &beside, |_, _| true).points);
    let refusal = refusal(&both);
    assert!(
        matches!(&refusal, ScanError::SeveralDrapes { apart_mm, .. } if (apart_mm - 390.5).abs() < 4.0),
        "{refusal:?}"
    );

    // What stands about without a cloth on it is no drape: a dish, 25 mm high, upside down.
    let mut with_dish = kept(|_, _| true);
    let floor_m = with_dish.points.iter().map(|p| p.y).fold(0.0, f64::min);
    for ring in 0..200 {
        let bearing = f64::from(ring) * std::f64::consts::TAU / 200.0;
        let at = |radius_m: f64, height_m: f64| {
            Point3::new(
                0.3 + radius_m * bearing.cos(),
                floor_m + height_m,
                radius_m * bearing.sin(),
            )
        };
        with_dish.points.extend((0..25).map(|k| at(f64::from(k) * 2e-3, 0.025)));
        with_dish.points.extend((0..12).map(|k| at(0.05, f64::from(k) * 2e-3)));
    }
    let found = boundary_from_scan(&with_dish, &options()).unwrap();
    assert!(1e3 * found.boundary.mean_distance_m(&drape().rim()) < 0.5);
}

#[test]
fn a_plate_whose_edge_does_not_show() {
    // a shiny band round it: no points from its edge to 11 mm below its top
    let is_seen = |p: &Point3| p.x.hypot(p.z) < 0.0485 || p.y < -11e-3;
    let banded = scan_where(drape(), &Sampling::default(), &pose(), |_, p| is_seen(p));
    let refusal = refusal(&banded);
    assert!(too_little_is_seen(&refusal), "{refusal:?}");
}

#[test]
fn a_round_specimen_is_no_square() {
    let round = kept(|m, _| m[0].hypot(m[1]) < 0.15);
    let refusal = refusal(&round);
    assert!(
        matches!(refusal, ScanError::NotASquare { rms_mm, limit_mm, .. } if rms_mm > limit_mm),
        "{refusal:?}"
    );
}

#[test]
fn a_view_that_ends_70_mm_below_the_plate() {
    let refusal = refusal(&kept(|_, p| p.y > -0.07));
    assert!(too_little_is_seen(&refusal), "{refusal:?}");
}

/// Whether at the plate the surface is said to end before the specimen's edge.
fn too_little_is_seen(refusal: &ScanError) -> bool {
    let ScanError::NoPlate { why: NoDrape::NotTheSpecimen(there), .. } = refusal else {
        return false;
    };
    let off_m = (there.centre - pose() * Point3::origin()).norm();
    off_m < 5e-3
        && there.short > 0.5
        && there.short > 3.0 * there.beyond
        && refusal.to_string().contains("a drape of which too little is seen")
}

#[test]
fn half_a_drape() {
    let refusal = refusal(&kept(|_, p| p.x < 0.02));
    assert!(
        matches!(refusal, ScanError::TooLittleRim { observed_percent, length_mm, bearing_deg, .. }
            if observed_percent < 60.0 && length_mm > 400.0 && bearing_deg.to_radians().cos() > 0.9),
        "{refusal:?}"
    );
}

/// A stereo camera's scan of a knit whose folds are as narrow as its noise is wide.
#[test]
fn folds_that_noise_blurs() {
    let knit = [240e3, 310e3, 90e3, 150.0, 150.0, 150.0, 200.0];
    let triangles = Drape::triangles().into_iter().map(|t| t.map(|v| v as u32)).collect();
    let mesh = Mesh { vertices: Drape::simulated(2, knit).vertices, triangles };
    let scene = Scene::on(mesh, Stand::MODIFIED_CUSICK);
    let mut profile = Profile::named("d435").unwrap();
    profile.axial_m *= 3.0;
    profile.axial_growth_per_m *= 3.0;
    let noisy = sensor::scan(&scene, &sensor::default_ring(), &profile, 4).unwrap().cloud;
    let refusal = refusal(&noisy);
    assert!(
        matches!(refusal, ScanError::TooNoisy { noise_mm, rms_mm, limit_mm }
            if rms_mm > limit_mm && rms_mm < noise_mm),
        "{refusal:?}"
    );
}

#[test]
fn passes_that_lie_three_millimetres_apart() {
    let triangles = Drape::triangles().into_iter().map(|t| t.map(|v| v as u32)).collect();
    let mesh = Mesh { vertices: drape().vertices.clone(), triangles };
    let profile = Profile::named("handheld").unwrap();
    let scene = Scene::on(mesh, Stand::MODIFIED_CUSICK);
    let mut made = sensor::scan(&scene, &sensor::default_ring(), &profile, 4).unwrap();
    let off = Isometry3::new(Vector3::new(3e-3, 0.0, 0.0), Vector3::zeros());
    for view in made.views.iter_mut().step_by(2) {
        let pose = &mut view.pose_believed.simulation_from_camera;
        *pose = off * *pose;
    }
    made.fuse_again(&profile, 4);
    let apart = made.cloud;
    let refusal = refusal(&apart);
    assert!(
        matches!(refusal, ScanError::PassesApart { hanging_mm, plate_mm, .. } if hanging_mm > 2.0 * plate_mm),
        "{refusal:?}"
    );
}

#[test]
fn a_long_gap() {
    let refusal = refusal(&kept(|_, p| !within(p, 95.0, 50.0)));
    assert!(
        matches!(refusal, ScanError::Gap { length_mm, limit_mm, bearing_deg }
            if length_mm > limit_mm && (bearing_deg - 95.0).abs() < 10.0),
        "{refusal:?}"
    );
}

#[test]
fn too_little_rim_in_many_short_gaps() {
    let refusal = refusal(&kept(|_, p| !(0..12).any(|k| within(p, 30.0 * f64::from(k), 11.0))));
    assert!(
        matches!(refusal, ScanError::TooLittleRim { observed_percent, limit_percent, .. }
            if observed_percent < limit_percent),
        "{refusal:?}"
    );
}

/// The drape with its folds drawn towards a bell, which has less cloth around.
#[test]
fn a_surface_that_cannot_be_laid_flat() {
    let mut drawn_in = kept(|_, _| true);
    for p in drawn_in.points.iter_mut().filter(|p| p.y > -0.2 && p.x.hypot(p.z) > 0.05) {
        let bell_m = 0.05 - 0.7 * p.y;
        let inward = 0.4 * (bell_m / p.x.hypot(p.z) - 1.0) + 1.0;
        (p.x, p.z) = (inward * p.x, inward * p.z);
    }
    let refusal = refusal(&drawn_in);
    assert!(
        matches!(refusal, ScanError::Strained { strain_percent, limit_percent }
            if strain_percent > limit_percent),
        "{refusal:?}"
    );
}

#[test]
fn a_tag_that_hangs_off_the_rim() {
    // 14 mm of paper, 8 mm off the cloth in the middle of the side at x = +150 mm
    let middle = drape().vertices[60 * SIDE + 30];
    let outward = drape().outward(30);
    let along = (drape().vertices[60 * SIDE + 31] - drape().vertices[60 * SIDE + 29]).normalize();
    let normal = outward.cross(&along);
    let mut cloud = kept(|_, _| true);
    for i in 0..60 {
        for k in 0..60 {
            let [s, t] = [i, k].map(|c| (f64::from(c) / 59.0 - 0.5) * 14e-3);
            let at = middle - normal * 8e-3 + along * s + outward * t;
            cloud.points.push(pose() * at);
        }
    }
    let refusal = refusal(&cloud);
    assert!(
        matches!(refusal, ScanError::Unexplained { area_mm2, limit_mm2, bearing_deg }
            if area_mm2 > 2.0 * limit_mm2 && ((bearing_deg + 180.0).rem_euclid(360.0) - 180.0).abs() < 20.0),
        "{refusal:?}"
    );
}

#[test]
fn a_specimen_cut_as_a_trapezium() {
    // 300 mm at x = +150 mm, 288 mm at x = -150 mm
    let cut = kept(|m, _| m[1].abs() < 0.147 + m[0] * (3e-3 / 0.15));
    let refusal = refusal(&cut);
    assert!(
        matches!(refusal, ScanError::UnevenSides { measured_mm, median_mm, limit_mm, bearing_deg }
            if median_mm - measured_mm > limit_mm && (bearing_deg - 180.0).abs() < 20.0),
        "{refusal:?}"
    );
}

#[test]
fn sides_of_another_length_than_accepted() {
    let options = ScanOptions { side_range_m: [0.305, 0.330], ..options() };
    let refusal = refusal_with(&kept(|_, _| true), &options);
    assert!(
        matches!(refusal, ScanError::SideLength { measured_mm, min_mm, .. } if measured_mm < min_mm),
        "{refusal:?}"
    );
}

#[test]
fn cloth_pressed_into_a_crease() {
    // hanging cloth on one side in sharp pleats 12 mm wide and 8 mm deep
    let cloud = kept(|_, _| true);
    let back = pose().inverse();
    let points = cloud.points.iter().map(|p| {
        let q = back * p;
        let radius = q.x.hypot(q.z);
        if !(0.06..0.2).contains(&radius) || q.y < -0.2 || q.x < 0.03 {
            return *p;
        }
        let arc = bearing_deg(&q).to_radians() * radius / 12e-3;
        let zigzag = (2.0 * (arc - arc.floor()) - 1.0).abs() * 8e-3;
        let out = Vector3::new(q.x, 0.0, q.z) / radius;
        pose() * (q + out * zigzag)
    });
    let creased = Cloud { points: points.collect(), ..Cloud::default() };
    let refusal = refusal(&creased);
    assert!(
        matches!(refusal, ScanError::Misfit { .. } | ScanError::Unexplained { .. }),
        "{refusal:?}"
    );
}

/// A closed surface of revolution about the y axis, as a mesh: (radius, height) from the
/// middle of its top to the middle of its bottom.
fn revolved(profile: &[[f64; 2]]) -> Cloud {
    const AROUND: usize = 180;
    let mut cloud = Cloud::default();
    for [radius, height] in profile {
        for k in 0..AROUND {
            let (sine, cosine) = (std::f64::consts::TAU * k as f64 / AROUND as f64).sin_cos();
            cloud.points.push(Point3::new(radius * cosine, *height, radius * sine));
        }
    }
    for i in 0..profile.len() - 1 {
        for k in 0..AROUND {
            let next = (k + 1) % AROUND;
            let [a, b] = [i * AROUND + k, i * AROUND + next].map(|v| v as u32);
            let [c, d] = [a, b].map(|v| v + AROUND as u32);
            cloud.triangles.extend([[a, b, c], [b, d, c]]);
        }
    }
    cloud
}

#[test]
fn a_jar_has_no_free_edge() {
    // a flat top of 50 mm radius, a shoulder of 20 mm, straight down, and round underneath
    let arc = |from: f64, to: f64, at: [f64; 2], radius: f64| {
        (0..=16).map(move |k| {
            let angle = from + (to - from) * f64::from(k) / 16.0;
            [at[0] + radius * angle.sin(), at[1] + radius * angle.cos()]
        })
    };
    let right = std::f64::consts::FRAC_PI_2;
    let mut profile: Vec<[f64; 2]> = (0..=20).map(|k| [2.5e-3 * f64::from(k), 0.0]).collect();
    profile.extend(arc(0.0, right, [0.05, -0.02], 0.02));
    profile.extend((1..=90).map(|k| [0.07, -0.02 - 2.5e-3 * f64::from(k)]));
    profile.extend(arc(right, 2.0 * right, [0.0, -0.245], 0.07));
    let refusal = refusal(&revolved(&profile));
    assert!(
        matches!(refusal, ScanError::NoCrease { crease_deg, limit_deg } if crease_deg < limit_deg),
        "{refusal:?}"
    );
}

/// The drape with the colours that `color` gives to flat positions; floor and pedestal
/// are grey.
fn colored(color: impl Fn([f64; 2]) -> Option<[u8; 3]>, cloth: [u8; 3]) -> Cloud {
    let mut cloud = Cloud::default();
    for (vertex, at) in drape().vertices.iter().enumerate() {
        // each vertex as 4 x 4 points of its cell, in the planes of its neighbours
        let (i, k) = (vertex / SIDE, vertex % SIDE);
        if i + 1 == SIDE || k + 1 == SIDE {
            continue;
        }
        let [u, v] = [vertex + SIDE, vertex + 1].map(|other| drape().vertices[other] - at);
        let uv = drape().vertices[vertex + SIDE + 1] - at - u - v;
        for a in 0..4 {
            for b in 0..4 {
                let [s, t] = [a, b].map(|c| f64::from(c) / 3.0);
                let flat = flat_m(vertex);
                cloud.points.push(pose() * (at + u * s + v * t + uv * (s * t)));
                let place = [flat[0] + 5e-3 * s, flat[1] + 5e-3 * t];
                cloud.colors.push(color(place).unwrap_or(cloth));
            }
        }
    }
    cloud
}

const GREY: [u8; 3] = [120, 120, 125];
const RED: [u8; 3] = [190, 50, 45];

fn marked(cloud: &Cloud, mark: &str) -> Result<(), ScanError> {
    let mark = Some(mark.parse::<MarkColor>().unwrap());
    let found = boundary_from_scan(cloud, &ScanOptions { mark, ..ScanOptions::default() });
    found.map(|_| ()).inspect_err(|refusal| println!("{refusal:?}"))
}

#[test]
fn marks_that_are_not_there_or_tell_nothing() {
    let at = |x: f64, z: f64| move |m: [f64; 2]| (m[0] - x).hypot(m[1] - z) < 9e-3;
    let red = |on: &dyn Fn([f64; 2]) -> bool, m| on(m).then_some(RED);
    let (side, corner, other) = (at(0.145, 0.0), at(0.145, 0.145), at(0.0, 0.145));
    assert_eq!(marked(&colored(|m| red(&side, m), GREY), "red"), Ok(()));

    let mut bare = colored(|m| red(&side, m), GREY);
    bare.colors.clear();
    assert_eq!(marked(&bare, "red"), Err(ScanError::NoColors));

    let none = marked(&colored(|m| red(&side, m), GREY), "green");
    assert!(matches!(none, Err(ScanError::NoMark { points, limit }) if points < limit), "{none:?}");

    let alike = marked(&colored(|_| None, RED), "red");
    assert!(matches!(alike, Err(ScanError::MarkLikeCloth { .. })), "{alike:?}");

    let cornered = marked(&colored(|m| red(&corner, m), GREY), "red");
    assert!(
        matches!(cornered, Err(ScanError::MarkUnclear { off_deg, limit_deg, .. }) if off_deg > limit_deg),
        "{cornered:?}"
    );
    let two = marked(&colored(|m| red(&|m| side(m) || other(m), m), GREY), "red");
    assert!(
        matches!(two, Err(ScanError::MarkUnclear { share_percent, limit_percent, .. })
            if share_percent < limit_percent),
        "{two:?}"
    );
}

#[test]
fn a_direction_of_the_warp_that_stands_upright() {
    let upright = Some(WarpToward::Direction([0.1, 1.0, -0.1]));
    let options = ScanOptions { warp_toward: upright, ..ScanOptions::default() };
    let refusal = refusal_with(&kept(|_, _| true), &options);
    assert!(
        matches!(&refusal, ScanError::WarpSteep(steep) if steep.off_vertical_deg < steep.limit_deg),
        "{refusal:?}"
    );
}

/// Every variant of the enum stands in a test.
#[test]
fn every_refusal_has_a_test() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let rust_files = |folder: &str| {
        let mut paths = vec![root.join(folder)];
        let mut texts = Vec::new();
        while let Some(path) = paths.pop() {
            if path.is_dir() {
                paths.extend(std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()));
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                texts.push(std::fs::read_to_string(path).unwrap());
            }
        }
        texts
    };
    let sources = rust_files("src/scan");
    let enumeration = sources.iter().find_map(|s| s.split_once("pub enum ScanError {"));
    let (_, body) = enumeration.expect("src/scan has the enum");
    let body = &body[..body.find("\n}").unwrap()];
    let variants: Vec<&str> = body
        .lines()
        .filter_map(|line| line.strip_prefix("    ").filter(|l| l.starts_with(char::is_uppercase)))
        .map(|line| line.split([' ', ',', '(']).next().unwrap())
        .collect();
    assert!(variants.len() >= 18, "{variants:?}");
    let tests = rust_files("tests");
    let provoked = |name: &&&str| {
        let used = format!("ScanError::{name}");
        tests.iter().any(|test| {
            let after = test.match_indices(&used).map(|(at, _)| &test[at + used.len()..]);
            after.into_iter().any(|rest| !rest.starts_with(char::is_alphanumeric))
        })
    };
    let missing: Vec<&&str> = variants.iter().filter(|name| !provoked(name)).collect();
    assert!(missing.is_empty(), "no test provokes {missing:?}");
}
