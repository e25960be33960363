//! What the shipped estimate promises of drapes that the model has not seen: errors, widths and
//! coverage. They are 64 (`fixtures/rims`), 37 on finer cells, and four drops each of 16 fabrics.
//! An estimator that ignores the scan breaks these promises, and so does each planted fault.
//! On the same rims: the linear regression with which `scan2params-lab redrape` compares the
//! network.

use std::sync::OnceLock;

use crate::promises::{self, hold, promise};
use scan2params::dataset::{Manifest, Row, read_folder};
use scan2params::estimate::{Estimator, SWAPPED};
use scan2params::fabric::{Fabric, Mixture, STIFFNESSES};
use scan2params_lab::evaluate::estimate::repeats::Repeats;
use scan2params_lab::evaluate::estimate::{
    Answer, Baseline, Scores, answer, check_folder, converged, noisy,
};
use scan2params_lab::evaluate::linear::Linear;
use scan2params_lab::evaluate::rim_noise::RimNoise;

fn rims() -> Vec<Row> {
    of_folder("fixtures/rims")
}

fn of_folder(name: &str) -> Vec<Row> {
    converged(read_folder(&promises::root().join(name)).unwrap()).unwrap()
}

fn scores(answers: &[Answer], rows: &[Row]) -> Scores {
    let truths: Vec<Fabric> = rows.iter().map(|row| row.fabric).collect();
    Scores::of(&truths, answers, Mixture::union().limits())
}

/// The answers of the shipped estimator on the 64 rims as they are.
fn answers() -> &'static [Answer] {
    static ANSWERS: OnceLock<Vec<Answer>> = OnceLock::new();
    ANSWERS.get_or_init(|| answers_to(rims()))
}

fn answers_to(rows: impl IntoIterator<Item = Row>) -> Vec<Answer> {
    let estimator = Estimator::shipped().unwrap();
    rows.into_iter().map(|row| answer(&estimator, &row).unwrap()).collect()
}

/// Scores of the shipped estimator's answers changed by `after`.
fn scores_after(after: impl Fn(Answer) -> Answer) -> Scores {
    scores(&answers().iter().copied().map(after).collect::<Vec<_>>(), &rims())
}

/// Scores of the shipped estimator on rims changed by `change`; the truth stays.
fn scores_of(rows: &[Row], change: impl Fn(Row) -> Row) -> Scores {
    scores(&answers_to(rows.iter().cloned().map(change)), rows)
}

/// The figures that are promised, by id.
fn figures(scores: &Scores) -> [(&'static str, f64); 8] {
    [
        ("estimate.rmse", scores.rmse),
        ("estimate.r2", scores.r2),
        ("estimate.least_r2", scores.least_r2()),
        ("estimate.error", scores.worst_median_abs_ln_error()),
        ("estimate.coverage", scores.coverage),
        ("estimate.width", scores.half_width_factor),
        ("estimate.widest", scores.widest_factor()),
        ("estimate.novel", scores.novel_share),
    ]
}

fn broken(scores: &Scores) -> Vec<&'static str> {
    let broken = figures(scores).into_iter().filter(|(id, value)| !promise(id).is_kept_by(*value));
    broken.map(|(id, _)| id).collect()
}

#[test]
fn the_rims_are_of_this_simulator_and_new_to_the_model() {
    for (name, count, vertices) in [
        ("fixtures/rims", 64, 61),
        ("fixtures/rims_finer", 37, 121),
        ("fixtures/rims_repeats", 64, 61),
    ] {
        let manifest = Manifest::read(&promises::root().join(name)).unwrap();
        check_folder(&Estimator::shipped().unwrap(), &manifest).unwrap();
        assert_eq!(manifest.simulator["vertices"], vertices, "{name}");
        // what the fixture says it is, it is: each fabric is that of the prior, the seed and the
        // index
        let prior = Mixture::named(&manifest.prior).unwrap();
        assert_eq!(prior.sha256(), manifest.prior_sha256);
        let rows = of_folder(name);
        assert_eq!(rows.len(), count, "{name}");
        for row in &rows {
            let drawn = prior.sample(manifest.seed, row.fabric_index).unwrap().to_paper_units();
            let same = drawn.iter().zip(row.fabric.to_paper_units());
            assert!(same.into_iter().all(|(a, b)| (a / b - 1.0).abs() < 1e-9), "{}", row.index);
        }
    }
}

