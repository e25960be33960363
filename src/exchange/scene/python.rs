//! A scene as a Python script: remarks, the scene's values as JSON in a raw string, and the code of
//! its target. JSON escapes quotes, so that none ends the string.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::bench::Bench;
use crate::exchange::exported::Options;
use crate::exchange::going_along::{self, number};
use crate::fabric::params::Params;

/// The search for rest, the same for all scripts.
const SETTLE: &str = include_str!("settle.py");
/// A moment over which the cloth's way is taken \[s\], the way that counts as rest \[m\], and the
/// time after which the script ends in any case \[s\].
const WINDOW_S: f64 = 0.2;
const STILL_M: f64 = 1e-4;
const MOST_S: f64 = 10.0;

/// The script: `values` are the target's, beside those of every scene.
pub(super) fn script(
    bench: &Bench,
    params: &Params,
    options: &Options,
    [lost, notes]: [&[String]; 2],
    values: Value,
    code: &str,
) -> String {
    let mut text = String::new();
    for line in going_along::lines(params, lost, notes) {
        // writing to a string cannot fail
        let _ = writeln!(text, "# {line}");
    }
    let mut scene = json!({
        "name": options.name,
        "scene": bench.scene.name(),
        "gravity_m_s2": crate::base::frame::GRAVITY_M_S2,
        "plate_radius_m": bench.plate.radius_m,
        "friction": bench.friction,
        "mass_kg": bench.mass_kg,
        "at_rest": { "window_s": WINDOW_S, "still_m": STILL_M, "most_s": MOST_S },
    });
    if let (Value::Object(scene), Value::Object(values)) = (&mut scene, values) {
        scene.extend(values);
    }
    let _ = write!(
        text,
        "\nimport json\n\nSCENE = json.loads(r\"\"\"\n{}\"\"\")\n\n{code}\n\n{SETTLE}",
        going_along::text(&scene)
    );
    text
}

/// Positions as a list of Python, to a nanometre, one to a line.
pub(super) fn points(positions_m: &[[f64; 3]]) -> String {
    let lines = positions_m.iter().map(|p| {
        let [x, y, z] = p.map(|m| number((m * 1e9).round() / 1e9));
        format!("    ({x}, {y}, {z}),\n")
    });
    format!("[\n{}]", lines.collect::<String>())
}

/// Faces as a list of Python, one to a line.
pub(super) fn faces<'a>(faces: impl IntoIterator<Item = &'a [usize]>) -> String {
    let lines = faces.into_iter().map(|face| {
        let words: Vec<_> = face.iter().map(usize::to_string).collect();
        format!("    ({}),\n", words.join(", "))
    });
    format!("[\n{}]", lines.collect::<String>())
}
