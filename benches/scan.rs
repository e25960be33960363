//! The stages of a scan: `cargo bench --bench scan`. Times are for comparing builds on
//! one machine; nothing is asserted.
//!
//! On a committed scan (99,000 points, half of them cloth) and on a cloud of 300,000
//! points spread evenly over a coarse drape that is simulated first.

use std::hint::black_box;
use std::path::Path;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use scan2params::base::Vector3;
use scan2params::base::clock::Stages;
use scan2params::fabric::Fabric;
use scan2params::geom::Cloud;
use scan2params::io::read_scan;
use scan2params::scan::{ScanOptions, WarpToward, boundary_in_stages};
use scan2params::sensor::{Scene, even};
use scan2params::sim::{Drop, DropStart, SimOptions, drape};

/// What is timed by itself: name, and the stages of the clock in it. Every stage is in one of them,
/// which the bench asserts.
const PARTS: [(&str, &[&str]); 3] = [
    ("frame", &["points and unit", "plate", "floor"]),
    (
        "surface and parameterisation",
        &[
            "cut to the cloth",
            "clusters",
            "strays",
            "smooth and normals",
            "parameterisation",
            "relaxation",
            "square",
        ],
    ),
    ("rim", &["sheet", "registration", "edge and rim", "uncertainty"]),
];

fn generated() -> Cloud {
    let knit = Fabric::from_paper_units([240e3, 310e3, 90e3, 5200.0, 3600.0, 4100.0, 260.0]);
    let options = SimOptions { vertices: 31, ..SimOptions::default() };
    let drape = drape(&knit, &Drop { start: DropStart::Canonical }, &options);
    even(&Scene::modified_cusick(drape.mesh()), 300_000, 0.15e-3, 1).expect("a scene")
}

fn bench(criterion: &mut Criterion) {
    let file =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/scans/mean_structured-light.ply");
    let mut group = criterion.benchmark_group("scan");
    group.sample_size(10).measurement_time(Duration::from_secs(10));
    group.bench_function("fixture/read", |b| {
        b.iter(|| read_scan(black_box(&file)).expect("a scan"))
    });
    let fixture = read_scan(&file).expect("a scan").0;
    let toward = |direction: Vector3| ScanOptions {
        warp_toward: Some(WarpToward::Direction(direction.into())),
        ..ScanOptions::default()
    };
    let cases =
        [("fixture", fixture, toward(-Vector3::x())), ("even", generated(), toward(Vector3::x()))];
    for (name, cloud, options) in &cases {
        let run = |stages: &mut Stages| {
            boundary_in_stages(cloud.clone(), options, stages).expect("a rim")
        };
        group.bench_function(format!("{name}/whole"), |b| b.iter(|| run(&mut Stages::off())));
        let mut clock = Stages::start();
        run(&mut clock);
        for stage in clock.noted() {
            let parts = PARTS.iter().filter(|(_, stages)| stages.contains(&stage.name)).count();
            assert_eq!(parts, 1, "stage `{}` is in {parts} of PARTS", stage.name);
        }
        for (part, stages) in PARTS {
            group.bench_function(format!("{name}/{part}"), |b| {
                b.iter_custom(|times| {
                    let mut sum = Duration::ZERO;
                    for _ in 0..times {
                        let mut clock = Stages::start();
                        run(&mut clock);
                        let of_part = clock.noted().iter().filter(|s| stages.contains(&s.name));
                        sum += of_part.map(|s| Duration::from_secs_f64(s.wall_s)).sum();
                    }
                    sum
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
