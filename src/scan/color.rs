//! The colour of a mark, as a user names it, and colours without their brightness.
//!
//! Colours are compared by their chromaticity, the shares of red, green and blue, which
//! shadows do not change. Grey, black and white have none of their own.

use std::str::FromStr;

use serde::Serialize;

/// The colour of a mark: red, green, blue, 0 to 255 \[-\].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct MarkColor(pub [u8; 3]);

/// Names, with the colours of tape and chalk rather than of screens.
const NAMED: [(&str, [u8; 3]); 7] = [
    ("red", [220, 40, 40]),
    ("orange", [240, 130, 30]),
    ("yellow", [235, 215, 40]),
    ("green", [40, 160, 70]),
    ("cyan", [40, 190, 210]),
    ("blue", [40, 70, 200]),
    ("magenta", [210, 40, 160]),
];
/// Chromaticities closer than this cannot be told apart. Chosen.
pub(super) const LEAST_DIFFERENCE: f64 = 0.10;
/// Darker colours have no hue: sum of the three channels. Chosen.
const DARKEST: f64 = 45.0;

/// The shares of red, green and blue in a colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Chromaticity(pub [f64; 3]);

impl Chromaticity {
    /// That of grey.
    const GREY: Self = Self([1.0 / 3.0; 3]);

    /// The chromaticity of a colour; `None` of a dark one.
    pub fn of(color: [u8; 3]) -> Option<Self> {
        let color = color.map(f64::from);
        let sum: f64 = color.iter().sum();
        (sum >= DARKEST).then(|| Self(color.map(|c| c / sum)))
    }

    /// What leads from another chromaticity to this one.
    pub fn minus(self, other: Self) -> [f64; 3] {
        [0, 1, 2].map(|k| self.0[k] - other.0[k])
    }

    /// The distance between two chromaticities.
    pub fn distance(self, other: Self) -> f64 {
        norm(self.minus(other))
    }
}

/// The length of a difference of chromaticities.
pub(super) fn norm(difference: [f64; 3]) -> f64 {
    difference.iter().map(|d| d.powi(2)).sum::<f64>().sqrt()
}

impl FromStr for MarkColor {
    type Err = String;

    /// A name or `#rrggbb`.
    fn from_str(text: &str) -> Result<Self, String> {
        let named = NAMED.iter().find(|(name, _)| text.eq_ignore_ascii_case(name));
        let hex = || {
            let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.is_ascii())?;
            let channel = |k: usize| u8::from_str_radix(&digits[2 * k..2 * k + 2], 16).ok();
            Some([channel(0)?, channel(1)?, channel(2)?])
        };
        let names = NAMED.map(|(name, _)| name).join(", ");
        let color = named.map(|(_, color)| *color).or_else(hex);
        let color = color.ok_or_else(|| format!("give #rrggbb or one of {names}"))?;
        let shares = Chromaticity::of(color).unwrap_or(Chromaticity::GREY);
        if shares.distance(Chromaticity::GREY) < LEAST_DIFFERENCE {
            return Err(format!("{text} has no hue that a shadow keeps; mark in one of {names}"));
        }
        Ok(Self(color))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_have_names_and_greys_are_none() {
        assert_eq!("Red".parse(), Ok(MarkColor([220, 40, 40])));
        assert_eq!("#0a64ff".parse(), Ok(MarkColor([10, 100, 255])));
        for wrong in ["", "#12", "#12345g", "#808080", "#000000", "white", "#ffffff"] {
            assert!(wrong.parse::<MarkColor>().is_err(), "{wrong}");
        }
    }
}
