//! From the figures to the grounds: one function for each thing that may speak against a
//! result. Those of the rim and the scan are here, those of the bench in [`bench`], those of the
//! estimate in [`answer`].

mod answer;
mod bench;

use super::figures::{Figures, OnPlate, Parameter, Refining};
use super::limits::{Limits, Steps};
use super::scale::Scale;
use super::{Code, Ground, Level, Verdict};
use crate::base::boundary::{Orientation, SIDES};
use crate::base::units::{M_PER_MM, mm};
use crate::numeric::robust::median;

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
    /// Whether the values are those of the fit.
    fn is_taken(&self) -> bool {
        matches!(self.refining, Some(Refining::Taken { .. }))
    }

    /// Whether they are, and the fit's drape lies on the scan as it should.
    fn is_fitted(&self, limits: &Limits) -> bool {
        let most = limits.refined_misfit.doubtful;
        matches!(self.refining, Some(Refining::Taken { misfit, .. }) if misfit <= most)
    }

    /// The verdict of these figures under these limits.
    #[must_use]
    pub fn verdict(&self, limits: &Limits) -> Verdict {
        let mut grounds = Vec::new();
        grounds.extend(sides(self, limits));
        let scale = self.scan.as_ref().and_then(|scan| Scale::of(self, scan, limits));
        if !grounds.iter().any(|ground: &Ground| ground.code == Code::Scale) {
            grounds.extend(scale.and_then(|scale| off_scale(self, &scale, limits)));
        }
        if let Some(scan) = &self.scan {
            grounds.extend(width(self, scan, limits));
            grounds.extend(bench::plate(self, scan, limits));
            grounds.extend(bench::off_centre(self, scan, limits));
            grounds.extend(uneven(self, limits));
            grounds.extend(near_refusal(self, scan, limits));
        } else {
            grounds.push(rim_from_file());
        }
        grounds.extend(bench::tilted(self, limits));
        grounds.extend(hidden(self, limits));
        grounds.extend(warp(self, limits));
        if let Some(answer) = &self.answer {
            grounds.extend(answer::novel(self, answer, limits));
            grounds.extend(answer::outside_prior(answer, limits));
            grounds.extend(answer.parameters.iter().filter_map(|p| answer::range_end(p, limits)));
            grounds.extend(answer::density(answer, limits));
            grounds.extend(answer::bending_raised(answer));
            grounds.extend(answer::folds_for_bending(self, answer, limits));
        }
        if let Some(refining) = &self.refining {
            grounds.extend(answer::refined(refining, limits));
        }
        if let Some(released) = &self.released {
            grounds.extend(answer::released(self, released, limits));
        }
        Verdict { scale, ..Verdict::of(grounds) }
    }
}

/// Stretch of hanging cloth of which nothing is known: the limpest of the measured fabrics.
const UNKNOWN_STRETCH: f64 = 0.05;

/// What the specimen, its folds and its stretch allow the sides of a rim.
struct Sides {
    least_m: f64,
    /// Sides 0 and 2 run along the weft, 1 and 3 along the warp.
    most_m: [f64; SIDES],
    /// What noise adds to every limit.
    more_m: f64,
    /// Whether folds of such cloth may touch.
    touches: bool,
    /// The four lengths, in words.
    lengths: String,
}

impl Sides {
    fn of(f: &Figures, limits: &Limits) -> Self {
        let side_m = f.given.side_m;
        let softest_m = limits.least_bending_length_m;
        let (bending_m, stretch) = match &f.answer {
            Some(answer) => (answer.bending_length_m, answer.stretch),
            None => (softest_m, [0.0; 2]),
        };
        let chords_m = if f.scan.is_none() { limits.chord_share * side_m } else { 0.0 };
        let most = |s: usize| side_m * (1.0 + limits.stretch_of_rim * stretch[s % 2]);
        Self {
            least_m: side_m - limits.side_loss_m2 / bending_m.max(softest_m) - chords_m,
            most_m: std::array::from_fn(most),
            more_m: limits.side_off_per_noise * f.noise_m,
            touches: bending_m < limits.touching_bending_length_m,
            lengths: f.sides_m.map(|m| format!("{:.1}", mm(m))).join(", "),
        }
    }

    /// By how much a length is too long or too short.
    fn off_m(&self, length_m: f64, most_m: f64) -> f64 {
        (length_m - most_m).max(self.least_m - length_m).max(0.0)
    }
}

/// The sides of the rim against what is expected of them: one by one, and those of a rim from a
/// file in the mean too, which tells its scale. The sheet of a scan is fitted with the specimen's
/// lengths; its scale is told by [`Scale`].
fn sides(f: &Figures, limits: &Limits) -> Vec<Ground> {
    let expected = Sides::of(f, limits);
    let mean = if f.scan.is_none() { mean_side(f, &expected, limits) } else { None };
    mean.into_iter().chain(worst_side(f, &expected, limits)).collect()
}

