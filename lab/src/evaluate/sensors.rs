//! The estimate on canonical and on perturbed drops, seen clean and by sensors, for `evaluate
//! sensors`.
//!
//! In: fabrics of a prior, networks, ways to see a drape ([`Sight`]). Out: one [`Cell`] for each
//! network, drop and sight: the scores of its answers, and how many scans the scan path refused.
//! Every network gets the same rims, the fabrics lie at full rest on the network's cells, and all
//! errors are over the prior's box.
//!
//! Where it fails: scans of the simulator's own drapes; finer cells and real cloth are elsewhere
//! (`scan2params-lab refine`, docs/validation/refine.md).

use std::ops::Range;

use rayon::prelude::*;
use serde::Serialize;

use super::case_error::CaseError;
use super::estimate::{Answer, Scores, answered};
use super::refine::Sight;
use super::scan::RimOff;
use scan2params::base::Boundary;
use scan2params::dataset::drape_file::rim_of;
use scan2params::estimate::{EstimateError, Estimator};
use scan2params::fabric::{Fabric, Mixture};
use scan2params::scan::ScanError;
use scan2params::sim::{Fall, SimOptions, Stop, drape};

/// Fabrics, who is asked, and what they see.
pub struct Sweep<'a> {
    /// Where the fabrics are from.
    pub prior: Mixture,
    /// Which of them.
    pub fabrics: Range<u64>,
    /// Seed of fabrics, drops and scans.
    pub seed: u64,
    /// How each drape is seen.
    pub sights: Vec<Sight>,
    /// The networks.
    pub estimators: &'a [Estimator],
}

/// One drape: what each network makes of each sight of it, in the order of the sweep's.
#[derive(Debug)]
pub struct Draped {
    /// Its place in the run.
    pub index: u64,
    /// How it fell.
    pub fall: Fall,
    /// The true fabric.
    pub fabric: Fabric,
    /// None where the drape did not come to rest; by sight.
    answers: Option<Vec<Result<Asked, ScanError>>>,
}

/// A rim and what each network makes of it.
#[derive(Debug)]
struct Asked {
    off: RimOff,
    said: Vec<Answer>,
}

/// The answers of a network for one fall and sight.
#[derive(Clone, Debug, Serialize)]
pub struct Cell {
    /// Name of the network.
    pub model: String,
    /// How the drapes fell.
    pub fall: Fall,
    /// How they were seen.
    pub sight: String,
    /// Scans refused.
    pub refused: usize,
    /// Drapes that did not come to rest.
    pub not_at_rest: usize,
    /// How far the rims lie from the true ones, in the mean; none where all were refused.
    pub rim: Option<RimOff>,
    /// The answers' scores; none where all were refused.
    pub scores: Option<Scores>,
}

/// Why a sweep cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// A fabric or a scene cannot be made.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// A network has no answer.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
}

impl Sweep<'_> {
    /// Drapes, scans and asks on all cores; `tell` hears of each drape as it ends.
    ///
    /// # Errors
    /// The first drape that cannot be made or answered for.
    pub fn run(&self, tell: impl Fn(&Draped) + Sync) -> Result<Vec<Draped>, SweepError> {
        let of_fabric = |index: u64| Fall::ALL.map(|fall| (index, fall));
        let all: Vec<(u64, Fall)> = self.fabrics.clone().flat_map(of_fabric).collect();
        let draped = all.into_par_iter().with_max_len(1).map(|(index, fall)| {
            let draped = self.draped(index, fall)?;
            tell(&draped);
            Ok(draped)
        });
        draped.collect()
    }

    fn draped(&self, index: u64, fall: Fall) -> Result<Draped, SweepError> {
        let fabric = self.prior.sample(self.seed, index).map_err(CaseError::from)?;
        let seed = self.seed ^ index;
        let drape = drape(&fabric, &fall.drop(seed), &SimOptions::default());
        let mut draped = Draped { index, fall, fabric, answers: None };
        if drape.stop != Stop::AtRest || drape.intersections > 0 {
            return Ok(draped);
        }
        let mesh = drape.mesh();
        let rim = rim_of(&mesh).unwrap_or_else(|| unreachable!("a square grid of vertices"));
        let truth = (mesh, rim);
        let mut answers = Vec::new();
        for sight in &self.sights {
            let seen = sight.of(&truth, seed).map_err(CaseError::from)?;
            answers.push(match seen {
                Ok(seen) => Ok(Asked {
                    off: RimOff::of(&seen.rim, &truth.1),
                    said: self.asked(&seen.rim, &fabric)?,
                }),
                Err(refused) => Err(refused),
            });
        }
        draped.answers = Some(answers);
        Ok(draped)
    }

    /// What each network says of a rim.
    fn asked(&self, rim: &Boundary, fabric: &Fabric) -> Result<Vec<Answer>, EstimateError> {
        let answer = |own: &Estimator| answered(own, rim, fabric.density_kg_m2);
        self.estimators.iter().map(answer).collect()
    }

    /// The table of drapes that were made.
    #[must_use]
    pub fn cells(&self, draped: &[Draped]) -> Vec<Cell> {
        let mut cells = Vec::new();
        for (model, estimator) in self.estimators.iter().enumerate() {
            for fall in Fall::ALL {
                for (sight, seen_as) in self.sights.iter().enumerate() {
                    let own = draped.iter().filter(|d| d.fall == fall);
                    let mut cell = Cell {
                        model: estimator.model().id.clone(),
                        fall,
                        sight: seen_as.name().to_owned(),
                        refused: 0,
                        not_at_rest: 0,
                        rim: None,
                        scores: None,
                    };
                    let (mut truths, mut answers, mut offs) = (Vec::new(), Vec::new(), Vec::new());
                    for Draped { fabric, answers: said, .. } in own {
                        match said.as_ref().map(|said| &said[sight]) {
                            None => cell.not_at_rest += 1,
                            Some(Err(_)) => cell.refused += 1,
                            Some(Ok(said)) => {
                                truths.push(*fabric);
                                answers.push(said.said[model]);
                                offs.push(said.off);
                            }
                        }
                    }
                    cell.rim = RimOff::mean(&offs);
                    if !answers.is_empty() {
                        cell.scores = Some(Scores::of(&truths, &answers, self.prior.limits()));
                    }
                    cells.push(cell);
                }
            }
        }
        cells
    }
}

