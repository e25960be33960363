//! The flags of an experiment, mm and degrees, and what they mean in SI.

#![allow(
    rustdoc::broken_intra_doc_links,
    reason = "the words are those of --help, units in brackets"
)]

use clap::Args;

use crate::base::units::M_PER_MM;
use crate::sim::Experiment;
use crate::sim::experiment::{Curl, ExperimentError};

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
        let set = |number: &mut f64, value: Option<f64>, unit: f64| {
            if let Some(value) = value {
                *number = value * unit;
            }
        };
        let degree = 1_f64.to_radians();
        set(&mut e.specimen.warp_m, self.size.map(|v| v[0]), M_PER_MM);
        set(&mut e.specimen.weft_m, self.size.map(|v| v[1]), M_PER_MM);
        set(&mut e.specimen.skew_rad, self.skew, degree);
        set(&mut e.specimen.rotation_rad, self.rotation, degree);
        set(&mut e.tilt.down_x_rad, self.tilt.map(|v| v[0]), degree);
        set(&mut e.tilt.down_z_rad, self.tilt.map(|v| v[1]), degree);
        set(&mut e.plate.radius_m, self.plate_radius, M_PER_MM);
        set(&mut e.plate.edge_radius_m, self.edge_radius, M_PER_MM);
        set(&mut e.plate.friction, self.friction, 1.0);
        set(&mut e.softening.weft_m, self.softening.map(|v| v[0]), M_PER_MM);
        set(&mut e.softening.warp_m, self.softening.map(|v| v[1]), M_PER_MM);
        set(&mut e.softening.bias_m, self.softening.map(|v| v[2]), M_PER_MM);
        set(&mut e.asymmetric_bending.weft, self.asymmetric_bending.map(|v| v[0]), 1.0);
        set(&mut e.asymmetric_bending.warp, self.asymmetric_bending.map(|v| v[1]), 1.0);
        set(&mut e.hysteresis.weft_n, self.hysteresis.map(|v| v[0]), N_PER_MN);
        set(&mut e.hysteresis.warp_n, self.hysteresis.map(|v| v[1]), N_PER_MN);
        set(&mut e.hysteresis.slip_per_m, self.hysteresis_slip, 1.0);
        set(&mut e.fold_correction, self.fold_correction, 1.0);
        for (k, number) in e.specimen.offset_m.iter_mut().enumerate() {
            set(number, self.offset.map(|v| v[k]), M_PER_MM);
        }
        if let Some(curl) = self.curl {
            e.curl = Curl::uniform(curl);
        }
        set(&mut e.curl.edge.curvature_per_m, self.edge_curl.map(|v| v[0]), 1.0);
        set(&mut e.curl.edge.width_m, self.edge_curl.map(|v| v[1]), M_PER_MM);
        set(&mut e.curl.line.curvature_per_m, self.crease.map(|v| v[0]), 1.0);
        set(&mut e.curl.line.width_m, self.crease.map(|v| v[1]), M_PER_MM);
        set(&mut e.curl.line.angle_rad, self.crease.map(|v| v[2]), degree);
        set(&mut e.curl.line.offset_m, self.crease.map(|v| v[3]), M_PER_MM);
        e.check()?;
        Ok(e)
    }
}

/// Newtons in a millinewton.
const N_PER_MN: f64 = 1e-3;

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
