//! A drawn scene, scanned.

use super::broken::Cause;
use super::drapes::KeptDrape;
use super::draw::Drawn;
use scan2params::base::{Boundary, Point3};
use scan2params::dataset::drape_file::rim_of;
use scan2params::geom::Mesh;
use scan2params::sensor::{Scene, SceneError, Seen, VirtualScan, scan};

/// A scene that was scanned.
pub(in crate::evaluate) struct Made {
    pub(super) drawn: Drawn,
    pub(in crate::evaluate) scan: VirtualScan,
    /// The cloth as it lay there, simulation frame \[m\].
    pub(super) mesh: Mesh,
    /// Its rim.
    pub(super) rim: Boundary,
    /// What the views saw of it.
    pub(super) seen: Seen,
    /// Height of the floor \[m\]; `None` if there is none.
    pub(super) floor_y_m: Option<f64>,
}

impl Made {
    /// The scan of what was drawn.
    pub(super) fn of(drawn: Drawn, drapes: &[KeptDrape]) -> Result<Self, SceneError> {
        let (drawn, mesh) = deformed(drawn, drapes);
        let Drawn { cause, seed, .. } = drawn;
        let other = &drapes[(drawn.drape + 1) % drapes.len()].mesh;
        Self::of_cloth(drawn, mesh, |scene| cause.rearrange(scene, other, seed))
    }

    /// The scan of this cloth, a square grid, in the scene that was drawn and then rearranged.
    pub(in crate::evaluate) fn of_cloth(
        drawn: Drawn,
        mesh: Mesh,
        rearrange: impl FnOnce(&mut Scene),
    ) -> Result<Self, SceneError> {
        let Drawn { cause, seed, ref profile, .. } = drawn;
        let mut profile = profile.clone();
        let rim = rim_of(&mesh).unwrap_or_else(|| unreachable!("read as a square grid"));
        let points: Vec<Point3> = rim.positions_m().collect();
        let mut scene = drawn.setting.scene(mesh.clone(), &profile, seed);
        rearrange(&mut scene);
        let (mut poses, seen) = drawn.views(&scene, &points)?;
        cause.narrow(&mut poses, seed);
        cause.coarsen(&mut profile, seed);
        let mut scan = scan(&scene, &poses, &profile, seed)?;
        cause.spoil(&mut scan, &profile, seed);
        let floor_y_m = (scene.stand.floor_radius_m > 0.0).then_some(scene.stand.floor_y_m);
        Ok(Self { drawn, scan, mesh, rim, seen, floor_y_m })
    }
}

/// The cloth as the cause has it, of the drawn drape or of the next one that it can be made of; a
/// crease, which all cloth takes, where there is none.
fn deformed(drawn: Drawn, drapes: &[KeptDrape]) -> (Drawn, Mesh) {
    let from = drawn.drape;
    let others = (from..drapes.len()).chain(0..from);
    for drape in others.filter(|&k| drawn.cause.suits(&drapes[k])) {
        let mut mesh = drapes[drape].mesh.clone();
        if drawn.cause.deform(&mut mesh, drawn.seed) {
            return (Drawn { drape, ..drawn }, mesh);
        }
    }
    let mut mesh = drapes[from].mesh.clone();
    Cause::Crease.deform(&mut mesh, drawn.seed);
    (Drawn { cause: Cause::Crease, ..drawn }, mesh)
}
