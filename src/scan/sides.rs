//! The four sides of the flat specimen: coordinates along each and outward of it.

/// Material coordinates as (along, outward) of a side: 0 is x = +half walked
/// towards +z, 1 is z = +half towards -x, and so on.
pub(super) fn to_side(side: usize, m: [f64; 2]) -> [f64; 2] {
    match side {
        0 => [m[1], m[0]],
        1 => [-m[0], m[1]],
        2 => [-m[1], -m[0]],
        _ => [m[0], -m[1]],
    }
}

/// The inverse of [`to_side`].
pub(super) fn from_side(side: usize, [along, outward]: [f64; 2]) -> [f64; 2] {
    match side {
        0 => [outward, along],
        1 => [-along, outward],
        2 => [-outward, -along],
        _ => [along, -outward],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Boundary;

    #[test]
    fn sides_run_like_the_boundary_vector() {
        for i in 0..244 {
            let m = Boundary::flat_xz_m(i, 0.3);
            let [along, outward] = to_side(i / 61, m);
            assert!((outward - 0.15).abs() < 1e-12, "{i}");
            assert!((along - ((i % 61) as f64 * 5e-3 - 0.15)).abs() < 1e-12, "{i}");
            let back = from_side(i / 61, [along, outward]);
            assert!((back[0] - m[0]).abs() + (back[1] - m[1]).abs() < 1e-12);
        }
    }
}
