//! The units that textile laboratories, simulators and papers give stiffness and density in.
//!
//! In: a number and the name of its unit. Out: the number in SI, or in another unit of the same
//! quantity. Sources: 1 gf = 9.80665e-3 N and 1 dyn = 1e-5 N exactly; 1 oz = 28.349523125 g and
//! 1 yd = 0.9144 m exactly. Fails for a unit that is not known, and for two units of different
//! quantities, with the names that would do.
//!
//! Two scales are no units: a bending length c stands for B = rho g c^3 and needs the density, and
//! CLO's slider is a curve ([`super::slider`]).

use super::slider;
use crate::base::frame::GRAVITY_M_S2;

/// What a number measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Stretch and shear stiffness \[N/m\].
    Stretch,
    /// Bending stiffness \[N m\].
    Bending,
    /// Areal density \[kg/m^2\].
    Density,
}

impl Quantity {
    /// The words for people.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Stretch => "stretch or shear stiffness",
            Self::Bending => "bending stiffness",
            Self::Density => "areal density",
        }
    }
}

/// How a number becomes one in SI.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Scale {
    /// Times this.
    Factor(f64),
    /// A bending length in mm.
    BendingLength,
    /// CLO's slider, 0 to 100.
    Slider,
}

/// A unit, or a scale that stands for one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// The name as it is printed.
    pub name: &'static str,
    /// What is measured in it.
    pub quantity: Quantity,
    scale: Scale,
    /// Other spellings, as [`plain`] leaves them.
    also: &'static [&'static str],
}

/// 1 gf/cm in N/m.
pub const N_M_PER_GF_CM: f64 = 0.980_665;
/// 1 gf/(cm deg), KES's unit of shear stiffness, in N/m per radian.
pub const N_M_PER_GF_CM_DEG: f64 = N_M_PER_GF_CM * 180.0 / std::f64::consts::PI;
/// 1 gf cm^2/cm, KES's unit of bending stiffness, in N m.
pub const NM_PER_GF_CM2_CM: f64 = 9.806_65e-5;
/// 1 dyn cm in N m.
pub const NM_PER_DYN_CM: f64 = 1e-7;
/// 1 oz/yd^2 in kg/m^2.
pub const KG_M2_PER_OZ_YD2: f64 = 0.028_349_523_125 / (0.9144 * 0.9144);

const fn unit(
    name: &'static str,
    quantity: Quantity,
    factor: f64,
    also: &'static [&'static str],
) -> Unit {
    Unit { name, quantity, scale: Scale::Factor(factor), also }
}

/// All units, those of one quantity together.
pub const UNITS: &[Unit] = &[
    unit("g/s^2", Quantity::Stretch, 1e-3, &["gs-2"]),
    unit("N/m", Quantity::Stretch, 1.0, &["nm-1", "kg/s2"]),
    unit("gf/cm", Quantity::Stretch, N_M_PER_GF_CM, &[]),
    unit("gf/(cm deg)", Quantity::Stretch, N_M_PER_GF_CM_DEG, &["gf/cmdeg", "gf/cm/deg"]),
    Unit { name: "clo-slider", quantity: Quantity::Stretch, scale: Scale::Slider, also: &["clo"] },
    unit(
        "g mm^2 s^-2 rad^-1",
        Quantity::Bending,
        1e-9,
        &["gmm2/s2", "gmm2/s2/rad", "gmm2/(s2rad)", "gmm2s-2"],
    ),
    unit("N m", Quantity::Bending, 1.0, &["nm2/m"]),
    unit("uN m", Quantity::Bending, 1e-6, &["unm2/m"]),
    unit("gf cm^2/cm", Quantity::Bending, NM_PER_GF_CM2_CM, &["gfcm"]),
    unit("dyn cm", Quantity::Bending, NM_PER_DYN_CM, &["dyncm2/cm", "dynecm"]),
    Unit {
        name: "mm",
        quantity: Quantity::Bending,
        scale: Scale::BendingLength,
        also: &["mmbendinglength"],
    },
    unit("g/m^2", Quantity::Density, 1e-3, &["gsm", "gm-2"]),
    unit("kg/m^2", Quantity::Density, 1.0, &["kgm-2"]),
    unit("g/cm^2", Quantity::Density, 10.0, &["gcm-2"]),
    unit("g/mm^2", Quantity::Density, 1e3, &[]),
    unit("mg/cm^2", Quantity::Density, 1e-2, &[]),
    unit("oz/yd^2", Quantity::Density, KG_M2_PER_OZ_YD2, &["osy"]),
];

