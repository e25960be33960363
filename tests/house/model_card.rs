//! The numbers of docs/model_card.md: they are those of the model's own file,
//! `src/estimate/model/shipped.json`.

use std::fmt::Write as _;

use crate::promises::root;
use serde_json::Value;

const BEGIN: &str = "<!-- model -->";
const END: &str = "<!-- /model -->";
/// Set to write the tables into docs/model_card.md instead of comparing them.
const WRITE: &str = "SCAN2PARAMS_WRITE_MODEL_CARD";

fn path(name: &str) -> std::path::PathBuf {
    root().join(name)
}

fn record() -> Value {
    let text = std::fs::read_to_string(path("src/estimate/model/shipped.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

fn list(values: &Value, show: impl Fn(f64) -> String) -> String {
    let values = values.as_array().unwrap().iter().map(|v| show(v.as_f64().unwrap()));
    values.collect::<Vec<_>>().join(" | ")
}

/// Side of a specimen's cells \[mm\].
fn cells_mm(vertices: f64) -> f64 {
    300.0 / (vertices - 1.0)
}

/// How many drapes at rest lie on which cells.
fn of_cells(by_vertices: &Value) -> String {
    let by_vertices = by_vertices.as_object().unwrap();
    let mut each: Vec<(u32, &Value)> =
        by_vertices.iter().map(|(vertices, rows)| (vertices.parse().unwrap(), rows)).collect();
    each.sort_by_key(|(vertices, _)| *vertices);
    let shown = each.iter().map(|(vertices, rows)| {
        format!("{rows} at rest on cells of {:.1} mm", cells_mm(f64::from(*vertices)))
    });
    shown.collect::<Vec<_>>().join(", ")
}

/// The tables as markdown.
fn rendered(record: &Value) -> String {
    let number = |pointer: &str| record.pointer(pointer).and_then(Value::as_f64).unwrap();
    let text = |key: &str| record[key].as_str().unwrap();
    let left_out: f64 =
        record["rows"]["left_out"].as_object().unwrap().values().filter_map(Value::as_f64).sum();
    let read = number("/rows/read");
    let inputs = record["input"]["min"].as_array().unwrap().len();
    let end = |which: &str| number(&format!("/input/{which}/{}", inputs - 1));
    let layers = |key: &str| list(&record["network"][key], |v| v.to_string()).replace(" | ", ", ");
    let mut out = String::from("| what | value |\n|---|---|\n");
    for (what, value) in [
        ("name", format!("`{}`", text("id"))),
        ("SHA-256 of the ONNX file", format!("`{}`", text("onnx_sha256"))),
        ("fabrics", format!("{} of the prior `{}`", record["fabrics"], text("prior"))),
        (
            "seed of the data, numerics of the simulator",
            format!("{}, {}", record["data_seed"], record["simulator_numerics"]),
        ),
        ("drapes", format!("{read}, of which {:.1} % at rest", 100.0 * (read - left_out) / read)),
        ("their cells", of_cells(&record["rows"]["by_vertices"])),
        (
            "of these to train, to calibrate, to test (split by walks)",
            format!(
                "{}, {}, {}",
                record["rows"]["train"], record["rows"]["calibration"], record["rows"]["test"]
            ),
        ),
        (
            "network, weights",
            format!(
                "{} of {}: {} channels, blocks of dilation {}, streams {} wide; {}",
                record["network"]["members"].as_u64().unwrap_or(1),
                record["network"]["kind"].as_str().unwrap(),
                layers("channels"),
                layers("dilations"),
                record["network"]["hidden"],
                text("weights")
            ),
        ),
        ("trained with", format!("`{}`", text("command"))),
        ("density for which it answers", format!("{} g/m^2", number("/input/asked_density_g_m2"))),
        ("densities in training", format!("{:.0} to {:.0} g/m^2", end("min"), end("max"))),
        ("a rim is novel from", format!("{:.2} mm (rms)", number("/input/novelty_limit_mm"))),
    ] {
        writeln!(out, "| {what} | {value} |").unwrap();
    }
    out += "\n| on | RMSE | R2 |\n|---|---|---|\n";
    let (own, beside) = (&record["metrics"], &record["beside"]["snn8"]);
    for (metrics, name) in [
        (&own["test"], "test split, clean"),
        (&own["test_noisy"], "test split, scan noise"),
        (&own["other_test"], "falls of other fabrics, clean"),
        (&own["other_test_noisy"], "falls of other fabrics, scan noise"),
        (&beside["test"], "as many SNN/8 of the same drapes, test split, clean"),
        (&beside["test_noisy"], "these SNN/8, test split, scan noise"),
        (&beside["other_test"], "these SNN/8, falls of other fabrics, clean"),
        (&own["linear_regression"], "linear regression, test split, clean"),
        (&own["linear_regression_noisy"], "linear regression, test split, scan noise"),
    ] {
        let of = |key: &str| metrics[key].as_f64();
        let (rmse, r2) = (of("rmse").unwrap(), of("r2").unwrap());
        writeln!(out, "| {name} | {rmse:.4} | {r2:.3} |").unwrap();
    }
    let test = &record["metrics"]["test"];
    let asked = number("/input/asked_density_g_m2");
    let intervals = &record["intervals_measured"];
    let falls = &intervals["tests"][0];
    out += "\n| | S^u | S^v | H | B^u | B^v | B^h |\n|---|---|---|---|---|---|---|\n";
    for (name, row) in [
        ("RMSE, test split, clean", list(&test["rmse_each"], |v| format!("{v:.3}"))),
        ("R2", list(&test["r2_each"], |v| format!("{v:.3}"))),
        (
            "factor of the median interval's ends, falls of other fabrics, scan noise",
            list(&falls["noisy"]["median_interval_factor_each"], |v| format!("{v:.2}")),
        ),
        (
            "conformal quantile, in sigmas",
            list(&record["interval"]["quantile"], |v| format!("{v:.2}")),
        ),
        (
            "least stiffness over density of the training",
            list(&record["output"]["ln_min"], |v| format!("{:.3}", v.exp() / asked)),
        ),
        ("most", list(&record["output"]["ln_max"], |v| format!("{:.0}", v.exp() / asked))),
    ] {
        writeln!(out, "| {name} | {row} |").unwrap();
    }
    out + &of_intervals(intervals)
}

/// How the intervals hold, as markdown.
fn of_intervals(record: &Value) -> String {
    let on = &record["calibrated_on"];
    let command = record["command"].as_str().unwrap();
    let widened = record.get("widened_on").map_or_else(String::new, |finer| {
        let cells = cells_mm(finer["vertices"].as_f64().unwrap());
        let factors = finer["factor"].as_array().unwrap().iter();
        let factors: Vec<String> = factors.map(|f| format!("{:.2}", f.as_f64().unwrap())).collect();
        format!(
            " and widened on {} falls of seed {} on cells of {cells:.1} mm, which hold 85 %, by {}",
            finer["drapes"],
            finer["seed"],
            factors.join(", ")
        )
    });
    let mut out = format!(
        "\nIntervals calibrated on {} falls of seed {}{widened} (`{command}`). Share of the 90 % intervals that hold the truth, all in all, and in each quarter of \
         the true bending length, softest first; then the share of the rims that are called novel, and the RMSE:\n\n| falls of other fabrics | | all | 1 | 2 | 3 | 4 | novel | RMSE |\n|---|---|---|---|---|---|---|---|---|\n",
        on["drapes"], on["seed"]
    );
    for test in record["tests"].as_array().unwrap() {
        let cells = cells_mm(test["vertices"].as_f64().unwrap());
        for (key, name) in [("clean", "clean"), ("noisy", "scan noise")] {
            let measured = &test[key];
            let quarters = list(&measured["coverage_quarters"], |v| format!("{v:.3}"));
            let all = measured["coverage"].as_f64().unwrap();
            let (drapes, seed) = (&test["drapes"], &test["seed"]);
            let [novel, rmse] = ["novel", "rmse"].map(|key| measured[key].as_f64().unwrap());
            writeln!(out, "| {drapes} of seed {seed}, cells of {cells:.1} mm | {name} | {all:.3} | {quarters} | {novel:.3} | {rmse:.4} |").unwrap();
        }
    }
    out
}

fn card_with(tables: &str) -> (String, String) {
    let before = std::fs::read_to_string(path("docs/model_card.md")).unwrap();
    let (head, rest) = before.split_once(BEGIN).expect("docs/model_card.md has no marker");
    let (_, tail) = rest.split_once(END).expect("docs/model_card.md has no end marker");
    let now = format!("{head}{BEGIN}\n\n{tables}\n{END}{tail}");
    (before, now)
}

#[test]
fn the_card_shows_the_numbers_of_the_model() {
    let (before, now) = card_with(&rendered(&record()));
    let write = std::env::var_os(WRITE).is_some();
    if write {
        std::fs::write(path("docs/model_card.md"), &now).unwrap();
    }
    assert!(
        write || now == before,
        "docs/model_card.md does not show src/estimate/model/shipped.json as it is: run \
         `{WRITE}=1 cargo test --release --test house model_card`"
    );
}

#[test]
fn another_model_has_another_card() {
    let own = rendered(&record());
    for pointer in [
        "/metrics/test/r2",
        "/metrics/other_test/rmse",
        "/interval/quantile/3",
        "/rows/train",
        "/intervals_measured/tests/0/noisy/coverage_quarters/3",
    ] {
        let mut other = record();
        let value = other.pointer_mut(pointer).unwrap();
        *value = serde_json::json!(value.as_f64().unwrap() + 1.0);
        assert_ne!(rendered(&other), own, "{pointer}");
    }
}
