//! What a calibration amounts to, in sentences: the verdict, what to do next, what the data cannot
//! decide.

use maud::{Markup, html};

use crate::base::units::mm;
use crate::calibrate::effect::Acts;
use crate::calibrate::explain::{Cause, Explanations};
use crate::calibrate::floor::Pairing;
use crate::calibrate::found::FoundEffect;
use crate::calibrate::manifest::{Face, Role};
use crate::calibrate::result::{FabricResult, Verdict};
use crate::numeric::moments::{mean, mean_and_error};
use crate::report::page::number::{fixed, percent};
use crate::report::page::units::words;

/// Share of the prior's uncertainty that drapes must remove for a stiffness to count as shown.
const SHOWN: f64 = 0.5;

/// An effect's name in words.
pub(super) fn effect(name: &str) -> String {
    name.replace('_', " ")
}

/// What pairs of outlines have in common, in words.
pub(super) fn pairing(pairing: Pairing) -> &'static str {
    match pairing {
        Pairing::Captures => "the drape (captures)",
        Pairing::Drops => "specimen and face (repeated drops)",
        Pairing::Faces => "the specimen (its two faces)",
        Pairing::Specimens => "the face (two specimens)",
    }
}

/// A role in words.
pub(super) fn role(role: Role) -> &'static str {
    match role {
        Role::Fit => "fitted",
        Role::Holdout => "held out",
    }
}

pub(super) fn verdict(fabric: &FabricResult) -> Markup {
    let (tone, word) = match fabric.verdict {
        Verdict::Found => ("reliable", "An effect is found"),
        Verdict::None => ("reliable", "No effect is needed"),
        Verdict::Undecided => ("doubtful", "Undecided"),
        Verdict::Unexplained => ("doubtful", "Something is unexplained"),
    };
    let tone = if fabric.coarse_cells().is_some() { "doubtful" } else { tone };
    html! {
        div class={ "verdict " (tone) } {
            p .lead { span .badge { (word) } }
            @for sentence in sentences(fabric) { p { (sentence) } }
        }
    }
}

/// The grounds of the verdict.
fn sentences(fabric: &FabricResult) -> Vec<String> {
    let mut out = Vec::new();
    out.extend(fabric.coarse_cells().map(|doubt| format!("Doubtful: {}.", doubt.text)));
    if let Some(explanations) = &fabric.explanations {
        out.push(explained(explanations));
    }
    if fabric.explanations.is_none() {
        out.push(
            "One sheet\u{2019}s equilibrium has no known derivative, so no effect was tested."
                .to_owned(),
        );
        return out;
    }
    if fabric.specimens_fitted() < FEWEST_SPECIMENS {
        out.push(format!("Drapes of fewer than {FEWEST_SPECIMENS} specimens were fitted: what is found may be a property of a specimen, not of the cloth."));
    }
    if let Some((face, [measured, simulated])) = fabric.other_face_is_off() {
        out.push(format!(
            "Drapes with the face {} were held out. Their drape coefficient is {} % and the simulated one {} %: what was fitted does not hold for that face.",
            face.name(),
            fixed(measured, 1),
            fixed(simulated, 1)
        ));
    }
    let names = |all: &[&'static str]| {
        all.iter().map(|name| effect(name)).collect::<Vec<_>>().join(" and ")
    };
    if let Some(after) = &fabric.after {
        let own: Vec<&'static str> = after.effects.iter().map(|found| found.effect.name).collect();
        out.push(format!("Added to the plain model: {}.", names(&own)));
        out.extend(confirmation(fabric));
    }
    out
}

