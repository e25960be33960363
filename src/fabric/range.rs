//! Where the parameters are known, and checks of one fabric against it.
//!
//! In: a [`Fabric`] (SI). Out: warnings, or every fault at once. Limits are kept
//! in the paper's units because Table 2 prints them so and the messages speak
//! to people who know them so.
//!
//! Bending: for an orthotropic plate B^h = (B^u + B^v + 2 D3) / 4 (docs/design/
//! estimation.md), so its energy is positive only while
//! B^h >= (sqrt B^u - sqrt B^v)^2 / 4.

use super::values::Fabric;
use crate::base::units::{BENDING_UNIT, DENSITY_UNIT, N_M_PER_G_MM2_S2, STRETCH_UNIT};

/// Parameters of a fabric, density included.
pub const PARAMETERS: usize = 7;
/// Stiffnesses of a fabric.
pub const STIFFNESSES: usize = 6;

/// One row of Table 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterRange {
    /// Name in files and options.
    pub key: &'static str,
    /// The paper's symbol.
    pub symbol: &'static str,
    /// Unit of the numbers here.
    pub unit: &'static str,
    /// Mean of the measured fabrics.
    pub mean: f64,
    /// Standard deviation of the measured fabrics.
    pub sd: f64,
    /// Smallest of the measured fabrics.
    pub min: f64,
    /// Largest of the measured fabrics.
    pub max: f64,
}

impl ParameterRange {
    /// Whether `value` (in [`Self::unit`]) lies inside, with room for rounding.
    #[must_use]
    pub fn contains(&self, value: f64) -> bool {
        // One part in 10^9 is far below any measurement and far above what the
        // conversion to SI and back loses.
        value >= self.min * (1.0 - 1e-9) && value <= self.max * (1.0 + 1e-9)
    }
}

/// Table 2 of the paper, in the order of [`Fabric::from_paper_units`]. The sd of
/// S^v is printed there as a copy of its mean; here it has the coefficient of
/// variation of S^u.
pub const TABLE_2: [ParameterRange; PARAMETERS] = [
    row("stretch_weft", "S^u", STRETCH_UNIT, [131_010.96, 158_742.72, 1_351.57, 1e6]),
    row("stretch_warp", "S^v", STRETCH_UNIT, [163_944.78, 198_647.81, 2_783.85, 1e6]),
    row("shear", "H", STRETCH_UNIT, [75_064.22, 120_353.45, 638.27, 1e6]),
    row("bending_weft", "B^u", BENDING_UNIT, [1_119.74, 3_009.62, 33.57, 43_753.10]),
    row("bending_warp", "B^v", BENDING_UNIT, [1_370.87, 3_244.53, 45.78, 43_753.10]),
    row("bending_bias", "B^h", BENDING_UNIT, [1_245.30, 2_712.10, 45.78, 27_932.70]),
    row("density", "D", DENSITY_UNIT, [214.02, 66.44, 53.03, 393.43]),
];

const fn row(
    key: &'static str,
    symbol: &'static str,
    unit: &'static str,
    [mean, sd, min, max]: [f64; 4],
) -> ParameterRange {
    ParameterRange { key, symbol, unit, mean, sd, min, max }
}

/// Densities that a textile can have at all \[g/m^2\]: tulle is near 10, the
/// heaviest coatings near 1500. Outside it is a slip of units.
pub const DENSITY_LIMITS_G_M2: [f64; 2] = [1.0, 2000.0];

/// Something that a fabric can be simulated with, but that should be known.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Warning {
    /// Outside the measured fabrics.
    #[error("{key} = {value} {unit} lies outside the measured fabrics ({min} to {max} {unit})")]
    OutsideTable2 {
        /// Parameter.
        key: &'static str,
        /// Its value in `unit`.
        value: f64,
        /// Unit.
        unit: &'static str,
        /// Lower end.
        min: f64,
        /// Upper end.
        max: f64,
    },
    /// B^h was raised so that the plate's bending energy is positive.
    #[error(
        "bending_bias raised from {from} to {to} {BENDING_UNIT}: below that the bending energy \
         of these bending_weft and bending_warp is not positive"
    )]
    BendingProjected {
        /// Before \[g mm^2 s^-2 rad^-1\].
        from: f64,
        /// After \[g mm^2 s^-2 rad^-1\].
        to: f64,
    },
}

