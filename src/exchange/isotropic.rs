//! One stiffness for three directions, for targets that know only one.
//!
//! Bending: the mean over all directions. A plate's stiffness in the direction t is B^u c^4 + B^v
//! s^4 + 2 D3 c^2 s^2 with D3 = 2 B^h - (B^u + B^v) / 2 (docs/symbols.md), and its mean (B^u + B^v
//! + 2 B^h) / 4. Stretch: the mean of weft and warp.

use crate::fabric::Fabric;

/// Stretch \[N/m\], shear \[N/m\] and bending \[N m\] of a fabric that is alike in all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Isotropic {
    pub(super) stretch_n_m: f64,
    pub(super) shear_n_m: f64,
    pub(super) bending_nm: f64,
}

impl Isotropic {
    pub(super) fn of(fabric: &Fabric) -> Self {
        let (weft, warp) = (fabric.bending_weft_nm, fabric.bending_warp_nm);
        Self {
            stretch_n_m: 0.5 * (fabric.stretch_weft_n_m + fabric.stretch_warp_n_m),
            shear_n_m: fabric.shear_n_m,
            bending_nm: 0.25 * (weft + warp + 2.0 * fabric.bending_bias_nm),
        }
    }

    /// Poisson's ratio with which a plane isotropic material has this shear beside this stretch,
    /// within `0..=most`: H = S / (2 (1 + nu)).
    pub(super) fn poisson(&self, most: f64) -> f64 {
        (self.stretch_n_m / (2.0 * self.shear_n_m) - 1.0).clamp(0.0, most)
    }

    /// What this loses of a fabric, in the order of what a drape shows most.
    pub(super) fn lost(fabric: &Fabric) -> Vec<String> {
        vec![
            format!(
                "bending along weft, warp and bias ({}, {}, {} uN m): one number, their mean over all \
                 directions",
                micro(fabric.bending_weft_nm),
                micro(fabric.bending_warp_nm),
                micro(fabric.bending_bias_nm)
            ),
            format!(
                "stretch along weft and warp ({:.4} and {:.4} N/m): one number, their mean",
                fabric.stretch_weft_n_m, fabric.stretch_warp_n_m
            ),
        ]
    }
}

fn micro(nm: f64) -> String {
    format!("{:.4}", nm * 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_over_directions_is_that_of_the_plate() {
        let fabric = Fabric::from_paper_units([1e5, 2e5, 6e4, 900.0, 2100.0, 1300.0, 200.0]);
        let [weft, warp, bias] = [900.0, 2100.0, 1300.0];
        let d3 = 2.0 * bias - 0.5 * (weft + warp);
        let sum: f64 = (0..360)
            .map(|degree| {
                let (s, c) = f64::from(degree).to_radians().sin_cos();
                weft * c.powi(4) + warp * s.powi(4) + 2.0 * d3 * c * c * s * s
            })
            .sum();
        let found = Isotropic::of(&fabric);
        assert!((found.bending_nm * 1e9 / (sum / 360.0) - 1.0).abs() < 1e-12);
        assert_eq!(found.stretch_n_m, 150.0);
        // 150 / 120 - 1
        assert!((found.poisson(0.49) - 0.25).abs() < 1e-12);
    }
}
