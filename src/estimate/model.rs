//! What is known of a trained network besides its weights: the JSON that
//! `scripts/train.py` writes beside the ONNX file (schema `scan2params/model/1`).

use serde::Deserialize;

use crate::base::boundary::POINTS;
use crate::base::units::M_PER_MM;
use crate::fabric::{STIFFNESSES, TABLE_2, sha256_hex};
use crate::sim::NUMERICS_VERSION;

const SCHEMA: &str = "scan2params/model/1";
/// Inputs of the network: coordinates and the density.
pub(super) const INPUTS: usize = 3 * POINTS + 1;
/// The paper's order with weft and warp exchanged.
pub const SWAPPED: [usize; STIFFNESSES] = [1, 0, 2, 4, 3, 5];

/// A model that cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{name}: {fault}")]
pub struct ModelError {
    name: String,
    fault: String,
}

impl ModelError {
    pub(super) fn new(name: impl Into<String>, fault: impl Into<String>) -> Self {
        Self { name: name.into(), fault: fault.into() }
    }
}

/// What is known of a trained network. Fields of the file that are for people
/// (metrics, command line, seeds) are in [`Self::record`].
#[derive(Clone, Debug, Deserialize)]
pub struct Model {
    schema: String,
    /// Name of the model.
    pub id: String,
    /// `drapes`, or `fake` for a model that only tests the way through.
    pub trained_on: String,
    /// SHA-256 of the ONNX file, hexadecimal.
    pub onnx_sha256: String,
    /// Numerics version of the simulator that made the drapes.
    pub simulator_numerics: u32,
    /// Prior of the fabrics.
    pub prior: String,
    pub(super) input: Input,
    pub(super) output: Output,
    pub(super) interval: Interval,
    /// Everything else that the file says.
    #[serde(flatten)]
    pub record: serde_json::Map<String, serde_json::Value>,
}

/// Ranges of the 733 inputs in training \[mm, g/m^2\].
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Input {
    pub min: Vec<f64>,
    pub max: Vec<f64>,
    pub novelty_limit_mm: f64,
    /// Areal density that the network gets for any specimen, the answer being in proportion;
    /// without it the network gets the specimen's own.
    #[serde(default)]
    pub asked_density_g_m2: Option<f64>,
}

/// Logarithms of the stiffnesses (the paper's units) at outputs 0 and 1.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Output {
    keys: Vec<String>,
    ln_min: [f64; STIFFNESSES],
    ln_max: [f64; STIFFNESSES],
}

impl Output {
    /// The stiffness of a normalised value, cut to the trained range (paper's
    /// units).
    pub fn stiffness(&self, parameter: usize, normalised: f64) -> f64 {
        let (min, max) = (self.ln_min[parameter], self.ln_max[parameter]);
        (min + normalised.clamp(0.0, 1.0) * (max - min)).exp()
    }
}

impl Output {
    /// Least and largest stiffness of the training (paper's units).
    pub fn range(&self, parameter: usize) -> [f64; 2] {
        [self.ln_min[parameter], self.ln_max[parameter]].map(f64::exp)
    }
}

/// Conformal calibration: the interval is mean -+ quantile * sigma, and with `by_length` times a
/// factor by the fabric's bending length, with `by_noise` times one by the rim's noise
/// (`scripts/calibrate_intervals.py`).
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Interval {
    level: f64,
    quantile: [f64; STIFFNESSES],
    #[serde(default)]
    by_length: Option<ByLength>,
    #[serde(default)]
    by_noise: Option<ByNoise>,
}

/// Factor on all intervals of a fabric: straight in the logarithm of its bending length between
/// some lengths, that of the first and the last beyond them.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ByLength {
    length_mm: Vec<f64>,
    factor: Vec<f64>,
}

/// Factor on all intervals of a rim: straight in the mean of its points' sigmas between some;
/// beyond the last one it continues as between the last two.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ByNoise {
    sigma_mm: Vec<f64>,
    factor: Vec<f64>,
}

impl Interval {
    /// Half the widths of the intervals in sigmas, for a fabric whose shortest bending length is
    /// this \[m\] and a rim whose points are known to within this, per coordinate, in the mean
    /// \[m\].
    pub fn half_in_sigmas(&self, bending_length_m: f64, noise_m: f64) -> [f64; STIFFNESSES] {
        let [length_mm, noise_mm] = [bending_length_m, noise_m].map(|m| m / M_PER_MM);
        let by_length = self.by_length.as_ref().map_or(1.0, |by_length| by_length.at(length_mm));
        let by_noise = self.by_noise.as_ref().map_or(1.0, |by_noise| by_noise.at(noise_mm));
        self.quantile.map(|quantile| quantile * by_length * by_noise)
    }
}

