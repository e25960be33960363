//! The network behind `ort`: by default the embedded `tract` (pure Rust, nothing
//! to install); with `ORT_DYLIB_PATH` set, the native ONNX Runtime found there.
//! Both give the same numbers (tests/estimate/network.rs).

use std::path::PathBuf;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use ort::environment::Environment;
use ort::session::Session;
use ort::value::Tensor;

use super::model::INPUTS;
use crate::fabric::STIFFNESSES;

/// Names in the ONNX file.
const INPUT: &str = "boundary";
const NORMALISED: &str = "normalised";
const NOVELTY: &str = "novelty";
/// Where a native runtime is looked for.
const DYLIB: &str = "ORT_DYLIB_PATH";

/// Why the network gave nothing.
#[derive(Clone, Debug, thiserror::Error)]
pub enum RuntimeError {
    /// The native runtime that was asked for cannot be used.
    #[error("neural network runtime: {DYLIB} = {}: {source}", path.display())]
    Library {
        /// Its path.
        path: PathBuf,
        /// What `ort` says.
        source: Arc<ort::LoadDynamicError>,
    },
    /// The runtime refuses the network, or fails in it.
    #[error("neural network runtime: {0}")]
    Failed(Arc<ort::Error>),
    /// The network is another one: it lacks an output.
    #[error("neural network runtime: no output `{0}`")]
    NoOutput(&'static str),
    /// The network is another one: an output has another shape.
    #[error("neural network runtime: output `{name}` has shape {shape:?}")]
    Shape {
        /// Name of the output.
        name: &'static str,
        /// Its shape.
        shape: Vec<i64>,
    },
    /// An output is infinite or not a number.
    #[error("neural network runtime: an output is not finite")]
    NotFinite,
}

impl RuntimeError {
    fn of(error: ort::Error) -> Self {
        Self::Failed(Arc::new(error))
    }
}

/// What the network says of one rim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Output {
    /// Normalised logarithms of the stiffnesses.
    pub mean: [f32; STIFFNESSES],
    /// Logarithms of their standard deviations.
    pub log_sigma: [f32; STIFFNESSES],
    /// Distance from the training rims \[mm\].
    pub novelty_mm: f32,
}

/// A loaded network.
pub(super) struct Network {
    /// `ort` runs a session by exclusive reference.
    session: Mutex<Session>,
}

impl Network {
    pub fn new(onnx: &[u8]) -> Result<Self, RuntimeError> {
        let session = Session::builder(environment()?)
            .and_then(|mut builder| builder.commit_from_memory(onnx))
            .map_err(RuntimeError::of)?;
        Ok(Self { session: Mutex::new(session) })
    }

    /// Rows of [`INPUTS`] numbers to as many outputs.
    pub fn run(&self, rows: &[Vec<f32>]) -> Result<Vec<Output>, RuntimeError> {
        let flat: Vec<f32> = rows.concat();
        let tensor = Tensor::from_array(([rows.len(), INPUTS], flat)).map_err(RuntimeError::of)?;
        let mut session = self.session.lock().unwrap_or_else(PoisonError::into_inner);
        let outputs = session.run(ort::inputs![INPUT => tensor]).map_err(RuntimeError::of)?;
        let column = |name: &'static str, width: usize| {
            let value = outputs.get(name).ok_or(RuntimeError::NoOutput(name))?;
            let (shape, numbers) = value.try_extract_tensor::<f32>().map_err(RuntimeError::of)?;
            if numbers.len() != rows.len() * width {
                return Err(RuntimeError::Shape { name, shape: shape.to_vec() });
            }
            Ok(numbers)
        };
        let normalised = column(NORMALISED, 2 * STIFFNESSES)?;
        let novelty = column(NOVELTY, 1)?;
        if normalised.iter().chain(novelty).any(|x| !x.is_finite()) {
            return Err(RuntimeError::NotFinite);
        }
        let output = |(numbers, &novelty_mm): (&[f32; 2 * STIFFNESSES], &f32)| Output {
            mean: std::array::from_fn(|i| numbers[i]),
            log_sigma: std::array::from_fn(|i| numbers[STIFFNESSES + i]),
            novelty_mm,
        };
        Ok(normalised.as_chunks().0.iter().zip(novelty).map(output).collect())
    }
}

/// Path of the native runtime that this process was told to use; `None` for the
/// embedded one.
pub(super) fn native_library() -> Option<PathBuf> {
    std::env::var_os(DYLIB).filter(|path| !path.is_empty()).map(Into::into)
}

/// The one environment of the process; the choice of runtime is made once.
fn environment() -> Result<&'static Environment, RuntimeError> {
    static ENVIRONMENT: OnceLock<Result<Environment, RuntimeError>> = OnceLock::new();
    let made = ENVIRONMENT.get_or_init(|| {
        let builder = if let Some(path) = native_library() {
            ort::init_from(&path)
                .map_err(|source| RuntimeError::Library { path, source: Arc::new(source) })?
        } else {
            ort::set_api(ort_tract::api());
            ort::init()
        };
        builder.with_telemetry(false).build().map_err(RuntimeError::of)
    });
    made.as_ref().map_err(Clone::clone)
}
