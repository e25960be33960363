//! Fabrics draped again from their estimates, for `scan2params-lab redrape`: Figs. 8 and 9 of the
//! paper.
//!
//! In: fabrics of a prior. Out: one [`Redraped`] each: the fabric falls canonically on the
//! network's cells, its rim is answered for by the network, by a linear regression where there is
//! one, and by the fit where that is wanted, and each answer falls as the true fabric did; so
//! does, where wanted, the true fabric with stiffnesses that are wrong by a known share.
//! What counts is the mean distance of the rims, and the shares below 5 and 10 mm ([`Tally`]). The
//! drops, the fit and the comparison are those of `scan2params-lab refine --canonical`
//! ([`Series`]).
//!
//! Where it fails: a soft knit's drop ends on another branch with hardly another fabric, so that
//! its distance says little of its stiffnesses; hence the tally by bending length. The paper's
//! figures are of another simulator and other fabrics.

use image::RgbImage;
use rayon::prelude::*;
use serde::Serialize;

use super::case_error::CaseError;
use super::linear::Linear;
use super::refine::{NoAnswer, Series, Sight};
use scan2params::base::units::M_PER_MM;
use scan2params::fabric::{Fabric, STIFFNESSES};
use scan2params::picture::chart::{Axis, COLOURS, Chart, Legend, Mark, Series as Drawn};
use scan2params::sim::experiment::bending_length_m;

/// Distances of which the shares below are counted \[mm\]: the paper's 5 and 10.
pub const WITHIN_MM: [f64; 2] = [5.0, 10.0];
/// Bending length from which on cloth falls where its like fell (docs/validation/refine.md, "Rims
/// alone") \[mm\].
pub const STIFFER_MM: f64 = 6.0;
/// Bars of the histogram, and the end of its axis \[mm\]; what lies beyond is in the last bar.
const BAR_MM: f64 = 2.5;
const MOST_MM: f64 = 40.0;

/// Who answers for a rim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum By {
    /// The shipped network.
    Network,
    /// Linear regression.
    Linear,
    /// The fit that the network begins.
    Refined,
    /// Nobody: the true fabric with all stiffnesses somewhat higher, which shows what the drop
    /// itself makes of an error.
    Off,
}

impl By {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Network, Self::Linear, Self::Refined, Self::Off];

    /// The word in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Network => "network",
            Self::Linear => "linear",
            Self::Refined => "refined",
            Self::Off => "off",
        }
    }
}

/// One fabric, draped again.
#[derive(Debug)]
pub struct Redraped {
    /// Its place in the run.
    pub index: u64,
    /// The true fabric.
    pub fabric: Fabric,
    /// Mean distance of each answer's rim from the true one \[m\], in the order of [`By::ALL`]: NaN
    /// where that does not come to rest, `None` where nobody was asked; or why the fabric has no
    /// true drape.
    pub distances_m: Result<[Option<f64>; 4], NoAnswer>,
}

/// Who answers beside the network.
#[derive(Clone, Copy, Debug, Default)]
pub struct Comparison<'a> {
    /// Linear regression, where there is one.
    pub linear: Option<&'a Linear>,
    /// Whether the fit does, which takes some ten drapes a fabric.
    pub refine: bool,
    /// By what share all stiffnesses of the true fabric are raised for [`By::Off`].
    pub off: Option<f64>,
}

/// Drapes the fabrics of a series and their answers, on all cores, in order; `tell` hears of each
/// as it ends. The series has one prior and canonical drops.
///
/// # Errors
/// The first case that cannot be made.
pub fn run(
    series: &Series<'_>,
    comparison: &Comparison<'_>,
    tell: impl Fn(&Redraped) + Sync,
) -> Result<Vec<Redraped>, CaseError> {
    let indices: Vec<u64> = series.fabrics.clone().collect();
    let cases = indices.into_par_iter().with_max_len(1).map(|index| {
        let case = of_fabric(series, comparison, index)?;
        tell(&case);
        Ok(case)
    });
    cases.collect()
}

