//! From the boundary vector to the six stiffnesses, with intervals.
//!
//! In: a [`Boundary`] (simulation frame), the areal density, to which all stiffnesses are in
//! proportion, and whether weft and warp are known. Out: an [`Estimate`]: a fabric, a 90 % interval
//! on each stiffness, and what is to be said against it. Method: convolutions along the rim before
//! the two streams of the paper's SNN (section IV), with a sigma beside each mean, averaged over
//! the symmetric views of the specimen; intervals by split conformal prediction, wider or narrower
//! by the bending length (docs/design/estimation.md).
//!
//! Where it fails: outside the trained range the network extrapolates, and says
//! so (`in_range`, `novelty`); the coverage of the intervals holds on average over
//! the prior's fabrics, not for each, and for drapes made like the training data:
//! on those of a finer grid it is less (docs/validation/network.md).

mod model;
mod runtime;
mod symmetry;

use std::path::Path;

pub use model::{Model, ModelError, SWAPPED};
pub use runtime::RuntimeError;
pub use symmetry::{View, views};

use crate::base::units::{KG_M2_PER_G_M2, M_PER_MM};
use crate::base::{Boundary, BoundaryPoint};
use crate::fabric::{Fabric, Fault, Likeness, Mixture, STIFFNESSES, TABLE_2, check_density};
use crate::sim::experiment::bending_length_m;
use runtime::{Network, Output};

/// How near the end of the trained range a normalised value counts as pinned
/// there: the prior has next to no fabrics beyond, and the network none.
const PINNED: f64 = 0.01;

/// The shipped model.
const SHIPPED_ONNX: &[u8] = include_bytes!("model/shipped.onnx");
const SHIPPED_JSON: &str = include_str!("model/shipped.json");

/// Name of the shipped model and the SHA-256 of its file, without loading it.
#[must_use]
pub fn shipped_model() -> [String; 2] {
    #[derive(serde::Deserialize)]
    struct Names {
        id: String,
        onnx_sha256: String,
    }
    let names = serde_json::from_str(SHIPPED_JSON);
    names.map_or_else(|_| Default::default(), |names: Names| [names.id, names.onnx_sha256])
}

/// What a boundary and a density say of the fabric.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// The stiffnesses, in the boundary's own frame (weft along z); the density is
    /// the one given.
    pub fabric: Fabric,
    /// Lower and upper ends of the 90 % interval on each stiffness. If weft and
    /// warp are not known, it covers both candidates.
    pub interval90: [Fabric; 2],
    /// Whether each stiffness (paper's order) lies inside what the model was
    /// trained on, and not at its end.
    pub in_range: [bool; STIFFNESSES],
    /// Ends of what the model was trained on, for each stiffness (paper's order and units), at this
    /// density. Values and intervals are cut there.
    pub trained: [[f64; 2]; STIFFNESSES],
    /// One fabric if weft and warp are known. If not, two: the boundary as given,
    /// and with weft and warp exchanged.
    pub candidates: Vec<Candidate>,
    /// How far the rim is from all drapes that the model knows.
    pub novelty: Novelty,
    /// What the user should know.
    pub warnings: Vec<EstimateWarning>,
}

/// One reading of an estimate.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The stiffnesses.
    pub fabric: Fabric,
    /// Lower and upper ends of the 90 % interval on each.
    pub interval90: [Fabric; 2],
}

/// Distance of a rim from the space of the rims that the model was trained on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Novelty {
    /// Root mean square over the points \[m\].
    pub rms_m: f64,
    /// What 99 % of the drapes of unseen fabrics, with scan noise, stay below \[m\].
    pub limit_m: f64,
    /// Largest distance of a coordinate from the range it had in training \[m\].
    pub outside_m: f64,
}

