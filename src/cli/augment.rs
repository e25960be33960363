//! `augment`: a virtual scan of a drape.

use anyhow::anyhow;

use super::{Failure, Outcome, args};
use crate::report::evaluate::read_drape;
use crate::sensor::{Profile, Scene, default_ring, scan};

pub(crate) fn run(given: &args::Augment) -> Outcome {
    let profile = profile(&given.profile)?;
    let scene = Scene::modified_cusick(read_drape(&given.input)?);
    let made = scan(&scene, &default_ring(), &profile, given.seed)?;
    made.write(&given.out)?;
    eprintln!("wrote {} ({} points)", given.out.display(), made.cloud.points.len());
    Ok(())
}

/// The sensor profile of this name.
pub(super) fn profile(name: &str) -> Result<Profile, Failure> {
    Profile::named(name).ok_or_else(|| {
        Failure::usage(anyhow!(
            "no sensor profile `{name}`: give ideal, structured-light, truedepth or consumer"
        ))
    })
}
