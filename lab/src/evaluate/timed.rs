//! Timed drapes of a prior's fabrics, for `scan2params-lab dataset` and `scan2params-lab speed`.
//!
//! In: a prior's seed and index. Out: the drape with its processor time.

use scan2params::base::clock::thread_cpu_s;
use scan2params::fabric::{Fabric, Mixture, MixtureError};
use scan2params::sim::{Drape, Drop, DropStart, SimOptions, drape};

/// One timed drape.
#[derive(Clone, Debug)]
pub struct TimedDrape {
    /// The fabric.
    pub fabric: Fabric,
    /// Its drape.
    pub drape: Drape,
    /// Processor time \[s\]; `None` where the system does not tell it.
    pub cpu_s: Option<f64>,
}

/// Drapes fabric `index` of the prior `knit-2020` with a perturbed drop.
///
/// # Errors
/// When the prior gives no fabric inside its range.
pub fn timed_drape(
    run_seed: u64,
    index: u64,
    options: &SimOptions,
) -> Result<TimedDrape, MixtureError> {
    let fabric = Mixture::knit_2020().sample(run_seed, index)?;
    let before = thread_cpu_s();
    let drape = drape(&fabric, &Drop { start: DropStart::Perturbed(run_seed ^ index) }, options);
    let cpu_s = before.zip(thread_cpu_s()).map(|(before, after)| after - before);
    Ok(TimedDrape { fabric, drape, cpu_s })
}
