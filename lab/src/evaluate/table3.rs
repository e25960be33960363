//! The paper's Table 3 beside ours, for `scan2params-lab table3`.
//!
//! In: the shipped model's record (`shipped.json`), perhaps scores on a folder of drapes. Out:
//! [`Line`]s of RMSE and R2 on normalised outputs, each with the drapes that it was trained on and
//! tested on: none of these numbers says anything without them.
//!
//! Where it fails: the rows are of different drapes. The paper's are canonical drops of its knits
//! in its simulator, ours perturbed drops and walks of both priors.

use serde::Serialize;
use serde_json::Value;

use super::estimate::Scores;
use scan2params::estimate::Model;

/// One line of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// Whose.
    pub name: String,
    /// What was tested on.
    pub tested_on: String,
    /// Drapes trained on.
    pub trained: Option<u64>,
    /// Drapes tested on.
    pub tested: Option<u64>,
    /// Root mean square error of normalised outputs, mean over the six.
    pub rmse: f64,
    /// Share of variance explained, mean over the six.
    pub r2: f64,
    /// The errors of each stiffness, where known.
    pub rmse_each: Option<Vec<f64>>,
    /// The shares of each.
    pub r2_each: Option<Vec<f64>>,
}

/// Drapes that the paper made, nine tenths to train (its section V).
const PAPER_DRAPES: [u64; 2] = [90_000, 10_000];
/// Table 3 of the paper: RMSE and R2 on its test drapes; it does not give R2 of all.
const PAPER: [(&str, f64, f64); 7] = [
    ("SNN", 0.019_75, 0.973_35),
    ("NN", 0.019_90, 0.973_23),
    ("SNN/2", 0.020_95, f64::NAN),
    ("SNN/4", 0.023_71, f64::NAN),
    ("SNN/B", 0.022_71, f64::NAN),
    ("LR", 0.039_97, 0.889_08),
    ("LR-D", 0.049_08, f64::NAN),
];
/// What our networks were tested on: key of the metrics, and what it is.
const TESTS: [(&str, &str); 4] = [
    ("test", "its test split, clean"),
    ("test_noisy", "its test split, scan noise"),
    (OTHER_TEST, "falls of other fabrics, clean"),
    ("other_test_noisy", "falls of other fabrics, scan noise"),
];
const OTHER_TEST: &str = "other_test";
/// The linear regression's metrics, likewise.
const LINEAR: [(&str, &str); 2] = [
    ("linear_regression", "its test split, clean"),
    ("linear_regression_noisy", "its test split, scan noise"),
];

/// The paper's lines, then those of the record.
#[must_use]
pub fn lines(model: &Model) -> Vec<Line> {
    let [trained, tested] = PAPER_DRAPES.map(Some);
    let paper = PAPER.iter().map(|(name, rmse, r2)| Line {
        name: format!("paper, {name}"),
        tested_on: "canonical drops of its knits".to_owned(),
        trained,
        tested,
        rmse: *rmse,
        r2: *r2,
        rmse_each: None,
        r2_each: None,
    });
    let record = |key: &str| model.record.get(key);
    let networks = record("beside").and_then(Value::as_object).into_iter().flatten();
    let networks = networks.map(|(kind, metrics)| (shown(kind), Some(metrics), &TESTS[..]));
    let own = std::iter::once((network(model), record("metrics"), &TESTS[..]));
    let linear = std::iter::once(("ours, LR".to_owned(), record("metrics"), &LINEAR[..]));
    let ours = own.chain(networks).chain(linear).flat_map(|(name, metrics, tests)| {
        let line = move |(key, tested_on): &(&str, &str)| {
            recorded(model, &name, tested_on, (key, metrics?.get(key)?))
        };
        tests.iter().filter_map(line).collect::<Vec<_>>()
    });
    paper.chain(ours).collect()
}

/// A line of the record: the metrics of one network on one test, with the key of that.
fn recorded(
    model: &Model,
    name: &str,
    tested_on: &str,
    (key, metrics): (&str, &Value),
) -> Option<Line> {
    let rows = |key: &str| model.record.get("rows").and_then(|rows| rows[key].as_u64());
    let each = |key: &str| -> Option<Vec<f64>> {
        metrics[key].as_array()?.iter().map(Value::as_f64).collect()
    };
    Some(Line {
        name: name.to_owned(),
        tested_on: tested_on.to_owned(),
        trained: rows("train"),
        tested: rows(if key.starts_with(OTHER_TEST) { OTHER_TEST } else { "test" }),
        rmse: metrics["rmse"].as_f64()?,
        r2: metrics["r2"].as_f64()?,
        rmse_each: each("rmse_each"),
        r2_each: each("r2_each"),
    })
}