/// One stiffness of an estimate, as it is printed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterEstimate {
    /// Name in files.
    pub key: &'static str,
    /// The paper's symbol.
    pub symbol: &'static str,
    /// Unit of the numbers.
    pub unit: &'static str,
    /// The estimate.
    pub value: f64,
    /// 90 % interval.
    pub interval90: [f64; 2],
    /// Inside what the model was trained on, and not at its end.
    pub in_range: bool,
    /// Ends of what the model was trained on.
    pub trained: [f64; 2],
}

/// What the user should know of an estimate.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EstimateWarning {
    /// No fabric that the model knows is so light or so heavy.
    #[error(
        "density {value} g/m^2 lies outside the {min} to {max} g/m^2 of the fabrics that the model was trained on: \
         weigh the specimen again"
    )]
    DensityOutsideTraining {
        /// Density \[g/m^2\].
        value: f64,
        /// Lower end \[g/m^2\].
        min: f64,
        /// Upper end \[g/m^2\].
        max: f64,
    },
    /// The rim is unlike those of the training.
    #[error(
        "the rim is {rms_mm:.2} mm (rms) from any drape the model knows, more than the {limit_mm:.2} mm \
         of scanned ones: check the scan, or expect the stiffnesses to be off"
    )]
    NovelRim {
        /// Distance \[mm\].
        rms_mm: f64,
        /// Limit \[mm\].
        limit_mm: f64,
    },
    /// At or beyond the end of the trained range.
    #[error("{key} is at the {end} end of the trained range: the fabric may lie beyond it")]
    AtRangeEnd {
        /// Parameter.
        key: &'static str,
        /// `lower` or `upper`.
        end: &'static str,
    },
    /// Weft and warp are not known.
    #[error("weft and warp are not known and may be exchanged: say where the warp points")]
    OrientationAmbiguous,
    /// The three bending stiffnesses were made those of one plate.
    #[error(transparent)]
    Bending(crate::fabric::Warning),
}

