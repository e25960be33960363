//! The still picture of a scan in three dimensions: SVG, drawn from back to front.
//!
//! In: a sheet, two rims, a plate. Out: what the turning view shows before it is turned, for paper
//! and for where there is no WebGL. The sheet is drawn coarser than it is, the rims are not.
//! Painting from back to front hides what lies behind; where cloth crosses within a patch, it may
//! be wrong by that patch.

use maud::{Markup, html};

use super::shown::Shown;
use super::svg::c;
use crate::base::{Point3, Vector3};

/// Size of the drawing, and where the point looked at lies in it.
const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 480.0;
const MIDDLE: [f64; 2] = [320.0, 240.0];
/// From where: azimuth from the warp, elevation.
const AZIMUTH_DEG: f64 = 35.0;
const ELEVATION_DEG: f64 = 28.0;
/// Pixels of a thing as large as it is far: 32 degrees are the drawing's height.
const FOCAL: f64 = 837.0;
/// Patches on a side of the sheet.
const PATCHES: usize = 36;
/// How much nearer than it is a rim is taken to be \[m\], so that the cloth that it belongs to does
/// not hide it.
const RIM_AHEAD_M: f64 = 4e-3;
/// Light of a patch that the light meets edge-on, and of one that faces it \[% of the sheet's
/// colour\].
const LIGHT: [f64; 2] = [42.0, 100.0];

/// A camera's axes.
struct Eye {
    right: Vector3,
    up: Vector3,
    toward: Vector3,
    /// Height of the point looked at, and distance from it \[m\].
    target_y_m: f64,
    distance_m: f64,
}

impl Eye {
    fn on(shown: &Shown) -> Self {
        let ((sa, ca), (se, ce)) =
            (AZIMUTH_DEG.to_radians().sin_cos(), ELEVATION_DEG.to_radians().sin_cos());
        let toward = Vector3::new(ca * ce, se, sa * ce);
        let right = Vector3::y().cross(&toward).normalize();
        let reach_m = shown.scanned.iter().map(|p| p.x.hypot(p.z)).fold(0.0, f64::max);
        let lowest_m = shown.scanned.iter().map(|p| p.y).fold(0.0, f64::min);
        let (target_y_m, distance_m) = (0.48 * lowest_m, 0.2 + 2.9 * reach_m);
        Self { right, up: toward.cross(&right), toward, target_y_m, distance_m }
    }

    /// Place in the drawing, and how near \[m\].
    fn see(&self, p: &Point3) -> ([f64; 2], f64) {
        let off = p - Point3::new(0.0, self.target_y_m, 0.0);
        let near = off.dot(&self.toward);
        let scale = FOCAL / (self.distance_m - near).max(0.05);
        ([MIDDLE[0] + scale * off.dot(&self.right), MIDDLE[1] - scale * off.dot(&self.up)], near)
    }
}

/// A piece of the drawing.
struct Piece {
    near_m: f64,
    class: &'static str,
    /// The variable of the style that shades a patch.
    style: Option<String>,
    path: String,
}

/// The drawing.
pub(super) fn drawing(shown: &Shown) -> Markup {
    let eye = Eye::on(shown);
    let mut pieces = patches(&shown.sheet, &eye);
    pieces.extend(rim(&shown.scanned, &eye, "scanned", RIM_AHEAD_M));
    pieces.extend(rim(&shown.simulated, &eye, "simulated", 0.9 * RIM_AHEAD_M));
    pieces.sort_by(|a, b| a.near_m.total_cmp(&b.near_m));
    let plate = |k: usize| {
        let (sin, cos) = (k as f64 * std::f64::consts::TAU / 72.0).sin_cos();
        eye.see(&Point3::new(shown.plate_m * cos, -1e-3, shown.plate_m * sin)).0
    };
    let points: String =
        if shown.sheet.is_empty() { dots(&shown.points, &eye) } else { String::new() };
    html! {
        svg .still viewBox={ "0 0 " (c(WIDTH)) " " (c(HEIGHT)) } role="img" aria-label="The cloth on its plate, seen aside from above" {
            path .plate d=(super::svg::closed((0..72).map(plate))) {}
            @if !points.is_empty() { path .dots d=(points) {} }
            @for piece in &pieces { path class=(piece.class) style=[&piece.style] d=(piece.path) {} }
        }
    }
}

/// The sheet's patches, shaded by how they face the light.
fn patches(sheet: &[Point3], eye: &Eye) -> Vec<Piece> {
    let n = sheet.len().isqrt();
    if n < 2 {
        return Vec::new();
    }
    let light = (eye.toward + 0.6 * eye.up - 0.35 * eye.right).normalize();
    let lines = PATCHES.min(n - 1);
    let at = |k: usize| k * (n - 1) / lines;
    let mut pieces = Vec::with_capacity(lines * lines);
    for i in 0..lines {
        for j in 0..lines {
            let corner = |a: usize, b: usize| sheet[at(i + a) * n + at(j + b)];
            let corners = [corner(0, 0), corner(0, 1), corner(1, 1), corner(1, 0)];
            let normal = (corners[2] - corners[0]).cross(&(corners[3] - corners[1]));
            let facing = normal.dot(&light).abs() / normal.norm().max(f64::MIN_POSITIVE);
            let shade = LIGHT[0] + (LIGHT[1] - LIGHT[0]) * facing;
            let seen = corners.map(|p| eye.see(&p));
            let near_m = seen.iter().map(|s| s.1).sum::<f64>() / 4.0;
            let path = super::svg::closed(seen.map(|s| s.0));
            let style = Some(format!("--s:{shade:.0}%"));
            pieces.push(Piece { near_m, class: "q", style, path });
        }
    }
    pieces
}

fn rim(points: &[Point3], eye: &Eye, class: &'static str, ahead_m: f64) -> Vec<Piece> {
    let seen: Vec<_> = points.iter().map(|p| eye.see(p)).collect();
    let piece = |k: usize| {
        let (a, b) = (seen[k], seen[(k + 1) % seen.len()]);
        let near_m = 0.5 * (a.1 + b.1) + ahead_m;
        Piece { near_m, class, style: None, path: super::svg::path([a.0, b.0]) }
    };
    (0..seen.len()).map(piece).collect()
}

/// Points as lines of no length.
fn dots(points: &[Point3], eye: &Eye) -> String {
    let dot = |p: &Point3| super::svg::path([eye.see(p).0]) + "h0";
    points.iter().step_by(3).map(dot).collect()
}
