//! Repeated drapes of one fabric, each estimated, as one fabric with its scatter.
//!
//! In: the params.json files of drapes ([`read()`]). Out: a [`Combined`]: for each stiffness the
//! geometric mean with its 90 % interval, standard deviation and coefficient of variation
//! ([`pooled`] has the method and its sources); the folds of each drape; what was left out and why;
//! which drapes lie apart.
//!
//! Left out, and named: drapes whose verdict is `do not use`; of several results of one scan all
//! but the refined one; scans that another drape's refinement has used already; where weft and warp
//! are known in some, those in which they are not. Nothing else is: outlying drapes are named and
//! stay. Refused: drapes of different densities, and results of different models or numerics, which
//! are not of one measurement.

mod drape;
mod error;
mod file;
pub mod pooled;
mod read;
mod show;

use std::collections::BTreeMap;
use std::path::Path;

pub use drape::{Drape, LeftOut};
pub use error::{CombineError, DENSITY_RATIO};
pub use file::SCHEMA_VERSION;
pub use pooled::Pooled;
pub use read::{files, read};
pub use show::{json, table};

use crate::fabric::{STIFFNESSES, TABLE_2};
use crate::numeric::moments::{mean, mean_and_error};

/// Share of what an answer states as its variance that all drapes of a fabric err by alike, for
/// each stiffness: what the network does not know of a fabric. Set on sixty-eight fabrics of four
/// simulated drops (`docs/validation/network.md`, "Several drops of one fabric").
pub const COMMON: [f64; STIFFNESSES] = [0.65, 0.65, 0.75, 0.4, 0.4, 0.4];

/// A drape that is in the mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Used {
    /// The drape.
    pub drape: Drape,
    /// What sets it apart from the others; nothing for most.
    pub outlying: Vec<String>,
}

/// One stiffness over the drapes, paper's unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Combination {
    /// Name in files.
    pub key: &'static str,
    /// The paper's symbol.
    pub symbol: &'static str,
    /// Unit of the numbers.
    pub unit: &'static str,
    /// The weighted geometric mean.
    pub value: f64,
    /// The 90 % interval of the fabric's value.
    pub interval90: [f64; 2],
    /// Plain mean of the values.
    pub mean: f64,
    /// Their standard deviation; `None` of one.
    pub sd: Option<f64>,
    /// The same as a share of the mean \[%\].
    pub cv_percent: Option<f64>,
    /// The pooling, of logarithms.
    pub pooled: Pooled,
    /// Whether all drapes lie inside what the model was trained on.
    pub in_range: bool,
}

/// Repeats of one fabric.
#[derive(Clone, Debug, PartialEq)]
pub struct Combined {
    /// The six stiffnesses.
    pub parameters: [Combination; STIFFNESSES],
    /// Mean density \[g/m^2\].
    pub density_g_m2: f64,
    /// Drapes by their folds.
    pub folds: BTreeMap<usize, usize>,
    /// The count of folds that most have, if one is commonest.
    pub modal: Option<usize>,
    /// The drapes in the mean.
    pub used: Vec<Used>,
    /// Those that are not.
    pub left_out: Vec<LeftOut>,
    /// What has to be known.
    pub notes: Vec<String>,
}

/// Combines drapes.
///
/// # Errors
/// When they are not of one fabric or one program, or none can be used.
pub fn combine(drapes: Vec<Drape>) -> Result<Combined, CombineError> {
    let (used, left_out) = chosen(drapes);
    if used.is_empty() {
        return Err(CombineError::NothingLeft { left_out });
    }
    one_program(&used)?;
    one_density(&used)?;
    let parameters: [Combination; STIFFNESSES] = std::array::from_fn(|k| combination(&used, k));
    let folds = by_folds(&used);
    let modal = modal(&folds);
    let notes = notes(&used);
    let densities: Vec<f64> = used.iter().map(|drape| drape.density_g_m2).collect();
    let apart = |(k, drape): (usize, Drape)| {
        let outlying = outlying(&drape, k, &parameters, modal);
        Used { drape, outlying }
    };
    let used = used.into_iter().enumerate().map(apart).collect();
    let density_g_m2 = mean(&densities);
    Ok(Combined { parameters, density_g_m2, folds, modal, used, left_out, notes })
}

