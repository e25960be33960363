//! From the figures to the grounds: one function for each thing that may speak against a
//! result.

use super::figures::{Answer, Figures, Fit, OnPlate, Parameter};
use super::limits::{Limits, Steps};
use super::{Code, Ground, Level, Verdict};
use crate::base::boundary::{Orientation, SIDES};
use crate::base::units::M_PER_MM;
use crate::sim::Stop;

impl Steps {
    /// What a number makes of a result, and the limit that it is beyond; `None` within both.
    fn level(self, value: f64) -> Option<(Level, f64)> {
        if value > self.do_not_use {
            Some((Level::DoNotUse, self.do_not_use))
        } else if value > self.doubtful {
            Some((Level::Doubtful, self.doubtful))
        } else {
            None
        }
    }

    /// Both limits, shifted by `more`.
    fn plus(self, more: f64) -> Self {
        Self { doubtful: self.doubtful + more, do_not_use: self.do_not_use + more }
    }
}

impl Figures {
    /// The verdict of these figures under these limits.
    #[must_use]
    pub fn verdict(&self, limits: &Limits) -> Verdict {
        let mut grounds = Vec::new();
        grounds.extend(sides(self, limits));
        if let Some(scan) = &self.scan {
            grounds.extend(width(self, scan, limits));
            grounds.extend(plate(self, scan, limits));
            grounds.extend(near_refusal(self, scan, limits));
        } else {
            grounds.push(rim_from_file());
        }
        grounds.extend(hidden(self, limits));
        grounds.extend(warp(self, limits));
        if let Some(answer) = &self.answer {
            grounds.extend(novel(answer, limits));
            grounds.extend(answer.parameters.iter().filter_map(|p| range_end(p, limits)));
            grounds.extend(density(answer, limits));
            grounds.extend(bending_raised(answer));
            grounds.extend(folds_for_bending(self, answer, limits));
        }
        if let Some(again) = &self.again {
            grounds.extend(resimulated(self, again, limits));
        }
        Verdict::of(grounds)
    }
}

/// Stretch of hanging cloth of which nothing is known: the limpest of the measured fabrics.
const UNKNOWN_STRETCH: f64 = 0.05;

const fn mm(metres: f64) -> f64 {
    metres / M_PER_MM
}

/// The sides against what the specimen, its folds and its stretch allow: one by one, and
/// their mean, which tells the scale.
fn sides(f: &Figures, limits: &Limits) -> Vec<Ground> {
    let noise_m = f.scan.map_or(0.0, |scan| scan.noise_m);
    let side_m = f.given.side_m;
    let softest_m = limits.least_bending_length_m;
    let [bending_m, stretch] = match &f.answer {
        Some(answer) => [[answer.bending_length_m; 2], answer.stretch],
        None => [[softest_m, f64::INFINITY], [0.0; 2]],
    };
    let chords_m = if f.scan.is_none() { limits.chord_share * side_m } else { 0.0 };
    let least_m = side_m - limits.side_loss_m2 / bending_m[0].max(softest_m) - chords_m;
    // Sides 0 and 2 run along the weft, 1 and 3 along the warp.
    let most_m: [f64; SIDES] = std::array::from_fn(|s| {
        let loss_m = limits.side_loss_m2 / bending_m[1].max(softest_m);
        side_m * (1.0 + limits.stretch_of_rim * stretch[s % 2]) - loss_m
    });
    let off = |length_m: f64, most_m: f64| (length_m - most_m).max(least_m - length_m).max(0.0);
    let more_m = limits.side_off_per_noise * noise_m;
    let lengths = f.sides_m.map(|m| format!("{:.1}", mm(m))).join(", ");
    let mean = |values: [f64; SIDES]| values.iter().sum::<f64>() / SIDES as f64;
    let mut grounds = Vec::new();

    let mean_off_m = off(mean(f.sides_m), mean(most_m));
    if let Some((level, limit_m)) = limits.scale_off_m.plus(more_m).level(mean_off_m) {
        let percent = 100.0 * (mean(f.sides_m) / side_m - 1.0);
        let text = format!(
            "the four sides measure {lengths} mm, in the mean {:.1} mm ({percent:+.1} % of {:.0} mm); between {:.1} \
             and {:.1} mm are expected of this cloth (limit {:.1} mm beyond): check the specimen's size and the scan's \
             scale, the vertical one too",
            mm(mean(f.sides_m)),
            mm(side_m),
            mm(least_m),
            mm(mean(most_m)),
            mm(limit_m)
        );
        let measured = (mm(mean_off_m), mm(limit_m), "mm");
        grounds.push(Ground::new(Code::Scale, level, measured, text));
    }

    let off_m: [f64; SIDES] = std::array::from_fn(|s| off(f.sides_m[s], most_m[s]));
    let worst = (0..SIDES).max_by(|&a, &b| off_m[a].total_cmp(&off_m[b])).unwrap_or(0);
    if let Some((level, limit_m)) = limits.side_off_m.plus(more_m).level(off_m[worst]) {
        let text = format!(
            "side {worst} of the rim measures {:.1} mm; between {:.1} and {:.1} mm are expected of this cloth (limit \
             {:.1} mm beyond; the four measure {lengths}): check the specimen's size, the scan's scale, and whether \
             the cloth is cut or folded there",
            mm(f.sides_m[worst]),
            mm(least_m),
            mm(most_m[worst]),
            mm(limit_m)
        );
        let measured = (mm(off_m[worst]), mm(limit_m), "mm");
        grounds.push(Ground::new(Code::SideLength, level, measured, text));
    }
    grounds
}

