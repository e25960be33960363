//! U3M 1.1: the material's JSON, and next to it the physics file that it names, in which
//! Browzwear's programs look for stiffnesses.
//!
//! Source: the schemas `u3m1.1/spec/u3m_schema.json` and `u3m1.1/physics/physics_schema.json` and
//! their examples. The material has thickness \[mm\] and weight \[g/m^2\]. The physics file has no
//! measurements (`raw_data` null: nothing was pulled or pressed) and in `custom.browzwear` what a
//! FAB derives from them: bend \[dyn cm\], stretch and shear \[N/m\], mass \[g/m^2\], along the
//! length (warp) and the width (weft). Visuals are null. The identity is drawn from the content:
//! the same fabric is the same material. Not tried in Browzwear's programs: there are none to be
//! had here.

use std::time::SystemTime;

use serde_json::{Value, json};

use super::exported::{Companion, Exported, Options, companion_name};
use super::going_along;
use super::units::NM_PER_DYN_CM;
use crate::base::units::{KG_M2_PER_G_M2, M_PER_MM};
use crate::fabric::params::Params;
use crate::fabric::sha256_hex;

/// What the physics file's name ends in.
const FAB_ENDING: &str = ".fab.json";

pub(super) fn write(params: &Params, options: &Options, out_stem: &str) -> Exported {
    let fabric = &params.fabric;
    let lost = vec![format!(
        "bending along the bias ({:.4} uN m): there is no field",
        fabric.bending_bias_nm * 1e6
    )];
    let mut notes = vec!["length is the warp, width the weft".to_owned()];
    if options.thickness_m.is_none() {
        notes.push("thickness is not known from a drape and left open (--thickness-mm)".to_owned());
    }
    let physics = json!({
        "schema": "1.1",
        "raw_data": null,
        "custom": { "browzwear": browzwear(params, options) },
    });
    let along = going_along::json(params, &lost, &notes);
    let made = date_time(options.made);
    let material = json!({
        "schema": "1.1",
        "material": {
            "id": identity(&format!("{}{physics}", options.name)),
            "name": if options.name.is_empty() { "fabric" } else { &options.name },
            "description": going_along::NOTE,
            "created": made,
            "modified": made,
            "front": null,
            "back": null,
            "side": null,
            "physics": {
                "thickness": options.thickness_m.map(|m| m / M_PER_MM),
                "weight": fabric.density_kg_m2 / KG_M2_PER_G_M2,
                "composition": null,
                "devices": { "fab": companion_name(out_stem, FAB_ENDING) },
                "material_type": null,
                "construction": null,
            },
            "metadata": null,
        },
        "custom": { "scan2params": along },
    });
    let companion = Companion { ending: FAB_ENDING, text: going_along::text(&physics) };
    Exported { text: going_along::text(&material), companion: Some(companion), lost, notes }
}

fn browzwear(params: &Params, options: &Options) -> Value {
    let fabric = &params.fabric;
    let mut of = json!({
        "name": options.name,
        "bend": {
            "length": fabric.bending_warp_nm / NM_PER_DYN_CM,
            "width": fabric.bending_weft_nm / NM_PER_DYN_CM,
        },
        "stretch": { "length": fabric.stretch_warp_n_m, "width": fabric.stretch_weft_n_m },
        "shear": fabric.shear_n_m,
        "mass": fabric.density_kg_m2 / KG_M2_PER_G_M2,
    });
    if let Some(thickness) = options.thickness_m {
        of["thickness"] = json!(thickness / M_PER_MM);
    }
    if let Some(friction) = options.friction {
        of["friction"] = json!(friction);
    }
    of
}

/// A UUID of version 4's form from the hash of a text.
fn identity(text: &str) -> String {
    let hex = sha256_hex(text.as_bytes());
    let variant = ["8", "9", "a", "b"][usize::from(hex.as_bytes()[16]) % 4];
    format!(
        "{}-{}-4{}-{variant}{}-{}",
        &hex[..8],
        &hex[8..12],
        &hex[13..16],
        &hex[17..20],
        &hex[20..32]
    )
}

