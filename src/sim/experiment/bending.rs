//! Laws of bending beyond three stiffnesses: softening, another stiffness towards either face,
//! friction inside the cloth.
//!
//! In: nothing but numbers (SI). Out: what the energies of the same names are made of; their limits
//! stand in `parameters.rs`.

/// Bending that softens: the moment per width at curvature k is `B k (1 - s |k|)`, the law of Feng
/// et al. 2022 with s = -NL / L, up to 100 /m, and no farther than where the tangent stiffness has
/// fallen to a twentieth. From there to 100 /m that stiffness stays; beyond 100 /m, where nothing
/// is taken to have been measured, the tangent is what the law has there, and at least half of B
/// (`energy/softened.rs`).
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Softening {
    /// The law's s for bending along the weft \[m\].
    pub weft_m: f64,
    /// The law's s for bending along the warp \[m\].
    pub warp_m: f64,
    /// The law's s for bending about a line at 45 degrees \[m\].
    pub bias_m: f64,
    /// Curvature up to which the law was measured, above zero \[1/m\]. With infinity the tangent
    /// that is lost stays lost, as in the first drapes that softened. No file has it.
    #[serde(skip)]
    pub measured_to_per_m: f64,
}

impl Default for Softening {
    fn default() -> Self {
        let [weft_m, warp_m, bias_m] = [0.0; 3];
        Self { weft_m, warp_m, bias_m, measured_to_per_m: 100.0 }
    }
}

impl Softening {
    /// The same s in all directions \[m\].
    #[must_use]
    pub fn uniform(s_m: f64) -> Self {
        Self { weft_m: s_m, warp_m: s_m, bias_m: s_m, ..Self::default() }
    }

    /// Whether bending is linear.
    #[must_use]
    pub fn is_off(&self) -> bool {
        [self.weft_m, self.warp_m, self.bias_m] == [0.0; 3]
    }
}

/// Bending that is stiffer towards one face than towards the other: the moment per width at the
/// curvature k beyond the natural one is `B k (1 + a)` towards the face, which is up (+y) on the
/// flat specimen, and `B k (1 - a)` towards the back, with a smooth passage over 5 /m
/// (`energy/asymmetry.rs`). Cloth that hangs from a plate bends towards its back. The same cloth
/// laid face down is the one with the other signs, see [`Self::face_down`].
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct AsymmetricBending {
    /// The law's a for bending along the weft.
    pub weft: f64,
    /// The law's a for bending along the warp.
    pub warp: f64,
}

impl AsymmetricBending {
    /// The same a along weft and warp.
    #[must_use]
    pub fn uniform(a: f64) -> Self {
        Self { weft: a, warp: a }
    }

    /// That of the same cloth laid with the other face up.
    #[must_use]
    pub fn face_down(&self) -> Self {
        Self { weft: -self.weft, warp: -self.warp }
    }

    /// Whether both faces are alike.
    #[must_use]
    pub fn is_off(&self) -> bool {
        *self == Self::default()
    }
}

/// Friction inside the cloth against bending, the hysteresis of Kawabata's bending test (KES): the
/// moment per width is `B k + HB` while the curvature k grows and `B k - HB` while it falls
/// (`energy/hysteresis.rs`). KES gives 2HB, the distance of the two.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Hysteresis {
    /// HB, half of KES's 2HB, for bending along the weft: moment per width \[N m/m = N\].
    pub weft_n: f64,
    /// HB for bending along the warp \[N\].
    pub warp_n: f64,
    /// Change of curvature over which the friction rises to HB when bending turns round, and from
    /// where on it slips \[1/m\]. Its initial stiffness is 2 HB over this.
    pub slip_per_m: f64,
}

impl Default for Hysteresis {
    fn default() -> Self {
        Self { weft_n: 0.0, warp_n: 0.0, slip_per_m: 10.0 }
    }
}

impl Hysteresis {
    /// Whether bending has no friction.
    #[must_use]
    pub fn is_off(&self) -> bool {
        self.weft_n == 0.0 && self.warp_n == 0.0
    }
}