/// The drapes that go into the mean, and the others.
fn chosen(drapes: Vec<Drape>) -> (Vec<Drape>, Vec<LeftOut>) {
    let some_oriented = drapes.iter().any(|d| d.oriented && !d.is_unusable());
    let reasons: Vec<Option<String>> =
        (0..drapes.len()).map(|k| reason(&drapes, k, some_oriented)).collect();
    let (mut used, mut left_out) = (Vec::new(), Vec::new());
    for (drape, reason) in drapes.into_iter().zip(reasons) {
        match reason {
            Some(reason) => left_out.push(LeftOut { drape, reason }),
            None => used.push(drape),
        }
    }
    (used, left_out)
}

/// Why a drape is left out, if it is.
fn reason(drapes: &[Drape], k: usize, some_oriented: bool) -> Option<String> {
    let drape = &drapes[k];
    if drape.is_unusable() {
        return Some(format!("its verdict is `do not use` ({})", drape.grounds.join(", ")));
    }
    let usable = || drapes.iter().enumerate().filter(|(i, d)| *i != k && !d.is_unusable());
    let better = usable().find(|(i, other)| {
        let rank = |d: &Drape, i: usize| (!d.refined, d.with.is_empty(), i);
        other.input == drape.input && rank(other, *i) < rank(drape, k)
    });
    if let Some((_, other)) = better {
        let why = if other.refined && !drape.refined { ", which is refined" } else { "" };
        return Some(format!("of the same scan as {}{why}", other.file.display()));
    }
    if drape.with.is_empty()
        && let Some((_, other)) = usable().find(|(_, other)| other.with.contains(&drape.input))
    {
        let file = other.file.display();
        return Some(format!("its scan is in {file} already, which was refined with it"));
    }
    if some_oriented && !drape.oriented {
        return Some("weft and warp are not known in it, as they are in others".to_owned());
    }
    None
}

fn one_program(drapes: &[Drape]) -> Result<(), CombineError> {
    let first = &drapes[0];
    let of = |d: &Drape| {
        let [id, sha256] = &d.model;
        let model = format!("{id} {}", sha256.chars().take(12).collect::<String>());
        [("models", model), ("numerics", d.numerics.to_string())]
    };
    for drape in drapes {
        for ((what, a), (_, b)) in of(first).into_iter().zip(of(drape)) {
            if a != b {
                let (one, other) = (first.file.clone(), drape.file.clone());
                return Err(CombineError::Versions { one, other, what, values: [a, b] });
            }
        }
    }
    Ok(())
}

fn one_density(drapes: &[Drape]) -> Result<(), CombineError> {
    let by = |a: &&Drape, b: &&Drape| a.density_g_m2.total_cmp(&b.density_g_m2);
    let (Some(lightest), Some(heaviest)) = (drapes.iter().min_by(by), drapes.iter().max_by(by))
    else {
        return Ok(());
    };
    if heaviest.density_g_m2 <= DENSITY_RATIO * lightest.density_g_m2 {
        return Ok(());
    }
    Err(CombineError::Densities {
        lightest: lightest.file.clone(),
        heaviest: heaviest.file.clone(),
        densities: [lightest.density_g_m2, heaviest.density_g_m2],
    })
}

fn combination(drapes: &[Drape], k: usize) -> Combination {
    let values: Vec<f64> = drapes.iter().map(|drape| drape.values[k]).collect();
    let ln: Vec<f64> = values.iter().map(|v| v.ln()).collect();
    let stated = |drape: &Drape| pooled::stated_sigma(drape.values[k], drape.interval90[k]);
    let sigma: Vec<f64> = drapes.iter().map(stated).collect();
    let pooled = pooled::pool(&ln, &sigma, COMMON[k]);
    let [mean, error] = mean_and_error(&values);
    let sd = Some(error * (values.len() as f64).sqrt()).filter(|sd| sd.is_finite());
    let single = (drapes.len() == 1).then(|| drapes[0].interval90[k]);
    Combination {
        key: TABLE_2[k].key,
        symbol: TABLE_2[k].symbol,
        unit: TABLE_2[k].unit,
        value: pooled.ln_mean.exp(),
        interval90: single.unwrap_or_else(|| pooled.ln_interval90.map(f64::exp)),
        mean,
        sd,
        cv_percent: sd.map(|sd| 100.0 * sd / mean),
        pooled,
        in_range: drapes.iter().all(|drape| drape.in_range[k]),
    }
}

