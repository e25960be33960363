//! The class `Fabric`.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use scan2params::fabric::{TABLE_2, params};

use crate::errors::{file, invalid};
use crate::{pickled, words};

/// Six stiffnesses and an areal density, in SI.
///
/// They are simulation parameters: the numbers with which this simulator reproduces a drape.
///
/// Parameters
/// ----------
/// stretch_weft_n_m, stretch_warp_n_m, shear_n_m : float
///     Stretch stiffness along weft and warp, and shear stiffness, in N/m.
/// bending_weft_n_m, bending_warp_n_m, bending_bias_n_m : float
///     Bending stiffness along weft, warp and bias (45 degrees), in N m.
/// density_kg_m2 : float
///     Areal density in kg/m^2.
///
/// Raises
/// ------
/// InvalidInput
///     A number that is not positive, or a density that no textile has.
#[pyclass(frozen, module = "scan2params", skip_from_py_object)]
#[derive(Clone, Copy)]
pub(crate) struct Fabric(pub(crate) scan2params::Fabric);

#[pymethods]
impl Fabric {
    #[new]
    #[pyo3(signature = (*, stretch_weft_n_m, stretch_warp_n_m, shear_n_m, bending_weft_n_m, bending_warp_n_m, bending_bias_n_m, density_kg_m2))]
    fn new(
        stretch_weft_n_m: f64,
        stretch_warp_n_m: f64,
        shear_n_m: f64,
        bending_weft_n_m: f64,
        bending_warp_n_m: f64,
        bending_bias_n_m: f64,
        density_kg_m2: f64,
    ) -> PyResult<Self> {
        let density_kg_m2 = words::density_kg_m2(density_kg_m2)?;
        Self::checked(scan2params::Fabric {
            stretch_weft_n_m,
            stretch_warp_n_m,
            shear_n_m,
            bending_weft_nm: bending_weft_n_m,
            bending_warp_nm: bending_warp_n_m,
            bending_bias_nm: bending_bias_n_m,
            density_kg_m2,
        })
    }

    /// A fabric from numbers in the units of the paper and of ``params.json``.
    ///
    /// Parameters
    /// ----------
    /// stretch_weft, stretch_warp, shear : float
    ///     Stiffnesses in g/s^2.
    /// bending_weft, bending_warp, bending_bias : float
    ///     Bending stiffnesses in g mm^2 s^-2 rad^-1.
    /// density : float
    ///     Areal density in g/m^2.
    ///
    /// Returns
    /// -------
    /// Fabric
    #[staticmethod]
    #[pyo3(signature = (*, stretch_weft, stretch_warp, shear, bending_weft, bending_warp, bending_bias, density))]
    fn from_paper_units(
        stretch_weft: f64,
        stretch_warp: f64,
        shear: f64,
        bending_weft: f64,
        bending_warp: f64,
        bending_bias: f64,
        density: f64,
    ) -> PyResult<Self> {
        let values =
            [stretch_weft, stretch_warp, shear, bending_weft, bending_warp, bending_bias, density];
        Self::checked(scan2params::Fabric::from_paper_units(values))
    }

