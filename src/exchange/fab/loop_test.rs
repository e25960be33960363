//! The loop test: a strip between two clamps that approach each other buckles into a loop.
//!
//! In: free length and width of the strip, distance of the clamps, their force. Out: the bending
//! stiffness. Both clamps hold the strip level, so that its shape is four quarters of Euler's
//! elastica. With m the square of the elliptic modulus, d the clamps' distance over the length L,
//! and b the width:
//!
//! ```text
//! 2 E(m) / K(m) - 1 = d,    B = F L^2 / (16 b K(m)^2)
//! ```
//!
//! At d = 1 that is the buckling load, F = 4 pi^2 b B / L^2. Source: Euler's elastica, e.g. S. P.
//! Timoshenko and J. M. Gere, Theory of Elastic Stability, 2.7. The weight is left out.

/// Nearest clamps over the strip's length: nearer ones make a bulb whose sides touch. The tester
/// stops at 0.6.
const LEAST_SHARE: f64 = 0.3;
/// Parameter m of a loop that is nearer than [`LEAST_SHARE`].
const LARGEST_M: f64 = 0.8;

/// Complete elliptic integrals K and E of the parameter m, by the arithmetic-geometric mean.
fn elliptic(m: f64) -> [f64; 2] {
    let (mut a, mut b, mut power) = (1.0_f64, (1.0 - m).sqrt(), 0.5);
    let mut sum = power * m;
    while (a - b).abs() > 1e-15 * a {
        let c = 0.5 * (a - b);
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
        power *= 2.0;
        sum += power * c * c;
    }
    let k = std::f64::consts::FRAC_PI_2 / a;
    [k, k * (1.0 - sum)]
}

/// Bending stiffness per width \[N m\] of a strip of length and width \[m\] that presses with
/// `force_n` on clamps `distance_m` apart; `None` where the clamps are farther apart than the strip
/// is long, or nearer than [`LEAST_SHARE`] of it.
pub(super) fn bending_nm(
    [length_m, width_m]: [f64; 2],
    distance_m: f64,
    force_n: f64,
) -> Option<f64> {
    let share = distance_m / length_m;
    let share_at = |m: f64| {
        let [k, e] = elliptic(m);
        2.0 * e / k - 1.0
    };
    let (mut low, mut high) = (0.0, LARGEST_M);
    if !(LEAST_SHARE..1.0).contains(&share) {
        return None;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if share_at(middle) > share { low = middle } else { high = middle }
    }
    let [k, _] = elliptic(low);
    Some(force_n * length_m * length_m / (16.0 * width_m * k * k))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// A quarter of the loop without elliptic integrals: theta'' = -sin theta from the inflection,
    /// where theta is `angle` and theta' is 0, to the clamp, where theta is 0. Length and reach.
    fn quarter(angle: f64) -> [f64; 2] {
        let (mut theta, mut rate, mut reach, step) = (angle, 0.0_f64, 0.0, 1e-5);
        let mut length = 0.0;
        while theta > 0.0 {
            // Midpoint rule.
            let (half, half_rate) = (theta + 0.5 * step * rate, rate - 0.5 * step * theta.sin());
            theta += step * half_rate;
            rate -= step * half.sin();
            reach += step * half.cos();
            length += step;
        }
        [length, reach]
    }

    #[test]
    fn a_loop_of_known_stiffness_gives_it_back() {
        for angle in [0.2, 0.7, 1.3] {
            let [length, reach] = quarter(angle);
            // Lengths there are in sqrt(B b / F).
            let (strip_m, width_m, bending_nm_) = (0.021, 0.04, 4e-6);
            let unit_m = strip_m / (4.0 * length);
            let force_n = bending_nm_ * width_m / (unit_m * unit_m);
            let found = bending_nm([strip_m, width_m], 4.0 * reach * unit_m, force_n).unwrap();
            assert!((found / bending_nm_ - 1.0).abs() < 1e-4, "{angle}: {found}");
        }
    }

    #[test]
    fn a_strip_that_just_buckles_has_eulers_load_and_one_that_is_taut_none() {
        let force_n = 4.0 * PI * PI * 0.05 * 5e-6 / (0.02 * 0.02);
        let found = bending_nm([0.02, 0.05], 0.02 * (1.0 - 1e-9), force_n).unwrap();
        assert!((found / 5e-6 - 1.0).abs() < 1e-6);
        assert_eq!(bending_nm([0.02, 0.05], 0.0201, force_n), None);
        assert_eq!(bending_nm([0.02, 0.05], 0.001, force_n), None);
    }
}
