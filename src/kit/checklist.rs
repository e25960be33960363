//! What makes a scan refused, with the numbers of the scan path itself.
//!
//! In: the options of a scan. Out: one [`Refusal`] for each variant of [`crate::scan::ScanError`],
//! a test holds that none is missing; every number is read from [`ScanOptions`], from which `scan`
//! takes its limits.

use crate::scan::ScanOptions;

/// One reason to refuse a scan.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    /// Name of the variant.
    pub code: &'static str,
    /// What is refused, with the limit.
    pub refused: String,
    /// How to avoid it.
    pub avoid: &'static str,
}

/// The reasons, in the order in which a scan is looked at.
#[must_use]
pub fn checklist(options: &ScanOptions) -> Vec<Refusal> {
    [seen(options), plate(options), mark(options), size(options), rim(options)].concat()
}

fn refusal(code: &'static str, refused: impl Into<String>, avoid: &'static str) -> Refusal {
    Refusal { code, refused: refused.into(), avoid }
}

fn mm(metres: f64) -> f64 {
    metres * 1e3
}

/// Points and unit.
fn seen(options: &ScanOptions) -> Vec<Refusal> {
    let limits = &options.tuning.limits;
    let scene = &options.tuning.scene;
    vec![
        refusal(
            "TooFewPoints",
            format!("fewer than {} usable points", limits.min_points),
            "scan longer, export the whole cloud",
        ),
        refusal(
            "TooSparse",
            format!(
                "cloth or rim not seen, in points more than {:.1} mm apart ({:.1} mm are enough)",
                mm(limits.sparse_m),
                mm(limits.needed_m)
            ),
            "go nearer, do not decimate the export",
        ),
        refusal(
            "TooCoarse",
            format!("coordinates stored in steps of more than {:.0} mm", mm(limits.coarse_step_m)),
            "export with more digits, or without a map's offset",
        ),
        refusal(
            "Size",
            format!(
                "a scene that measures {} m to {:.0} m in no unit",
                scene.smallest_m, scene.largest_m
            ),
            "export in metres or millimetres, or give `--unit`",
        ),
    ]
}

/// What the cloth lies on.
fn plate(options: &ScanOptions) -> Vec<Refusal> {
    let underside = &options.tuning.underside;
    vec![
        refusal(
            "NoPlate",
            format!(
                "no level disc of {:.0} mm radius from which a square of {:.0} mm hangs",
                mm(options.plate_radius_m),
                mm(options.specimen_side_m)
            ),
            "scan from above too; use the plate of this kit; in a cluttered scene give `--plate-near`, `--up` or `--crop`",
        ),
        refusal(
            "SeveralDrapes",
            "a second drape in the scan",
            "one stand at a time, or choose it with `--plate-near` or `--crop`",
        ),
        refusal(
            "NoCrease",
            format!(
                "a mesh that was closed underneath and turns by less than {:.0} degrees at the cloth's edge",
                underside.min_crease_rad.to_degrees()
            ),
            "export without hole filling or Poisson surface, or the point cloud",
        ),
        refusal(
            "HiddenCrease",
            format!(
                "a closed mesh whose edge shows on less than {:.0} % of the rim",
                100.0 * options.tuning.limits.min_clear
            ),
            "export without hole filling or Poisson surface, or the point cloud",
        ),
    ]
}

/// Where the warp is.
fn mark(options: &ScanOptions) -> Vec<Refusal> {
    let limits = &options.tuning.limits;
    vec![
        refusal(
            "NoColors",
            "`--mark` with a file without colours",
            "export colours, or give `--warp-toward`",
        ),
        refusal("MarkLikeCloth", "a mark of the cloth's own hue", "mark in another colour"),
        refusal(
            "NoMark",
            format!(
                "fewer than {} points of the mark's colour on the cloth",
                limits.least_mark_points
            ),
            "make it as large as the template's, in a bright colour",
        ),
        refusal(
            "MarkUnclear",
            format!(
                "less than {:.0} % of the mark towards one side, or its middle more than {:.0} degrees off the side's",
                100.0 * limits.least_mark_share,
                limits.most_mark_off_deg
            ),
            "one mark, in the middle of one side",
        ),
        refusal(
            "WarpSteep",
            format!(
                "a `--warp-toward` less than {:.0} degrees from the vertical",
                limits.least_warp_off_vertical_deg
            ),
            "give a horizontal direction of the scan's frame",
        ),
    ]
}

