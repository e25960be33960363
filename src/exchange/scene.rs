//! The whole experiment for another program (`export --scene`): plate, cloth, gravity, friction and
//! the solver's settings, so that the drape comes to rest there without further input.
//!
//! In: a fabric, the experiment's name ([`Scene`]), the length of the mesh's edges. Out: a file
//! that the program runs. The plate is this simulator's, a disc with a rounded edge; the cloth
//! starts level above it, with the unevenness of the canonical drop. The scene's frame has z up, x
//! along the warp and y along the weft, against the simulation frame's z; its origin is the centre
//! of the plate's top. Lengths are in metres.
//!
//! The cloth's mesh is `cloth_mesh`'s, the same for all programs: what differs between them is
//! their physics. One file here per target says how its contact is set so that the cloth rests half
//! a gap above the plate, as it does in this simulator.

mod bench;
mod blender;
mod cloth_mesh;
mod mujoco;
mod newton;
mod python;

use super::exported::{ExchangeError, Exported, Options};
use super::target::{Scene, Target};
use crate::fabric::params::Params;
use bench::Bench;

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
    use super::cloth_mesh::ClothMesh;
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
