//! What an experiment changes, against what is known of it.

use nalgebra::Rotation3;
use scan2params::base::Vector3;
use scan2params::fabric::Fabric;
use scan2params::sim::experiment::{Outline, Specimen, Tilt};
use scan2params::sim::grid::Grid;
use scan2params::sim::model::Model;
use scan2params::sim::{Drape, Drop, Experiment, Plate, SimOptions, Stop, drape};

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
        let mass: f64 = model.mass_kg.iter().sum();
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
            let own = Vector3::y() * (model.mass_kg[v] * 9.80665);
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
    let mass: f64 = model.mass_kg.iter().sum();
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
