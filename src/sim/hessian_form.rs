//! Which second derivative is meant: the exact one, or a substitute without negative
//! eigenvalues.

/// Which Hessian an energy computes, and which a step is taken with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HessianForm {
    /// A positive semidefinite substitute. A step factorises it in single precision without
    /// the blocks outside the grid's pattern: it gives a direction, which the line search then
    /// judges.
    Projected,
    /// The Hessian itself. A step takes it whole and in double precision.
    Exact,
}