#[test]
fn on_finer_cells_which_are_most_like_cloth_it_is_as_good_as_promised() {
    let rows = of_folder("fixtures/rims_finer");
    let answers = answers_to(rows.clone());
    let found = scores(&answers, &rows);
    hold("estimate.rmse_finer", found.rmse);
    hold("estimate.coverage_finer", found.coverage);
    // as a network answers that knows coarse cells alone: stretch and shear by a quarter too low
    let low = |mut answer: Answer| {
        for i in 0..3 {
            answer.value[i] *= 0.75;
            answer.interval90[i] = answer.interval90[i].map(|end| 0.75 * end);
        }
        answer
    };
    let low = scores(&answers.into_iter().map(low).collect::<Vec<_>>(), &rows);
    println!("stretch and shear a quarter too low: {:.4} {:.3}", low.rmse, low.coverage);
    assert!(!promise("estimate.rmse_finer").is_kept_by(low.rmse));
    assert!(!promise("estimate.coverage_finer").is_kept_by(low.coverage));
}

/// What the drops of one fabric tell together, of answers changed by `after`.
fn together(rows: &[Row], answers: &[Answer], after: impl Fn(usize, Answer) -> Answer) -> Repeats {
    let truths: Vec<Fabric> = rows.iter().map(|row| row.fabric).collect();
    let fabric_of: Vec<u64> = rows.iter().map(|row| row.fabric_index).collect();
    let answers: Vec<Answer> = answers.iter().enumerate().map(|(k, a)| after(k, *a)).collect();
    Repeats::of(&truths, &fabric_of, &answers, Mixture::union().limits()).unwrap()
}

#[test]
fn drops_of_a_fabric_tell_more_than_one_and_their_interval_holds() {
    let rows = of_folder("fixtures/rims_repeats");
    let answers = answers_to(rows.clone());
    let found = together(&rows, &answers, |_, answer| answer);
    assert_eq!((found.fabrics, found.drops), (16, 64));
    let less = |found: &Repeats| found.all.rmse_together / found.all.rmse_of_one;
    hold("repeats.error", less(&found));
    hold("repeats.interval", found.all.interval_holds);
    hold("repeats.two", found.all.two_hold);
    // as if the first drop had been scanned four times
    let first = |k: usize, _: Answer| answers[k - k % 4];
    let same = together(&rows, &answers, first);
    let narrow = |_: usize, answer: Answer| Answer {
        interval90: std::array::from_fn(|i| {
            answer.interval90[i].map(|end| answer.value[i] * (end / answer.value[i]).sqrt())
        }),
        ..answer
    };
    let narrow = together(&rows, &answers, narrow);
    println!(
        "one drop four times {:.3}, intervals half as wide {:.3}, of two {:.3}",
        less(&same),
        narrow.all.interval_holds,
        narrow.all.two_hold
    );
    assert!(!promise("repeats.error").is_kept_by(less(&same)));
    assert!(!promise("repeats.interval").is_kept_by(narrow.all.interval_holds));
    assert!(!promise("repeats.two").is_kept_by(narrow.all.two_hold));
}

#[test]
fn errors_widths_and_coverage_are_as_promised() {
    let scores = scores_after(|answer| answer);
    for (id, value) in figures(&scores) {
        hold(id, value);
    }
}

#[test]
fn intervals_ask_for_the_noise_of_the_rim() {
    let noise = Estimator::shipped().unwrap().model().record["noise"].clone();
    let trained: RimNoise = serde_json::from_value(noise).unwrap();
    let much = RimNoise { smooth_mm: 3.0 * trained.smooth_mm, ..trained };
    let rows = noisy(&rims(), &much, 1);
    hold("estimate.coverage_noise", scores_of(&rows, |row| row).coverage);
    let unsaid = |mut row: Row| {
        let points = row.drape.boundary.positions_m().collect::<Vec<_>>();
        row.drape.boundary = scan2params::base::Boundary::exact(points).unwrap();
        row
    };
    // a planted fault needs no more than every second rim
    let half: Vec<Row> = rows.into_iter().step_by(2).collect();
    let unsaid = scores_of(&half, unsaid).coverage;
    println!("rims that do not say how noisy they are: {unsaid:.3}");
    assert!(!promise("estimate.coverage_noise").is_kept_by(unsaid));
}

#[test]
fn an_estimator_that_ignores_the_scan_breaks_the_promises() {
    let rows = rims();
    let baseline = Baseline::of(&Mixture::union()).unwrap();
    let scores = scores(&vec![baseline.answer(); rows.len()], &rows);
    println!("{:?}", figures(&scores));
    let broken = broken(&scores);
    for id in [
        "estimate.rmse",
        "estimate.r2",
        "estimate.least_r2",
        "estimate.error",
        "estimate.width",
        "estimate.widest",
    ] {
        assert!(broken.contains(&id), "{id} is kept by an estimator that ignores the scan");
    }
}

