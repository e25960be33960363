//! Fabrics: the six stiffnesses and the density of one, the ranges in which
//! they are known, and the mixtures they are drawn from, and where in these one lies.

mod digest;
mod likeness;
mod mixture;
pub mod params;
mod range;
mod stiffnesses;
mod values;

pub use digest::sha256_hex;
pub use likeness::{Likeness, PartLikeness};
pub use mixture::{DEFAULT_PRIOR, MEASURED_PRIOR, Mixture, MixtureError, UNION_PRIOR};
pub use range::{
    DENSITY_LIMITS_G_M2, FabricError, Fault, PARAMETERS, ParameterRange, STIFFNESSES, TABLE_2,
    Warning, check_density,
};
pub use stiffnesses::Stiffnesses;
pub use values::Fabric;
