//! One implicit step, and what it shares with the search for equilibrium.
//!
//! A step minimises `E(x) + 1/2 sum m |x - y|^2 / dt^2` from the current x, with y the place where
//! inertia alone would carry the sheet: implicit Euler. With y = x it is a proximal
//! (pseudo-transient) step, and with dt infinite a plain Newton step for the equilibrium. `step.rs`
//! takes one step, `linear.rs` finds its direction (where contact reaches beyond the pattern by
//! `krylov.rs`), `descent.rs` lowers the energy by many steps on one factor, `stability.rs` judges
//! an equilibrium; all of them work on the [`Newton`] of `workspace.rs`.

mod correct;
mod descent;
mod krylov;
mod linear;
mod stability;
mod step;
mod workspace;

pub use correct::Correction;
pub use descent::Memory;
pub use workspace::{Inertia, Iteration, Newton};
