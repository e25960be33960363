//! CLO and Marvelous Designer: a .jfab file, JSON with the stiffnesses in `mapPhysical`.
//!
//! CLO's units are the paper's, but for the density, g/mm^2 (the factors of an importer of CLO's
//! data, Unreal's Chaos cloth: g/s^2, g mm^2/s^2, g/mm^2, mm). fSuK, fBuK belong to the weft and
//! fSvK, fBvK to the warp; this order of u and v is second-hand, so that it can be exchanged.
//! Thickness and friction are written where they are given. Not tried in CLO: there is none to be
//! had here.

use serde_json::{Value, json};

use super::exported::{Exported, Options};
use super::going_along;
use crate::base::units::M_PER_MM;
use crate::fabric::params::Params;

/// g/mm^2 in a g/m^2.
const G_MM2_PER_G_M2: f64 = 1e-6;

pub(super) fn write(params: &Params, options: &Options) -> Exported {
    let [mut su, mut sv, shear, mut bu, mut bv, bias, density] = params.fabric.to_paper_units();
    if options.swap_warp_weft {
        (su, sv, bu, bv) = (sv, su, bv, bu);
    }
    let mut physical = json!({
        "fSuK": su,
        "fSvK": sv,
        "fHK": shear,
        "fBuK": bu,
        "fBvK": bv,
        "fBhK": bias,
        "fDensity": density * G_MM2_PER_G_M2,
    });
    let mut left_open = Vec::new();
    match options.thickness_m {
        Some(thickness) => physical["fThickness"] = json!(thickness / M_PER_MM),
        None => left_open.push("fThickness (--thickness-mm)"),
    }
    match options.friction {
        Some(friction) => physical["fFriction"] = json!(friction),
        None => left_open.push("fFriction (--friction)"),
    }
    let order = if options.swap_warp_weft { "u is the warp" } else { "u is the weft" };
    let mut notes = vec![format!(
        "{order}; CLO's order of u and v is second-hand: if the fabric comes out turned by 90 degrees, \
         export it with --swap-warp-weft or without"
    )];
    if !left_open.is_empty() {
        notes.push(format!("not known from a drape and left out: {}", left_open.join(", ")));
    }
    let along: Value = going_along::json(params, &[], &notes);
    let file = json!({ "name": options.name, "mapPhysical": physical, "scan2params": along });
    Exported { text: going_along::text(&file), companion: None, lost: Vec::new(), notes }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fabric::Fabric;

    const FABRIC: [f64; 7] = [1e5, 2e5, 6e4, 900.0, 2100.0, 1300.0, 200.0];

    fn written(options: &Options) -> Value {
        let params = Params::of(Fabric::from_paper_units(FABRIC));
        serde_json::from_str(&write(&params, options).text).unwrap()
    }

    fn near(value: &Value, expected: f64) {
        assert!((value.as_f64().unwrap() / expected - 1.0).abs() < 1e-12, "{value} {expected}");
    }

    #[test]
    fn units_and_order_are_clos() {
        let file = written(&Options::named("a"));
        let of = |key: &str| file["mapPhysical"][key].clone();
        for (key, expected) in [
            ("fSuK", 1e5),
            ("fSvK", 2e5),
            ("fHK", 6e4),
            ("fBuK", 900.0),
            ("fBvK", 2100.0),
            ("fBhK", 1300.0),
            ("fDensity", 2e-4),
        ] {
            near(&of(key), expected);
        }
        assert_eq!(of("fThickness"), Value::Null);
    }

    #[test]
    fn weft_and_warp_change_places_and_what_is_given_is_written() {
        let options = Options {
            swap_warp_weft: true,
            thickness_m: Some(0.4e-3),
            friction: Some(0.2),
            ..Options::named("a")
        };
        let file = written(&options);
        let of = |key: &str| file["mapPhysical"][key].clone();
        near(&of("fSuK"), 2e5);
        near(&of("fBvK"), 900.0);
        near(&of("fBhK"), 1300.0);
        near(&of("fThickness"), 0.4);
        near(&of("fFriction"), 0.2);
    }
}
