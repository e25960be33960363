//! Flags whose values are names: their parsers, which also list the names in `--help`, in errors
//! and in a shell's completion.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use crate::exchange::{Scene, Target};
use crate::fabric::{DEFAULT_PRIOR, MEASURED_PRIOR, UNION_PRIOR};
use crate::io::{DepthSource, Format};
use crate::scan::LengthUnit;
use crate::sensor::{Profile, StandKind, Surroundings};

/// One of some names, as what it stands for.
fn one_of<T: Clone + Send + Sync + 'static>(
    names: impl IntoIterator<Item = impl Into<PossibleValue>>,
    named: fn(&str) -> Option<T>,
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(names).try_map(move |name| named(&name).ok_or("an unknown name"))
}

/// A target of `export`, in any letter case.
pub fn target() -> impl TypedValueParser<Value = Target> {
    let names = Target::ALL.map(|target| PossibleValue::new(target.name()).help(target.title()));
    one_of(names, |name| {
        Target::ALL.into_iter().find(|target| target.name().eq_ignore_ascii_case(name))
    })
}

/// An experiment that `export` writes.
pub fn scene() -> impl TypedValueParser<Value = Scene> {
    let names = Scene::ALL.map(|scene| PossibleValue::new(scene.name()).help(scene.title()));
    one_of(names, |name| Scene::ALL.into_iter().find(|scene| scene.name() == name))
}

/// A shipped prior, by its name.
pub fn prior() -> PossibleValuesParser {
    PossibleValuesParser::new([DEFAULT_PRIOR, MEASURED_PRIOR, UNION_PRIOR])
}

/// A sensor of the virtual camera.
pub fn profile() -> impl TypedValueParser<Value = Profile> {
    one_of(Profile::ALL.map(|profile| profile.name), Profile::named)
}

/// What carries the plate of a virtual scan.
pub fn stand() -> impl TypedValueParser<Value = StandKind> {
    one_of(StandKind::ALL.map(StandKind::name), StandKind::named)
}

/// What is around the drape of a virtual scan.
pub fn surroundings() -> impl TypedValueParser<Value = Surroundings> {
    one_of(Surroundings::ALL.map(Surroundings::name), Surroundings::named)
}

/// A format that bytes can be in: a set of views is files.
pub fn format() -> impl TypedValueParser<Value = Format> {
    const NAMES: [&str; 10] =
        ["ply", "obj", "pcd", "stl", "glb", "e57", "las", "laz", "xyz", "png"];
    one_of(NAMES, Format::named)
}

/// A source of depth images.
pub fn depth_source() -> impl TypedValueParser<Value = DepthSource> {
    one_of(DepthSource::ALL.map(|source| source.name), DepthSource::named)
}

/// A unit of length.
pub fn unit() -> impl TypedValueParser<Value = LengthUnit> {
    one_of(LengthUnit::ALL.map(LengthUnit::name), LengthUnit::named)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every name that is listed is one that is taken: `one_of` would refuse it otherwise.
    #[test]
    fn every_listed_name_is_taken() {
        fn check<T: Clone + Send + Sync + 'static>(parser: impl TypedValueParser<Value = T>) {
            let command = clap::Command::new("s");
            let names: Vec<_> = parser.possible_values().unwrap().collect();
            assert!(names.len() > 1);
            for name in names {
                assert!(parser.parse_ref(&command, None, name.get_name().as_ref()).is_ok());
            }
        }
        check(target());
        check(prior());
        check(profile());
        check(stand());
        check(surroundings());
        check(format());
        check(depth_source());
        check(unit());
        check(scene());
    }
}
