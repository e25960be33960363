//! scan2params for Python: the functions of the library, numpy in and out.
//!
//! In: numpy arrays, paths, and what is known. Out: classes that hold the library's results and
//! give them as arrays. Nothing is computed here: each function resolves its arguments, calls what
//! the program's verb of the same name calls, and shows the result. All of it is SI, as inside the
//! library; `paper_units` and the dictionaries of `params.json` and `calibration.json` are in the
//! units that those files name.
//!
//! Each long function works on its own thread (`work`). The caller's thread waits without Python's
//! lock, reports the steps and listens for control-C.
//!
//! The types for Python are in `scan2params/_scan2params.pyi`; tests check that the two agree.

#![warn(missing_docs)]

mod arrays;
mod augment;
mod boundary;
mod calibrate;
mod drape;
mod errors;
mod estimate;
mod fabric;
mod given;
mod messages;
mod pickled;
mod rim;
mod words;
mod work;

use pyo3::prelude::*;

/// The functions of scan2params; import `scan2params`.
#[pymodule]
mod _scan2params {
    use super::*;
    #[pymodule_export]
    use crate::augment::{Scan, augment};
    #[pymodule_export]
    use crate::boundary::Boundary;
    #[pymodule_export]
    use crate::calibrate::calibrate;
    #[pymodule_export]
    use crate::drape::{Drape, Sensitivities, sensitivities, simulate};
    #[pymodule_export]
    use crate::estimate::{Estimate, estimate};
    #[pymodule_export]
    use crate::fabric::Fabric;
    #[pymodule_export]
    use crate::rim::boundary;
    use scan2params::sensor::Profile;
    use scan2params::sim::sensitivity::Parameter;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        let py = module.py();
        let profiles = pyo3::types::PyTuple::new(py, Profile::ALL.map(|profile| profile.name))?;
        module.add("PROFILES", profiles)?;
        let parameters = pyo3::types::PyTuple::new(py, Parameter::ALL.map(Parameter::name))?;
        module.add("PARAMETERS", parameters)
    }
}
