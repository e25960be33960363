//! The moment of cloth that softens as it bends, over the whole range of curvatures.
//!
//! In: a stiffness and the parabola that was measured of its moment, `M = B k - N k^2` (Feng et al.
//! 2022). Out: the moment as three pieces, each a parabola or a line, with a continuous tangent but
//! for one step:
//!
//! - the measured parabola, up to where its tangent has fallen to [`FLOOR`] of B or where the
//!   curvature is reached up to which it was measured;
//! - from the former to the latter that tangent: the parabola falls from there on and must not be
//!   followed;
//! - beyond what was measured the tangent that the parabola has there, and at least [`BEYOND`] of
//!   B.
//!
//! Why the last: a cloth whose tangent stays lost has hardly more moment than B / (4 s) at any
//! curvature, and single folds of it close to creases one cell wide, for any cell
//! (`docs/design/simulator.md`). By how much the tangent recovers is chosen, not measured.

/// Least tangent stiffness over the linear one within the measured range.
pub(super) const FLOOR: f64 = 0.05;
/// Least tangent stiffness over the linear one beyond it.
pub(super) const BEYOND: f64 = 0.5;

/// A piece of a moment: `constant + linear k + quadratic k^2` from a curvature on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub from: f64,
    pub constant: f64,
    pub linear: f64,
    pub quadratic: f64,
}

/// The moment of cloth that softens, for curvatures from 0 on.
#[derive(Clone, Copy, Debug)]
pub(super) struct SoftenedMoment {
    pub pieces: [Piece; 3],
}

impl SoftenedMoment {
    /// Of a stiffness B and the N of its parabola, measured up to a curvature.
    pub fn new(stiffness: f64, cubic: f64, measured_to: f64) -> Self {
        let parabola = Piece { from: 0.0, constant: 0.0, linear: stiffness, quadratic: -cubic };
        let never = Piece { from: f64::INFINITY, ..parabola };
        if cubic == 0.0 {
            return Self { pieces: [parabola, never, never] };
        }
        let at_floor = (1.0 - FLOOR) * stiffness / (2.0 * cubic);
        let limit = if cubic > 0.0 { at_floor.min(measured_to) } else { measured_to };
        let tangent = stiffness - 2.0 * cubic * limit;
        let line = parabola.touched(limit, tangent);
        let beyond = line.touched(measured_to, tangent.max(BEYOND * stiffness));
        Self { pieces: [parabola, line, beyond] }
    }

    /// Its integral from 0, the moment, and its tangent at a curvature k >= 0.
    pub fn at(&self, k: f64) -> [f64; 3] {
        let own = self.pieces.iter().rfind(|piece| piece.from <= k).unwrap_or(&self.pieces[0]);
        let value =
            self.up_to(k).map(|(piece, to)| piece.integral(to) - piece.integral(piece.from));
        [value.sum(), own.moment(k), own.linear + 2.0 * own.quadratic * k]
    }

    /// What softening adds to a linear moment of this stiffness.
    pub fn less(mut self, stiffness: f64) -> Self {
        self.pieces.iter_mut().for_each(|piece| piece.linear -= stiffness);
        self
    }

    /// The pieces below a curvature, with where each ends.
    pub fn up_to(&self, k: f64) -> impl Iterator<Item = (Piece, f64)> {
        let ends = self.pieces.iter().skip(1).map(|piece| piece.from).chain([f64::INFINITY]);
        let own = self.pieces.iter().copied().zip(ends);
        own.filter(move |(piece, _)| piece.from < k).map(move |(piece, end)| (piece, end.min(k)))
    }
}

impl Piece {
    fn moment(&self, k: f64) -> f64 {
        self.constant + (self.linear + self.quadratic * k) * k
    }

    fn integral(&self, k: f64) -> f64 {
        (self.constant + (0.5 * self.linear + self.quadratic * k / 3.0) * k) * k
    }

    /// The line that continues it at a curvature.
    fn touched(&self, from: f64, tangent: f64) -> Self {
        let constant = self.moment(from) - tangent * from;
        Self { from, constant, linear: tangent, quadratic: 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_moment_is_the_parabola_where_it_was_measured_and_never_falls() {
        let (stiffness, measured_to) = (1e-6, 100.0);
        for (s_m, parabola_to) in [(1e-3, 100.0), (2.5e-3, 100.0), (6e-3, 79.0), (12e-3, 39.5)] {
            let law = SoftenedMoment::new(stiffness, s_m * stiffness, measured_to);
            for k in (0..600).map(f64::from) {
                let [_, moment, tangent] = law.at(k);
                if k < parabola_to {
                    let nominal = stiffness * k * (1.0 - s_m * k);
                    assert!((moment - nominal).abs() < 1e-12 * stiffness, "{s_m} {k}");
                }
                let least = if k < measured_to { FLOOR } else { BEYOND };
                assert!(tangent >= least * stiffness * (1.0 - 1e-12), "{s_m} {k}: {tangent:e}");
                assert!(tangent <= stiffness * (1.0 + 1e-12));
            }
        }
    }

    #[test]
    fn moment_and_tangent_are_difference_quotients() {
        for (stiffness, cubic) in [(1e-6, 3e-9), (1e-6, 9e-9), (2e-6, -1e-9), (1e-6, 0.0)] {
            let law = SoftenedMoment::new(stiffness, cubic, 50.0);
            for k in [3.0, 40.0, 49.0, 51.0, 80.0, 300.0] {
                let step = 1e-3;
                let [above, below] = [law.at(k + step), law.at(k - step)];
                let [_, moment, tangent] = law.at(k);
                let slope = |c: usize| (above[c] - below[c]) / (2.0 * step);
                assert!((slope(0) / moment - 1.0).abs() < 1e-6, "{k}: {:e}", slope(0) / moment);
                assert!((slope(1) / tangent - 1.0).abs() < 1e-6, "{k}: {:e}", slope(1) / tangent);
            }
            // no step in the moment
            let [below, above] = [50.0 - 1e-9, 50.0 + 1e-9].map(|k| law.at(k)[1]);
            assert!((above / below - 1.0).abs() < 1e-9);
        }
    }
}
