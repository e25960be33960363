//! The result as a table on a terminal.

use std::fmt::Write as _;

use super::simulated::{RELEASED, TIED};
use super::verdict;
use crate::base::clock::Stage;
use crate::base::units::{DENSITY_UNIT, KG_M2_PER_G_M2, M_PER_MM};
use crate::intake::Rim;
use crate::io::{ReadNotes, ViewNote};
use crate::job::verdict::Limits;
use crate::job::{Outcome, Refinement};
use crate::scan::{Orientation, ScannedBoundary};

/// The whole result as text.
#[must_use]
pub fn text(outcome: &Outcome) -> String {
    let mut out = verdict::lines(&outcome.verdict);
    // writing to a string cannot fail
    let _ = writeln!(out, "input            {}", outcome.job.input.display());
    out += &rim(&outcome.rim);
    let density = outcome.job.density_kg_m2 / KG_M2_PER_G_M2;
    let _ = writeln!(out, "density          {density:>12.1}  {DENSITY_UNIT} (given)\n");
    let _ = writeln!(out, "parameter               value   90 % interval                    unit");
    for p in outcome.estimate.parameters() {
        let [low, high] = p.interval90.map(significant);
        let interval = format!("{low} .. {high}");
        let flag = if p.in_range { "" } else { "  (out of range)" };
        let value = significant(p.value);
        let _ = writeln!(
            out,
            "{:<14}{:>4} {value:>10}   {interval:<30}   {}{flag}",
            p.key, p.symbol, p.unit
        );
    }
    if let Some(likeness) = &outcome.likeness {
        let _ = writeln!(out, "fabric           {}", likeness.words());
    }
    if let Some(found) = &outcome.refinement {
        out += &refinement(found);
    }
    out += &drapes(outcome);
    let _ = writeln!(out, "model {} ({})", outcome.model[0], &outcome.model[1][..12]);
    let _ = writeln!(out, "simulation parameters, not measured mechanical properties");
    out
}

/// What refining found, as text.
fn refinement(found: &Refinement) -> String {
    let mut out = String::from("\n");
    let Some(taken) = found.taken() else {
        return out + "refined                    no  the values are the network's\n";
    };
    let refined = taken.refined();
    let _ =
        writeln!(out, "refined          {:>12}  {} drapes", refined.ended.name(), refined.drapes);
    let shown: Vec<String> =
        refined.stiffnesses.iter().map(|s| format!("{} {:.0} %", s.key, 100.0 * s.shown)).collect();
    let _ = writeln!(out, "uncertainty      removed by this scan: {}", shown.join(", "));
    for (companion, fit) in found.companions.iter().zip(&refined.scans[1..]) {
        let _ = writeln!(
            out,
            "refined with     {}: tied drape {:.2} mm off, {} folds of {}",
            companion.path.display(),
            fit.tied_mean_m / M_PER_MM,
            fit.nodes[1],
            fit.nodes[0]
        );
    }
    out
}

/// The simulated drapes compared with the scan, as text.
fn drapes(outcome: &Outcome) -> String {
    let mut out = String::new();
    if let Some(taken) = outcome.taken() {
        let tied = taken.first();
        let [mean, largest] = [tied.tied_mean_m, tied.tied_largest_m].map(|m| m / M_PER_MM);
        let good = Limits::default().refined_misfit.doubtful;
        let _ = writeln!(
            out,
            "{TIED}       {mean:>12.2}  mm from the scanned rim, {largest:.2} at most, {} folds; misfit {:.2} sigma (below {good:.2} is good), \
             springs carry {:.1} % of the weight",
            tied.nodes[1],
            taken.refined().misfit,
            100.0 * tied.springs_share
        );
    }
    if let Some(released) = &outcome.released {
        let [mean, largest] =
            [released.mean_distance_m, released.largest_distance_m].map(|m| m / M_PER_MM);
        let _ = writeln!(
            out,
            "{RELEASED}   {mean:>12.2}  mm from the scanned rim, {largest:.2} at most, {} folds ({}, started from the {})",
            released.drape.nodes,
            released.drape.stop.name(),
            released.started_from.name()
        );
    }
    if out.is_empty() { out } else { format!("\n{out}") }
}

/// What was done, with processor time, time on the wall and the largest memory by its end, as text.
#[must_use]
pub fn stages(stages: &[Stage]) -> String {
    let mut out = format!("{:<20}{:>10}{:>10}{:>11}\n", "stage", "CPU s", "wall s", "peak MiB");
    let unknown = || "-".to_owned();
    for Stage { name, cpu_s, wall_s, peak_mib } in stages {
        let cpu = cpu_s.map_or_else(unknown, |s| format!("{s:.2}"));
        let peak = peak_mib.map_or_else(unknown, |mib| format!("{mib:.0}"));
        let _ = writeln!(out, "{name:<20}{cpu:>10}{wall_s:>10.2}{peak:>11}");
    }
    out
}

/// What the rim is, as text.
#[must_use]
pub fn rim(rim: &Rim) -> String {
    match rim {
        Rim::Scanned { scanned, notes: left_out } => notes(left_out) + &scan(scanned),
        Rim::Given { orientation, .. } => format!(
            "rim              {:>12}  as the boundary file gives it, {:.1} % observed\n{}",
            "given",
            100.0 * rim.observed_fraction(),
            weft_and_warp(*orientation)
        ),
    }
}

