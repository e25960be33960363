//! What belongs to the experiment and not to the fabric: specimen, plate, tilt, and
//! the effects beyond six stiffnesses and a density.
//!
//! In: nothing but numbers (SI, simulation frame). Out: checks of them, and the maps
//! that the grid, the drop and the energies ask for. [`Experiment::default`] is the
//! modified Cusick drape with every effect off; with an effect off the energies are
//! those without it, bit for bit (`tests/physics_bits.rs`).

use crate::base::Vector3;
use crate::base::frame::{GRAVITY_M_S2, SPECIMEN_SIDE_M};
use crate::fabric::Fabric;
use crate::sim::plate::Plate;

/// The experiment that a drape comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Experiment {
    /// The specimen and how it lies on the plate.
    pub specimen: Specimen,
    /// The plate: radius, edge radius, friction.
    pub plate: Plate,
    /// How far the plate is from level. The simulation frame stays the plate's:
    /// y is its normal, and gravity tilts.
    pub tilt: Tilt,
    /// Natural curvature; zero for a fabric that is flat when weightless.
    #[serde(skip_serializing_if = "Curl::is_off")]
    pub curl: Curl,
    /// Bending that softens with curvature; zero for linear bending.
    pub softening: Softening,
    /// beta of the energy beta B h^2 k^4 / 4 per area that a fold across cells of side h
    /// costs besides: a correction of the mesh, not an effect of the cloth. Second
    /// differences make tight folds too soft; with 0.04 cantilever strips keep to 2 % from
    /// two cells a bending length on (`docs/validation.md`). 0: none.
    pub fold_correction: f64,
}

/// The outline of a specimen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outline {
    /// A rectangle, sheared by the skew.
    #[default]
    Rectangle,
    /// The disc inscribed in that rectangle, which must be a square without skew.
    Disc,
}

/// The specimen: its cut and its place.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Specimen {
    /// Rectangle or disc.
    pub outline: Outline,
    /// Extent along the warp (x), or the disc's diameter \[m\].
    pub warp_m: f64,
    /// Extent along the weft (z), or the disc's diameter \[m\].
    pub weft_m: f64,
    /// Angle by which the sides along z lean towards +x \[rad\]; 0: a right angle.
    pub skew_rad: f64,
    /// Place (x, z) of its centre on the plate \[m\].
    pub offset_m: [f64; 2],
    /// Turn about the plate's normal, from +x towards -z \[rad\].
    pub rotation_rad: f64,
}

impl Default for Specimen {
    fn default() -> Self {
        Self {
            outline: Outline::Rectangle,
            warp_m: SPECIMEN_SIDE_M,
            weft_m: SPECIMEN_SIDE_M,
            skew_rad: 0.0,
            offset_m: [0.0; 2],
            rotation_rad: 0.0,
        }
    }
}

impl Specimen {
    /// A flat point of the specimen (from its centre) where it lies on the plate.
    #[must_use]
    pub fn place(&self, flat: Vector3) -> Vector3 {
        let (sin, cos) = self.rotation_rad.sin_cos();
        let x = flat.x * cos + flat.z * sin + self.offset_m[0];
        let z = flat.z * cos - flat.x * sin + self.offset_m[1];
        Vector3::new(x, flat.y, z)
    }
}

/// How far the plate is from level.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Tilt {
    /// Angle by which the plate falls towards +x \[rad\].
    pub down_x_rad: f64,
    /// Angle by which the plate falls towards +z \[rad\].
    pub down_z_rad: f64,
}

impl Tilt {
    /// Against gravity, in the plate's frame; a unit vector.
    #[must_use]
    pub fn up(&self) -> Vector3 {
        let up = Vector3::new(-self.down_x_rad.tan(), 1.0, -self.down_z_rad.tan());
        up / up.norm()
    }
}

