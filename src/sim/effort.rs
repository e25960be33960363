//! What a search for rest cost: counts and times.

use std::ops::{AddAssign, Sub};
use std::time::Instant;

/// Counts and times of a search for rest. Times are those of a clock on the wall \[s\]; a drape
/// runs on one thread, so that their shares are those of processor time unless the machine is
/// crowded.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Effort {
    /// Number of Cholesky factorisations.
    pub factorisations: usize,
    /// Time spent on gradients and Hessians \[s\].
    pub assembly_s: f64,
    /// Time spent on factorisations \[s\].
    pub factorisation_s: f64,
    /// Time spent on linear solves: substitutions, and products with the Hessian \[s\].
    pub solve_s: f64,
    /// Time spent on finding what touches the plate or the sheet itself, and on keeping steps short
    /// of it \[s\].
    pub contact_s: f64,
    /// Time spent on energies along a direction \[s\].
    pub search_s: f64,
}

impl Effort {
    /// The five times with their names in files \[s\].
    #[must_use]
    pub fn parts_s(&self) -> [(&'static str, f64); 5] {
        [
            ("assembly", self.assembly_s),
            ("factorisation", self.factorisation_s),
            ("solve", self.solve_s),
            ("contact", self.contact_s),
            ("line_search", self.search_s),
        ]
    }
}

impl AddAssign for Effort {
    fn add_assign(&mut self, other: Self) {
        self.factorisations += other.factorisations;
        self.assembly_s += other.assembly_s;
        self.factorisation_s += other.factorisation_s;
        self.solve_s += other.solve_s;
        self.contact_s += other.contact_s;
        self.search_s += other.search_s;
    }
}

impl Sub for Effort {
    type Output = Self;

    fn sub(self, before: Self) -> Self {
        Self {
            factorisations: self.factorisations - before.factorisations,
            assembly_s: self.assembly_s - before.assembly_s,
            factorisation_s: self.factorisation_s - before.factorisation_s,
            solve_s: self.solve_s - before.solve_s,
            contact_s: self.contact_s - before.contact_s,
            search_s: self.search_s - before.search_s,
        }
    }
}

/// Runs `work` and adds its time to `account_s`.
pub(super) fn charge<T>(account_s: &mut f64, work: impl FnOnce() -> T) -> T {
    let begun = Instant::now();
    let result = work();
    *account_s += begun.elapsed().as_secs_f64();
    result
}
