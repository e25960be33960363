//! `scan2params-lab verdict`: a table of what the verdict is made of.

use super::{Failure, Outcome, args};
use scan2params::estimate::Estimator;
use scan2params::fabric::Mixture;
use scan2params_lab::evaluate::scan::Setup;
use scan2params_lab::evaluate::verdict::{self, Case, Series};

pub(super) fn run(given: &args::Verdict) -> Outcome {
    let series = Series {
        prior: Mixture::named(&given.prior).map_err(Failure::usage)?,
        setup: Setup::named(&given.profile).map_err(Failure::usage)?,
        scale: given.scale,
        seed: given.seed,
        fabrics: given.first..given.first.saturating_add(given.count),
    };
    let tell = |case: &Case| eprintln!("{}", line(case, ""));
    let cases = series.run(&Estimator::shipped()?, tell)?;
    let columns = cases.iter().map(verdict::numbers).max_by_key(Vec::len).unwrap_or_default();
    let names: Vec<&str> = columns.iter().map(|column| column.0).collect();
    println!("index,verdict,grounds,{},refusal", names.join(","));
    for case in &cases {
        let numbers = verdict::numbers(case);
        let cell = |k: usize| numbers.get(k).map_or(String::new(), |n| format!("{:.4}", n.1));
        let cells: Vec<String> = (0..names.len()).map(cell).collect();
        println!("{}", line(case, &cells.join(",")));
    }
    let summary = verdict::Summary::of(&cases);
    println!("\nverdicts: {:?}\ngrounds: {:?}", summary.verdicts, summary.grounds);
    println!("\ncolumn,least,at_5_percent,median,at_95_percent,largest");
    for (name, values) in &summary.columns {
        let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
        let row = [0.0, 0.05, 0.5, 0.95, 1.0].map(|share| format!("{:.4}", at(share)));
        println!("{name},{}", row.join(","));
    }
    Ok(())
}

/// A case as a line of a table; `numbers` are the cells between the grounds and the refusal.
fn line(case: &Case, numbers: &str) -> String {
    match &case.answer {
        Ok(judged) => {
            let codes = verdict::codes(&judged.verdict).join(" ");
            format!("{},{},{codes},{numbers},", case.index, judged.verdict.level.name())
        }
        Err(refusal) => {
            let refusal = refusal.to_string().replace('"', "'");
            format!("{},refused,,{numbers},\"{refusal}\"", case.index)
        }
    }
}
