//! The simulator against known answers, for `scan2params-lab physics` and
//! docs/validation/simulator.md.
//!
//! In: nothing, or a folder of measured data. Out: tables of numbers with their known
//! answers, and charts. Strips: `sim::strip`; the elastica: `sim::elastica`.

use std::path::Path;

use super::{DataError, Table, text_rows};
use scan2params::base::frame::GRAVITY_M_S2;
use scan2params::fabric::Fabric;
use scan2params::picture::chart::{Axis, COLOURS, Chart, Legend, Mark, Series};
use scan2params::sim::Experiment;
use scan2params::sim::elastica::{Elastica, End};
use scan2params::sim::strip::{Cut, Strip, cantilever, hanging, slide};

/// The stretch of a strip that hardly stretches \[g/s^2\].
const STIFF: f64 = 1e6;
/// Areal density of the strips \[kg/m^2\].
const DENSITY_KG_M2: f64 = 0.2;

/// A cantilever at rest beside the elastica.
#[derive(Clone, Debug)]
pub struct Cantilever {
    /// The cut.
    pub cut: Cut,
    /// rho g L^3 / B with the stiffness of the strip's direction.
    pub gamma: f64,
    /// The strip.
    pub strip: Strip,
    /// The elastica's end, in lengths.
    pub exact: End,
}

impl Cantilever {
    /// Solves a strip whose three bending stiffnesses are `ratios` (weft, warp, bias) times
    /// the one that gives `gamma` for a ratio of 1.
    #[must_use]
    pub fn new(cut: Cut, gamma: f64, ratios: [f64; 3]) -> Option<Self> {
        Self::with(cut, gamma, ratios, 0.0)
    }

    /// The same with a correction for folds ([`Experiment::fold_correction`]).
    #[must_use]
    pub fn with(cut: Cut, gamma: f64, ratios: [f64; 3], fold_correction: f64) -> Option<Self> {
        let length_m = cut.clamped_length_m();
        let rigidity_nm = DENSITY_KG_M2 * GRAVITY_M_S2 * length_m.powi(3) / gamma;
        let [weft, warp, bias] = ratios.map(|r| r * rigidity_nm);
        let stiff = Fabric::from_paper_units([STIFF; 7]);
        let fabric = Fabric {
            bending_weft_nm: weft,
            bending_warp_nm: warp,
            bending_bias_nm: bias,
            density_kg_m2: DENSITY_KG_M2,
            ..stiff
        };
        let experiment = Experiment { fold_correction, ..Experiment::default() };
        let strip = cantilever(&fabric, &cut, &experiment);
        Some(Self { cut, gamma, strip, exact: Elastica::linear(gamma).end().ok()? })
    }

    /// Bending length (B / rho g)^(1/3) \[m\].
    #[must_use]
    pub fn bending_length_m(&self) -> f64 {
        self.cut.clamped_length_m() / self.gamma.cbrt()
    }

    /// Droop over reach.
    #[must_use]
    pub fn slope(&self) -> f64 {
        let [reach, droop, _] = self.strip.end_m();
        droop / reach
    }

    /// Error of droop over reach against the elastica.
    #[must_use]
    pub fn slope_error(&self) -> f64 {
        self.slope() * self.exact.reach / self.exact.droop - 1.0
    }

    /// Distance of the end from the elastica's, over the length.
    #[must_use]
    pub fn end_error(&self) -> f64 {
        let length_m = self.cut.clamped_length_m();
        let [reach, droop, _] = self.strip.end_m().map(|v| v / length_m);
        (reach - self.exact.reach).hypot(droop - self.exact.droop)
    }

    /// The bending stiffness with which the elastica would droop like the strip, over the
    /// true one of the warp.
    #[must_use]
    pub fn apparent_stiffness(&self) -> Option<f64> {
        let (mut low, mut high) = (0.1 * self.gamma, 10.0 * self.gamma);
        for _ in 0..40 {
            let middle = (low * high).sqrt();
            let end = Elastica::linear(middle).end().ok()?;
            if end.droop / end.reach < self.slope() { low = middle } else { high = middle }
        }
        Some(self.gamma / low)
    }
}

