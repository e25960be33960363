//! Repeated drapes of one fabric as one value: the random-effects mean of one stiffness.
//!
//! In: of each drape the logarithm of the value and the standard deviation that its own interval states. Out: a [`Pooled`].
//!
//! Drape k is taken as y_k ~ N(mu, tau^2 + s_k^2): s_k is what it states of itself, tau what drapes scatter beyond that (folds,
//! specimens, handling). tau is the restricted maximum likelihood estimate by Fisher scoring (Viechtbauer, J. Educ.
//! Behav. Stat. 30, 2005, eq. 15 ff.), mu the mean with weights 1 / (tau^2 + s_k^2), so that equal drapes count alike and a
//! vague one little. The interval of mu is the longer of two: Hartung and Knapp's (Stat. Med. 20, 2001), Student's t on the
//! weighted scatter seen, which the normal one of DerSimonian and Laird is too short beside (IntHout, Ioannidis, Borm, BMC Med.
//! Res. Methodol. 14, 2014), and that normal one, without which two drapes that agree by luck would state next to nothing
//! (Wiksten, Ruecker, Schwarzer, Stat. Med. 35, 2016). Logarithms make the mean geometric and the interval positive.
//!
//! Where it fails: what all drapes of a fabric are off by in the same way (the network's error for that fabric) does not scatter
//! and cannot be seen here. What the drapes state of themselves and do not show as scatter may be of that kind: if they
//! state a variance W and scatter by S^2 < W, up to W - S^2 may be common to all. [`Pooled::ln_shared90`] keeps that share
//! whole, however many drapes there are; [`Pooled::ln_interval90`] is of the mean of further repeats alone. Three drapes
//! that state very different s_k are held in 86 %, not 90 (the tests below print what they find).

use statrs::distribution::{ContinuousCDF as _, StudentsT};

use crate::numeric::moments::{mean, mean_and_error};

/// Of a normal distribution: half of its 90 % interval in standard deviations.
pub const Z90: f64 = 1.644_853_626_951_472_7;
/// Least standard deviation of a logarithm that an interval is taken to state.
const LEAST_SIGMA: f64 = 1e-4;
/// Fisher scoring ends when tau^2 changes by less than this.
const SETTLED: f64 = 1e-12;
/// Most steps of it; it takes some ten.
const MOST_STEPS: usize = 500;
/// Share of sets of sound drapes in which one is named as outlying, for one stiffness.
const FALSE_ALARMS: f64 = 0.05;

/// The mean of one stiffness over drapes; logarithms.
#[derive(Clone, Debug, PartialEq)]
pub struct Pooled {
    /// The random-effects mean.
    pub ln_mean: f64,
    /// Its 90 % interval.
    pub ln_interval90: [f64; 2],
    /// The same with what the drapes may all be off by.
    pub ln_shared90: [f64; 2],
    /// Standard deviation between drapes beyond what each states of itself.
    pub between: f64,
    /// What they state of themselves, root mean square.
    pub within: f64,
    /// For each drape, how far it lies from the others: in standard deviations of that difference, and the number of
    /// them beyond which it is named. `None` where the others are fewer than three.
    pub off: Vec<Option<[f64; 2]>>,
}

/// Standard deviation of the logarithm that a value with this 90 % interval states, from the longer half of it: an end that was cut
/// at the model's range says too little on its side. None is exact.
#[must_use]
pub fn stated_sigma(value: f64, [low, high]: [f64; 2]) -> f64 {
    ((high / value).ln().max((value / low).ln()) / Z90).max(LEAST_SIGMA)
}

/// Half of Student's 90 % interval in standard errors.
#[must_use]
pub fn student90(degrees: usize) -> f64 {
    student(degrees, 0.95)
}

/// Student's quantile.
fn student(degrees: usize, below: f64) -> f64 {
    StudentsT::new(0.0, 1.0, degrees as f64).map_or(f64::INFINITY, |t| t.inverse_cdf(below))
}

/// Pools drapes: at least one, each with a standard deviation above 0.
#[must_use]
pub fn pool(ln: &[f64], sigma: &[f64]) -> Pooled {
    let mean_of = RandomEffects::of(ln, sigma);
    let stated = mean(&sigma.iter().map(|s| s * s).collect::<Vec<_>>());
    let count = ln.len();
    let seen = if count > 1 { student90(count - 1) * mean_of.error } else { 0.0 };
    let half = seen.max(Z90 * mean_of.stated_error);
    // Of a single drape all that it states is in its interval already.
    let shared = if count > 1 {
        let [_, error] = mean_and_error(ln);
        (stated - error * error * count as f64).max(0.0)
    } else {
        0.0
    };
    let wide = half.max(seen.hypot(Z90 * shared.sqrt()));
    Pooled {
        ln_mean: mean_of.mean,
        ln_interval90: [mean_of.mean - half, mean_of.mean + half],
        ln_shared90: [mean_of.mean - wide, mean_of.mean + wide],
        between: mean_of.tau_sq.sqrt(),
        within: stated.sqrt(),
        off: (0..count).map(|k| off(ln, sigma, k)).collect(),
    }
}

