//! The flags of an experiment, mm and degrees, and what they mean in SI.

#![allow(
    rustdoc::broken_intra_doc_links,
    reason = "the words are those of --help, units in brackets"
)]

use clap::Args;

use crate::sim::Experiment;
use crate::sim::experiment::{Curl, ExperimentError};
use crate::sim::parameters::Row;

/// Specimen, plate and effects; without a flag the modified Cusick drape.
#[derive(Debug, Args)]
#[command(next_help_heading = "Experiment")]
pub struct ExperimentFlags {
    /// A disc of 300 mm on a plate of radius 90 mm to start from: the standard Cusick drape
    #[arg(long)]
    pub cusick: bool,
    /// Extents of the specimen along warp and weft [mm]
    #[arg(long, value_name = "WARP,WEFT", value_parser = numbers::<2>)]
    pub size: Option<[f64; 2]>,
    /// Angle by which the sides along the weft lean towards the warp [degrees]
    #[arg(long, allow_negative_numbers = true)]
    pub skew: Option<f64>,
    /// Place of the specimen's centre on the plate [mm]
    #[arg(long, value_name = "X,Z", value_parser = numbers::<2>, allow_hyphen_values = true)]
    pub offset: Option<[f64; 2]>,
    /// Rotation of the specimen, from +x towards -z [degrees]
    #[arg(long, allow_negative_numbers = true)]
    pub rotation: Option<f64>,
    /// Fall of the plate towards +x and +z [degrees]
    #[arg(long, value_name = "X,Z", value_parser = numbers::<2>, allow_hyphen_values = true)]
    pub tilt: Option<[f64; 2]>,
    /// Radius of the plate [mm]
    #[arg(long)]
    pub plate_radius: Option<f64>,
    /// Radius of the plate's edge, half its thickness [mm]
    #[arg(long)]
    pub edge_radius: Option<f64>,
    /// Coefficient of friction between cloth and plate
    #[arg(long)]
    pub friction: Option<f64>,
    /// Natural curvature of the whole sheet along weft, warp, and twist [1/m]
    #[arg(long, value_name = "WEFT,WARP,TWIST", value_parser = numbers::<3>, allow_hyphen_values = true)]
    pub curl: Option<[f64; 3]>,
    /// Natural curvature across the free edges [1/m] and how far in it reaches [mm]
    #[arg(long, value_name = "CURVATURE,WIDTH", value_parser = numbers::<2>, allow_hyphen_values = true)]
    pub edge_curl: Option<[f64; 2]>,
    /// Crease: natural curvature across a line [1/m], how far from it [mm], the line's direction
    /// from the warp towards the weft [degrees] and its distance from the centre [mm]
    #[arg(long, value_name = "CURVATURE,WIDTH,ANGLE,OFFSET", value_parser = numbers::<4>, allow_hyphen_values = true)]
    pub crease: Option<[f64; 4]>,
    /// Softening of bending M = B k (1 - s k), s along weft, warp, bias [mm]
    #[arg(long, value_name = "WEFT,WARP,BIAS", value_parser = numbers::<3>)]
    pub softening: Option<[f64; 3]>,
    /// Bending stiffer towards the face (up) than towards the back, B (1 + a) against B (1 - a): a
    /// along weft and warp; with the other signs the same cloth laid face down
    #[arg(long, value_name = "WEFT,WARP", value_parser = numbers::<2>, allow_hyphen_values = true)]
    pub asymmetric_bending: Option<[f64; 2]>,
    /// Friction moment per width against bending along weft and warp, half of KES's 2HB [mN]
    #[arg(long, value_name = "WEFT,WARP", value_parser = numbers::<2>)]
    pub hysteresis: Option<[f64; 2]>,
    /// Change of curvature over which that friction rises to its full moment [1/m]
    #[arg(long)]
    pub hysteresis_slip: Option<f64>,
    /// Correction of the mesh for folds (0.04 corrects cantilevers); 0: none
    #[arg(long)]
    pub fold_correction: Option<f64>,
}

impl ExperimentFlags {
    /// The experiment, checked.
    ///
    /// # Errors
    /// What no experiment can have.
    pub fn experiment(&self) -> Result<Experiment, ExperimentError> {
        let mut e = if self.cusick { Experiment::standard_cusick() } else { Experiment::default() };
        if let Some(curl) = self.curl {
            e.curl = Curl::uniform(curl);
        }
        for (keys, values) in self.numbers() {
            for (key, value) in keys.iter().zip(values) {
                let Some(row) = Row::named(key) else { unreachable!("no number is called {key}") };
                row.numbers(&mut e)[0] = value * row.unit.in_si;
            }
        }
        e.check()?;
        Ok(e)
    }

    /// The names of the numbers of each flag, and those given, in their units.
    fn numbers(&self) -> [(&'static [&'static str], &[f64]); 15] {
        [
            (&["specimen.warp", "specimen.weft"], self.size.as_slice().as_flattened()),
            (&["specimen.skew"], self.skew.as_slice()),
            (&["specimen.offset_x", "specimen.offset_z"], self.offset.as_slice().as_flattened()),
            (&["specimen.rotation"], self.rotation.as_slice()),
            (&["tilt.down_x", "tilt.down_z"], self.tilt.as_slice().as_flattened()),
            (&["plate.radius"], self.plate_radius.as_slice()),
            (&["plate.edge_radius"], self.edge_radius.as_slice()),
            (&["plate.friction"], self.friction.as_slice()),
            (&["curl.edge", "curl.edge_width"], self.edge_curl.as_slice().as_flattened()),
            (
                &["curl.line", "curl.line_width", "curl.line_angle", "curl.line_offset"],
                self.crease.as_slice().as_flattened(),
            ),
            (
                &["softening.weft", "softening.warp", "softening.bias"],
                self.softening.as_slice().as_flattened(),
            ),
            (
                &["asymmetric_bending.weft", "asymmetric_bending.warp"],
                self.asymmetric_bending.as_slice().as_flattened(),
            ),
            (&["hysteresis.weft", "hysteresis.warp"], self.hysteresis.as_slice().as_flattened()),
            (&["hysteresis.slip"], self.hysteresis_slip.as_slice()),
            (&["fold_correction"], self.fold_correction.as_slice()),
        ]
    }
}

/// `N` numbers with commas between them.
///
/// # Errors
/// Another text, with what would be one.
pub fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse::<f64>()).collect();
    let given =
        numbers.map_err(|error| format!("{error}; give {N} numbers with commas between"))?;
    let count = given.len();
    given.try_into().map_err(|_| format!("{count} numbers; give {N} with commas between"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        flags: ExperimentFlags,
    }

    #[test]
    fn every_number_of_a_flag_has_a_row() {
        let Line { flags } = clap::Parser::parse_from(["program"]);
        for (keys, values) in flags.numbers() {
            assert!(values.is_empty() && keys.iter().all(|key| Row::named(key).is_some()));
        }
    }
}
