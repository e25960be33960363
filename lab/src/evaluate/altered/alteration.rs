//! What is altered in a scan that is not quite the experiment.

use rand::RngExt as _;

use super::cloth;
use scan2params::base::units::M_PER_MM;
use scan2params::base::{Vector3, seed};
use scan2params::geom::Mesh;
use scan2params::sensor::VirtualScan;
use scan2params::sim::Experiment;

/// What is altered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Alteration {
    /// Nothing.
    Valid,
    /// The specimen lies off the plate's centre.
    OffCentre,
    /// The plate is not level.
    Tilted,
    /// The plate is of another radius.
    OtherPlate,
    /// The specimen is of another size.
    OtherSpecimen,
    /// All lengths are wrong by a factor.
    Scaled,
    /// Heights are.
    VerticallyScaled,
    /// The cloud is sheared, to the side with the height or within the plate's plane.
    Sheared,
    /// The cloth is smoothed, as meshing programs do.
    Smoothed,
    /// It is slit from an edge.
    Slit,
    /// A corner is folded over or under.
    FoldedCorner,
    /// A strip along an edge is missing.
    CutEdge,
    /// The mean of two fabrics' drapes.
    Blended,
    /// A skirt with even pleats.
    Pleats,
    /// A cone.
    Cone,
    /// A bell.
    Bell,
}

/// By how much something is altered.
#[derive(Clone, Copy, Debug)]
pub struct Amount {
    /// How much \[`unit`\].
    pub value: f64,
    /// Unit of the value; empty for factors and counts.
    pub unit: &'static str,
    /// Where it points \[rad\].
    pub toward_rad: f64,
}

impl Alteration {
    /// All but [`Self::Valid`].
    pub const ALTERED: [Self; 15] = [
        Self::OffCentre,
        Self::Tilted,
        Self::OtherPlate,
        Self::OtherSpecimen,
        Self::Scaled,
        Self::VerticallyScaled,
        Self::Sheared,
        Self::Smoothed,
        Self::Slit,
        Self::FoldedCorner,
        Self::CutEdge,
        Self::Blended,
        Self::Pleats,
        Self::Cone,
        Self::Bell,
    ];