/// The mean of the four sides.
fn mean_side(f: &Figures, expected: &Sides, limits: &Limits) -> Option<Ground> {
    let mean = |values: [f64; SIDES]| values.iter().sum::<f64>() / SIDES as f64;
    let [mean_m, most_m] = [f.sides_m, expected.most_m].map(mean);
    let off_m = expected.off_m(mean_m, most_m);
    let (level, limit_m) = limits.scale_off_m.plus(expected.more_m).level(off_m)?;
    let percent = 100.0 * (mean_m / f.given.side_m - 1.0);
    let text = format!(
        "the four sides measure {} mm, on average {:.1} mm ({percent:+.1} % of {:.0} mm); between {:.1} \
         and {:.1} mm are expected of this cloth (limit {:.1} mm beyond): check the specimen's size and the scan's \
         scale, the vertical one too",
        expected.lengths,
        mm(mean_m),
        mm(f.given.side_m),
        mm(expected.least_m),
        mm(most_m),
        mm(limit_m)
    );
    Some(Ground::new(Code::Scale, level, (mm(off_m), mm(limit_m), "mm"), text))
}

/// The side that is farthest off. The drape of a fitted fabric has the specimen's sides, and its
/// misfit tells whether the scan's rim has them: a side is for information then. Where folds touch
/// one side may be read wrongly; a specimen of another size has more than one.
fn worst_side(f: &Figures, expected: &Sides, limits: &Limits) -> Option<Ground> {
    let off_m: [f64; SIDES] =
        std::array::from_fn(|s| expected.off_m(f.sides_m[s], expected.most_m[s]));
    let worst = (0..SIDES).max_by(|&a, &b| off_m[a].total_cmp(&off_m[b])).unwrap_or(0);
    let steps = limits.side_off_m.plus(expected.more_m);
    let (level, limit_m) = steps.level(off_m[worst])?;
    let alone = off_m.iter().filter(|off_m| **off_m > steps.doubtful).count() == 1;
    let check =
        "check the specimen's size, the scan's scale, and whether the cloth is cut or folded there";
    let is_fitted = f.scan.is_some() && f.is_fitted(limits);
    let (level, what_follows) = match (is_fitted, expected.touches && alone) {
        (true, _) => {
            (Level::Reliable, "the fitted drape, with the specimen's sides, is on the scan")
        }
        (false, true) => (Level::Doubtful, check),
        (false, false) => (level, check),
    };
    let text = format!(
        "side {worst} of the rim measures {:.1} mm; between {:.1} and {:.1} mm are expected of this cloth (limit \
         {:.1} mm beyond; the four measure {}): {what_follows}",
        mm(f.sides_m[worst]),
        mm(expected.least_m),
        mm(expected.most_m[worst]),
        mm(limit_m),
        expected.lengths
    );
    let measured = (mm(off_m[worst]), mm(limit_m), "mm");
    Some(Ground::new(Code::SideLength, level, measured, text))
}

/// A scale that moves bending by more than its interval knows of.
fn off_scale(f: &Figures, scale: &Scale, limits: &Limits) -> Option<Ground> {
    let half = |p: &Parameter| 0.5 * (p.interval90[1] / p.interval90[0]).ln();
    let bending = f.answer.as_ref()?.parameters.iter().filter(|p| p.key.starts_with("bending"));
    let known = bending.map(half).fold(f64::INFINITY, f64::min);
    let moves = scale.bending_moves(limits);
    if !scale.is_off() || moves <= known {
        return None;
    }
    let Scale { value, sigma, cloth, plate } = *scale;
    let text = format!(
        "the scan's scale is {value:.3} +- {sigma:.3} (cloth {:.3} +- {:.3}, plate {:.3} +- {:.3}), which moves bending \
         by about {:.0} % (its interval is {:.0} %): measure the specimen; if it is of {:.0} mm, give --rescale {value:.3}",
        cloth.value,
        cloth.sigma,
        plate.value,
        plate.sigma,
        100.0 * moves,
        100.0 * known,
        mm(f.given.side_m)
    );
    let measured = (100.0 * moves, 100.0 * known, "%");
    Some(Ground::new(Code::Scale, Level::Doubtful, measured, text))
}

