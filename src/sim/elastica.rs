//! The planar heavy elastica: the known answer for a cantilever strip.
//!
//! In: gamma = rho g L^3 / B and, for the model's extensions, the natural curvature and the
//! softening of the moment, or any other law of the moment ([`end_under`]). Out: the strip's droop
//! and reach over its length.
//!
//! The moment M balances the weight of what hangs beyond, `M' = -rho g (L - s) cos theta`,
//! with M(L) = 0 and the angle below the horizontal theta(0) = 0; theta' = k(M). For linear
//! bending that is `B theta'' = -rho g (L - s) cos theta`. Solved by integrating from the
//! free end with t = (L - s) / L (Runge-Kutta, order 4) and bisecting the end's angle until
//! the clamp is level. The unknown is the angle from the vertical on a scale that is
//! logarithmic near zero, since a long strip hangs within e^-66 of it.
//!
//! Fails: where softening leaves no curvature for a moment (beyond the top of the parabola)
//! the tangent of `energy/softening.rs` is not followed, and the result is an error.

/// A heavy strip clamped level at one end, without dimensions: lengths are in its own length L,
/// moments in B / L.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elastica {
    /// Weight over stiffness, rho g L^3 / B.
    pub gamma: f64,
    /// Natural curvature times L, positive downward.
    pub natural: f64,
    /// Softening s over L, of the moment M = k (1 - s |k|).
    pub softening: f64,
}

/// Where the free end of a strip is, seen from the clamp, in lengths of the strip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End {
    /// How far the end hangs below the clamp.
    pub droop: f64,
    /// How far the end reaches out horizontally.
    pub reach: f64,
}

/// No curvature bears the moment of a strip that softens.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "a strip with weight over stiffness {gamma} and softening {softening} has moments beyond the \
     top of its parabola, B / (4 s): give a shorter strip or less softening"
)]
pub struct BeyondParabola {
    /// Weight over stiffness, rho g L^3 / B.
    pub gamma: f64,
    /// Softening s over the strip's length L.
    pub softening: f64,
}

/// To which side an integration left the strips that can rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Swing {
    /// Past straight up: the end's angle was too large.
    Outward,
    /// Past straight down: the end's angle was too small.
    Inward,
}

impl Swing {
    /// The side that the sign of an angle or a moment tells.
    fn of(signed: f64) -> Self {
        if signed > 0.0 { Self::Outward } else { Self::Inward }
    }
}

/// Integration steps; doubling them moves no result by 1e-8 up to gamma = 1e4 (tested).
const STEPS: usize = 4000;
/// Angle within which the clamp must be level \[rad\].
const LEVEL_RAD: f64 = 1e-6;
/// Scale below which the end's angle from the vertical is resolved linearly.
const LEAST_ANGLE: f64 = 1e-40;

impl Elastica {
    /// A strip with linear bending that is flat when weightless.
    #[must_use]
    pub fn linear(gamma: f64) -> Self {
        Self { gamma, natural: 0.0, softening: 0.0 }
    }

    /// Where the free end comes to rest.
    ///
    /// # Errors
    /// [`BeyondParabola`] where the moment leaves the softening's parabola.
    pub fn end(&self) -> Result<End, BeyondParabola> {
        self.end_in(STEPS)
    }

    fn end_in(&self, steps: usize) -> Result<End, BeyondParabola> {
        let beyond = BeyondParabola { gamma: self.gamma, softening: self.softening };
        end_in(self.gamma, |moment| self.curvature(moment), steps).ok_or(beyond)
    }

    /// The curvature under a moment.
    fn curvature(&self, moment: f64) -> Option<f64> {
        if self.softening == 0.0 {
            return Some(self.natural + moment);
        }
        let root = 1.0 - 4.0 * self.softening * moment.abs();
        // the stable form of the smaller root
        (root >= 0.0).then(|| self.natural + 2.0 * moment / (1.0 + root.sqrt()))
    }
}

/// Where the free end of a strip of weight over stiffness `gamma` comes to rest whose curvature
/// (positive downward) under a moment is `curvature`, both without dimensions; `None` where that
/// gives no curvature for a moment that the strip has.
pub fn end_under(gamma: f64, curvature: impl Fn(f64) -> Option<f64>) -> Option<End> {
    end_in(gamma, curvature, STEPS)
}

