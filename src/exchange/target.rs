//! Names of what can be exported to: programs and formats, and whole experiments.

use crate::sim::experiment::Experiment;

/// A program or format that is exported to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// CLO and Marvelous Designer, .jfab.
    Clo,
    /// Blender's cloth, a preset in Python.
    Blender,
    /// NVIDIA Newton, JSON for its solvers Style3D and VBD.
    Newton,
    /// `MuJoCo`, a flex in MJCF.
    Mujoco,
    /// ARCSim's material JSON.
    Arcsim,
    /// U3M 1.1, with a physics file for Browzwear next to it.
    U3m,
    /// OpenUSD, text.
    Usd,
    /// All that is known, in all units.
    Json,
    /// The same as a table.
    Csv,
}

impl Target {
    /// All targets.
    pub const ALL: [Self; 9] = [
        Self::Clo,
        Self::Blender,
        Self::Newton,
        Self::Mujoco,
        Self::Arcsim,
        Self::U3m,
        Self::Usd,
        Self::Json,
        Self::Csv,
    ];

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Clo => "clo",
            Self::Blender => "blender",
            Self::Newton => "newton",
            Self::Mujoco => "mujoco",
            Self::Arcsim => "arcsim",
            Self::U3m => "u3m",
            Self::Usd => "usd",
            Self::Json => "json",
            Self::Csv => "csv",
        }
    }

    /// Endings of the file, of a whole experiment where there is a scene; the first is the usual.
    #[must_use]
    pub fn endings(self, scene: Option<Scene>) -> &'static [&'static str] {
        match self {
            Self::Clo => &[".jfab"],
            Self::Blender => &[".py"],
            Self::Newton if scene.is_some() => &[".py"],
            Self::Newton | Self::Arcsim | Self::Json => &[".json"],
            Self::Mujoco => &[".xml"],
            Self::U3m => &[".u3m"],
            Self::Usd => &[".usda", ".usd"],
            Self::Csv => &[".csv"],
        }
    }

    /// What reads the file, and the file's ending.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Clo => "CLO and Marvelous Designer, .jfab",
            Self::Blender => "Blender's cloth, a preset in Python, .py",
            Self::Newton => "NVIDIA Newton, solvers Style3D and VBD, .json",
            Self::Mujoco => "MuJoCo, a flex in MJCF, .xml",
            Self::Arcsim => "ARCSim's material, .json",
            Self::U3m => "U3M 1.1, .u3m, with FILE.fab.json for Browzwear",
            Self::Usd => "OpenUSD, .usda",
            Self::Json => "All values in all units, .json",
            Self::Csv => "All values in all units as a table, .csv",
        }
    }
}

/// An experiment that is written as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scene {
    /// The experiment of this program: a square of 300 mm on a plate of radius 50 mm.
    Drape,
    /// The standard Cusick drape: a disc of 300 mm on a plate of radius 90 mm.
    Cusick,
}

impl Scene {
    /// All scenes.
    pub const ALL: [Self; 2] = [Self::Drape, Self::Cusick];

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Drape => "drape",
            Self::Cusick => "cusick",
        }
    }

    /// What it is, in a line.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Drape => "A square of 300 mm on a plate of radius 50 mm",
            Self::Cusick => "A disc of 300 mm on a plate of radius 90 mm",
        }
    }

    /// The experiment, with every effect off.
    #[must_use]
    pub fn experiment(self) -> Experiment {
        match self {
            Self::Drape => Experiment::default(),
            Self::Cusick => Experiment::standard_cusick(),
        }
    }
}
