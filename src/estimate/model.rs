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
    /// Areal density for which the network is asked whatever the specimen's, the answer being in proportion; without it
    /// the network is asked for the specimen's own.
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

/// Conformal calibration: the interval is mean -+ quantile * sigma, and with `by_length` times a factor by the fabric's
/// bending length (`scripts/calibrate_intervals.py`).
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Interval {
    level: f64,
    quantile: [f64; STIFFNESSES],
    #[serde(default)]
    by_length: Option<ByLength>,
}

/// Factor on all intervals of a fabric: straight in the logarithm of its bending length between some lengths, that of the first and
/// the last beyond them.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ByLength {
    length_mm: Vec<f64>,
    factor: Vec<f64>,
}

impl Interval {
    /// Half the widths of the intervals in sigmas, for a fabric whose shortest bending length is this \[m\].
    pub fn half_in_sigmas(&self, bending_length_m: f64) -> [f64; STIFFNESSES] {
        let length_mm = bending_length_m / M_PER_MM;
        let factor = self.by_length.as_ref().map_or(1.0, |by_length| by_length.at(length_mm));
        self.quantile.map(|quantile| quantile * factor)
    }
}

impl ByLength {
    fn at(&self, length_mm: f64) -> f64 {
        let after = self.length_mm.partition_point(|node_mm| *node_mm <= length_mm);
        match after {
            0 => self.factor[0],
            k if k == self.factor.len() => self.factor[k - 1],
            k => {
                let [from, to] = [self.length_mm[k - 1], self.length_mm[k]].map(f64::ln);
                let part = (length_mm.ln() - from) / (to - from);
                self.factor[k - 1] + part * (self.factor[k] - self.factor[k - 1])
            }
        }
    }

    fn is_sound(&self) -> bool {
        let Self { length_mm, factor } = self;
        let rises = length_mm.windows(2).all(|pair| pair[0] < pair[1]);
        let positive = |values: &[f64]| values.iter().all(|v| *v > 0.0 && v.is_finite());
        !factor.is_empty()
            && length_mm.len() == factor.len()
            && rises
            && positive(length_mm)
            && positive(factor)
    }
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
        let Interval { level, quantile, by_length } = &self.interval;
        if (level - 0.9).abs() > 1e-9 || !quantile.iter().all(|q| *q > 0.0 && q.is_finite()) {
            faults.push(format!("interval has level {level} and quantiles {quantile:?}"));
        }
        if let Some(by_length) = by_length.as_ref().filter(|by_length| !by_length.is_sound()) {
            faults.push(format!("interval has the factors {by_length:?}"));
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

    /// Areal density for which the network is asked whatever the specimen's \[g/m^2\]; none where it is the specimen's own.
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

    fn interval(by_length: Option<ByLength>) -> Interval {
        Interval { level: 0.9, quantile: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], by_length }
    }

    #[test]
    fn intervals_are_wider_by_the_factor_of_the_bending_length() {
        let factors = ByLength { length_mm: vec![4.0, 16.0], factor: vec![1.2, 0.8] };
        let by_length = interval(Some(factors));
        for (length_mm, factor) in [(1.0, 1.2), (4.0, 1.2), (8.0, 1.0), (16.0, 0.8), (40.0, 0.8)] {
            let halves = by_length.half_in_sigmas(length_mm * M_PER_MM);
            for (half, quantile) in halves.iter().zip(by_length.quantile) {
                assert!((half - factor * quantile).abs() < 1e-12, "{length_mm}: {half}");
            }
        }
        assert_eq!(interval(None).half_in_sigmas(8e-3), interval(None).quantile);
    }

    #[test]
    fn factors_that_say_nothing_are_not_sound() {
        let sound = |length_mm: &[f64], factor: &[f64]| {
            ByLength { length_mm: length_mm.to_vec(), factor: factor.to_vec() }.is_sound()
        };
        assert!(sound(&[4.0], &[1.1]) && sound(&[4.0, 9.0], &[1.1, 0.9]));
        assert!(!sound(&[], &[]) && !sound(&[4.0], &[1.1, 1.0]));
        assert!(!sound(&[9.0, 4.0], &[1.1, 0.9]) && !sound(&[4.0, 9.0], &[1.1, 0.0]));
        assert!(!sound(&[4.0, f64::NAN], &[1.1, 0.9]) && !sound(&[0.0, 4.0], &[1.0, 1.0]));
    }
}
