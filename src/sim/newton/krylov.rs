//! Conjugate gradients on the whole tangent, the blocks outside its pattern included.

use crate::base::Vector3;
use crate::numeric::sparse::BlockPattern;
use crate::sim::model::{OutsideBlock, Tangent};

use super::workspace::dot;

/// Products in a solve.
const LIMIT: usize = 200;

/// A right-hand side on its way to the solution.
struct Side<'a> {
    solution: &'a mut [Vector3],
    residual: Vec<Vector3>,
    preconditioned: Vec<Vector3>,
    search: Vec<Vector3>,
    /// The residual's square in the preconditioner's norm, and that at which the solve ends.
    rho: f64,
    target: f64,
}

/// Solves with the tangent for some right-hand sides, which become the solutions, until the
/// residual of each has fallen to `tolerance` in the preconditioner's norm. They go side by side,
/// so that a preconditioner can serve all of them at once; each is computed as if it were alone.
/// False as soon as one meets negative curvature: all are then what they had come to.
pub(super) fn conjugate_gradients(
    pattern: &BlockPattern,
    tangent: &Tangent,
    all: &mut [&mut [Vector3]],
    tolerance: f64,
    mut precondition: impl FnMut(&mut [&mut [Vector3]]),
) -> bool {
    let mut sides: Vec<Side> = all.iter_mut().map(|side| Side::new(side)).collect();
    precondition(&mut preconditioned(&mut sides));
    sides.iter_mut().for_each(|side| side.begin(tolerance));
    let mut product = vec![Vector3::zeros(); pattern.unknowns() / 3];
    for iteration in 0..LIMIT {
        for side in &mut sides {
            multiply(pattern, tangent, &side.search, &mut product);
            if !side.advance(&product, iteration == 0) {
                return false;
            }
        }
        precondition(&mut preconditioned(&mut sides));
        sides.retain_mut(Side::goes_on);
        if sides.is_empty() {
            break;
        }
    }
    true
}

