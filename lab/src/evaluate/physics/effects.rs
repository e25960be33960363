//! What bending that is stiffer to one side and bending hysteresis do to a standard Cusick drape,
//! for `scan2params-lab physics`.
//!
//! In: for hysteresis a folder of measured data; else nothing. Out: rows of drape coefficients, one
//! fabric with one strength of one effect over several drops each.

use std::path::Path;

use super::drapes::{Timed, drape_coefficient, fabric_of, kes_drape, options, timed};
use super::{DataError, text_rows};
use scan2params::base::frame::GRAVITY_M_S2;
use scan2params::fabric::Fabric;
use scan2params::sim::experiment::{AsymmetricBending, Hysteresis};
use scan2params::sim::{Drop, DropStart, Experiment, drape};

/// Columns of both tables.
pub const COLUMNS: &str = "fabric, effect, dc_percent of each drop, dc_mean, dc_mean less that without, folds, stops, cpu_s";

/// Bending lengths of the fabrics of [`asymmetry`]: of one with about the drape coefficient of
/// fabric 2 of the measured silhouettes, and of a softer one \[m\].
const BENDING_LENGTHS_M: [f64; 2] = [26e-3, 15e-3];
/// Their areal density, that of the same fabric \[kg/m^2\].
const DENSITY_KG_M2: f64 = 0.192;
/// Asymmetries, the same along weft and warp.
const ASYMMETRIES: [f64; 3] = [0.0, 0.3, -0.3];

/// Two fabrics with equal faces, and 30 % stiffer towards the face or towards the back.
pub fn asymmetry(drops: u64, mut tell: impl FnMut(&str)) {
    for length_m in BENDING_LENGTHS_M {
        let rigidity_nm = length_m.powi(3) * DENSITY_KG_M2 * GRAVITY_M_S2;
        let fabric = fabric_of(DENSITY_KG_M2, [rigidity_nm; 3]);
        let mut without = None;
        for a in ASYMMETRIES {
            let asymmetric_bending = AsymmetricBending::uniform(a);
            let experiment = Experiment { asymmetric_bending, ..Experiment::standard_cusick() };
            let name = format!("{:.0} mm, a {a:+.1}", 1e3 * length_m);
            tell(&row(&name, &fabric, &experiment, drops, &mut without));
        }
    }
}

/// The four KES fabrics without hysteresis, and with theirs, which slips at the default curvature,
/// at half and at twice that.
///
/// # Errors
/// When the file of the folder cannot be read.
pub fn hysteresis(data: &Path, drops: u64, mut tell: impl FnMut(&str)) -> Result<(), DataError> {
    let loops = text_rows(&data.join("kes-drape-4/fabrics4.csv"))?;
    for (measured, line) in kes_drape(data)?.into_iter().zip(&loops) {
        let hb_n = 0.5 * line.number(3)?;
        let mut without = None;
        let usual = Hysteresis::default().slip_per_m;
        let cases = [(0.0, usual), (hb_n, usual), (hb_n, 0.5 * usual), (hb_n, 2.0 * usual)];
        for (hb_n, slip_per_m) in cases {
            let hysteresis = Hysteresis { weft_n: hb_n, warp_n: hb_n, slip_per_m };
            let experiment = Experiment { hysteresis, ..Experiment::standard_cusick() };
            let measured_dc = measured.drape.map_or(f64::NAN, |[coefficient, _]| coefficient);
            let name = format!(
                "{} (measured {measured_dc:.1}), HB {:.3} mN, s {slip_per_m:.0} /m",
                measured.name,
                1e3 * hb_n
            );
            tell(&row(&name, &measured.fabric, &experiment, drops, &mut without));
        }
    }
    Ok(())
}

/// A row: a canonical drop and perturbed ones. `without` keeps the mean of a fabric's first row.
fn row(
    name: &str,
    fabric: &Fabric,
    experiment: &Experiment,
    drops: u64,
    without: &mut Option<f64>,
) -> String {
    let (mut coefficients, mut folds, mut stops) = (Vec::new(), Vec::new(), Vec::new());
    let mut total_s = 0.0;
    for seed in 0..drops.max(1) {
        let start = if seed == 0 { DropStart::Canonical } else { DropStart::Perturbed(seed) };
        let Timed { drape: d, cpu_s } =
            timed(|| drape(fabric, &Drop { start }, &options(*experiment)));
        coefficients.push(drape_coefficient(&d, experiment));
        folds.push(d.nodes.to_string());
        stops.push(d.stop.name());
        total_s += cpu_s;
    }
    let mean = coefficients.iter().sum::<f64>() / coefficients.len() as f64;
    let of_drops: Vec<String> = coefficients.iter().map(|dc| format!("{dc:.1}")).collect();
    stops.dedup();
    format!(
        "{name}, {}, {mean:.1}, {:+.1}, {}, {}, {total_s:.0}",
        of_drops.join(" "),
        mean - *without.get_or_insert(mean),
        folds.join(" "),
        stops.join(" ")
    )
}