    /// The alteration of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        std::iter::once(Self::Valid).chain(Self::ALTERED).find(|kind| kind.name() == name)
    }

    /// The word in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.row().0
    }

    /// The codes of grounds and the variants of [`scan2params::scan::ScanError`] that name it.
    #[must_use]
    pub fn right_names(self) -> &'static [&'static str] {
        self.row().1
    }

    /// Name; which names of a refusal or a ground are right.
    fn row(self) -> (&'static str, &'static [&'static str]) {
        match self {
            Self::Valid => ("valid", &[]),
            Self::OffCentre => ("off_centre", &["off_centre"]),
            Self::Tilted => ("tilted", &["tilted"]),
            Self::OtherPlate => ("other_plate", &["plate_radius"]),
            Self::OtherSpecimen => {
                ("other_specimen", &["scale", "width", "side_length", "WrongSize"])
            }
            Self::Scaled | Self::VerticallyScaled => {
                let name = if self == Self::Scaled { "scaled" } else { "vertically_scaled" };
                (name, &["scale", "width", "side_length", "WrongSize", "SideLength"])
            }
            Self::Sheared => (
                "sheared",
                &[
                    "width",
                    "side_length",
                    "SideLength",
                    "uneven_sides",
                    "UnevenSides",
                    "NotASquare",
                    "Strained",
                ],
            ),
            Self::Smoothed => {
                ("smoothed", &["scale", "width", "side_length", "WrongSize", "Strained"])
            }
            Self::Slit => ("slit", &["unexplained_cloth", "Unexplained", "Gap", "rim_bridged"]),
            Self::FoldedCorner | Self::CutEdge => {
                let name = if self == Self::CutEdge { "cut_edge" } else { "folded_corner" };
                let names: &[&str] = &[
                    "side_length",
                    "SideLength",
                    "uneven_sides",
                    "UnevenSides",
                    "width",
                    "NotASquare",
                    "Unexplained",
                    "unexplained_cloth",
                    // Both ask whether the cloth is cut or folded there.
                    "TooLittleRim",
                    "Gap",
                ];
                (name, names)
            }
            Self::Blended => ("blended", Self::NO_CLOTH),
            Self::Pleats => ("pleats", Self::NO_CLOTH),
            Self::Cone => ("cone", Self::NO_CLOTH),
            Self::Bell => ("bell", Self::NO_CLOTH),
        }
    }

    /// What says of a surface that no hanging cloth has it.
    const NO_CLOTH: &'static [&'static str] = &[
        "Misfit",
        "Unexplained",
        "NoPlate",
        "WrongSize",
        "Strained",
        "width",
        "novel_rim",
        "folds_for_bending",
        "model_misfit",
    ];

    /// Whether the cloth is a fabric's drape, so that there is a truth.
    #[must_use]
    pub fn is_of_cloth(self) -> bool {
        self.right_names() != Self::NO_CLOTH
    }

    /// Draws by how much.
    #[must_use]
    pub fn draw(self, rng: &mut seed::Rng) -> Amount {
        let mut between = |ranges: &[[f64; 2]]| {
            let [low, high] = ranges[rng.random_range(0..ranges.len())];
            rng.random_range(low..high)
        };
        let (value, unit) = match self {
            Self::Valid => (0.0, ""),
            Self::OffCentre => (between(&[[5.0, 30.0]]), "mm"),
            Self::Tilted => (between(&[[2.0, 8.0]]), "deg"),
            Self::OtherPlate => (between(&[[40.0, 48.0], [52.0, 60.0]]), "mm"),
            Self::OtherSpecimen => (between(&[[250.0, 294.0], [306.0, 330.0]]), "mm"),
            Self::Scaled | Self::VerticallyScaled => (between(&[[0.90, 0.98], [1.02, 1.10]]), ""),
            Self::Sheared => (between(&[[0.03, 0.12]]), ""),
            Self::Smoothed => (between(&[[3.0, 12.0]]), "mm"),
            Self::Slit => (between(&[[30.0, 100.0]]), "mm"),
            Self::FoldedCorner => (between(&[[15.0, 50.0]]), "mm"),
            Self::CutEdge => (between(&[[4.0, 20.0]]), "mm"),
            Self::Blended => (between(&[[0.3, 0.7]]), ""),
            Self::Pleats => (between(&[[5.0, 15.0]]).floor(), ""),
            Self::Cone | Self::Bell => (between(&[[30.0, 80.0]]), "deg"),
        };
        Amount { value, unit, toward_rad: rng.random_range(0.0..std::f64::consts::TAU) }
    }

    /// The bench that has to be simulated, if it is the bench that is altered.
    #[must_use]
    pub fn bench(self, amount: &Amount) -> Option<Experiment> {
        let mut bench = Experiment::default();
        let (sin, cos) = amount.toward_rad.sin_cos();
        match self {
            Self::OffCentre => {
                bench.specimen.offset_m = [cos, sin].map(|share| share * amount.value * M_PER_MM);
            }
            Self::Tilted => {
                bench.tilt.down_x_rad = cos * amount.value.to_radians();
                bench.tilt.down_z_rad = sin * amount.value.to_radians();
            }
            Self::OtherPlate => bench.plate.radius_m = amount.value * M_PER_MM,
            Self::OtherSpecimen => {
                bench.specimen.warp_m = amount.value * M_PER_MM;
                bench.specimen.weft_m = amount.value * M_PER_MM;
            }
            _ => return None,
        }
        Some(bench)
    }

    /// The cloth, altered; `other` is another fabric's drape on as many vertices.
    #[must_use]
    pub fn deform(self, amount: &Amount, own: &Mesh, other: &Mesh, rng: &mut seed::Rng) -> Mesh {
        let length_m = amount.value * M_PER_MM;
        let mut mesh = own.clone();
        match self {
            Self::Smoothed => cloth::smooth(&mut mesh, length_m),
            Self::Slit => cloth::slit(&mut mesh, length_m, rng),
            Self::FoldedCorner => cloth::fold_corner(&mut mesh, length_m, rng),
            Self::CutEdge => cloth::cut_edge(&mut mesh, length_m, rng),
            Self::Blended => {
                for (p, q) in mesh.vertices.iter_mut().zip(&other.vertices) {
                    *p += (q - *p) * amount.value;
                }
            }
            Self::Pleats => cloth::pleats(&mut mesh, amount.value, amount.toward_rad, rng),
            Self::Cone => cloth::bell(&mut mesh, amount.value.to_radians(), 1e-3),
            Self::Bell => cloth::bell(&mut mesh, amount.value.to_radians(), 40e-3),
            _ => {}
        }
        mesh
    }

    /// What it does to the cloud.
    pub fn spoil(self, amount: &Amount, made: &mut VirtualScan) {
        let (truth, value) = (made.truth, amount.value);
        let aside = Vector3::new(amount.toward_rad.cos(), 0.0, amount.toward_rad.sin());
        let within_plane = amount.toward_rad.sin() > 0.0;
        let moved = |p: Vector3| match self {
            Self::Scaled => p * value,
            Self::VerticallyScaled => Vector3::new(p.x, p.y * value, p.z),
            Self::Sheared if within_plane => p + Vector3::x() * (value * p.z),
            Self::Sheared => p + aside * (value * p.y),
            _ => p,
        };
        let back = truth.simulation_from_scanner.inverse();
        for point in &mut made.cloud.points {
            let p = moved(truth.to_simulation_m(point).coords);
            *point = back * scan2params::base::Point3::from(p) / truth.unit_m;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_right_name_is_a_code_or_a_variant() {
        let source = include_str!("../../../../src/scan/error.rs");
        let codes = scan2params::job::verdict::Code::ALL;
        for kind in Alteration::ALTERED {
            for name in kind.right_names() {
                let code = codes.iter().any(|code| code.name() == *name);
                let variant = source.contains(&format!("\n    {name} {{"));
                assert!(code || variant, "{}: {name}", kind.name());
            }
            assert_eq!(Alteration::named(kind.name()), Some(kind));
        }
    }
}