/// Why a number cannot be converted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UnitError {
    /// No such unit.
    #[error("no unit `{name}`; give one of {}", names(None).join(", "))]
    Unknown {
        /// As it was given.
        name: String,
    },
    /// Two quantities.
    #[error(
        "{} is a unit of {}, {} of {}; from {} go {}",
        from.name, from.quantity.name(), to.name, to.quantity.name(), from.name,
        names(Some(from.quantity)).join(", ")
    )]
    Quantities {
        /// The unit of the number.
        from: Unit,
        /// The unit asked for.
        to: Unit,
    },
    /// A bending length without the density.
    #[error(
        "a bending length in mm stands for B = rho g c^3: give the areal density as well \
         (--density G_PER_M2)"
    )]
    NoDensity,
    /// No stiffness and no density is like that.
    #[error("{value} {unit}: give a positive number")]
    NotPositive {
        /// The number.
        value: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// Beyond the slider's curve.
    #[error("{value} {unit} is beyond CLO's slider, {low} to {high} {unit}; give one in between")]
    BeyondSlider {
        /// The number.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
}

/// The names of the units of a quantity, or of all.
fn names(of: Option<Quantity>) -> Vec<&'static str> {
    UNITS.iter().filter(|u| of.is_none_or(|of| u.quantity == of)).map(|u| u.name).collect()
}

/// A unit's name without what spellings differ in: spaces, `^`, dots, the letter for micro.
fn plain(name: &str) -> String {
    let left_out = [' ', '^', '*', '.', '\u{b7}', '\u{22c5}'];
    let name = name.replace(['\u{b5}', '\u{3bc}'], "u").replace('\u{b2}', "2");
    name.chars().filter(|c| !left_out.contains(c)).collect::<String>().to_lowercase()
}

impl Unit {
    /// The unit that a name stands for, with any spaces, `^`, `*` and capitals.
    ///
    /// # Errors
    /// [`UnitError::Unknown`].
    pub fn named(name: &str) -> Result<Self, UnitError> {
        let given = plain(name);
        let is = |unit: &&Self| plain(unit.name) == given || unit.also.contains(&given.as_str());
        let unknown = || UnitError::Unknown { name: name.to_owned() };
        UNITS.iter().find(is).copied().ok_or_else(unknown)
    }

    /// A number of this unit in SI; `density_kg_m2` is what a bending length needs.
    ///
    /// # Errors
    /// A number that is not positive, a bending length without density, a slider beyond its curve.
    pub fn to_si(&self, value: f64, density_kg_m2: Option<f64>) -> Result<f64, UnitError> {
        if !(value.is_finite() && value > 0.0) {
            return Err(UnitError::NotPositive { value, unit: self.name });
        }
        match self.scale {
            Scale::Factor(factor) => Ok(value * factor),
            Scale::BendingLength => {
                let weight_n_m2 = weight_n_m2(density_kg_m2)?;
                Ok(weight_n_m2 * (value * 1e-3).powi(3))
            }
            Scale::Slider => {
                let [low, high] = slider::POSITIONS;
                let beyond = UnitError::BeyondSlider { value, unit: self.name, low, high };
                slider::stiffness_n_m(value).ok_or(beyond)
            }
        }
    }

    /// A number in SI in this unit: the inverse of [`Self::to_si`].
    ///
    /// # Errors
    /// As there; the ends of the slider are then in g/s^2.
    pub fn of_si(&self, si: f64, density_kg_m2: Option<f64>) -> Result<f64, UnitError> {
        match self.scale {
            Scale::Factor(factor) => Ok(si / factor),
            Scale::BendingLength => Ok((si / weight_n_m2(density_kg_m2)?).cbrt() * 1e3),
            Scale::Slider => {
                let [low, high] = slider::STIFFNESSES_G_S2;
                let (value, unit) = (si / 1e-3, "g/s^2");
                let beyond = UnitError::BeyondSlider { value, unit, low, high };
                slider::position(si).ok_or(beyond)
            }
        }
    }
}

/// The weight of an area \[N/m^2\].
fn weight_n_m2(density_kg_m2: Option<f64>) -> Result<f64, UnitError> {
    let density = density_kg_m2.ok_or(UnitError::NoDensity)?;
    if density.is_finite() && density > 0.0 {
        return Ok(density * GRAVITY_M_S2);
    }
    Err(UnitError::NotPositive { value: density, unit: "kg/m^2" })
}

