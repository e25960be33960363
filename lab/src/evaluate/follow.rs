//! Continuation beside fresh drapes: what a walk to a neighbouring fabric and back costs, and where
//! it ends.
//!
//! In: a prior, a seed, the length of a step. Out: one row a walk, and sums of them. A walk drops a
//! fabric of the prior (perturbed), follows it to a fabric that lies one step away in a random
//! direction of the seven logarithms, and back.

use rand::RngExt as _;

use scan2params::base::clock::thread_cpu_s;
use scan2params::base::seed;
use scan2params::base::units::M_PER_MM;
use scan2params::fabric::{Fabric, Mixture, MixtureError, PARAMETERS};
use scan2params::numeric::robust;
use scan2params::sim::experiment::bending_length_m;
use scan2params::sim::{
    Drape, Drop, DropStart, FollowError, FollowOptions, Followed, Follower, SimOptions, Stop,
};

/// A leg of a walk.
#[derive(Clone, Debug)]
pub struct Leg {
    /// How it was followed.
    pub followed: Followed,
    /// The sheet at its end.
    pub drape: Drape,
    /// Processor time \[s\]; NaN where the system does not tell it.
    pub cpu_s: f64,
}

/// A walk there and back.
#[derive(Clone, Debug)]
pub struct Walk {
    /// Its place in the run.
    pub index: u64,
    /// The fabric that it starts from.
    pub fabric: Fabric,
    /// The drape that it starts from.
    pub fresh: Drape,
    /// What that cost \[s\]; NaN where the system does not tell it.
    pub fresh_cpu_s: f64,
    /// The paths there and back; fewer where the sheet did not come to rest.
    pub legs: Vec<Leg>,
}

/// The fabric that lies `length` from `fabric` (root mean square of the seven logarithms) in a
/// direction drawn from `seed` and `index`, its bending made positive.
#[must_use]
pub fn neighbour(fabric: &Fabric, length: f64, seed: u64, index: u64) -> Fabric {
    let mut rng = seed::rng(seed, "walk", index);
    let direction: [f64; PARAMETERS] = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
    let norm = (direction.iter().map(|d| d * d).sum::<f64>() / PARAMETERS as f64).sqrt();
    let values = fabric.in_si();
    let moved = std::array::from_fn(|k| values[k] * (length * direction[k] / norm).exp());
    Fabric::from_si(moved).project_bending().0
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let before = thread_cpu_s();
    let result = work();
    let cpu_s = before.zip(thread_cpu_s()).map_or(f64::NAN, |(before, after)| after - before);
    (result, cpu_s)
}

/// Walk `index` of a run. A drape that does not come to rest has no legs.
///
/// # Errors
/// When the prior gives no fabric inside its range.
pub fn walk(
    prior: &Mixture,
    seed: u64,
    index: u64,
    length: f64,
    options: &SimOptions,
    how: &FollowOptions,
) -> Result<Walk, MixtureError> {
    let fabric = prior.sample(seed, index)?.project_bending().0;
    let drop = Drop { start: DropStart::Perturbed(seed ^ index) };
    let (mut follower, fresh_cpu_s) = timed(|| Follower::drop(&fabric, &drop, options));
    let fresh = follower.drape();
    let mut legs = Vec::new();
    for to in [neighbour(&fabric, length, seed, index), fabric] {
        let (followed, cpu_s) = timed(|| follower.follow_fabric(&to, how));
        match followed {
            Ok(followed) => legs.push(Leg { followed, drape: follower.drape(), cpu_s }),
            Err(FollowError::NotAtRest(_) | FollowError::OtherOutline) => break,
        }
    }
    Ok(Walk { index, fabric, fresh, fresh_cpu_s, legs })
}

impl Walk {
    /// The names of what [`Self::row`] gives.
    pub const COLUMNS: &str = "index, bending_length_mm, fresh_cpu_s, fresh_factorisations, \
         there_cpu_s, there_factorisations, back_cpu_s, back_factorisations, descents, events, \
         branch_jump_mm, away_mm, return_mm, nodes, stop, intersections";

    /// Events on both legs.
    #[must_use]
    pub fn events(&self) -> usize {
        self.legs.iter().map(|leg| leg.followed.events.len()).sum()
    }

    /// Mean distance of the rim from where the walk began, after it \[mm\]; NaN of a walk that did
    /// not come back.
    #[must_use]
    pub fn return_mm(&self) -> f64 {
        self.legs.get(1).map_or(f64::NAN, |leg| self.off_mm(leg))
    }

    fn off_mm(&self, leg: &Leg) -> f64 {
        self.fresh.boundary.mean_distance_m(&leg.drape.boundary) / M_PER_MM
    }