/// How the elastica agrees with a file of the same curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveError {
    /// Points compared.
    pub points: usize,
    /// Largest error of droop over reach.
    pub largest: f64,
    /// The gamma at which it is.
    pub at_gamma: f64,
}

impl std::fmt::Display for CurveError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (points, percent) = (self.points, 100.0 * self.largest);
        write!(f, "{points} points, largest error {percent:.3} % at gamma {:.0}", self.at_gamma)
    }
}

/// Holds the elastica against a file of gamma and droop over width (Romero et al. 2021), up
/// to `most_gamma`.
///
/// # Errors
/// When the file cannot be read as two columns of numbers.
pub fn elastica_against(path: &Path, most_gamma: f64) -> Result<CurveError, DataError> {
    let mut error = CurveError { points: 0, largest: 0.0, at_gamma: 0.0 };
    for row in text_rows(path)? {
        let (gamma, slope) = (row.number(0)?, row.number(1)?);
        let end = Some(gamma).filter(|g| *g <= most_gamma);
        if let Some(end) = end.and_then(|gamma| Elastica::linear(gamma).end().ok()) {
            error.points += 1;
            let own = (end.droop / end.reach / slope - 1.0).abs();
            if own > error.largest {
                (error.largest, error.at_gamma) = (own, gamma);
            }
        }
    }
    Ok(error)
}

/// Angles of the three strips against the warp \[degrees\], with their names.
const DIRECTIONS: [(f64, &str); 3] = [(0.0, "warp"), (90.0, "weft"), (45.0, "bias")];

fn cut(degrees: f64, cell_m: f64, length_m: f64, width_m: f64) -> Cut {
    Cut {
        angle_rad: degrees.to_radians(),
        cell_m,
        along: (length_m / cell_m + 0.5).round() as usize,
        across: (width_m / cell_m).round() as usize,
    }
}

/// Strips along warp, weft and bias against the master curve over three decades, 5 mm cells.
#[must_use]
pub fn master_curve() -> (Table, Chart) {
    let mut rows = Vec::new();
    let mut series = vec![Series {
        name: "heavy elastica".into(),
        points: (0..=80)
            .filter_map(|k| {
                let gamma = 10.0_f64.powf(-0.3 + 3.5 * f64::from(k) / 80.0);
                let end = Elastica::linear(gamma).end().ok()?;
                Some([gamma, end.droop / end.reach])
            })
            .collect(),
        mark: Mark::Line,
        colour: COLOURS[5],
    }];
    for (direction, (degrees, name)) in DIRECTIONS.into_iter().enumerate() {
        let mut points = Vec::new();
        for gamma in [1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0] {
            let cut = cut(degrees, 5e-3, 0.1425, 0.03);
            let Some(c) = Cantilever::new(cut, gamma, [1.0; 3]) else { continue };
            rows.push(cantilever_row(name, &c));
            points.push([gamma, c.slope()]);
        }
        let colour = COLOURS[direction];
        series.push(Series { name: format!("strip, {name}"), points, mark: Mark::Cross, colour });
    }
    let table = Table {
        title: "cantilever strips 142.5 x 30 mm, 5 mm cells, against the heavy elastica".into(),
        columns: CANTILEVER_COLUMNS.to_vec(),
        rows,
    };
    let axis = |label: &str| Axis { label: label.into(), log: true };
    let chart = Chart {
        title: "Cantilever: droop over reach, 5 mm cells".into(),
        x: axis("rho g L^3 / B"),
        y: axis("droop / reach"),
        series,
        legend: Legend::Left,
    };
    (table, chart)
}