/// Why a fabric cannot be simulated.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Fault {
    /// NaN or infinite.
    #[error("{key} = {value} is not a number: give a positive value in {unit}")]
    NotFinite {
        /// Parameter.
        key: &'static str,
        /// Its value.
        value: f64,
        /// Unit to give it in.
        unit: &'static str,
    },
    /// Zero or negative.
    #[error(
        "{key} = {value} {unit} is not positive: give a value above 0 ({min} to {max} is usual)"
    )]
    NotPositive {
        /// Parameter.
        key: &'static str,
        /// Its value in `unit`.
        value: f64,
        /// Unit.
        unit: &'static str,
        /// Table 2's minimum.
        min: f64,
        /// Table 2's maximum.
        max: f64,
    },
    /// No textile has it.
    #[error(
        "density = {value} g/m^2 is outside {} to {} g/m^2: give the areal density in grams per \
         square metre{}", DENSITY_LIMITS_G_M2[0], DENSITY_LIMITS_G_M2[1], other_unit(*value)
    )]
    Density {
        /// Areal density \[g/m^2\].
        value: f64,
    },
    /// The three bending stiffnesses cannot belong to one plate.
    #[error(
        "bending_bias = {value} {BENDING_UNIT} is below {limit}, the least that bending_weft and \
         bending_warp allow ((sqrt B^u - sqrt B^v)^2 / 4): raise it to that, or project it"
    )]
    BendingNotPositive {
        /// B^h \[g mm^2 s^-2 rad^-1\].
        value: f64,
        /// Least admissible B^h \[g mm^2 s^-2 rad^-1\].
        limit: f64,
    },
}

/// All faults of one fabric.
#[derive(Clone, Debug, PartialEq)]
pub struct FabricError {
    /// At least one, in the order of the parameters.
    pub faults: Vec<Fault>,
}

impl std::fmt::Display for FabricError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let lines: Vec<String> = self.faults.iter().map(ToString::to_string).collect();
        f.write_str(&lines.join("; "))
    }
}

/// What a density below the limits may have been meant as: the units that fabrics are weighed in
/// and whose numbers are that small.
fn other_unit(g_m2: f64) -> String {
    let [min, max] = DENSITY_LIMITS_G_M2;
    let meant: Vec<String> = [("kg/m^2", 1e3), ("g/cm^2", 1e4)]
        .into_iter()
        .map(|(unit, factor)| (unit, g_m2 * factor))
        .filter(|(_, meant)| g_m2 < min && (10.0 * min..=max).contains(meant))
        .map(|(unit, meant)| format!("{g_m2} {unit} are {}", (meant * 1e6).round() / 1e6))
        .collect();
    if meant.is_empty() { String::new() } else { format!(" ({})", meant.join(", ")) }
}

impl std::error::Error for FabricError {}

/// Refuses a density that no textile has \[kg/m^2\].
///
/// # Errors
/// [`Fault::NotFinite`] or [`Fault::Density`].
pub fn check_density(density_kg_m2: f64) -> Result<(), Fault> {
    let value = density_kg_m2 / crate::base::units::KG_M2_PER_G_M2;
    if !value.is_finite() {
        return Err(Fault::NotFinite { key: "density", value, unit: DENSITY_UNIT });
    }
    // As in `contains`: 2000 g/m^2 given as 2 kg/m^2 is inside.
    let [min, max] = DENSITY_LIMITS_G_M2;
    if value < min * (1.0 - 1e-9) || value > max * (1.0 + 1e-9) {
        return Err(Fault::Density { value });
    }
    Ok(())
}

impl Fabric {
    /// Checks that the fabric can be simulated; warns where it lies outside the
    /// measured fabrics.
    ///
    /// # Errors
    /// All faults at once: not finite, not positive, a density outside
    /// [`DENSITY_LIMITS_G_M2`], a bending set whose energy is not positive.
    pub fn check(&self) -> Result<Vec<Warning>, FabricError> {
        let values = self.to_paper_units();
        let mut faults: Vec<Fault> = TABLE_2
            .iter()
            .zip(values)
            .take(STIFFNESSES)
            .filter_map(|(&ParameterRange { key, unit, min, max, .. }, value)| {
                if !value.is_finite() {
                    Some(Fault::NotFinite { key, value, unit })
                } else if value <= 0.0 {
                    Some(Fault::NotPositive { key, value, unit, min, max })
                } else {
                    None
                }
            })
            .collect();
        faults.extend(check_density(self.density_kg_m2).err());
        if faults.is_empty() && !self.bending_is_positive() {
            let limit = self.least_bending_bias_nm() / N_M_PER_G_MM2_S2;
            faults.push(Fault::BendingNotPositive { value: values[5], limit });
        }
        if faults.is_empty() { Ok(self.range_warnings()) } else { Err(FabricError { faults }) }
    }

