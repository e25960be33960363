//! `batch`: every scan of a folder.

use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow};

use super::{Failure, Outcome, args};
use scan2params::base::units::KG_M2_PER_G_M2;
use scan2params::batch::{self, BatchError, BatchOptions, Progress, Row, Share, Status, Summary};
use scan2params::job::check_experiment;
use scan2params::job::verdict::Level;

pub(crate) fn run(given: &args::Batch) -> Outcome {
    let of_batch = |error: BatchError| Failure::of_kind(error.kind(), error);
    batch::check_folder(&given.folder).map_err(of_batch)?;
    let options = BatchOptions {
        folder: given.folder.clone(),
        share: match given.shard {
            Some(shard) => Share::Shard(shard),
            None if given.merge => Share::Merge,
            None => Share::All,
        },
        out: given.out.clone().map_or_else(|| default_out(&given.folder), Ok)?,
        density_csv: given.density_csv.clone(),
        density_kg_m2: given.density.map(|d| d * KG_M2_PER_G_M2),
        read: given.read.read()?,
        scan: given.read.options()?,
        refine: !given.quick,
        release: given.release,
        strict: given.strict,
        threads: given.threads.threads,
        pages: !given.no_report,
    };
    check_experiment(&options.scan).map_err(Failure::of_job)?;
    if given.dry_run {
        let inputs = batch::inputs(&options).map_err(of_batch)?;
        for input in &inputs.scans {
            let density = input.density_kg_m2.map(|d| format!("{} g/m^2", d / KG_M2_PER_G_M2));
            println!("{}: {}", input.file, input.fault.clone().or(density).unwrap_or_default());
        }
        tell_passed_over(&inputs.passed_over);
        return Ok(());
    }
    let summary = batch::run(&options, report).map_err(of_batch)?;
    let text = if given.json {
        let lines: Result<Vec<String>, _> =
            summary.rows.iter().map(serde_json::to_string).collect();
        lines?.iter().map(|line| format!("{line}\n")).collect()
    } else if std::io::stdout().is_terminal() {
        batch::overview(&summary.rows)
    } else {
        batch::csv(&summary.rows)
    };
    print!("{text}");
    conclude(&summary)
}

/// `NAME-results` in the current folder: a rerun from there continues it.
fn default_out(folder: &Path) -> anyhow::Result<PathBuf> {
    let whole = std::fs::canonicalize(folder).with_context(|| folder.display().to_string())?;
    let name = whole.file_name().unwrap_or_else(|| "batch".as_ref()).to_string_lossy();
    Ok(format!("{name}-results").into())
}

fn report(progress: Progress<'_>) {
    let Progress { row, done, to_do, failed, left_s } = progress;
    let Row { file, status, seconds, .. } = row;
    let verdict = row.verdict().map(|level| format!(", {level}")).unwrap_or_default();
    eprintln!(
        "{done}/{to_do} done, {failed} failed, {} left: {file}: {}{verdict} ({seconds:.1} s)",
        duration(left_s),
        status.name()
    );
}

fn conclude(summary: &Summary) -> Outcome {
    if summary.torn_bytes > 0 {
        eprintln!("the journal ended in a torn line ({} bytes), cut off", summary.torn_bytes);
    }
    if summary.unreadable_lines > 0 {
        warning!("warning: {} damaged lines of the journal passed over", summary.unreadable_lines);
    }
    tell_passed_over(&summary.passed_over);
    eprintln!("{} scans, {} kept from an earlier run", summary.rows.len(), summary.kept);
    for path in summary.written.iter().chain(&summary.page) {
        eprintln!("wrote {}", path.display());
    }
    let levels = Level::ALL.map(|level| {
        let count = summary.rows.iter().filter(|row| row.verdict() == Some(level.name())).count();
        format!("{count} {}", level.words())
    });
    let others = summary.rows.iter().filter(|row| row.not_the_experiment()).count();
    eprintln!("verdicts: {} ({others} not the experiment)", levels.join(", "));
    let unknown = summary.rows.iter().filter(|row| row.is_warp_unknown()).count();
    if unknown > 0 {
        warning!(
            "warning: weft and warp unknown in {unknown} of {} estimated scans, whose intervals cover both readings; \
             give --warp-toward, --mark, or the column warp_toward of --density-csv",
            summary.rows.iter().filter(|row| row.result.is_some()).count()
        );
    }
    for file in &summary.lost {
        warning!(
            "warning: {file}: its results were removed from the folder; the same command makes them again"
        );
    }
    let failed: Vec<&Row> = summary.rows.iter().filter(|row| row.exit_code != 0).collect();
    if failed.is_empty() && summary.lost.is_empty() {
        return Ok(());
    }
    for row in &failed {
        match (&row.reason, row.verdict()) {
            (Some(reason), _) => {
                warning!("warning: {} ({}): {reason}", row.file, row.status.name())
            }
            (None, level) => {
                let level = level.unwrap_or_default();
                warning!("warning: {} ({level}): {}", row.file, row.grounds().join(", "));
            }
        }
    }
    for path in &summary.pictures {
        eprintln!("wrote {}: what was found in the scan", path.display());
    }
    let (without, all) =
        (failed.iter().filter(|row| row.status != Status::Ok).count(), summary.rows.len());
    let mut said = format!("{without} of {all} scans have no estimate");
    if without < failed.len() {
        said += &format!(", {} one that is not to be used", failed.len() - without);
    }
    if !summary.lost.is_empty() {
        said += &format!(", {} have lost their results", summary.lost.len());
    }
    Err(Failure::partial(anyhow!(said)))
}

/// Names the files that were passed over, so that nobody takes them for estimated.
fn tell_passed_over(files: &[String]) {
    const NAMED: usize = 3;
    let more = match files.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let named = &files[..files.len().min(NAMED)];
    if !named.is_empty() {
        warning!(
            "note: passed over, since their names do not end as those of scans: {}{more}; depth images and .txt are \
             read if --density-csv names them",
            named.join(", ")
        );
    }
}

/// Seconds as a person reads them.
fn duration(seconds: f64) -> String {
    let seconds = seconds.round() as u64;
    match (seconds / 3600, seconds / 60 % 60, seconds % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m} min {s:02} s"),
        (h, m, _) => format!("{h} h {m:02} min"),
    }
}

#[cfg(test)]
mod tests {
    use super::duration;

    #[test]
    fn durations_for_people() {
        assert_eq!(duration(59.4), "59 s");
        assert_eq!(duration(61.0), "1 min 01 s");
        assert_eq!(duration(7265.0), "2 h 01 min");
    }
}
