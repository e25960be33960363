//! Smooth fields on the cloth that would explain what a fit leaves, of natural curvature, of weight
//! or of bending: a tracer of effects that are on no list.
//!
//! In: the least squares around a plain fit, the numbers of the effects found. Out: [`Field`]s,
//! numbers at 5 x 5 nodes over the specimen. Curvatures along weft and warp come in two layers:
//! what turns over with the specimen, as the cloth's own curl does, and what bends it upwards
//! whichever face is up. Weight and bending are what they are with either face up. How far
//! neighbouring nodes may differ is what is most probable of what is tried; the least of that
//! leaves a field that is even.
//!
//! It shows where on the cloth something is, and hardly what: an effect that moves the
//! sheet as a curvature at that place would is drawn as one. The three are told next to each other,
//! the most probable first. Where drapes are seen from above alone, much of the plate's cloth moves
//! nothing, and the field there is that of its neighbours.

use super::effect::{Effect, FieldOf, LAYER_NODES, Layer, Layers, Number};
use super::evidence::{Around, Discrepancy, Forms};
use super::smooth::{STEPS, smoothness_of, unit_of};
use crate::sim::experiment::{CURL_NODES, NodeField, Outline, Specimen};

/// One layer of a field.
#[derive(Clone, Copy, Debug)]
pub struct FieldLayer {
    /// What it is of.
    pub of: FieldOf,
    /// What it does when the specimen is turned over.
    pub layer: Layer,
    /// Its numbers \[1/m of curvatures, else 1\]; curvatures are positive towards the face of a
    /// specimen that lies with it up.
    pub values: NodeField,
    /// Standard errors of these.
    pub errors: NodeField,
}

/// A field on the cloth.
#[derive(Clone, Debug)]
pub struct Field {
    /// What it is of, as files have it: `curvature`, `weight` or `bending`.
    pub name: &'static str,
    /// Its layers, in the order of [`super::effect::FIELDS`].
    pub layers: Vec<FieldLayer>,
    /// How far neighbouring nodes may differ: standard deviation, in the layers' unit.
    pub step: f64,
    /// Whether that is the least of what is tried, so that the field is the same all over the
    /// cloth.
    pub is_even: bool,
    /// Logarithm of how many times as probable what was measured is with it as without.
    pub ln_gain: f64,
}

/// Where a field is strongest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strongest {
    /// Which of its layers.
    pub layer: usize,
    /// Place on the specimen as fractions of its sides along warp and weft, 0 to 1.
    pub place: [f64; 2],
    /// Its value there \[1/m of curvatures, else 1\].
    pub value: f64,
    /// The standard error of that.
    pub error: f64,
}

/// Logarithm of the odds from which on a field is something.
const SURE_LN: f64 = 3.0;
/// Parts of a specimen's side between the places at which a field is looked at.
const LOOKS: usize = 40;

/// The fields of what is left beside some numbers, the most probable first.
pub(super) fn fields(
    around: &Around,
    forms: &Forms,
    comparison: &[&'static Number],
    usual: Discrepancy,
) -> Vec<Field> {
    let Some(without) = around.evidence(forms, comparison) else { return Vec::new() };
    let without = without.ln(usual.of_any_size());
    let of = |(effect, layers): &'static (Effect, Layers)| {
        let tried = STEPS.iter().zip(smoothness_of(layers)).filter_map(|(step, smooth)| {
            let evidence = around.of_field(forms, comparison, effect, &smooth)?;
            Some((*step, evidence.ln(usual.of_any_size()), smooth))
        });
        let (step, ln, smooth) = tried.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let [values, errors] = around.at_nodes(forms, comparison, effect, &smooth)?;
        Some(Field {
            name: effect.name,
            layers: layers_of(layers, &values, &errors),
            step: step * unit_of(layers[0].0),
            is_even: step <= STEPS[0],
            ln_gain: ln - without,
        })
    };
    let mut fields: Vec<Field> = around.fields().iter().filter_map(of).collect();
    fields.sort_by(|a, b| b.ln_gain.total_cmp(&a.ln_gain));
    fields
}