/// A component of the sheet's curvature. As a number it is the component's place in a node of a
/// [`Curl`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurvatureComponent {
    /// Curvature along the weft.
    Weft = 0,
    /// Curvature along the warp.
    Warp = 1,
    /// Twist.
    Twist = 2,
}

impl CurvatureComponent {
    /// The word used in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Weft => "weft",
            Self::Warp => "warp",
            Self::Twist => "twist",
        }
    }
}

/// Nodes of a [`Curl`] along one side of the specimen.
pub const CURL_NODES: usize = 5;

/// Natural curvature of the weightless sheet: positive where it curls towards its
/// face (up, +y, on the flat specimen). Given at 5 x 5 nodes evenly over the
/// specimen, bilinear between; `nodes[i][j]` has i along the warp, j along the weft.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Curl {
    /// Curvature along the weft, along the warp, and twist, at each node \[1/m\].
    pub nodes: [[[f64; 3]; CURL_NODES]; CURL_NODES],
    /// Besides, along the free edges.
    pub edge: EdgeCurl,
    /// Besides, along a line: a crease.
    pub line: LineCurl,
}

/// Natural curvature across the free edges, full at the edge and falling to nothing over a
/// width: a knit whose edges roll.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct EdgeCurl {
    /// Curvature at the edge, towards the face \[1/m\].
    pub curvature_per_m: f64,
    /// How far in from the edge it reaches \[m\].
    pub width_m: f64,
}

impl Default for EdgeCurl {
    fn default() -> Self {
        Self { curvature_per_m: 0.0, width_m: 10e-3 }
    }
}

/// Natural curvature across a straight line on the specimen, full on the line and falling to
/// nothing over a width on both sides: a crease. Weightless, it turns the cloth by curvature
/// times width.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct LineCurl {
    /// Curvature on the line, towards the face \[1/m\].
    pub curvature_per_m: f64,
    /// How far from the line it reaches \[m\].
    pub width_m: f64,
    /// Direction of the line, from the warp towards the weft \[rad\].
    pub angle_rad: f64,
    /// Distance of the line from the specimen's centre, to its left when looking along it with
    /// the warp to the right and the weft up \[m\].
    pub offset_m: f64,
}

impl Default for LineCurl {
    fn default() -> Self {
        Self { curvature_per_m: 0.0, width_m: 10e-3, angle_rad: 0.0, offset_m: 0.0 }
    }
}

impl Curl {
    /// The same curvature everywhere: along the weft, along the warp, twist \[1/m\].
    #[must_use]
    pub fn uniform(weft_warp_twist: [f64; 3]) -> Self {
        Self { nodes: [[weft_warp_twist; CURL_NODES]; CURL_NODES], ..Self::default() }
    }

    /// Whether it is zero everywhere.
    #[must_use]
    pub fn is_off(&self) -> bool {
        self.nodes.iter().flatten().flatten().all(|&k| k == 0.0)
            && self.edge.curvature_per_m == 0.0
            && self.line.curvature_per_m == 0.0
    }

    /// The field's curvature, without edges and line, at the fractions (along warp, along weft) of the specimen's
    /// sides, each in 0 to 1.
    #[must_use]
    pub fn at(&self, warp: f64, weft: f64) -> [f64; 3] {
        let split = |t: f64| {
            let at = t.clamp(0.0, 1.0) * (CURL_NODES - 1) as f64;
            let whole = (at.floor() as usize).min(CURL_NODES - 2);
            (whole, at - whole as f64)
        };
        let ((i, a), (j, b)) = (split(warp), split(weft));
        let n = &self.nodes;
        std::array::from_fn(|k| {
            (1.0 - a) * ((1.0 - b) * n[i][j][k] + b * n[i][j + 1][k])
                + a * ((1.0 - b) * n[i + 1][j][k] + b * n[i + 1][j + 1][k])
        })
    }
}