impl ByLength {
    fn at(&self, length_mm: f64) -> f64 {
        let Self { length_mm: nodes, factor } = self;
        let ends = [nodes[0], nodes[nodes.len() - 1]];
        let nodes: Vec<f64> = nodes.iter().copied().map(f64::ln).collect();
        straight(&nodes, factor, length_mm.clamp(ends[0], ends[1]).ln())
    }

    fn is_sound(&self) -> bool {
        are_nodes(&self.length_mm, &self.factor) && self.length_mm[0] > 0.0
    }
}

impl ByNoise {
    fn at(&self, sigma_mm: f64) -> f64 {
        straight(&self.sigma_mm, &self.factor, sigma_mm.max(self.sigma_mm[0]))
    }

    /// Factors that fall with the noise would soon be none beyond the last node.
    fn is_sound(&self) -> bool {
        are_nodes(&self.sigma_mm, &self.factor)
            && self.sigma_mm[0] >= 0.0
            && self.factor.windows(2).all(|pair| pair[0] <= pair[1])
    }
}

/// Value at `x` of the line through the nodes, which continues beyond its ends; a single node holds
/// everywhere.
fn straight(nodes: &[f64], values: &[f64], x: f64) -> f64 {
    let last = nodes.len() - 1;
    if last == 0 {
        return values[0];
    }
    let k = nodes.partition_point(|node| *node <= x).clamp(1, last);
    let part = (x - nodes[k - 1]) / (nodes[k] - nodes[k - 1]);
    values[k - 1] + part * (values[k] - values[k - 1])
}

/// Whether there are as many factors as nodes, one at least, all of them factors, and the nodes
/// rise.
fn are_nodes(nodes: &[f64], factors: &[f64]) -> bool {
    let rises = nodes.windows(2).all(|pair| pair[0] < pair[1]);
    !nodes.is_empty()
        && nodes.len() == factors.len()
        && rises
        && nodes.iter().all(|node| node.is_finite())
        && factors.iter().all(|factor| *factor > 0.0 && factor.is_finite())
}

impl Model {
    /// Reads `json` and makes sure that it belongs to `onnx` and to this
    /// program. `name` is for messages.
    pub(super) fn parse(name: &str, json: &str, onnx: &[u8]) -> Result<Self, ModelError> {
        let model: Self =
            serde_json::from_str(json).map_err(|e| ModelError::new(name, e.to_string()))?;
        let faults = model.faults(&sha256_hex(onnx));
        if faults.is_empty() { Ok(model) } else { Err(ModelError::new(name, faults.join("; "))) }
    }

    fn faults(&self, sha256: &str) -> Vec<String> {
        let mut faults = Vec::new();
        if self.schema != SCHEMA {
            faults.push(format!("schema is `{}`, expected `{SCHEMA}`", self.schema));
        }
        if self.onnx_sha256 != sha256 {
            let recorded = &self.onnx_sha256;
            faults.push(format!("the ONNX file has SHA-256 {sha256}, recorded is {recorded}"));
        }
        if self.simulator_numerics != NUMERICS_VERSION {
            let theirs = self.simulator_numerics;
            faults.push(format!(
                "trained on drapes of simulator numerics {theirs}, this is {NUMERICS_VERSION}: \
                 train again (scripts/README.md)"
            ));
        }
        let keys = TABLE_2.iter().take(STIFFNESSES).map(|range| range.key);
        if !keys.eq(self.output.keys.iter().map(String::as_str)) {
            faults.push(format!("outputs are {:?}", self.output.keys));
        }
        if [self.input.min.len(), self.input.max.len()] != [INPUTS; 2] {
            let inputs = self.input.min.len();
            faults.push(format!("has ranges of {inputs} inputs, expected {INPUTS}"));
        }
        let [least, most] = [&self.input.min, &self.input.max].map(|v| v.last().copied());
        if let (Some(asked), Some(least), Some(most)) = (self.input.asked_density_g_m2, least, most)
            && !(least..=most).contains(&asked)
        {
            faults.push(format!("asks for {asked} g/m^2, trained on {least} to {most}"));
        }
        let Output { ln_min, ln_max, .. } = &self.output;
        if !ln_min.iter().zip(ln_max).all(|(min, max)| min < max && (max - min).is_finite()) {
            faults.push(format!("output ranges are {ln_min:?} to {ln_max:?}"));
        }
        let Interval { level, quantile, by_length, by_noise } = &self.interval;
        if (level - 0.9).abs() > 1e-9 || !quantile.iter().all(|q| *q > 0.0 && q.is_finite()) {
            faults.push(format!("interval has level {level} and quantiles {quantile:?}"));
        }
        if let Some(by_length) = by_length.as_ref().filter(|by_length| !by_length.is_sound()) {
            faults.push(format!("interval has the factors {by_length:?}"));
        }
        if let Some(by_noise) = by_noise.as_ref().filter(|by_noise| !by_noise.is_sound()) {
            faults.push(format!("interval has the factors {by_noise:?}"));
        }
        faults
    }

