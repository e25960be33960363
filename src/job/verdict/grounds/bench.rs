//! The grounds of the bench: the plate, its tilt, and where the specimen lies on it.

use super::super::figures::{Figures, OnPlate};
use super::super::limits::Limits;
use super::super::{Code, Ground, Level};
use crate::base::units::mm;

/// The plate found against the plate given.
pub(super) fn plate(f: &Figures, scan: &OnPlate, limits: &Limits) -> Option<Ground> {
    let (given_m, sigma_m) = (f.given.plate_radius_m, scan.radius_sigma_m);
    let expected_m = given_m - limits.plate_lead_m;
    let larger_m = scan.radius_m - expected_m;
    let (off_m, steps, sigmas) = if larger_m > 0.0 {
        (larger_m, limits.plate_larger_m, limits.plate_larger_sigmas)
    } else if sigma_m <= limits.plate_arched_sigma_m {
        (-larger_m, limits.plate_smaller_m, limits.plate_smaller_sigmas)
    } else {
        return arched(f, scan, limits);
    };
    let Some((level, limit_m)) = steps.plus(sigmas * sigma_m).level(off_m) else {
        return arched(f, scan, limits);
    };
    let text = format!(
        "the cloth leaves the plate at a radius of {:.1} mm (standard error {:.1}); {:.1} mm are expected of a plate \
         of {:.0} mm (limit {:.1} mm apart): check the plate's radius and the scan's scale; on another plate the \
         stiffnesses are off by factors",
        mm(scan.radius_m),
        mm(sigma_m),
        mm(expected_m),
        mm(given_m),
        mm(limit_m)
    );
    let ground = Ground::new(Code::PlateRadius, level, (mm(off_m), mm(limit_m), "mm"), text);
    Some(if level == Level::DoNotUse { ground.not_the_experiment() } else { ground })
}

/// Where the specimen lies on the plate. The fit lays its drape where the scan shows the cloth.
pub(super) fn off_centre(f: &Figures, scan: &OnPlate, limits: &Limits) -> Option<Ground> {
    let (level, limit_m) = limits.off_centre_m.level(scan.centre_offset_m)?;
    let (level, what_follows) = if f.is_taken() {
        (Level::Reliable, "the fit has taken it into account")
    } else {
        (
            level,
            "the network takes it for another fabric: centre the specimen and scan again, or refine it (without --quick)",
        )
    };
    let text = format!(
        "the specimen's centre lies {:.1} mm off the plate's (limit {:.1} mm): {what_follows}",
        mm(scan.centre_offset_m),
        mm(limit_m)
    );
    let measured = (mm(scan.centre_offset_m), mm(limit_m), "mm");
    Some(Ground::new(Code::OffCentre, level, measured, text))
}

/// The plate's tilt that refining found.
pub(super) fn tilted(f: &Figures, limits: &Limits) -> Option<Ground> {
    let (level, limit) = limits.tilt_rad.level(f.tilt_rad)?;
    let (level, what_follows) = if f.is_taken() {
        (Level::Reliable, "the fit has taken it into account")
    } else {
        (level, "the network takes the drape for another fabric's: level the plate and scan again")
    };
    let measured = (f.tilt_rad.to_degrees(), limit.to_degrees(), "deg");
    let text = format!(
        "the plate seems to be tilted by {:.1} degrees (limit {:.1}): {what_follows}",
        measured.0, measured.1
    );
    Some(Ground::new(Code::Tilted, level, measured, text))
}

/// The plate found against how early cloth of the bending length found leaves one: stiff cloth
/// arches over the plate, the more the stiffer it is. The bending length hardly depends on the
/// plate.
fn arched(f: &Figures, scan: &OnPlate, limits: &Limits) -> Option<Ground> {
    let length_m = f.answer.as_ref()?.bending_length_m;
    let expected_m = f.given.plate_radius_m - limits.plate_lead_m;
    let least_m = expected_m - limits.plate_arch_per_m * length_m * length_m;
    let off_m = least_m - scan.radius_m;
    let more_m = limits.plate_arched_sigmas * scan.radius_sigma_m
        + limits.plate_arched_per_noise * f.noise_m;
    let (level, limit_m) = limits.plate_smaller_m.plus(more_m).level(off_m)?;
    let text = format!(
        "the cloth leaves the plate at a radius of {:.1} mm (standard error {:.1}); cloth of the bending length found, \
         {:.1} mm, leaves a plate of {:.0} mm at {:.1} mm or farther out (limit {:.1} mm less): check the plate's radius \
         and the scan's scale; on another plate the stiffnesses are off by factors",
        mm(scan.radius_m),
        mm(scan.radius_sigma_m),
        mm(length_m),
        mm(f.given.plate_radius_m),
        mm(least_m),
        mm(limit_m)
    );
    Some(Ground::new(Code::PlateRadius, level, (mm(off_m), mm(limit_m), "mm"), text))
}
