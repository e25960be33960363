//! Every ground on constructed figures, on both sides of its limit.

use super::super::NotTaken;
use super::*;
use crate::base::boundary::Orientation;
use crate::fabric::{STIFFNESSES, TABLE_2};
use crate::refine::{Ended, FitError};
use crate::sim::Stop;

/// A good scan of the mean knit: bending length 8 mm, eight folds.
fn valid() -> Figures {
    let parameter = |i: usize| Parameter {
        key: TABLE_2[i].key,
        unit: TABLE_2[i].unit,
        value: TABLE_2[i].mean,
        interval90: [0.5 * TABLE_2[i].mean, 2.0 * TABLE_2[i].mean],
        trained: [TABLE_2[i].min, TABLE_2[i].max],
        pinned: None,
    };
    Figures {
        given: Given {
            side_m: 0.300,
            plate_radius_m: 0.050,
            least_observed: 0.75,
            longest_gap_m: 0.068,
            most_misfit_m: 0.22e-3,
            most_unexplained_m2: 33e-6,
        },
        sides_m: [0.2990, 0.2992, 0.2989, 0.2991],
        noise_m: 0.0,
        scan: Some(OnPlate {
            radius_m: 0.0491,
            radius_sigma_m: 0.4e-3,
            centre_offset_m: 2e-3,
            misfit_m: 0.07e-3,
            unexplained_m2: 0.0,
            widths_m: [Some(0.2985); 2],
        }),
        observed_fraction: 0.99,
        longest_gap_m: 0.010,
        folds: 8,
        orientation: Orientation::Given,
        warp_off_rad: Some(5_f64.to_radians()),
        warp_unused: false,
        answer: Some(Answer {
            bending_length_m: 8e-3,
            stretch: [0.004, 0.004],
            parameters: std::array::from_fn(parameter),
            density_outside_g_m2: None,
            novelty_m: 1.0e-3,
            novelty_limit_m: 2.0e-3,
            prior: Some(InPrior {
                network: true,
                like: true,
                distance: 1.2,
                limit: 3.75,
                words: "resembles in the training data: knits 91 %".to_owned(),
            }),
            bending_raised: None,
        }),
        refining: None,
        tilt_rad: 0.0,
        released: Some(Fit {
            mean_m: 6e-3,
            folds: 8,
            stop: Stop::AtRest,
            residual_n: 1e-8,
            intersections: 0,
        }),
    }
}

/// The verdict without the scale, which goes with every scan.
fn verdict(figures: &Figures) -> Verdict {
    Verdict { scale: None, ..figures.verdict(&Limits::default()) }
}

fn answer(f: &mut Figures) -> &mut Answer {
    f.answer.as_mut().unwrap()
}

/// Holds that nothing is said a little within a limit, and one ground of `code` and `level` a
/// little beyond it. `set` puts the number there; `limit` is what it comes to.
fn straddles(code: Code, level: Level, limit: f64, set: impl Fn(&mut Figures, f64)) {
    let at = |value: f64| {
        let mut figures = valid();
        set(&mut figures, value);
        verdict(&figures)
    };
    let found =
        |said: &Verdict| said.grounds.iter().find(|g| g.code == code && g.level == level).cloned();
    let (below, beyond) = (at(limit * 0.999), at(limit * 1.001));
    assert!(found(&below).is_none(), "{} at {limit}: {below:?}", code.name());
    let ground = found(&beyond).unwrap_or_else(|| panic!("{} at {limit}: {beyond:?}", code.name()));
    assert_eq!(beyond.level, level, "{beyond:?}");
    assert!((ground.measured / ground.limit - 1.0).abs() < 0.01, "{ground:?}");
    assert!(ground.text.len() > 40, "{}", ground.text);
}

#[test]
fn a_valid_scan_is_reliable_without_grounds() {
    assert_eq!(verdict(&valid()), Verdict::of(vec![]));
    // What the scan alone tells.
    let scan = Figures { answer: None, released: None, ..valid() };
    assert_eq!(verdict(&scan), Verdict::of(vec![]));
}

