//! A scene for Blender: a Python script that makes plate and cloth and steps the cloth to rest.
//!
//! Blender keeps cloth off a collider by the thicknesses of both, which are at least 1 mm each. So
//! the collider is the plate moved inwards ([`INWARDS_M`]), and the cloth rests where it should.
//! Its friction is `pdef_cfrict` / 100 of the collider (`collision.cc`).
//!
//! On triangles the constants of [`super::super::blender`], which hold for quads, are others. For
//! equilateral ones of side a: a hinge's force acts on three corners, of which one lies off the
//! hinge, at a sqrt(3) / 2; its moment is 0.1 k a (a sqrt(3) / 6) a radian. A plate of stiffness B
//! on such hinges has B l^2 / A = 2 B / sqrt(3) a radian ([`super::super::hinge`]). So k = 40 B /
//! a^2.
//! The springs along the edges are a plate of stretch 2 K / sqrt(3) with K = tension / a, so
//! tension = S a sqrt(3) / 2. Its shear is always 3/8 of that stretch.

use serde_json::json;

use super::bench::Bench;
use super::python;
use crate::exchange::blender::{MASS, QUALITY};
use crate::exchange::exported::{Exported, Options};
use crate::exchange::isotropic::Isotropic;
use crate::fabric::params::Params;

const CODE: &str = include_str!("blender.py");
/// Frames in a second, each of `quality` steps.
const FRAMES_PER_S: usize = 25;
/// Least distances that Blender lets cloth and collider keep \[m\].
const DISTANCE_M: f64 = 1e-3;
/// How far within the plate's surface the collider lies \[m\]: the cloth rests 1.8 mm off a
/// collider
/// with both distances (observed), and should 0.5 mm off the plate.
pub(super) const INWARDS_M: f64 = 1.3e-3;
/// Setting over B / a^2 on equilateral triangles.
const BENDING_TRIANGLES: f64 = 40.0;

pub(super) fn write(bench: &Bench, params: &Params, options: &Options) -> Exported {
    let mut lost = Isotropic::lost(&params.fabric);
    let isotropic = Isotropic::of(&params.fabric);
    let edge_m = bench.cloth.mean_edge_m();
    lost.push("shear: springs along triangles have 3/8 of their stretch".to_owned());
    let tension = isotropic.stretch_n_m * edge_m * 3.0_f64.sqrt() / 2.0;
    let settings = json!({
        "bending_model": "ANGULAR",
        "quality": QUALITY,
        "bending_damping": 0,
        "tension_stiffness": tension,
        "compression_stiffness": tension,
        "shear_stiffness": 0,
        "bending_stiffness": bending_on_triangles(isotropic.bending_nm, edge_m),
        // vertices have one mass each: the cloth's over their number
        "mass": MASS * bench.mass_kg / bench.cloth.points_m.len() as f64,
    });
    let values = json!({
        "frames_per_s": FRAMES_PER_S,
        "plate_distance_m": DISTANCE_M,
        "settings": settings,
        "collision_settings": {
            "use_collision": true,
            "distance_min": DISTANCE_M,
            "collision_quality": 4,
            "use_self_collision": true,
            "self_distance_min": DISTANCE_M,
        },
    });
    let mut notes = bench.notes(params, options);
    notes.push("the constants hold for this mesh and the bending model Angular".to_owned());
    notes.push(
        "run it with `blender --python FILE`, or `python FILE` with the package bpy".to_owned(),
    );
    let text = python::script(bench, params, options, [&lost, &notes], values, &code(bench));
    Exported { text, companion: None, lost, notes }
}

/// The script's code, with the meshes in it.
fn code(bench: &Bench) -> String {
    let faces = python::faces(bench.cloth.triangles.iter().map(|face| &face[..]));
    let plate_faces = Bench::plate_faces();
    CODE.replace("@POINTS@", &python::points(&bench.start_m(2.0 * bench.rest_height_m())))
        .replace("@FACES@", &faces)
        .replace("@PLATE_POINTS@", &python::points(&bench.plate_m(-INWARDS_M)))
        .replace("@PLATE_FACES@", &python::faces(plate_faces.iter().map(Vec::as_slice)))
}

/// Blender's bending stiffness on equilateral triangles.
pub(super) fn bending_on_triangles(bending_nm: f64, edge_m: f64) -> f64 {
    BENDING_TRIANGLES * bending_nm / (edge_m * edge_m)
}
