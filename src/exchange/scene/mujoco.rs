//! A scene for `MuJoCo` 4.0: MJCF that `python -m mujoco.viewer --mjcf=FILE` shows.
//!
//! The plate is a mesh, since a cylinder has no rounded edge; `MuJoCo` collides with the convex
//! hull, which is the plate. The flex has a radius of half this simulator's gap, so that the cloth
//! rests as high above the plate. Contacts are as stiff as the time step allows. Air brakes the
//! cloth: Stokes' drag of the box that `MuJoCo` gives each vertex of a flex, 10 mm on a side.

use super::bench::{Bench, DRAG_PER_S};
use crate::base::frame::GRAVITY_M_S2;
use crate::exchange::exported::{Exported, Options};
use crate::exchange::going_along::{self, number};
use crate::exchange::isotropic::Isotropic;
use crate::exchange::mujoco::{Flex, attribute, comment};
use crate::fabric::params::Params;

/// Time step \[s\].
const STEP_S: f64 = 0.002;
/// Iterations of the constraint solver in a step, at most.
const ITERATIONS: usize = 50;
/// Side of the box that gives a vertex its inertia, and so its drag \[m\].
const BOX_M: f64 = 0.010;

pub(super) fn write(bench: &Bench, params: &Params, options: &Options) -> Exported {
    let flex = Flex::of(&Isotropic::of(&params.fabric));
    let lost = flex.lost(&params.fabric);
    let mut notes = bench.notes(params, options);
    notes.extend(flex.notes());
    notes.push("show it with `python -m mujoco.viewer --mjcf=FILE`".to_owned());
    let along = comment(&going_along::lines(params, &lost, &notes));
    let vertex_kg = bench.mass_kg / bench.cloth.points_m.len() as f64;
    let viscosity = DRAG_PER_S * vertex_kg / (3.0 * std::f64::consts::PI * BOX_M);
    let radius_m = bench.rest_height_m();
    let contact =
        format!(r#"friction="{}" solref="{} 1""#, number(bench.friction), number(2.0 * STEP_S));
    let points = bench.start_m(2.0 * radius_m);
    let elements = bench.cloth.triangles.iter().flatten().map(usize::to_string);
    let elements: Vec<_> = elements.collect();
    let text = format!(
        r#"<!--
{along}-->
<mujoco model="{name}">
  <option timestep="{STEP_S}" integrator="discrete" iterations="{ITERATIONS}" gravity="0 0 -{GRAVITY_M_S2}" viscosity="{viscosity}"/>
  <size memory="1G"/>
  <statistic center="0 0 -0.05" extent="0.3"/>
  <visual>
    <headlight ambient="0.3 0.3 0.3" diffuse="0.6 0.6 0.6"/>
  </visual>
  <asset>
    <mesh name="plate" vertex="{plate}"/>
  </asset>
  <worldbody>
    <geom name="plate" type="mesh" mesh="plate" rgba="0.5 0.5 0.5 1" {contact}/>
    <flexcomp name="cloth" type="direct" dim="2" mass="{mass}" radius="{radius}" rgba="0.3 0.5 0.8 1" point="{cloth}" element="{elements}">
      <contact {contact} selfcollide="auto"/>
      {elasticity}
    </flexcomp>
  </worldbody>
</mujoco>
"#,
        name = attribute(&options.name),
        viscosity = number(viscosity),
        plate = numbers(&bench.plate_m(0.0)),
        mass = number(bench.mass_kg),
        radius = number(radius_m),
        cloth = numbers(&points),
        elements = elements.join(" "),
        elasticity = flex.elasticity(),
    );
    Exported { text, companion: None, lost, notes }
}

/// Positions to a nanometre.
fn numbers(positions_m: &[[f64; 3]]) -> String {
    let words: Vec<_> = positions_m.iter().flatten().map(|m| format!("{m:.9}")).collect();
    words.join(" ")
}