    /// As a line of a table.
    #[must_use]
    pub fn row(&self) -> String {
        let cost = |leg: Option<&Leg>| match leg {
            Some(leg) => format!("{:.2}, {}", leg.cpu_s, leg.followed.effort.factorisations),
            None => "-, -".to_owned(),
        };
        let jumps = self.legs.iter().flat_map(|leg| &leg.followed.events);
        let branch_jump_m = jumps.map(|event| event.branch_jump_m).fold(0.0, f64::max);
        let ends = self.legs.iter().map(|leg| &leg.drape);
        let nodes: Vec<String> = [&self.fresh]
            .into_iter()
            .chain(ends.clone())
            .map(|drape| drape.nodes.to_string())
            .collect();
        format!(
            "{}, {:.1}, {:.2}, {}, {}, {}, {}, {}, {:.2}, {:.2}, {:.3}, {}, {}, {}",
            self.index,
            bending_length_m(&self.fabric) / M_PER_MM,
            self.fresh_cpu_s,
            self.fresh.effort.factorisations,
            cost(self.legs.first()),
            cost(self.legs.get(1)),
            self.legs.iter().map(|leg| leg.followed.descents).sum::<usize>(),
            self.events(),
            branch_jump_m / M_PER_MM,
            self.legs.first().map_or(f64::NAN, |leg| self.off_mm(leg)),
            self.return_mm(),
            nodes.join(" "),
            self.legs.last().map_or(self.fresh.stop, |leg| leg.followed.stop).name(),
            ends.map(|drape| drape.intersections).sum::<usize>(),
        )
    }
}

/// What many walks come to.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Sums {
    /// Median processor time of a fresh drape \[s\].
    pub fresh_median_cpu_s: f64,
    /// Median processor time of a leg \[s\].
    pub follow_median_cpu_s: f64,
    /// Its 95th percentile \[s\].
    pub follow_p95_cpu_s: f64,
    /// Legs.
    pub walks: usize,
    /// Legs that ended at rest.
    pub at_rest: usize,
    /// Pairs of triangles that intersect at the ends of legs.
    pub intersections: usize,
    /// Events on legs.
    pub events: usize,
    /// Walks there and back without an event.
    pub quiet: usize,
    /// Median processor time of a leg of theirs \[s\].
    pub quiet_median_cpu_s: f64,
    /// Its 95th percentile \[s\].
    pub quiet_p95_cpu_s: f64,
    /// Median distance of the rim from where such a walk began \[mm\].
    pub quiet_return_median_mm: f64,
    /// Its 95th percentile \[mm\].
    pub quiet_return_p95_mm: f64,
    /// Largest of them \[mm\].
    pub quiet_return_largest_mm: f64,
}

impl Sums {
    /// Of these walks.
    #[must_use]
    pub fn of(walks: &[Walk]) -> Self {
        let fresh: Vec<f64> = walks.iter().map(|walk| walk.fresh_cpu_s).collect();
        let legs: Vec<&Leg> = walks.iter().flat_map(|walk| &walk.legs).collect();
        let costs: Vec<f64> = legs.iter().map(|leg| leg.cpu_s).collect();
        let quiet = walks.iter().filter(|walk| walk.events() == 0 && walk.legs.len() == 2);
        let returns: Vec<f64> = quiet.clone().map(Walk::return_mm).collect();
        let quiet: Vec<f64> = quiet.flat_map(|walk| &walk.legs).map(|leg| leg.cpu_s).collect();
        Self {
            fresh_median_cpu_s: at(&fresh, 0.5),
            follow_median_cpu_s: at(&costs, 0.5),
            follow_p95_cpu_s: at(&costs, 0.95),
            walks: legs.len(),
            at_rest: legs.iter().filter(|leg| leg.followed.stop == Stop::AtRest).count(),
            intersections: legs.iter().map(|leg| leg.drape.intersections).sum(),
            events: walks.iter().map(Walk::events).sum(),
            quiet: returns.len(),
            quiet_median_cpu_s: at(&quiet, 0.5),
            quiet_p95_cpu_s: at(&quiet, 0.95),
            quiet_return_median_mm: at(&returns, 0.5),
            quiet_return_p95_mm: at(&returns, 0.95),
            quiet_return_largest_mm: at(&returns, 1.0),
        }
    }
}

/// The quantile at `share`; NaN of none.
fn at(values: &[f64], share: f64) -> f64 {
    robust::quantile(values.to_vec(), share).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use scan2params::sim::Setup;

    #[test]
    fn a_neighbour_lies_one_step_away_and_is_the_same_every_time() {
        let fabric = Fabric::mean_knit();
        let to = neighbour(&fabric, 0.25, 3, 5);
        assert_eq!(to, neighbour(&fabric, 0.25, 3, 5));
        assert_ne!(to, neighbour(&fabric, 0.25, 3, 6));
        let setup = |fabric| Setup { fabric, experiment: Default::default() };
        assert!((setup(fabric).log_distance(&setup(to)) - 0.25).abs() < 1e-9);
    }

    #[test]
    fn sums_count_what_the_walks_did() {
        let options = SimOptions { vertices: 21, fall_vertices: 21, ..SimOptions::default() };
        let how = FollowOptions::default();
        let walks: Vec<_> = (0..2)
            .map(|k| walk(&Mixture::measured(), 5, k, 0.02, &options, &how).unwrap())
            .collect();
        let sums = Sums::of(&walks);
        assert_eq!((sums.walks, sums.at_rest, sums.intersections), (4, 4, 0));
        let quiet = walks.iter().filter(|walk| walk.events() == 0).map(Walk::return_mm);
        let largest_mm = quiet.clone().fold(f64::NAN, f64::max);
        println!("{} quiet, back within {largest_mm:.2e} mm", sums.quiet);
        assert!(sums.quiet_return_largest_mm.total_cmp(&largest_mm).is_eq());
        assert_eq!(sums.quiet, quiet.count());
        assert_eq!(sums.fresh_median_cpu_s, walks[0].fresh_cpu_s.max(walks[1].fresh_cpu_s));
        assert_eq!(walks[0].row().split(',').count(), Walk::COLUMNS.split(',').count());
    }
}
