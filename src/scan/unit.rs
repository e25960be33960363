//! The unit of length of a scan's coordinates.

use serde::Serialize;

/// Units that sensors and programs write.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum LengthUnit {
    /// Metres.
    Metre,
    /// Millimetres.
    Millimetre,
    /// Centimetres.
    Centimetre,
    /// Inches of 25.4 mm.
    Inch,
    /// Feet of 304.8 mm.
    Foot,
    /// Micrometres.
    Micrometre,
    /// Tenths of a millimetre.
    TenthMillimetre,
}

impl LengthUnit {
    /// All of them, those first that sensors write most.
    pub const ALL: [Self; 7] = [
        Self::Metre,
        Self::Millimetre,
        Self::Centimetre,
        Self::Inch,
        Self::Foot,
        Self::Micrometre,
        Self::TenthMillimetre,
    ];

    /// The unit of this symbol; `None` for an unknown one.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|unit| unit.name() == name)
    }

    /// The unit's symbol.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Metre => "m",
            Self::Millimetre => "mm",
            Self::Centimetre => "cm",
            Self::Inch => "in",
            Self::Foot => "ft",
            Self::Micrometre => "um",
            Self::TenthMillimetre => "0.1mm",
        }
    }

    /// Metres in one unit.
    #[must_use]
    pub fn metres(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Millimetre => 1e-3,
            Self::Centimetre => 1e-2,
            Self::Inch => 25.4e-3,
            Self::Foot => 304.8e-3,
            Self::Micrometre => 1e-6,
            Self::TenthMillimetre => 1e-4,
        }
    }
}