const CANTILEVER_COLUMNS: [&str; 8] = [
    "direction",
    "cell_mm",
    "gamma",
    "bending_length_mm",
    "droop_over_reach",
    "exact",
    "error_percent",
    "end_error_percent_of_length",
];

fn cantilever_row(name: &str, c: &Cantilever) -> Vec<String> {
    let at_rest = if c.strip.at_rest { "" } else { " not at rest" };
    vec![
        format!("{name}{at_rest}"),
        format!("{:.1}", c.cut.cell_m * 1e3),
        format!("{:.0}", c.gamma),
        format!("{:.1}", c.bending_length_m() * 1e3),
        format!("{:.5}", c.slope()),
        format!("{:.5}", c.exact.droop / c.exact.reach),
        format!("{:+.3}", 100.0 * c.slope_error()),
        format!("{:.3}", 100.0 * c.end_error()),
    ]
}

/// The error on 5 mm cells by bending length and gamma, with a correction for folds or
/// without (0): where the target of 2 % is met.
#[must_use]
pub fn resolution(fold_correction: f64) -> Table {
    let mut rows = Vec::new();
    for length_m in [8e-3, 10e-3, 14e-3, 20e-3, 30e-3] {
        for gamma in [10.0, 30.0, 100.0, 300.0, 1000.0] {
            let cut = cut(0.0, 5e-3, length_m * f64::cbrt(gamma), 0.02);
            let c = Cantilever::with(cut, gamma, [1.0; 3], fold_correction);
            rows.extend(c.map(|c| cantilever_row("warp", &c)));
        }
    }
    Table {
        title: format!(
            "cantilever by bending length and gamma, 5 mm cells, fold correction {fold_correction}"
        ),
        columns: CANTILEVER_COLUMNS.to_vec(),
        rows,
    }
}

/// Three cell sizes on about one length: errors and the order between them.
#[must_use]
pub fn refinement() -> (Table, Chart) {
    let (mut rows, mut series) = (Vec::new(), Vec::new());
    for (k, gamma) in [10.0, 100.0, 1000.0].into_iter().enumerate() {
        let mut before: Option<[f64; 2]> = None;
        let mut points = Vec::new();
        for cell_m in [10e-3, 5e-3, 2.5e-3] {
            let cut = cut(0.0, cell_m, 0.145, 0.03);
            let Some(c) = Cantilever::new(cut, gamma, [1.0; 3]) else { continue };
            let now = [cell_m / cut.clamped_length_m(), c.end_error()];
            let order = before.map(|b| (b[1] / now[1]).ln() / (b[0] / now[0]).ln());
            let mut row = cantilever_row("warp", &c);
            row.push(order.map_or("-".into(), |o| format!("{o:.2}")));
            rows.push(row);
            points.push([cell_m * 1e3, 100.0 * now[1]]);
            before = Some(now);
        }
        let (name, colour) = (format!("gamma {gamma:.0}"), COLOURS[k]);
        series.push(Series { name, points, mark: Mark::Line, colour });
    }
    let columns = CANTILEVER_COLUMNS.iter().copied().chain(["order"]).collect();
    let title = "cantilever, cells of 10, 5 and 2.5 mm".into();
    let axis = |label: &str| Axis { label: label.into(), log: true };
    let chart = Chart {
        title: "Cantilever: distance of the end from the elastica's, over the length".into(),
        x: axis("cell [mm]"),
        y: axis("error [%]"),
        series,
        legend: Legend::Left,
    };
    (Table { title, columns, rows }, chart)
}