#[test]
fn a_scale_is_doubtful_that_moves_bending_by_more_than_its_interval() {
    let scaled = |by: f64, half: f64, noise_m: f64| {
        let mut figures = Figures { noise_m, ..valid() };
        let scan = figures.scan.as_mut().unwrap();
        scan.widths_m = [Some(0.2997 * by); 2];
        scan.radius_m = 0.0493 * by;
        for p in &mut answer(&mut figures).parameters {
            p.interval90 = [p.value / half.exp(), p.value * half.exp()];
        }
        figures.verdict(&Limits::default())
    };
    let is_said = |said: &Verdict| {
        said.grounds.iter().any(|g| (g.code, g.level) == (Code::Scale, Level::Doubtful))
    };
    for by in [0.988, 1.012] {
        let said = scaled(by, 0.05, 0.0);
        let scale = said.scale.unwrap();
        assert!((scale.value - by).abs() < 1e-3, "{scale:?}");
        assert!((0.003..0.004).contains(&scale.sigma) && is_said(&said), "{said:?}");
        // Where bending is known less well, where it is hardly off, or where noise may have made
        // it.
        assert!(!is_said(&scaled(by, 0.15, 0.0)) && !is_said(&scaled(by, 0.05, 2e-3)));
        assert!(!is_said(&scaled(1.0 + 0.4 * (by - 1.0), 0.01, 0.0)));
    }
    // The plate alone says little of it.
    let mut other = valid();
    other.scan.as_mut().unwrap().radius_m = 0.0475;
    let scale = |figures: &Figures| figures.verdict(&Limits::default()).scale;
    assert!((scale(&other).unwrap().value - 1.0).abs() < 6e-3);
    assert!(scale(&Figures { answer: None, ..valid() }).is_none());
}

#[test]
fn a_verdict_is_the_worst_of_its_grounds_and_names_that_first() {
    let ground =
        |level, text: &str| Ground::new(Code::SideLength, level, (1.0, 2.0, "mm"), text.to_owned());
    let said = Verdict::of(vec![ground(Level::Reliable, "a remark")]);
    assert_eq!((said.level, said.grounds.len()), (Level::Reliable, 1));
    let all = [
        ground(Level::Reliable, "a"),
        ground(Level::Doubtful, "b"),
        ground(Level::DoNotUse, "c"),
        ground(Level::Doubtful, "d"),
        ground(Level::Doubtful, "e").not_the_experiment(),
    ];
    let verdict = Verdict::of(all.to_vec());
    assert_eq!((verdict.level, verdict.not_the_experiment), (Level::DoNotUse, true));
    let texts: Vec<&str> = verdict.grounds.iter().map(|g| g.text.as_str()).collect();
    assert_eq!(texts, ["e", "c", "b", "d", "a"]);
    assert_eq!(verdict.refusal(), "what was scanned is not the experiment: e");
    assert!(verdict.is_refusal(false));
    let other = Verdict::of(all[..4].to_vec());
    assert!(!other.not_the_experiment && !other.is_refusal(false) && other.is_refusal(true));
    assert_eq!(other.refusal(), "the result is not to be used: c");
    assert!(!Verdict::of(all[..2].to_vec()).is_refusal(true), "doubtful is no refusal");
}

#[test]
fn codes_are_in_snake_case_and_all_different() {
    let mut names: Vec<&str> = Code::ALL.iter().map(|code| code.name()).collect();
    assert!(names.iter().all(|name| name.chars().all(|c| c.is_ascii_lowercase() || c == '_')));
    let count = names.len();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), count);
    assert_eq!(serde_json::to_value(Code::PlateRadius).unwrap(), "plate_radius");
}