fn end_in(gamma: f64, curvature: impl Fn(f64) -> Option<f64>, steps: usize) -> Option<End> {
    let angle = |z: f64| LEAST_ANGLE * z.sinh();
    let wide = (3.0 / LEAST_ANGLE).asinh();
    let (mut low, mut high) = (-wide, wide);
    for _ in 0..70 {
        let middle = 0.5 * (low + high);
        let too_far = match integrate(gamma, &curvature, angle(middle), steps) {
            Ok([upright, ..]) => upright >= std::f64::consts::FRAC_PI_2,
            Err(swing) => swing == Swing::Outward,
        };
        if too_far { high = middle } else { low = middle }
    }
    let [upright, _, reach, droop] = integrate(gamma, &curvature, angle(low), steps).ok()?;
    // where the parabola's top lies between the two last angles, neither has a level clamp
    let level = (upright - std::f64::consts::FRAC_PI_2).abs() < LEVEL_RAD;
    level.then_some(End { droop, reach })
}

/// Integrates from the free end, at the angle `upright` from the vertical, to the clamp. The
/// result is the angle there, the moment, and how far reach and droop have grown. It is an
/// error where the strip swings past straight up or straight down, from where it could come
/// back to a level clamp by a shape that no strip rests in, or where a moment has no curvature.
fn integrate(
    gamma: f64,
    curvature: impl Fn(f64) -> Option<f64>,
    upright: f64,
    steps: usize,
) -> Result<[f64; 4], Swing> {
    let slope = |t: f64, [upright, moment, _, _]: [f64; 4]| {
        let (sin, cos) = upright.sin_cos();
        let curvature = curvature(moment).ok_or(Swing::of(moment))?;
        Ok([curvature, gamma * t * sin, sin, cos])
    };
    let along = |a: [f64; 4], b: [f64; 4], by: f64| -> [f64; 4] {
        std::array::from_fn(|k| a[k] + b[k] * by)
    };
    let h = 1.0 / steps as f64;
    let mut state = [upright, 0.0, 0.0, 0.0];
    for step in 0..steps {
        let t = step as f64 * h;
        let a = slope(t, state)?;
        let b = slope(t + 0.5 * h, along(state, a, 0.5 * h))?;
        let c = slope(t + 0.5 * h, along(state, b, 0.5 * h))?;
        let d = slope(t + h, along(state, c, h))?;
        for k in 0..4 {
            state[k] += h / 6.0 * (a[k] + 2.0 * b[k] + 2.0 * c[k] + d[k]);
        }
        if state[0].abs() > std::f64::consts::PI {
            return Err(Swing::of(state[0]));
        }
    }
    Ok(state)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_light_strip_droops_as_the_linear_beam() {
        for gamma in [1e-3, 1e-2] {
            let end = Elastica::linear(gamma).end().unwrap();
            // large deflection takes off about gamma^2 / 100
            assert!((end.droop * 8.0 / gamma - 1.0).abs() < 0.01 * gamma, "{gamma}");
            assert!((1.0 - end.reach) < gamma * gamma);
        }
    }

    #[test]
    fn the_integration_has_converged_over_seven_decades() {
        for exponent in -3..=4 {
            let strip = Elastica::linear(10.0_f64.powi(exponent));
            let (coarse, fine) = (strip.end_in(STEPS).unwrap(), strip.end_in(2 * STEPS).unwrap());
            assert!((coarse.droop / fine.droop - 1.0).abs() < 1e-8, "{exponent}");
            assert!((coarse.reach / fine.reach - 1.0).abs() < 1e-8, "{exponent}");
        }
    }

    #[test]
    fn a_weightless_curled_strip_is_an_arc() {
        let curl = Elastica { gamma: 1e-12, natural: 1.3, softening: 0.0 };
        let end = curl.end().unwrap();
        assert!((end.reach - 1.3_f64.sin() / 1.3).abs() < 1e-9);
        assert!((end.droop - (1.0 - 1.3_f64.cos()) / 1.3).abs() < 1e-9);
    }

    #[test]
    fn a_softening_strip_droops_more_and_beyond_the_parabola_is_refused() {
        let droop = |softening| Elastica { gamma: 5.0, natural: 0.0, softening }.end();
        let (linear, soft) = (droop(0.0).unwrap(), droop(0.05).unwrap());
        assert!(soft.droop > linear.droop + 0.01);
        // of 0.2 an end was given until it was asked whether its clamp is level (it was 43 degrees
        // off)
        for softening in [0.2, 3.0] {
            assert_eq!(droop(softening), Err(BeyondParabola { gamma: 5.0, softening }));
        }
        // to first order in the softening the droop grows in proportion
        let little = droop(0.0005).unwrap();
        let rate = (soft.droop - linear.droop) / (little.droop - linear.droop);
        assert!((90.0..140.0).contains(&rate), "{rate}");
    }
}
