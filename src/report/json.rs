//! params.json: schema 2. Values in the paper's units, lengths in mm, each with its
//! unit next to it. `read` and `quality` are null for a rim that was read from a
//! boundary CSV.

mod simulated;

use serde_json::{Map, Value, json};

use crate::base::units::{DENSITY_UNIT, KG_M2_PER_G_M2, M_PER_MM};
use crate::fabric::Likeness;
use crate::io::{ReadNotes, ViewNote};
use crate::job::{Outcome, Refinement};
use crate::refine::{ReleasedDrape, ScanFit};
use crate::scan::ScannedBoundary;
use crate::sim::{Experiment, NUMERICS_VERSION, rim_nodes};

pub use simulated::Simulated;

/// Version of the layout of params.json.
pub const SCHEMA_VERSION: u32 = 3;

/// The result as JSON.
#[must_use]
pub fn params(outcome: &Outcome) -> Value {
    let mut parameters = Map::new();
    for p in outcome.estimate.parameters() {
        parameters.insert(
            p.key.to_owned(),
            json!({
                "symbol": p.symbol,
                "value": p.value,
                "unit": p.unit,
                "interval90": p.interval90,
                "in_range": p.in_range,
            }),
        );
    }
    let warnings: Vec<String> = outcome.estimate.warnings.iter().map(ToString::to_string).collect();
    let candidates: Vec<[f64; 7]> =
        outcome.estimate.candidates.iter().map(|c| c.fabric.to_paper_units()).collect();
    json!({
        "schema_version": SCHEMA_VERSION,
        "verdict": outcome.verdict,
        "input": outcome.job.input.display().to_string(),
        "parameters": parameters,
        "density": {
            "value": outcome.job.density_kg_m2 / KG_M2_PER_G_M2,
            "unit": DENSITY_UNIT,
        },
        "candidates": candidates,
        "prior": outcome.likeness.as_ref().map(likeness),
        "tied_drape": outcome.taken().map(|taken| tied_drape(taken.first(), taken.refined().misfit)),
        "released_drape": outcome.released.as_ref().map(released_drape),
        "refinement": outcome.refinement.as_ref().map(refinement),
        "boundary": boundary(outcome),
        "read": outcome.rim.notes().map(read),
        "quality": outcome.rim.scanned().map(quality),
        "orientation": outcome.rim.orientation(),
        "novelty": {
            "rms_mm": outcome.estimate.novelty.rms_m / M_PER_MM,
            "limit_mm": outcome.estimate.novelty.limit_m / M_PER_MM,
        },
        "warnings": warnings,
        "model": { "id": outcome.model[0], "sha256": outcome.model[1] },
        "simulator": { "numerics_version": NUMERICS_VERSION },
        "read_options": outcome.job.read,
        "scan_options": outcome.job.scan,
        "version": env!("CARGO_PKG_VERSION"),
        "seed": outcome.job.scan.seed,
        "experiment": (outcome.job.experiment != Experiment::default()).then_some(outcome.job.experiment),
        "note": "simulation parameters, not measured mechanical properties",
    })
}

/// What was read of a scan's file.
#[must_use]
pub fn read(notes: &ReadNotes) -> Value {
    let mut read = json!({
        "points_in_file": notes.points_in_file,
        "dropped_non_finite": notes.dropped_non_finite,
        "dropped_jumps": notes.dropped_jumps,
        "taken": notes.taken,
    });
    if !notes.views.is_empty() {
        read["views"] = notes.views.iter().map(view).collect();
    }
    read
}

/// What was done with a view to bring it to the others.
fn view(view: &ViewNote) -> Value {
    let mm = |m: f64| m.is_finite().then_some(m / M_PER_MM);
    json!({
        "file": view.name,
        "moved_mm": view.moved_m / M_PER_MM,
        "turned_deg": view.turned_rad.to_degrees(),
        "misfit_before_mm": mm(view.misfit_before_m),
        "misfit_mm": mm(view.misfit_m),
        "left_out": view.left_out,
    })
}

/// Where the stiffnesses lie in the prior of the training.
fn likeness(likeness: &Likeness) -> Value {
    let parts: Vec<Value> = likeness
        .parts
        .iter()
        .map(|part| {
            json!({
                "name": part.name,
                "probability": part.probability,
                "distance": part.distance,
                "limit": part.limit,
            })
        })
        .collect();
    let like: Vec<&str> = likeness.like().iter().map(|part| part.name.as_str()).collect();
    json!({ "name": likeness.prior, "like": like, "parts": parts, "text": likeness.words() })
}

