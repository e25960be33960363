//! A manifest's fabrics, one after another: outlines, floor, fit, prediction of the drapes held
//! out.
//!
//! In: the rows of a manifest. Out: for each fabric what was measured, what it is known by, the
//! plain fit and each drape beside its outline. A file that cannot be used is named with the
//! reason, and the rest continues.
//!
//! Of the captures of one unit (specimen and face) those that show one drape make the floor, and
//! the first of them is simulated. Silhouettes of a unit nearly always show one; rims in space tell
//! by themselves whether the specimen was dropped anew. Of a drape that was looked at again while
//! it settled, every observation is simulated, and those of the first make the floor.

mod fabric;
mod options;

pub use fabric::fabric;
pub use options::{CalibrateError, Options, Told};

use rayon::prelude::*;

use super::manifest::{Bench, Entry, Kind};
use super::measured::Measured;
use super::measures::Measures;
use super::result::FabricResult;
use super::silhouette;
use super::target::Rim;
use crate::base::boundary::Orientation;
use crate::base::units::KG_M2_PER_G_M2;
use crate::intake;
use crate::intake::rim::parse_warp_toward;
use crate::io::{ReadOptions, boundary_csv};
use crate::scan::ScanOptions;
use crate::sim::Experiment;

/// A file that was not used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refused {
    /// Line of the manifest.
    pub line: usize,
    /// The file, as it is written there.
    pub name: String,
    /// Why, with the remedy.
    pub why: String,
}

/// What was found of a manifest.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// Its fabrics, in the manifest's order.
    pub fabrics: Vec<FabricResult>,
    /// The files that were not used.
    pub refused: Vec<Refused>,
}

/// The files of a manifest, read.
#[derive(Clone, Debug)]
pub struct Files {
    /// Fabrics with their drapes, in the manifest's order.
    pub fabrics: Vec<(String, Vec<Measured>)>,
    /// The files that cannot be used.
    pub refused: Vec<Refused>,
}

