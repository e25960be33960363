//! One sample of a dataset: a fabric's drop, simulated, or a sheet led there from
//! the sample before.

use super::row::{Ending, Sample, Simulated, SimulatedRow};
use crate::sim::follow::{FollowOptions, Follower};
use crate::sim::{Drape, Drop, SimOptions, drape};

/// The options under which drapes are made that all fall: the default's, but the descent ends
/// when a cycle lowers the energy by less than 1e-4 of itself. How far such rims
/// are from full rest is in `docs/validation/network.md`.
#[must_use]
pub fn dataset_options() -> SimOptions {
    SimOptions { energy_drop: 1e-4, ..SimOptions::default() }
}

/// The options under which walks are made: the descent ends when a cycle lowers the energy by less
/// than 1e-5 of itself, 1.4 mm from full rest in the median for the softest knits and zero for
/// stiff cloth. A continued sheet has little energy to lose on its way, so that a walk with the
/// falls' 1e-4 would lag behind its fabrics by millimetres.
#[must_use]
pub fn walk_options() -> SimOptions {
    SimOptions { energy_drop: 1e-5, ..SimOptions::default() }
}

/// Longest step of a walk: the root mean square of the changes of the fabric's seven logarithms.
/// Twice that of a continuation that looks for events, since a sheet that leaves its branch is a
/// drape like any other here.
const LONGEST_STEP: f64 = 0.5;

/// Simulates a sample that falls: canonically, or in a drop drawn from the run's seed and the
/// index. No sheet is continued from it.
#[must_use]
pub fn simulate<S>(sample: &Sample, options: &SimOptions) -> Simulated<S> {
    let drape = drape(&sample.fabric, &drop_of(sample), options);
    Simulated { row: row(&drape, false), sheet: drape.mesh(), next: None }
}

/// Simulates a sample of a walk, with the sheet that the next one continues. A sheet falls where
/// there is none to continue, and where the one there is does not come to rest on its way.
#[must_use]
pub fn walk(sample: &Sample, sheet: Option<Follower>, options: &SimOptions) -> Simulated<Follower> {
    let led = sheet.and_then(|sheet| led(sheet, sample));
    let walked = led.is_some();
    let sheet = led.unwrap_or_else(|| Follower::drop(&sample.fabric, &drop_of(sample), options));
    let drape = sheet.drape();
    let row = row(&drape, walked);
    let next = row.ending.is_converged().then_some(sheet);
    Simulated { row, sheet: drape.mesh(), next }
}

/// The sheet at rest with the sample's fabric.
fn led(mut sheet: Follower, sample: &Sample) -> Option<Follower> {
    let how = FollowOptions { longest_step: LONGEST_STEP, ..FollowOptions::default() };
    let followed = sheet.follow_fabric(&sample.fabric, &how).ok()?;
    (followed.reached == 1.0 && followed.stop.is_as_asked()).then_some(sheet)
}

fn drop_of(sample: &Sample) -> Drop {
    sample.fall.drop(sample.run_seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ sample.index)
}

fn row(drape: &Drape, walked: bool) -> SimulatedRow {
    SimulatedRow {
        ending: Ending::of(drape),
        node_count: drape.nodes as u32,
        energy_j: drape.energy_j,
        residual_n: drape.residual_n,
        boundary: drape.boundary.clone(),
        walked,
    }
}