#[test]
fn sides_are_held_against_the_specimen_s_its_folds_and_its_stretch() {
    let limits = Limits::default();
    let loss_m = limits.side_loss_m2 / 8e-3;
    let most_m = 0.300 * (1.0 + limits.stretch_of_rim * 0.004);
    let least_m = 0.300 - loss_m;
    for (level, one_m, all_m) in [
        (Level::Doubtful, limits.side_off_m.doubtful, limits.scale_off_m.doubtful),
        (Level::DoNotUse, limits.side_off_m.do_not_use, limits.scale_off_m.do_not_use),
    ] {
        // One side too long or too short.
        for (end_m, sign) in [(least_m, -1.0), (most_m, 1.0)] {
            straddles(Code::SideLength, level, one_m, |f, off_m| {
                f.sides_m = [end_m; 4];
                f.sides_m[2] += sign * off_m;
            });
        }
        // All of a rim from a file, whose sides are chords.
        let chords_m = limits.chord_share * 0.300;
        for (end_m, sign) in [(least_m - chords_m, -1.0), (most_m, 1.0)] {
            straddles(Code::Scale, level, all_m, |f, off_m| {
                f.scan = None;
                f.sides_m = [end_m + sign * off_m; 4];
            });
        }
    }
    // Noise widens the limits, stretch allows for longer sides, sharp folds for shorter ones.
    let sides = |by_m: f64, change: fn(&mut Figures)| {
        let mut figures = Figures { sides_m: [by_m; 4], ..valid() };
        change(&mut figures);
        verdict(&figures).level
    };
    let long_m = most_m + limits.side_off_m.doubtful + 0.1e-3;
    assert_eq!(sides(long_m, |_| ()), Level::Doubtful);
    assert_eq!(sides(long_m, |f| f.noise_m = 1e-3), Level::Reliable);
    assert_eq!(sides(long_m, |f| answer(f).stretch = [0.05; 2]), Level::Reliable);
    let short_m = least_m - limits.side_off_m.doubtful - 0.1e-3;
    assert_eq!(sides(short_m, |_| ()), Level::Doubtful);
    // With twelve folds the drape of eight would be another ground.
    let soft = |f: &mut Figures| {
        (f.folds, f.released) = (12, None);
        answer(f).bending_length_m = 3e-3;
    };
    assert_eq!(sides(short_m, soft), Level::Reliable);
}

#[test]
fn the_cloth_from_edge_to_edge_tells_a_scale_that_its_sides_hide() {
    let limits = Limits::default();
    let loss_m = limits.side_loss_m2 / 8e-3;
    let noise_m = 0.4e-3;
    for (level, limit_m) in [
        (Level::Doubtful, limits.width_off_m.doubtful),
        (Level::DoNotUse, limits.width_off_m.do_not_use),
    ] {
        let limit_m = limit_m + limits.width_off_per_noise * noise_m;
        for along in 0..2 {
            let most_m = 0.300 * (1.0 + limits.stretch_of_width * 0.004)
                + limits.width_swell_per_noise * noise_m;
            straddles(Code::Width, level, limit_m, |f, off_m| {
                f.noise_m = noise_m;
                f.scan.as_mut().unwrap().widths_m[along] = Some(most_m + off_m);
            });
            let least_m = 0.300 - loss_m - limits.width_lead_m;
            straddles(Code::Width, level, limit_m, |f, off_m| {
                f.noise_m = noise_m;
                f.scan.as_mut().unwrap().widths_m[along] = Some(least_m - off_m);
            });
        }
    }
    let mut found = valid();
    found.scan.as_mut().unwrap().widths_m = [Some(0.3045), None];
    assert_eq!(verdict(&found).level, Level::DoNotUse);
    // Limp cloth may be longer along its own threads: the warp is the second of the stretches.
    answer(&mut found).stretch = [0.05, 0.004];
    assert_eq!(verdict(&found).level, Level::DoNotUse);
    answer(&mut found).stretch = [0.004, 0.05];
    assert_eq!(verdict(&found), Verdict::of(vec![]));
    // Edges that nobody saw say nothing.
    found.scan.as_mut().unwrap().widths_m = [None; 2];
    assert_eq!(verdict(&found), Verdict::of(vec![]));
}

#[test]
fn off_centre_the_network_is_not_relied_on_and_the_fit_is() {
    let limits = Limits::default().off_centre_m;
    let set = |f: &mut Figures, off_m: f64| f.scan.as_mut().unwrap().centre_offset_m = off_m;
    for (level, limit_m) in
        [(Level::Doubtful, limits.doubtful), (Level::DoNotUse, limits.do_not_use)]
    {
        straddles(Code::OffCentre, level, limit_m, set);
    }
    straddles(Code::OffCentre, Level::Reliable, limits.doubtful, |f, off_m| {
        set(f, off_m);
        f.refining = Some(taken(0.9));
    });
}

