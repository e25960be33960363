//! Whole drapes, pinned: no rim moves without `NUMERICS_VERSION` being raised.
//!
//! The rims are in `tests/pinned/numerics-N`, N being the version that they belong to; they are
//! made by
//!
//!     cargo test --release --test physics pinned -- --ignored
//!
//! which writes a rim only where there is none: a rim of a version that has been given out is not
//! to change, and the earlier ones that the simulator still knows are held too. A test that fails
//! here says that drapes have moved, and so that the shipped model, which was trained on drapes, no
//! longer belongs to this simulator.

use std::path::PathBuf;

use scan2params::base::{Boundary, Point3};
use scan2params::fabric::Fabric;
use scan2params::sim::experiment::{Curl, Softening, Specimen, Tilt};
use scan2params::sim::{
    Drape, Drop, Experiment, NUMERICS_VERSION, Numerics, Plate, SimOptions, Stop, drape,
};

/// Farthest that a point of a rim may lie from its pinned place \[m\].
///
/// Rounding that another machine's mathematical library or vector registers do otherwise moves a
/// point by 2e-8 m at most: so much does a density changed by 1e-13 of itself, observed on all of
/// these drapes. A constant changed by a thousandth of itself moves a point by more: those of the
/// fabric and the plate by 3e-7 m (slip) to 5e-2 m (radius, another branch), as the test
/// `a_thousandth_of_any_constant_moves_the_rim` holds; gravity 3e-2, the stiffness of the plate
/// 9e-6 and of its wall 5e-7, of self-contact 1.4e-6 and its gap 4e-5, the hold of the in-plane
/// twist 1.2e-5, D66 6e-6, the damping of the fall 1.7e-6 m (planted once). A wrong sign of one
/// tilt scores 1.5e-2 m, of the natural twist 3.3e-2 m.
const TOLERANCE_M: f64 = 2e-7;

struct Case {
    name: &'static str,
    version: u32,
    fabric: Fabric,
    drop: Drop,
    options: SimOptions,
}

/// Stiff enough that the way to rest is short and forgets its rounding.
fn stiff() -> Fabric {
    Fabric::from_paper_units([240e3, 310e3, 90e3, 9000.0, 7000.0, 8000.0, 260.0])
}

/// The versions that the simulator knows.
const VERSIONS: [(u32, Numerics); 2] = [(3, Numerics::THREE), (4, Numerics::FOUR)];

/// Everything beside the seven parameters that an experiment knew when these rims were pinned:
/// without asymmetric bending and hysteresis, which came later and are off in all of them.
fn with_all_effects() -> Experiment {
    let mut curl = Curl::uniform([2.0, -1.0, 0.5]);
    curl.edge.curvature_per_m = 20.0;
    (curl.line.curvature_per_m, curl.line.angle_rad) = (10.0, 0.5);
    Experiment {
        specimen: Specimen {
            warp_m: 0.31,
            skew_rad: 0.02,
            offset_m: [0.003, -0.002],
            rotation_rad: 0.2,
            ..Specimen::default()
        },
        tilt: Tilt { down_x_rad: 0.01, down_z_rad: -0.02 },
        // as the law went on when these rims were pinned
        softening: Softening {
            weft_m: 1e-3,
            warp_m: 2e-3,
            bias_m: 1.5e-3,
            measured_to_per_m: f64::INFINITY,
        },
        curl,
        fold_correction: 0.04,
        ..Experiment::default()
    }
}

fn cases((version, numerics): (u32, Numerics)) -> Vec<Case> {
    let canonical = Drop::canonical;
    let usual = Experiment::default();
    let options = |vertices: usize, fall_vertices: usize, experiment: Experiment| SimOptions {
        vertices,
        fall_vertices,
        experiment,
        numerics,
        ..SimOptions::default()
    };
    vec![
        // falls on a coarse grid and is carried to a finer one
        Case {
            name: "square",
            version,
            fabric: stiff(),
            drop: canonical(),
            options: options(31, 21, usual),
        },
        Case {
            name: "all-effects",
            version,
            fabric: stiff(),
            drop: canonical(),
            options: options(21, 21, with_all_effects()),
        },
        // folds as fine as the mesh, layers in contact
        Case {
            name: "soft",
            version,
            fabric: Fabric::from_paper_units([131e3, 164e3, 75e3, 150.0, 150.0, 150.0, 214.0]),
            drop: canonical(),
            options: options(17, 17, usual),
        },
        Case {
            name: "disc",
            version,
            fabric: stiff(),
            drop: canonical(),
            options: options(25, 25, Experiment::standard_cusick()),
        },
    ]
}

