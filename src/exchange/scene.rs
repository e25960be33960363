//! The whole experiment for another program (`export --scene`): plate, cloth, gravity, friction and
//! the solver's settings, so that the drape comes to rest there without further input.
//!
//! In: a fabric, the experiment's name ([`Scene`]), the length of the mesh's edges. Out: a file
//! that the program runs. The plate is this simulator's, a disc with a rounded edge; the cloth starts
//! level above it, with the unevenness of the canonical drop. The scene's frame has z up, x along
//! the warp and y along the weft, against the simulation frame's z; its origin is the centre of the
//! plate's top. Lengths are in metres.
//!
//! The cloth's mesh is `cloth_mesh`'s, the same for all programs: what differs between them is
//! their physics. One file here per target says how its contact is set so that the cloth rests half
//! a gap above the plate, as it does in this simulator.

mod blender;
mod cloth_mesh;
mod mujoco;
mod newton;
mod python;

pub(super) use cloth_mesh::ClothMesh;

use super::Target;
use super::exported::{ExchangeError, Exported, Options};
use crate::base::frame::GRAVITY_M_S2;
use crate::fabric::params::Params;
use crate::sim::experiment::{Experiment, Outline};
use crate::sim::plate::Plate;

/// Length of the cloth's edges where it is not given \[m\].
const EDGE_M: f64 = 0.010;
/// Limits of the edges \[m\]: the cloth has 60 to 40,000 vertices.
const EDGES_M: [f64; 2] = [1.5e-3, 40e-3];
/// Share of its speed that cloth loses to the air in a second \[1/s\], a choice: the rest does not
/// depend on it.
const DRAG_PER_S: f64 = 6.0;
/// Corners around the plate's edge, and steps over its rounding.
const AROUND: usize = 96;
const OVER: usize = 6;

/// An experiment that is written as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scene {
    /// The experiment of this program: a square of 300 mm on a plate of radius 50 mm.
    Drape,
    /// The standard Cusick drape: a disc of 300 mm on a plate of radius 90 mm.
    Cusick,
}

impl Scene {
    /// All scenes.
    pub const ALL: [Self; 2] = [Self::Drape, Self::Cusick];

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Drape => "drape",
            Self::Cusick => "cusick",
        }
    }

    /// What it is, in a line.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Drape => "A square of 300 mm on a plate of radius 50 mm",
            Self::Cusick => "A disc of 300 mm on a plate of radius 90 mm",
        }
    }

    /// The experiment, with every effect off.
    #[must_use]
    pub fn experiment(self) -> Experiment {
        match self {
            Self::Drape => Experiment::default(),
            Self::Cusick => Experiment::standard_cusick(),
        }
    }
}

/// What every program's file is made of.
struct Bench {
    scene: Scene,
    plate: Plate,
    friction: f64,
    cloth: ClothMesh,
    /// Mass of the cloth \[kg\].
    mass_kg: f64,
}

impl Bench {
    fn new(scene: Scene, params: &Params, options: &Options) -> Result<Self, ExchangeError> {
        let edge_m = options.edge_m.unwrap_or(EDGE_M);
        if !(EDGES_M[0]..=EDGES_M[1]).contains(&edge_m) {
            let value = edge_m * 1e3;
            let limits = "1.5 to 40 mm with --scene";
            return Err(ExchangeError::Given { flag: "--edge-mm", value, limits });
        }
        let Experiment { specimen, plate, .. } = scene.experiment();
        let cloth = match specimen.outline {
            Outline::Rectangle => ClothMesh::square(specimen.warp_m, edge_m),
            Outline::Disc => ClothMesh::disc(0.5 * specimen.warp_m, edge_m),
        };
        let mass_kg = params.fabric.density_kg_m2 * cloth.area_m2();
        let friction = options.friction.unwrap_or(plate.friction);
        Ok(Self { scene, plate, friction, cloth, mass_kg })
    }

    /// Height above the plate at which the cloth rests \[m\].
    fn rest_height_m(&self) -> f64 {
        0.5 * self.plate.gap_m
    }

