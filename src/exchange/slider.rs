//! CLO's slider from 0 to 100, the "GUI value" of a stiffness.
//!
//! In: a position, or a stiffness \[N/m\]. Out: the other. The curve runs through six known pairs
//! and is straight between them in position and logarithm of the stiffness. The pairs are
//! second-hand and name no field. They are taken for stretch and shear in g/s^2, where 100 is 2000
//! N/m and the paper's Table 2 lies between 24 and 95; in CLO's unit of bending the top would be 46
//! times the stiffest fabric of that table. So it holds for stretch and shear, and bending has no
//! slider here. Fails (`None`) outside the pairs: below 10, above 100.

use crate::base::units::N_M_PER_G_S2;

/// Position and stiffness \[g/s^2\] of the known pairs.
const PAIRS: [[f64; 2]; 6] =
    [[10.0, 1e2], [27.0, 9.5e2], [50.0, 3.25e3], [65.0, 1.8e4], [83.0, 2e5], [100.0, 2e6]];

/// The positions between which the curve is known.
pub const POSITIONS: [f64; 2] = [PAIRS[0][0], PAIRS[5][0]];
/// The stiffnesses there \[g/s^2\].
pub const STIFFNESSES_G_S2: [f64; 2] = [PAIRS[0][1], PAIRS[5][1]];

/// The stretch or shear stiffness \[N/m\] at a position of the slider.
#[must_use]
pub fn stiffness_n_m(position: f64) -> Option<f64> {
    let pairs = PAIRS.map(|[position, stiffness]| [position, stiffness.ln()]);
    Some(between(&pairs, position)?.exp() * N_M_PER_G_S2)
}

/// The position of the slider for a stretch or shear stiffness \[N/m\].
#[must_use]
pub fn position(stiffness_n_m: f64) -> Option<f64> {
    let pairs = PAIRS.map(|[position, stiffness]| [stiffness.ln(), position]);
    between(&pairs, (stiffness_n_m / N_M_PER_G_S2).ln())
}

/// The straight line between the two pairs around `x`, with room for rounding at the ends.
fn between(pairs: &[[f64; 2]], x: f64) -> Option<f64> {
    let (first, last) = (pairs.first()?[0], pairs.last()?[0]);
    let room = 1e-9 * (last - first);
    if !(first - room..=last + room).contains(&x) {
        return None;
    }
    let x = x.clamp(first, last);
    let [a, b] = pairs.windows(2).map(|w| [w[0], w[1]]).find(|[_, b]| x <= b[0])?;
    Some(a[1] + (b[1] - a[1]) * (x - a[0]) / (b[0] - a[0]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_known_pairs_are_met_and_beyond_them_there_is_nothing() {
        for [at, stiffness] in PAIRS {
            assert!((stiffness_n_m(at).unwrap() / (stiffness * 1e-3) - 1.0).abs() < 1e-12);
            assert!((position(stiffness * 1e-3).unwrap() - at).abs() < 1e-9);
        }
        assert_eq!((stiffness_n_m(9.0), stiffness_n_m(101.0), position(1e4)), (None, None, None));
        assert_eq!(position(0.0), None);
        // the ends of Table 2
        let ends = [638.27e-3, 1e3].map(|n_m| position(n_m).unwrap().round());
        assert_eq!(ends, [24.0, 95.0]);
        // half way between 83 and 100, one decade: the root of ten
        assert!((stiffness_n_m(91.5).unwrap() - 200.0 * 10.0_f64.sqrt()).abs() < 1e-6);
    }
}