fn by_folds(drapes: &[Drape]) -> BTreeMap<usize, usize> {
    let mut counts = BTreeMap::new();
    for folds in drapes.iter().filter_map(|drape| drape.folds) {
        *counts.entry(folds).or_insert(0) += 1;
    }
    counts
}

/// The commonest count, if no other is as common.
fn modal(folds: &BTreeMap<usize, usize>) -> Option<usize> {
    let most = *folds.values().max()?;
    let mut commonest = folds.iter().filter(|(_, count)| **count == most);
    let first = commonest.next()?;
    commonest.next().is_none().then_some(*first.0)
}

/// What sets a drape apart: other folds than most have, and values far from the others'.
fn outlying(
    drape: &Drape,
    k: usize,
    parameters: &[Combination],
    modal: Option<usize>,
) -> Vec<String> {
    let mut said = Vec::new();
    if let (Some(folds), Some(modal)) = (drape.folds, modal)
        && folds != modal
    {
        said.push(format!("{folds} folds, most have {modal}: another of the fabric's drapes"));
    }
    for (p, parameter) in parameters.iter().enumerate() {
        let Some([by, limit]) = parameter.pooled.off[k] else { continue };
        if by.abs() > limit {
            let (value, key, unit) = (drape.values[p], parameter.key, parameter.unit);
            said.push(format!(
                "{key} {value:.4e} {unit} lies {by:+.1} standard deviations from the others (limit {limit:.1}): look at \
                 its scan and how it was laid"
            ));
        }
    }
    said
}

fn notes(drapes: &[Drape]) -> Vec<String> {
    let mut notes = Vec::new();
    let all = drapes.len();
    let count = |test: &dyn Fn(&Drape) -> bool| drapes.iter().filter(|d| test(d)).count();
    if all == 1 {
        notes.push("one drape: its own interval, and no scatter between drapes".to_owned());
    } else if all < 4 {
        notes.push(format!("{all} drapes: too few to tell an outlying one by its values"));
    }
    let refined = count(&|d| d.refined);
    if refined > 0 && refined < all {
        notes.push(format!(
            "{refined} of {all} drapes are refined: the others weigh little next to them; refine all"
        ));
    }
    let doubtful = count(&|d| d.verdict == crate::job::verdict::Level::Doubtful.name());
    if doubtful > 0 {
        notes.push(format!("{doubtful} of {all} drapes are doubtful"));
    }
    if count(&|d| d.oriented) == 0 {
        notes.push(
            "weft and warp are not known in any drape and may be exchanged between them".to_owned(),
        );
    }
    for [copy, of] in copies(drapes) {
        notes.push(format!(
            "{} has the numbers of {}: a copy of one scan is no second drop; leave it out",
            copy.display(),
            of.display()
        ));
    }
    let versions: std::collections::BTreeSet<&str> =
        drapes.iter().map(|d| d.version.as_str()).collect();
    if versions.len() > 1 {
        let versions: Vec<&str> = versions.into_iter().collect();
        notes.push(format!("made with versions {} of the program", versions.join(" and ")));
    }
    notes
}