fn of_fabric(
    series: &Series<'_>,
    comparison: &Comparison<'_>,
    index: u64,
) -> Result<Redraped, CaseError> {
    let prior = &series.priors[0];
    let fabric = prior.sample(series.seed, index)?;
    let truth = match series.truth(prior, &fabric, index, 0)? {
        Ok(truth) => truth,
        Err((stop, intersections)) => {
            let distances_m = Err(NoAnswer::Truth { stop, intersections });
            return Ok(Redraped { index, fabric, distances_m });
        }
    };
    let rim = &truth.1;
    let estimate = series.estimator.estimate(rim, fabric.density_kg_m2, true);
    let linear_m = comparison
        .linear
        .map(|linear| series.redropped_m(rim, &linear.fabric(rim, fabric.density_kg_m2)));
    let off_m = comparison.off.map(|share| series.redropped_m(rim, &stiffer(&fabric, share)));
    let refined_m = if comparison.refine {
        // no fit is far off, as no rest is
        let answer =
            series.answer(&Sight::Rim, std::slice::from_ref(&truth), &fabric, (index, None))?;
        Some(answer.map_or(f64::NAN, |answer| answer.redropped_m[0]))
    } else {
        None
    };
    let distances_m = match estimate {
        Ok(own) => Ok([Some(series.redropped_m(rim, &own.fabric)), linear_m, refined_m, off_m]),
        Err(error) => Err(error.into()),
    };
    Ok(Redraped { index, fabric, distances_m })
}

/// The fabric with all stiffnesses higher by a share: as a drape depends on stiffness over weight
/// alone, a lighter one.
fn stiffer(fabric: &Fabric, share: f64) -> Fabric {
    let mut values = fabric.to_paper_units();
    values[..STIFFNESSES].iter_mut().for_each(|value| *value *= 1.0 + share);
    Fabric::from_paper_units(values)
}

impl Redraped {
    /// Names of the columns of [`Self::row`].
    pub const COLUMNS: &str =
        "fabric, bending_length_mm, network_mm, linear_mm, refined_mm, off_mm, left_out";

    /// As a row of a table; `far` for an answer that does not come to rest.
    #[must_use]
    pub fn row(&self) -> String {
        let begun = format!("{}, {:.1}", self.index, self.length_mm());
        match &self.distances_m {
            Err(why) => format!("{begun}, , , , , {}", why.to_string().replace(", ", "; ")),
            Ok(all) => {
                let shown = all.map(|distance| match distance {
                    None => String::new(),
                    Some(m) if m.is_nan() => "far".to_owned(),
                    Some(m) => format!("{:.2}", m / M_PER_MM),
                });
                format!("{begun}, {}, ", shown.join(", "))
            }
        }
    }

    fn length_mm(&self) -> f64 {
        bending_length_m(&self.fabric) / M_PER_MM
    }

    /// Distance of an answer \[mm\]; infinite where it does not come to rest.
    fn distance_mm(&self, by: By) -> Option<f64> {
        let m = self.distances_m.as_ref().ok()?[by as usize]?;
        Some(if m.is_nan() { f64::INFINITY } else { m / M_PER_MM })
    }
}

/// Some fabrics by bending length \[mm\]: what they are called, and whether one is of them.
type Class = (&'static str, fn(f64) -> bool);

/// How near the answers of one come, of some fabrics.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tally {
    /// Who answers.
    pub by: By,
    /// Which fabrics: `all`, or by bending length.
    pub group: &'static str,
    /// Fabrics with an answer.
    pub fabrics: usize,
    /// Shares of them below 5 and 10 mm.
    pub within: [f64; 2],
    /// Median distance \[mm\]; null in files where half of them do not come to rest.
    pub median_mm: f64,
}

impl Tally {
    /// Names of the columns of [`Self::row`].
    pub const COLUMNS: &str = "by, fabrics_are, fabrics, below_5_mm, below_10_mm, median_mm";

    /// Of each who answers, all fabrics and by bending length.
    #[must_use]
    pub fn all(cases: &[Redraped]) -> Vec<Self> {
        let groups: [Class; 3] = [
            ("all", |_| true),
            ("6 mm and above", |mm| mm >= STIFFER_MM),
            ("below 6 mm", |mm| mm < STIFFER_MM),
        ];
        let of = |by: By, group: &'static str, inside: fn(f64) -> bool| {
            let own = cases.iter().filter(|case| inside(case.length_mm()));
            let mut distances: Vec<f64> = own.filter_map(|case| case.distance_mm(by)).collect();
            distances.sort_by(f64::total_cmp);
            let count = distances.len();
            let within = |mm| distances.iter().filter(|d| **d < mm).count() as f64 / count as f64;
            let median_mm = *distances.get(count / 2)?;
            Some(Self { by, group, fabrics: count, within: WITHIN_MM.map(within), median_mm })
        };
        let each =
            By::ALL.into_iter().flat_map(|by| groups.map(|(group, inside)| of(by, group, inside)));
        each.flatten().collect()
    }

    /// As a row of a table.
    #[must_use]
    pub fn row(&self) -> String {
        let Self { by, group, fabrics, within: [five, ten], median_mm } = self;
        format!("{}, {group}, {fabrics}, {five:.3}, {ten:.3}, {median_mm:.2}", by.name())
    }
}