/// What the drapes held out say of the effects that were added.
fn confirmation(fabric: &FabricResult) -> Vec<String> {
    let pairs = fabric.pairs();
    if pairs.is_empty() {
        return vec!["No drape was held out, so that nothing confirms it.".to_owned()];
    }
    let mut out = Vec::new();
    let of = |k: usize| mean(&pairs.iter().map(|p| mm(p.rms_m[k])).collect::<Vec<_>>());
    let fall: Vec<f64> = pairs.iter().map(|p| mm(p.rms_m[0] - p.rms_m[1])).collect();
    let [gain, error] = mean_and_error(&fall);
    let error =
        if error.is_finite() { format!(" \u{b1} {}", fixed(error, 2)) } else { String::new() };
    let held = pairs.len();
    let end = if fabric.is_confirmed() { "confirms" } else { "does not confirm" };
    out.push(format!(
        "On {held} drapes held out the outlines lie {} mm off without it and {} mm with it, a fall of {}{error} mm. Judged by the squares of the distances, at two standard errors, that {end} it.",
        fixed(of(0), 2),
        fixed(of(1), 2),
        fixed(gain, 2)
    ));
    let free: Vec<[f64; 2]> = pairs.iter().filter_map(|p| p.released_rms_m).collect();
    if !free.is_empty() {
        let of = |k: usize| mean(&free.iter().map(|both| mm(both[k])).collect::<Vec<_>>());
        out.push(format!(
            "Those sheets are tied to their scans. Released, they lie {} mm off without it and {} mm with it.",
            fixed(of(0), 2),
            fixed(of(1), 2)
        ));
        if fabric.falls_away() {
            out.push("With it, half of them or more do not rest where they were scanned: it stands for something else. Do not simulate with it.".to_owned());
        }
    }
    out
}

/// Specimens from which on what they have in common is taken for the cloth's.
const FEWEST_SPECIMENS: usize = 3;

/// What the drapes are explained by, with probabilities from one in a hundred on.
fn explained(explanations: &Explanations) -> String {
    let shown = explanations.0.iter().filter(|e| e.probability >= 0.01);
    let all = shown.map(|e| format!("{} {}", cause(&e.cause), percent(e.probability, 0)));
    format!("Probable explanations of the drapes: {}.", all.collect::<Vec<_>>().join(", "))
}

/// A cause in words.
pub(super) fn cause(cause: &Cause) -> String {
    match cause {
        Cause::Nothing => "nothing beyond the plain model".to_owned(),
        Cause::Effects(effects) => {
            effects.iter().map(|e| effect(e.name)).collect::<Vec<_>>().join(" and ")
        }
        Cause::Else => "something that is not on the list".to_owned(),
    }
}

/// What is to be done about the effects that were found: those of the cloth belong to it, those of
/// the stand are corrected there.
fn remedies(fabric: &FabricResult) -> Vec<&'static str> {
    let mut steps = Vec::new();
    if fabric.verdict != Verdict::Found {
        return steps;
    }
    let are_scans = fabric.measured.iter().all(|measured| measured.rim.is_some());
    for found in fabric.after.iter().flat_map(|after| &after.effects) {
        let step = match found.effect.name {
            "scale" if are_scans => {
                "Scan something of known size, correct the scans\u{2019} scale in the scanner\u{2019}s program, and calibrate again: until then the stiffnesses depend on the scale."
            }
            "scale" => {
                "Measure the pictures\u{2019} scale on something of known size, correct mm_per_pixel, and calibrate again: until then the stiffnesses depend on the scale."
            }
            "plate_radius" | "specimen_size" | "tilt" | "friction" => {
                "Measure what was found on the stand (plate, specimens, level, friction), correct it, and calibrate again."
            }
            _ => {
                "Use the parameters together with the effect of the cloth: without it the stiffnesses belong to another model. The command \u{201c}simulate --params\u{201d} takes both from the fabric's params.json."
            }
        };
        if !steps.contains(&step) {
            steps.push(step);
        }
    }
    steps
}