    /// Raises B^h to the least for which the bending energy is positive; says so
    /// if it had to.
    #[must_use]
    pub fn project_bending(mut self) -> (Self, Option<Warning>) {
        if self.bending_is_positive() {
            return (self, None);
        }
        let from = self.bending_bias_nm / N_M_PER_G_MM2_S2;
        self.bending_bias_nm = self.least_bending_bias_nm();
        let to = self.bending_bias_nm / N_M_PER_G_MM2_S2;
        (self, Some(Warning::BendingProjected { from, to }))
    }

    /// (sqrt B^u - sqrt B^v)^2 / 4 \[N m\].
    #[must_use]
    pub fn least_bending_bias_nm(&self) -> f64 {
        0.25 * (self.bending_weft_nm.sqrt() - self.bending_warp_nm.sqrt()).powi(2)
    }

    /// Whether the plate's bending energy is positive; a rounding error below
    /// the limit counts as on it.
    #[must_use]
    pub fn bending_is_positive(&self) -> bool {
        self.bending_bias_nm >= self.least_bending_bias_nm() * (1.0 - 1e-12)
    }

    fn range_warnings(&self) -> Vec<Warning> {
        let outside = |(range, value): (&ParameterRange, f64)| {
            let &ParameterRange { key, unit, min, max, .. } = range;
            (!range.contains(value)).then_some(Warning::OutsideTable2 {
                key,
                value,
                unit,
                min,
                max,
            })
        };
        TABLE_2.iter().zip(self.to_paper_units()).filter_map(outside).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(index: usize, value: f64) -> Fabric {
        let mut v = Fabric::mean_knit().to_paper_units();
        v[index] = value;
        Fabric::from_paper_units(v)
    }

    #[test]
    fn the_mean_knit_is_sound_and_inside() {
        assert_eq!(Fabric::mean_knit().check(), Ok(vec![]));
    }

    #[test]
    fn every_parameter_is_refused_when_not_positive_or_not_finite_and_named() {
        for (index, range) in TABLE_2.iter().enumerate() {
            for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
                let error = with(index, bad).check().unwrap_err();
                assert_eq!(error.faults.len(), 1, "{error}");
                assert!(error.to_string().starts_with(range.key), "{error}");
            }
        }
    }

    #[test]
    fn a_density_in_another_unit_is_refused_with_what_it_would_be() {
        let said = |g_m2: f64| check_density(1e-3 * g_m2).unwrap_err().to_string();
        assert!(said(0.214).contains("0.214 kg/m^2 are 214)"), "{}", said(0.214));
        assert!(said(0.0214).contains("0.0214 g/cm^2 are 214)"), "{}", said(0.0214));
        for none in [0.0, -214.0, 5000.0] {
            assert!(said(none).ends_with("per square metre"), "{}", said(none));
        }
    }

    #[test]
    fn all_faults_are_reported_at_once() {
        let bad = Fabric::from_paper_units([-1.0, 0.0, f64::NAN, 1.0, 1.0, 1.0, 5000.0]);
        assert_eq!(bad.check().unwrap_err().faults.len(), 4);
    }

    #[test]
    fn the_ends_of_the_box_are_inside_and_beyond_them_is_a_warning() {
        for (index, range) in TABLE_2.iter().enumerate() {
            if range.key == "bending_bias" {
                continue; // its ends depend on the other two; see the projection test
            }
            let outside = |value| {
                let fabric = with(index, value).project_bending().0;
                let named = |w: &Warning| matches!(w, Warning::OutsideTable2 { key, .. } if *key == range.key);
                fabric.check().unwrap().iter().any(named)
            };
            assert!(!outside(range.min) && !outside(range.max), "{}", range.key);
            assert!(outside(range.min * 0.99) && outside(range.max * 1.01), "{}", range.key);
        }
    }

    #[test]
    fn density_is_refused_outside_its_limits_and_taken_on_them() {
        for (density, sound) in [(0.999, false), (1.0, true), (2000.0, true), (2001.0, false)] {
            assert_eq!(with(6, density).check().is_ok(), sound, "{density}");
        }
    }

    #[test]
    fn bending_below_its_limit_is_refused_and_projected_onto_it() {
        let v = |bias| Fabric::from_paper_units([1e5, 1e5, 1e5, 400.0, 3600.0, bias, 200.0]);
        let limit = 0.25 * (60.0_f64 - 20.0).powi(2);
        assert!(v(limit * 1.0001).check().is_ok());
        let error = v(limit * 0.9999).check().unwrap_err();
        assert!(matches!(error.faults[0], Fault::BendingNotPositive { .. }), "{error}");
        let (projected, warning) = v(100.0).project_bending();
        assert!(projected.check().is_ok());
        assert!((projected.to_paper_units()[5] - limit).abs() < 1e-9 * limit);
        assert!(warning.unwrap().to_string().contains("raised from"));
        assert_eq!(v(limit * 1.0001).project_bending().1, None);
    }
}
