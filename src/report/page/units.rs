//! The six stiffnesses and the density in the units of those who read them: the paper's, SI,
//! textile laboratories', CLO's.
//!
//! In: values in the paper's units, paper's order. Out: for each a list of the same quantity in
//! other units. KES is the Kawabata Evaluation System: bending rigidity in gf cm^2/cm, shear
//! stiffness in gf/(cm degree). 1 gf is 0.00980665 N. CLO's numbers are those of its `.jfab` files,
//! whose base units are the paper's but for the density; a file says them under the names given
//! here.

use crate::fabric::PARAMETERS;

/// A unit of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Its symbol.
    pub name: &'static str,
    /// How many of it one of the paper's units is.
    pub per_paper_unit: f64,
}

/// A parameter's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// Words for people.
    pub words: &'static str,
    /// SI.
    pub si: Unit,
    /// Textile laboratories': one or two.
    pub textile: &'static [Unit],
    /// CLO's.
    pub clo: Unit,
    /// Its name in CLO's `.jfab`.
    pub clo_field: &'static str,
}

/// g/s^2 in gf/cm: 1 gf/cm is 980.665 g/s^2.
const GF_CM: f64 = 1.0 / 980.665;
/// g/s^2 per radian in gf/(cm degree).
const GF_CM_DEG: f64 = GF_CM * std::f64::consts::PI / 180.0;
/// g mm^2/s^2 in gf cm^2/cm: 1 gf cm is 98066.5 g mm^2/s^2.
const GF_CM2_CM: f64 = 1.0 / 98_066.5;

const STRETCH: &[Unit] = &[Unit { name: "gf/cm", per_paper_unit: GF_CM }];
const SHEAR: &[Unit] = &[Unit { name: "gf/(cm\u{b7}\u{b0}), KES", per_paper_unit: GF_CM_DEG }];
const BENDING: &[Unit] = &[
    Unit { name: "\u{b5}N\u{b7}m", per_paper_unit: 1e-3 },
    Unit { name: "gf\u{b7}cm\u{b2}/cm, KES", per_paper_unit: GF_CM2_CM },
];

const fn force(words: &'static str, textile: &'static [Unit], clo_field: &'static str) -> Units {
    let si = Unit { name: "N/m", per_paper_unit: 1e-3 };
    Units { words, si, textile, clo: Unit { name: "g/s\u{b2}", per_paper_unit: 1.0 }, clo_field }
}

const fn bending(words: &'static str, clo_field: &'static str) -> Units {
    let si = Unit { name: "N\u{b7}m", per_paper_unit: 1e-9 };
    let clo = Unit { name: "g\u{b7}mm\u{b2}/s\u{b2}", per_paper_unit: 1.0 };
    Units { words, si, textile: BENDING, clo, clo_field }
}

/// The units of each parameter, paper's order.
pub const UNITS: [Units; PARAMETERS] = [
    force("Stretch, weft", STRETCH, "fSuK"),
    force("Stretch, warp", STRETCH, "fSvK"),
    force("Shear", SHEAR, "fHK"),
    bending("Bending, weft", "fBuK"),
    bending("Bending, warp", "fBvK"),
    bending("Bending, bias", "fBhK"),
    Units {
        words: "Areal density",
        si: Unit { name: "kg/m\u{b2}", per_paper_unit: 1e-3 },
        textile: &[Unit { name: "g/m\u{b2}", per_paper_unit: 1.0 }],
        clo: Unit { name: "g/mm\u{b2}", per_paper_unit: 1e-6 },
        clo_field: "fDensity",
    },
];

/// A unit of the paper's, as a page writes it.
#[must_use]
pub fn typeset(unit: &str) -> String {
    match unit {
        "g/s^2" => "g/s\u{b2}".to_owned(),
        "g/m^2" => "g/m\u{b2}".to_owned(),
        "g mm^2 s^-2 rad^-1" => {
            "g\u{b7}mm\u{b2}\u{b7}s\u{207b}\u{b2}\u{b7}rad\u{207b}\u{b9}".to_owned()
        }
        other => other.to_owned(),
    }
}

/// A parameter by its name in files, in words; the name itself where it is none.
#[must_use]
pub fn words(key: &str) -> String {
    let at = crate::fabric::TABLE_2.iter().position(|range| range.key == key);
    at.map_or_else(|| key.to_owned(), |k| UNITS[k].words.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fabric::{Fabric, TABLE_2};

    #[test]
    fn si_is_that_of_the_fabric_and_kes_that_of_the_standard_gravity() {
        let fabric = Fabric::mean_knit();
        for (k, (paper, si)) in fabric.to_paper_units().iter().zip(fabric.in_si()).enumerate() {
            let own = paper * UNITS[k].si.per_paper_unit;
            assert!((own / si - 1.0).abs() < 1e-12, "{} {own} {si}", TABLE_2[k].key);
        }
        // the mean knit of Table 2: 131 N/m, 0.0114 gf cm^2/cm
        let bending = 1119.74 * UNITS[3].textile[1].per_paper_unit;
        assert!((bending - 0.011_418).abs() < 1e-6, "{bending}");
        // 1 gf/cm per degree is 980.665 g/s^2 over a degree's radians
        assert!((56_188.0 * UNITS[2].textile[0].per_paper_unit - 1.0).abs() < 1e-5);
        assert!((980.665 * UNITS[0].textile[0].per_paper_unit - 1.0).abs() < 1e-12);
    }
}