    /// Refuses a model that was trained on made-up drapes.
    pub(super) fn check_trained_on_drapes(&self) -> Result<(), ModelError> {
        if self.trained_on == "drapes" {
            return Ok(());
        }
        let fault = format!(
            "was trained on `{}` data and estimates nothing: train it on drapes (scripts/README.md)",
            self.trained_on
        );
        Err(ModelError::new(self.id.clone(), fault))
    }

    /// Areal density that the network gets for any specimen \[g/m^2\]; none if it is the specimen's
    /// own.
    #[must_use]
    pub fn asked_density_g_m2(&self) -> Option<f64> {
        self.input.asked_density_g_m2
    }

    /// Range of the density in training \[g/m^2\].
    #[must_use]
    pub fn density_range_g_m2(&self) -> [f64; 2] {
        [self.input.min[INPUTS - 1], self.input.max[INPUTS - 1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interval(by_length: Option<ByLength>, by_noise: Option<ByNoise>) -> Interval {
        Interval { level: 0.9, quantile: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], by_length, by_noise }
    }

    fn factor(of: &Interval, length_mm: f64, noise_mm: f64) -> f64 {
        let halves = of.half_in_sigmas(length_mm * M_PER_MM, noise_mm * M_PER_MM);
        let factor = halves[0] / of.quantile[0];
        for (half, quantile) in halves.iter().zip(of.quantile) {
            assert!((half - factor * quantile).abs() < 1e-12, "{length_mm} {noise_mm}: {half}");
        }
        factor
    }

    #[test]
    fn intervals_are_wider_by_the_factors_of_the_bending_length_and_of_the_noise() {
        let lengths = || Some(ByLength { length_mm: vec![4.0, 16.0], factor: vec![1.2, 0.8] });
        let noises =
            || Some(ByNoise { sigma_mm: vec![0.0, 0.5, 1.0], factor: vec![0.9, 1.0, 1.2] });
        let by_length = [(1.0, 1.2), (4.0, 1.2), (8.0, 1.0), (16.0, 0.8), (40.0, 0.8)];
        // noise of more than was tried costs as the last that was
        let by_noise = [(0.0, 0.9), (0.25, 0.95), (0.5, 1.0), (1.0, 1.2), (2.0, 1.6)];
        let both = interval(lengths(), noises());
        for (length_mm, of_length) in by_length {
            let alone = factor(&interval(lengths(), None), length_mm, 0.7);
            assert!((alone - of_length).abs() < 1e-12, "{length_mm}: {alone}");
            for (noise_mm, of_noise) in by_noise {
                let found = factor(&both, length_mm, noise_mm);
                assert!((found - of_length * of_noise).abs() < 1e-12, "{length_mm} {noise_mm}");
            }
        }
        assert_eq!(factor(&interval(None, None), 8.0, 3.0), 1.0);
    }

    #[test]
    fn factors_that_say_nothing_are_not_sound() {
        let length = |length_mm: &[f64], factor: &[f64]| {
            ByLength { length_mm: length_mm.to_vec(), factor: factor.to_vec() }.is_sound()
        };
        assert!(length(&[4.0], &[1.1]) && length(&[4.0, 9.0], &[1.1, 0.9]));
        assert!(!length(&[], &[]) && !length(&[4.0], &[1.1, 1.0]));
        assert!(!length(&[9.0, 4.0], &[1.1, 0.9]) && !length(&[4.0, 9.0], &[1.1, 0.0]));
        assert!(!length(&[4.0, f64::NAN], &[1.1, 0.9]) && !length(&[0.0, 4.0], &[1.0, 1.0]));
        let noise = |sigma_mm: &[f64], factor: &[f64]| {
            ByNoise { sigma_mm: sigma_mm.to_vec(), factor: factor.to_vec() }.is_sound()
        };
        assert!(noise(&[0.0], &[1.1]) && noise(&[0.0, 1.0], &[0.9, 1.1]));
        assert!(!noise(&[-0.1, 1.0], &[0.9, 1.1]) && !noise(&[0.0, 1.0], &[1.1, 0.9]));
    }
}
