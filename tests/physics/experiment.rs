//! What an experiment changes, against what is known of it.

use nalgebra::Rotation3;
use scan2params::base::Vector3;
use scan2params::calibrate::measures::drape_coefficient;
use scan2params::calibrate::prediction::outline_of;
use scan2params::fabric::Fabric;
use scan2params::sim::elastica::end_under;
use scan2params::sim::energy::asymmetry::SMOOTHING_PER_M;
use scan2params::sim::experiment::{AsymmetricBending, Curl, Hysteresis, Outline, Specimen, Tilt};
use scan2params::sim::grid::Grid;
use scan2params::sim::model::Model;
use scan2params::sim::setup::Setup;
use scan2params::sim::strip::{Cut, cantilever, unloaded};
use scan2params::sim::{
    Drape, Drop, Experiment, FollowOptions, Follower, Plate, SimOptions, Stop, drape,
};

/// Stiff enough to rest within a second on 25 x 25 vertices.
fn fabric() -> Fabric {
    Fabric::from_paper_units([240e3, 310e3, 90e3, 9000.0, 7000.0, 8000.0, 260.0])
}

fn draped(experiment: Experiment) -> Drape {
    let options =
        SimOptions { vertices: 25, fall_vertices: 25, experiment, ..SimOptions::default() };
    let d = drape(&fabric(), &Drop::canonical(), &options);
    assert_eq!(d.stop, Stop::AtRest, "{experiment:?}");
    d
}

#[test]
fn the_drape_of_a_rotated_specimen_is_the_drape_rotated() {
    let straight = draped(Experiment::default());
    let mut rotated = Experiment::default();
    rotated.specimen.rotation_rad = 0.7;
    let rotated = draped(rotated);
    let back = Rotation3::from_axis_angle(&Vector3::y_axis(), -0.7);
    let largest = straight
        .positions_m
        .iter()
        .zip(&rotated.positions_m)
        .map(|(p, q)| (p - back * q).norm())
        .fold(0.0, f64::max);
    // the plate is round: only rounding and the solver's rest differ
    assert!(largest < 1e-4, "{largest:e} m");
}

#[test]
fn a_specimen_off_centre_hangs_lower_where_it_overhangs_more() {
    let mut off = Experiment::default();
    off.specimen.offset_m = [0.015, 0.0];
    let (level, off) = (draped(Experiment::default()), draped(off));
    let side = |d: &Drape, sign: f64| {
        let points = d.boundary.positions_m().enumerate();
        // middles of the sides at x = +150 and -150 mm
        let middle = if sign > 0.0 { 30 } else { 152 };
        points.filter(|(k, _)| k.abs_diff(middle) < 10).map(|(_, p)| p.y).sum::<f64>() / 19.0
    };
    assert!(side(&off, 1.0) < side(&level, 1.0) - 2e-3);
    assert!(side(&off, -1.0) > side(&level, -1.0) + 2e-3);
}

#[test]
fn a_larger_plate_carries_more_and_a_rounder_edge_lets_it_hang_earlier() {
    let height = |plate: Plate| {
        let d = draped(Experiment { plate, ..Experiment::default() });
        d.boundary.positions_m().map(|p| p.y).sum::<f64>() / 244.0
    };
    let usual = height(Plate::default());
    assert!(height(Plate { radius_m: 0.07, ..Plate::default() }) > usual + 5e-3);
    assert!(height(Plate { edge_radius_m: 8e-3, ..Plate::default() }) < usual - 5e-4);
}