#[test]
fn planted_faults_break_a_promise() {
    let scaled = |factor: f64| {
        move |mut row: Row| {
            let points = row.drape.boundary.positions_m().map(|p| p * factor);
            row.drape.boundary = scan2params::base::Boundary::exact(points).unwrap();
            row
        }
    };
    let turned = |mut row: Row| {
        row.drape.boundary = row.drape.boundary.rotated(1);
        row
    };
    let heavier = |mut row: Row| {
        row.fabric.density_kg_m2 *= 1.3;
        row
    };
    let value = |factor: f64| {
        move |answer: Answer| Answer {
            value: answer.value.map(|v| v * factor),
            interval90: answer.interval90.map(|ends| ends.map(|v| v * factor)),
            ..answer
        }
    };
    let width = |factor: f64| {
        move |answer: Answer| Answer {
            interval90: answer.interval90.map(|[low, high]| {
                let (middle, half) = ((low * high).sqrt(), (high / low).sqrt().powf(factor));
                [middle / half, middle * half]
            }),
            ..answer
        }
    };
    // A fault of the rims is planted in a quarter of them, which keep the promises unchanged.
    let quarter: Vec<Row> = rims().into_iter().step_by(4).collect();
    let own: Vec<Answer> = answers().iter().copied().step_by(4).collect();
    let own = scores(&own, &quarter);
    println!("a quarter of the rims: {:.3?}", figures(&own));
    let [rmse, error] = ["estimate.rmse", "estimate.error"];
    let holds = |found: &Scores| !broken(found).iter().any(|id| *id == rmse || *id == error);
    assert!(holds(&own), "{:?}", broken(&own));
    for (fault, scores) in [
        ("weft and warp exchanged", scores_of(&quarter, turned)),
        ("rims 3 % too large", scores_of(&quarter, scaled(1.03))),
        ("a density 30 % too high", scores_of(&quarter, heavier)),
    ] {
        println!("{fault}: {:.3?}", figures(&scores));
        assert!(!holds(&scores), "{fault} breaks no promise");
    }
    for (fault, scores) in [
        ("values and intervals 1.3 times the truth", scores_after(value(1.3))),
        ("intervals two thirds as wide", scores_after(width(0.67))),
        ("intervals 1.5 times as wide", scores_after(width(1.5))),
    ] {
        println!("{fault}: {:.3?}", figures(&scores));
        assert!(!broken(&scores).is_empty(), "{fault} breaks no promise");
    }
}

/// Mean over rims and stiffnesses of the natural logarithm of value over truth, without its sign.
fn linear_error(linear: &Linear, rows: &[Row]) -> f64 {
    let of_row = |row: &Row| {
        let said = linear.fabric(&row.drape.boundary, row.fabric.density_kg_m2).in_si();
        let truth = row.fabric.in_si();
        (0..STIFFNESSES).map(|i| (said[i] / truth[i]).ln().abs()).sum::<f64>()
    };
    rows.iter().map(of_row).sum::<f64>() / (rows.len() * STIFFNESSES) as f64
}

#[test]
fn a_linear_regression_follows_its_own_drapes_and_says_something_of_others() {
    let (rows, prior) = (rims(), Mixture::union());
    let linear = Linear::fit(&rows[..48], &prior).unwrap();
    let (own, others) = (linear_error(&linear, &rows[..48]), linear_error(&linear, &rows[48..]));
    println!("{own:.3} {others:.3}");
    // observed: 0.22 and 0.86; the prior's mean scores 1.5 and more
    assert!(own < 0.28 && others < 1.1, "{own} {others}");
    assert!(Linear::fit(&[], &prior).is_err());
}

#[test]
fn to_a_linear_regression_a_rim_turned_by_a_quarter_has_weft_and_warp_exchanged() {
    let (rows, prior) = (rims(), Mixture::union());
    let linear = Linear::fit(&rows[..32], &prior).unwrap();
    let (rim, density) = (&rows[40].drape.boundary, rows[40].fabric.density_kg_m2);
    let plain = linear.fabric(rim, density).in_si();
    let turned = linear.fabric(&rim.rotated(1), density).in_si();
    for i in 0..STIFFNESSES {
        assert!((turned[i] / plain[SWAPPED[i]] - 1.0).abs() < 1e-6, "{plain:?} {turned:?}");
    }
}
