//! Steps from drapes to drapes, as long as they lower the cost (Levenberg-Marquardt).

use super::state::{State, Step};
use crate::sim::{Follower, Kept};

/// Why a fit ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum Ended {
    /// Nothing more to be gained.
    Converged,
    /// Steps predicted a gain, and none of them lowered the cost: neighbouring minima.
    NoBetter,
    /// The drapes ran out.
    Spent,
    /// The least squares have no solution.
    Singular,
}

impl Ended {
    /// The word for it in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::NoBetter => "no_better",
            Self::Spent => "spent",
            Self::Singular => "singular",
        }
    }
}

/// A fit whose steps are drapes.
pub(crate) trait Descent {
    /// What it keeps of a drape.
    type Drape;

    /// The sheets.
    fn sheets(&mut self) -> &mut [Follower];

    /// Drapes so far.
    fn simulated(&self) -> usize;

    /// A damped step, if there is one.
    fn step(&self, from: &State<Self::Drape>, damping: f64) -> Option<Step>;

    /// Predicted fall of the cost that is not worth a round of drapes.
    fn least_gain(&self, _from: &State<Self::Drape>) -> f64 {
        LEAST_GAIN
    }

    /// The sheets brought along a step.
    fn brought(&mut self, step: &Step, from: &State<Self::Drape>) -> Moved<Self::Drape>;
}

/// Where a step has led.
pub(crate) enum Moved<D> {
    /// Nearer.
    Nearer(State<D>),
    /// Nearer, and no further step is worth it.
    Last(State<D>),
    /// Not nearer, or a sheet did not come to rest.
    NoNearer,
}

impl<D> Moved<D> {
    /// Where a step has led whose sheets came to rest.
    pub fn to(state: Option<State<D>>, from: &State<D>) -> Self {
        state.filter(|state| state.cost < from.cost).map_or(Self::NoNearer, Self::Nearer)
    }
}

/// Steps from a state, to which the sheets belong before and after, until so many drapes were made.
/// A step that does not lower the cost is shortened a few times.
pub(crate) fn descend<P: Descent>(
    problem: &mut P,
    mut best: State<P::Drape>,
    most: usize,
) -> (State<P::Drape>, Ended) {
    let mut kept = keep(problem.sheets());
    let (mut damping, mut shortenings) = (FIRST, 0);
    loop {
        if problem.simulated() >= most {
            return (best, Ended::Spent);
        }
        let Some(step) = problem.step(&best, damping) else {
            return (best, Ended::Singular);
        };
        if step.is_little(problem.least_gain(&best)) {
            return (best, Ended::Converged);
        }
        match problem.brought(&step, &best) {
            Moved::Nearer(state) => {
                best = state;
                kept = keep(problem.sheets());
                (damping, shortenings) = (0.2 * damping, 0);
            }
            Moved::Last(state) => return (state, Ended::Converged),
            Moved::NoNearer => {
                return_to(problem.sheets(), &kept);
                if shortenings == SHORTENINGS {
                    return (best, Ended::NoBetter);
                }
                (damping, shortenings) = ((10.0 * damping).max(SHORTENED), shortenings + 1);
            }
        }
    }
}

impl Step {
    /// Whether it is not worth a drape where a fall of the cost by so much is not.
    pub fn is_little(&self, least_gain: f64) -> bool {
        self.predicted < least_gain || self.moved < LEAST_MOVE
    }
}

/// The sheets as they lie.
pub(crate) fn keep(sheets: &[Follower]) -> Vec<Kept> {
    sheets.iter().map(Follower::keep).collect()
}

/// Puts sheets back as they lay.
pub(crate) fn return_to(sheets: &mut [Follower], kept: &[Kept]) {
    sheets.iter_mut().zip(kept).for_each(|(sheet, kept)| sheet.return_to(kept));
}

/// Share that is added to the diagonal in the first step, and at least after a step that raised the
/// cost.
const FIRST: f64 = 1e-2;
const SHORTENED: f64 = 0.1;
/// Shortenings of a step in a row before the fit ends.
const SHORTENINGS: usize = 2;
/// Predicted fall of the cost, in squared standard deviations, that is not worth a drape.
pub(crate) const LEAST_GAIN: f64 = 0.05;
/// Change of a shared unknown that is not worth one.
const LEAST_MOVE: f64 = 3e-3;
