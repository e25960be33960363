//! Arguments of a caller, as what they mean.

use pyo3::prelude::*;
use scan2params::calibrate::manifest::Face;
use scan2params::fabric::check_density;
use scan2params::intake::hints::parse_up;
use scan2params::intake::rim::parse_warp_toward;
use scan2params::scan::{Crop, LengthUnit, MarkColor, WarpToward};

use crate::arrays;
use crate::errors::invalid;

/// The word for a unit that is looked for.
pub(crate) const GUESS: &str = "guess";

/// An areal density \[kg/m^2\] that a textile can have.
pub(crate) fn density_kg_m2(value: f64) -> PyResult<f64> {
    let [least, most] = scan2params::fabric::DENSITY_LIMITS_G_M2.map(|g_m2| g_m2 * 1e-3);
    if check_density(value).is_ok() {
        return Ok(value);
    }
    let meant = value * 1e-3;
    let hint = if check_density(meant).is_ok() {
        format!(" ({value} g/m^2 are {} kg/m^2)", (meant * 1e9).round() / 1e9)
    } else {
        String::new()
    };
    Err(invalid(format!(
        "density_kg_m2: {value} is outside {least} to {most} kg/m^2; give the areal density in kg/m^2{hint}"
    )))
}

/// `m`, `mm`, `cm`, `in`, or `None` for `guess`.
pub(crate) fn unit(name: &str) -> PyResult<Option<LengthUnit>> {
    if name == GUESS {
        return Ok(None);
    }
    let unit = LengthUnit::named(name);
    unit.map(Some).ok_or_else(|| {
        invalid(format!("unit: no unit `{name}`; give m, mm, cm, in, ft, um, 0.1mm or {GUESS}"))
    })
}

/// A direction in words or as three numbers.
pub(crate) fn warp_toward(given: &Bound<'_, PyAny>) -> PyResult<WarpToward> {
    if let Ok(text) = given.extract::<String>() {
        return parse_warp_toward(&text).map_err(|error| invalid(format!("warp_toward: {error}")));
    }
    let numbers = arrays::numbers("warp_toward", given, 3, f64::NEG_INFINITY)?;
    match numbers[..] {
        [x, y, z] if [x, y, z] != [0.0; 3] => Ok(WarpToward::Direction([x, y, z])),
        _ => Err(invalid("warp_toward: a direction of length 0; give another")),
    }
}

/// Which way is up, in words or as three numbers.
pub(crate) fn up(given: &Bound<'_, PyAny>) -> PyResult<[f64; 3]> {
    if let Ok(text) = given.extract::<String>() {
        return parse_up(&text).map_err(|error| invalid(format!("up: {error}")));
    }
    three("up", given)
}

/// A place as three numbers.
pub(crate) fn plate_near(given: &Bound<'_, PyAny>) -> PyResult<[f64; 3]> {
    three("plate_near", given)
}

fn three(name: &str, given: &Bound<'_, PyAny>) -> PyResult<[f64; 3]> {
    let numbers = arrays::numbers(name, given, 3, f64::NEG_INFINITY)?;
    Ok([numbers[0], numbers[1], numbers[2]])
}

/// Two opposite corners, in any order.
pub(crate) fn crop_box(given: &Bound<'_, PyAny>) -> PyResult<Crop> {
    let corners = arrays::finite_points("crop_box", given)?;
    let [a, b] = corners[..] else {
        return Err(invalid(format!(
            "crop_box: {} corners; give two opposite ones",
            corners.len()
        )));
    };
    Ok(Crop::Box { low: a.inf(&b).into(), high: a.sup(&b).into() })
}

/// A colour by its name or as `#rrggbb`.
pub(crate) fn mark(name: &str) -> PyResult<MarkColor> {
    name.parse().map_err(|error| invalid(format!("mark: {error}")))
}

/// `up` or `down`.
pub(crate) fn face(name: &str) -> PyResult<Face> {
    match name {
        "up" => Ok(Face::Up),
        "down" => Ok(Face::Down),
        other => Err(invalid(format!("face: no face `{other}`; give up or down"))),
    }
}
