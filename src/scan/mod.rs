//! From a scan of a draped specimen to its boundary vector.
//!
//! In: a cloud in the file's unit and an arbitrary frame. Out: the rim as 244
//! points in the simulation frame, each with sigma and an observed flag, and how
//! good they are; or a refusal that says what was measured and where.
//!
//! The main flow is [`boundary_in_stages`]; the types that it passes on are in `steps`,
//! what is refused and why in `limits`:
//!
//! load (`io`) -> points in metres, meshes sampled and opened (`scene`, `underside`),
//! unit (`unit_guess`) -> plate and up (`plate`) -> local frame and floor (`frame`,
//! `floor`) -> floor, pedestal and background cut away, denoised (`cloth`) ->
//! parameterised (`parameterisation`) -> the square in the parameter plane (`square`) and
//! its warp (`mark`) -> a smooth sheet (`sheet`), registered to the points without
//! changing its lengths (`registration`; both from `fit`) -> the plate under it
//! (`origin`) -> free edge (`edge`, of a mesh `loops`; `shift`) -> rim (`rim`) -> its uncertainty
//! (`uncertainty`) -> the simulation frame (`scanned`) and the figures of its quality
//! (`quality`).
//!
//! The idea that carries it: a draped cloth is nearly an isometric image of a
//! known square. In the parameter plane the rim is four straight lines with known
//! corners, with any folds, and holes, the plate's edge and the pedestal
//! lie inside it or outside the sheet. Tried and dropped: boundary points by their
//! angular gap, then ordering them; they need a threshold, come unordered, and an
//! occlusion looks like a rim.

mod cloth;
mod color;
mod coordinate_step;
mod coverage;
mod downsample;
mod edge;
pub mod error;
mod fit;
mod floor;
pub mod found;
mod frame;
mod hints;
mod limits;
mod loops;
mod mark;
mod measured;
mod mesh_facts;
mod misfit;
pub mod options;
mod origin;
mod parameterisation;
mod plane;
mod plate;
mod pose;
mod quality;
mod registration;
mod rim;
mod scanned;
mod scene;
mod sheet;
mod shift;
mod sides;
mod square;
mod steps;
mod surface;
pub mod tuning;
mod uncertainty;
mod underside;
pub mod unit;
mod unit_guess;
mod warp;

pub use color::MarkColor;
pub use error::{NoDrape, Place, PlateCandidate, ScanError};
pub use found::{Found, FoundPlate, FoundSquare, Refusal};
pub use frame::Bearing;
pub use mesh_facts::{CutFacts, MeshFacts};
pub use options::{Crop, ExperimentFault, HintFault, ScanOptions, WarpToward};
pub use quality::Quality;
pub use scanned::{Evidence, ScannedBoundary};
pub use shift::EdgeShift;
pub use tuning::{Tuning, TuningError};
pub use unit::LengthUnit;
pub use warp::{WarpSteep, quarters_to_warp};

pub use crate::base::boundary::Orientation;

use crate::base::Point3;
use crate::base::clock::Stages;
use crate::geom::Cloud;
use steps::{
    Assessed, Edged, Isolated, Local, Oriented, Parameterised, Plated, Registered, Relaxed, Sheeted,
};

/// Finds the boundary vector in a scan. A cloud with triangles on most of its points
/// is taken as a mesh.
///
/// # Errors
/// When the scan cannot be trusted; see [`ScanError`].
pub fn boundary_from_scan(
    cloud: &Cloud,
    options: &ScanOptions,
) -> Result<ScannedBoundary, ScanError> {
    boundary_in_stages(cloud.clone(), options, &mut Stages::off()).map_err(|refusal| refusal.error)
}

