//! What belongs to the experiment and not to the fabric: specimen, plate, tilt, and
//! the effects beyond six stiffnesses and a density.
//!
//! In: nothing but numbers (SI, simulation frame), whose limits stand in `parameters.rs`. Out: the
//! maps that the grid, the drop and the energies ask for. [`Experiment::default`] is the
//! modified Cusick drape with every effect off; with an effect off the energies are
//! those without it, bit for bit (`tests/physics/bits.rs`).

mod bending;
mod mesh;
mod nodes;
mod uneven;

pub use bending::{AsymmetricBending, Hysteresis, Softening};
pub use mesh::{CELLS_PER_BENDING_LENGTH, MeshWarning, bending_length_m, mesh_warnings};
pub use nodes::{CURL_NODES, NodeField};
pub use uneven::{Draught, Hem, Seam, StiffnessGradient, Uneven};

use nodes::bilinear;

use crate::base::Vector3;
use crate::base::frame::SPECIMEN_SIDE_M;
use crate::sim::plate::Plate;

/// Everything that a drape depends on apart from the fabric: the specimen's cut and place, the
/// plate, and the effects beyond seven parameters. The default is the modified Cusick drape with
/// every effect off. Read from a file, what is left out is as in the default, and a key that is not
/// known is an error.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Experiment {
    /// The specimen and how it lies on the plate.
    pub specimen: Specimen,
    /// The plate: its radius, its edge and its friction.
    pub plate: Plate,
    /// How far the plate is from level. The simulation frame stays the plate's: y is its normal,
    /// and it is gravity that tilts.
    pub tilt: Tilt,
    /// Natural curvature of the sheet; zero for a fabric that is flat when weightless.
    #[serde(skip_serializing_if = "Curl::is_off")]
    pub curl: Curl,
    /// Bending that softens with curvature; zero for linear bending.
    pub softening: Softening,
    /// Bending that is stiffer towards one face than towards the other; zero for a fabric with
    /// equal faces.
    #[serde(skip_serializing_if = "AsymmetricBending::is_off")]
    pub asymmetric_bending: AsymmetricBending,
    /// Friction inside the cloth against bending; zero for bending that is elastic.
    #[serde(skip_serializing_if = "Hysteresis::is_off")]
    pub hysteresis: Hysteresis,
    /// What makes one part of the drape unlike another; nothing for even cloth in still air. No fit
    /// knows of it.
    #[serde(skip_deserializing, skip_serializing_if = "Uneven::is_off")]
    pub uneven: Uneven,
    /// The factor beta of the energy beta B h^2 k^4 / 4 per area that a fold of curvature k costs
    /// in addition on cells of side h. It corrects the mesh and is no effect of the cloth: second
    /// differences make tight folds too soft. With 0.04 cantilever strips keep to 2 % from two
    /// cells a bending length on (`docs/validation/simulator.md`); with 0 nothing is corrected.
    pub fold_correction: f64,
}

/// The outline of a specimen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outline {
    /// A rectangle, sheared by the skew.
    #[default]
    Rectangle,
    /// The disc inscribed in that rectangle, which must be a square without skew.
    Disc,
}

/// The specimen: how it is cut and how it lies on the plate.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Specimen {
    /// Whether it is a rectangle or a disc.
    pub outline: Outline,
    /// Extent along the warp (x), or the disc's diameter \[m\].
    pub warp_m: f64,
    /// Extent along the weft (z), or the disc's diameter \[m\].
    pub weft_m: f64,
    /// Angle by which the sides along z lean towards +x \[rad\]; 0 for right angles.
    pub skew_rad: f64,
    /// Place (x, z) of the specimen's centre, from the plate's \[m\].
    pub offset_m: [f64; 2],
    /// Rotation of the specimen about the plate's normal, from +x towards -z \[rad\].
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
    /// Where a point of the flat specimen, given from the specimen's centre, lies on the plate
    /// \[m\].
    #[must_use]
    pub fn place(&self, flat: Vector3) -> Vector3 {
        let (sin, cos) = self.rotation_rad.sin_cos();
        let x = flat.x * cos + flat.z * sin + self.offset_m[0];
        let z = flat.z * cos - flat.x * sin + self.offset_m[1];
        Vector3::new(x, flat.y, z)
    }

    /// Distance of the specimen's last point from its centre along a bearing on the flat specimen,
    /// from the warp towards the weft \[m\].
    #[must_use]
    pub fn reach_m(&self, toward_rad: f64) -> f64 {
        let (sin, cos) = toward_rad.sin_cos();
        match self.outline {
            Outline::Disc => 0.5 * self.weft_m,
            Outline::Rectangle => {
                let along_weft = cos * self.skew_rad.tan() + sin;
                0.5 * (self.warp_m * cos.abs() + self.weft_m * along_weft.abs())
            }
        }
    }

    /// Flat (x, z), from the specimen's centre, of the point that [`Self::place`] lays on the
    /// plate's centre \[m\].
    #[must_use]
    pub fn plate_centre_m(&self) -> [f64; 2] {
        let (sin, cos) = self.rotation_rad.sin_cos();
        let [x, z] = self.offset_m;
        [sin * z - cos * x, -sin * x - cos * z]
    }
}