/// Histogram of the distances, those of each who answers beside each other; the last bar has all
/// that lie beyond.
#[must_use]
pub fn histogram(cases: &[Redraped]) -> RgbImage {
    let bars = (MOST_MM / BAR_MM).round() as usize;
    let asked: Vec<By> = By::ALL
        .into_iter()
        .filter(|by| cases.iter().any(|case| case.distance_mm(*by).is_some()))
        .collect();
    let wide = BAR_MM / (asked.len() + 1) as f64;
    let drawn = asked.iter().enumerate().map(|(k, by)| {
        let mut counts = vec![0_usize; bars];
        for mm in cases.iter().filter_map(|case| case.distance_mm(*by)) {
            counts[((mm / BAR_MM) as usize).min(bars - 1)] += 1;
        }
        let at = |bar: usize| bar as f64 * BAR_MM + (k as f64 + 1.0) * wide;
        let points = counts.iter().enumerate().filter(|(_, count)| **count > 0);
        let points = points.flat_map(|(bar, count)| [[at(bar), 0.0], [at(bar), *count as f64]]);
        Drawn {
            name: by.name().to_owned(),
            points: points.collect(),
            mark: Mark::Bar,
            colour: COLOURS[k],
        }
    });
    Chart {
        title: "Fabrics by the distance of their rims draped again".to_owned(),
        x: Axis { label: format!("mean distance [mm], {BAR_MM} mm a bar"), log: false },
        y: Axis { label: "fabrics".to_owned(), log: false },
        series: drawn.collect(),
        legend: Legend::Right,
    }
    .draw()
}

#[cfg(test)]
mod tests {
    use super::*;
    use scan2params::sim::Stop;

    /// A fabric of a bending length of 4 or 15 mm.
    fn case(stiff: bool, distances_m: [Option<f64>; 4]) -> Redraped {
        let b = if stiff { 6600.0 } else { 126.0 };
        let fabric = Fabric::from_paper_units([1e5, 1e5, 5e4, b, b, b, 200.0]);
        Redraped { index: 3, fabric, distances_m: Ok(distances_m) }
    }

    #[test]
    fn shares_count_what_does_not_come_to_rest_as_far() {
        let mut cases = vec![
            case(true, [Some(1e-3), Some(6e-3), None, None]),
            case(true, [Some(4.9e-3), Some(f64::NAN), None, None]),
            case(false, [Some(7e-3), Some(20e-3), None, None]),
            case(false, [Some(f64::NAN), Some(2e-3), None, None]),
        ];
        let lost = NoAnswer::Truth { stop: Stop::AtRest, intersections: 2 };
        cases.push(Redraped { distances_m: Err(lost), ..case(true, [None; 4]) });
        let tallies = Tally::all(&cases);
        let of = |by: By, group: &str| {
            let tally = tallies.iter().find(|t| t.by == by && t.group == group).unwrap();
            (tally.fabrics, tally.within)
        };
        assert_eq!(of(By::Network, "all"), (4, [0.5, 0.75]));
        assert_eq!(of(By::Network, "6 mm and above"), (2, [1.0, 1.0]));
        assert_eq!(of(By::Network, "below 6 mm"), (2, [0.0, 0.5]));
        assert_eq!(of(By::Linear, "all"), (4, [0.25, 0.5]));
        // nobody refined, and nothing was put off
        assert!(tallies.iter().all(|t| t.by != By::Off));
        assert!(tallies.iter().all(|t| t.by != By::Refined));
        let columns = Redraped::COLUMNS.split(", ").count();
        assert!(cases.iter().all(|case| case.row().split(", ").count() == columns));
        assert_eq!(cases[1].row(), "3, 15.0, 4.90, far, , , ");
    }

    #[test]
    fn a_fabric_put_off_keeps_its_density_and_is_stiffer_all_over() {
        let fabric = case(true, [None; 4]).fabric;
        let [off, own] = [stiffer(&fabric, 0.02), fabric].map(|f| f.to_paper_units());
        for k in 0..STIFFNESSES {
            assert!((off[k] / own[k] - 1.02).abs() < 1e-12);
        }
        assert_eq!(off[STIFFNESSES], own[STIFFNESSES]);
    }

    #[test]
    fn the_histogram_has_a_bar_where_fabrics_are() {
        let bare = histogram(&[case(true, [Some(1e-3), None, None, None])]);
        let more = histogram(&[
            case(true, [Some(1e-3), None, None, None]),
            case(true, [Some(1.0), None, None, None]),
        ]);
        assert_ne!(bare, more);
    }
}