impl Draped {
    /// In words, for whoever waits.
    #[must_use]
    pub fn told(&self) -> String {
        let Self { index, fall, answers, .. } = self;
        let seen = match answers {
            None => "did not come to rest".to_owned(),
            Some(answers) => {
                let refused: Vec<String> = answers
                    .iter()
                    .filter_map(|a| a.as_ref().err())
                    .map(ToString::to_string)
                    .collect();
                if refused.is_empty() { "seen".to_owned() } else { refused.join("; ") }
            }
        };
        format!("fabric {index}, {}: {seen}", fall.name())
    }
}

impl Cell {
    /// Names of the columns of [`Self::row`].
    pub const COLUMNS: &str = "model, drop, seen, answered, refused, not_at_rest, off_mm, deformed_mm, sigma_mm, rmse, r2, coverage, half_width_factor";

    /// As a row of a table.
    #[must_use]
    pub fn row(&self) -> String {
        let Self { model, fall, sight, refused, not_at_rest, rim, scores } = self;
        let begun = format!("{model}, {}, {sight}", fall.name());
        match scores.as_ref().zip(*rim) {
            None => format!("{begun}, 0, {refused}, {not_at_rest}, , , , , , , "),
            Some((s, RimOff { off_mm, deformed_mm, sigma_mm })) => format!(
                "{begun}, {}, {refused}, {not_at_rest}, {off_mm:.3}, {deformed_mm:.3}, {sigma_mm:.3}, {:.4}, {:.3}, {:.3}, {:.2}",
                s.drapes, s.rmse, s.r2, s.coverage, s.half_width_factor
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[ignore = "a whole experiment: -- --ignored"]
    fn every_network_is_asked_for_each_drop_as_each_sensor_saw_it() {
        let estimators = [Estimator::shipped().unwrap(), Estimator::shipped().unwrap()];
        let sight = |name: &&str| Sight::named(name).unwrap();
        let sweep = Sweep {
            prior: Mixture::measured(),
            fabrics: 1..2,
            seed: 13,
            sights: ["rim", "structured-light"].iter().map(sight).collect(),
            estimators: &estimators,
        };
        let draped = sweep.run(|draped| println!("{}", draped.told())).unwrap();
        let cells = sweep.cells(&draped);
        assert_eq!(cells.len(), 2 * 2 * 2);
        for cell in &cells {
            println!("{}", cell.row());
            assert_eq!(cell.row().split(", ").count(), Cell::COLUMNS.split(", ").count());
            assert_eq!((cell.refused, cell.not_at_rest), (0, 0));
            let RimOff { off_mm, deformed_mm, sigma_mm } = cell.rim.unwrap();
            // a rim that is seen as it is has no error and says so; a scan's is of the size that it
            // says
            match cell.sight.as_str() {
                "rim" => assert_eq!([off_mm, deformed_mm, sigma_mm], [0.0; 3]),
                _ => assert!(deformed_mm < off_mm && (0.5..2.0).contains(&(off_mm / sigma_mm))),
            }
        }
        let rmse = |k: usize| cells[k].scores.as_ref().unwrap().rmse;
        // both networks are the same one, and a scan moves the answer, but not far
        for k in 0..4 {
            assert_eq!(rmse(k), rmse(k + 4));
        }
        for rim in [0, 2] {
            assert!(rmse(rim) > 0.0 && rmse(rim) != rmse(rim + 1));
            assert!(rmse(rim).max(rmse(rim + 1)) < 0.15, "{} {}", rmse(rim), rmse(rim + 1));
        }
        assert_ne!(rmse(0), rmse(2), "the drops are two");
    }

    #[test]
    fn refused_scans_and_drapes_that_did_not_rest_are_counted_and_not_scored() {
        let estimators = [Estimator::shipped().unwrap()];
        let sights = vec![Sight::Rim];
        let (prior, fabrics) = (Mixture::measured(), 0..3);
        let sweep = Sweep { prior, fabrics, seed: 13, sights, estimators: &estimators };
        let fabric = sweep.prior.sample(13, 0).unwrap();
        let draped = |answers| Draped { index: 0, fall: Fall::Perturbed, fabric, answers };
        let refused = ScanError::TooFewPoints { points: 3, limit: 1000 };
        let all = [draped(None), draped(Some(vec![Err(refused)]))];
        let cells = sweep.cells(&all);
        let Cell { refused, not_at_rest, scores, .. } = &cells[1];
        assert_eq!((*refused, *not_at_rest, scores.is_none()), (1, 1, true));
        assert!(cells[1].row().ends_with("perturbed, rim, 0, 1, 1, , , , , , , "));
    }
}