/// Bending that softens: the moment per width at curvature k is `B k (1 - s |k|)`,
/// the law of Feng et al. 2022 with s = -NL / L, up to the curvature at which the
/// tangent stiffness has fallen to a twentieth; from there on linear.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Softening {
    /// s for bending along the weft \[m\].
    pub weft_m: f64,
    /// s for bending along the warp \[m\].
    pub warp_m: f64,
    /// s for bending about a line at 45 degrees \[m\].
    pub bias_m: f64,
}

impl Softening {
    /// Whether bending is linear.
    #[must_use]
    pub fn is_off(&self) -> bool {
        *self == Self::default()
    }
}

/// A number of the experiment that cannot be simulated.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ExperimentFault {
    /// NaN, infinite, or outside its limits.
    #[error("{key} = {value} {unit} is outside {least} to {most} {unit}: give a value inside")]
    Outside {
        /// The number's name.
        key: &'static str,
        /// Its value in `unit`.
        value: f64,
        /// Least that is taken.
        least: f64,
        /// Most that is taken.
        most: f64,
        /// Unit.
        unit: &'static str,
    },
    /// A disc cut from something else than a square.
    #[error(
        "a disc needs equal extents and no skew, got {warp_mm} x {weft_mm} mm, skew {skew_deg} deg: \
         give the diameter as both extents"
    )]
    NoDisc {
        /// Extent along the warp \[mm\].
        warp_mm: f64,
        /// Extent along the weft \[mm\].
        weft_mm: f64,
        /// Skew \[degrees\].
        skew_deg: f64,
    },
}

/// All faults of one experiment.
#[derive(Clone, Debug, PartialEq)]
pub struct ExperimentError {
    /// At least one.
    pub faults: Vec<ExperimentFault>,
}

impl std::fmt::Display for ExperimentError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let lines: Vec<String> = self.faults.iter().map(ToString::to_string).collect();
        f.write_str(&lines.join("; "))
    }
}

impl std::error::Error for ExperimentError {}

impl Experiment {
    /// The standard Cusick drape: a disc of radius 150 mm on a plate of radius 90 mm.
    #[must_use]
    pub fn standard_cusick() -> Self {
        Self {
            specimen: Specimen { outline: Outline::Disc, ..Specimen::default() },
            plate: Plate { radius_m: 0.090, ..Plate::default() },
            ..Self::default()
        }
    }