#[test]
fn a_tilt_that_the_fit_has_is_a_note_and_one_that_it_could_not_explain_a_ground() {
    let limits = Limits::default().tilt_rad;
    let left = Refining::Left(NotTaken::NotConverged(Ended::Spent));
    for (level, limit) in [(Level::Doubtful, limits.doubtful), (Level::DoNotUse, limits.do_not_use)]
    {
        straddles(Code::Tilted, level, limit.to_degrees(), |f, tilt_deg| {
            f.tilt_rad = tilt_deg.to_radians();
            f.refining = Some(left.clone());
        });
    }
    straddles(Code::Tilted, Level::Reliable, limits.doubtful.to_degrees(), |f, tilt_deg| {
        f.tilt_rad = tilt_deg.to_radians();
        f.refining = Some(taken(0.9));
    });
}

#[test]
fn the_plate_found_is_held_against_the_plate_given_with_its_standard_error() {
    let limits = Limits::default();
    let expected_m = 0.050 - limits.plate_lead_m;
    for (sign, steps, sigmas) in [
        (1.0, limits.plate_larger_m, limits.plate_larger_sigmas),
        (-1.0, limits.plate_smaller_m, limits.plate_smaller_sigmas),
    ] {
        for (level, limit_m) in
            [(Level::Doubtful, steps.doubtful), (Level::DoNotUse, steps.do_not_use)]
        {
            straddles(Code::PlateRadius, level, limit_m + sigmas * 0.4e-3, |f, off_m| {
                f.scan.as_mut().unwrap().radius_m = expected_m + sign * off_m;
            });
        }
    }
    let mut other = valid();
    other.scan.as_mut().unwrap().radius_m = 0.044;
    assert!(verdict(&other).not_the_experiment, "{:?}", verdict(&other));
    // Stiff cloth arches over the plate and leaves it farther in, but not as far as it pleases,
    // and never farther out.
    other.scan.as_mut().unwrap().radius_sigma_m = 1.1e-3;
    assert_eq!(verdict(&other).level, Level::DoNotUse, "{:?}", verdict(&other));
    (other.folds, other.released) = (5, None);
    answer(&mut other).bending_length_m = 15e-3;
    assert_eq!(verdict(&other), Verdict::of(vec![]));
    other.scan.as_mut().unwrap().radius_m = 0.0405;
    assert_eq!(verdict(&other).level, Level::DoNotUse, "{:?}", verdict(&other));
    // Without an estimate there is nothing to hold it against.
    let silent = Figures { answer: None, ..other.clone() };
    assert_eq!(verdict(&silent), Verdict::of(vec![]));
    other.scan.as_mut().unwrap().radius_m = 0.058;
    assert!(verdict(&other).not_the_experiment, "{:?}", verdict(&other));
    // Another plate that was asked for is none.
    let mut asked = valid();
    asked.given.plate_radius_m = 0.060;
    asked.scan.as_mut().unwrap().radius_m = 0.0591;
    assert_eq!(verdict(&asked), Verdict::of(vec![]));
}

#[test]
fn a_side_is_for_information_where_a_fitted_drape_has_the_specimens_sides() {
    let level = |figures: Figures| {
        let said = verdict(&Figures { sides_m: [0.3055; 4], ..figures });
        let ground = said.grounds.iter().find(|ground| ground.code == Code::SideLength).cloned();
        (said.level, ground.unwrap().level)
    };
    let fitted = || Figures { refining: Some(taken(1.0)), released: None, ..valid() };
    assert_eq!(level(valid()), (Level::DoNotUse, Level::DoNotUse));
    assert_eq!(level(fitted()), (Level::Reliable, Level::Reliable));
    assert_eq!(level(Figures { scan: None, ..fitted() }).1, Level::DoNotUse);
    // and where one alone is off
    let uneven =
        |figures: Figures| verdict(&Figures { sides_m: [0.3, 0.3, 0.303, 0.3], ..figures });
    assert!(uneven(valid()).level >= Level::Doubtful);
    let said = uneven(fitted());
    assert!(said.grounds.iter().any(|ground| ground.code == Code::UnevenSides));
    assert_eq!(said.level, Level::Reliable);
    // A fit that leaves too much is the answer, and says nothing of the sides.
    let left = uneven(Figures { refining: Some(leaving(0.8)), ..fitted() });
    let doubts = |code| left.grounds.iter().any(|g| g.code == code && g.level == Level::Doubtful);
    assert!(doubts(Code::UnevenSides) && doubts(Code::ModelMisfit), "{left:?}");
}