pub(super) fn next(fabric: &FabricResult) -> Markup {
    let mut steps: Vec<&str> = remedies(fabric);
    if fabric.coarse_cells().is_some() {
        steps.insert(0, "Fit again with more vertices (--vertices): the cells are too coarse.");
    }
    match fabric.verdict {
        Verdict::Found => {}
        Verdict::None => steps.push("Use the parameters of the plain model."),
        Verdict::Undecided if fabric.edge_at_limit() => steps.push("Measure a specimen\u{2019}s side, and scan something flat of known size: the scans\u{2019} edges lie farther from the cloth\u{2019}s than a sensor can shift them. The cause is the specimens\u{2019} size, the scans\u{2019} scale or the sensor. Specimens of measured size tell the sensor\u{2019}s part (sensor_edge): give it with --sensor-edge-mm."),
        Verdict::Undecided if fabric.explanations.is_some() => {
            steps.extend(fabric.next_measurement());
        }
        Verdict::Undecided => steps.push("Use the parameters of the plain model, and measure more specimens, on both faces, some held out: that confirms the effect or removes it."),
        Verdict::Unexplained => steps.push("Compare the residuals of all drapes: a residual that goes with the cloth, with the face or with the stand points to its cause."),
    }
    let faces = |face: Face| fabric.measured.iter().any(|m| m.entry.face == Some(face));
    if !(faces(Face::Up) && faces(Face::Down)) {
        steps.push("Measure the other face too: an effect of the cloth changes its sign with the face, one of the stand does not.");
    }
    if fabric.held_out_rms_m().is_empty() {
        steps.push("Hold some specimens out (role holdout).");
    }
    if !fabric.fabric_prior.density_known {
        steps.push("Weigh the fabric: without its density only stiffness over weight is known.");
    }
    html! {
        h3 { "What to do next" }
        ol .steps { @for step in &steps { li { (step) } } }
    }
}

/// What these data cannot decide.
pub(super) fn undecided(fabric: &FabricResult) -> Markup {
    let mut points: Vec<String> = Vec::new();
    let last = fabric.after.as_ref().map(|after| &after.fitted).or(fabric.fitted.as_ref().ok());
    if let Some(fitted) = last {
        let hidden: Vec<String> = fitted
            .stiffnesses
            .iter()
            .filter(|s| s.shown < SHOWN)
            .map(|s| format!("{} ({})", words(s.key).to_lowercase(), percent(s.shown, 0)))
            .collect();
        if !hidden.is_empty() {
            points.push(format!("These drapes remove less than half of the uncertainty of: {}. Those intervals are mostly the prior\u{2019}s.", hidden.join("; ")));
        }
    }
    for found in
        fabric.after.iter().flat_map(|after| &after.effects).filter(|found| !found.group.is_empty())
    {
        let others: Vec<String> = found.group.iter().map(|name| effect(name)).collect();
        points.push(format!(
            "{} cannot be told from {} by these outlines: any of them moves them alike.",
            effect(found.effect.name),
            others.join(", ")
        ));
    }
    let one_face = fabric.measured.iter().all(|m| m.entry.face != Some(Face::Down));
    let sided =
        |found: &&FoundEffect| found.numbers.iter().any(|(n, ..)| matches!(n.acts, Acts::Face(_)));
    if one_face {
        points.push("One face alone was measured: what changes its sign with the face cannot be told from what does not.".to_owned());
    } else if let Some(found) = fabric.after.iter().flat_map(|after| &after.effects).find(sided) {
        points.push(format!(
            "The sign of {} is that of the side called \u{201c}up\u{201d} in the manifest.",
            effect(found.effect.name)
        ));
    }
    if !fabric.fabric_prior.density_known {
        points.push("The density was not given: all stiffnesses scale with it.".to_owned());
    }
    points.push("An outline from above shows no heights: cloth that hangs differently under the same outline looks the same.".to_owned());
    html! {
        h3 { "What these data cannot decide" }
        ul .plainlist { @for point in &points { li { (crate::report::page::number::sentence(point)) } } }
    }
}