/// B^h changed alone: what the three strips make of it, at two widths. The apparent
/// stiffness is over that of the strip's own direction.
#[must_use]
pub fn bias_alone() -> Table {
    let mut rows = Vec::new();
    for bias in [0.6, 1.0, 2.0] {
        for (degrees, name) in DIRECTIONS {
            for width_m in [0.05, 0.15] {
                let own = if degrees == 45.0 { bias } else { 1.0 };
                let cut = cut(degrees, 5e-3, 0.1425, width_m);
                // gamma of the strip's own direction is 20 / own
                let ratios = [1.0 / own, 1.0 / own, bias / own];
                let Some(c) = Cantilever::new(cut, 20.0 / own, ratios) else { continue };
                let apparent = c.apparent_stiffness().unwrap_or(f64::NAN);
                rows.push(vec![
                    format!("{bias:.1}"),
                    name.into(),
                    format!("{:.0}", width_m * 1e3),
                    format!("{:.5}", c.slope()),
                    format!("{apparent:.4}"),
                ]);
            }
        }
    }
    Table {
        title: "cantilever, B^u = B^v = 1, B^h changed alone".into(),
        columns: vec!["b_bias", "direction", "width_mm", "droop_over_reach", "apparent_over_true"],
        rows,
    }
}

/// Hanging strips along the yarns and the bias against their analytic extension.
#[must_use]
pub fn hanging_strips() -> Table {
    let fabric = Fabric::from_paper_units([400e3, 600e3, 150e3, 1e3, 1e3, 1e3, 100.0]);
    let (s, t, h) = (fabric.stretch_warp_n_m, fabric.stretch_weft_n_m, fabric.shear_n_m);
    let stiffness = [s, t, 4.0 / (1.0 / s + 1.0 / t + 1.0 / h)];
    let mut rows = Vec::new();
    for ((degrees, name), stiffness) in DIRECTIONS.into_iter().zip(stiffness) {
        for cell_m in [10e-3, 5e-3, 2.5e-3] {
            let [measured, exact] = extension(&fabric, degrees, cell_m, stiffness);
            rows.push(vec![
                name.to_owned(),
                format!("{:.1}", cell_m * 1e3),
                format!("{:.5}", measured * 1e3),
                format!("{:.5}", exact * 1e3),
                format!("{:+.4}", 100.0 * (measured / exact - 1.0)),
            ]);
        }
    }
    Table {
        title: "strips 200 x 20 mm hanging under their own weight: extension of the lower three \
                quarters"
            .into(),
        columns: vec!["direction", "cell_mm", "extension_mm", "exact_mm", "error_percent"],
        rows,
    }
}

/// Extension of the lower three quarters of a hanging strip of 200 mm x 20 mm, measured
/// and exact \[m\]. The upper quarter is left out: there the clamp keeps a bias strip from
/// narrowing.
#[must_use]
pub fn extension(fabric: &Fabric, degrees: f64, cell_m: f64, stiffness_n_m: f64) -> [f64; 2] {
    let along = (0.2 / cell_m).round() as usize;
    let across = (0.02 / cell_m).round().max(3.0) as usize;
    let strip = hanging(fabric, &Cut { angle_rad: degrees.to_radians(), cell_m, along, across });
    let from = along / 4;
    let below_m = (along - from) as f64 * cell_m;
    let measured = strip.row_m(along).x - strip.row_m(from).x - below_m;
    let exact = fabric.density_kg_m2 * GRAVITY_M_S2 * below_m * below_m / (2.0 * stiffness_n_m);
    [measured, exact]
}

/// A piece of cloth on a tilted plate, mu = 0.3.
#[must_use]
pub fn friction() -> Table {
    const MU: f64 = 0.3;
    let mut rows = Vec::new();
    for over_mu in [0.5, 0.98, 0.99, 1.0, 1.01, 1.02, 1.5] {
        let slide = slide(&Fabric::mean_knit(), MU, MU * over_mu, 0.5);
        rows.push(vec![
            format!("{over_mu:.2}"),
            format!("{:.3}", slide.distance_m * 1e3),
            format!("{:.3}", slide.expected_m * 1e3),
        ]);
    }
    Table {
        title: "a 40 mm square, plate tilted within 0.3 s, then 0.5 s".into(),
        columns: vec!["slope_over_mu", "slid_mm", "coulomb_mm"],
        rows,
    }
}