/// How far a drape lies from the others (Viechtbauer and Cheung, Res. Synth. Methods 1, 2010: deleted residuals), held
/// against Student's t with as many degrees as give the others' scatter, at 5 % over all drapes.
fn off(ln: &[f64], sigma: &[f64], k: usize) -> Option<[f64; 2]> {
    let without = |values: &[f64]| -> Vec<f64> {
        values.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, v)| *v).collect()
    };
    let others = ln.len() - 1;
    if others < 3 {
        return None;
    }
    let rest = RandomEffects::of(&without(ln), &without(sigma));
    let spread = (rest.tau_sq + sigma[k] * sigma[k] + rest.error * rest.error).sqrt();
    let limit = student(others - 1, 1.0 - 0.5 * FALSE_ALARMS / ln.len() as f64);
    Some([(ln[k] - rest.mean) / spread, limit])
}

/// What drapes say together.
struct RandomEffects {
    mean: f64,
    /// Standard error of the mean after Hartung and Knapp, from the scatter seen; NaN of one drape.
    error: f64,
    /// The same from what drapes state and from tau^2.
    stated_error: f64,
    /// Variance between drapes.
    tau_sq: f64,
}

impl RandomEffects {
    fn of(ln: &[f64], sigma: &[f64]) -> Self {
        let count = ln.len() as f64;
        let mut tau_sq = if ln.len() > 1 {
            let [_, error] = mean_and_error(ln);
            error * error * count
        } else {
            0.0
        };
        for _ in 0..MOST_STEPS {
            let w = weights(sigma, tau_sq);
            let centre = weighted(ln, &w);
            let (mut up, mut down, mut sum) = (0.0, 0.0, 0.0);
            for k in 0..ln.len() {
                let square = w[k] * w[k];
                up += square * ((ln[k] - centre).powi(2) - sigma[k] * sigma[k]);
                down += square;
                sum += w[k];
            }
            let next = (up / down + 1.0 / sum).max(0.0);
            let settled = (next - tau_sq).abs() < SETTLED * (1.0 + tau_sq);
            tau_sq = next;
            if settled {
                break;
            }
        }
        let w = weights(sigma, tau_sq);
        let mean = weighted(ln, &w);
        let scatter: f64 = ln.iter().zip(&w).map(|(y, w)| w * (y - mean).powi(2)).sum();
        let sum: f64 = w.iter().sum();
        let error = (scatter / (count - 1.0) / sum).sqrt();
        Self { mean, error, stated_error: sum.sqrt().recip(), tau_sq }
    }
}

fn weights(sigma: &[f64], tau_sq: f64) -> Vec<f64> {
    sigma.iter().map(|s| 1.0 / (tau_sq + s * s)).collect()
}

