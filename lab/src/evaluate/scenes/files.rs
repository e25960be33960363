//! A scene as files, so that a failure can be opened: `NAME.ply` and `NAME.truth.json`.
//!
//! The truth has `params` (the paper's units), `warp_toward`, `rim_mm` (244 points, simulation
//! frame), `sensor_from_sim` (4 x 4, from the simulation frame in mm into the file's frame and
//! unit) and what was drawn.

use std::path::Path;

use serde_json::{Map, Value, json};

use super::made::Made;
use scan2params::base::Vector3;
use scan2params::base::units::M_PER_MM;
use scan2params::fabric::{Fabric, TABLE_2};
use scan2params::io::{self, WriteError};

/// Writes a scene under a name that says what it is.
pub(super) fn write(folder: &Path, made: &Made, fabric: Option<&Fabric>) -> Result<(), WriteError> {
    std::fs::create_dir_all(folder)
        .map_err(|source| WriteError { path: folder.to_owned(), source })?;
    let drawn = &made.drawn;
    let name = format!(
        "{:04}_{}_{}_{}_{}",
        drawn.index,
        drawn.profile.name,
        drawn.stand(),
        drawn.surroundings(),
        drawn.cause.name()
    );
    io::write_ply(folder.join(format!("{name}.ply")), &made.scan.cloud, 1.0)?;
    let truth = truth(made, fabric);
    let path = folder.join(format!("{name}.truth.json"));
    io::atomically(&path, |out| writeln!(out, "{truth}"))
}

fn truth(made: &Made, fabric: Option<&Fabric>) -> Value {
    let drawn = &made.drawn;
    let truth = &made.scan.truth;
    let scanner_from_simulation = truth.simulation_from_scanner.inverse();
    let mut matrix = scanner_from_simulation.to_homogeneous();
    for column in 0..4 {
        let scale = if column < 3 { M_PER_MM } else { 1.0 };
        for row in 0..3 {
            matrix[(row, column)] *= scale / truth.unit_m;
        }
    }
    let rows = matrix.transpose();
    let rows: Vec<&[f64]> = rows.as_slice().chunks(4).collect();
    let warp: [f64; 3] = (scanner_from_simulation * Vector3::x()).into();
    let rim_mm: Vec<[f64; 3]> =
        made.rim.positions_m().map(|p| (p.coords / M_PER_MM).into()).collect();
    json!({
        "sensor": drawn.profile.name,
        "stand": drawn.stand(),
        "scene": drawn.surroundings(),
        "cause": drawn.cause.name(),
        "unit": if drawn.profile.unit_m == 1.0 { "m" } else { "mm" },
        "views": made.scan.views.len(),
        "points": made.scan.cloud.points.len(),
        "rim_seen": made.seen.share,
        "params": fabric.map(params),
        "warp_toward": warp,
        "rim_mm": rim_mm,
        "sensor_from_sim": rows,
    })
}

/// The seven parameters by name.
fn params(fabric: &Fabric) -> Value {
    let values = fabric.to_paper_units();
    let entries = TABLE_2.iter().zip(values).take(6);
    let mut own: Map<String, Value> =
        entries.map(|(range, value)| (range.key.to_owned(), json!(value))).collect();
    own.insert("density".to_owned(), json!(values[6]));
    Value::Object(own)
}
