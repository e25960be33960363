//! A cloud without a camera: points spread evenly over cloth and floor, with noise of
//! one size in all directions. For measuring speed and memory, where visibility and
//! the errors of a camera would only be in the way.

use rand_distr::{Distribution as _, StandardNormal};

use super::scene::{Scene, SceneError};
use crate::base::{Point3, Vector3, seed};
use crate::geom::adjacency::{area_vector2, spread};
use crate::geom::{Cloud, Mesh};

/// Share of the points that lie on the cloth; the rest is floor.
const CLOTH_SHARE: f64 = 0.7;
/// Half the side of the square of floor \[m\].
const FLOOR_HALF_M: f64 = 0.3;

/// About `count` points of a scene in the simulation frame \[m\]; the same arguments
/// give the same bytes.
///
/// # Errors
/// When the scene is none.
pub fn even(scene: &Scene, count: usize, noise_m: f64, run_seed: u64) -> Result<Cloud, SceneError> {
    scene.check()?;
    let floor = floor(scene.stand.floor_y_m);
    let on = |mesh: &Mesh, share: f64| -> Vec<Point3> {
        let area = (0..mesh.triangles.len()).map(|face| area_vector2(mesh, face).norm());
        let area = 0.5 * area.sum::<f64>();
        spread(mesh, (area / (share * count as f64)).sqrt()).map(|sample| sample.at).collect()
    };
    let mut points = on(&scene.drape, CLOTH_SHARE);
    points.extend(on(&floor, 1.0 - CLOTH_SHARE));
    let mut rng = seed::rng(run_seed, "sensor-even", 0);
    for point in &mut points {
        *point += Vector3::from_fn(|_, _| -> f64 { StandardNormal.sample(&mut rng) }) * noise_m;
    }
    Ok(Cloud { points, ..Cloud::default() })
}

fn floor(y_m: f64) -> Mesh {
    let corner = |x: f64, z: f64| Point3::new(x * FLOOR_HALF_M, y_m, z * FLOOR_HALF_M);
    Mesh {
        vertices: vec![corner(-1., -1.), corner(1., -1.), corner(1., 1.), corner(-1., 1.)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}
