//! Fabrics: the six stiffnesses and the density of one, the ranges in which
//! they are known, and the mixtures they are drawn from.

mod digest;
mod mixture;
pub mod params;
mod range;
mod values;

pub use digest::sha256_hex;
pub use mixture::{DEFAULT_PRIOR, MEASURED_PRIOR, Mixture, MixtureError, UNION_PRIOR};
pub use range::{
    DENSITY_LIMITS_G_M2, FabricError, Fault, PARAMETERS, ParameterRange, STIFFNESSES, TABLE_2,
    Warning, check_density,
};
pub use values::Fabric;