/// What the preconditioner is applied to.
fn preconditioned<'a>(sides: &'a mut [Side<'_>]) -> Vec<&'a mut [Vector3]> {
    sides.iter_mut().map(|side| side.preconditioned.as_mut_slice()).collect()
}

impl<'a> Side<'a> {
    fn new(solution: &'a mut [Vector3]) -> Self {
        let residual = solution.to_vec();
        solution.fill(Vector3::zeros());
        let (preconditioned, search) = (residual.clone(), Vec::new());
        Self { solution, residual, preconditioned, search, rho: 0.0, target: 0.0 }
    }

    /// Begins with the first preconditioned residual.
    fn begin(&mut self, tolerance: f64) {
        self.search.clone_from(&self.preconditioned);
        self.rho = dot(&self.residual, &self.preconditioned);
        self.target = self.rho * tolerance * tolerance;
    }

    /// One step along the search direction, whose product with the tangent is given; false where
    /// the curvature along it is negative. The first direction is then all that is known of the
    /// solution.
    fn advance(&mut self, product: &[Vector3], is_first: bool) -> bool {
        let curvature = dot(&self.search, product);
        if curvature <= 0.0 {
            if is_first {
                self.solution.copy_from_slice(&self.search);
            }
            return false;
        }
        let alpha = self.rho / curvature;
        for v in 0..product.len() {
            self.solution[v] += self.search[v] * alpha;
            self.residual[v] -= product[v] * alpha;
        }
        self.preconditioned.copy_from_slice(&self.residual);
        true
    }

    /// Turns to the next search direction; false where the solution is found.
    fn goes_on(&mut self) -> bool {
        let next = dot(&self.residual, &self.preconditioned);
        if next <= self.target {
            return false;
        }
        let beta = next / self.rho;
        self.rho = next;
        for (search, preconditioned) in self.search.iter_mut().zip(&self.preconditioned) {
            *search = preconditioned + *search * beta;
        }
        true
    }
}

/// `out` = tangent times `x`, the blocks outside the pattern included.
pub(super) fn multiply(
    pattern: &BlockPattern,
    tangent: &Tangent,
    x: &[Vector3],
    out: &mut [Vector3],
) {
    pattern.multiply(&tangent.values, x, out);
    for OutsideBlock { row, column, block } in &tangent.outside {
        let (r, c) = (*row as usize, *column as usize);
        out[r] += block * x[c];
        out[c] += block.transpose() * x[r];
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;
    use crate::numeric::sparse::{Analysis, Factor, TOGETHER, Work};

    const BLOCKS: usize = 40;

    /// A chain of blocks, each bound to the next, with some bound to far ones outside the pattern.
    fn chain(bound: f64) -> (BlockPattern, Tangent) {
        let next = |j: usize| if j + 1 < BLOCKS { vec![j as u32 + 1] } else { Vec::new() };
        let pattern = BlockPattern::new((0..BLOCKS).map(next).collect());
        let mut values = vec![0.0; pattern.nonzeros()];
        for j in 0..BLOCKS {
            pattern.add_diagonal(&mut values, j, &(Matrix3::identity() * 4.0));
            if let Some(slot) = pattern.slot(j + 1, j) {
                let block = Matrix3::from_fn(|r, c| ((j + 3 * r + c) as f64).sin() * 0.5);
                BlockPattern::add_block(&mut values, slot, &block);
            }
        }
        let outside = |j: u32| OutsideBlock {
            row: 3 * j + 11,
            column: 3 * j,
            block: Matrix3::from_fn(|r, c| bound * (1.0 + r as f64 - c as f64 * 0.3)),
        };
        (pattern, Tangent { values, outside: (0..9).map(outside).collect() })
    }

    fn sides() -> Vec<Vec<Vector3>> {
        let side = |k: usize| -> Vec<Vector3> {
            let at = |j: usize| Vector3::new((j * k) as f64, (j as f64).cos(), k as f64 - 3.5);
            (0..BLOCKS).map(at).collect()
        };
        (0..TOGETHER).map(side).collect()
    }

    /// The solutions, solved so many at a time.
    fn solved(at_a_time: usize, bound: f64) -> Option<Vec<Vec<Vector3>>> {
        let (pattern, tangent) = chain(bound);
        let order: Vec<u32> = (0..BLOCKS as u32).collect();
        let mut factor = Factor::<f64>::new(&Analysis::new(chain(bound).0, Some(&order)));
        assert!(factor.factorize(&tangent.values));
        let (mut work, mut all) = (Work::default(), sides());
        for some in all.chunks_mut(at_a_time) {
            let mut some: Vec<&mut [Vector3]> = some.iter_mut().map(Vec::as_mut_slice).collect();
            let precondition = |x: &mut [&mut [Vector3]]| factor.solve_with(&mut work, x);
            if !conjugate_gradients(&pattern, &tangent, &mut some, 1e-9, precondition) {
                return None;
            }
        }
        Some(all)
    }

    #[test]
    fn sides_solved_together_are_as_if_each_were_alone_and_solve_the_whole() {
        let (together, alone) = (solved(TOGETHER, 0.4).unwrap(), solved(1, 0.4).unwrap());
        assert_eq!(together, alone);
        let (pattern, tangent) = chain(0.4);
        for (solution, side) in together.iter().zip(sides()) {
            let mut product = vec![Vector3::zeros(); BLOCKS];
            multiply(&pattern, &tangent, solution, &mut product);
            let left = product.iter().zip(&side).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            // sides are up to 273 long: a solve without the blocks outside the pattern would leave
            // whole numbers
            assert!(left < 1e-5, "{left:e}");
        }
    }

    #[test]
    fn negative_curvature_is_reported() {
        assert_eq!(solved(TOGETHER, 9.0), None);
        assert_eq!(solved(1, 9.0), None);
    }
}