impl Case {
    fn path(&self) -> PathBuf {
        let pinned = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/pinned");
        pinned.join(format!("numerics-{}", self.version)).join(format!("{}.csv", self.name))
    }

    fn drape(&self) -> Drape {
        let drape = drape(&self.fabric, &self.drop, &self.options);
        assert_eq!(drape.stop, Stop::AtRest, "{}", self.name);
        drape
    }

    fn pinned(&self) -> Boundary {
        let path = self.path();
        let mut rows = csv::Reader::from_path(&path).unwrap_or_else(|error| {
            panic!(
                "{}: {error}. Numerics {} has no pinned rims yet: make them by \
                 `cargo test --release --test physics pinned -- --ignored` and commit them",
                path.display(),
                self.version
            )
        });
        let points = rows.deserialize().map(|row| {
            let [x, y, z]: [f64; 3] = row.unwrap();
            Point3::new(x, y, z) * 1e-3
        });
        Boundary::exact(points).unwrap()
    }
}

/// The largest distance of a point of one rim from that of the other \[m\].
fn farthest_m(a: &Boundary, b: &Boundary) -> f64 {
    a.positions_m().zip(b.positions_m()).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max)
}

#[test]
fn no_rim_has_moved() {
    assert_eq!(VERSIONS.last().map(|(version, _)| *version), Some(NUMERICS_VERSION));
    assert_eq!(VERSIONS.map(|(_, numerics)| numerics).last(), Some(&Numerics::default()));
    for case in VERSIONS.into_iter().flat_map(cases) {
        let moved_m = farthest_m(&case.drape().boundary, &case.pinned());
        println!("{} of numerics {}: {moved_m:.1e} m", case.name, case.version);
        assert!(
            moved_m < TOLERANCE_M,
            "the rim of `{}` has moved by {moved_m:.1e} m, limit {TOLERANCE_M:.0e} m, since \
             numerics {}. If the drapes are meant to change, raise \
             NUMERICS_VERSION in src/sim/mod.rs, make the rims of the new version by `cargo test \
             --release --test physics pinned -- --ignored`, and then data and model again \
             (scripts/README.md)",
            case.name,
            case.version
        );
    }
}

#[test]
#[ignore = "writes the rims of a new NUMERICS_VERSION"]
fn write_the_rims_of_a_new_version() {
    let all = VERSIONS.into_iter().flat_map(cases);
    for case in all.filter(|case| !case.path().exists()) {
        std::fs::create_dir_all(case.path().parent().unwrap()).unwrap();
        let mut file = csv::Writer::from_path(case.path()).unwrap();
        file.write_record(["x_mm", "y_mm", "z_mm"]).unwrap();
        for p in case.drape().boundary.positions_m() {
            let mm = [p.x, p.y, p.z].map(|metres| format!("{:.6}", metres * 1e3));
            file.write_record(mm).unwrap();
        }
        file.flush().unwrap();
    }
}

/// What the pinned rims are worth: each of these constants, changed by a thousandth of itself,
/// moves the rim by more than the tolerance.
#[test]
fn a_thousandth_of_any_constant_moves_the_rim() {
    let case = &cases(VERSIONS[VERSIONS.len() - 1])[0];
    let pinned = case.drape().boundary;
    let rim = |fabric: &Fabric, plate: Plate| {
        let experiment = Experiment { plate, ..Experiment::default() };
        drape(fabric, &case.drop, &SimOptions { experiment, ..case.options }).boundary
    };
    let mut weak = Vec::new();
    let mut look = |name: &str, rim: Boundary| {
        let moved_m = farthest_m(&rim, &pinned);
        println!("{name}: {moved_m:.1e} m");
        if moved_m < TOLERANCE_M {
            weak.push(format!("{name}: {moved_m:.1e} m"));
        }
    };
    let usual = Plate::default();
    let mut values = case.fabric.to_paper_units();
    for k in 0..values.len() {
        values[k] *= 1.001;
        look(scan2params::fabric::TABLE_2[k].key, rim(&Fabric::from_paper_units(values), usual));
        values[k] /= 1.001;
    }
    for (name, plate) in [
        ("plate radius", Plate { radius_m: 1.001 * usual.radius_m, ..usual }),
        ("edge radius", Plate { edge_radius_m: 1.001 * usual.edge_radius_m, ..usual }),
        ("gap", Plate { gap_m: 1.001 * usual.gap_m, ..usual }),
        ("friction", Plate { friction: 1.001 * usual.friction, ..usual }),
        ("slip", Plate { slip_m: 1.001 * usual.slip_m, ..usual }),
    ] {
        look(name, rim(&case.fabric, plate));
    }
    assert!(weak.is_empty(), "not felt by the pinned rim: {weak:?}");
}