#[test]
fn one_side_of_soft_cloth_may_be_read_wrongly_where_folds_touch() {
    straddles(Code::UnevenSides, Level::Doubtful, 2.0e-3, |f, off_m| {
        f.sides_m[1] = 0.2991 + off_m;
    });
    let with = |bending_length_m: f64, sides_m: [f64; 4]| {
        let mut figures = valid();
        figures.answer.as_mut().unwrap().bending_length_m = bending_length_m;
        figures.sides_m = sides_m;
        verdict(&figures)
    };
    let (soft_m, stiff_m) = (4e-3, 12e-3);
    let one = [0.2980, 0.2982, 0.2979, 0.3055];
    let said = with(soft_m, one);
    assert_eq!(said.level, Level::Doubtful, "{said:?}");
    let codes: Vec<Code> = said.grounds.iter().map(|ground| ground.code).collect();
    assert!(codes.contains(&Code::UnevenSides) && codes.contains(&Code::SideLength), "{codes:?}");
    assert_eq!(with(stiff_m, one).level, Level::DoNotUse);
    assert_eq!(with(soft_m, [0.3055, 0.2982, 0.3055, 0.2979]).level, Level::DoNotUse);
}

#[test]
fn what_is_nearly_refused_is_doubtful() {
    let near = Limits::default().near_refusal;
    let level = Level::Doubtful;
    straddles(Code::SheetMisfit, level, near * 0.22e-3, |f, misfit_m| {
        f.scan.as_mut().unwrap().misfit_m = misfit_m;
    });
    straddles(Code::Unexplained, level, near * 33e-6, |f, area_m2| {
        f.scan.as_mut().unwrap().unexplained_m2 = area_m2;
    });
    // a fold that was missed would be off a fitted drape
    let mut fitted = Figures { refining: Some(taken(1.0)), released: None, ..valid() };
    fitted.scan.as_mut().unwrap().misfit_m = 1.01 * near * 0.22e-3;
    fitted.scan.as_mut().unwrap().unexplained_m2 = 1.01 * near * 33e-6;
    let said = verdict(&fitted);
    let codes: Vec<Code> = said.grounds.iter().map(|ground| ground.code).collect();
    assert_eq!((said.level, codes), (Level::Reliable, vec![Code::SheetMisfit, Code::Unexplained]));
    for (level, share) in [(Level::Doubtful, near), (Level::DoNotUse, 1.0)] {
        straddles(Code::RimHidden, level, share * 0.25, |f, hidden| {
            f.observed_fraction = 1.0 - hidden;
        });
        straddles(Code::RimBridged, level, share * 0.068, |f, gap_m| f.longest_gap_m = gap_m);
    }
}

#[test]
fn a_rim_from_a_file_says_so_and_its_chords_may_be_short() {
    let file = Figures { scan: None, sides_m: [0.294; 4], ..valid() };
    let said = verdict(&file);
    assert_eq!(said.level, Level::Reliable);
    assert_eq!(said.grounds.iter().map(|g| g.code).collect::<Vec<_>>(), [Code::RimFromFile]);
    assert_eq!(verdict(&Figures { sides_m: [0.286; 4], ..file.clone() }).level, Level::DoNotUse);
    assert_eq!(verdict(&Figures { sides_m: [0.304; 4], ..file.clone() }).level, Level::DoNotUse);
    let bridged = Figures { observed_fraction: 0.0, longest_gap_m: 1.2, ..file.clone() };
    assert_eq!(verdict(&bridged).level, Level::DoNotUse);
    // one that says how noisy it is may be longer by that
    let soft = |sides_m: f64, noise_m: f64, figures: Figures| {
        let mut soft =
            Figures { sides_m: [sides_m; 4], folds: 12, released: None, noise_m, ..figures };
        answer(&mut soft).bending_length_m = 3e-3;
        verdict(&soft).level
    };
    assert_eq!(soft(0.3011, 0.0, file.clone()), Level::Reliable);
    assert_eq!(soft(0.3018, 0.0, file.clone()), Level::Doubtful);
    assert_eq!(soft(0.3018, 0.5e-3, file), Level::Reliable);
}