/// The cloth from edge to opposite edge against what the specimen, its folds and its stretch
/// allow: the worse of the two.
fn width(f: &Figures, scan: &OnPlate, limits: &Limits) -> Option<Ground> {
    let side_m = f.given.side_m;
    let softest_m = limits.least_bending_length_m;
    // Along the weft first.
    let [bending_m, stretch] = match &f.answer {
        Some(answer) => [[answer.bending_length_m; 2], answer.stretch],
        None => [[softest_m, f64::INFINITY], [UNKNOWN_STRETCH; 2]],
    };
    let [most_loss_m, least_loss_m] =
        bending_m.map(|length_m| limits.side_loss_m2 / length_m.max(softest_m));
    let least_m = side_m - most_loss_m - limits.width_lead_m;
    let more_m = limits.width_off_per_noise * scan.noise_m;
    let [warp_m, weft_m] = scan.widths_m;
    let measured = [("weft", weft_m, stretch[0]), ("warp", warp_m, stretch[1])];
    let off = measured.into_iter().filter_map(|(thread, width_m, stretch)| {
        let width_m = width_m?;
        let most_m = side_m * (1.0 + limits.stretch_of_width * stretch) - least_loss_m;
        let off_m = (width_m - most_m).max(least_m - width_m);
        let (level, limit_m) = limits.width_off_m.plus(more_m).level(off_m)?;
        Some((off_m, level, limit_m, thread, width_m, most_m))
    });
    let worst = off.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let (off_m, level, limit_m, thread, width_m, most_m) = worst;
    let text = format!(
        "along the {thread} the scanned cloth measures {:.1} mm from edge to edge ({:+.1} % of {:.0} mm); between \
         {:.1} and {:.1} mm are expected (limit {:.1} mm beyond): check the specimen's size and the scan's scale, the \
         vertical one too",
        mm(width_m),
        100.0 * (width_m / side_m - 1.0),
        mm(side_m),
        mm(least_m),
        mm(most_m),
        mm(limit_m)
    );
    Some(Ground::new(Code::Width, level, (mm(off_m), mm(limit_m), "mm"), text))
}