/// Size and shape of the cloth.
fn size(options: &ScanOptions) -> Vec<Refusal> {
    let limits = &options.tuning.limits;
    let side = options.specimen_side_m;
    let [shortest, longest] = limits.sides.map(|share| mm(share * side));
    let [least, most] = options.side_range_m.map(mm);
    vec![
        refusal(
            "WrongSize",
            format!(
                "cloth that flattens to a square of less than {shortest:.1} or more than {longest:.1} mm (from {:.1} mm on \
                 if its rim is too long or the plate too large as well)",
                mm(limits.likely_sides[1] * side)
            ),
            "cut by the template, check the diagonals; check the scanner's scale on the plate, which is known",
        ),
        refusal(
            "NotASquare",
            format!(
                "an outline of which less than {:.0} % lies on the specimen's square",
                100.0 * limits.min_on_square
            ),
            "nothing may touch the cloth; cut the corners true",
        ),
        refusal(
            "HiddenRim",
            format!(
                "a rim out of sight on more than {:.0} % of the bearings, with such an outline",
                100.0 * limits.most_hidden
            ),
            "add views all round, level with the rim",
        ),
        refusal(
            "SideLength",
            format!("a side of the rim shorter than {least:.0} or longer than {most:.0} mm"),
            "check specimen and scale",
        ),
        refusal(
            "UnevenSides",
            format!(
                "a side that differs from the median of the four by more than {:.1} mm + {} of the noise",
                mm(options.max_uneven_m),
                options.max_uneven_per_noise
            ),
            "cut true; add views of that side",
        ),
    ]
}

/// How well the rim is seen, and the cloth near it.
fn rim(options: &ScanOptions) -> Vec<Refusal> {
    [completeness(options), fitted(options)].concat()
}

/// How well the rim is seen.
fn completeness(options: &ScanOptions) -> Vec<Refusal> {
    let limits = &options.tuning.limits;
    let well = limits.bridged_well_noise_m;
    vec![
        refusal(
            "Gap",
            format!(
                "an arc of the rim longer than {:.0} mm out of sight (at up to {:.0} mm of noise; less beyond)",
                mm(options.longest_gap_m(well)),
                mm(well)
            ),
            "add a view from the bearing that the message names",
        ),
        refusal(
            "TooLittleRim",
            format!(
                "less than {:.0} % of the rim seen (more with more noise)",
                100.0 * options.least_observed(well)
            ),
            "add views all round",
        ),
    ]
}