/// What the reader left out of a file or took by a guess, as text; nothing if it took all as it
/// stands.
#[must_use]
pub fn notes(notes: &ReadNotes) -> String {
    let mut out = String::new();
    if notes.dropped_non_finite > 0 {
        let _ = writeln!(
            out,
            "left out         {:>12}  of {} points: not finite or too far away",
            notes.dropped_non_finite, notes.points_in_file
        );
    }
    if notes.dropped_jumps > 0 {
        let _ = writeln!(
            out,
            "left out         {:>12}  pixels next to depth jumps",
            notes.dropped_jumps
        );
    }
    for text in &notes.taken {
        let _ = writeln!(out, "read             {text}");
    }
    views(&mut out, &notes.views);
    out
}

/// What was done with each view, as a table.
#[must_use]
pub fn by_view(views: &[ViewNote]) -> String {
    let mut out = "moved [mm]  turned [deg]  misfit before [mm]  after [mm]  view\n".to_owned();
    for view in views {
        let left_out = view.left_out.as_ref().map(|why| format!("  left out: {why}"));
        let _ = writeln!(
            out,
            "{:10.2}  {:12.2}  {:18.3}  {:10.3}  {}{}",
            view.moved_m / M_PER_MM,
            view.turned_rad.to_degrees(),
            view.misfit_before_m / M_PER_MM,
            view.misfit_m / M_PER_MM,
            view.name,
            left_out.unwrap_or_default()
        );
    }
    out
}

/// How views were brought together, in a line, and one for each that was left out.
fn views(out: &mut String, views: &[ViewNote]) {
    let mm = |of: fn(&ViewNote) -> f64| {
        let kept = views.iter().filter(|view| view.left_out.is_none());
        kept.map(of).filter(|m| m.is_finite()).fold(0.0, f64::max) / M_PER_MM
    };
    let (moved_mm, misfit_mm) = (mm(|view| view.moved_m), mm(|view| view.misfit_m));
    let left_out = views.iter().filter(|view| view.left_out.is_some());
    let kept = views.len() - left_out.clone().count();
    if kept > 1 && moved_mm > 0.0 {
        let _ = writeln!(
            out,
            "views            {kept:>12}  registered: moved by up to {moved_mm:.1} mm, {misfit_mm:.2} mm apart"
        );
    } else if kept > 1 && misfit_mm > 0.0 {
        let _ = writeln!(
            out,
            "views            {kept:>12}  placed by their poses, {misfit_mm:.2} mm apart"
        );
    }
    for view in left_out {
        let why = view.left_out.as_deref().unwrap_or_default();
        let _ = writeln!(out, "left out         {}: {why}", view.name);
    }
}

/// What was found in the scan, as text.
#[must_use]
pub fn scan(scanned: &ScannedBoundary) -> String {
    let q = &scanned.quality;
    let mm = |metres: f64| metres / M_PER_MM;
    let mut out = String::new();
    let guessed = if q.unit_guessed { "guessed" } else { "given" };
    let _ = writeln!(out, "unit             {:>12}  ({guessed})", scanned.unit.name());
    let [x, y, z] = q.up;
    let _ = writeln!(out, "up               ({x:.3}, {y:.3}, {z:.3}) in the scan's frame");
    let _ = writeln!(
        out,
        "points           {:>12}  of which cloth {}, {:.1} % of its area seen",
        q.points,
        q.cloth_points,
        100.0 * q.seen_share
    );
    if let Some(mesh) = &q.mesh {
        let _ = writeln!(
            out,
            "mesh             {:>12}  triangles with edges of {:.1} mm, {:.0} % of the rim from its own edge",
            mesh.triangles,
            mm(mesh.edge_m),
            100.0 * mesh.own_edge_share
        );
        if let Some(cut) = mesh.cut {
            let _ = writeln!(
                out,
                "closed below     {:>12.0}  % of its area cut away where it turns by {:.0} degrees",
                100.0 * cut.removed_share,
                cut.crease_rad.to_degrees()
            );
        }
    }
    let _ = writeln!(
        out,
        "rim              {:>12.1}  mm long, {:.1} % observed, longest bridged arc {:.1} mm",
        mm(q.loop_length_m),
        100.0 * q.observed_fraction,
        mm(q.longest_gap_m)
    );
    let _ = writeln!(
        out,
        "plate            {:>12.1}  mm radius found, centre known to {:.2} mm",
        mm(q.plate_radius_m),
        mm(q.origin_sigma_m)
    );
    let _ = writeln!(
        out,
        "noise            {:>12.2}  mm, points {:.2} mm apart",
        mm(q.noise_m),
        mm(q.point_spacing_m)
    );
    out + &weft_and_warp(scanned.orientation)
}

fn weft_and_warp(orientation: Orientation) -> String {
    let text = match orientation {
        Orientation::Given => "given",
        Orientation::Ambiguous => "ambiguous (give --warp-toward or --mark)",
    };
    format!("weft and warp    {text:>12}\n")
}

/// Four significant digits, without exponent.
fn significant(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let decimals = (3 - value.abs().log10().floor() as i32).max(0) as usize;
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::significant;

    #[test]
    fn four_digits_at_least() {
        assert_eq!(significant(131_010.96), "131011");
        assert_eq!(significant(1119.74), "1120");
        assert_eq!(significant(45.784_2), "45.78");
        assert_eq!(significant(0.012_346), "0.01235");
    }
}
