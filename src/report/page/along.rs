//! The error along the rim: how far the simulated drape's rim lies from the scanned one, point by
//! point, sides marked.
//!
//! In: two rims, point against point. Out: SVG of two panels over the place along the flat
//! specimen's border (0 to 1200 mm, side after side): the distance in space, over twice the scan's
//! own uncertainty; and its parts outwards and upwards, from the scanned to the simulated rim.
//! Where the rim was bridged, the foot of the chart says so.

use maud::{Markup, html};

use super::number::fixed;
use super::svg::{Scale, c, closed, labelled, path};
use crate::base::Boundary;
use crate::base::boundary::{POINTS, POINTS_PER_SIDE, SIDES};
use crate::base::units::mm;

const LEFT: f64 = 44.0;
const RIGHT: f64 = 940.0;
const TOP: [f64; 2] = [26.0, 216.0];
const LOW: [f64; 2] = [270.0, 384.0];
const HEIGHT: f64 = 422.0;
/// Least height of the upper panel's axis \[mm\].
const LEAST_MM: f64 = 2.0;

/// Place of a point along the border of the flat specimen, 0 to 1.
fn share(index: usize) -> f64 {
    let along = (index % POINTS_PER_SIDE) as f64 / (POINTS_PER_SIDE - 1) as f64;
    ((index / POINTS_PER_SIDE) as f64 + along) / SIDES as f64
}

/// Distance, part outwards (away from the plate's axis in the plan) and part upwards of each point
/// \[mm\].
fn errors(scanned: &Boundary, again: &Boundary) -> Vec<[f64; 3]> {
    let pairs = scanned.positions_m().zip(again.positions_m());
    let of = |(from, to): (crate::base::Point3, crate::base::Point3)| {
        let (off, far) = (to - from, from.x.hypot(from.z).max(f64::MIN_POSITIVE));
        let outwards = (off.x * from.x + off.z * from.z) / far;
        [off.norm(), outwards, off.y].map(mm)
    };
    pairs.map(of).collect()
}

/// Shares of the points that lie within each of some distances \[mm\] of their own.
pub(super) fn within(scanned: &Boundary, again: &Boundary, limits_mm: [f64; 2]) -> [f64; 2] {
    let all = errors(scanned, again);
    limits_mm.map(|limit| all.iter().filter(|e| e[0] <= limit).count() as f64 / all.len() as f64)
}

/// The chart.
pub(super) fn chart(scanned: &Boundary, again: &Boundary, side_mm: f64) -> Markup {
    let all = errors(scanned, again);
    let worst = (0..POINTS).max_by(|&a, &b| all[a][0].total_cmp(&all[b][0])).unwrap_or(0);
    let most = all[worst][0];
    let part = all.iter().flat_map(|e| [e[1].abs(), e[2].abs()]).fold(0.5 * LEAST_MM, f64::max);
    let x = Scale { values: [0.0, 1.0], pixels: [LEFT, RIGHT] };
    let y = Scale { values: [0.0, (1.12 * most).max(LEAST_MM)], pixels: [TOP[1], TOP[0]] };
    let low = Scale { values: [-1.08 * part, 1.08 * part], pixels: [LOW[1], LOW[0]] };
    let sigma = scanned.points().iter().map(|p| mm(2.0 * p.sigma_m));
    let foot = [[x.at(1.0), y.at(0.0)], [x.at(0.0), y.at(0.0)]];
    let area = |values: &mut dyn Iterator<Item = f64>| {
        let line = values.enumerate().map(|(k, v)| [x.at(share(k)), y.at(v.min(y.values[1]))]);
        closed(line.chain(foot))
    };
    let line = |scale: &Scale, part: usize| {
        path((0..POINTS).map(|k| [x.at(share(k)), scale.at(all[k][part])]))
    };
    let label = format!(
        "Distance of the rims along the border: largest {} mm on side {}",
        fixed(most, 1),
        worst / POINTS_PER_SIDE
    );
    html! {
        svg .chart viewBox={ "0 0 960 " (c(HEIGHT)) } role="img" aria-label=(label) {
            (sides(&x, side_mm))
            (level_lines(&y))
            path .sigma d=(area(&mut sigma.into_iter())) {}
            path .error-area d=(area(&mut all.iter().map(|e| e[0]))) {}
            path .error d=(line(&y, 0)) {}
            (bridged(scanned, &x, TOP[1]))
            text .title x=(c(LEFT)) y="14" { "Distance of the simulated rim [mm]" }
            circle .worst cx=(c(x.at(share(worst)))) cy=(c(y.at(most))) r="3.4" {}
            text .mark x=(c(x.at(share(worst)))) y=(c(y.at(most) - 7.0)) text-anchor="middle" { (fixed(most, 1)) }
            (level_lines(&low))
            line .zero x1=(c(LEFT)) x2=(c(RIGHT)) y1=(c(low.at(0.0))) y2=(c(low.at(0.0))) {}
            path .outwards d=(line(&low, 1)) {}
            path .upwards d=(line(&low, 2)) {}
            text .title x=(c(LEFT)) y=(c(LOW[0] - 10.0)) { "Its component outwards (solid) and upwards (dashed) [mm]" }
            text .title x=(c(RIGHT)) y=(c(HEIGHT - 4.0)) text-anchor="end" { "place along the border [mm]" }
        }
    }
}

