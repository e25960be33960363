//! The library's errors as exceptions of `scan2params._errors`, with the library's words.

use std::fmt::Display;

use pyo3::PyErr;
use pyo3::import_exception;
use scan2params::dataset::drape_file::DrapeFileError;
use scan2params::estimate::EstimateError;
use scan2params::intake::IntakeError;
use scan2params::io::{OutputError, ReadError, WriteError};
use scan2params::job::{CompanionFault, JobError};

use crate::messages::in_python;

import_exception!(scan2params._errors, InvalidInput);
import_exception!(scan2params._errors, FileError);
import_exception!(scan2params._errors, ScanRefused);
import_exception!(scan2params._errors, NotAtRest);
import_exception!(scan2params._errors, InternalError);

/// A scan or a rim cannot be trusted.
pub(crate) fn refused(why: impl Display) -> PyErr {
    ScanRefused::new_err(in_python(&why.to_string()))
}

/// What was given cannot be meant.
pub(crate) fn invalid(why: impl Display) -> PyErr {
    InvalidInput::new_err(in_python(&why.to_string()))
}

/// A file cannot be read or written.
pub(crate) fn file(why: impl Display) -> PyErr {
    FileError::new_err(in_python(&why.to_string()))
}

/// What ought not to happen.
pub(crate) fn internal(why: impl Display) -> PyErr {
    InternalError::new_err(format!("{why}; this is a fault of scan2params: please report it"))
}

/// Of the readers.
pub(crate) fn of_read(error: &ReadError) -> PyErr {
    file(error)
}

/// Of a drape's file.
pub(crate) fn of_drape_file(error: &DrapeFileError) -> PyErr {
    file(error)
}

/// Of a result that cannot be written, or must not be.
pub(crate) fn of_output(error: &OutputError) -> PyErr {
    if error.is_usage() { invalid(error) } else { file(error) }
}

/// Of the writers.
pub(crate) fn of_write(error: &WriteError) -> PyErr {
    file(error)
}

/// Of an input; `in_memory` is what is given as arrays, so that nothing of it is a file's fault.
pub(crate) fn of_intake(error: &IntakeError, in_memory: bool) -> PyErr {
    match error {
        IntakeError::Read(error) if in_memory => invalid(error),
        IntakeError::Read(error) => of_read(error),
        IntakeError::Refused { .. } | IntakeError::RimRefused { .. } => refused(error),
    }
}

/// Of the main job.
pub(crate) fn of_job(error: &JobError) -> PyErr {
    match error {
        JobError::Density(_) | JobError::Experiment { .. } => invalid(error),
        JobError::Intake(error) => of_intake(error, false),
        JobError::Companion { source: CompanionFault::UnknownWarp, .. } => invalid(error),
        JobError::Companion { .. } => refused(error),
        JobError::Estimate(error) => of_estimate(error),
        JobError::Write(error) => of_write(error),
    }
}

/// Of the network.
pub(crate) fn of_estimate(error: &EstimateError) -> PyErr {
    match error {
        EstimateError::Density(_) | EstimateError::NotFinite { .. } => invalid(error),
        EstimateError::Model(_) | EstimateError::Runtime(_) => internal(error),
    }
}
