//! `scan2params-lab follow`: continuation beside fresh drapes.

use rayon::prelude::*;

use super::{Failure, Outcome, args};
use scan2params::fabric::{Mixture, MixtureError};
use scan2params::sim::{FollowOptions, SimOptions};
use scan2params_lab::evaluate::follow::{Sums, Walk, walk};

pub(crate) fn run(given: &args::Follow) -> Outcome {
    let priors = match &given.prior {
        Some(name) => vec![Mixture::named(name).map_err(Failure::usage)?],
        None => vec![Mixture::knit_2020(), Mixture::measured()],
    };
    let how = FollowOptions { halvings: given.halvings, ..FollowOptions::default() };
    for prior in &priors {
        println!("{}\n{}", prior.name(), Walk::COLUMNS);
        let sums = Sums::of(&walks(prior, given, &how)?);
        println!(
            "\nfresh_median_cpu_s, follow_median_cpu_s, follow_p95_cpu_s, legs, at_rest, \
             intersections, events, quiet_walks, quiet_median_cpu_s, quiet_95_cpu_s, return_median_mm, return_95_mm, return_most_mm"
        );
        println!(
            "{:.2}, {:.2}, {:.2}, {}, {}, {}, {}, {}, {:.2}, {:.2}, {:.3}, {:.3}, {:.3}\n",
            sums.fresh_median_cpu_s,
            sums.follow_median_cpu_s,
            sums.follow_p95_cpu_s,
            sums.walks,
            sums.at_rest,
            sums.intersections,
            sums.events,
            sums.quiet,
            sums.quiet_median_cpu_s,
            sums.quiet_p95_cpu_s,
            sums.quiet_return_median_mm,
            sums.quiet_return_p95_mm,
            sums.quiet_return_largest_mm
        );
        if given.json {
            println!("{}", serde_json::to_string(&sums)?);
        }
    }
    Ok(())
}

/// The walks of one prior on all cores, printed as they end.
fn walks(
    prior: &Mixture,
    given: &args::Follow,
    how: &FollowOptions,
) -> Result<Vec<Walk>, MixtureError> {
    let indices = given.first..given.first.saturating_add(given.count);
    let (send, receive) = std::sync::mpsc::channel();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            indices.into_par_iter().for_each_with(send, |send, index| {
                let options = SimOptions::default();
                let _ = send.send(walk(prior, given.seed, index, given.step, &options, how));
            });
        });
        let print = |walk: Walk| {
            println!("{}", walk.row());
            walk
        };
        receive.into_iter().map(|walk| walk.map(print)).collect()
    })
}