/// [`boundary_from_scan`] of a cloud that is not needed after, with the time that each
/// stage takes.
///
/// # Errors
/// As there; a [`Refusal`] has what was found until then.
pub fn boundary_in_stages(
    cloud: Cloud,
    options: &ScanOptions,
    stages: &mut Stages,
) -> Result<ScannedBoundary, Refusal> {
    let mut found = Found::of_file(&cloud.points, options);
    match assess(cloud, options, stages, &mut found) {
        Ok(assessed) => Ok(ScannedBoundary::of(assessed, found, options)),
        Err(error) => {
            let (spacing_m, size) = (found.point_spacing_m, found.size());
            let error = limits::no_drape(error, found.unlikely.as_ref(), found.unit, options);
            let error = limits::underlying(error, spacing_m, size.as_ref(), options);
            let error = limits::coarse(error, &found.scene, found.unit, options);
            found.note_refusal(&error);
            Err(Refusal { error, found: Box::new(found) })
        }
    }
}

/// The unit of a file's points: the caller's, or the one that their size makes likeliest.
#[must_use]
pub fn likely_unit(points: &[Point3], options: &ScanOptions) -> LengthUnit {
    let guess = || unit_guess::guess(points, &options.tuning.scene).units.first().copied();
    options.unit.or_else(guess).unwrap_or(LengthUnit::Metre)
}

/// Where the plate is in a cloud in metres, if one is found that carries a cloth.
#[must_use]
pub fn plate_of(points: &[Point3], options: &ScanOptions) -> Option<FoundPlate> {
    let options = ScanOptions { unit: Some(LengthUnit::Metre), ..options.clone() };
    let cloud = Cloud { points: points.to_vec(), ..Cloud::default() };
    let plated = scene::take(cloud, &options).and_then(|scene| Plated::of(scene, &options));
    let mut found = Found::of_file(&[], &options);
    plated.ok().and_then(|plated| {
        found.note(plated);
        found.plate
    })
}

/// The first of some factors on a cloud in metres with which a drape is found in it.
#[must_use]
pub fn scale_of_drape(cloud: &Cloud, factors: &[f64], options: &ScanOptions) -> Option<f64> {
    let options = ScanOptions { unit: Some(LengthUnit::Metre), ..options.clone() };
    factors.iter().copied().find(|factor| {
        let points = cloud.points.iter().map(|p| p * *factor).collect();
        let scaled = Cloud { points, ..Cloud::default() };
        let plated = scene::take(scaled, &options).and_then(|scene| Plated::of(scene, &options));
        plated.is_ok_and(|plated| plated.is_of_size && plated.judge(&options).is_ok())
    })
}

/// The way from a cloud to its rim; each step is noted before it is judged.
fn assess<'a>(
    cloud: Cloud,
    options: &'a ScanOptions,
    stages: &mut Stages,
    found: &mut Found,
) -> Result<Assessed<'a>, ScanError> {
    let scene = found.note(stages.span("points and unit", || scene::take(cloud, options))?);
    let plated = found.note(stages.span("plate", || Plated::of(scene, options))?);
    plated.judge(options)?;
    let local = found.note(stages.span("floor", || Local::of(plated, options)));
    let isolated = found.note(Isolated::of(local, options, stages));
    let parameterised =
        found.note(stages.span("parameterisation", || Parameterised::of(isolated, options)));
    let relaxed = found.note(stages.span("relaxation", || Relaxed::of(parameterised, options)));
    relaxed.judge(options)?;
    let oriented = stages.span("square", || Oriented::of(relaxed, options))?;
    let sheeted = stages.span("sheet", || Sheeted::of(oriented, options))?;
    let registered = found.note(stages.span("registration", || Registered::of(sheeted, options))?);
    let fits = registered.judge(options);
    let edged = found.note(stages.span("edge and rim", || Edged::of(registered, options)));
    if fits.is_ok() {
        edged.judge(options)?;
    }
    let assessed = found.note(stages.span("uncertainty", || Assessed::of(edged, options)));
    // Half a sheet fits nothing well.
    fits.map_err(|misfit| assessed.lacks_a_side(options).unwrap_or(misfit))?;
    assessed.judge(options)?;
    Ok(assessed)
}