/// The four sides as stripes with their names, places below.
fn sides(x: &Scale, side_mm: f64) -> Markup {
    let name = |side: usize| ["+x", "+z", "\u{2212}x", "\u{2212}z"][side % SIDES];
    html! {
        @for side in 0..SIDES {
            @let [a, b] = [side, side + 1].map(|s| x.at(s as f64 / SIDES as f64));
            @if side % 2 == 0 {
                rect .stripe x=(c(a)) y=(c(TOP[0])) width=(c(b - a)) height=(c(LOW[1] - TOP[0])) {}
            }
            text .side x=(c(0.5 * (a + b))) y=(c(TOP[1] + 15.0)) text-anchor="middle" {
                "side " (side) " (" (name(side)) ", along the " (if side % 2 == 0 { "weft" } else { "warp" }) ")"
            }
        }
        @for k in 0..=(2 * SIDES) {
            @let at = x.at(k as f64 / (2 * SIDES) as f64);
            line .tick x1=(c(at)) x2=(c(at)) y1=(c(LOW[1])) y2=(c(LOW[1] + 4.0)) {}
            text .label x=(c(at)) y=(c(LOW[1] + 16.0)) text-anchor="middle" { (fixed(0.5 * k as f64 * side_mm, 0)) }
        }
    }
}

fn level_lines(y: &Scale) -> Markup {
    html! {
        @for (value, label) in labelled(y.values, 5) {
            @let at = y.at(value);
            line .grid x1=(c(LEFT)) x2=(c(RIGHT)) y1=(c(at)) y2=(c(at)) {}
            text .label x=(c(LEFT - 6.0)) y=(c(at + 3.5)) text-anchor="end" { (label) }
        }
    }
}

/// A thick line at the foot where the rim was bridged.
fn bridged(scanned: &Boundary, x: &Scale, foot: f64) -> Markup {
    let step = 0.5 / (SIDES * (POINTS_PER_SIDE - 1)) as f64;
    html! {
        @for (k, point) in scanned.points().iter().enumerate() {
            @if !point.observed {
                @let [a, b] = [share(k) - step, share(k) + step].map(|s| x.at(s.clamp(0.0, 1.0)));
                rect .bridged-mark x=(c(a)) y=(c(foot - 4.0)) width=(c(b - a)) height="4" {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Point3;

    #[test]
    fn errors_have_their_parts_and_bands_their_shares() {
        let flat = |k: usize| Boundary::flat_xz_m(k, 0.3);
        let rim = |out: f64, up: f64| {
            let at = |k: usize| {
                let [x, z] = flat(k).map(|v| v * (1.0 + out / flat(k)[0].hypot(flat(k)[1])));
                Point3::new(x, -0.1 + if k < POINTS / 2 { up } else { 0.0 }, z)
            };
            Boundary::exact((0..POINTS).map(at)).unwrap()
        };
        let (scanned, again) = (rim(0.0, 0.0), rim(3e-3, -12e-3));
        let all = errors(&scanned, &again);
        assert!((all[0][1] - 3.0).abs() < 1e-9 && (all[0][2] + 12.0).abs() < 1e-9);
        assert!((all[0][0] - 3.0_f64.hypot(12.0)).abs() < 1e-9 && (all[200][0] - 3.0).abs() < 1e-9);
        assert_eq!(within(&scanned, &again, [5.0, 10.0]), [0.5, 0.5]);
        assert_eq!(within(&scanned, &again, [2.0, 15.0]), [0.0, 1.0]);
        let drawn = chart(&scanned, &again, 300.0).into_string();
        assert!(drawn.contains("largest 12.4 mm on side") && !drawn.contains("NaN"));
        // the corner's two points lie at one place
        assert_eq!((share(60), share(61), share(243)), (0.25, 0.25, 1.0));
    }
}
