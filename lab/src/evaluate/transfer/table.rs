//! How far found fabrics are from the true ones in experiments that the fit has not seen: one row
//! for each sensor, reader and shape.
//!
//! In: [`Transferred`]. Out: medians and 95th percentiles over fabrics \[mm, %\].

use serde::Serialize;

use super::shapes::{Reading, Shape, Tried};
use super::{Reader, Transferred};
use scan2params::numeric::robust;

/// One sensor, one reader, one shape.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Name of the sensor.
    pub sensor: String,
    /// Who found the fabrics.
    pub reader: Reader,
    /// The experiment.
    pub shape: Shape,
    /// Fabrics with sheets at rest.
    pub fabrics: usize,
    /// Distance of the mean drape coefficients of the drops: median, 95th percentile \[points\].
    pub coefficient: [f64; 2],
    /// The standard deviation of the true fabric's drops, median \[points\]; NaN for one drop.
    pub scatter: f64,
    /// Part of the fabrics whose mean coefficient lies within the true drops' least and largest;
    /// NaN for one drop.
    pub within_scatter: f64,
    /// Distance of the mean numbers of folds, median.
    pub folds: f64,
    /// Distance of the mean waves, median and 95th percentile \[mm\].
    pub waves_mm: [f64; 2],
    /// Distance of the mean depths of the hem, median and 95th percentile \[mm\].
    pub hem_mm: [f64; 2],
    /// Sheets continued from the true fabric's: distance of their coefficients, median and 95th
    /// percentile \[points\].
    pub continued: [f64; 2],
    /// Their hems' distance, place by place, median \[mm\].
    pub continued_mm: f64,
    /// Part of them that left the branch.
    pub left_branch: f64,
}

/// The bending lengths that cantilevers read, of one sensor and one reader.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Lengths {
    /// Name of the sensor.
    pub sensor: String,
    /// Who found the fabrics.
    pub reader: Reader,
    /// Fabrics.
    pub fabrics: usize,
    /// Distance from the true fabric's along weft, warp and bias: median \[%\].
    pub median: [f64; 3],
    /// The 95th percentile \[%\].
    pub at_95: [f64; 3],
}

/// Median and 95th percentile; NaN of none.
fn ends(values: &[f64]) -> [f64; 2] {
    [0.5, 0.95].map(|share| robust::quantile(values.to_vec(), share).unwrap_or(f64::NAN))
}

/// The mean of a number over readings.
fn mean(readings: &[Reading], of: fn(&Reading) -> f64) -> f64 {
    readings.iter().map(of).sum::<f64>() / readings.len() as f64
}

/// The sensors that found something, in the order of the run.
fn sensors(all: &[Transferred]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for found in all.iter().flat_map(|fabric| &fabric.found) {
        if !names.contains(&found.sensor) {
            names.push(found.sensor.clone());
        }
    }
    names
}

/// Each of a reader's answers from a sensor: its fabric, and its place among those found.
fn answers<'a>(
    all: &'a [Transferred],
    sensor: &'a str,
    reader: Reader,
) -> impl Iterator<Item = (&'a Transferred, usize)> {
    all.iter().filter_map(move |fabric| {
        let mut found = fabric.found.iter();
        let at = found.position(|found| found.sensor == sensor && found.reader == reader)?;
        Some((fabric, at))
    })
}

/// Rows of all sensors, readers and shapes.
#[must_use]
pub fn rows(all: &[Transferred]) -> Vec<Row> {
    let mut rows = Vec::new();
    for sensor in sensors(all) {
        for reader in Reader::ALL {
            for shape in Shape::ALL {
                let tried: Vec<(&Tried, usize)> = answers(all, &sensor, reader)
                    .filter_map(|(fabric, at)| {
                        let tried = fabric.tried.iter().find(|tried| tried.shape == shape)?;
                        let both = !tried.truth.is_empty() && !tried.dropped[at].is_empty();
                        both.then_some((tried, at))
                    })
                    .collect();
                rows.push(Row::of(sensor.clone(), reader, shape, &tried));
            }
        }
    }
    rows
}

