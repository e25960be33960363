//! The six stiffnesses by their names.

use serde::Serialize;

use super::range::STIFFNESSES;

/// Something of each stiffness.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(rename = "StiffnessesOf{T}"))]
pub struct Stiffnesses<T> {
    /// Stretch stiffness along the weft \[g/s^2\].
    pub stretch_weft: T,
    /// Stretch stiffness along the warp \[g/s^2\].
    pub stretch_warp: T,
    /// Shear stiffness \[g/s^2\].
    pub shear: T,
    /// Bending stiffness along the weft \[g mm^2 s^-2 rad^-1\].
    pub bending_weft: T,
    /// Bending stiffness along the warp \[g mm^2 s^-2 rad^-1\].
    pub bending_warp: T,
    /// Bending stiffness along the bias (45 degrees) \[g mm^2 s^-2 rad^-1\].
    pub bending_bias: T,
}

impl<T> From<[T; STIFFNESSES]> for Stiffnesses<T> {
    /// In the paper's order.
    fn from(all: [T; STIFFNESSES]) -> Self {
        let [stretch_weft, stretch_warp, shear, bending_weft, bending_warp, bending_bias] = all;
        Self { stretch_weft, stretch_warp, shear, bending_weft, bending_warp, bending_bias }
    }
}