/// The cloth from edge to opposite edge against what the specimen, its folds and its stretch
/// allow: the worse of the two.
fn width(f: &Figures, scan: &OnPlate, limits: &Limits) -> Option<Ground> {
    let side_m = f.given.side_m;
    let softest_m = limits.least_bending_length_m;
    // Along the weft first.
    let (bending_m, stretch) = match &f.answer {
        Some(answer) => (answer.bending_length_m, answer.stretch),
        None => (softest_m, [UNKNOWN_STRETCH; 2]),
    };
    let loss_m = limits.side_loss_m2 / bending_m.max(softest_m);
    let least_m = side_m - loss_m - limits.width_lead_m;
    let more_m = limits.width_off_per_noise * f.noise_m;
    let swell_m = limits.width_swell_per_noise * f.noise_m;
    let [warp_m, weft_m] = scan.widths_m;
    let measured = [("weft", weft_m, stretch[0]), ("warp", warp_m, stretch[1])];
    let off = measured.into_iter().filter_map(|(thread, width_m, stretch)| {
        let width_m = width_m?;
        let most_m = side_m * (1.0 + limits.stretch_of_width * stretch) + swell_m;
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

/// A side that differs from the others. For information where a fitted drape, whose sides do not,
/// lies on the scan.
fn uneven(f: &Figures, limits: &Limits) -> Option<Ground> {
    let median_m = median(f.sides_m.to_vec())?;
    let off_m = f.sides_m.iter().map(|m| (m - median_m).abs()).fold(0.0, f64::max);
    let limit_m = limits.uneven_share * f.given.side_m + limits.uneven_per_noise * f.noise_m;
    let (level, what_follows) = match f.is_fitted(limits) {
        true => (Level::Reliable, "the fitted drape, with even sides, is on the scan"),
        false => (
            Level::Doubtful,
            "soft cloth lies double where folds touch, which no camera sees, or cloth is joined wrongly there; stretch and \
             shear may be off by more than their intervals; scan it from more sides, or lay the specimen again",
        ),
    };
    let text = format!(
        "one side differs by {:.1} mm from the median of the four (limit {:.1} mm): {what_follows}",
        mm(off_m),
        mm(limit_m)
    );
    let measured = (mm(off_m), mm(limit_m), "mm");
    (off_m > limit_m).then(|| Ground::new(Code::UnevenSides, level, measured, text))
}

/// What is nearly as bad as what `scan` refuses. For information where a fitted drape lies on the
/// scan: a fold that was missed would be off it.
fn near_refusal(f: &Figures, scan: &OnPlate, limits: &Limits) -> Vec<Ground> {
    let share = limits.near_refusal;
    let is_fitted = f.is_fitted(limits);
    let near = |code, measured: f64, refused: f64, unit, text: String, check| {
        let (level, what_follows) = match is_fitted {
            true => (Level::Reliable, "the fitted drape is on the scan"),
            false => (Level::Doubtful, check),
        };
        let text = format!("{text}: {what_follows}");
        (measured > share * refused)
            .then(|| Ground::new(code, level, (measured, share * refused, unit), text))
    };
    let refused_m = f.given.most_misfit_m;
    let misfit = near(
        Code::SheetMisfit,
        mm(scan.misfit_m),
        mm(refused_m),
        "mm",
        format!(
            "the fitted sheet is {:.2} mm off the scanned cloth (doubtful beyond {:.2}, refused beyond {:.2} mm, or a \
         quarter more where noise blurs the folds)",
            mm(scan.misfit_m),
            share * mm(refused_m),
            mm(refused_m)
        ),
        "it may have missed a fold; lay the specimen again, without creases",
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
         {:.0}, refused beyond {refused_mm2:.0})",
            share * refused_mm2
        ),
        "a fold may be hidden there; add views",
    );
    [misfit, unexplained].into_iter().flatten().collect()
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
            "{:.0} % of the rim was not observed but bridged (limit {:.0} %): add views",
            100.0 * hidden,
            100.0 * limit
        );
        Ground::new(Code::RimHidden, level, (hidden, limit, ""), text)
    });
    let refused_m = f.given.longest_gap_m;
    let steps = Steps { doubtful: share * refused_m, do_not_use: refused_m };
    let arc = steps.level(f.longest_gap_m).map(|(level, limit_m)| {
        let text = format!(
            "an arc of {:.0} mm of the rim was not observed but bridged (limit {:.0} mm): add a view of it",
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
        let text = "weft and warp may be exchanged: give --warp-toward or --mark; else each interval of an \
                    estimate covers both readings";
        let ground = Ground::new(
            Code::OrientationAmbiguous,
            Level::Reliable,
            (2.0, 1.0, ""),
            text.to_owned(),
        );
        grounds.push(ground);
    }
    if f.warp_unused {
        let text = "the file gives the warp, and --warp-toward was not used; write 0 into the file's column \
                    warp_known to use it";
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