impl Row {
    /// The names of what [`Self::line`] gives.
    pub const COLUMNS: &str = "sensor, reader, shape, fabrics, coefficient_median, coefficient_95, \
         scatter_of_drops, within_scatter, folds, waves_median_mm, waves_95_mm, hem_median_mm, \
         hem_95_mm, continued_median, continued_95, continued_hem_mm, left_branch";

    fn of(sensor: String, reader: Reader, shape: Shape, tried: &[(&Tried, usize)]) -> Self {
        let apart = |of: fn(&Reading) -> f64| -> Vec<f64> {
            let pairs = tried.iter().map(|(tried, at)| (&tried.truth, &tried.dropped[*at]));
            pairs.map(|(truth, found)| (mean(found, of) - mean(truth, of)).abs()).collect()
        };
        let within = |(tried, at): &&(&Tried, usize)| {
            let own = mean(&tried.dropped[*at], |r| r.coefficient);
            let truth = tried.truth.iter().map(|reading| reading.coefficient);
            let [low, high] = truth.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
                [low.min(v), high.max(v)]
            });
            (low..=high).contains(&own)
        };
        let scattered = || tried.iter().filter(|(tried, _)| tried.truth.len() > 1);
        let continued = || {
            let pairs = tried.iter().filter_map(|(tried, at)| {
                Some((tried.truth.first()?, tried.continued[*at].as_ref()?))
            });
            pairs.collect::<Vec<_>>()
        };
        let of_continued = |of: &dyn Fn(&Reading, &super::shapes::Continued) -> f64| {
            continued().into_iter().map(|(truth, own)| of(truth, own)).collect::<Vec<f64>>()
        };
        let left = of_continued(&|_, own| f64::from(u8::from(own.left_branch)));
        let deviations: Vec<f64> =
            tried.iter().filter_map(|(tried, _)| deviation(&tried.truth)).collect();
        Self {
            fabrics: tried.len(),
            coefficient: ends(&apart(|r| r.coefficient)),
            scatter: ends(&deviations)[0],
            within_scatter: scattered().filter(within).count() as f64 / scattered().count() as f64,
            folds: ends(&apart(|r| r.folds))[0],
            waves_mm: ends(&apart(|r| r.waves_mm)),
            hem_mm: ends(&apart(|r| r.hem_mm)),
            continued: ends(&of_continued(&|truth, own| {
                (own.reading.coefficient - truth.coefficient).abs()
            })),
            continued_mm: ends(&of_continued(&|_, own| own.distance_mm))[0],
            left_branch: left.iter().sum::<f64>() / left.len() as f64,
            sensor,
            reader,
            shape,
        }
    }

    /// As a line of a table.
    #[must_use]
    pub fn line(&self) -> String {
        let [low, high] = self.coefficient;
        let ([waves, waves_95], [hem, hem_95]) = (self.waves_mm, self.hem_mm);
        let [continued, continued_95] = self.continued;
        format!(
            "{}, {}, {}, {}, {low:.2}, {high:.2}, {:.2}, {:.2}, {:.1}, {waves:.2}, {waves_95:.2}, \
             {hem:.2}, {hem_95:.2}, {continued:.2}, {continued_95:.2}, {:.2}, {:.2}",
            self.sensor,
            self.reader.name(),
            self.shape.name(),
            self.fabrics,
            self.scatter,
            self.within_scatter,
            self.folds,
            self.continued_mm,
            self.left_branch
        )
    }
}

/// Standard deviation of the coefficients of some drops; `None` for fewer than two.
fn deviation(readings: &[Reading]) -> Option<f64> {
    let middle = mean(readings, |r| r.coefficient);
    let squares: f64 = readings.iter().map(|r| (r.coefficient - middle).powi(2)).sum();
    (readings.len() > 1).then(|| (squares / (readings.len() - 1) as f64).sqrt())
}