    /// Checks that the experiment can be simulated.
    ///
    /// # Errors
    /// All faults at once: numbers that are not finite or outside their limits.
    pub fn check(&self) -> Result<(), ExperimentError> {
        let (s, p) = (&self.specimen, &self.plate);
        let degrees = f64::to_degrees;
        let rows = [
            ("specimen.warp", s.warp_m * 1e3, 20.0, 1000.0, "mm"),
            ("specimen.weft", s.weft_m * 1e3, 20.0, 1000.0, "mm"),
            ("specimen.skew", degrees(s.skew_rad), -30.0, 30.0, "deg"),
            ("specimen.offset_x", s.offset_m[0] * 1e3, -100.0, 100.0, "mm"),
            ("specimen.offset_z", s.offset_m[1] * 1e3, -100.0, 100.0, "mm"),
            ("specimen.rotation", degrees(s.rotation_rad), -360.0, 360.0, "deg"),
            ("plate.radius", p.radius_m * 1e3, 5.0, 500.0, "mm"),
            ("plate.edge_radius", p.edge_radius_m * 1e3, 0.5, p.radius_m * 1e3, "mm"),
            ("plate.gap", p.gap_m * 1e3, 0.05, 5.0, "mm"),
            ("plate.friction", p.friction, 0.0, 5.0, ""),
            ("plate.slip", p.slip_m * 1e3, 1e-3, 5.0, "mm"),
            ("tilt.down_x", degrees(self.tilt.down_x_rad), -60.0, 60.0, "deg"),
            ("tilt.down_z", degrees(self.tilt.down_z_rad), -60.0, 60.0, "deg"),
            ("fold_correction", self.fold_correction, 0.0, 1.0, ""),
            ("softening.weft", self.softening.weft_m * 1e3, 0.0, 100.0, "mm"),
            ("softening.warp", self.softening.warp_m * 1e3, 0.0, 100.0, "mm"),
            ("softening.bias", self.softening.bias_m * 1e3, 0.0, 100.0, "mm"),
        ];
        let (edge, line) = (self.curl.edge, self.curl.line);
        let bands = [
            ("curl.edge", edge.curvature_per_m, -500.0, 500.0, "1/m"),
            ("curl.edge_width", edge.width_m * 1e3, 0.5, 100.0, "mm"),
            ("curl.line", line.curvature_per_m, -500.0, 500.0, "1/m"),
            ("curl.line_width", line.width_m * 1e3, 0.5, 100.0, "mm"),
            ("curl.line_angle", degrees(line.angle_rad), -360.0, 360.0, "deg"),
            ("curl.line_offset", line.offset_m * 1e3, -500.0, 500.0, "mm"),
        ];
        let curls = self.curl.nodes.iter().flatten().flatten();
        let curls = curls.map(|&k| ("curl", k, -500.0, 500.0, "1/m"));
        let mut faults: Vec<_> = rows
            .into_iter()
            .chain(bands)
            .chain(curls)
            .filter(|&(_, value, least, most, _)| !(least..=most).contains(&value))
            .map(|(key, value, least, most, unit)| ExperimentFault::Outside {
                key,
                value,
                least,
                most,
                unit,
            })
            .collect();
        if s.outline == Outline::Disc && (s.warp_m != s.weft_m || s.skew_rad != 0.0) {
            let (warp_mm, weft_mm) = (s.warp_m * 1e3, s.weft_m * 1e3);
            let skew_deg = degrees(s.skew_rad);
            faults.push(ExperimentFault::NoDisc { warp_mm, weft_mm, skew_deg });
        }
        if faults.is_empty() { Ok(()) } else { Err(ExperimentError { faults }) }
    }
}

/// Something about a drape that its reader should know.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MeshWarning {
    /// The folds are as fine as the mesh.
    #[error(
        "the shortest bending length is {length_mm:.1} mm, below {limit_mm:.1} mm, two cells of \
         {cell_mm:.1} mm: the folds depend on the mesh; use at least {vertices} vertices a side"
    )]
    TooCoarse {
        /// Shortest bending length of the fabric \[mm\].
        length_mm: f64,
        /// Two cells \[mm\].
        limit_mm: f64,
        /// Side of a cell \[mm\].
        cell_mm: f64,
        /// Vertices a side at which the warning goes away.
        vertices: usize,
    },
}

/// Cells that a bending length must span: from there on a cantilever's droop is within 4 %
/// of the elastica's, within 2 % with the fold correction (`docs/validation.md`, "Physics").
pub const CELLS_PER_BENDING_LENGTH: f64 = 2.0;

/// The shortest of the three bending lengths (B / (D g))^(1/3) \[m\].
#[must_use]
pub fn bending_length_m(fabric: &Fabric) -> f64 {
    let rigidity = fabric.bending_weft_nm.min(fabric.bending_warp_nm).min(fabric.bending_bias_nm);
    (rigidity / (fabric.density_kg_m2 * GRAVITY_M_S2)).cbrt()
}

