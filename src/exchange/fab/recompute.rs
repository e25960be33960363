//! Stiffnesses from the raw series of a tester.
//!
//! In: the upward bend test and the 8 cm stretch test of three strips. Out: the six stiffnesses,
//! each the mean over cycles with its least and largest value. The tester's own laws are not
//! public. These are used:
//!
//! - **Bending** is Euler's elastica between two clamps (`loop_test.rs`) at the largest push of
//!   each outward part of the upward test at 2 cm, with the force as the file has it. Of the laws
//!   that were tried this one agrees best with the given values of the two examples: 5 to 12 %
//!   below all four. The rest is near one factor, which no public document explains. Dropped:
//!   zeroing the force (the load cell's zero drifts by more than the signal, up to 3 gf; slopes
//!   alone give two to four times the given values); the downward test; the weight of the strip,
//!   which moves the result by some 10 %; the returns, which friction in the fabric pulls to zero.
//! - **Stretch** is the secant from the free length to 5 gf/cm on the returns of the 8 cm test,
//!   without the first cycle. 5 gf/cm is the least load of the FAST-3 tester. The law of the given
//!   values is not known: this one lies within some 20 % of the four, and with four numbers that is
//!   no proof. At 2 cm the slip in the clamps weighs four times as much.
//! - **Shear** follows from the same secant along the bias, E45, as in an orthotropic sheet without
//!   Poisson's effect: 1/G = 4/E45 - 1/E_weft - 1/E_warp. At 2 cm yarns run from clamp to clamp,
//!   so that only 8 cm will do. It depends on the load: fabrics that shear easily lock later.

use super::loop_test;
use super::series::{M_PER_CM, N_PER_GF, Part, Strip};
use crate::fabric::STIFFNESSES;

/// Load per width of a secant \[N/m\]: 5 gf/cm.
pub const LOAD_N_M: f64 = 5.0 * N_PER_GF / M_PER_CM;

/// A value from series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recomputed {
    /// Mean over the cycles, SI.
    pub value: f64,
    /// Its least and largest over the cycles, SI.
    pub range: [f64; 2],
}

impl Recomputed {
    fn of(values: &[f64], why_none: &str) -> Result<Self, String> {
        if values.is_empty() {
            return Err(why_none.to_owned());
        }
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(0.0, f64::max);
        let value = values.iter().sum::<f64>() / values.len() as f64;
        Ok(Self { value, range: [low, high] })
    }
}

/// The six stiffnesses in the paper's order, from the strips along weft, warp and bias; in place of
/// a value the reason why there is none.
pub fn all(weft: &Strip, warp: &Strip, bias: &Strip) -> [Result<Recomputed, String>; STIFFNESSES] {
    let [stretch_weft, stretch_warp, stretch_bias] = [weft, warp, bias].map(stretch);
    let shear = shear(&stretch_weft, &stretch_warp, &stretch_bias);
    let [bend_weft, bend_warp, bend_bias] = [weft, warp, bias].map(bending);
    [stretch_weft, stretch_warp, shear, bend_weft, bend_warp, bend_bias]
}

/// Bending stiffness of a loop test \[N m\].
fn bending(strip: &Strip) -> Result<Recomputed, String> {
    let test = strip.up_2cm.as_ref().ok_or("no test U1")?;
    let of_part = |part: &Part| {
        let push = part.pairs.iter().copied().min_by(|a, b| a[1].total_cmp(&b[1]))?;
        let [distance_m, force_n] = push;
        let bending = loop_test::bending_nm([test.length_m, test.width_m], distance_m, -force_n)?;
        (bending > 0.0).then_some(bending)
    };
    let values: Vec<f64> = test.parts.iter().step_by(2).filter_map(of_part).collect();
    Recomputed::of(&values, "no outward part of test U1 pushes on the clamps")
}

/// Secant stiffness of a strip \[N/m\].
fn stretch(strip: &Strip) -> Result<Recomputed, String> {
    let test = strip.stretch_8cm.as_ref().ok_or("no test S2")?;
    let load_n = LOAD_N_M * test.width_m;
    let of_part = |part: &Part| {
        let strain = distance_at(part, load_n)? / test.length_m - 1.0;
        (strain > 0.0).then(|| LOAD_N_M / strain)
    };
    let back = test.parts.iter().skip(1).step_by(2).skip(1);
    let values: Vec<f64> = back.filter_map(of_part).collect();
    Recomputed::of(&values, "no return of test S2 passes 5 gf/cm beyond the free length")
}

/// Where a part that begins at a larger force passes this one first, between its pairs.
fn distance_at(part: &Part, force_n: f64) -> Option<f64> {
    part.pairs.windows(2).find_map(|pair| {
        let [[x, f], [next_x, next_f]] = [pair[0], pair[1]];
        (f >= force_n && next_f < force_n).then(|| x + (next_x - x) * (f - force_n) / (f - next_f))
    })
}

fn shear(
    weft: &Result<Recomputed, String>,
    warp: &Result<Recomputed, String>,
    bias: &Result<Recomputed, String>,
) -> Result<Recomputed, String> {
    let [weft, warp, bias] = [(weft, "width"), (warp, "length"), (bias, "bias")]
        .map(|(found, along)| found.as_ref().map_err(|why| format!("along the {along}: {why}")));
    let (weft, warp, bias) = (weft?, warp?, bias?);
    let of = |along_bias: f64| {
        let softness = 4.0 / along_bias - 1.0 / weft.value - 1.0 / warp.value;
        if softness > 0.0 {
            return Ok(1.0 / softness);
        }
        Err("the strip along the bias is stiffer than its yarns allow".to_owned())
    };
    Ok(Recomputed { value: of(bias.value)?, range: [of(bias.range[0])?, of(bias.range[1])?] })
}