#[test]
fn a_warp_near_a_diagonal_is_doubtful_and_an_unknown_one_is_said() {
    let limit_deg = 45.0 - Limits::default().diagonal_deg;
    straddles(Code::WarpNearDiagonal, Level::Doubtful, limit_deg, |f, off_deg| {
        f.warp_off_rad = Some(off_deg.to_radians());
    });
    let unknown = Figures { orientation: Orientation::Ambiguous, warp_off_rad: None, ..valid() };
    let said = verdict(&unknown);
    assert_eq!((said.level, said.grounds[0].code), (Level::Reliable, Code::OrientationAmbiguous));
    let unused = Figures { warp_unused: true, warp_off_rad: None, ..valid() };
    let said = verdict(&unused);
    assert_eq!((said.level, said.grounds[0].code), (Level::Reliable, Code::WarpFromFile));
}

#[test]
fn an_estimate_outside_of_the_training_is_doubtful() {
    let limits = Limits::default();
    for (level, limit) in
        [(Level::Doubtful, limits.novelty.doubtful), (Level::DoNotUse, limits.novelty.do_not_use)]
    {
        straddles(Code::NovelRim, level, limit * 2e-3, |f, rms_m| answer(f).novelty_m = rms_m);
    }
    // The network's answer is not the fit's.
    straddles(Code::NovelRim, Level::Reliable, limits.novelty.doubtful * 2e-3, |f, rms_m| {
        answer(f).novelty_m = rms_m;
        f.refining = Some(taken(0.9));
    });
    let factor = limits.density_factor;
    for (level, limit) in [(Level::Doubtful, factor.doubtful), (Level::DoNotUse, factor.do_not_use)]
    {
        straddles(Code::DensityOutsideTraining, level, limit * 390.0, |f, density| {
            answer(f).density_outside_g_m2 = (density > 390.0).then_some((density, [76.0, 390.0]));
        });
    }
    let mut light = valid();
    answer(&mut light).density_outside_g_m2 = Some((60.0, [76.0, 390.0]));
    assert_eq!(verdict(&light).grounds[0].code, Code::DensityOutsideTraining);
    // as it was given: six is not six point three
    answer(&mut light).density_outside_g_m2 = Some((6.3, [76.0, 390.0]));
    let grounds = verdict(&light).grounds;
    assert!(grounds[0].text.contains("the density, 6.3 g/m^2,"), "{}", grounds[0].text);
}

/// An end of what the model was trained on.
fn p_end(parameter: usize, end: usize) -> f64 {
    [TABLE_2[parameter].min, TABLE_2[parameter].max][end]
}

#[test]
fn a_stiffness_at_its_bound_is_doubtful_and_an_interval_that_ends_there_is_said() {
    for i in 0..STIFFNESSES {
        for end in [0, 1] {
            let mut pinned = valid();
            let p = &mut answer(&mut pinned).parameters[i];
            (p.value, p.interval90[end], p.pinned) = (p.trained[end], p.trained[end], Some(end));
            let said = verdict(&pinned);
            assert_eq!((said.level, said.grounds.len()), (Level::Doubtful, 1), "{said:?}");
            let ground = &said.grounds[0];
            assert_eq!((ground.code, ground.parameter), (Code::OutOfRange, Some(TABLE_2[i].key)));
            assert!(ground.text.contains(["lower", "upper"][end]), "{}", ground.text);
            answer(&mut pinned).parameters[i].interval90 = [TABLE_2[i].min, TABLE_2[i].max];
            answer(&mut pinned).parameters[i].interval90[1 - end] = p_end(i, end);
            assert_eq!(verdict(&pinned).level, Level::DoNotUse);
            // The value may lie anywhere in an interval that is cut.
            let limit = Limits::default().interval_cut;
            for (share, level) in [(0.9 * limit, Level::Reliable), (1.1 * limit, Level::Doubtful)] {
                let mut cut = valid();
                let p = &mut answer(&mut cut).parameters[i];
                let kept = 2_f64.ln() * (1.0 - 2.0 * share);
                p.value =
                    if end == 0 { p.trained[0] * kept.exp() } else { p.trained[1] / kept.exp() };
                p.interval90 = [p.value / 2.0, p.value * 2.0];
                p.interval90[end] = p.trained[end];
                let said = verdict(&cut);
                assert_eq!((said.level, said.grounds.len()), (level, 1), "{said:?}");
                let ground = &said.grounds[0];
                assert_eq!(ground.code, Code::IntervalAtBound);
                assert_eq!(ground.parameter, Some(TABLE_2[i].key));
                assert!((ground.measured - share).abs() < 1e-9, "{ground:?}");
            }
        }
    }
    let mut raised = valid();
    answer(&mut raised).bending_raised = Some([100.0, 120.0]);
    let said = verdict(&raised);
    assert_eq!((said.level, said.grounds[0].code), (Level::Reliable, Code::BendingProjected));
}

