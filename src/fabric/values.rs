//! One fabric: six stiffnesses and a density, in SI and in the paper's units.

use crate::base::units::{KG_M2_PER_G_M2, N_M_PER_G_MM2_S2, N_M_PER_G_S2};

/// One fabric in SI. Symbols of the paper in brackets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fabric {
    /// Weft stretch stiffness \[S^u\] \[N/m\].
    pub stretch_weft_n_m: f64,
    /// Warp stretch stiffness \[S^v\] \[N/m\].
    pub stretch_warp_n_m: f64,
    /// Shear stiffness \[H\] \[N/m\].
    pub shear_n_m: f64,
    /// Weft bending stiffness \[B^u\] \[N m\].
    pub bending_weft_nm: f64,
    /// Warp bending stiffness \[B^v\] \[N m\].
    pub bending_warp_nm: f64,
    /// Bias (45 degrees) bending stiffness \[B^h\] \[N m\].
    pub bending_bias_nm: f64,
    /// Areal density \[D\] \[kg/m^2\].
    pub density_kg_m2: f64,
}

impl Fabric {
    /// From the paper's order and units: S^u, S^v, H \[g/s^2\], B^u, B^v, B^h
    /// \[g mm^2 s^-2 rad^-1\], D \[g/m^2\].
    #[must_use]
    pub fn from_paper_units(v: [f64; 7]) -> Self {
        Self {
            stretch_weft_n_m: v[0] * N_M_PER_G_S2,
            stretch_warp_n_m: v[1] * N_M_PER_G_S2,
            shear_n_m: v[2] * N_M_PER_G_S2,
            bending_weft_nm: v[3] * N_M_PER_G_MM2_S2,
            bending_warp_nm: v[4] * N_M_PER_G_MM2_S2,
            bending_bias_nm: v[5] * N_M_PER_G_MM2_S2,
            density_kg_m2: v[6] * KG_M2_PER_G_M2,
        }
    }

    /// The inverse of [`Self::in_si`].
    #[must_use]
    pub fn from_si(v: [f64; 7]) -> Self {
        Self {
            stretch_weft_n_m: v[0],
            stretch_warp_n_m: v[1],
            shear_n_m: v[2],
            bending_weft_nm: v[3],
            bending_warp_nm: v[4],
            bending_bias_nm: v[5],
            density_kg_m2: v[6],
        }
    }

    /// Of the logarithms of six stiffnesses in SI, paper's order, made one that can be
    /// ([`Self::project_bending`]).
    #[must_use]
    pub fn from_ln_stiffnesses(ln: &[f64; 6], density_kg_m2: f64) -> Self {
        let [a, b, c, d, e, f] = ln.map(f64::exp);
        Self::from_si([a, b, c, d, e, f, density_kg_m2]).project_bending().0
    }

    /// The seven numbers in SI, in the paper's order: S^u, S^v, H \[N/m\], B^u, B^v, B^h
    /// \[N m\], D \[kg/m^2\].
    #[must_use]
    pub fn in_si(&self) -> [f64; 7] {
        [
            self.stretch_weft_n_m,
            self.stretch_warp_n_m,
            self.shear_n_m,
            self.bending_weft_nm,
            self.bending_warp_nm,
            self.bending_bias_nm,
            self.density_kg_m2,
        ]
    }

    /// The inverse of [`Self::from_paper_units`].
    #[must_use]
    pub fn to_paper_units(&self) -> [f64; 7] {
        [
            self.stretch_weft_n_m / N_M_PER_G_S2,
            self.stretch_warp_n_m / N_M_PER_G_S2,
            self.shear_n_m / N_M_PER_G_S2,
            self.bending_weft_nm / N_M_PER_G_MM2_S2,
            self.bending_warp_nm / N_M_PER_G_MM2_S2,
            self.bending_bias_nm / N_M_PER_G_MM2_S2,
            self.density_kg_m2 / KG_M2_PER_G_M2,
        ]
    }

    /// Table 2's mean knit.
    #[must_use]
    pub fn mean_knit() -> Self {
        Self::from_paper_units([
            131_010.96, 163_944.78, 75_064.22, 1119.74, 1370.87, 1245.30, 214.02,
        ])
    }
}