/// How near the cloth lies to the sheet that is fitted.
fn fitted(options: &ScanOptions) -> Vec<Refusal> {
    let limits = &options.tuning.limits;
    vec![
        refusal(
            "Strained",
            format!(
                "a surface that cannot be laid flat within {:.0} % (median strain), whose rim is not where the specimen's would be",
                100.0 * limits.most_strain
            ),
            "see whether the scan was sheared, scaled along one axis or smoothed",
        ),
        refusal(
            "Unexplained",
            format!(
                "more than {:.0} mm^2 of cloth near the rim off the fitted sheet: a hidden fold",
                options.max_unexplained_m2 * 1e6
            ),
            "add a view into the fold, or lay the specimen anew",
        ),
        refusal(
            "PassesApart",
            "cloth off the fitted sheet in many places, or points that scatter more across the hanging cloth than on the plate: passes \
             or views that do not meet"
                .to_owned(),
            "align the views anew, scan in one pass, or check the focal length",
        ),
        refusal(
            "TooNoisy",
            format!(
                "cloth that everywhere is off the fitted sheet by less than the noise of single points, but by {} times \
                 what another cloth may be: noise blurs the folds",
                limits.blurred_misfit
            ),
            "scan from nearer, or with a sensor of less noise",
        ),
        refusal(
            "Misfit",
            format!(
                "a sheet more than {:.2} mm + {} times what it is off over the plate off the cloth: creases, or cloth that \
                 touches something",
                mm(options.max_misfit_m),
                options.max_misfit_per_noise
            ),
            "iron or rest the specimen flat, lay it anew",
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::ScanError;

    /// The name of each variant: one that is added must be named here and listed above.
    fn name(error: &ScanError) -> &'static str {
        match error {
            ScanError::TooFewPoints { .. } => "TooFewPoints",
            ScanError::Size { .. } => "Size",
            ScanError::TooSparse { .. } => "TooSparse",
            ScanError::TooCoarse { .. } => "TooCoarse",
            ScanError::WrongSize { .. } => "WrongSize",
            ScanError::NoPlate { .. } => "NoPlate",
            ScanError::SeveralDrapes { .. } => "SeveralDrapes",
            ScanError::NoCrease { .. } => "NoCrease",
            ScanError::HiddenCrease { .. } => "HiddenCrease",
            ScanError::NoColors => "NoColors",
            ScanError::MarkLikeCloth { .. } => "MarkLikeCloth",
            ScanError::NoMark { .. } => "NoMark",
            ScanError::MarkUnclear { .. } => "MarkUnclear",
            ScanError::WarpSteep(_) => "WarpSteep",
            ScanError::NotASquare { .. } => "NotASquare",
            ScanError::HiddenRim { .. } => "HiddenRim",
            ScanError::SideLength { .. } => "SideLength",
            ScanError::UnevenSides { .. } => "UnevenSides",
            ScanError::Gap { .. } => "Gap",
            ScanError::TooLittleRim { .. } => "TooLittleRim",
            ScanError::Strained { .. } => "Strained",
            ScanError::Unexplained { .. } => "Unexplained",
            ScanError::Misfit { .. } => "Misfit",
            ScanError::PassesApart { .. } => "PassesApart",
            ScanError::TooNoisy { .. } => "TooNoisy",
        }
    }

    /// The variants as the source declares them.
    fn declared() -> Vec<String> {
        let source = include_str!("../scan/error.rs");
        let body = source.split("pub enum ScanError {").nth(1).unwrap();
        let body = body.split("\n}\n").next().unwrap();
        let lines = body.lines().filter_map(|line| line.strip_prefix("    "));
        let names = lines.filter(|line| line.starts_with(|c: char| c.is_ascii_uppercase()));
        names.map(|line| line.chars().take_while(char::is_ascii_alphanumeric).collect()).collect()
    }

    #[test]
    fn every_reason_to_refuse_is_on_the_list_once() {
        let list = checklist(&ScanOptions::default());
        let mut listed: Vec<&str> = list.iter().map(|r| r.code).collect();
        listed.sort_unstable();
        let mut declared = declared();
        declared.sort_unstable();
        assert_eq!(declared, listed);
        assert_eq!(name(&ScanError::NoColors), "NoColors");
        assert!(declared.len() > 20);
    }

    #[test]
    fn the_numbers_are_those_of_the_options() {
        let text = |options: &ScanOptions| {
            checklist(options).iter().map(|r| r.refused.clone() + "\n").collect::<String>()
        };
        let shipped = ScanOptions::default();
        assert!(text(&shipped).contains("longer than 80 mm"), "{}", text(&shipped));
        let mut other = ScanOptions { max_gap_m: 0.041, min_observed: 0.61, ..shipped };
        other.tuning.limits.min_points = 777;
        let said = text(&other);
        for part in ["longer than 41 mm", "less than 61 %", "fewer than 777 usable"] {
            assert!(said.contains(part), "{said}");
        }
    }
}
