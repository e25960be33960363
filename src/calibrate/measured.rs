//! A measured drape: its row of a manifest, and what was read of its file.

use super::effect::settled;
use super::manifest::{Entry, Face};
use super::measures::Measures;
use super::target::{Rim, Target};
use crate::base::Outline;
use crate::sim::Experiment;

/// A measured drape.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Its row of the manifest.
    pub entry: Entry,
    /// The outline, from the picture's upper left corner, or in the scan's frame \[m\].
    pub outline: Outline,
    /// The rim, where it was scanned or given.
    pub rim: Option<Rim>,
    /// Specimen and plate.
    pub bench: Experiment,
    /// What is counted on it.
    pub measures: Measures,
    /// Bearing of the warp in the picture or in the scan's frame, from +x towards +z, if it is
    /// known \[rad\].
    pub warp_rad: Option<f64>,
}

impl Measured {
    /// What a sheet is fitted to.
    #[must_use]
    pub fn target(&self) -> Target {
        let plain = || Target::of(&self.outline, self.warp_rad, &self.bench);
        let of_rim = self.rim.clone().and_then(|rim| Target::of_rim(rim, &self.bench));
        let turned_over = self.entry.face == Some(Face::Down);
        let settled = self.entry.observation.map_or(0.0, settled);
        let per_height = self.entry.camera_height_m.map_or(0.0, |m| 1.0 / m);
        let specimen = self.entry.specimen.clone();
        Target { turned_over, settled, per_height, specimen, ..of_rim.unwrap_or_else(plain) }
    }
}