/// Calibrates the fabrics of a manifest.
///
/// # Errors
/// [`CalibrateError`]; a file or a fabric that fails by itself is a part of the result.
pub fn calibrate(
    entries: &[Entry],
    options: &Options,
    tell: &(dyn Fn(Told<'_>) + Sync),
) -> Result<Calibration, CalibrateError> {
    let Files { fabrics: files, refused } = read(entries, options, tell)?;
    let mut fabrics = Vec::new();
    for together in files.chunks(together()) {
        let own = together.par_iter().cloned().map(|(name, own)| fabric(name, own, options, tell));
        fabrics.extend(own.collect::<Result<Vec<_>, _>>()?);
    }
    Ok(Calibration { fabrics, refused })
}

/// How many fabrics are fitted at a time: a fabric's drapes keep about a dozen cores busy.
#[must_use]
pub fn together() -> usize {
    rayon::current_num_threads().div_ceil(DRAPES)
}

/// Drapes that a fabric mostly has.
const DRAPES: usize = 12;

/// Reads the files of a manifest.
///
/// # Errors
/// [`CalibrateError`]; a file that cannot be used is a part of the result unless it is every one.
pub fn read(
    entries: &[Entry],
    options: &Options,
    tell: &(dyn Fn(Told<'_>) + Sync),
) -> Result<Files, CalibrateError> {
    check_densities(entries)?;
    tell(Told::Reading(entries.len()));
    let read: Vec<_> = entries.par_iter().map(|entry| measured(entry, options)).collect();
    let mut refused = Vec::new();
    let mut fabrics: Vec<(String, Vec<Measured>)> = Vec::new();
    for one in read {
        let others = fabrics.iter().flat_map(|(_, own)| own);
        match one.and_then(|measured| other_than(measured, others)) {
            Ok(measured) => {
                let name = &measured.entry.fabric;
                match fabrics.iter_mut().find(|(known, _)| known == name) {
                    Some((_, own)) => own.push(measured),
                    None => fabrics.push((name.clone(), vec![measured])),
                }
            }
            Err(why) => refused.push(why),
        }
    }
    if let (true, Some(first)) = (fabrics.is_empty(), refused.first()) {
        let (line, why) = (first.line, format!("{}: {}", first.name, first.why));
        return Err(CalibrateError::Nothing { files: entries.len(), line, why });
    }
    Ok(Files { fabrics, refused })
}

/// A file's drape, unless another file of its fabric shows the very same: a drape that counts
/// twice makes intervals too narrow.
fn other_than<'a>(
    measured: Measured,
    mut others: impl Iterator<Item = &'a Measured>,
) -> Result<Measured, Refused> {
    let is_same = |other: &&Measured| {
        other.entry.fabric == measured.entry.fabric && other.outline == measured.outline
    };
    let Some(first) = others.find(is_same) else {
        return Ok(measured);
    };
    let (line, name) = (measured.entry.line, measured.entry.name);
    let why = format!(
        "the same points as `{}` in line {}: one drape counts once; give the file of another drape",
        first.entry.name, first.entry.line
    );
    Err(Refused { line, name, why })
}

fn check_densities(entries: &[Entry]) -> Result<(), CalibrateError> {
    for (k, entry) in entries.iter().enumerate() {
        let Some(density) = entry.density_kg_m2 else { continue };
        let other = entries[..k].iter().find(|before| {
            before.fabric == entry.fabric && before.density_kg_m2.is_some_and(|d| d != density)
        });
        if let Some(before) = other {
            return Err(CalibrateError::TwoDensities {
                fabric: entry.fabric.clone(),
                line: entry.line,
                found: density / KG_M2_PER_G_M2,
                before: before.line,
                first: before.density_kg_m2.unwrap_or_default() / KG_M2_PER_G_M2,
            });
        }
    }
    Ok(())
}

/// The drape of a file.
fn measured(entry: &Entry, options: &Options) -> Result<Measured, Refused> {
    let of_file = match (entry.kind, entry.pixel_m, entry.bench) {
        (Kind::Silhouette, Some(pixel_m), Some(Bench::Cusick)) => {
            of_picture(entry, pixel_m, options)
        }
        (Kind::Silhouette, _, None) => Err("experiment is empty; write cusick if it is one".into()),
        (Kind::Silhouette, ..) => {
            Err("only silhouettes of the standard Cusick drape are fitted".into())
        }
        (Kind::Scan | Kind::Boundary, _, Some(Bench::Cusick)) => Err(
            "a rim is found on squares alone; write kind silhouette for a picture of a disc from straight above"
                .into(),
        ),
        (Kind::Scan | Kind::Boundary, ..) => of_scan(entry, options),
    };
    of_file.map_err(|why| Refused { line: entry.line, name: entry.name.clone(), why })
}

/// The outline in a picture from straight above.
fn of_picture(entry: &Entry, pixel_m: f64, options: &Options) -> Result<Measured, String> {
    let warp_rad = match &entry.warp_toward {
        Some(text) => Some(bearing(text).ok_or_else(|| {
            format!(
                "warp_toward `{text}`: write the bearing in the picture in degrees, anticlockwise from the right"
            )
        })?),
        None => None,
    };
    let picture = silhouette::read(&entry.path).map_err(|error| error.to_string())?;
    let found = silhouette::outline_of(&picture, pixel_m, &options.limits);
    let outline = found.map_err(|error| error.to_string())?.outline;
    let bench = Experiment::standard_cusick();
    let measures = Measures::of(&outline, &bench, &options.folds);
    Ok(Measured { entry: entry.clone(), outline, rim: None, bench, measures, warp_rad })
}

/// The rim of a scan, or of a boundary CSV.
fn of_scan(entry: &Entry, options: &Options) -> Result<Measured, String> {
    let is_boundary = boundary_csv::is_one(&entry.path);
    if is_boundary != (entry.kind == Kind::Boundary) && entry.path.exists() {
        let right = if is_boundary {
            "holds a rim; write kind boundary"
        } else {
            "holds no rim; write kind scan"
        };
        return Err(right.into());
    }
    let mut scan = ScanOptions::default();
    if let Some(text) = &entry.warp_toward {
        let said = |error: &dyn std::fmt::Display| {
            format!("warp_toward `{text}`: {error}, or mark:COLOUR")
        };
        match text.strip_prefix("mark:") {
            Some(colour) => scan.mark = Some(colour.parse().map_err(|error| said(&error))?),
            None => scan.warp_toward = Some(parse_warp_toward(text).map_err(|error| said(&error))?),
        }
    }
    let read = intake::rim::of_input(&entry.path, &ReadOptions::default(), &scan)
        .map_err(|error| error.to_string())?;
    if read.orientation() == Orientation::Ambiguous {
        return Err("weft and warp are not known; write in warp_toward where the warp points (+x, a bearing in degrees) or mark:COLOUR".into());
    }
    let edge = read.scanned().map(|scanned| scanned.edge_shift);
    let rim = Rim { boundary: read.boundary().clone(), sheet: read.sheet().cloned(), edge };
    let outline =
        rim.from_above().ok_or("seen from above, the rim does not go around the plate's axis")?;
    let bench = Experiment::default();
    let measures = Measures::of(&outline, &bench, &options.folds);
    Ok(Measured {
        entry: entry.clone(),
        outline,
        rim: Some(rim),
        bench,
        measures,
        warp_rad: Some(0.0),
    })
}

/// Degrees anticlockwise from the right as a bearing from +x towards +z, which a picture has
/// downwards.
fn bearing(text: &str) -> Option<f64> {
    let degrees: f64 = text.parse().ok()?;
    degrees.is_finite().then(|| -degrees.to_radians())
}

#[cfg(test)]
mod tests {
    use super::fabric::drapes_of;
    use super::*;
    use crate::calibrate::manifest::Role;
    use crate::calibrate::measures::FoldRule;
    use std::path::PathBuf;

    fn entry(line: usize, fabric: &str, density: Option<f64>) -> Entry {
        Entry {
            line,
            name: format!("{line}.png"),
            path: PathBuf::from("nowhere.png"),
            kind: Kind::Silhouette,
            fabric: fabric.to_owned(),
            specimen: None,
            face: None,
            capture: None,
            density_kg_m2: density,
            bench: Some(Bench::Cusick),
            pixel_m: Some(1e-3),
            role: Role::Fit,
            warp_toward: None,
            observation: None,
            camera_height_m: None,
        }
    }

    #[test]
    fn rims_far_apart_are_two_drops_and_an_unknown_specimen_is_one_of_its_own() {
        let rim = |off_m: f64, specimen: Option<&str>| {
            let at = |k: usize| crate::base::Boundary::flat_xz_m(k, 0.3);
            let point = |k: usize| crate::base::Point3::new(at(k)[0], off_m - 0.04, at(k)[1]);
            let boundary = crate::base::Boundary::exact((0..244).map(point)).unwrap();
            let rim = Rim { boundary, sheet: None, edge: None };
            let outline = rim.from_above().unwrap();
            let bench = Experiment::default();
            let measures = Measures::of(&outline, &bench, &FoldRule::default());
            let entry = Entry { specimen: specimen.map(str::to_owned), ..entry(1, "a", Some(0.2)) };
            Measured { entry, outline, rim: Some(rim), bench, measures, warp_rad: Some(0.0) }
        };
        let own = Some("1");
        let all = [rim(0.0, own), rim(1e-3, own), rim(6e-3, own), rim(5e-3, own), rim(0.0, None)];
        assert_eq!(drapes_of(&all), [0, 0, 2, 2, 4]);
        // silhouettes of a unit are one drape
        let flat = all.map(|measured| Measured { rim: None, ..measured });
        assert_eq!(drapes_of(&flat), [0, 0, 0, 0, 4]);
    }

    #[test]
    fn a_drape_that_two_files_show_counts_once() {
        let folder = tempfile::tempdir().unwrap();
        let rim = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/drapes/woven.boundary.csv");
        let row = |line: usize, path: PathBuf| Entry {
            path,
            kind: Kind::Boundary,
            bench: Some(Bench::Square),
            ..entry(line, "a", Some(0.18))
        };
        let copy = folder.path().join("copy.csv");
        std::fs::copy(rim, &copy).unwrap();
        let rows = [row(2, rim.into()), row(3, copy)];
        let files = super::read(&rows, &Options::default(), &|_| ()).unwrap();
        assert_eq!(files.fabrics[0].1.len(), 1);
        assert_eq!((files.refused.len(), files.refused[0].line), (1, 3));
        let why = &files.refused[0].why;
        assert!(why.contains("the same points as `2.png` in line 2"), "{why}");
    }

    #[test]
    fn two_densities_of_one_fabric_are_refused_and_an_unknown_one_is_none() {
        let rows = [entry(2, "a", Some(0.2)), entry(3, "b", Some(0.3)), entry(4, "a", None)];
        assert!(check_densities(&rows).is_ok());
        let rows = [entry(2, "a", Some(0.2)), entry(5, "a", Some(0.21))];
        let said = check_densities(&rows).unwrap_err().to_string();
        assert!(
            said.contains("line 5: fabric `a` has 210 g/m^2 here and 200 g/m^2 in line 2"),
            "{said}"
        );
    }

    #[test]
    fn a_file_that_cannot_be_used_is_refused_with_the_remedy() {
        let options = Options::default();
        let why = |change: &dyn Fn(&mut Entry)| {
            let mut row = entry(7, "a", None);
            change(&mut row);
            measured(&row, &options).unwrap_err().why
        };
        assert!(why(&|_| ()).contains("nowhere.png"));
        assert!(why(&|e| e.bench = None).contains("write cusick"));
        assert!(why(&|e| e.bench = Some(Bench::Square)).contains("standard Cusick"));
        assert!(why(&|e| e.kind = Kind::Scan).contains("silhouette"));
        assert!(
            why(&|e| (e.kind, e.bench) = (Kind::Scan, Some(Bench::Square))).contains("nowhere.png")
        );
        assert!(why(&|e| e.warp_toward = Some("up".into())).contains("in degrees"));
        let only = [entry(7, "a", None)];
        let said = calibrate(&only, &options, &|_| ()).unwrap_err().to_string();
        assert!(said.contains("none of the manifest's 1 files"), "{said}");
        // a quarter anticlockwise on the picture is up, which is -z
        assert!((bearing("90").unwrap().sin() + 1.0).abs() < 1e-12);
    }
}
