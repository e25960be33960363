//! How the cells of a grid and the yarns lie on the flat cloth.

/// The material frame of a grid: how one step along i and one along j lie on the flat cloth, and
/// how the yarns run there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialFrame {
    /// Where one step along i leads on the flat specimen: (x, z) over the spacing.
    pub step_i: [f64; 2],
    /// Where one step along j leads on the flat specimen: (x, z) over the spacing.
    pub step_j: [f64; 2],
    /// Angle of the warp from x towards z on the flat specimen \[rad\].
    pub warp_rad: f64,
}

impl MaterialFrame {
    /// Square cells whose sides run along warp and weft.
    pub const ALIGNED: Self = Self { step_i: [1.0, 0.0], step_j: [0.0, 1.0], warp_rad: 0.0 };

    /// The area of a cell over the square of the spacing.
    #[must_use]
    pub fn area(&self) -> f64 {
        self.step_i[0] * self.step_j[1] - self.step_i[1] * self.step_j[0]
    }

    /// The weights with which differences over one step along i and j add up to the derivatives
    /// along weft and warp, times the spacing: `[[weft by i, weft by j], [warp by i, warp by j]]`.
    #[must_use]
    pub fn derivatives(&self) -> [[f64; 2]; 2] {
        let ([ix, iz], [jx, jz], area) = (self.step_i, self.step_j, self.area());
        let (sin, cos) = self.warp_rad.sin_cos();
        // d/dx = (jz d_i - iz d_j) / area, d/dz = (-jx d_i + ix d_j) / area
        // a right angle is one: its cosine's rounding must not couple anything
        let exact = |v: f64| if v.abs() < 1e-12 { 0.0 } else { v };
        let along =
            |x: f64, z: f64| [(x * jz - z * jx) / area, (z * ix - x * iz) / area].map(exact);
        [along(-sin, cos), along(cos, sin)]
    }

    /// Whether the cells' sides run along the yarns.
    #[must_use]
    pub fn along_yarns(&self) -> bool {
        let [weft, warp] = self.derivatives();
        weft[0] == 0.0 && warp[1] == 0.0 || weft[1] == 0.0 && warp[0] == 0.0
    }
}