/// Numbers in the order of a field's layers.
fn layers_of(layers: Layers, values: &[f64], errors: &[f64]) -> Vec<FieldLayer> {
    let nodes = |all: &[f64], layer: usize| {
        let of_layer = &all[layer * LAYER_NODES..][..LAYER_NODES];
        let node = |i: usize, j: usize| of_layer[i * CURL_NODES + j];
        NodeField { nodes: std::array::from_fn(|i| std::array::from_fn(|j| node(i, j))) }
    };
    let layer = |(k, (of, layer)): (usize, &(FieldOf, Layer))| FieldLayer {
        of: *of,
        layer: *layer,
        values: nodes(values, k),
        errors: nodes(errors, k),
    };
    layers.iter().enumerate().map(layer).collect()
}

impl FieldLayer {
    /// What it is of, in words.
    #[must_use]
    pub fn title(&self) -> String {
        match (self.of, self.layer) {
            (FieldOf::Weight | FieldOf::Bending, _) => self.of.name().to_owned(),
            (of, Layer::Turns) => format!("along the {}, turns over", of.name()),
            (of, Layer::Stays) => format!("along the {}, stays up", of.name()),
        }
    }

    /// What is left of it at a place, given as fractions of the specimen's sides along warp and
    /// weft, less two standard errors, with its sign.
    #[must_use]
    pub fn sure_at(&self, [warp, weft]: [f64; 2]) -> f64 {
        let (value, error) = (self.values.at(warp, weft), self.errors.at(warp, weft));
        value.signum() * (value.abs() - 2.0 * error).max(0.0)
    }
}

impl Field {
    /// Whether it is twenty times as probable as nothing. The smoothness is the best of those
    /// tried, so that the odds are a little too good.
    #[must_use]
    pub fn is_something(&self) -> bool {
        self.ln_gain > SURE_LN
    }

    /// Where it is strongest on a specimen, less two standard errors.
    #[must_use]
    pub fn strongest(&self, specimen: &Specimen) -> Option<Strongest> {
        let places = (0..=LOOKS).flat_map(|i| (0..=LOOKS).map(move |j| [i, j]));
        let places = places.map(|place| place.map(|k| k as f64 / LOOKS as f64));
        let places = places.filter(|place| is_on(specimen, *place));
        let all = places.flat_map(|place| (0..self.layers.len()).map(move |layer| (layer, place)));
        let strongest = all.map(|(layer, place)| {
            let FieldLayer { values, errors, .. } = &self.layers[layer];
            let [value, error] = [values, errors].map(|field| field.at(place[0], place[1]));
            Strongest { layer, place, value, error }
        });
        let sure = |s: &Strongest| self.layers[s.layer].sure_at(s.place).abs();
        strongest.max_by(|a, b| sure(a).total_cmp(&sure(b)))
    }
}

/// Whether a place, given as fractions of the sides along warp and weft, is on a specimen.
#[must_use]
pub fn is_on(specimen: &Specimen, [warp, weft]: [f64; 2]) -> bool {
    let inside = [warp, weft].into_iter().all(|t| (0.0..=1.0).contains(&t));
    match specimen.outline {
        Outline::Rectangle => inside,
        Outline::Disc => (warp - 0.5).hypot(weft - 0.5) <= 0.5,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::effect::FIELDS;

    #[test]
    fn a_field_is_strongest_where_its_node_is_unless_there_is_no_cloth() {
        let (_, layers) = &FIELDS[0];
        let mut values = vec![0.0; 4 * LAYER_NODES];
        // what stays, along the warp, node 3 along the warp and 1 along the weft; and a larger one
        // in a corner
        values[3 * LAYER_NODES + 3 * CURL_NODES + 1] = -7.0;
        values[3 * LAYER_NODES] = 9.0;
        // and a still larger one that is not sure
        values[6] = 30.0;
        let mut errors = vec![1.0; 4 * LAYER_NODES];
        errors[6] = 15.0;
        let field = Field {
            name: "curvature",
            layers: layers_of(layers, &values, &errors),
            step: 5.0,
            is_even: false,
            ln_gain: 5.0,
        };
        let disc = Specimen { outline: Outline::Disc, ..Specimen::default() };
        let found = field.strongest(&disc).unwrap();
        let own = &field.layers[found.layer];
        assert_eq!((own.of, own.layer), (FieldOf::CurvatureWarp, Layer::Stays));
        assert_eq!((found.place, found.value, found.error), ([0.75, 0.25], -7.0, 1.0));
        assert_eq!(field.strongest(&Specimen::default()).unwrap().place, [0.0, 0.0]);
        assert!(field.is_something());
        assert!(!Field { ln_gain: 1.0, ..field }.is_something());
    }
}