/// The model's network.
fn network(model: &Model) -> String {
    let kind = model.record.get("network").and_then(|network| network["kind"].as_str());
    shown(kind.unwrap_or("network"))
}

/// A network of ours by its kind: `snn8` is the paper's, an eighth as wide.
fn shown(kind: &str) -> String {
    match kind.strip_prefix("snn") {
        Some("" | "1") => "ours, SNN".to_owned(),
        Some(divided) => format!("ours, SNN/{divided}"),
        None => format!("ours, {kind}"),
    }
}

/// The line of scores measured now.
#[must_use]
pub fn measured(model: &Model, tested_on: &str, scores: &Scores) -> Line {
    let rows = model.record.get("rows").and_then(|rows| rows["train"].as_u64());
    Line {
        name: network(model),
        tested_on: tested_on.to_owned(),
        trained: rows,
        tested: Some(scores.drapes as u64),
        rmse: scores.rmse,
        r2: scores.r2,
        rmse_each: Some(scores.parameters.iter().map(|p| p.rmse).collect()),
        r2_each: Some(scores.parameters.iter().map(|p| p.r2).collect()),
    }
}

impl Line {
    /// Names of the columns of [`Self::row`].
    pub const COLUMNS: &str = "by, tested on, drapes_trained, drapes_tested, rmse, r2, \
         rmse_each (S^u S^v H B^u B^v B^h), r2_each";

    /// As a row of a table.
    #[must_use]
    pub fn row(&self) -> String {
        let count = |n: Option<u64>| n.map_or("not recorded".to_owned(), |n| n.to_string());
        let r2 = if self.r2.is_nan() { "not stated".to_owned() } else { format!("{:.4}", self.r2) };
        let each = |values: &Option<Vec<f64>>| {
            let list = |v: &Vec<f64>| v.iter().map(|v| format!("{v:.3}")).collect::<Vec<_>>();
            values.as_ref().map_or("not stated".to_owned(), |v| list(v).join(" "))
        };
        format!(
            "{} | {} | {} | {} | {:.5} | {r2} | {} | {}",
            self.name,
            self.tested_on,
            count(self.trained),
            count(self.tested),
            self.rmse,
            each(&self.rmse_each),
            each(&self.r2_each)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scan2params::estimate::Estimator;

    #[test]
    fn every_line_has_its_errors_and_ours_have_the_sizes_of_their_data() {
        let estimator = Estimator::shipped().unwrap();
        let all = lines(estimator.model());
        // the shipped network, the paper's on the same drapes, linear regression
        assert_eq!(all.len(), PAPER.len() + 2 * TESTS.len() + LINEAR.len());
        let ours: Vec<&Line> = all.iter().filter(|line| line.name.starts_with("ours")).collect();
        for line in &ours {
            assert!(line.trained.is_some_and(|rows| rows > 1000), "{line:?}");
            let each = line.rmse_each.as_ref().unwrap();
            let mean = each.iter().sum::<f64>() / each.len() as f64;
            assert!((mean - line.rmse).abs() < 1e-9, "{line:?}");
        }
        let rmse = |name: &str, tested_on: &str| {
            let line = ours.iter().find(|line| line.name == name && line.tested_on == tested_on);
            line.unwrap().rmse
        };
        let clean = TESTS[0].1;
        assert!(rmse("ours, ring", clean) < rmse("ours, ring", TESTS[1].1));
        for (_, tested_on) in TESTS {
            assert!(rmse("ours, ring", tested_on) < rmse("ours, SNN/8", tested_on), "{tested_on}");
        }
        assert!(rmse("ours, SNN/8", clean) < rmse("ours, LR", clean));
        assert_eq!(all[0].row().split(" | ").count(), 8);
        assert_eq!([shown("snn4"), shown("snn1")], ["ours, SNN/4", "ours, SNN"]);
    }
}