fn weighted(values: &[f64], weights: &[f64]) -> f64 {
    let sum: f64 = weights.iter().sum();
    values.iter().zip(weights).map(|(v, w)| v * w).sum::<f64>() / sum
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution as _, StandardNormal};

    use super::*;

    fn normal(rng: &mut ChaCha8Rng) -> f64 {
        StandardNormal.sample(rng)
    }

    /// Student's t: tables print 6.314, 2.132, 1.833, and 1.645 in the limit.
    #[test]
    fn student_s_quantiles_are_those_of_the_tables() {
        for (degrees, table) in [(1, 6.3138), (4, 2.1318), (9, 1.8331), (100_000, 1.6449)] {
            assert!((student90(degrees) - table).abs() < 1e-4, "{degrees}: {}", student90(degrees));
        }
    }

    /// Equal statements: the plain mean, and tau^2 = S^2 - s^2, in closed form.
    #[test]
    fn equal_drapes_give_the_plain_mean_and_its_interval() {
        let ln = [1.0, 1.4, 0.8, 1.6];
        let (centre, variance) = (1.2, 0.4 / 3.0);
        let pooled = pool(&ln, &[0.1; 4]);
        assert!((pooled.ln_mean - centre).abs() < 1e-12);
        assert!((pooled.between - (variance - 0.01_f64).sqrt()).abs() < 1e-6, "{pooled:?}");
        let half = student90(3) * (variance / 4.0_f64).sqrt();
        assert!((pooled.ln_interval90[1] - centre - half).abs() < 1e-9);
        // they scatter more than they state: nothing is left that could be common
        assert_eq!(pooled.ln_interval90, pooled.ln_shared90);
        // and drapes that agree better than they state keep what they state
        let pooled = pool(&[1.0, 1.0, 1.0], &[0.2; 3]);
        assert_eq!(pooled.between, 0.0);
        assert!((pooled.ln_shared90[1] - 1.0 - Z90 * 0.2).abs() < 1e-12);
        let normal = Z90 * 0.2 / 3_f64.sqrt();
        assert!((pooled.ln_interval90[1] - 1.0 - normal).abs() < 1e-12);
    }

    /// The case of metafor's documentation: BCG vaccine, log risk ratios and variances of 13 trials; REML gives
    /// tau^2 = 0.3132 and mu = -0.7145, with Knapp and Hartung's standard error 0.1808.
    #[test]
    fn a_published_case_is_reproduced() {
        let ln = [
            -0.8893, -1.5854, -1.3481, -1.4416, -0.2175, -0.7861, -1.6209, 0.0120, -0.4694,
            -1.3713, -0.3394, 0.4459, -0.0173,
        ];
        let variance = [
            0.3256, 0.1946, 0.4154, 0.0200, 0.0512, 0.0069, 0.2230, 0.0040, 0.0564, 0.0730, 0.0124,
            0.5325, 0.0714_f64,
        ];
        let sigma = variance.map(f64::sqrt);
        let found = RandomEffects::of(&ln, &sigma);
        assert!((found.tau_sq - 0.3132).abs() < 5e-4, "{}", found.tau_sq);
        assert!((found.mean + 0.7145).abs() < 5e-4, "{}", found.mean);
        assert!((found.error - 0.1808).abs() < 5e-4, "{}", found.error);
    }

    /// Share of draws whose interval holds the truth: drapes that scatter by `between` and state `within`, of which
    /// `common` is the same for all drapes of a draw.
    fn coverage(count: usize, between: f64, within: f64, common: f64) -> [f64; 2] {
        const DRAWS: usize = 4000;
        let mut rng = ChaCha8Rng::seed_from_u64(count as u64);
        let mut held = [0; 2];
        for _ in 0..DRAWS {
            let shift = common * normal(&mut rng);
            // Drapes state from half to one and a half times as much as the usual one.
            let stated: Vec<f64> =
                (0..count).map(|k| within * (0.5 + k as f64 / (count - 1) as f64)).collect();
            let own = |s: f64| (s * s - common * common).max(0.0).sqrt();
            let ln: Vec<f64> = stated
                .iter()
                .map(|&s| 3.0 + shift + between * normal(&mut rng) + own(s) * normal(&mut rng))
                .collect();
            let pooled = pool(&ln, &stated);
            for (held, [low, high]) in
                held.iter_mut().zip([pooled.ln_interval90, pooled.ln_shared90])
            {
                *held += usize::from(low <= 3.0 && 3.0 <= high);
            }
        }
        held.map(|n| n as f64 / DRAWS as f64)
    }

    /// Binomial standard error at 90 % of 4000: 0.5 %. Student's t alone: 0.84 of three drapes.
    #[test]
    fn intervals_hold_the_truth_in_about_nine_of_ten_draws() {
        for (count, limits) in [(3, 0.845..0.98), (5, 0.865..0.96), (10, 0.875..0.95)] {
            for (between, within) in [(0.0, 0.2), (0.1, 0.2), (0.3, 0.2), (0.3, 0.02)] {
                let [mean, shared] = coverage(count, between, within, 0.0);
                println!(
                    "{count} drapes, between {between}, stated {within}: {mean:.3}, shared {shared:.3}"
                );
                assert!(limits.contains(&mean), "{count}, {between}, {within}: {mean}");
                assert!(shared >= mean, "{count}, {between}, {within}: {shared}");
            }
        }
    }

    /// An error that all drapes share: repeats cannot show it. The interval of the mean does not hold the truth,
    /// the other one does.
    #[test]
    fn what_repeats_share_stays_in_the_wider_interval() {
        for count in [3, 5, 10] {
            let [mean, shared] = coverage(count, 0.05, 0.4, 0.19);
            println!("{count} drapes with an error in common: {mean:.3}, shared {shared:.3}");
            assert!(shared > 0.855, "{count}: {shared}");
            assert!(mean < shared - 0.05, "{count}: {mean}, {shared}");
        }
    }

    #[test]
    fn an_outlying_drape_is_named_and_sound_ones_are_not() {
        let ln = [1.00, 1.05, 0.97, 1.02, 2.2];
        let pooled = pool(&ln, &[0.05; 5]);
        let beyond: Vec<bool> =
            pooled.off.iter().map(|off| off.is_some_and(|[by, limit]| by.abs() > limit)).collect();
        assert_eq!(beyond, [false, false, false, false, true], "{pooled:?}");
        assert!(pool(&ln[..3], &[0.05; 3]).off.iter().all(Option::is_none));

        const DRAWS: usize = 3000;
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut alarms = 0;
        for _ in 0..DRAWS {
            let ln: Vec<f64> = (0..6).map(|_| 0.3 * normal(&mut rng)).collect();
            let off = pool(&ln, &[0.05; 6]).off;
            alarms += usize::from(off.iter().flatten().any(|[by, limit]| by.abs() > *limit));
        }
        let share = alarms as f64 / DRAWS as f64;
        assert!((0.02..0.065).contains(&share), "{share}");
    }

    #[test]
    fn one_drape_keeps_its_own_interval() {
        let pooled = pool(&[2.0], &[0.1]);
        let half = Z90 * 0.1;
        assert!((pooled.ln_interval90[0] - (2.0 - half)).abs() < 1e-12);
        assert_eq!(pooled.ln_interval90, pooled.ln_shared90);
        assert_eq!((pooled.between, pooled.off.as_slice()), (0.0, &[None][..]));
    }
}
