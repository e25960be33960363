//! A scan and its options, resolved.
//!
//! In: a path, an array, a [`Scan`] or a [`Boundary`], and what is known of it. Out: an [`Input`]
//! and the library's options.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use scan2params::geom::Cloud;
use scan2params::intake::{IntakeError, Rim, rim};
use scan2params::io::{ReadOptions, intrinsics};
use scan2params::scan::{Crop, LengthUnit, ScanOptions};

use crate::augment::Scan;
use crate::boundary::Boundary;
use crate::errors::{invalid, of_intake, of_read};
use crate::{arrays, words};

/// Options of a scan.
#[derive(Default)]
pub(crate) struct Known<'a, 'py> {
    pub(crate) triangles: Option<&'a Bound<'py, PyAny>>,
    pub(crate) colors: Option<&'a Bound<'py, PyAny>>,
    pub(crate) unit: Option<&'a str>,
    pub(crate) warp_toward: Option<&'a Bound<'py, PyAny>>,
    pub(crate) mark: Option<&'a str>,
    pub(crate) crop_radius_m: Option<f64>,
    pub(crate) crop_box: Option<&'a Bound<'py, PyAny>>,
    pub(crate) up: Option<&'a Bound<'py, PyAny>>,
    pub(crate) plate_near: Option<&'a Bound<'py, PyAny>>,
    pub(crate) specimen_side_m: Option<f64>,
    pub(crate) plate_radius_m: Option<f64>,
    pub(crate) seed: Option<u64>,
    pub(crate) intrinsics: Option<PathBuf>,
    pub(crate) depth_scale: Option<f64>,
    pub(crate) name: Option<PathBuf>,
}

/// Something that a rim is found in, or that has one.
pub(crate) enum Input {
    /// A file.
    File(PathBuf),
    /// A cloud or a mesh with its name.
    Memory(PathBuf, Cloud),
    /// A rim that is there, with its name and the file that it was found in, if it was in one.
    Rim(PathBuf, Box<Rim>, Option<PathBuf>),
}

/// An input with the options that go with it.
pub(crate) struct Given {
    pub(crate) input: Input,
    pub(crate) read: ReadOptions,
    pub(crate) scan: ScanOptions,
}

impl Known<'_, '_> {
    /// An input with its options.
    ///
    /// # Errors
    /// `InvalidInput`.
    pub(crate) fn of(&self, scan: &Bound<'_, PyAny>) -> PyResult<Given> {
        if let Ok(boundary) = scan.cast::<Boundary>() {
            self.check_unused()?;
            let boundary = boundary.get();
            let file = boundary.file().map(Path::to_owned);
            let rim = Box::new(boundary.rim().clone());
            let input = Input::Rim(boundary.path().to_owned(), rim, file);
            let (read, scan) = (ReadOptions::default(), boundary.options().clone());
            return Ok(Given { input, read, scan });
        }
        let options = self.options()?;
        let in_metres = || Some(LengthUnit::Metre);
        let guessed = self.unit == Some(words::GUESS);
        if let Ok(scanned) = scan.cast::<Scan>() {
            self.check_no_arrays("a Scan has its own")?;
            let name = self.name.clone().unwrap_or_else(|| "scan".into());
            let unit = if guessed { None } else { options.unit.or_else(in_metres) };
            let input = Input::Memory(name, scanned.get().cloud().clone());
            return Ok(Given { input, read: self.read()?, scan: ScanOptions { unit, ..options } });
        }
        if let Ok(path) = scan.extract::<PathBuf>() {
            self.check_no_arrays("a file has its own")?;
            return Ok(Given { input: Input::File(path), read: self.read()?, scan: options });
        }
        let name = self.name.clone().unwrap_or_else(|| "cloud".into());
        let unit = if guessed { None } else { options.unit.or_else(in_metres) };
        let input = Input::Memory(name, self.cloud(scan)?);
        Ok(Given { input, read: self.read()?, scan: ScanOptions { unit, ..options } })
    }

    /// The same of other scans: arrays and names are the first one's own.
    pub(crate) fn of_others(self) -> Self {
        Self { triangles: None, colors: None, name: None, ..self }
    }

    /// One of several scans. A Boundary has its own options; those given here are not for it.
    ///
    /// # Errors
    /// `InvalidInput`.
    pub(crate) fn of_numbered(&self, scan: &Bound<'_, PyAny>, number: usize) -> PyResult<Given> {
        if scan.cast::<Boundary>().is_ok() {
            return Known::default().of(scan);
        }
        let mut given = self.of(scan)?;
        if let Input::Memory(name, _) = &mut given.input {
            *name = format!("{} {number}", name.display()).into();
        }
        Ok(given)
    }

    /// The cloud of some points.
    fn cloud(&self, points: &Bound<'_, PyAny>) -> PyResult<Cloud> {
        let points = arrays::points("scan", points)?;
        let colors = self.colors.map(|given| arrays::colors("colors", given)).transpose()?;
        let triangles =
            self.triangles.map(|given| arrays::triangles("triangles", given)).transpose()?;
        Ok(Cloud {
            points,
            colors: colors.unwrap_or_default(),
            triangles: triangles.unwrap_or_default(),
        })
    }

