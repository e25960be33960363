//! What makes one part of a drape unlike another: a hem, a seam, a stiffness that rises to one
//! side, a draught.
//!
//! In: nothing but numbers (SI). Out: what `sim/uneven.rs` makes masses, bending and loads of;
//! their limits stand in `parameters.rs`. Nothing fits these numbers: hem, seam, gradient and
//! draught stand for what a model of a drape does not know of, and sealed cases are drawn with them
//! (`lab/src/sealed`); the two fields are what a calibration's tracer draws (`calibrate/field.rs`).
//! All are off by default.

use serde::{Deserialize, Serialize};

use super::nodes::NodeField;

/// What makes one part of a drape unlike another. Bearings are those on the flat specimen, from the
/// warp (x) towards the weft (z) \[rad\]; that of the draught is one of the room, from +x towards
/// +z of the simulation frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Uneven {
    /// A heavier border on one side.
    pub hem: Hem,
    /// A stiffer line across the cloth.
    pub seam: Seam,
    /// Bending that is stiffer on one side than on the other.
    pub gradient: StiffnessGradient,
    /// Air that presses from one side.
    pub draught: Draught,
    /// What the cloth weighs more, as a share of its weight.
    pub weight: NodeField,
    /// Logarithm of a factor on its bending.
    pub ln_bending: NodeField,
}

/// Cloth that is heavier on one side: the part of the specimen beyond a straight line across the
/// bearing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hem {
    /// What the border weighs more than the cloth \[kg/m^2\].
    pub added_kg_m2: f64,
    /// Distance of the line from the specimen's last point at that bearing \[m\].
    pub width_m: f64,
    /// Bearing of the side \[rad\].
    pub toward_rad: f64,
}

impl Default for Hem {
    fn default() -> Self {
        Self { added_kg_m2: 0.0, width_m: 10e-3, toward_rad: 0.0 }
    }
}

/// A straight line along which the cloth bends less easily, both along and across it: the bending
/// stiffness is full on the line, and falls linearly to the cloth's own over a width on both sides.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Seam {
    /// Bending stiffness on the line over the cloth's own, less 1.
    pub added: f64,
    /// Distance from the line at which nothing is added any more \[m\]; a cell or more.
    pub width_m: f64,
    /// Bearing of the line's normal \[rad\].
    pub toward_rad: f64,
    /// Distance of the line from the specimen's centre, towards that bearing \[m\].
    pub offset_m: f64,
}

impl Default for Seam {
    fn default() -> Self {
        Self { added: 0.0, width_m: 5e-3, toward_rad: 0.0, offset_m: 0.0 }
    }
}

/// Bending whose logarithm rises evenly from one side of the specimen to the other and is the
/// cloth's own in the middle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StiffnessGradient {
    /// Logarithm of the factor at the specimen's last point at the bearing; the opposite side has
    /// its inverse.
    pub ln_factor: f64,
    /// Bearing of the stiffer side \[rad\].
    pub toward_rad: f64,
}

/// Air that presses with one horizontal force per area on the half of the overhang that it meets
/// first. The force is that of the flat specimen and does not change as the cloth falls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Draught {
    /// Force per area of cloth \[Pa\].
    pub pressure_pa: f64,
    /// Bearing that the air blows towards, in the room \[rad\].
    pub toward_rad: f64,
}

impl Uneven {
    /// Whether the drape is even.
    #[must_use]
    pub fn is_off(&self) -> bool {
        self.hem.added_kg_m2 == 0.0
            && self.seam.added == 0.0
            && self.gradient.ln_factor == 0.0
            && self.draught.pressure_pa == 0.0
            && self.weight.is_off()
            && self.ln_bending.is_off()
    }

    /// That of the same cloth turned over about its warp: what lies on the cloth is mirrored, the
    /// draught stays.
    #[must_use]
    pub fn face_down(&self) -> Self {
        let (hem, seam, gradient) = (self.hem, self.seam, self.gradient);
        Self {
            hem: Hem { toward_rad: -hem.toward_rad, ..hem },
            seam: Seam { toward_rad: -seam.toward_rad, ..seam },
            gradient: StiffnessGradient { toward_rad: -gradient.toward_rad, ..gradient },
            draught: self.draught,
            weight: self.weight.face_down(),
            ln_bending: self.ln_bending.face_down(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Experiment;

    fn halfway(from: Uneven, to: Uneven) -> Uneven {
        let [from, to] = [from, to].map(|uneven| Experiment { uneven, ..Experiment::default() });
        from.between(&to, 0.5).uneven
    }

    #[test]
    fn halfway_to_none_has_half_the_size_at_its_own_place() {
        let hem = Hem { added_kg_m2: 0.2, width_m: 20e-3, toward_rad: 1.0 };
        let draught = Draught { pressure_pa: 0.4, toward_rad: -2.0 };
        let uneven = Uneven { hem, draught, ..Uneven::default() };
        for half in [halfway(uneven, Uneven::default()), halfway(Uneven::default(), uneven)] {
            assert_eq!(half.hem, Hem { added_kg_m2: 0.1, ..hem });
            assert_eq!(half.draught, Draught { pressure_pa: 0.2, ..draught });
            assert!(half.seam == Seam::default() && !half.is_off());
        }
        assert!(Uneven::default().is_off());
    }

    #[test]
    fn twice_turned_over_is_as_before() {
        let seam = Seam { added: 4.0, width_m: 6e-3, toward_rad: 0.7, offset_m: 30e-3 };
        let mut uneven = Uneven { seam, ..Uneven::default() };
        (uneven.weight.nodes[1][0], uneven.ln_bending.nodes[4][3]) = (0.3, -0.2);
        let turned = uneven.face_down();
        assert_eq!(turned.face_down(), uneven);
        assert_eq!(turned.seam.toward_rad, -0.7);
        assert_eq!((turned.weight.nodes[1][4], turned.ln_bending.nodes[4][1]), (0.3, -0.2));
        let half = halfway(uneven, Uneven::default());
        assert_eq!((half.weight.at(0.25, 0.0), half.weight.at(0.25, 0.125)), (0.15, 0.075));
    }
}
