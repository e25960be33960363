//! `scan2params-lab refine`: refinement held against known fabrics.

use super::{Failure, Outcome, args};
use scan2params::base::units::M_PER_MM;
use scan2params::estimate::Estimator;
use scan2params::fabric::Mixture;
use scan2params::io::output;
use scan2params::refine::FitOptions;
use scan2params::sim::Fall;
use scan2params::sim::experiment::bending_length_m;
use scan2params_lab::evaluate::refine::{Begin, Case, Series, Sight, Summary};

/// Bending length from which on cells of 5 mm resolve the folds \[mm\].
const STIFFER_MM: f64 = 10.0;

pub(super) fn run(given: &args::Refine) -> Outcome {
    let named = |name: &String| Mixture::named(name).map_err(Failure::usage);
    let sight = |name: &String| Sight::named(name).map_err(Failure::usage);
    let estimator = Estimator::shipped()?;
    if let Some(folder) = &given.keep {
        output::check_folder(folder).map_err(Failure::of_output)?;
        std::fs::create_dir_all(folder)?;
    }
    let usual = FitOptions::default();
    let vertices = given.vertices.unwrap_or(usual.vertices);
    // the options hold for stiff cloth too
    let stiff_vertices = given.vertices.map_or(usual.stiff_vertices, |[_, last]| last);
    let evaluations = given.evaluations.map_or(usual.evaluations, |most| [most; 2]);
    let series = Series {
        priors: given.priors.iter().map(named).collect::<Result<_, _>>()?,
        anywhere: given.anywhere,
        sights: given.profiles.iter().map(sight).collect::<Result<_, _>>()?,
        estimator: &estimator,
        begin: if given.from_prior { Begin::Prior } else { Begin::Network },
        options: FitOptions { vertices, stiff_vertices, evaluations, release: true, ..usual },
        seed: given.seed,
        fabrics: given.first..given.first.saturating_add(given.count),
        drops: given.drops,
        fall: if given.canonical { Fall::Canonical } else { Fall::Perturbed },
        truth_vertices: given.truth_vertices as usize,
        energy_drop: 0.0,
        keep: given.keep.clone(),
    };
    println!("{}", Case::COLUMNS);
    let cases = series.run(|case| println!("{}", case.row()))?;
    let mut sums = Vec::new();
    for sight in &series.sights {
        for (class, stiffer) in [("stiffer", true), ("softer", false)] {
            let inside = |case: &&Case| {
                let length_mm = bending_length_m(&case.fabric) / M_PER_MM;
                case.sensor == sight.name() && (length_mm >= STIFFER_MM) == stiffer
            };
            let group = format!("{} {class}", sight.name());
            sums.extend(Summary::of(&group, cases.iter().filter(inside)));
        }
    }
    print(&sums);
    if given.json {
        println!("{}", serde_json::to_string(&sums)?);
    }
    Ok(())
}

/// The table of the groups' figures.
fn print(sums: &[Summary]) {
    println!(
        "\ngroup, cases, answered, within_1_mm, within_2_mm, within_5_mm, rim_median_mm, held_within_1_mm, held_rim_median_mm, network_within_5_mm, network_rim_median_mm, floor_median_mm, turned_within_1_mm, turned_median_mm, redropped_within_5_mm, redropped_median_mm, bending_median, bending_95, stretch_median, \
         network_bending_median, balance_bending_median, held, bending_factor, cpu_median_s, cpu_95_s"
    );
    // refined and floor, refined and network; none of perturbed drops
    let both = |values: [Option<f64>; 2]| {
        values.map(|value| value.map_or("-".to_owned(), |value| format!("{value:.2}"))).join(" ")
    };
    for s in sums {
        println!(
            "{}, {}, {}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {:.2}, {}, {}, {}, {}, {:.3}, {:.3}, {:.3}, {:.3}, {:.3}, {}, {:.2}, {:.1}, {:.1}",
            s.group,
            s.cases,
            s.answered,
            s.within_mm[0],
            s.within_mm[1],
            s.within_mm[2],
            s.rim_median_mm,
            s.held_within_1_mm,
            s.held_rim_median_mm,
            s.network_within_5_mm,
            s.network_rim_median_mm,
            s.floor_median_mm,
            both(s.turned_within_1_mm.map(Some)),
            both(s.turned_median_mm.map(Some)),
            both(s.redropped_within_5_mm),
            both(s.redropped_median_mm),
            s.bending_median,
            s.bending_95,
            s.stretch_median,
            s.network_bending_median,
            s.balance_bending_median,
            s.held.map(|share| format!("{share:.2}")).join(" "),
            s.bending_factor,
            s.cpu_s[0],
            s.cpu_s[1]
        );
    }
}