    /// The fabric of a ``params.json``, as ``estimate`` and the program write it.
    ///
    /// Effects that the file may have are not of the fabric: give `simulate` the path for them.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///
    /// Returns
    /// -------
    /// Fabric
    ///
    /// Raises
    /// ------
    /// FileError
    ///     The file cannot be read, lacks a number or names another unit.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        Self::checked(params::fabric(&path, [None; 7]).map_err(file)?)
    }

    /// The mean knit of the paper's Table 2.
    ///
    /// Returns
    /// -------
    /// Fabric
    #[staticmethod]
    fn mean_knit() -> Self {
        Self(scan2params::Fabric::mean_knit())
    }

    /// float: Stretch stiffness along the weft in N/m.
    #[getter]
    fn stretch_weft_n_m(&self) -> f64 {
        self.0.stretch_weft_n_m
    }

    /// float: Stretch stiffness along the warp in N/m.
    #[getter]
    fn stretch_warp_n_m(&self) -> f64 {
        self.0.stretch_warp_n_m
    }

    /// float: Shear stiffness in N/m.
    #[getter]
    fn shear_n_m(&self) -> f64 {
        self.0.shear_n_m
    }

    /// float: Bending stiffness along the weft in N m.
    #[getter]
    fn bending_weft_n_m(&self) -> f64 {
        self.0.bending_weft_nm
    }

    /// float: Bending stiffness along the warp in N m.
    #[getter]
    fn bending_warp_n_m(&self) -> f64 {
        self.0.bending_warp_nm
    }

    /// float: Bending stiffness along the bias in N m.
    #[getter]
    fn bending_bias_n_m(&self) -> f64 {
        self.0.bending_bias_nm
    }

    /// float: Areal density in kg/m^2.
    #[getter]
    fn density_kg_m2(&self) -> f64 {
        self.0.density_kg_m2
    }

    /// The seven numbers in SI, by the names of the attributes.
    ///
    /// Returns
    /// -------
    /// dict of str to float
    ///     ``Fabric(**fabric.si_units())`` is the fabric again.
    fn si_units<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (name, value) in SI_NAMES.iter().zip(self.0.in_si()) {
            dict.set_item(name, value)?;
        }
        Ok(dict)
    }

    /// The seven numbers in the units of the paper and of ``params.json``.
    ///
    /// Returns
    /// -------
    /// dict of str to float
    ///     Stretch and shear in g/s^2, bending in g mm^2 s^-2 rad^-1, density in g/m^2.
    fn paper_units<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (range, value) in TABLE_2.iter().zip(self.0.to_paper_units()) {
            dict.set_item(range.key, value)?;
        }
        Ok(dict)
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __hash__(&self) -> u64 {
        use std::hash::{DefaultHasher, Hash as _, Hasher as _};
        let mut hasher = DefaultHasher::new();
        self.0.in_si().map(f64::to_bits).hash(&mut hasher);
        hasher.finish()
    }

    fn __repr__(&self) -> String {
        self.shown()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, ([f64; 7],))> {
        Ok((pickled::restorer::<Self>(py)?, (self.0.in_si(),)))
    }

    /// The fabric that was pickled.
    #[classmethod]
    fn _restored(_class: &Bound<'_, PyType>, numbers: [f64; 7]) -> Self {
        Self(of_si(numbers))
    }
}

impl Fabric {
    /// The fabric as Python would write it.
    pub(crate) fn shown(&self) -> String {
        let numbers = SI_NAMES.iter().zip(self.0.in_si());
        let numbers: Vec<String> =
            numbers.map(|(name, value)| format!("{name}={value:.4e}")).collect();
        format!("Fabric({})", numbers.join(", "))
    }

    /// A fabric that can be simulated.
    fn checked(fabric: scan2params::Fabric) -> PyResult<Self> {
        fabric.check().map_err(invalid)?;
        Ok(Self(fabric))
    }
}

/// A fabric from its numbers in SI, paper's order.
pub(crate) fn of_si(numbers: [f64; 7]) -> scan2params::Fabric {
    let [stretch_weft_n_m, stretch_warp_n_m, shear_n_m, weft, warp, bias, density_kg_m2] = numbers;
    scan2params::Fabric {
        stretch_weft_n_m,
        stretch_warp_n_m,
        shear_n_m,
        bending_weft_nm: weft,
        bending_warp_nm: warp,
        bending_bias_nm: bias,
        density_kg_m2,
    }
}

/// The names of a fabric's numbers, paper's order.
const SI_NAMES: [&str; 7] = [
    "stretch_weft_n_m",
    "stretch_warp_n_m",
    "shear_n_m",
    "bending_weft_n_m",
    "bending_warp_n_m",
    "bending_bias_n_m",
    "density_kg_m2",
];
