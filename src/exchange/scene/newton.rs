//! A scene for NVIDIA Newton: a Python script that drapes the cloth with `SolverStyle3D` on the
//! CPU.
//!
//! Particles touch the plate, with a radius. So the plate is a cylinder that is smaller by the
//! edge's radius, and the particles have that radius: both together are the plate with its rounded
//! edge, raised by the height at which the cloth rests. The cloth's triangles do not touch it;
//! coarse ones sink over the edge.
//!
//! The solver takes the stretch matrix of the flat cloth for its steps, which lets cloth turn only
//! a
//! little in an iteration. Long steps therefore brake the fall to a crawl. Steps of 0.5 ms do not
//! need many iterations.

use serde_json::json;

use super::bench::{Bench, DRAG_PER_S};
use super::python;
use crate::exchange::exported::{Exported, Options};
use crate::exchange::hinge::{self, Mesh};
use crate::fabric::params::Params;

const CODE: &str = include_str!("newton.py");
/// Time step \[s\].
const STEP_S: f64 = 5e-4;
/// Iterations of a step, and of the linear solver in each.
const ITERATIONS: usize = 4;
const LINEAR_ITERATIONS: usize = 10;
/// Stiffness \[N/m\] and damping of contact: a vertex at the edge sinks in by less than 0.1 mm.
const CONTACT_N_M: f64 = 100.0;
const CONTACT_DAMPING: f64 = 1e-3;
/// Half of the distance that layers of cloth keep \[m\].
const SELF_CONTACT_M: f64 = 5e-4;
/// Half the height of the cylinder below the plate's top \[m\].
const HALF_HEIGHT_M: f64 = 0.02;

pub(super) fn write(bench: &Bench, params: &Params, options: &Options) -> Exported {
    let fabric = &params.fabric;
    let bending = [fabric.bending_weft_nm, fabric.bending_warp_nm, fabric.bending_bias_nm];
    let radius_m = bench.plate.edge_radius_m;
    let above_m = bench.rest_height_m();
    let values = json!({
        "density": fabric.density_kg_m2,
        "tri_aniso_ke": [fabric.stretch_weft_n_m, fabric.stretch_warp_n_m, fabric.shear_n_m],
        "edge_aniso_ke": hinge::style3d(bending, Mesh::Irregular),
        "particle_radius_m": radius_m,
        "cylinder_radius_m": bench.plate.radius_m - radius_m,
        "cylinder_half_height_m": HALF_HEIGHT_M,
        "cylinder_top_m": above_m - radius_m,
        "soft_contact_ke": CONTACT_N_M,
        "soft_contact_kd": CONTACT_DAMPING,
        "self_contact_radius_m": SELF_CONTACT_M,
        "step_s": STEP_S,
        "iterations": ITERATIONS,
        "linear_iterations": LINEAR_ITERATIONS,
        "drag_per_s": DRAG_PER_S,
    });
    let mut notes = bench.notes(params, options);
    notes.push(
        "edge_aniso_ke is a third of the bending stiffness (weft, warp, bias), since Newton's hinge bends \
         three times as stiffly"
            .to_owned(),
    );
    notes.push("run it with `python FILE`; it writes the drape as OBJ next to itself".to_owned());
    let code = CODE
        .replace("@POINTS@", &python::points(&bench.start_m(2.0 * above_m)))
        .replace("@TRIANGLES@", &python::faces(bench.cloth.triangles.iter().map(|t| &t[..])));
    let lost = Vec::new();
    let text = python::script(bench, params, options, [&lost, &notes], values, &code);
    Exported { text, companion: None, lost, notes }
}