#[test]
fn folds_are_held_against_the_bending_length_of_the_answer() {
    let with = |folds: usize, length_m: f64| {
        let mut f = Figures { folds, released: None, ..valid() };
        answer(&mut f).bending_length_m = length_m;
        // Sides of cloth with such folds.
        f.sides_m = [0.300 - Limits::default().side_loss_m2 / length_m; 4];
        verdict(&f)
    };
    let [least, most] = Limits::default().folds_root_m05;
    // A bending length for which the limits are whole numbers of folds and a half.
    let beyond = Limits::default().folds_beyond.doubtful;
    for (folds, length_m) in
        [(10, (most / (9.99 - beyond)).powi(2)), (6, (least / (6.01 + beyond)).powi(2))]
    {
        let said = with(folds, length_m);
        assert_eq!((said.level, said.grounds[0].code), (Level::Doubtful, Code::FoldsForBending));
    }
    for (folds, length_m) in
        [(10, (most / (10.01 - beyond)).powi(2)), (6, (least / (5.99 + beyond)).powi(2))]
    {
        assert_eq!(with(folds, length_m), Verdict::of(vec![]), "{folds} folds at {length_m} m");
    }
    let pleated = with(16, 8e-3);
    assert_eq!(pleated.level, Level::DoNotUse);
    assert!(pleated.grounds[0].text.contains("16 folds"), "{}", pleated.grounds[0].text);
    // Folds that the drape of a fit has are cloth's.
    let mut fitted = Figures { folds: 16, released: None, ..valid() };
    fitted.refining = Some(taken(0.9));
    assert_eq!(verdict(&fitted).level, Level::Reliable);
}

#[test]
fn the_released_drape_of_the_networks_fabric_is_held_against_the_scan() {
    let limits = Limits::default();
    let again = |f: &mut Figures, change: &dyn Fn(&mut Fit)| change(f.released.as_mut().unwrap());
    for (level, limit_m) in [
        (Level::Doubtful, limits.released_m.doubtful),
        (Level::DoNotUse, limits.released_m.do_not_use),
    ] {
        straddles(Code::ReleasedDrapeOff, level, limit_m, |f, mean_m| {
            again(f, &|fit| fit.mean_m = mean_m);
        });
    }
    // cloth of 16 mm and more falls into one shape, however it falls
    let [soft, stiff] = [limits.released_m, limits.released_stiff_m];
    let between = 0.5 * (soft.doubtful + stiff.doubtful);
    for (bending_m, limit_m) in
        [(10e-3, soft.doubtful), (13e-3, between), (16e-3, stiff.doubtful), (30e-3, stiff.doubtful)]
    {
        straddles(Code::ReleasedDrapeOff, Level::Doubtful, limit_m + 0.5e-3, |f, mean_m| {
            (f.noise_m, f.folds) = (0.5e-3, 4);
            answer(f).bending_length_m = bending_m;
            again(f, &|fit| (fit.mean_m, fit.folds) = (mean_m, 4));
        });
    }
    for (folds, level) in [
        (7, Level::Reliable),
        (9, Level::Reliable),
        (6, Level::Doubtful),
        (11, Level::Doubtful),
        (4, Level::DoNotUse),
        (12, Level::DoNotUse),
    ] {
        let mut f = valid();
        again(&mut f, &|fit| fit.folds = folds);
        assert_eq!(verdict(&f).level, level, "{folds} folds against 8");
    }
    for stop in [Stop::Slow, Stop::Unstable, Stop::Iterations] {
        let mut f = valid();
        again(&mut f, &|fit| fit.stop = stop);
        let said = verdict(&f);
        assert_eq!(
            (said.level, said.grounds[0].code),
            (Level::Doubtful, Code::ReleasedDrapeNotAtRest)
        );
    }
    let mut f = valid();
    again(&mut f, &|fit| fit.intersections = 1);
    let said = verdict(&f);
    assert_eq!(
        (said.level, said.grounds[0].code),
        (Level::Doubtful, Code::ReleasedDrapeIntersects)
    );
}

