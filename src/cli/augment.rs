//! `augment`: a virtual scan of a drape.

use anyhow::{anyhow, bail};

use super::{Failure, Outcome, args};
use crate::base::Point3;
use crate::base::units::M_PER_MM;
use crate::geom::Mesh;
use crate::sensor::{Profile, Scene, default_ring, scan};

pub(crate) fn run(given: &args::Augment) -> Outcome {
    let profile = Profile::named(&given.profile).ok_or_else(|| {
        Failure::usage(anyhow!(
            "no sensor profile `{}`: give ideal, structured-light, truedepth or consumer",
            given.profile
        ))
    })?;
    let scene = Scene::modified_cusick(drape(&given.input)?);
    let made = scan(&scene, &default_ring(), &profile, given.seed)?;
    made.write(&given.out)?;
    eprintln!("wrote {} ({} points)", given.out.display(), made.cloud.points.len());
    Ok(())
}

/// The drape of an OBJ in mm, simulation frame.
fn drape(path: &std::path::Path) -> anyhow::Result<Mesh> {
    let (cloud, _) = crate::io::read_scan(path)?;
    if cloud.triangles.is_empty() {
        bail!("{}: no faces; give a drape as `simulate` writes it", path.display());
    }
    let reach = cloud.points.iter().map(|p| p.coords.norm()).fold(0.0, f64::max);
    if !(100.0..500.0).contains(&reach) {
        bail!(
            "{}: reaches {reach:.3} from the origin; a drape in mm, in the simulation frame, \
             reaches 100 to 500",
            path.display()
        );
    }
    let vertices = cloud.points.iter().map(|p| Point3::from(p.coords * M_PER_MM)).collect();
    Ok(Mesh { vertices, triangles: cloud.triangles })
}
