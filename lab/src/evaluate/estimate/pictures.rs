//! Pictures of answers beside the true fabrics, as in Figs. 2, 4 and 7 of Ju & Choi 2020.
//!
//! In: true fabrics and what was answered for each. Out: charts, six to an image, of stiffnesses in
//! the paper's units. A drape knows stiffness over density alone, so what [`pairs`] shows is of
//! stiffness at 1 g/m^2: with the densities in it all six would go together though no drape says
//! so.

use image::RgbImage;

use super::Answer;
use scan2params::fabric::{Fabric, STIFFNESSES, TABLE_2};
use scan2params::picture::chart::{Axis, COLOURS, Chart, Legend, Mark, Series, grid};

/// Charts to a row.
const COLUMNS: usize = 3;
/// Pairs of stiffnesses that are drawn over each other: those within stretch and within bending,
/// and one from each to the other.
const PAIRS: [[usize; 2]; 6] = [[0, 1], [0, 2], [3, 4], [3, 5], [0, 3], [2, 5]];

/// A chart for each stiffness: the answer over the truth, with the 90 % interval as a bar and the
/// line on which both are the same.
#[must_use]
pub fn answers(truths: &[Fabric], answers: &[Answer]) -> RgbImage {
    let charts: Vec<Chart> = (0..STIFFNESSES).map(|i| answers_of(i, truths, answers)).collect();
    grid(&charts, COLUMNS)
}

fn answers_of(i: usize, truths: &[Fabric], answers: &[Answer]) -> Chart {
    let (key, symbol, unit) = (TABLE_2[i].key, TABLE_2[i].symbol, TABLE_2[i].unit);
    let truth: Vec<f64> = truths.iter().map(|fabric| fabric.to_paper_units()[i]).collect();
    let value: Vec<f64> = answers.iter().map(|answer| answer.value[i]).collect();
    let bars = truth.iter().zip(answers);
    let bars = bars.flat_map(|(t, answer)| answer.interval90[i].map(|end| [*t, end]));
    let held = truths.iter().zip(answers).filter(|(t, answer)| answer.holds(t)[i]);
    let percent = 100.0 * held.count() as f64 / answers.len() as f64;
    let ends = [f64::min, f64::max].map(|of| truth.iter().copied().fold(truth[0], of));
    let series =
        |name: String, points, mark, k: usize| Series { name, points, mark, colour: COLOURS[k] };
    let dots = truth.iter().zip(&value).map(|(t, v)| [*t, *v]);
    Chart {
        title: format!("{key} ({symbol}): r {:.3} of the logarithms", correlation(&truth, &value)),
        x: Axis { label: format!("truth [{unit}]"), log: true },
        y: Axis { label: format!("answer [{unit}]"), log: true },
        series: vec![
            series(format!("90 % interval: {percent:.0} % hold"), bars.collect(), Mark::Bar, 5),
            series("answer = truth".into(), ends.map(|end| [end, end]).to_vec(), Mark::Line, 1),
            series(format!("{} drapes", answers.len()), dots.collect(), Mark::Cross, 0),
        ],
        legend: Legend::Left,
    }
}

/// Charts of one stiffness over another, at 1 g/m^2, of true fabrics and of answers: whether the
/// answers go together as the fabrics do.
#[must_use]
pub fn pairs(truths: &[Fabric], answers: &[Answer]) -> RgbImage {
    let charts: Vec<Chart> = PAIRS.iter().map(|pair| pair_of(*pair, truths, answers)).collect();
    grid(&charts, COLUMNS)
}

fn pair_of(pair: [usize; 2], truths: &[Fabric], answers: &[Answer]) -> Chart {
    let density = |fabric: &Fabric| fabric.to_paper_units()[STIFFNESSES];
    let truth = |i: usize| -> Vec<f64> {
        truths.iter().map(|fabric| fabric.to_paper_units()[i] / density(fabric)).collect()
    };
    let answer = |i: usize| -> Vec<f64> {
        answers.iter().zip(truths).map(|(a, fabric)| a.value[i] / density(fabric)).collect()
    };
    let series = |name: &str, [x, y]: [Vec<f64>; 2], k: usize| Series {
        name: format!("{name}: r {:.2}", correlation(&x, &y)),
        points: x.iter().zip(&y).map(|(x, y)| [*x, *y]).collect(),
        mark: Mark::Cross,
        colour: COLOURS[k],
    };
    let [x, y] = pair.map(|i| TABLE_2[i]);
    let label = |key: &str| Axis { label: format!("{key} over density"), log: true };
    Chart {
        title: format!("{} and {}", x.symbol, y.symbol),
        x: label(x.key),
        y: label(y.key),
        series: vec![
            series("true fabrics", pair.map(truth), 5),
            series("answers", pair.map(answer), 0),
        ],
        legend: Legend::Left,
    }
}

/// Correlation of the logarithms of two rows of positive numbers; NaN where one does not vary.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let centred = |values: &[f64]| -> Vec<f64> {
        let logs: Vec<f64> = values.iter().map(|v| v.ln()).collect();
        let mean = logs.iter().sum::<f64>() / logs.len() as f64;
        logs.iter().map(|v| v - mean).collect()
    };
    let (a, b) = (centred(a), centred(b));
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    dot(&a, &b) / (dot(&a, &a) * dot(&b, &b)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer_of(fabric: &Fabric, factor: f64) -> Answer {
        let [a, b, c, d, e, f, _] = fabric.to_paper_units();
        let value = [a, b, c, d, e, f];
        Answer { value, interval90: value.map(|v| [v / factor, v * factor]), novel: false }
    }

    #[test]
    fn a_correlation_is_that_of_logarithms_whatever_the_scale() {
        let a = [1.0, 10.0, 100.0, 1000.0];
        assert!((correlation(&a, &a.map(|v| 7.0 * v * v)) - 1.0).abs() < 1e-12);
        assert!((correlation(&a, &a.map(|v| 1.0 / v)) + 1.0).abs() < 1e-12);
        // by hand: logarithms 0 1 2 3 and 0 1 0 1 have 1 / sqrt(5 * 1)
        let b = [1.0, 10.0, 1.0, 10.0];
        assert!((correlation(&a, &b) - 1.0 / 5_f64.sqrt()).abs() < 1e-12);
        assert!(correlation(&a, &[2.0; 4]).is_nan());
    }

    #[test]
    fn exact_answers_lie_on_the_line_and_on_the_true_fabrics() {
        let prior = scan2params::fabric::Mixture::union();
        let truths: Vec<Fabric> = (0..40).map(|k| prior.sample(3, k).unwrap()).collect();
        let exact: Vec<Answer> = truths.iter().map(|fabric| answer_of(fabric, 1.2)).collect();
        for i in 0..STIFFNESSES {
            let chart = answers_of(i, &truths, &exact);
            assert!(chart.title.contains("r 1.000"), "{}", chart.title);
            assert!(chart.series[0].name.contains("100 % hold"), "{}", chart.series[0].name);
            assert_eq!(chart.series[0].points.len(), 2 * truths.len());
            assert!(chart.series[2].points.iter().all(|[x, y]| (x / y - 1.0).abs() < 1e-12));
        }
        for pair in PAIRS {
            let chart = pair_of(pair, &truths, &exact);
            assert_eq!(chart.series[0].points, chart.series[1].points);
        }
        assert_eq!(
            answers(&truths, &exact).width(),
            3 * grid(&[pair_of([0, 1], &truths, &exact)], 1).width()
        );
        assert_eq!(pairs(&truths, &exact).height(), answers(&truths, &exact).height());
    }
}
