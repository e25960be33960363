//! What of a job is shown in three dimensions, and the data that the view reads.
//!
//! In: a job's outcome. Out: points and sheets, simulation frame; as data 16-bit numbers in one
//! cube, little-endian, base64: a step is some 5 micrometres. The sheet is the simulated drape,
//! tied or released, or without one the sheet fitted to the scan; the points are some of the
//! cloth's, smoothed.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use super::super::simulated::SimulatedDrape;
use crate::base::Point3;
use crate::job::Outcome;

/// Most points of the cloth: 42 kB, 56 kB as text.
const MOST_POINTS: usize = 7_000;

/// What is shown, simulation frame \[m\].
pub(super) struct Shown {
    /// Some points of the scanned cloth.
    pub points: Vec<Point3>,
    /// A sheet of n x n places, the second coordinate running fastest; empty where there is none.
    pub sheet: Vec<Point3>,
    /// Whether the sheet is a simulated drape.
    pub simulated_sheet: bool,
    /// The scanned rim.
    pub scanned: Vec<Point3>,
    /// The simulated drape's rim; empty where there is none.
    pub simulated: Vec<Point3>,
    /// Radius of the plate.
    pub plate_m: f64,
}

impl Shown {
    /// Of a job.
    pub(super) fn of(outcome: &Outcome) -> Self {
        let cloth = outcome.rim.scanned().map_or(&[][..], |scanned| &scanned.evidence.cloth);
        let step = cloth.len().div_ceil(MOST_POINTS).max(1);
        let fitted = || -> Vec<Point3> {
            outcome
                .rim
                .sheet()
                .map_or_else(Vec::new, |s| s.points().iter().map(|p| p.position_m).collect())
        };
        let again = SimulatedDrape::of(outcome).map(|shown| shown.drape);
        Self {
            points: cloth.iter().step_by(step).copied().collect(),
            sheet: again.map_or_else(fitted, |drape| drape.mesh().vertices),
            simulated_sheet: again.is_some(),
            scanned: outcome.rim.boundary().positions_m().collect(),
            simulated: again.map_or_else(Vec::new, |drape| drape.boundary.positions_m().collect()),
            plate_m: outcome.job.scan.plate_radius_m,
        }
    }

    /// Lower corner and side of the cube that holds everything.
    fn cube(&self) -> ([f64; 3], f64) {
        let all =
            || self.points.iter().chain(&self.sheet).chain(&self.scanned).chain(&self.simulated);
        let end = |pick: fn(f64, f64) -> f64, start: f64| -> [f64; 3] {
            std::array::from_fn(|k| all().map(|p| p[k]).fold(start, pick))
        };
        let (low, high) = (end(f64::min, f64::INFINITY), end(f64::max, f64::NEG_INFINITY));
        (low, (0..3).map(|k| high[k] - low[k]).fold(1e-6, f64::max))
    }

    /// What the view reads.
    pub(super) fn data(&self) -> Value {
        let (low, size) = self.cube();
        let text = |points: &[Point3]| -> Option<String> {
            let whole = |v: f64, k: usize| {
                ((v - low[k]) / size * 65535.0).round().clamp(0.0, 65535.0) as u16
            };
            let bytes = |p: &Point3| [0, 1, 2].map(|k| whole(p[k], k).to_le_bytes()).concat();
            (!points.is_empty())
                .then(|| STANDARD.encode(points.iter().flat_map(bytes).collect::<Vec<u8>>()))
        };
        json!({
            "cube": { "min": low, "size": size },
            "points": text(&self.points),
            "sheet": text(&self.sheet),
            "side": self.sheet.len().isqrt(),
            "scanned": text(&self.scanned),
            "simulated": text(&self.simulated),
            "plate": self.plate_m,
        })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A small sheet, without a simulated one.
    pub(in crate::report::page) fn shown() -> Shown {
        let at = |k: usize| {
            Point3::new(0.1 * (k as f64).cos(), -0.02 * (k % 5) as f64, 0.1 * (k as f64).sin())
        };
        let points: Vec<Point3> = (0..25).map(at).collect();
        let (sheet, scanned, simulated) = (points.clone(), points.clone(), Vec::new());
        Shown { points, sheet, simulated_sheet: false, scanned, simulated, plate_m: 0.05 }
    }

    #[test]
    fn what_the_view_reads_is_what_was_shown() {
        let shown = shown();
        let data = shown.data();
        let (low, size) = (&data["cube"]["min"], data["cube"]["size"].as_f64().unwrap());
        let bytes = STANDARD.decode(data["points"].as_str().unwrap()).unwrap();
        assert_eq!(bytes.len(), 6 * shown.points.len());
        for (k, pair) in bytes.chunks(2).enumerate() {
            let whole = f64::from(u16::from_le_bytes([pair[0], pair[1]]));
            let value = low[k % 3].as_f64().unwrap() + whole / 65535.0 * size;
            assert!((value - shown.points[k / 3][k % 3]).abs() <= 0.5001 * size / 65535.0, "{k}");
        }
        assert_eq!((&data["side"], &data["simulated"]), (&json!(5), &Value::Null));
    }
}
