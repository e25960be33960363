//! A manifest's fabrics, one after another, each kept as it is done.
//!
//! In: the rows of a manifest, options, a folder of results. Out: in the folder `calibration.json`,
//! and for each fabric what [`calibration::write`] writes; the sections, in the manifest's order.
//!
//! A finished fabric is a file below [`KEPT`], written last, so that a run can be killed at any
//! time. The next run keeps a fabric if its rows, the bytes of its files, the options, the program,
//! the simulator and the calibration are those that it was made with, and its files are there. Kept
//! files of fabrics that are no longer in the manifest are removed.
//!
//! One run at a time fills a folder of results; another is told who does.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::sha256_of;
use crate::calibrate;
use crate::calibrate::manifest::Entry;
use crate::calibrate::measured::Measured;
use crate::calibrate::run::{
    CalibrateError, Files, Options, Refused, Told, fabric, read, together,
};
use crate::fabric::sha256_hex;
use crate::io::{self, Lock, LockError, ReadError, WriteError};
use crate::report::calibration::{self, write_json};
use crate::report::section::Section;
use crate::sim::NUMERICS_VERSION;

/// Folder of the fabrics that are done, in that of the results.
pub const KEPT: &str = "kept";

/// What a run did.
#[derive(Clone, Debug)]
pub struct Calibrated {
    /// The fabrics, in the manifest's order.
    pub sections: Vec<Section>,
    /// The files that were not used.
    pub refused: Vec<Refused>,
    /// How many of the fabrics were kept from an earlier run.
    pub kept: usize,
    /// The files in the folder of results.
    pub written: Vec<PathBuf>,
}