#[test]
fn size_and_skew_keep_the_cloth_s_mass_and_its_flat_rest() {
    let specimens = [
        Specimen { warp_m: 0.31, weft_m: 0.29, ..Specimen::default() },
        Specimen { skew_rad: 0.1, ..Specimen::default() },
        Specimen { outline: Outline::Disc, ..Specimen::default() },
    ];
    for specimen in specimens {
        let grid = Grid::of(&specimen, 31);
        let experiment = Experiment { specimen, ..Experiment::default() };
        let mut model = Model::new(&grid, &fabric(), &experiment, 0.2);
        model.plate = scan2params::sim::energy::plate::PlateContact::none();
        let mass: f64 = model.weight.mass_kg.iter().sum();
        let area = match specimen.outline {
            Outline::Disc => std::f64::consts::PI * 0.15 * 0.15,
            Outline::Rectangle => specimen.warp_m * specimen.weft_m,
        };
        assert!((mass / (0.26 * area) - 1.0).abs() < 1e-4, "{specimen:?}: {mass}");
        let x: Vec<_> = (0..grid.vertices()).map(|v| grid.flat(v)).collect();
        let mut gradient = vec![Vector3::zeros(); x.len()];
        model.gradient(&x, &mut gradient);
        let weight: Vector3 = gradient.iter().sum();
        for (v, g) in gradient.iter().enumerate() {
            // flat is free of stress: only the weight is left
            let own = Vector3::y() * (model.weight.mass_kg[v] * 9.80665);
            assert!((g - own).norm() < 1e-12, "{specimen:?} {v}: {g:?}");
        }
        assert!((weight.y / (9.80665 * mass) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn a_skewed_and_an_oblong_specimen_drape_and_keep_their_rim_s_length() {
    for specimen in [
        Specimen { warp_m: 0.31, weft_m: 0.29, ..Specimen::default() },
        Specimen { skew_rad: 0.05, ..Specimen::default() },
    ] {
        let d = draped(Experiment { specimen, ..Experiment::default() });
        let points: Vec<_> = d.boundary.positions_m().collect();
        let length: f64 = points.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        let leaning = specimen.weft_m / specimen.skew_rad.cos();
        let exact = 2.0 * (specimen.warp_m + leaning);
        // folds on 12.5 mm cells: the rim is cubic between their vertices, whose chords keep their
        // length
        assert!((length / exact - 1.0).abs() < 1e-2, "{specimen:?}: {length} {exact}");
    }
}

#[test]
fn a_disc_drapes_clear_of_the_plate_and_its_rim_keeps_its_length() {
    let options = SimOptions {
        vertices: 41,
        fall_vertices: 25,
        experiment: Experiment::standard_cusick(),
        ..SimOptions::default()
    };
    let d = drape(&fabric(), &Drop::canonical(), &options);
    assert_eq!(d.stop, Stop::AtRest);
    assert!(d.plate_clearance_m > 0.0 && d.intersections == 0);
    let points: Vec<_> = d.boundary.positions_m().collect();
    let length: f64 =
        (0..points.len()).map(|k| (points[k] - points[(k + 1) % points.len()]).norm()).sum();
    assert!((length / (std::f64::consts::TAU * 0.15) - 1.0).abs() < 6e-3, "{length}");
    assert!((2..=12).contains(&d.nodes), "{}", d.nodes);
}

#[test]
fn gravity_follows_the_tilt_and_its_force_is_its_energy_s_slope() {
    let grid = Grid::shared(9, 0.3);
    let tilt = Tilt { down_x_rad: 0.1, down_z_rad: -0.2 };
    let experiment = Experiment { tilt, ..Experiment::default() };
    let mut model = Model::new(&grid, &fabric(), &experiment, 0.2);
    model.plate = scan2params::sim::energy::plate::PlateContact::none();
    let x: Vec<_> = (0..grid.vertices()).map(|v| grid.flat(v)).collect();
    let mut gradient = vec![Vector3::zeros(); x.len()];
    model.gradient(&x, &mut gradient);
    let moved = Vector3::new(0.01, -0.02, 0.03);
    let y: Vec<_> = x.iter().map(|p| p + moved).collect();
    let work: f64 = gradient.iter().map(|g| g.dot(&moved)).sum();
    let rise = model.body_energy_j(&y) - model.body_energy_j(&x);
    assert!((work / rise - 1.0).abs() < 1e-9, "{work:e} {rise:e}");
    let force = -gradient.iter().sum::<Vector3>();
    let mass: f64 = model.weight.mass_kg.iter().sum();
    assert!((force.norm() / (9.80665 * mass) - 1.0).abs() < 1e-12);
    // downhill is where it says
    assert!(force.x > 0.0 && force.z < 0.0 && force.y < 0.0);
}

#[test]
fn a_mesh_too_coarse_for_its_fabric_is_told_in_the_drape() {
    let soft = Fabric::from_paper_units([131e3, 164e3, 75e3, 300.0, 300.0, 300.0, 214.0]);
    let options =
        SimOptions { vertices: 21, fall_vertices: 21, iterations: 1, ..SimOptions::default() };
    let d = drape(&soft, &Drop::canonical(), &options);
    assert_eq!(d.warnings.len(), 1);
    assert!(d.warnings[0].to_string().contains("at least"), "{}", d.warnings[0]);
    let fine = SimOptions { vertices: 21, fall_vertices: 21, ..options };
    let stiff = Fabric { bending_weft_nm: 1e-3, bending_warp_nm: 1e-3, ..soft };
    let stiff = Fabric { bending_bias_nm: 1e-3, ..stiff };
    assert!(drape(&stiff, &Drop::canonical(), &fine).warnings.is_empty());
}

/// 142.5 mm from the clamp on 5 mm cells.
fn cut(degrees: f64) -> Cut {
    Cut { angle_rad: degrees.to_radians(), cell_m: 5e-3, along: 29, across: 6 }
}

/// Equal bending in all directions with this weight over stiffness on the strip of [`cut`], and
/// that stiffness \[N m\].
fn strip_fabric(gamma: f64) -> (Fabric, f64) {
    let rigidity_nm = 0.2 * 9.80665 * cut(0.0).clamped_length_m().powi(3) / gamma;
    let units = rigidity_nm / 1e-9;
    (Fabric::from_paper_units([1e6, 1e6, 1e6, units, units, units, 200.0]), rigidity_nm)
}

/// The curvature at which a rising law has this moment, both positive or both negative.
fn inverse(law: impl Fn(f64) -> f64, moment: f64) -> Option<f64> {
    let (mut low, mut high) = (0.0, 1e3);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if law(middle) < moment.abs() { low = middle } else { high = middle }
    }
    Some(low * moment.signum())
}

/// Distance of a strip's end from the known one, and of the known one from that of linear bending,
/// in lengths of the strip.
fn end_error(
    experiment: &Experiment,
    degrees: f64,
    gamma: f64,
    law: impl Fn(f64) -> f64,
) -> [f64; 2] {
    let length_m = cut(degrees).clamped_length_m();
    let strip = cantilever(&strip_fabric(gamma).0, &cut(degrees), experiment);
    assert!(strip.at_rest, "{degrees} {gamma}: {:e} N", strip.residual_n);
    let [reach, droop, _] = strip.end_m().map(|m| m / length_m);
    let exact = end_under(gamma, |moment| inverse(&law, moment)).unwrap();
    let linear = end_under(gamma, Some).unwrap();
    [
        (reach - exact.reach).hypot(droop - exact.droop),
        (linear.reach - exact.reach).hypot(linear.droop - exact.droop),
    ]
}

#[test]
fn bending_that_is_stiffer_to_one_side_bends_a_strip_as_the_elastica_with_that_law() {
    let length_m = cut(0.0).clamped_length_m();
    let smoothing = SMOOTHING_PER_M * length_m;
    for degrees in [0.0, 90.0, 45.0] {
        for a in [0.3, -0.3] {
            let asymmetric_bending = AsymmetricBending::uniform(a);
            let experiment = Experiment { asymmetric_bending, ..Experiment::default() };
            // A strip that hangs from a clamp bends towards its back. At 45 degrees weft and warp
            // have half of the curvature each, and the twist has the other half of the stiffness.
            let law = |k: f64| match degrees {
                45.0 => k * (1.0 - 0.5 * a * k / k.hypot(2.0 * smoothing)),
                _ => k * (1.0 - a * k / k.hypot(smoothing)),
            };
            let [error, effect] = end_error(&experiment, degrees, 10.0, law);
            println!("{degrees} {a}: {error:.1e} of {effect:.1e}");
            // observed: 4e-4 along the yarns; on the bias, where a strip can curl across, 2.8e-3
            let limit = if degrees == 45.0 { 4e-3 } else { 1e-3 };
            assert!(effect > 0.03 && error < limit, "{degrees} {a}: {error:e} of {effect:e}");
        }
    }
}

#[test]
fn each_direction_has_its_own_asymmetry() {
    let only = |weft: f64, warp: f64| Experiment {
        asymmetric_bending: AsymmetricBending { weft, warp },
        ..Experiment::default()
    };
    // (degrees from the warp, what moves this strip, what does not)
    let cases = [(0.0, only(0.0, 0.3), only(0.3, 0.0)), (90.0, only(0.3, 0.0), only(0.0, 0.3))];
    let droop = |degrees: f64, experiment: &Experiment| {
        cantilever(&strip_fabric(10.0).0, &cut(degrees), experiment).end_m()[1]
    };
    for (degrees, own, others) in cases {
        let linear = droop(degrees, &Experiment::default());
        let (own, others) = (droop(degrees, &own) - linear, droop(degrees, &others) - linear);
        assert!(own > 2e-3 && others.abs() < 1e-3 * own, "{degrees}: {own:e} {others:e}");
    }
}

#[test]
fn a_weightless_strip_keeps_its_natural_curvature_whatever_the_asymmetry() {
    let length_m = cut(0.0).clamped_length_m();
    let (fabric, _) = strip_fabric(1e-3);
    let curl = Curl::uniform([0.0, 8.0, 0.0]);
    for a in [0.0, 0.5, -0.5] {
        let asymmetric_bending = AsymmetricBending::uniform(a);
        let experiment = Experiment { asymmetric_bending, curl, ..Experiment::default() };
        let [reach, droop, _] = cantilever(&fabric, &cut(0.0), &experiment).end_m();
        let angle = 8.0 * length_m;
        let error = (reach - angle.sin() / 8.0).hypot(droop + (1.0 - angle.cos()) / 8.0);
        assert!(error < 3e-3 * length_m, "{a}: {error:e} m");
    }
}

/// `f(u)` of the friction in units of HB, in curvatures over the slip curvature.
fn grip(u: f64) -> f64 {
    if u.abs() < 1.0 { u * (2.0 - u.abs()) } else { u.signum() }
}

#[test]
fn hysteresis_bends_a_strip_as_the_elastica_with_b_k_plus_hb() {
    let length_m = cut(0.0).clamped_length_m();
    let gamma = 10.0;
    let (_, rigidity_nm) = strip_fabric(gamma);
    for slip_per_m in [2.0, 10.0] {
        // HB over B of 5 /m: a third of the moment at the clamp
        let hb_n = 5.0 * rigidity_nm;
        let hysteresis = Hysteresis { weft_n: hb_n, warp_n: hb_n, slip_per_m };
        let experiment = Experiment { hysteresis, ..Experiment::default() };
        // at 45 degrees each of two elements has half of the curvature
        for (degrees, slips) in [(0.0, 1.0), (90.0, 1.0), (45.0, 2.0)] {
            let slip = slip_per_m * slips * length_m;
            let law = |k: f64| k + 5.0 * length_m * grip(k / slip);
            let [error, effect] = end_error(&experiment, degrees, gamma, law);
            println!("{slip_per_m} {degrees}: {error:.1e} of {effect:.1e}");
            // observed: 1.9e-4 along the yarns; on the bias 8 % of the effect, since the strip
            // curls across, where that takes friction out of both elements
            let limit = if degrees == 45.0 { 0.1 * effect } else { 1e-3 };
            assert!(effect > 0.05 && error < limit, "{degrees}: {error:e} of {effect:e}");
        }
    }
}

#[test]
fn a_strip_without_its_weight_stays_bent_where_friction_balances_bending() {
    let (fabric, rigidity_nm) = strip_fabric(10.0);
    let (slip_per_m, hb_over_b) = (4.0, 3.0);
    let hb_n = hb_over_b * rigidity_nm;
    let hysteresis = Hysteresis { weft_n: hb_n, warp_n: hb_n, slip_per_m };
    let experiment = Experiment { hysteresis, ..Experiment::default() };
    let angles = |strip: &scan2params::sim::strip::Strip| -> Vec<f64> {
        let rows: Vec<Vector3> = (0..strip.grid.rows).map(|i| strip.row_m(i)).collect();
        rows.windows(2).map(|w| (w[0].y - w[1].y).atan2(w[1].x - w[0].x)).collect()
    };
    let [loaded, after] = unloaded(&fabric, &cut(0.0), &experiment);
    assert!(loaded.at_rest && after.at_rest);
    let (loaded, after) = (angles(&loaded), angles(&after));
    let mut expected = after[0];
    for turn in loaded.windows(2) {
        let under_weight = (turn[1] - turn[0]) / cut(0.0).cell_m;
        // the anchor is 0 while the cloth grips, then follows
        let anchor = (under_weight - slip_per_m).max(0.0);
        // unbending until B k + HB f = 0
        let (mut low, mut high) = (-under_weight, under_weight);
        for _ in 0..60 {
            let k = 0.5 * (low + high);
            let moment = k + hb_over_b * grip((k - anchor) / slip_per_m);
            if moment < 0.0 { low = k } else { high = k }
        }
        expected += low * cut(0.0).cell_m;
    }
    let (bent, last) = (loaded[loaded.len() - 1], after[after.len() - 1]);
    println!("end at {bent:.4} under weight, {last:.4} without, expected {expected:.4}");
    assert!(last > 0.1 && last < 0.5 * bent);
    assert!((last / expected - 1.0).abs() < 5e-3, "{last} {expected}");
    // elastic cloth is flat again
    let [_, elastic] = unloaded(&fabric, &cut(0.0), &Experiment::default());
    assert!(elastic.end_m()[1].abs() < 1e-6);
}

#[test]
fn cloth_with_friction_inside_comes_to_rest_and_drapes_stiffer() {
    // bending lengths of 14.6 and 6 mm; HB over B as that of a cotton broadcloth
    let soft = Fabric::from_paper_units([131e3, 164e3, 75e3, 450.0, 450.0, 450.0, 214.0]);
    for fabric in [fabric(), soft] {
        let hb_n = 50.0 * fabric.bending_weft_nm;
        let hysteresis = Hysteresis { weft_n: hb_n, warp_n: hb_n, ..Hysteresis::default() };
        let coefficient = |hysteresis| {
            let experiment = Experiment { hysteresis, ..Experiment::standard_cusick() };
            let options =
                SimOptions { vertices: 31, fall_vertices: 25, experiment, ..SimOptions::default() };
            let d = drape(&fabric, &Drop::canonical(), &options);
            let cell_n = fabric.density_kg_m2 * 9.80665 * d.grid.cell_area_m2();
            assert_eq!(d.stop, Stop::AtRest);
            assert!(d.residual_n < options.residual * cell_n);
            let area_m2 = outline_of(&d).area_m2();
            (drape_coefficient(area_m2, &experiment), d.effort.factorisations)
        };
        let ((without, plain), (with, factors)) =
            (coefficient(Hysteresis::default()), coefficient(hysteresis));
        // observed: 39.9 and 53.6, 12.0 and 13.7 %
        println!("{without:.1} % in {plain} factors, {with:.1} % in {factors}");
        assert!(with > without + 1.0, "{without} {with}");
    }
}

#[test]
fn a_drape_with_friction_inside_is_followed_with_its_anchors() {
    let hb_n = 50.0 * fabric().bending_weft_nm;
    let hysteresis = Hysteresis { weft_n: hb_n, warp_n: hb_n, slip_per_m: 2.0 };
    let experiment = Experiment { hysteresis, ..Experiment::default() };
    let options =
        SimOptions { vertices: 25, fall_vertices: 25, experiment, ..SimOptions::default() };
    let mut follower = Follower::drop(&fabric(), &Drop::canonical(), &options);
    assert_eq!(follower.drape().stop, Stop::AtRest);
    let rim = |follower: &Follower| follower.boundary();
    let apart = |a: &scan2params::base::Boundary, b: &scan2params::base::Boundary| {
        a.positions_m().zip(b.positions_m()).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max)
    };
    let start = rim(&follower);
    let how = FollowOptions::default();
    let here = *follower.setup();
    follower.follow(&here, &how).unwrap();
    assert!(apart(&start, &rim(&follower)) < 2e-5, "{:e}", apart(&start, &rim(&follower)));
    // heavier and back: friction keeps a part of what the weight has bent
    let heavier = Fabric { density_kg_m2: 1.5 * fabric().density_kg_m2, ..fabric() };
    let there = follower.follow(&Setup { fabric: heavier, ..here }, &how).unwrap();
    let bent = rim(&follower);
    let back = follower.follow(&here, &how).unwrap();
    assert!(there.stop == Stop::AtRest && back.stop == Stop::AtRest);
    let (went, kept) = (apart(&start, &bent), apart(&start, &rim(&follower)));
    println!("went {went:.4} m, {kept:.4} m of it kept, {} events", back.events.len());
    assert!(kept > 0.2 * went, "{kept:e} of {went:e}");
    // and to elastic cloth, which has no memory to carry, and back on
    let elastic = Setup { experiment: Experiment::default(), ..here };
    assert_eq!(follower.follow(&elastic, &how).unwrap().stop, Stop::AtRest);
    assert_eq!(follower.follow(&here, &how).unwrap().stop, Stop::AtRest);
}