/// A time as RFC 3339 has it, in UTC, whole seconds; times before 1970 are its beginning.
fn date_time(time: SystemTime) -> String {
    let seconds = time.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let (days, second) = (seconds / 86_400, seconds % 86_400);
    // Years begin in March here, so that a leap day is the last of its year; 1970-01-01 is day
    // 719468.
    let day = days + 719_468;
    let era = day / 146_097;
    let of_era = day % 146_097;
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month = (5 * of_year + 2) / 153;
    let day_of_month = of_year - (153 * month + 2) / 5 + 1;
    let (month, next) = if month < 10 { (month + 3, 0) } else { (month - 9, 1) };
    let year = era * 400 + year_of_era + next;
    let [h, m, s] = [second / 3600, second / 60 % 60, second % 60];
    format!("{year:04}-{month:02}-{day_of_month:02}T{h:02}:{m:02}:{s:02}Z")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fabric::Fabric;

    #[test]
    fn the_schemas_fields_and_units() {
        let fabric = Fabric::from_paper_units([1e5, 2e5, 6e4, 900.0, 2100.0, 1500.0, 200.0]);
        let options = Options { thickness_m: Some(0.5e-3), ..Options::named("a") };
        let exported = write(&Params::of(fabric), &options, "cloth");
        let material: Value = serde_json::from_str(&exported.text).unwrap();
        let physics: Value = serde_json::from_str(&exported.companion.unwrap().text).unwrap();
        let keys = |value: &Value| {
            value.as_object().unwrap().keys().map(String::as_str).collect::<Vec<_>>().join(" ")
        };
        // what the schemas require, and nothing more where they allow nothing more
        assert_eq!(keys(&material), "custom material schema");
        assert_eq!(
            keys(&material["material"]),
            "back created description front id metadata modified name physics side"
        );
        assert_eq!(
            keys(&material["material"]["physics"]),
            "composition construction devices material_type thickness weight"
        );
        assert_eq!(keys(&physics), "custom raw_data schema");
        assert_eq!(material["material"]["physics"]["devices"]["fab"], "cloth.fab.json");
        let of = |pointer: &str| {
            physics["custom"]["browzwear"].pointer(pointer).unwrap().as_f64().unwrap()
        };
        for (pointer, expected) in [
            ("/bend/length", 21.0),
            ("/bend/width", 9.0),
            ("/stretch/length", 200.0),
            ("/stretch/width", 100.0),
            ("/shear", 60.0),
            ("/mass", 200.0),
            ("/thickness", 0.5),
        ] {
            assert!((of(pointer) / expected - 1.0).abs() < 1e-9, "{pointer}: {}", of(pointer));
        }
        assert_eq!(material["material"]["physics"]["weight"].as_f64().unwrap().round(), 200.0);
        assert!(exported.lost[0].contains("bias"));
    }

    #[test]
    fn identities_are_uuids_and_follow_the_content() {
        let (one, other) = (identity("a"), identity("b"));
        assert_ne!(one, other);
        assert_eq!(one, identity("a"));
        for id in [one, other] {
            let parts: Vec<&str> = id.split('-').collect();
            assert_eq!(parts.iter().map(|p| p.len()).collect::<Vec<_>>(), [8, 4, 4, 4, 12]);
            assert!(parts[2].starts_with('4') && parts[3].starts_with(['8', '9', 'a', 'b']));
            assert!(parts.concat().chars().all(|c| c.is_ascii_hexdigit()));
        }
    }

    #[test]
    fn dates_of_leap_years_and_centuries() {
        let at =
            |seconds| date_time(SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(seconds));
        for (seconds, text) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_400, "2000-02-29T00:00:00Z"),
            (951_868_799, "2000-02-29T23:59:59Z"),
            (951_868_800, "2000-03-01T00:00:00Z"),
            (1_735_689_599, "2024-12-31T23:59:59Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
        ] {
            assert_eq!(at(seconds), text);
        }
    }
}