/// How far the plate is from level.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Tilt {
    /// Angle by which the plate falls towards +x \[rad\].
    pub down_x_rad: f64,
    /// Angle by which the plate falls towards +z \[rad\].
    pub down_z_rad: f64,
}

impl Tilt {
    /// The unit vector against gravity, in the plate's frame.
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

/// Natural curvature: how the sheet curls when it is weightless. It is positive where the sheet
/// curls towards its face, which is up (+y) on the flat specimen.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Curl {
    /// Curvature along the weft, along the warp, and twist \[1/m\], in the order of
    /// [`CurvatureComponent`], at 5 x 5 nodes evenly over the specimen: `nodes[i][j]` is node i
    /// along the warp and j along the weft. Between nodes the curvature is bilinear.
    pub nodes: [[[f64; 3]; CURL_NODES]; CURL_NODES],
    /// Curvature along the free edges, added to that of the nodes.
    pub edge: EdgeCurl,
    /// Curvature along a line, a crease, added to that of the nodes.
    pub line: LineCurl,
    /// The same along a second line, as of a specimen that was folded twice. Where it is left out
    /// it lies along the weft.
    pub cross_line: LineCurl,
}

impl Default for Curl {
    /// None, its lines along warp and weft through the specimen's middle.
    fn default() -> Self {
        Self {
            nodes: Default::default(),
            edge: EdgeCurl::default(),
            line: LineCurl::default(),
            cross_line: LineCurl { angle_rad: std::f64::consts::FRAC_PI_2, ..LineCurl::default() },
        }
    }
}

/// Natural curvature across the free edges, as of a knit whose edges roll: full at the edge, and
/// falling linearly to zero over a width.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct EdgeCurl {
    /// Curvature at the edge, positive towards the face \[1/m\].
    pub curvature_per_m: f64,
    /// Distance from the edge at which the curvature has fallen to zero \[m\].
    pub width_m: f64,
}

impl Default for EdgeCurl {
    fn default() -> Self {
        Self { curvature_per_m: 0.0, width_m: 10e-3 }
    }
}

/// Natural curvature across a straight line on the specimen, a crease: full on the line, and
/// falling linearly to zero over a width on both sides. Weightless cloth is bent by the angle
/// curvature times width.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct LineCurl {
    /// Curvature on the line, positive towards the face \[1/m\].
    pub curvature_per_m: f64,
    /// Distance from the line at which the curvature has fallen to zero \[m\].
    pub width_m: f64,
    /// Direction of the line, from the warp towards the weft \[rad\].
    pub angle_rad: f64,
    /// Distance of the line from the specimen's centre, to its left when looking along it with
    /// the warp to the right and the weft up \[m\].
    pub offset_m: f64,
}

impl LineCurl {
    /// That of the same cloth turned over about its warp; one that is off stays where it is.
    fn face_down(self) -> Self {
        if self.curvature_per_m == 0.0 {
            return self;
        }
        Self {
            curvature_per_m: -self.curvature_per_m,
            angle_rad: -self.angle_rad,
            offset_m: -self.offset_m,
            width_m: self.width_m,
        }
    }
}

impl Default for LineCurl {
    fn default() -> Self {
        Self { curvature_per_m: 0.0, width_m: 10e-3, angle_rad: 0.0, offset_m: 0.0 }
    }
}

impl Curl {
    /// A natural curvature that is the same everywhere: along the weft, along the warp, twist
    /// \[1/m\].
    #[must_use]
    pub fn uniform(weft_warp_twist: [f64; 3]) -> Self {
        Self { nodes: [[weft_warp_twist; CURL_NODES]; CURL_NODES], ..Self::default() }
    }

    /// Whether the natural curvature is zero everywhere.
    #[must_use]
    pub fn is_off(&self) -> bool {
        self.nodes.iter().flatten().flatten().all(|&k| k == 0.0)
            && self.edge.curvature_per_m == 0.0
            && self.line.curvature_per_m == 0.0
            && self.cross_line.curvature_per_m == 0.0
    }

    /// That of the same cloth turned over about its warp: curvatures change their sign, places on
    /// the cloth are mirrored along the weft. A twist does both and stays what it is.
    #[must_use]
    pub fn face_down(&self) -> Self {
        let node = |i: usize, j: usize| {
            let [weft, warp, twist] = self.nodes[i][CURL_NODES - 1 - j];
            [-weft, -warp, twist]
        };
        let edge = self.edge;
        Self {
            nodes: std::array::from_fn(|i| std::array::from_fn(|j| node(i, j))),
            edge: EdgeCurl { curvature_per_m: -edge.curvature_per_m, ..edge },
            line: self.line.face_down(),
            cross_line: self.cross_line.face_down(),
        }
    }