/// Why there is no estimate.
#[derive(Debug, thiserror::Error)]
pub enum EstimateError {
    /// The density is not one of a textile.
    #[error(transparent)]
    Density(#[from] Fault),
    /// A point of the boundary, or its sigma, is not a number.
    #[error("point {index} of the boundary is not finite: the rim has to be complete")]
    NotFinite {
        /// Index in the boundary.
        index: usize,
    },
    /// The model cannot be used.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The runtime failed.
    #[error(transparent)]
    Runtime(#[from] RuntimeError),
}

/// A trained network with its calibration.
pub struct Estimator {
    model: Model,
    network: Network,
    /// That of the training, if it ships.
    prior: Option<Mixture>,
}

impl Estimator {
    /// The model that ships with the package.
    ///
    /// # Errors
    /// When it does not fit this build's simulator, or the runtime fails.
    pub fn shipped() -> Result<Self, EstimateError> {
        let model = Model::parse("shipped model", SHIPPED_JSON, SHIPPED_ONNX)?;
        model.check_trained_on_drapes()?;
        Self::new(model, SHIPPED_ONNX)
    }

    /// A model of `scripts/train.py` from its two files.
    ///
    /// # Errors
    /// When a file cannot be read, the two do not belong together, the model was
    /// trained on another simulator's drapes, or the runtime fails.
    pub fn from_files(onnx: &Path, json: &Path) -> Result<Self, EstimateError> {
        let io = |path: &Path| {
            let path = path.display().to_string();
            move |error: std::io::Error| ModelError::new(path, error.to_string())
        };
        let text = std::fs::read_to_string(json).map_err(io(json))?;
        let bytes = std::fs::read(onnx).map_err(io(onnx))?;
        let model = Model::parse(&json.display().to_string(), &text, &bytes)?;
        Self::new(model, &bytes)
    }

    fn new(model: Model, onnx: &[u8]) -> Result<Self, EstimateError> {
        let prior = Mixture::named(&model.prior).ok();
        Ok(Self { network: Network::new(onnx)?, model, prior })
    }

    /// The prior of the fabrics that the model was trained on, if it ships.
    #[must_use]
    pub fn prior(&self) -> Option<&Mixture> {
        self.prior.as_ref()
    }

    /// What is known of the model.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// What runs the network: `tract`, or the path of a native ONNX Runtime.
    #[must_use]
    pub fn runtime(&self) -> String {
        runtime::native_library().map_or_else(|| "tract".into(), |path| path.display().to_string())
    }

    /// Estimates the fabric.
    ///
    /// # Errors
    /// When the density is not one of a textile, a point is not finite, or the
    /// runtime fails. A poor estimate is not an error: it says so.
    pub fn estimate(
        &self,
        boundary: &Boundary,
        density_kg_m2: f64,
        orientation_known: bool,
    ) -> Result<Estimate, EstimateError> {
        check_density(density_kg_m2)?;
        if let Some(index) = boundary.points().iter().position(|p| !is_finite(p)) {
            return Err(EstimateError::NotFinite { index });
        }
        let views = symmetry::views(boundary);
        let asked_kg_m2 = self.asked_kg_m2(density_kg_m2);
        let rows: Vec<Vec<f32>> =
            views.iter().map(|view| network_input(&view.boundary, asked_kg_m2)).collect();
        let outputs = self.network.run(&rows)?;
        let mixture = Normalised::over_views(&views, &outputs);
        let novelty = self.novelty(&rows[0], outputs[0].novelty_mm);
        let asked = Asked { density_kg_m2, noise_m: boundary.mean_sigma_m() };
        Ok(self.assemble(&mixture, &asked, orientation_known, novelty))
    }

    /// The density for which the network is asked. A drape at rest depends on stiffness over weight
    /// alone, so that the answer for the specimen's is that one in proportion.
    fn asked_kg_m2(&self, density_kg_m2: f64) -> f64 {
        self.model.input.asked_density_g_m2.map_or(density_kg_m2, |asked| asked * KG_M2_PER_G_M2)
    }

    fn novelty(&self, row: &[f32], rms_mm: f32) -> Novelty {
        let input = &self.model.input;
        let excess = |((&x, &min), &max): ((&f32, &f64), &f64)| {
            (min - f64::from(x)).max(f64::from(x) - max).max(0.0)
        };
        let coordinates = row.iter().zip(&input.min).zip(&input.max).take(row.len() - 1);
        Novelty {
            rms_m: f64::from(rms_mm) * M_PER_MM,
            limit_m: input.novelty_limit_mm * M_PER_MM,
            outside_m: coordinates.map(excess).fold(0.0, f64::max) * M_PER_MM,
        }
    }

    fn assemble(
        &self,
        mixture: &Normalised,
        asked: &Asked,
        orientation_known: bool,
        novelty: Novelty,
    ) -> Estimate {
        let density_kg_m2 = asked.density_kg_m2;
        let mut warnings = Vec::new();
        let unlike = self.unlike_in_density(density_kg_m2);
        // asked for another density the network does not extrapolate
        let extrapolates = unlike.is_some() && self.model.input.asked_density_g_m2.is_none();
        let mut in_range = [!extrapolates; STIFFNESSES];
        warnings.extend(unlike);
        let heavier = density_kg_m2 / self.asked_kg_m2(density_kg_m2);
        for (i, known) in in_range.iter_mut().enumerate() {
            let mean = mixture.mean[i];
            if !(PINNED..=1.0 - PINNED).contains(&mean) {
                let end = if mean < 0.5 { "lower" } else { "upper" };
                warnings.push(EstimateWarning::AtRangeEnd { key: TABLE_2[i].key, end });
                *known = false;
            }
        }
        if novelty.rms_m > novelty.limit_m {
            let [rms_mm, limit_mm] = [novelty.rms_m, novelty.limit_m].map(|m| m / M_PER_MM);
            warnings.push(EstimateWarning::NovelRim { rms_mm, limit_mm });
        }
        let (as_given, bending) = self.candidate(mixture, asked);
        warnings.extend(bending.map(EstimateWarning::Bending));
        let mut candidates = vec![as_given];
        if !orientation_known {
            // The network is averaged over quarter turns too, so that the other
            // reading is this one with weft and warp exchanged.
            candidates.push(self.candidate(&mixture.swapped(), asked).0);
            warnings.push(EstimateWarning::OrientationAmbiguous);
            for pair in [(0, 1), (3, 4)] {
                let both = in_range[pair.0] && in_range[pair.1];
                (in_range[pair.0], in_range[pair.1]) = (both, both);
            }
        }
        Estimate {
            fabric: candidates[0].fabric,
            interval90: covering(&candidates),
            in_range,
            trained: std::array::from_fn(|i| self.model.output.range(i).map(|end| end * heavier)),
            candidates,
            novelty,
            warnings,
        }
    }

    /// Whether no fabric of the training is so light or so heavy.
    fn unlike_in_density(&self, density_kg_m2: f64) -> Option<EstimateWarning> {
        let value = density_kg_m2 / KG_M2_PER_G_M2;
        let [min, max] = self.model.density_range_g_m2();
        let outside = !(min..=max).contains(&value);
        outside.then_some(EstimateWarning::DensityOutsideTraining { value, min, max })
    }

    /// Values and intervals, cut to the trained range, for a density and a noise. The middle is
    /// made the bending set of one plate, so that it can be simulated.
    fn candidate(
        &self,
        mixture: &Normalised,
        &Asked { density_kg_m2, noise_m }: &Asked,
    ) -> (Candidate, Option<crate::fabric::Warning>) {
        let heavier = density_kg_m2 / self.asked_kg_m2(density_kg_m2);
        let beside = |off: [f64; STIFFNESSES]| {
            let mut values = [density_kg_m2 / KG_M2_PER_G_M2; STIFFNESSES + 1];
            for (i, value) in values.iter_mut().enumerate().take(STIFFNESSES) {
                *value = self.model.output.stiffness(i, mixture.mean[i] + off[i]) * heavier;
            }
            Fabric { density_kg_m2, ..Fabric::from_paper_units(values) }
        };
        let said = beside([0.0; STIFFNESSES]);
        let halves = self.model.interval.half_in_sigmas(bending_length_m(&said), noise_m);
        let end = |sign: f64| beside(std::array::from_fn(|i| sign * halves[i] * mixture.sigma[i]));
        let (middle, warning) = said.project_bending();
        let [low, mut high] = [end(-1.0), end(1.0)];
        high.bending_bias_nm = high.bending_bias_nm.max(middle.bending_bias_nm);
        (Candidate { fabric: middle, interval90: [low, high] }, warning)
    }
}

impl Candidate {
    /// The same with weft and warp exchanged.
    #[must_use]
    pub fn exchanged(&self) -> Self {
        let exchanged = |fabric: &Fabric| {
            let values = fabric.in_si();
            let [a, b, c, d, e, f] = SWAPPED.map(|i| values[i]);
            Fabric::from_si([a, b, c, d, e, f, fabric.density_kg_m2])
        };
        Self {
            fabric: exchanged(&self.fabric),
            interval90: self.interval90.each_ref().map(exchanged),
        }
    }
}

impl Estimate {
    /// The estimate of these readings, of which there is one at least; all else is that of `other`.
    #[must_use]
    pub fn of_candidates(candidates: Vec<Candidate>, other: &Self) -> Self {
        let interval90 = covering(&candidates);
        Self { fabric: candidates[0].fabric, interval90, candidates, ..other.clone() }
    }

    /// Where the stiffnesses lie in a prior.
    #[must_use]
    pub fn likeness(&self, prior: &Mixture) -> Likeness {
        let readings = self.candidates.iter().map(|c| (c.fabric, c.interval90));
        Likeness::of(prior, &readings.collect::<Vec<_>>())
    }

    /// The stiffnesses in the paper's order and units.
    #[must_use]
    pub fn parameters(&self) -> [ParameterEstimate; STIFFNESSES] {
        let value = self.fabric.to_paper_units();
        let [low, high] = self.interval90.map(|fabric| fabric.to_paper_units());
        std::array::from_fn(|i| ParameterEstimate {
            key: TABLE_2[i].key,
            symbol: TABLE_2[i].symbol,
            unit: TABLE_2[i].unit,
            value: value[i],
            interval90: [low[i], high[i]],
            in_range: self.in_range[i],
            trained: self.trained[i],
        })
    }
}

fn is_finite(point: &BoundaryPoint) -> bool {
    point.position_m.coords.iter().chain([&point.sigma_m]).all(|value| value.is_finite())
}

/// What of a specimen and its scan an answer is for, besides the rim.
struct Asked {
    density_kg_m2: f64,
    /// Mean of the rim's sigmas \[m\].
    noise_m: f64,
}

/// Means and sigmas of the six normalised outputs.
#[derive(Clone, Debug, PartialEq)]
struct Normalised {
    mean: [f64; STIFFNESSES],
    sigma: [f64; STIFFNESSES],
}

impl Normalised {
    /// Moments of the equal mixture of what the views say.
    fn over_views(views: &[symmetry::View], outputs: &[Output]) -> Self {
        let n = views.len() as f64;
        let (mut mean, mut square) = ([0.0; STIFFNESSES], [0.0; STIFFNESSES]);
        for (view, output) in views.iter().zip(outputs) {
            for i in 0..STIFFNESSES {
                let from = if view.swapped { SWAPPED[i] } else { i };
                let (m, s) =
                    (f64::from(output.mean[from]), f64::from(output.log_sigma[from]).exp());
                mean[i] += m / n;
                square[i] += (m * m + s * s) / n;
            }
        }
        let sigma = std::array::from_fn(|i| (square[i] - mean[i] * mean[i]).max(0.0).sqrt());
        Self { mean, sigma }
    }

    /// With weft and warp exchanged.
    fn swapped(&self) -> Self {
        Self { mean: SWAPPED.map(|i| self.mean[i]), sigma: SWAPPED.map(|i| self.sigma[i]) }
    }
}

/// The smallest interval per stiffness that holds those of all candidates.
fn covering(candidates: &[Candidate]) -> [Fabric; 2] {
    let end = |side: usize, choose: fn(f64, f64) -> f64| {
        let fabrics = candidates.iter().map(|c| c.interval90[side]);
        fabrics
            .reduce(|a, b| Fabric {
                stretch_weft_n_m: choose(a.stretch_weft_n_m, b.stretch_weft_n_m),
                stretch_warp_n_m: choose(a.stretch_warp_n_m, b.stretch_warp_n_m),
                shear_n_m: choose(a.shear_n_m, b.shear_n_m),
                bending_weft_nm: choose(a.bending_weft_nm, b.bending_weft_nm),
                bending_warp_nm: choose(a.bending_warp_nm, b.bending_warp_nm),
                bending_bias_nm: choose(a.bending_bias_nm, b.bending_bias_nm),
                density_kg_m2: a.density_kg_m2,
            })
            .expect("an estimate has at least one candidate")
    };
    [end(0, f64::min), end(1, f64::max)]
}

/// The network's input: 732 coordinates \[mm\], then the density \[g/m^2\].
fn network_input(boundary: &Boundary, density_kg_m2: f64) -> Vec<f32> {
    let coordinates = boundary.positions_m().flat_map(|p| [p.x, p.y, p.z]);
    coordinates
        .map(|metres| (metres / M_PER_MM) as f32)
        .chain([(density_kg_m2 / KG_M2_PER_G_M2) as f32])
        .collect()
}