/// What is to be said about draping `fabric` on cells of `cell_m`, `vertices` a side.
#[must_use]
pub fn mesh_warnings(fabric: &Fabric, cell_m: f64, vertices: usize) -> Vec<MeshWarning> {
    let length_m = bending_length_m(fabric);
    let limit_m = CELLS_PER_BENDING_LENGTH * cell_m;
    // a bending length of exactly two cells is enough, whatever its last bit
    if length_m >= limit_m * (1.0 - 1e-9) {
        return Vec::new();
    }
    let cells = (vertices - 1) as f64 * limit_m / length_m;
    vec![MeshWarning::TooCoarse {
        length_mm: length_m * 1e3,
        limit_mm: limit_m * 1e3,
        cell_mm: cell_m * 1e3,
        vertices: cells.ceil() as usize + 1,
    }]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_sound_and_every_bad_number_is_named() {
        assert_eq!(Experiment::default().check(), Ok(()));
        assert_eq!(Experiment::standard_cusick().check(), Ok(()));
        let mut bad = Experiment::default();
        bad.specimen.warp_m = f64::NAN;
        bad.plate.friction = -0.1;
        bad.tilt.down_z_rad = 2.0;
        bad.softening.bias_m = f64::INFINITY;
        bad.curl.nodes[2][3][1] = 1e6;
        bad.curl.edge.width_m = 0.0;
        bad.curl.line.curvature_per_m = f64::NAN;
        let error = bad.check().unwrap_err();
        let keys = [
            "specimen.warp",
            "plate.friction",
            "tilt.down_z",
            "softening.bias",
            "curl",
            "curl.edge_width",
            "curl.line",
        ];
        assert_eq!(error.faults.len(), keys.len(), "{error}");
        for key in keys {
            assert!(error.to_string().contains(key), "{error}");
        }
        let mut disc = Experiment::standard_cusick();
        disc.specimen.weft_m = 0.2;
        assert!(matches!(disc.check().unwrap_err().faults[..], [ExperimentFault::NoDisc { .. }]));
    }

    #[test]
    fn a_mesh_too_coarse_is_told_with_value_limit_and_remedy() {
        let fabric = Fabric::from_paper_units([1e5, 1e5, 1e5, 100.0, 200.0, 150.0, 200.0]);
        let length_m = bending_length_m(&fabric);
        assert!((length_m - (1e-7_f64 / (0.2 * GRAVITY_M_S2)).cbrt()).abs() < 1e-12);
        let warnings = mesh_warnings(&fabric, 0.005, 61);
        let [MeshWarning::TooCoarse { limit_mm, vertices, .. }] = warnings[..] else {
            panic!("{warnings:?}")
        };
        assert!((limit_mm - 10.0).abs() < 1e-12);
        let cell_m = 0.3 / (vertices - 1) as f64;
        assert_eq!(mesh_warnings(&fabric, cell_m, vertices), []);
        assert_eq!(mesh_warnings(&fabric, 0.3 / (vertices - 2) as f64, vertices - 1).len(), 1);
        assert!(warnings[0].to_string().contains("vertices a side"), "{}", warnings[0]);
    }

    #[test]
    fn a_curl_is_linear_between_its_nodes_and_reaches_them() {
        let mut curl = Curl::default();
        assert!(curl.is_off());
        for i in 0..CURL_NODES {
            for j in 0..CURL_NODES {
                curl.nodes[i][j] = [i as f64 + 10.0 * j as f64, 1.0, -(j as f64)];
            }
        }
        for (warp, weft) in [(0.0, 0.0), (1.0, 1.0), (0.3, 0.8), (0.25, 0.5)] {
            let [a, b, c] = curl.at(warp, weft);
            assert!((a - 4.0 * warp - 40.0 * weft).abs() < 1e-12);
            assert!((b - 1.0).abs() < 1e-12 && (c + 4.0 * weft).abs() < 1e-12);
        }
    }

    #[test]
    fn a_tilted_plate_falls_where_it_says() {
        let up = Tilt { down_x_rad: 0.1, down_z_rad: 0.0 }.up();
        assert!((up.norm() - 1.0).abs() < 1e-15 && up.x < 0.0);
        assert!((-up.x / up.y - 0.1_f64.tan()).abs() < 1e-15);
        assert_eq!(Tilt::default().up(), Vector3::y());
    }
}
