//! Fabrics for other programs: files that simulators and material libraries read ([`export`]), and
//! numbers in the units of papers, laboratories and programs ([`units`], [`systems`]). And back:
//! [`fab`] reads what a tester measured.
//!
//! In: what a params.json says ([`Params`]), and what the target asks for beyond it ([`Options`]).
//! Out: the text of a file, what of the fabric is lost in it, and what is to be known of it. One
//! file here per target says what is converted how and from which source; bending, which several
//! targets make too stiff or dependent on the mesh, is [`hinge`]'s. [`Scene`] names an experiment
//! that goes along. `docs/export.md` has the strips and drapes with which the numbers were tried in
//! the programs themselves.
//!
//! Fails for a result that is not to be used, unless forced, for a fabric that cannot be
//! simulated, and where the target needs a number that no params.json has.

mod arcsim;
mod blender;
mod clo;
mod exported;
pub mod fab;
mod going_along;
pub mod hinge;
mod isotropic;
mod mujoco;
mod newton;
mod scene;
pub mod slider;
pub mod systems;
mod table;
mod target;
mod u3m;
pub mod units;
mod usd;

use crate::fabric::params::Params;

pub use exported::{Companion, ExchangeError, Exported, Options, companion_name};
pub use hinge::Mesh;
pub use target::{Scene, Target};

/// A fabric as a target's file. `out_stem` is the name of the file without its ending.
///
/// # Errors
/// A result that is not to be used, without `options.force`; a fabric that cannot be simulated; a
/// number that the target needs and that is not given, or cannot be; a scene for a target that has
/// none.
pub fn export(
    target: Target,
    params: &Params,
    options: &Options,
    out_stem: &str,
) -> Result<Exported, ExchangeError> {
    if params.is_not_to_be_used() && !options.force {
        let grounds = params.grounds().join("; ");
        let grounds = if grounds.is_empty() { "its file says so".to_owned() } else { grounds };
        return Err(ExchangeError::DoNotUse { grounds });
    }
    params.fabric.check()?;
    check(options)?;
    if let Some(scene) = options.scene {
        return scene::write(scene, target, params, options);
    }
    match target {
        Target::Clo => Ok(clo::write(params, options)),
        Target::Blender => blender::write(params, options),
        Target::Newton => Ok(newton::write(params, options)),
        Target::Mujoco => Ok(mujoco::write(params, options)),
        Target::Arcsim => Ok(arcsim::write(params, options)),
        Target::U3m => Ok(u3m::write(params, options, out_stem)),
        Target::Usd => Ok(usd::write(params, options)),
        Target::Json => Ok(table::json(params, options)),
        Target::Csv => Ok(table::csv(params)),
    }
}

/// Refuses given numbers that cannot be.
fn check(options: &Options) -> Result<(), ExchangeError> {
    let given = [
        ("--edge-mm", options.edge_m.map(|m| m * 1e3), [0.1, 100.0], "0.1 to 100 mm"),
        ("--thickness-mm", options.thickness_m.map(|m| m * 1e3), [1e-3, 20.0], "0.001 to 20 mm"),
        ("--friction", options.friction, [0.0, 10.0], "0 to 10"),
    ];
    for (flag, value, [low, high], limits) in given {
        if let Some(value) = value.filter(|value| !(*value >= low && *value <= high)) {
            return Err(ExchangeError::Given { flag, value, limits });
        }
    }
    Ok(())
}
