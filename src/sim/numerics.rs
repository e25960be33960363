//! What a version of the numerics stands for.
//!
//! Numerics 4 is the default and what the shipped model was trained on; numerics 3 makes the drapes
//! of earlier data again. Each choice is a field, so that a sweep can vary one at a
//! time.

/// Where the lines of vertices are denser than elsewhere: in a band along the plate's edge, where
/// the sheet leaves the plate and bends most.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Grading {
    /// Lines a length in the band over those elsewhere, as many in all; 1: evenly spaced.
    pub density: f64,
    /// How far the band reaches inwards from the plate's edge \[m\].
    pub inwards_m: f64,
    /// How far it reaches outwards \[m\].
    pub outwards_m: f64,
    /// Length over which the density rises at either side \[m\]: a cell, so that neighbouring cells
    /// differ by a fifth at most.
    pub flank_m: f64,
}

impl Grading {
    /// Evenly spaced lines.
    pub const EVEN: Self = Self { density: 1.0, ..Self::EDGE };
    /// By a sweep: the best of densities from 1.5 to 2.5 in bands from 12 to 40
    /// mm inwards and 10 to 50 mm outwards, on three fabrics. Lines run along x and z, and the edge
    /// of a plate of 50 mm lies at 35 mm of both on the diagonals: a band that reaches less far
    /// inwards misses it.
    pub const EDGE: Self =
        Self { density: 2.0, inwards_m: 30e-3, outwards_m: 16e-3, flank_m: 4e-3 };
}

/// The choices of discretisation and solution that move the rim of a drape.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Numerics {
    /// Where cells are denser than elsewhere.
    pub grading: Grading,
    /// How stiffly the in-plane part of a cell's twist is held, over the bilinear cell's own
    /// stiffness. The whole of it locks cells in folds, none lets soft cloth hourglass.
    pub twist_hold: f64,
    /// Whether self-contact is as stiff as the fabric is heavy, so that a fabric whose seven
    /// parameters are all multiplied by one factor has the same drape; else it is equally stiff for
    /// all.
    pub contact_by_weight: bool,
}

impl Numerics {
    /// Even cells, the whole hold, one stiffness of self-contact.
    pub const THREE: Self =
        Self { grading: Grading::EVEN, twist_hold: 1.0, contact_by_weight: false };
    /// Cells graded towards the plate's edge, hardly any hold, self-contact by weight. The numbers
    /// are those of that sweep.
    pub const FOUR: Self =
        Self { grading: Grading::EDGE, twist_hold: 0.03, contact_by_weight: true };

    /// Whether these are the default, which files leave out.
    #[must_use]
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

impl Default for Numerics {
    fn default() -> Self {
        Self::FOUR
    }
}