    /// The cloth's vertices before the fall \[m\]: the lowest lies at `lowest_m`.
    fn start_m(&self, lowest_m: f64) -> Vec<[f64; 3]> {
        let rise_m = self.cloth.unevenness_m();
        let least_m = rise_m.iter().copied().fold(f64::INFINITY, f64::min);
        let flat_m = self.cloth.points_m.iter().zip(rise_m);
        flat_m.map(|(&[x, y], rise)| [x, y, lowest_m + rise - least_m]).collect()
    }

    /// Vertices of the plate's surface moved outwards by `offset_m` \[m\]: rings from the top face
    /// over the rounded edge to the lower face.
    fn plate_m(&self, offset_m: f64) -> Vec<[f64; 3]> {
        let Plate { radius_m, edge_radius_m, .. } = self.plate;
        let round_m = edge_radius_m + offset_m;
        let ring = |over: usize| {
            let (sin, cos) = (std::f64::consts::PI * over as f64 / OVER as f64).sin_cos();
            let (r, z) = (radius_m - edge_radius_m + round_m * sin, round_m * cos - edge_radius_m);
            (0..AROUND).map(move |k| {
                let (sin, cos) = (std::f64::consts::TAU * k as f64 / AROUND as f64).sin_cos();
                [r * cos, r * sin, z]
            })
        };
        (0..=OVER).flat_map(ring).collect()
    }

    /// Faces of the plate of `plate_m`, outwards.
    fn plate_faces() -> Vec<Vec<usize>> {
        let at = |over: usize, k: usize| over * AROUND + k % AROUND;
        let band = (0..OVER).flat_map(|over| {
            (0..AROUND).map(move |k| {
                vec![at(over, k), at(over + 1, k), at(over + 1, k + 1), at(over, k + 1)]
            })
        });
        let top = (0..AROUND).map(|k| at(0, k)).collect();
        let bottom = (0..AROUND).rev().map(|k| at(OVER, k)).collect();
        [top, bottom].into_iter().chain(band).collect()
    }

    /// What is written down with every scene.
    fn notes(&self, params: &Params, options: &Options) -> Vec<String> {
        let mut notes = vec![format!(
            "scene {}: {} vertices, edges of {:.2} mm, {:.2} g; z is up, x the warp, y the weft, in metres",
            self.scene.name(),
            self.cloth.points_m.len(),
            self.cloth.mean_edge_m() * 1e3,
            self.mass_kg * 1e3
        )];
        if options.friction.is_none() {
            notes.push(format!(
                "friction {} between cloth and plate is this simulator's; a drape does not show it",
                self.friction
            ));
        }
        let bending_length_m = least_bending_length_m(params);
        if 2.0 * self.cloth.mean_edge_m() > bending_length_m {
            notes.push(format!(
                "edges of {:.1} mm are coarse for a bending length of {:.1} mm; give --edge-mm {:.1}",
                self.cloth.mean_edge_m() * 1e3,
                bending_length_m * 1e3,
                (0.5e3 * bending_length_m).max(EDGES_M[0] * 1e3)
            ));
        }
        notes
    }
}

/// The least of the bending lengths along weft, warp and bias \[m\].
fn least_bending_length_m(params: &Params) -> f64 {
    let fabric = &params.fabric;
    let least = fabric.bending_weft_nm.min(fabric.bending_warp_nm).min(fabric.bending_bias_nm);
    (least / (fabric.density_kg_m2 * GRAVITY_M_S2)).cbrt()
}