    /// That no option is given that is known already.
    fn check_unused(&self) -> PyResult<()> {
        let given = [
            ("triangles", self.triangles.is_some()),
            ("colors", self.colors.is_some()),
            ("unit", self.unit.is_some()),
            ("warp_toward", self.warp_toward.is_some()),
            ("mark", self.mark.is_some()),
            ("crop_radius_m", self.crop_radius_m.is_some()),
            ("crop_box", self.crop_box.is_some()),
            ("up", self.up.is_some()),
            ("plate_near", self.plate_near.is_some()),
            ("specimen_side_m", self.specimen_side_m.is_some()),
            ("plate_radius_m", self.plate_radius_m.is_some()),
            ("seed", self.seed.is_some()),
            ("intrinsics", self.intrinsics.is_some()),
            ("depth_scale", self.depth_scale.is_some()),
            ("name", self.name.is_some()),
        ];
        match given.into_iter().find(|(_, given)| *given) {
            Some((key, _)) => Err(invalid(format!(
                "{key}: a Boundary was found with its own; give it to boundary()"
            ))),
            None => Ok(()),
        }
    }

    /// That no arrays go with what has its own.
    fn check_no_arrays(&self, why: &str) -> PyResult<()> {
        match (self.triangles, self.colors) {
            (None, None) => Ok(()),
            (Some(_), _) => Err(invalid(format!("triangles: {why}"))),
            (_, Some(_)) => Err(invalid(format!("colors: {why}"))),
        }
    }

    /// How depth images are read.
    fn read(&self) -> PyResult<ReadOptions> {
        let intrinsics =
            self.intrinsics.as_ref().map(intrinsics::read).transpose().map_err(|e| of_read(&e))?;
        let mut options = ReadOptions { intrinsics, ..ReadOptions::default() };
        if let Some(scale) = self.depth_scale {
            if !(scale.is_finite() && scale > 0.0) {
                return Err(invalid(format!("depth_scale: {scale}; give a positive number")));
            }
            options.depth_scale = scale;
        }
        Ok(options)
    }

    /// How the scan is taken.
    pub(crate) fn options(&self) -> PyResult<ScanOptions> {
        let default = ScanOptions::default();
        let side_m = self.specimen_side_m.unwrap_or(default.specimen_side_m);
        let radius_m = self.plate_radius_m.unwrap_or(default.plate_radius_m);
        let experiment = ScanOptions::for_experiment(side_m, radius_m).map_err(invalid)?;
        if self.warp_toward.is_some() && self.mark.is_some() {
            return Err(invalid("warp_toward, mark: both say where the warp points; give one"));
        }
        let crop = match (self.crop_radius_m, self.crop_box) {
            (None, None) => None,
            (Some(radius_m), None) => Some(Crop::Radius { radius_mm: radius_m * 1e3 }),
            (None, Some(corners)) => Some(words::crop_box(corners)?),
            (Some(_), Some(_)) => {
                return Err(invalid("crop_radius_m, crop_box: both crop the scan; give one"));
            }
        };
        let options = ScanOptions {
            unit: self.unit.map(words::unit).transpose()?.flatten(),
            warp_toward: self.warp_toward.map(words::warp_toward).transpose()?,
            mark: self.mark.map(words::mark).transpose()?,
            crop,
            up: self.up.map(words::up).transpose()?,
            plate_near: self.plate_near.map(words::plate_near).transpose()?,
            seed: self.seed.unwrap_or(default.seed),
            ..experiment
        };
        options.check_hints().map_err(invalid)?;
        Ok(options)
    }
}

impl Given {
    /// The name of the input in messages and results.
    pub(crate) fn name(&self) -> PathBuf {
        match &self.input {
            Input::File(name) | Input::Memory(name, _) | Input::Rim(name, ..) => name.clone(),
        }
    }

    /// The file that it was read from, if it was.
    pub(crate) fn file(&self) -> Option<PathBuf> {
        match &self.input {
            Input::File(path) => Some(path.clone()),
            Input::Memory(..) => None,
            Input::Rim(_, _, file) => file.clone(),
        }
    }

    /// Whether it is in memory.
    pub(crate) fn in_memory(&self) -> bool {
        !matches!(self.input, Input::File(_))
    }

    /// The rim of the input.
    ///
    /// # Errors
    /// What cannot be read, and what is refused.
    pub(crate) fn rim(self) -> Result<Rim, IntakeError> {
        match self.input {
            Input::File(path) => rim::of_input(&path, &self.read, &self.scan),
            Input::Memory(name, cloud) => rim::of_cloud(&name, cloud, &self.scan),
            Input::Rim(_, rim, _) => Ok(*rim),
        }
    }
}

/// The rim of an input that is in memory, or the exception.
pub(crate) fn intake_error(in_memory: bool) -> impl Fn(IntakeError) -> PyErr {
    move |error| of_intake(&error, in_memory)
}