/// The bending length (B / (rho g))^(1/3) \[m\] of a bending stiffness \[N m\].
#[must_use]
pub fn bending_length_m(bending_nm: f64, density_kg_m2: f64) -> f64 {
    (bending_nm / (density_kg_m2 * GRAVITY_M_S2)).cbrt()
}

/// A number of one unit in another. `density_kg_m2` is what bending lengths need.
///
/// # Errors
/// [`UnitError`]: other quantities, no density, beyond the slider, not positive.
pub fn convert(
    value: f64,
    from: &Unit,
    to: &Unit,
    density_kg_m2: Option<f64>,
) -> Result<f64, UnitError> {
    if from.quantity != to.quantity {
        return Err(UnitError::Quantities { from: *from, to: *to });
    }
    to.of_si(from.to_si(value, density_kg_m2)?, density_kg_m2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn between(value: f64, from: &str, to: &str) -> f64 {
        let [from, to] = [from, to].map(|name| Unit::named(name).unwrap());
        convert(value, &from, &to, Some(0.214)).unwrap()
    }

    /// Numbers of standards and tables, none from this program.
    #[test]
    fn known_numbers() {
        for (value, from, expected, to, within) in [
            (1.0, "gf cm^2/cm", 98_066.5, "g mm^2/s^2", 1e-12),
            (1.0, "gf/(cm deg)", 56_188.0, "g/s^2", 1e-5),
            (1.0, "dyn cm", 100.0, "g mm^2 s^-2 rad^-1", 1e-12),
            (1.0, "oz/yd^2", 33.906, "g/m^2", 1e-5),
            (214.0, "g/m^2", 2.14e-4, "g/mm^2", 1e-12),
            (0.0214, "g/cm2", 214.0, "gsm", 1e-12),
            (131_010.96, "g/s^2", 131.010_96, "N/m", 1e-12),
            // the mean knit of Table 2
            (1119.74, "g mm^2/s^2", 8.1, "mm", 2e-3),
            (1119.74, "g mm^2/s^2", 0.0114, "gf cm^2/cm", 3e-3),
            (1.0, "µN m", 1e-6, "N m", 1e-12),
        ] {
            let found = between(value, from, to);
            assert!((found / expected - 1.0).abs() < within, "{value} {from} = {found} {to}");
        }
    }

    #[test]
    fn there_and_back_is_the_same_number() {
        for from in UNITS {
            for to in UNITS.iter().filter(|to| to.quantity == from.quantity) {
                let value = 37.5;
                let there = convert(value, from, to, Some(0.2));
                // the least of other units may lie beyond the slider
                let Ok(there) = there else { continue };
                let back = convert(there, to, from, Some(0.2)).unwrap();
                assert!((back / value - 1.0).abs() < 1e-12, "{} {}", from.name, to.name);
            }
        }
    }

    #[test]
    fn names_do_not_clash_and_spellings_are_known() {
        for (k, unit) in UNITS.iter().enumerate() {
            let spelled = |u: &Unit| -> Vec<String> {
                u.also.iter().map(|s| (*s).to_owned()).chain([plain(u.name)]).collect()
            };
            for other in &UNITS[k + 1..] {
                assert!(spelled(unit).iter().all(|s| !spelled(other).contains(s)), "{unit:?}");
            }
            for also in unit.also {
                assert_eq!(plain(also), *also);
                assert_eq!(Unit::named(also).unwrap().name, unit.name);
            }
        }
    }

    #[test]
    fn other_quantities_are_refused_with_those_that_would_do() {
        let [from, to] = ["N/m", "N m"].map(|name| Unit::named(name).unwrap());
        let error = convert(1.0, &from, &to, None).unwrap_err().to_string();
        assert!(error.contains("g/s^2, N/m, gf/cm, gf/(cm deg), clo-slider"), "{error}");
        assert!(Unit::named("furlong").unwrap_err().to_string().contains("oz/yd^2"));
        let mm = Unit::named("mm").unwrap();
        assert_eq!(convert(8.0, &mm, &to, None), Err(UnitError::NoDensity));
        assert!(matches!(mm.to_si(-1.0, Some(0.2)), Err(UnitError::NotPositive { .. })));
    }
}
