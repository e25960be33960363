//! What drapes have sensitivities to.

use crate::fabric::STIFFNESSES;
#[cfg(doc)]
use crate::fabric::TABLE_2;
use crate::sim::experiment::CurvatureComponent;

/// A number that the drape depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// Weft stretch stiffness S^u \[N/m\].
    StretchWeft,
    /// Warp stretch stiffness S^v \[N/m\].
    StretchWarp,
    /// Shear stiffness H \[N/m\].
    Shear,
    /// Weft bending stiffness B^u \[N m\].
    BendingWeft,
    /// Warp bending stiffness B^v \[N m\].
    BendingWarp,
    /// Bias bending stiffness B^h \[N m\].
    BendingBias,
    /// Areal density D \[kg/m^2\].
    Density,
    /// One component of the natural curvature, everywhere on the sheet \[1/m\].
    Curl(CurvatureComponent),
    /// One component of the natural curvature at one node of its field \[1/m\].
    CurlNode {
        /// The node's number along the warp, from 0.
        warp: usize,
        /// The node's number along the weft, from 0.
        weft: usize,
        /// Which curvature.
        component: CurvatureComponent,
    },
    /// What the cloth weighs more at one node of a field, as a share of its weight.
    WeightNode {
        /// The node's number along the warp, from 0.
        warp: usize,
        /// The node's number along the weft, from 0.
        weft: usize,
    },
    /// Logarithm of a factor on bending at one node of a field.
    BendingNode {
        /// The node's number along the warp, from 0.
        warp: usize,
        /// The node's number along the weft, from 0.
        weft: usize,
    },
    /// Natural curvature across the free edges \[1/m\].
    EdgeCurl,
    /// Natural curvature across a line \[1/m\].
    LineCurl,
    /// Natural curvature across the second line \[1/m\].
    CrossLineCurl,
    /// Softening of bending along the weft \[m\].
    SofteningWeft,
    /// Softening of bending along the warp \[m\].
    SofteningWarp,
    /// Softening of bending about a line at 45 degrees \[m\].
    SofteningBias,
    /// Asymmetry of bending along the weft.
    AsymmetryWeft,
    /// Asymmetry of bending along the warp.
    AsymmetryWarp,
    /// Friction moment per width against bending along the weft \[N\].
    HysteresisWeft,
    /// Friction moment per width against bending along the warp \[N\].
    HysteresisWarp,
    /// Angle by which the plate falls towards +x \[rad\].
    TiltX,
    /// Angle by which the plate falls towards +z \[rad\].
    TiltZ,
    /// Place of the specimen along x \[m\].
    OffsetX,
    /// Place of the specimen along z \[m\].
    OffsetZ,
    /// Rotation of the specimen about the plate's normal, from +x towards -z \[rad\].
    Rotation,
    /// Radius of the plate \[m\].
    PlateRadius,
    /// Radius of the plate's rounded edge \[m\].
    EdgeRadius,
    /// Coefficient of friction on the plate.
    Friction,
    /// Extent of the specimen along the warp \[m\].
    Warp,
    /// Extent of the specimen along the weft \[m\].
    Weft,
    /// Skew of the specimen \[rad\].
    Skew,
    /// How far beyond an outline the springs of a [`crate::sim::Hold`] pull \[m\].
    Pull,
    /// Place along x of the surface or rim that ties hold the sheet to \[m\].
    TiesX,
    /// Place along z of the surface or rim that ties hold the sheet to \[m\].
    TiesZ,
}

impl Parameter {
    /// The six stiffnesses, paper's order.
    pub const STIFFNESSES: [Self; STIFFNESSES] = [
        Self::StretchWeft,
        Self::StretchWarp,
        Self::Shear,
        Self::BendingWeft,
        Self::BendingWarp,
        Self::BendingBias,
    ];

    /// The parameter's place among the fabric's seven, in the paper's order (see [`TABLE_2`]);
    /// `None` for a parameter of the experiment.
    #[must_use]
    pub fn of_fabric(self) -> Option<usize> {
        let seven = Self::STIFFNESSES.iter().chain([&Self::Density]);
        seven.into_iter().position(|&parameter| parameter == self)
    }
}
