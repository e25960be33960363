//! A sensor profile that a flag names.

use anyhow::anyhow;

use super::Failure;
use scan2params::sensor::Profile;

/// The sensor profile of this name.
pub(super) fn profile(name: &str) -> Result<Profile, Failure> {
    Profile::named(name).ok_or_else(|| {
        let names = Profile::ALL.map(|profile| profile.name).join(", ");
        Failure::usage(anyhow!("no sensor profile `{name}`: give one of {names}"))
    })
}
