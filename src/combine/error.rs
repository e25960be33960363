//! Why drapes cannot be combined, with the files and the remedy.

use std::path::PathBuf;

use super::drape::LeftOut;

/// Largest over smallest density that are taken for one fabric's: specimens of one cloth differ by
/// a per cent or two. Chosen.
pub const DENSITY_RATIO: f64 = 1.05;

/// Why drapes cannot be combined.
#[derive(Debug, thiserror::Error)]
pub enum CombineError {
    /// The system refuses.
    #[error("{}: {source}; check the path and its permissions", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A folder without results.
    #[error("{}: no *.params.json in it; give a folder that `estimate --out` or `batch` wrote", folder.display())]
    NoParams {
        /// The folder.
        folder: PathBuf,
    },
    /// A file that is not what `estimate` writes.
    #[error("{}: {what}; give params.json files as `estimate --out` and `batch` write them", path.display())]
    NotParams {
        /// The file.
        path: PathBuf,
        /// What it lacks.
        what: String,
    },
    /// Drapes of fabrics of different weight.
    #[error(
        "{} has {} g/m^2 and {} has {}: more than {:.0} % apart, so not drapes of one fabric; give those of one fabric",
        lightest.display(), densities[0], heaviest.display(), densities[1], 100.0 * (DENSITY_RATIO - 1.0)
    )]
    Densities {
        /// The file of the least density.
        lightest: PathBuf,
        /// The file of the largest.
        heaviest: PathBuf,
        /// Both \[g/m^2\].
        densities: [f64; 2],
    },
    /// Results of different programs.
    #[error(
        "{} and {} were made with different {what} ({} and {}): estimate both with one version",
        one.display(), other.display(), values[0], values[1]
    )]
    Versions {
        /// A file.
        one: PathBuf,
        /// One that differs.
        other: PathBuf,
        /// In what.
        what: &'static str,
        /// Both values.
        values: [String; 2],
    },
    /// Nothing is left.
    #[error("none of {} drapes can be used: {}", left_out.len(), reasons(left_out))]
    NothingLeft {
        /// Those left out.
        left_out: Vec<LeftOut>,
    },
}

fn reasons(left_out: &[LeftOut]) -> String {
    let said = left_out.iter().map(|l| format!("{}: {}", l.drape.file.display(), l.reason));
    said.collect::<Vec<_>>().join("; ")
}