/// The cantilevers of all sensors and readers.
#[must_use]
pub fn lengths(all: &[Transferred]) -> Vec<Lengths> {
    let mut rows = Vec::new();
    for sensor in sensors(all) {
        for reader in Reader::ALL {
            let pairs: Vec<([f64; 3], [f64; 3])> = answers(all, &sensor, reader)
                .filter_map(|(fabric, at)| {
                    Some((fabric.cantilevers_mm?, fabric.found[at].cantilevers_mm?))
                })
                .collect();
            let apart = |k: usize| -> Vec<f64> {
                pairs.iter().map(|(truth, own)| 100.0 * (own[k] / truth[k] - 1.0).abs()).collect()
            };
            let ends = [0, 1, 2].map(|k| ends(&apart(k)));
            rows.push(Lengths {
                sensor: sensor.clone(),
                reader,
                fabrics: pairs.len(),
                median: ends.map(|[median, _]| median),
                at_95: ends.map(|[_, high]| high),
            });
        }
    }
    rows
}

impl Lengths {
    /// The names of what [`Self::line`] gives.
    pub const COLUMNS: &str = "sensor, reader, fabrics, weft_median_pct, warp_median_pct, \
         bias_median_pct, weft_95_pct, warp_95_pct, bias_95_pct";

    /// As a line of a table.
    #[must_use]
    pub fn line(&self) -> String {
        let list = |values: [f64; 3]| values.map(|v| format!("{v:.2}")).join(", ");
        let (sensor, reader) = (&self.sensor, self.reader.name());
        format!("{sensor}, {reader}, {}, {}, {}", self.fabrics, list(self.median), list(self.at_95))
    }
}

#[cfg(test)]
mod tests {
    use super::super::Found;
    use super::super::shapes::Continued;
    use super::*;

    fn reading(coefficient: f64) -> Reading {
        Reading { coefficient, folds: 7.0, waves_mm: 10.0, hem_mm: 40.0 }
    }

    #[test]
    fn rows_compare_the_means_of_drops_with_the_scatter_of_the_truth() {
        let found = |reader| Found {
            sensor: "handheld".into(),
            reader,
            fabric: [1.0; 7],
            cantilevers_mm: Some([10.2, 10.0, 9.9]),
        };
        let continued = |coefficient| {
            let reading = reading(coefficient);
            Some(Continued { reading, distance_mm: 0.5, left_branch: false })
        };
        let fabric = Transferred {
            prior: "measured".into(),
            index: 0,
            seed: 1,
            drops: 2,
            truth: [1.0; 7],
            found: Reader::ALL.map(found).to_vec(),
            refused: Vec::new(),
            tried: vec![Tried {
                shape: Shape::Cusick,
                truth: vec![reading(50.0), reading(54.0)],
                dropped: vec![vec![reading(52.0), reading(54.0)], vec![reading(60.0)]],
                continued: vec![continued(51.0), None],
            }],
            cantilevers_mm: Some([10.0, 10.0, 10.0]),
        };
        let rows = rows(std::slice::from_ref(&fabric));
        let row = |reader, shape| {
            rows.iter().find(|row| row.reader == reader && row.shape == shape).unwrap()
        };
        let refined = row(Reader::Refined, Shape::Cusick);
        assert_eq!((refined.fabrics, refined.coefficient), (1, [1.0, 1.0]));
        assert!((refined.scatter - 8.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!((refined.within_scatter, refined.left_branch), (1.0, 0.0));
        assert_eq!((refined.continued, refined.continued_mm), ([1.0, 1.0], 0.5));
        let network = row(Reader::Network, Shape::Cusick);
        assert_eq!((network.coefficient, network.within_scatter), ([8.0, 8.0], 0.0));
        assert_eq!(row(Reader::Refined, Shape::Skirt).fabrics, 0);
        for row in &rows {
            assert_eq!(row.line().split(", ").count(), Row::COLUMNS.split(", ").count());
        }
        let lengths = lengths(&[fabric]);
        assert!((lengths[0].median[0] - 2.0).abs() < 1e-9);
        assert_eq!(lengths[0].line().split(", ").count(), Lengths::COLUMNS.split(", ").count());
    }
}