    /// The curvature of the nodes' field \[1/m\], without that of edges and line, at a place given
    /// as fractions of the specimen's sides along the warp and along the weft, 0 to 1 each.
    #[must_use]
    pub fn at(&self, warp: f64, weft: f64) -> [f64; 3] {
        std::array::from_fn(|k| bilinear(warp, weft, |i, j| self.nodes[i][j][k]))
    }
}

/// A number of the experiment that cannot be simulated.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ExperimentFault {
    /// A number is NaN, infinite, or outside its limits.
    #[error("{key} = {value} {unit} is outside {least} to {most} {unit}: give a value inside")]
    Outside {
        /// Name of the number.
        key: &'static str,
        /// Value of the number, in `unit`.
        value: f64,
        /// Least value that can be simulated, in `unit`.
        least: f64,
        /// Largest value that can be simulated, in `unit`.
        most: f64,
        /// Unit in which the number is given.
        unit: &'static str,
    },
    /// A disc is to be cut from something else than a square.
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
    /// The specimen's centre of mass lies beyond the plate's edge.
    #[error(
        "specimen.offset puts the centre of mass {distance_mm:.1} mm from the plate's axis, and the \
         plate ends at {radius_mm:.1} mm: the specimen falls off; give less"
    )]
    FallsOff {
        /// Distance of the specimen's centre from the plate's axis \[mm\].
        distance_mm: f64,
        /// Radius of the plate \[mm\].
        radius_mm: f64,
    },
}

/// Why an experiment cannot be simulated: all of its faults.
#[derive(Clone, Debug, PartialEq)]
pub struct ExperimentError {
    /// The faults, at least one.
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

    /// The same with the specimen turned over about its warp: what belongs to the cloth changes its
    /// sign or its side, what belongs to the plate and to the room stays.
    #[must_use]
    pub fn face_down(&self) -> Self {
        Self {
            // 0 - x: no skew stays a zero without a sign
            specimen: Specimen { skew_rad: 0.0 - self.specimen.skew_rad, ..self.specimen },
            curl: self.curl.face_down(),
            asymmetric_bending: self.asymmetric_bending.face_down(),
            uneven: self.uneven.face_down(),
            ..*self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again_and_unknown_keys_are_refused() {
        let mut changed = Experiment::default();
        changed.plate.friction = 0.2;
        changed.specimen.outline = Outline::Disc;
        changed.curl.edge.curvature_per_m = 30.0;
        let text = serde_json::to_string(&changed).unwrap();
        assert_eq!(serde_json::from_str::<Experiment>(&text).unwrap(), changed);
        let part: Experiment = serde_json::from_str(r#"{"plate": {"friction": 0.2}}"#).unwrap();
        assert_eq!(part.plate.radius_m, Experiment::default().plate.radius_m);
        for unknown in [r#"{"plates": {}}"#, r#"{"plate": {"radius": 0.05}}"#, r#"{"uneven": {}}"#]
        {
            let error = serde_json::from_str::<Experiment>(unknown).unwrap_err().to_string();
            assert!(error.contains("unknown field"), "{error}");
        }
    }

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
        bad.asymmetric_bending.warp = -0.9;
        bad.hysteresis = Hysteresis { weft_n: -1e-4, warp_n: 0.0, slip_per_m: 0.0 };
        bad.uneven.draught.pressure_pa = -1.0;
        bad.uneven.seam.width_m = 0.0;
        let error = bad.check().unwrap_err();
        let keys = [
            "specimen.warp",
            "plate.friction",
            "tilt.down_z",
            "softening.bias",
            "curl",
            "curl.edge_width",
            "curl.line",
            "asymmetric_bending.warp",
            "hysteresis.weft",
            "hysteresis.slip",
            "uneven.seam_width",
            "uneven.draught",
        ];
        assert_eq!(error.faults.len(), keys.len(), "{error}");
        for key in keys {
            assert!(error.to_string().contains(key), "{error}");
        }
        let mut disc = Experiment::standard_cusick();
        disc.specimen.weft_m = 0.2;
        assert!(matches!(disc.check().unwrap_err().faults[..], [ExperimentFault::NoDisc { .. }]));
        let mut off = Experiment::default();
        off.specimen.offset_m = [0.03, -0.03];
        assert_eq!(off.check(), Ok(()));
        off.specimen.offset_m = [0.03, -0.04];
        let error = off.check().unwrap_err();
        assert!(matches!(error.faults[..], [ExperimentFault::FallsOff { .. }]), "{error}");
        assert!(error.to_string().contains("50.0 mm from the plate's axis"), "{error}");
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
