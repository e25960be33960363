//! Raw series of a tester, in SI.

/// N in 1 gf.
pub(super) const N_PER_GF: f64 = 9.806_65e-3;
/// m in 1 cm.
pub(super) const M_PER_CM: f64 = 1e-2;

/// One part of a test: the clamps move one way, from the first pair to the last.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Distance of the clamps \[m\] and force \[N\], positive where the fabric pulls.
    pub pairs: Vec<[f64; 2]>,
}

/// A test: cycles, each with an outward part and a return.
#[derive(Clone, Debug, PartialEq)]
pub struct Test {
    /// Free length of the strip \[m\].
    pub length_m: f64,
    /// Width of the strip \[m\].
    pub width_m: f64,
    /// Outward parts and returns, alternating.
    pub parts: Vec<Part>,
}

/// The tests of a strip along one direction that are used here.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Strip {
    /// Bent upward, clamps at 2 cm.
    pub up_2cm: Option<Test>,
    /// Stretched, clamps at 8 cm.
    pub stretch_8cm: Option<Test>,
}
