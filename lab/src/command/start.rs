//! `scan2params-lab start`: where scanned drapes come to rest when they start from the scan.

use super::{Failure, Outcome, args};
use scan2params::base::units::M_PER_MM;
use scan2params::fabric::Mixture;
use scan2params::io::output;
use scan2params::report::files;
use scan2params_lab::evaluate::scan::Setup;
use scan2params_lab::evaluate::start::{CLASSES_M, Case, Series, Start, Summary, picture};

/// The columns that are summed up for each start.
const SUMMARY: &str = "ends, at_rest, folds_as_true, from_true_median_mm, from_true_95_mm, \
     from_true_most_mm, from_scan_median_mm, from_scan_95_mm, from_scan_most_mm, cpu_median_s, \
     cpu_95_s, intersections";

pub(super) fn run(given: &args::Start) -> Outcome {
    let named = |name: &String| Mixture::named(name).map_err(Failure::usage);
    let series = Series {
        priors: given.priors.iter().map(named).collect::<Result<_, _>>()?,
        setup: Setup::named(&given.profile).map_err(Failure::usage)?,
        seed: given.seed,
        fabrics: given.first..given.first.saturating_add(given.count),
    };
    if let Some(folder) = &given.pictures {
        output::check_folder(folder).map_err(Failure::of_output)?;
        std::fs::create_dir_all(folder)?;
    }
    println!(
        "prior, fabric, bending_length_mm, folds, rim_error_mm, sheet_error_mm, crossings, start, \
         from_true_mm, from_scan_mm, folds_at_rest, stop, intersections, cpu_s, refusal"
    );
    let cases = series.run(print)?;
    if let Some(folder) = &given.pictures {
        for case in &cases {
            let Ok(led) = &case.answer else { continue };
            let name = format!("{}-{}.png", case.prior, case.index);
            files::picture(&folder.join(name), &picture(&case.drape, led))?;
        }
    }
    let mut groups: Vec<(String, Vec<&Case>)> = vec![("all".into(), cases.iter().collect())];
    for prior in &series.priors {
        let of = cases.iter().filter(|case| case.prior == prior.name()).collect();
        groups.push((prior.name().to_owned(), of));
    }
    for ends in CLASSES_M.windows(2) {
        let inside = |case: &&Case| (ends[0]..ends[1]).contains(&case.bending_length_m);
        let [low, high] = [ends[0], ends[1]].map(|end| end / M_PER_MM);
        groups.push((format!("{low:.0} to {high:.0} mm"), cases.iter().filter(inside).collect()));
    }
    println!("\ngroup, scans, refused, start, {SUMMARY}");
    let mut json = Vec::new();
    for (name, group) in &groups {
        let refused = group.iter().filter(|case| case.answer.is_err()).count();
        for start in Start::ALL {
            let Some(s) = Summary::of(group.iter().copied(), start) else { continue };
            println!("{name}, {}, {refused}, {}, {}", group.len(), start.name(), cells(&s));
            json.push(as_json(name, [group.len(), refused], start, &s));
        }
    }
    if given.json {
        println!("{}", serde_json::Value::from(json));
    }
    Ok(())
}

/// The rows of a case.
fn print(case: &Case) {
    let head = format!(
        "{}, {}, {:.1}, {}",
        case.prior,
        case.index,
        case.bending_length_m / M_PER_MM,
        case.drape.nodes
    );
    match &case.answer {
        Err(refusal) => println!("{head}, , , , , , , , , , , {refusal}"),
        Ok(led) => {
            for (start, rest) in Start::ALL.into_iter().zip(&led.rests) {
                println!(
                    "{head}, {:.2}, {:.2}, {}, {}, {:.2}, {:.2}, {}, {}, {}, {:.1}, ",
                    led.rim_error_m / M_PER_MM,
                    led.sheet_error_m / M_PER_MM,
                    led.crossings,
                    start.name(),
                    rest.from_true_m / M_PER_MM,
                    rest.from_scan_m / M_PER_MM,
                    rest.drape.nodes,
                    rest.drape.stop.name(),
                    rest.drape.intersections,
                    rest.cpu_s
                );
            }
        }
    }
}

fn cells(s: &Summary) -> String {
    let mm = |values: [f64; 3]| values.map(|m| format!("{:.2}", m / M_PER_MM)).join(", ");
    format!(
        "{}, {}, {}, {}, {}, {:.1}, {:.1}, {}",
        s.count,
        s.at_rest,
        s.folds,
        mm(s.from_true_m),
        mm(s.from_scan_m),
        s.cpu_s[0],
        s.cpu_s[1],
        s.intersections
    )
}

fn as_json(
    group: &str,
    [scans, refused]: [usize; 2],
    start: Start,
    s: &Summary,
) -> serde_json::Value {
    let mm = |values: [f64; 3]| values.map(|m| m / M_PER_MM);
    let [true_mm, scan_mm] = [s.from_true_m, s.from_scan_m].map(mm);
    serde_json::json!({
        "group": group, "scans": scans, "refused": refused, "start": start.name(),
        "ends": s.count, "at_rest": s.at_rest, "folds_as_true": s.folds,
        "from_true_median_mm": true_mm[0], "from_true_95_mm": true_mm[1],
        "from_true_most_mm": true_mm[2],
        "from_scan_median_mm": scan_mm[0], "from_scan_95_mm": scan_mm[1],
        "from_scan_most_mm": scan_mm[2],
        "cpu_median_s": s.cpu_s[0], "cpu_95_s": s.cpu_s[1], "intersections": s.intersections,
    })
}