/// The plate found against the plate given.
fn plate(f: &Figures, scan: &OnPlate, limits: &Limits) -> Option<Ground> {
    let (given_m, sigma_m) = (f.given.plate_radius_m, scan.radius_sigma_m);
    let expected_m = given_m - limits.plate_lead_m;
    let larger_m = scan.radius_m - expected_m;
    let (off_m, steps, sigmas) = if larger_m > 0.0 {
        (larger_m, limits.plate_larger_m, limits.plate_larger_sigmas)
    } else if sigma_m <= limits.plate_arched_sigma_m {
        (-larger_m, limits.plate_smaller_m, limits.plate_smaller_sigmas)
    } else {
        return None;
    };
    let (level, limit_m) = steps.plus(sigmas * sigma_m).level(off_m)?;
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

/// What is nearly as bad as what `scan` refuses.
fn near_refusal(f: &Figures, scan: &OnPlate, limits: &Limits) -> Vec<Ground> {
    let share = limits.near_refusal;
    let near = |code, measured: f64, refused: f64, unit, text: String| {
        (measured > share * refused)
            .then(|| Ground::new(code, Level::Doubtful, (measured, share * refused, unit), text))
    };
    let mut sorted_m = f.sides_m;
    sorted_m.sort_by(f64::total_cmp);
    let median_m = 0.5 * (sorted_m[1] + sorted_m[2]);
    let uneven_m = sorted_m.iter().map(|m| (m - median_m).abs()).fold(0.0, f64::max);
    let refused_m = f.given.most_uneven_m;
    let uneven = near(
        Code::UnevenSides,
        mm(uneven_m),
        mm(refused_m),
        "mm",
        format!(
            "one side differs by {:.1} mm from the median of the four (doubtful beyond {:.1}, refused beyond {:.1} mm): \
         cloth may be joined wrongly there; scan it from more sides, or lay the specimen anew",
            mm(uneven_m),
            share * mm(refused_m),
            mm(refused_m)
        ),
    );
    let refused_m = f.given.most_misfit_m;
    let misfit = near(
        Code::SheetMisfit,
        mm(scan.misfit_m),
        mm(refused_m),
        "mm",
        format!(
            "the fitted sheet is {:.2} mm off the scanned cloth (doubtful beyond {:.2}, refused beyond {:.2} mm): it may \
         have missed a fold; lay the specimen anew, without creases",
            mm(scan.misfit_m),
            share * mm(refused_m),
            mm(refused_m)
        ),
    );
    let [area_mm2, refused_mm2] =
        [scan.unexplained_m2, f.given.most_unexplained_m2].map(|m2| m2 / (M_PER_MM * M_PER_MM));
    let unexplained = near(
        Code::Unexplained,
        area_mm2,
        refused_mm2,
        "mm^2",
        format!(
            "{area_mm2:.0} square millimetres of scanned cloth near the rim lie off the fitted sheet (doubtful beyond \
         {:.0}, refused beyond {refused_mm2:.0}): a fold may be hidden there; add views",
            share * refused_mm2
        ),
    );
    [uneven, misfit, unexplained].into_iter().flatten().collect()
}

fn rim_from_file() -> Ground {
    let text = "the rim was read from a file: the plate, the noise and the cloth itself could not be checked";
    let measured = (1.0, 0.0, "");
    Ground::new(Code::RimFromFile, Level::Reliable, measured, text.to_owned())
}

/// How much of the rim was not seen: doubtful near the limits at which a scan is refused, not to
/// be used beyond them (which only a rim from a file can be).
fn hidden(f: &Figures, limits: &Limits) -> Vec<Ground> {
    let share = limits.near_refusal;
    let refused = 1.0 - f.given.least_observed;
    let steps = Steps { doubtful: share * refused, do_not_use: refused };
    let hidden = 1.0 - f.observed_fraction;
    let rim = steps.level(hidden).map(|(level, limit)| {
        let text = format!(
            "{:.0} % of the rim was not seen but bridged (limit {:.0} %): add views",
            100.0 * hidden,
            100.0 * limit
        );
        Ground::new(Code::RimHidden, level, (hidden, limit, ""), text)
    });
    let refused_m = f.given.longest_gap_m;
    let steps = Steps { doubtful: share * refused_m, do_not_use: refused_m };
    let arc = steps.level(f.longest_gap_m).map(|(level, limit_m)| {
        let text = format!(
            "an arc of {:.0} mm of the rim was not seen but bridged (limit {:.0} mm): add a view of it",
            mm(f.longest_gap_m),
            mm(limit_m)
        );
        Ground::new(Code::RimBridged, level, (mm(f.longest_gap_m), mm(limit_m), "mm"), text)
    });
    [rim, arc].into_iter().flatten().collect()
}

/// Which direction is the warp.
fn warp(f: &Figures, limits: &Limits) -> Vec<Ground> {
    let mut grounds = Vec::new();
    if f.orientation == Orientation::Ambiguous {
        let text = "weft and warp may be exchanged: each interval covers both readings; say --warp-toward, or --mark";
        let ground = Ground::new(
            Code::OrientationAmbiguous,
            Level::Reliable,
            (2.0, 1.0, ""),
            text.to_owned(),
        );
        grounds.push(ground);
    }
    if f.warp_unused {
        let text = "the file says where the warp is, and --warp-toward was not used; write 0 into its column \
                    warp_known to have it used";
        let ground =
            Ground::new(Code::WarpFromFile, Level::Reliable, (1.0, 0.0, ""), text.to_owned());
        grounds.push(ground);
    }
    let limit_deg = 45.0 - limits.diagonal_deg;
    if let Some(off_deg) = f.warp_off_rad.map(f64::to_degrees).filter(|off| *off > limit_deg) {
        let text = format!(
            "the direction given for the warp is {off_deg:.0} degrees off the nearest axis of the specimen (limit \
             {limit_deg:.0}), {:.0} degrees from a diagonal: weft and warp may be exchanged; look up the direction \
             again, or use --mark",
            45.0 - off_deg
        );
        let measured = (off_deg, limit_deg, "degrees");
        grounds.push(Ground::new(Code::WarpNearDiagonal, Level::Doubtful, measured, text));
    }
    grounds
}

fn novel(answer: &Answer, limits: &Limits) -> Option<Ground> {
    let (level, limit) = limits.novelty.level(answer.novelty_m / answer.novelty_limit_m)?;
    let (measured_mm, limit_mm) = (mm(answer.novelty_m), limit * mm(answer.novelty_limit_m));
    let text = format!(
        "the rim is {measured_mm:.2} mm (rms) from any drape that the model knows (limit {limit_mm:.2} mm; 99 % of \
         drapes like those of its training stay below {:.2}): check the scan; no interval holds for such a rim",
        mm(answer.novelty_limit_m)
    );
    Some(Ground::new(Code::NovelRim, level, (measured_mm, limit_mm, "mm"), text))
}

/// A stiffness at the end of what the model was trained on, or its interval cut there.
fn range_end(p: &Parameter, limits: &Limits) -> Option<Ground> {
    let Parameter { key, unit, value, interval90: [low, high], trained, pinned } = *p;
    let ends = ["lower", "upper"];
    if let Some(end) = pinned {
        // The interval has shrunk to the bound: it lies beyond as a whole.
        let gone = low >= trained[1] || high <= trained[0];
        let (level, beyond) = if gone {
            (Level::DoNotUse, "the fabric lies beyond it, and so does the whole interval")
        } else {
            (Level::Doubtful, "the fabric may lie beyond it, and the interval cannot say so")
        };
        let text = format!(
            "{key} is {value:.0} {unit}, at the {} end of what the model was trained on ({:.0} to {:.0}): {beyond}",
            ends[end], trained[0], trained[1]
        );
        let measured = (value, trained[end], unit);
        return Some(Ground::new(Code::OutOfRange, level, measured, text).about(key));
    }
    // Both are cut at the very number.
    let end = [low <= trained[0], high >= trained[1]].iter().position(|cut| *cut)?;
    // The interval is even about the value in logarithms, before it is cut.
    let (whole, kept) = match end {
        0 => ((high / value).ln(), (value / low).ln()),
        _ => ((value / low).ln(), (high / value).ln()),
    };
    let share = 0.5 * (1.0 - kept / whole).max(0.0);
    let limit = limits.interval_cut;
    let level = if share > limit { Level::Doubtful } else { Level::Reliable };
    let text = format!(
        "the interval of {key} is cut at the {} end of what the model was trained on, {:.0} {unit}, by {:.0} % of its \
         length (limit {:.0} %): the fabric may lie beyond it",
        ends[end],
        trained[end],
        100.0 * share,
        100.0 * limit
    );
    Some(Ground::new(Code::IntervalAtBound, level, (share, limit, ""), text).about(key))
}

fn density(answer: &Answer, limits: &Limits) -> Option<Ground> {
    let (density, [least, most]) = answer.density_outside_g_m2?;
    let (level, factor) = limits.density_factor.level((density / most).max(least / density))?;
    let limit = if density > most { most * factor } else { least / factor };
    let text = format!(
        "the density, {density:.0} g/m^2, lies outside the {least:.0} to {most:.0} g/m^2 that the model was trained \
         on: every stiffness is extrapolated; weigh the specimen again"
    );
    let measured = (density, limit, "g/m^2");
    Some(Ground::new(Code::DensityOutsideTraining, level, measured, text))
}

fn bending_raised(answer: &Answer) -> Option<Ground> {
    let [from, to] = answer.bending_raised?;
    let unit = crate::base::units::BENDING_UNIT;
    let text = format!(
        "bending_bias was estimated as {from:.0} {unit} and raised to {to:.0}, the least that bending_weft and \
         bending_warp allow"
    );
    Some(Ground::new(Code::BendingProjected, Level::Reliable, (from, to, unit), text))
}

/// The count of folds against that of cloth with the bending length of the answer.
fn folds_for_bending(f: &Figures, answer: &Answer, limits: &Limits) -> Option<Ground> {
    let root_m05 = answer.bending_length_m.sqrt();
    let [least, most] = limits.folds_root_m05.map(|limit| limit / root_m05);
    let folds = f.folds as f64;
    let (level, beyond) = limits.folds_beyond.level((folds - most).max(least - folds))?;
    let text = format!(
        "the rim has {folds:.0} folds; cloth with the bending length found, {:.1} mm, makes {least:.1} to {most:.1} \
         (limit {beyond:.1} beyond): the folds are not those of hanging cloth (pleated, creased, held), or the bending \
         stiffness is off",
        mm(answer.bending_length_m)
    );
    let limit = if folds > most { most + beyond } else { least - beyond };
    Some(Ground::new(Code::FoldsForBending, level, (folds, limit, ""), text))
}

/// The drape of the estimate beside the scan.
fn resimulated(f: &Figures, again: &Fit, limits: &Limits) -> Vec<Ground> {
    let mut grounds = Vec::new();
    if let Some((level, limit_m)) = limits.resimulated_m.level(again.mean_m) {
        let text = format!(
            "draped again with these stiffnesses, the rim lies {:.1} mm from the scanned one in the mean (limit {:.0} \
             mm; honest scans come within {:.0}): the stiffnesses do not reproduce the drape; check the scan, or lay \
             the specimen anew",
            mm(again.mean_m),
            mm(limit_m),
            mm(limits.resimulated_m.doubtful)
        );
        let measured = (mm(again.mean_m), mm(limit_m), "mm");
        grounds.push(Ground::new(Code::ResimulationOff, level, measured, text));
    }
    let differ = f.folds.abs_diff(again.folds) as f64;
    if let Some((level, limit)) = limits.resimulated_folds.level(differ) {
        let text = format!(
            "draped again with these stiffnesses, the cloth has {} folds, the scan {} (limit {limit:.1} apart): it \
             fell into another shape, or the folds are not those of hanging cloth",
            again.folds, f.folds
        );
        grounds.push(Ground::new(Code::FoldsDiffer, level, (differ, limit, ""), text));
    }
    if again.stop != Stop::AtRest {
        let text = format!(
            "the drape of these stiffnesses did not come to rest ({}; a force of {:.1e} N is left): its distance from \
             the scan says little",
            again.stop.name(),
            again.residual_n
        );
        let measured = (again.residual_n, 0.0, "N");
        grounds.push(Ground::new(Code::ResimulationNotAtRest, Level::Doubtful, measured, text));
    }
    if again.intersections > 0 {
        let text = format!(
            "the drape of these stiffnesses passes through itself in {} pairs of triangles: it is no cloth's; please \
             report it",
            again.intersections
        );
        let measured = (again.intersections as f64, 0.0, "");
        grounds.push(Ground::new(Code::ResimulationIntersects, Level::Doubtful, measured, text));
    }
    grounds
}