/// A fabric in an experiment as a target's file.
pub(super) fn write(
    scene: Scene,
    target: Target,
    params: &Params,
    options: &Options,
) -> Result<Exported, ExchangeError> {
    let written = match target {
        Target::Mujoco => mujoco::write,
        Target::Newton => newton::write,
        Target::Blender => blender::write,
        _ => return Err(ExchangeError::NoScene { target: target.name() }),
    };
    Ok(written(&Bench::new(scene, params, options)?, params, options))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fabric::Fabric;

    const TARGETS: [Target; 3] = [Target::Mujoco, Target::Newton, Target::Blender];

    fn fabric() -> Params {
        let fabric = Fabric::from_paper_units([1e5, 2e5, 6e4, 900.0, 2100.0, 1500.0, 200.0]);
        Params::of(fabric)
    }

    fn written(scene: Scene, target: Target) -> String {
        write(scene, target, &fabric(), &Options::named("a \"b\" true")).unwrap().text
    }

    /// The JSON of a script.
    fn values(text: &str) -> serde_json::Value {
        let (_, rest) = text.split_once("r\"\"\"").unwrap();
        serde_json::from_str(rest.split_once("\"\"\"").unwrap().0).unwrap()
    }

    /// The numbers of an XML attribute, or of a list in a script.
    fn numbers(text: &str, start: &str, end: &str) -> Vec<f64> {
        let (_, rest) = text.split_once(start).unwrap();
        let list = rest.split_once(end).unwrap().0;
        list.split(['(', ')', ',', ' ', '\n'])
            .filter(|word| !word.is_empty())
            .map(|word| word.parse().unwrap())
            .collect()
    }

    fn radius_m(positions: &[f64]) -> f64 {
        positions.chunks(3).map(|p| p[0].hypot(p[1])).fold(0.0, f64::max)
    }

    #[test]
    fn the_cloths_mass_is_its_density_times_its_area() {
        // 200 g/m^2; the disc is a polygon of 90 corners
        let polygon = 45.0 * 0.15 * 0.15 * (std::f64::consts::TAU / 90.0).sin();
        for (scene, area_m2) in [(Scene::Drape, 0.09), (Scene::Cusick, polygon)] {
            let xml = written(scene, Target::Mujoco);
            let mass = numbers(&xml, " mass=\"", "\"")[0];
            assert!((mass / (0.2 * area_m2) - 1.0).abs() < 1e-9, "{mass}");
            for target in [Target::Newton, Target::Blender] {
                let mass = values(&written(scene, target))["mass_kg"].as_f64().unwrap();
                assert!((mass / (0.2 * area_m2) - 1.0).abs() < 1e-9, "{mass}");
            }
            let blender = values(&written(scene, Target::Blender));
            let points = numbers(&written(scene, Target::Blender), "POINTS_M = [", "]").len() / 3;
            let vertex_kg = blender["settings"]["mass"].as_f64().unwrap() * 1e-3;
            assert!((vertex_kg * points as f64 / (0.2 * area_m2) - 1.0).abs() < 1e-9);
        }
    }

    /// What the cloth meets is the plate; in Newton it is raised by how high the cloth rests, and
    /// at
    /// the edge it is the plate itself.
    #[test]
    fn the_plate_has_its_radius_in_every_program() {
        for (scene, plate_m) in [(Scene::Drape, 0.050), (Scene::Cusick, 0.090)] {
            let xml = written(scene, Target::Mujoco);
            let plate = numbers(&xml, "name=\"plate\" vertex=\"", "\"");
            assert!((radius_m(&plate) - plate_m).abs() < 1e-8);
            assert!(plate.chunks(3).all(|p| (-4e-3..=0.0).contains(&p[2])), "4 mm thick");
            let newton = values(&written(scene, Target::Newton));
            let of = |key: &str| newton[key].as_f64().unwrap();
            let met = of("cylinder_radius_m") + of("particle_radius_m");
            assert!((met - plate_m).abs() < 1e-12, "{met}");
            let met = of("cylinder_top_m") + of("particle_radius_m");
            assert!((met - 0.5e-3).abs() < 1e-12, "{met}");
            let plate = numbers(&written(scene, Target::Blender), "PLATE_M = [", "]");
            assert!((radius_m(&plate) + blender::INWARDS_M - plate_m).abs() < 1e-8);
        }
    }

    /// A Cusick disc of rings 10 mm apart, a square with edges of 10 mm: counts, extents, and
    /// indices
    /// within them.
    #[test]
    fn meshes_are_complete() {
        for (scene, points, triangles, extent_m) in
            [(Scene::Drape, 1134, 2135, 0.15 * 2.0_f64.sqrt()), (Scene::Cusick, 721, 1350, 0.15)]
        {
            let xml = written(scene, Target::Mujoco);
            let newton = written(scene, Target::Newton);
            for (cloth, elements) in [
                (numbers(&xml, " point=\"", "\""), numbers(&xml, " element=\"", "\"")),
                (numbers(&newton, "POINTS_M = [", "]"), numbers(&newton, "TRIANGLES = [", "]")),
            ] {
                assert_eq!([cloth.len(), elements.len()], [3 * points, 3 * triangles]);
                assert!((radius_m(&cloth) - extent_m).abs() < 1e-8);
                assert!(elements.iter().all(|&at| at < points as f64));
                // above the plate, and uneven by less than a millimetre
                assert!(cloth.chunks(3).all(|p| p[2] > 0.9e-3 && p[2] < 2e-3));
            }
            let blender = written(scene, Target::Blender);
            assert_eq!(numbers(&blender, "\nFACES = [", "]").len(), 3 * triangles);
        }
    }

    #[test]
    fn no_placeholder_is_left_and_names_stay_text() {
        for target in TARGETS {
            for scene in Scene::ALL {
                let text = written(scene, target);
                assert!(!text.contains('@'), "{}", target.name());
                if target == Target::Mujoco {
                    assert!(text.contains("model=\"a &quot;b&quot; true\""));
                    assert_eq!(text.matches("--").count(), 2, "one comment");
                } else {
                    assert_eq!(values(&text)["name"], "a \"b\" true");
                }
            }
        }
    }

    #[test]
    fn other_targets_and_meshes_that_cannot_be_are_refused() {
        let options = Options::named("a");
        for target in Target::ALL.into_iter().filter(|target| !TARGETS.contains(target)) {
            let error = write(Scene::Drape, target, &fabric(), &options).unwrap_err();
            assert!(error.to_string().starts_with(target.name()), "{error}");
        }
        let options = Options { edge_m: Some(1e-3), ..options };
        let error = write(Scene::Drape, Target::Mujoco, &fabric(), &options).unwrap_err();
        assert!(error.to_string().contains("1.5 to 40 mm"), "{error}");
    }

    /// The sum over the hinges of a disc that is bent to a cylinder, with the moment that Blender's
    /// hinge makes of the setting, is B / 2 times curvature squared times area.
    #[test]
    fn blenders_triangles_bend_as_the_fabric() {
        let (bending_nm, curvature) = (1.5e-6, 1.0);
        let mesh = ClothMesh::disc(0.15, 0.01);
        let setting = blender::bending_on_triangles(bending_nm, mesh.mean_edge_m());
        let place = |p: usize| {
            let [x, y] = mesh.points_m[p];
            nalgebra::Vector3::new(x, y, 0.5 * curvature * x * x * 1e-3)
        };
        let mut hinges = std::collections::HashMap::<[usize; 2], Vec<usize>>::new();
        for &[a, b, c] in &mesh.triangles {
            for [p, q, third] in [[a, b, c], [b, c, a], [c, a, b]] {
                hinges.entry([p.min(q), p.max(q)]).or_default().push(third);
            }
        }
        let mut energy_j = 0.0;
        for ([p, q], thirds) in &hinges {
            let &[r, s] = &thirds[..] else { continue };
            let edge = place(*q) - place(*p);
            let normal = |third: usize| edge.cross(&(place(third) - place(*p)));
            let (m, n) = (normal(r), -normal(s));
            let angle = m.cross(&n).norm() / (m.norm() * n.norm());
            // a third of the force acts at the height of each triangle
            let height_m = 0.5 * (m.norm() + n.norm()) / edge.norm();
            let stiffness = 0.1 * setting * edge.norm() * height_m / 3.0;
            energy_j += 0.5 * stiffness * angle * angle;
        }
        let expected_j = 0.5 * bending_nm * (curvature * 1e-3).powi(2) * mesh.area_m2();
        // rim triangles have no hinge outwards
        assert!((energy_j / expected_j - 1.0).abs() < 0.1, "{}", energy_j / expected_j);
    }
}
