//! The distortion of a camera's lens, as the programs of sensors write it: the name of
//! a model and its coefficients.
//!
//! Out: k1, k2, p1, p2, k3 of Brown and Conrady (D. C. Brown, "Decentering Distortion of
//! Lenses", Photogrammetric Engineering 32, 1966), which [`super::Intrinsics`] undoes.
//! Anything else is refused with text for a message; nothing is left out silently.

use serde_json::Value;

use super::error::shown;

/// Names of the model of Brown and Conrady, small, `_` between words; the rational model
/// is this one where its further coefficients are 0.
const BROWN_CONRADY: [&str; 6] =
    ["", "plumb_bob", "brown_conrady", "radtan", "opencv", "rational_polynomial"];
/// Parts of the names of models that are no pinhole, with any coefficients.
const FISHEYE: [&str; 4] = ["fisheye", "equidistant", "kannala", "ftheta"];

/// The five coefficients of Brown and Conrady, from those of the model named.
pub(super) fn brown_conrady(model: &str, coefficients: &[f64]) -> Result<[f64; 5], String> {
    let name = model.trim_matches(['"', '\'', ' ']).to_ascii_lowercase().replace([' ', '-'], "_");
    let name = name.strip_prefix("distortion.").unwrap_or(&name);
    let remedy =
        "only Brown and Conrady's (plumb_bob) with five is; undistort the depth images first";
    if FISHEYE.iter().any(|part| name.contains(part)) {
        return Err(format!(
            "a camera of the model `{}` is not read: {remedy}",
            shown(model.as_bytes())
        ));
    }
    let used = coefficients.iter().rposition(|&d| d != 0.0).map_or(0, |last| last + 1);
    match coefficients.get(..used.max(5).min(coefficients.len())) {
        _ if used == 0 => Ok([0.0; 5]),
        Some(&[k1, k2, p1, p2]) if BROWN_CONRADY.contains(&name) => Ok([k1, k2, p1, p2, 0.0]),
        Some(&[k1, k2, p1, p2, k3]) if BROWN_CONRADY.contains(&name) => Ok([k1, k2, p1, p2, k3]),
        _ => Err(format!(
            "distortion `{}` with {} coefficients is not known: {remedy}",
            shown(model.as_bytes()),
            coefficients.len()
        )),
    }
}

/// Keys under which programs write the coefficients of a distortion, as a list.
const COEFFICIENTS: [&str; 8] = [
    "coeffs",
    "coefficients",
    "distortion_coefficients",
    "distortion_coeffs",
    "dist_coeffs",
    "distortion",
    "D",
    "d",
];

/// The distortion that a JSON object of a camera says, zeros if it says none.
pub(super) fn of_json(value: &Value) -> Result<[f64; 5], String> {
    let model = ["model", "distortion_model"].into_iter().find_map(|key| value.get(key));
    let model = model.map_or(String::new(), |model| match model {
        Value::String(name) => name.clone(),
        other => other.to_string(),
    });
    let field = |key: &str| value.get(key).and_then(Value::as_f64).unwrap_or(0.0);
    let one_by_one = ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"].map(field);
    if one_by_one != [0.0; 8] {
        return brown_conrady(&model, &one_by_one);
    }
    let Some((key, list)) = COEFFICIENTS.iter().find_map(|key| Some((key, value.get(key)?))) else {
        return brown_conrady(&model, &[]);
    };
    let numbers: Option<Vec<f64>> = match list {
        Value::Null => Some(Vec::new()),
        list => list.as_array().and_then(|list| list.iter().map(Value::as_f64).collect()),
    };
    let numbers = numbers.ok_or_else(|| {
        format!("`{key}` is no list of numbers; give k1, k2, p1, p2, k3, or leave it out")
    })?;
    brown_conrady(&model, &numbers)
}
