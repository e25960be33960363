//! What every target is given beyond the fabric, what it gives back, and why it may not.

use std::time::SystemTime;

use super::hinge::Mesh;
use super::target::Scene;
use crate::fabric::FabricError;

/// What a target may need beyond the fabric.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The material's name in the target.
    pub name: String,
    /// Length of the edges of the target's mesh \[m\].
    pub edge_m: Option<f64>,
    /// Triangles of the target's mesh.
    pub mesh: Mesh,
    /// The experiment that is written with the fabric, or the fabric alone.
    pub scene: Option<Scene>,
    /// The fabric's thickness \[m\], which no drape shows.
    pub thickness_m: Option<f64>,
    /// The fabric's friction, which no drape shows.
    pub friction: Option<f64>,
    /// Whether weft and warp change places in CLO's file, whose order of u and v is second-hand.
    pub swap_warp_weft: bool,
    /// Whether a result that is not to be used is exported all the same.
    pub force: bool,
    /// When the material was made.
    pub made: SystemTime,
}

impl Options {
    /// A material of this name; nothing else is given.
    #[must_use]
    pub fn named(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            edge_m: None,
            mesh: Mesh::default(),
            scene: None,
            thickness_m: None,
            friction: None,
            swap_warp_weft: false,
            force: false,
            made: SystemTime::UNIX_EPOCH,
        }
    }
}

/// A second file, which the first names.
#[derive(Clone, Debug, PartialEq)]
pub struct Companion {
    /// What its name ends in, after the stem of the first file's.
    pub ending: &'static str,
    /// Its text.
    pub text: String,
}

/// A fabric in the words of a target.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// The text of the file.
    pub text: String,
    /// The second file, of targets that have one.
    pub companion: Option<Companion>,
    /// What of the fabric is lost.
    pub lost: Vec<String>,
    /// What is to be known of the numbers.
    pub notes: Vec<String>,
}

/// Why a fabric is not exported.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExchangeError {
    /// The result is not to be used.
    #[error("the result is not to be used: {grounds}; export it all the same with --force")]
    DoNotUse {
        /// The grounds of the verdict.
        grounds: String,
    },
    /// The fabric cannot be.
    #[error(transparent)]
    Fabric(#[from] FabricError),
    /// A number that the target cannot do without.
    #[error("{target} needs {what}: give {flag}")]
    Needs {
        /// The target's name.
        target: &'static str,
        /// What it needs.
        what: &'static str,
        /// The flag that gives it.
        flag: &'static str,
    },
    /// A target whose file has no room for an experiment.
    #[error("{target} holds a fabric alone; give --scene with mujoco, newton or blender")]
    NoScene {
        /// The target's name.
        target: &'static str,
    },
    /// A given number that cannot be.
    #[error("{flag} is {value}; give {limits}")]
    Given {
        /// The flag.
        flag: &'static str,
        /// The number.
        value: f64,
        /// What it may be.
        limits: &'static str,
    },
}

/// The name under which a target's `beside` file lies: `out` is the name of the first file. U3M
/// names it in the first file.
#[must_use]
pub fn companion_name(out_stem: &str, ending: &str) -> String {
    format!("{out_stem}{ending}")
}