/// Files whose six stiffnesses over density are those of an earlier one, with that one: no two
/// drops agree in as many digits.
fn copies(drapes: &[Drape]) -> Vec<[&Path; 2]> {
    /// Share by which numbers of one scan may differ, by rounding alone.
    const ROUNDING: f64 = 1e-6;
    let over_density = |d: &Drape, k: usize| d.values[k] / d.density_g_m2;
    let same = |a: &Drape, b: &Drape| {
        (0..STIFFNESSES).all(|k| (over_density(a, k) / over_density(b, k) - 1.0).abs() < ROUNDING)
    };
    let of = |k: usize| {
        let copy = &drapes[k];
        drapes[..k].iter().find(|of| same(of, copy)).map(|of| [&*copy.file, &*of.file])
    };
    (1..drapes.len()).filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    fn drape(name: &str, factor: f64) -> Drape {
        let values = [131e3, 164e3, 75e3, 1120.0, 1371.0, 1245.0].map(|v| v * factor);
        Drape {
            file: PathBuf::from(format!("{name}.params.json")),
            input: format!("{name}.ply"),
            values,
            interval90: values.map(|v| [v / 1.3, v * 1.3]),
            in_range: [true; 6],
            density_g_m2: 180.0,
            folds: Some(6),
            verdict: "reliable".to_owned(),
            grounds: Vec::new(),
            refined: false,
            with: Vec::new(),
            oriented: true,
            rim_error_mm: None,
            model: ["m".to_owned(), "abc".to_owned()],
            numerics: 4,
            version: "0.1.0".to_owned(),
        }
    }

    fn reasons_of(drapes: Vec<Drape>) -> Vec<(String, String)> {
        let found = combine(drapes).unwrap();
        let of = |l: &LeftOut| (l.drape.input.clone(), l.reason.clone());
        found.left_out.iter().map(of).collect()
    }

    #[test]
    fn the_mean_is_geometric_and_the_scatter_plain() {
        let drapes = ["a", "b", "c"].into_iter().zip([0.5, 1.0, 2.0]);
        let found = combine(drapes.map(|(name, factor)| drape(name, factor)).collect()).unwrap();
        let shear = &found.parameters[2];
        assert!((shear.value / 75e3 - 1.0).abs() < 1e-9, "{}", shear.value);
        assert!((shear.mean / 75e3 - 3.5 / 3.0).abs() < 1e-12);
        // squares of 0.5, 1, 2 about 3.5 / 3
        let sd = 75e3 * ((0.25 + 1.0 + 4.0 - 3.5 * 3.5 / 3.0) / 2.0_f64).sqrt();
        assert!((shear.sd.unwrap() / sd - 1.0).abs() < 1e-12);
        assert!((shear.cv_percent.unwrap() - 100.0 * sd / shear.mean).abs() < 1e-9);
        let [low, high] = shear.interval90;
        assert!((low * high / (75e3 * 75e3) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_not_to_be_used_is_left_out_and_named() {
        let bad = Drape {
            verdict: "do_not_use".to_owned(),
            grounds: vec!["plate_radius".to_owned()],
            ..drape("bad", 9.0)
        };
        let said = reasons_of(vec![drape("a", 1.0), bad.clone(), drape("b", 1.1)]);
        assert_eq!(said.len(), 1);
        assert!(said[0].0 == "bad.ply" && said[0].1.contains("plate_radius"), "{said:?}");
        let error = combine(vec![bad]).unwrap_err();
        assert!(matches!(error, CombineError::NothingLeft { .. }), "{error}");
    }

    #[test]
    fn of_one_scan_the_refined_result_is_taken_wherever_it_stands() {
        let refined = Drape { refined: true, file: "r.params.json".into(), ..drape("a", 1.2) };
        for drapes in [[drape("a", 1.0), refined.clone()], [refined.clone(), drape("a", 1.0)]] {
            let found = combine(drapes.to_vec()).unwrap();
            assert_eq!(found.used.len(), 1);
            assert!(found.used[0].drape.refined);
            assert!(found.left_out[0].reason.contains("which is refined"), "{:?}", found.left_out);
        }
        // twice the same is one drape
        assert_eq!(reasons_of(vec![drape("a", 1.0), drape("a", 1.0)]).len(), 1);
    }

    #[test]
    fn a_scan_in_a_joint_refinement_counts_once() {
        let joint = Drape { refined: true, with: vec!["b.ply".to_owned()], ..drape("a", 1.0) };
        let said = reasons_of(vec![joint, drape("b", 1.0), drape("c", 1.0)]);
        assert_eq!(said.len(), 1);
        assert!(said[0].0 == "b.ply" && said[0].1.contains("refined with it"), "{said:?}");
    }

    #[test]
    fn drapes_without_a_warp_are_not_mixed_with_those_that_have_one() {
        let unknown = Drape { oriented: false, ..drape("u", 1.0) };
        let said = reasons_of(vec![drape("a", 1.0), unknown.clone()]);
        assert!(said[0].1.contains("weft and warp"), "{said:?}");
        let found = combine(vec![unknown.clone(), Drape { input: "v.ply".into(), ..unknown }]);
        let found = found.unwrap();
        assert_eq!(found.used.len(), 2);
        assert!(found.notes.iter().any(|note| note.contains("exchanged")), "{:?}", found.notes);
    }

    #[test]
    fn a_copy_of_a_scan_is_named_even_where_its_density_is_another() {
        let other = drape("other", 1.01);
        let mut copy = drape("copy", 1.03);
        copy.density_g_m2 *= 1.03;
        let found = combine(vec![drape("own", 1.0), other, copy]).unwrap();
        let of_copies: Vec<_> = found.notes.iter().filter(|note| note.contains("copy")).collect();
        assert_eq!(of_copies.len(), 1, "{of_copies:?}");
        assert!(
            of_copies[0].starts_with("copy.params.json has the numbers of own.params.json"),
            "{of_copies:?}"
        );
    }

    #[test]
    fn fabrics_and_programs_are_not_mixed() {
        let heavy = |density_g_m2| Drape { density_g_m2, ..drape("h", 1.0) };
        assert!(combine(vec![drape("a", 1.0), heavy(188.9)]).is_ok());
        let error = combine(vec![drape("a", 1.0), heavy(189.1)]).unwrap_err();
        assert!(matches!(error, CombineError::Densities { .. }), "{error}");
        let old = Drape { numerics: 3, ..drape("o", 1.0) };
        let error = combine(vec![drape("a", 1.0), old]).unwrap_err();
        assert!(error.to_string().contains("different numerics (4 and 3)"), "{error}");
        let other = Drape { model: ["m".to_owned(), "abd".to_owned()], ..drape("o", 1.0) };
        let error = combine(vec![drape("a", 1.0), other]).unwrap_err();
        assert!(error.to_string().contains("different models"), "{error}");
    }

    #[test]
    fn folds_are_counted_and_the_odd_one_is_named() {
        let folds = |name: &str, folds| Drape { folds, ..drape(name, 1.0) };
        let drapes =
            vec![folds("a", Some(6)), folds("b", Some(6)), folds("c", Some(7)), folds("d", None)];
        let found = combine(drapes).unwrap();
        assert_eq!((found.modal, found.folds[&6], found.folds[&7]), (Some(6), 2, 1));
        let apart: Vec<usize> = found.used.iter().map(|u| u.outlying.len()).collect();
        assert_eq!(apart, [0, 0, 1, 0]);
        assert!(found.used[2].outlying[0].contains("7 folds, most have 6"));
        let even = combine(vec![folds("a", Some(6)), folds("b", Some(7))]).unwrap();
        assert_eq!(even.modal, None);
        assert!(even.used.iter().all(|used| used.outlying.is_empty()));
    }

    #[test]
    fn a_drape_far_off_is_named_with_the_stiffness() {
        let mut drapes: Vec<Drape> =
            (0..5).map(|k| drape(&format!("d{k}"), 1.0 + 0.02 * f64::from(k))).collect();
        for drape in &mut drapes {
            drape.interval90 = drape.values.map(|v| [v / 1.05, v * 1.05]);
        }
        drapes[3].values[4] *= 3.0;
        drapes[3].interval90[4] = drapes[3].interval90[4].map(|v| v * 3.0);
        let found = combine(drapes).unwrap();
        let named: Vec<usize> = found.used.iter().map(|u| u.outlying.len()).collect();
        assert_eq!(named, [0, 0, 0, 1, 0]);
        assert!(found.used[3].outlying[0].starts_with("bending_warp"), "{:?}", found.used[3]);
        // it stays in the mean
        assert_eq!(found.used.len(), 5);
    }
}