/// Why a manifest is not calibrated.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationsError {
    /// It cannot be.
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
    /// Another run fills the folder.
    #[error(transparent)]
    Lock(#[from] LockError),
    /// A file that was read before cannot be read again.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A result cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Calibrates the fabrics of a manifest into `folder`, which is made if it is not there.
///
/// # Errors
/// [`CalibrationsError`]; a file or a fabric that fails by itself is a part of the result.
pub fn run(
    entries: &[Entry],
    options: &Options,
    folder: &Path,
    tell: &(dyn Fn(Told<'_>) + Sync),
) -> Result<Calibrated, CalibrationsError> {
    // a folder of a manifest that cannot be calibrated is not made
    let Files { fabrics, refused } = read(entries, options, tell)?;
    let kept_in = folder.join(KEPT);
    let made = std::fs::create_dir_all(&kept_in);
    made.map_err(|source| WriteError { path: kept_in.clone(), source })?;
    let _lock = Lock::take(folder.join("calibrate.lock"))?;
    let work = Work { options, folder, kept_in: &kept_in };
    let mut sections = Vec::new();
    let mut kept = 0;
    for together in fabrics.chunks(together()) {
        let own = together.par_iter().map(|(name, own)| work.section(name, own, tell));
        for section in own.collect::<Result<Vec<_>, _>>()? {
            kept += usize::from(section.1);
            sections.push(section.0);
        }
    }
    work.remove_others(&fabrics);
    let json = write_json(&sections, &refused, folder)?;
    let files = sections.iter().flat_map(|section| &section.files).map(|name| folder.join(name));
    let written = std::iter::once(json).chain(files).collect();
    Ok(Calibrated { sections, refused, kept, written })
}

/// What all fabrics of a run share.
struct Work<'a> {
    options: &'a Options,
    folder: &'a Path,
    kept_in: &'a Path,
}

impl Work<'_> {
    /// The section of a fabric, and whether it was kept.
    fn section(
        &self,
        name: &str,
        measured: &[Measured],
        tell: &(dyn Fn(Told<'_>) + Sync),
    ) -> Result<(Section, bool), CalibrationsError> {
        let path = self.kept_at(name);
        let made_with = self.made_with(measured)?;
        if let Some(section) = self.kept(&path, &made_with) {
            return Ok((section, true));
        }
        let found = fabric(name.to_owned(), measured.to_vec(), self.options, tell)?;
        let section = calibration::write(&found, self.folder)?;
        let kept = serde_json::json!({ "made_with": made_with, "section": section });
        io::atomically(&path, |out| {
            serde_json::to_writer(&mut *out, &kept)?;
            writeln!(out)
        })?;
        Ok((section, false))
    }

    /// Where a fabric is kept: names of fabrics are any text.
    fn kept_at(&self, name: &str) -> PathBuf {
        self.kept_in.join(format!("{}.json", &sha256_hex(name.as_bytes())[..16]))
    }

    /// SHA-256 over all that a fabric's section depends on.
    fn made_with(&self, measured: &[Measured]) -> Result<String, ReadError> {
        let file = |m: &Measured| sha256_of(&m.entry.path);
        let files: Vec<String> = measured.par_iter().map(file).collect::<Result<_, _>>()?;
        let rows: Vec<String> = measured
            .iter()
            .map(|m| format!("{:?}", Entry { path: PathBuf::new(), ..m.entry.clone() }))
            .collect();
        let all = serde_json::json!({
            "program": env!("CARGO_PKG_VERSION"),
            "numerics": NUMERICS_VERSION,
            "calibration": calibrate::VERSION,
            "options": format!("{:?}", self.options),
            "rows": rows,
            "files": files,
        });
        Ok(sha256_hex(all.to_string().as_bytes()))
    }

    /// A fabric of an earlier run, if it is what this run would make; a file that is none is as
    /// good as none.
    fn kept(&self, path: &Path, made_with: &str) -> Option<Section> {
        let text = std::fs::read(path).ok()?;
        let mut kept: serde_json::Value = serde_json::from_slice(&text).ok()?;
        let own = kept.get("made_with")?.as_str()? == made_with;
        let section: Section = serde_json::from_value(kept.get_mut("section")?.take()).ok()?;
        let there = section.files.iter().all(|name| self.folder.join(name).is_file());
        (own && there).then_some(section)
    }

    fn remove_others(&self, fabrics: &[(String, Vec<Measured>)]) {
        let own: Vec<PathBuf> = fabrics.iter().map(|(name, _)| self.kept_at(name)).collect();
        let Ok(all) = std::fs::read_dir(self.kept_in) else { return };
        for path in all.flatten().map(|entry| entry.path()).filter(|path| !own.contains(path)) {
            // what stays is a file too many, and no fault of the results
            let _ = std::fs::remove_file(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::M_PER_MM;
    use crate::calibrate::effect::EFFECTS;
    use crate::calibrate::manifest;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// A manifest of two fabrics, a drawn ring of 26 waves each, which no cloth of the prior has;
    /// half of a small plate.
    fn manifest_in(folder: &Path, second_m: f64) -> Vec<Entry> {
        let mut text = "file,kind,fabric,specimen,face,experiment,mm_per_pixel,role\n".to_owned();
        for (name, mean_m) in [("one", 0.125), ("two", second_m)] {
            let picture = image::GrayImage::from_fn(256, 256, |x, y| {
                let [dx, dy] = [x, y].map(|v| (f64::from(v) - 127.5) * 1.39 * M_PER_MM);
                let edge_m = mean_m + 6e-3 * (7.0 * dy.atan2(dx)).cos();
                image::Luma([if dx.hypot(dy) < edge_m { 255 } else { 0 }])
            });
            picture.save(folder.join(format!("{name}.png"))).unwrap();
            text += &format!("{name}.png,silhouette,{name},1,up,cusick,1.39,fit\n");
        }
        std::fs::write(folder.join("m.csv"), text).unwrap();
        manifest::read(folder.join("m.csv")).unwrap()
    }

    #[test]
    fn a_fabric_that_is_done_is_kept_until_its_picture_changes_or_its_files_go() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let mut options = Options::default();
        (options.fit.sim.vertices, options.fit.sim.fall_vertices) = (11, 11);
        options.fit.evaluations = 2;
        // what is looked for says nothing of what is kept
        options.without = EFFECTS.iter().collect();
        let run_of = |entries: &[Entry]| {
            let fits = AtomicUsize::new(0);
            let tell = |told: Told<'_>| {
                fits.fetch_add(usize::from(matches!(told, Told::Floor(_))), Ordering::Relaxed);
            };
            let found = run(entries, &options, &out, &tell).unwrap();
            assert_eq!(found.kept + fits.into_inner(), 2);
            found
        };
        let entries = manifest_in(folder.path(), 0.125);
        let first = run_of(&entries);
        assert!(first.kept == 0 && first.refused.is_empty());
        assert!(
            first.sections.iter().all(|section| section.fitted),
            "{:?}",
            first.sections[0].table
        );
        let whole = std::fs::read(out.join("calibration.json")).unwrap();
        std::fs::remove_file(out.join("calibration.json")).unwrap();
        let again = run_of(&entries);
        assert_eq!((again.kept, &again.sections), (2, &first.sections));
        assert_eq!(std::fs::read(out.join("calibration.json")).unwrap(), whole);
        // another picture of the second
        let changed = run_of(&manifest_in(folder.path(), 0.124));
        assert_eq!((changed.kept, &changed.sections[0]), (1, &first.sections[0]));
        assert_ne!(changed.sections[1], first.sections[1]);
        // a torn file, and one that is gone
        let work = Work { options: &options, folder: &out, kept_in: &out.join(KEPT) };
        let Files { fabrics, .. } =
            read(&manifest_in(folder.path(), 0.124), &options, &|_| ()).unwrap();
        let is_kept = |(name, measured): &(String, Vec<Measured>)| {
            work.kept(&work.kept_at(name), &work.made_with(measured).unwrap()).is_some()
        };
        assert!(fabrics.len() == 2 && fabrics.iter().all(is_kept));
        std::fs::write(work.kept_at("one"), "{").unwrap();
        std::fs::remove_file(out.join(&changed.sections[1].files[0])).unwrap();
        assert!(!fabrics.iter().any(is_kept));
    }
}