/// A refinement that was taken, whose drape took this share of what was uncertain of the first
/// stiffness away.
fn taken(share: f64) -> Refining {
    let shown = std::array::from_fn(|i| Shown {
        key: TABLE_2[i].key,
        share: if i == 0 { share } else { 0.99 },
    });
    Refining::Taken { shown, misfit: 0.2 }
}

/// What becomes of a fit that leaves this.
fn leaving(misfit: f64) -> Refining {
    let most = Limits::default().refined_misfit.do_not_use;
    match taken(0.99) {
        Refining::Taken { shown, .. } if misfit <= most => Refining::Taken { shown, misfit },
        _ => Refining::Left(NotTaken::Leaves { misfit, most }),
    }
}

#[test]
fn what_refining_found_is_held_against_its_limits() {
    let limits = Limits::default();
    for (level, limit) in [
        (Level::Doubtful, limits.refined_misfit.doubtful),
        (Level::DoNotUse, limits.refined_misfit.do_not_use),
    ] {
        straddles(Code::ModelMisfit, level, limit, |f, misfit| {
            f.refining = Some(leaving(misfit));
        });
    }
    let said = |refining: Refining| {
        verdict(&Figures { refining: Some(refining), released: None, ..valid() })
    };
    assert_eq!(said(taken(limits.shown + 0.01)), Verdict::of(vec![]));
    let hidden = said(taken(limits.shown - 0.01));
    assert_eq!((hidden.level, hidden.grounds[0].code), (Level::Reliable, Code::HardlyVisible));
    assert_eq!(hidden.grounds[0].parameter, Some("stretch_weft"));
    let bound = said(Refining::Left(NotTaken::AtBound("stretch_warp")));
    assert_eq!(bound.grounds[0].parameter, Some("stretch_warp"));
    for (why, level) in [
        (NotTaken::Failed(FitError::NothingObserved), Level::Doubtful),
        (NotTaken::Failed(FitError::Interrupted), Level::Reliable),
        (NotTaken::NotConverged(Ended::Spent), Level::Doubtful),
        (NotTaken::AtBound("shear"), Level::Doubtful),
        (NotTaken::OtherBranch { folds: [8, 9], rim_m: 7e-3 }, Level::Doubtful),
    ] {
        let other = said(Refining::Left(why));
        assert_eq!((other.level, other.grounds[0].code), (level, Code::NotRefined));
        assert!(other.grounds[0].text.contains("the values are the network's"));
    }
}

#[test]
fn a_released_drape_that_moves_on_is_only_said_of_a_refined_fabric() {
    let far_m = Limits::default().released_far_m;
    for (mean_m, grounds) in [(0.9 * far_m, 0), (1.1 * far_m, 1), (30e-3, 1)] {
        let mut f = Figures { refining: Some(taken(0.99)), ..valid() };
        f.released.as_mut().unwrap().mean_m = mean_m;
        let said = verdict(&f);
        assert_eq!((said.level, said.grounds.len()), (Level::Reliable, grounds), "{mean_m}");
        assert!(said.grounds.iter().all(|ground| ground.code == Code::ReleasedDrapeOff));
    }
}

#[test]
fn a_fabric_like_no_part_of_the_prior_is_doubtful_unless_it_was_refined() {
    let limits = Limits::default();
    let outside = limits.outside_prior;
    let steps = [(Level::Doubtful, outside.doubtful), (Level::DoNotUse, outside.do_not_use)];
    for (level, limit) in steps {
        straddles(Code::OutsidePrior, level, limit * 3.75, |f, distance| {
            let prior = answer(f).prior.as_mut().unwrap();
            (prior.distance, prior.like) = (distance, distance <= prior.limit);
            prior.words = "like neither the knits nor the measured fabrics".to_owned();
        });
    }
    // like another part, which is the less likely one; refined; of a model without a prior
    let mut far = valid();
    answer(&mut far).prior.as_mut().unwrap().distance = 4.0;
    assert_eq!(verdict(&far), Verdict::of(vec![]));
    answer(&mut far).prior.as_mut().unwrap().like = false;
    assert_eq!(verdict(&far).level, Level::Doubtful);
    answer(&mut far).prior.as_mut().unwrap().network = false;
    let said = verdict(&far);
    assert_eq!((said.level, said.grounds[0].code), (Level::Reliable, Code::OutsidePrior));
    answer(&mut far).prior = None;
    assert_eq!(verdict(&far), Verdict::of(vec![]));
}
