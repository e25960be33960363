//! `batch`: every scan of a folder.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow};

use super::{Failure, Outcome, args};
use scan2params::base::units::KG_M2_PER_G_M2;
use scan2params::batch::{self, BatchError, BatchOptions, Progress, Row, Status, Summary};
use scan2params::job::check_experiment;

pub(crate) fn run(given: &args::Batch) -> Outcome {
    let options = BatchOptions {
        folder: given.folder.clone(),
        out: given.out.clone().map_or_else(|| default_out(&given.folder), Ok)?,
        density_csv: given.density_csv.clone(),
        density_kg_m2: given.density.map(|d| d * KG_M2_PER_G_M2),
        read: given.read.read()?,
        scan: given.read.options()?,
        resimulate: given.resimulate,
        threads: given.threads,
    };
    check_experiment(&options.scan).map_err(Failure::of_job)?;
    let of_batch = |error: BatchError| Failure::of_kind(error.kind(), error);
    if given.dry_run {
        for input in batch::inputs(&options).map_err(of_batch)? {
            let density = input.density_kg_m2.map(|d| format!("{} g/m^2", d / KG_M2_PER_G_M2));
            println!("{}: {}", input.file, input.fault.or(density).unwrap_or_default());
        }
        return Ok(());
    }
    let summary = batch::run(&options, report).map_err(of_batch)?;
    let text = if given.json {
        let lines: Result<Vec<String>, _> =
            summary.rows.iter().map(serde_json::to_string).collect();
        lines?.iter().map(|line| format!("{line}\n")).collect()
    } else {
        batch::csv(&summary.rows)
    };
    // A reader like `head` may have gone; the files are written.
    let _ = std::io::stdout().write_all(text.as_bytes());
    conclude(&summary)
}

/// `NAME-results` in the current folder: reruns from there take it up again.
fn default_out(folder: &Path) -> anyhow::Result<PathBuf> {
    let whole = std::fs::canonicalize(folder).with_context(|| folder.display().to_string())?;
    let name = whole.file_name().unwrap_or_else(|| "batch".as_ref()).to_string_lossy();
    Ok(format!("{name}-results").into())
}

fn report(progress: Progress<'_>) {
    let Progress { row, done, to_do, failed, left_s } = progress;
    let Row { file, status, seconds, .. } = row;
    eprintln!(
        "{done}/{to_do} done, {failed} failed, {} left: {file}: {} ({seconds:.1} s)",
        duration(left_s),
        status.name()
    );
}

fn conclude(summary: &Summary) -> Outcome {
    if summary.torn_bytes > 0 {
        eprintln!("the journal ended in a torn line ({} bytes), cut off", summary.torn_bytes);
    }
    if summary.unreadable_lines > 0 {
        eprintln!("warning: {} damaged lines of the journal passed over", summary.unreadable_lines);
    }
    let [table, lines] = &summary.written;
    eprintln!(
        "{} scans, {} kept from an earlier run; wrote {} and {}",
        summary.rows.len(),
        summary.kept,
        table.display(),
        lines.display()
    );
    let failed: Vec<&Row> = summary.rows.iter().filter(|row| row.status != Status::Ok).collect();
    if failed.is_empty() {
        return Ok(());
    }
    for row in &failed {
        let reason = row.reason.as_deref().unwrap_or_default();
        eprintln!("{} ({}): {reason}", row.file, row.status.name());
    }
    let (failed, all) = (failed.len(), summary.rows.len());
    Err(Failure::partial(anyhow!("{failed} of {all} scans have no estimate")))
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