/// What refining found; lengths in mm, angles in degrees, correlations of logarithms in the paper's
/// order.
fn refinement(found: &Refinement) -> Value {
    let network: Map<String, Value> = found
        .network
        .parameters()
        .iter()
        .map(|p| (p.key.to_owned(), json!({ "value": p.value, "interval90": p.interval90 })))
        .collect();
    let mut value = json!({
        "taken": found.taken().is_some(),
        "network": network,
        "wall_s": found.wall_s,
        "error": found.result.as_ref().err().map(ToString::to_string),
    });
    if let Ok(refined) = &found.result {
        let shown: Map<String, Value> = refined
            .stiffnesses
            .iter()
            .map(|s| (s.key.to_owned(), json!({ "shown": s.shown, "at_limit": s.at_limit })))
            .collect();
        value["ended"] = json!(refined.ended.name());
        value["stiffnesses"] = json!(shown);
        value["correlation_ln"] = json!(refined.correlation);
        value["start"] = json!(refined.start);
        value["drapes"] = json!(refined.drapes);
        let mut scans = refined.scans.iter().map(|scan| scan_fit(scan, refined.misfit));
        value
            .as_object_mut()
            .zip(scans.next())
            .into_iter()
            .for_each(|(of, first)| of.extend(first));
        let others = found.companions.iter().zip(scans).map(|(companion, mut fit)| {
            fit.insert("file".into(), json!(companion.path.display().to_string()));
            Value::Object(fit)
        });
        value["with"] = Value::Array(others.collect());
    }
    value
}

/// A scan beside the drapes of the fabric found.
fn scan_fit(scan: &ScanFit, misfit: f64) -> Map<String, Value> {
    let arcs: Vec<Value> = scan
        .arcs
        .iter()
        .map(|arc| json!({ "mean_mm": arc.mean_m / M_PER_MM, "sigmas": arc.sigmas }))
        .collect();
    let bench: Map<String, Value> = scan
        .bench
        .iter()
        .map(|number| {
            let (unit, scale) = match number.key {
                key if key.starts_with("tilt") || key == "rotation" => ("deg", 1_f64.to_degrees()),
                _ => ("mm", 1.0 / M_PER_MM),
            };
            let [of, sigma] = [number.value, number.sigma].map(|value| value * scale);
            (number.key.to_owned(), json!({ "value": of, "sigma_before": sigma, "unit": unit }))
        })
        .collect();
    let fields = [
        ("on_branch", json!(scan.on_branch)),
        ("tied_drape", tied_drape(scan, misfit)),
        ("released_drape", json!(scan.released.as_ref().map(released_drape))),
        ("arcs", json!(arcs)),
        ("bench", json!(bench)),
    ];
    fields.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

fn boundary(outcome: &Outcome) -> Value {
    let points = outcome.rim.boundary().points();
    json!({
        "points": points.len(),
        "folds": rim_nodes(outcome.rim.boundary()),
        "observed_fraction": outcome.rim.observed_fraction(),
        "mean_sigma_mm": outcome.rim.boundary().mean_sigma_m() / M_PER_MM,
    })
}

/// The tied drape, which the fabric was found by.
fn tied_drape(fit: &ScanFit, misfit: f64) -> Value {
    json!({
        "rim_mean_mm": fit.tied_mean_m / M_PER_MM,
        "rim_largest_mm": fit.tied_largest_m / M_PER_MM,
        "misfit_sigma": misfit,
        "springs_carry": fit.springs_share,
        "folds": fit.nodes[1],
    })
}

/// The released drape, without springs.
fn released_drape(released: &ReleasedDrape) -> Value {
    json!({
        "rim_mean_mm": released.mean_distance_m / M_PER_MM,
        "rim_largest_mm": released.largest_distance_m / M_PER_MM,
        "folds": released.drape.nodes,
        "started_from": released.started_from.name(),
        "stop": released.drape.stop.name(),
        "intersections": released.drape.intersections,
    })
}

/// The quality figures of a scan, lengths in mm.
#[must_use]
pub fn quality(scanned: &ScannedBoundary) -> Value {
    let q = &scanned.quality;
    let mm = |metres: f64| metres / M_PER_MM;
    json!({
        "points": q.points,
        "mesh": q.mesh.map(|mesh| json!({
            "triangles": mesh.triangles,
            "samples": mesh.samples,
            "edge_mm": mm(mesh.edge_m),
            "own_edge_share": mesh.own_edge_share,
            "cut_share": mesh.cut.map(|cut| cut.removed_share),
            "cut_crease_deg": mesh.cut.map(|cut| cut.crease_rad.to_degrees()),
        })),
        "cloth_points": q.cloth_points,
        "unit": scanned.unit,
        "unit_guessed": q.unit_guessed,
        "up": q.up,
        "seen_share": q.seen_share,
        "loop_length_mm": mm(q.loop_length_m),
        "side_lengths_mm": q.side_lengths_m.map(mm),
        "outline_side_mm": q.outline_side_m.map(mm),
        "widths_mm": q.widths_m.map(|width| width.map(mm)),
        "edges_mm": q.edge_m.map(mm),
        "longest_gap_mm": mm(q.longest_gap_m),
        "longest_gap_bearing_deg": q.longest_gap_bearing_deg,
        "plate_radius_mm": mm(q.plate_radius_m),
        "origin_sigma_mm": mm(q.origin_sigma_m),
        "centre_offset_mm": mm(q.centre_offset_m),
        "floor_height_mm": q.floor_height_m.map(mm),
        "point_spacing_mm": mm(q.point_spacing_m),
        "noise_mm": mm(q.noise_m),
        "sheet_rms_mm": mm(q.sheet_rms_m),
        "sheet_rms_on_plate_mm": mm(q.sheet_rms_on_plate_m),
        "drape_nats": q.drape_nats,
        "drape_ahead_nats": q.drape_ahead_nats,
        "unexplained_mm2": q.unexplained_m2 / (M_PER_MM * M_PER_MM),
    })
}
