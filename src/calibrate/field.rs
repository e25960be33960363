//! The smoothest field of natural curvature on the cloth that would explain what a fit leaves: a tracer of effects that are on
//! no list.
//!
//! In: the least squares around a plain fit by specimens, the effects chosen. Out: [`Field`], curvatures along weft and warp at 5 x 5
//! nodes over the specimen, in two layers: what turns over with the specimen, as the cloth's own curl does, and what bends it
//! upwards whichever face is up, as a lighter or stiffer place does against a heavier or limper one. How far neighbouring nodes may
//! differ is what foretells the drapes of specimens held out best; the least of what is tried leaves a field that is even.
//!
//! It shows where on the cloth something is, and not what: whatever moves the outline as a curvature at that place would is
//! drawn as one. Where drapes are seen from above alone, much of the plate's cloth moves nothing, and the field there is
//! that of its neighbours.

use nalgebra::DMatrix;

use super::effect::{Effect, FIELD, FIELD_COMPONENTS, FIELD_NUMBERS};
use super::linear::{LEAST_GAIN, Linear, falls, positions};
use crate::numeric::moments::mean_and_error;
use crate::sim::experiment::{CURL_NODES, Curl, Outline, Specimen};

/// What a field's two layers do when the specimen is turned over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// It turns over with it.
    Turns,
    /// It bends upwards with either face up.
    Stays,
}

impl Layer {
    /// Both, in the order of [`FIELD`].
    pub const ALL: [Self; 2] = [Self::Turns, Self::Stays];

    /// The word in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Turns => "turns",
            Self::Stays => "stays",
        }
    }
}

/// A field of natural curvature.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// The layers of [`Layer::ALL`]: curvatures \[1/m\], positive towards the face of a specimen that lies with it up.
    pub layers: [Curl; 2],
    /// Standard errors of these, over the specimens (the jackknife) \[1/m\].
    pub errors: [Curl; 2],
    /// How far neighbouring nodes may differ: standard deviation \[1/m\].
    pub step_per_m: f64,
    /// Fall of the logarithm of the held-out cost with it, mean over the specimens and standard error.
    pub gain: [f64; 2],
}

/// Where a field is strongest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strongest {
    /// In which layer.
    pub layer: Layer,
    /// Which curvature, of [`FIELD_COMPONENTS`].
    pub component: usize,
    /// Place on the specimen as fractions of its sides along warp and weft, 0 to 1.
    pub place: [f64; 2],
    /// The curvature there \[1/m\].
    pub per_m: f64,
    /// Its standard error \[1/m\].
    pub error_per_m: f64,
}

/// Standard deviations between neighbouring nodes that are tried \[1/m\].
const STEPS_PER_M: [f64; 6] = [0.5, 1.5, 5.0, 15.0, 50.0, 150.0];
/// Standard deviation of a curvature whatever its neighbours are \[1/m\].
const SIGMA_PER_M: f64 = 60.0;
/// Parts of a specimen's side between the places at which a field is looked at.
const LOOKS: usize = 40;

/// The field that foretells most of what some effects leave, whose held-out costs are `best`.
pub(super) fn field(linear: &Linear, with: &[&'static Effect], best: &[f64]) -> Option<Field> {
    let all = [with, &[&FIELD]].concat();
    let own = positions(&all, &FIELD);
    let base = linear.precision(&all);
    let tried = STEPS_PER_M.iter().filter_map(|&step_per_m| {
        let mut precision = base.clone();
        let smooth = smoothness(step_per_m);
        for (a, &row) in own.iter().enumerate() {
            for (b, &column) in own.iter().enumerate() {
                precision[(row, column)] = smooth[(a, b)];
            }
        }
        let foretold = linear.held_out_with(&all, &precision)?;
        let gain = mean_and_error(&falls(best, &foretold.costs));
        Some((step_per_m, precision, foretold, gain))
    });
    let (step_per_m, precision, foretold, gain) = tried.max_by(|a, b| a.3[0].total_cmp(&b.3[0]))?;
    let change = linear.fitted(&all, &precision, None)?;
    let values: Vec<f64> = own.iter().map(|&at| change[at]).collect();
    let errors = foretold.errors(&own);
    Some(Field { layers: layers(&values), errors: layers(&errors), step_per_m, gain })
}

/// The precision of a field's numbers: each from nothing, and neighbours from each other.
fn smoothness(step_per_m: f64) -> DMatrix<f64> {
    let mut precision =
        DMatrix::from_diagonal_element(FIELD_NUMBERS, FIELD_NUMBERS, SIGMA_PER_M.powi(-2));
    let stiff = step_per_m.powi(-2);
    let mut spring = |a: usize, b: usize| {
        for (row, column, sign) in [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)] {
            precision[(row, column)] += sign * stiff;
        }
    };
    for k in 0..FIELD_NUMBERS {
        if k % CURL_NODES + 1 < CURL_NODES {
            spring(k, k + 1);
        }
        if k / CURL_NODES % CURL_NODES + 1 < CURL_NODES {
            spring(k, k + CURL_NODES);
        }
    }
    precision
}

/// Numbers in the order of [`FIELD`] as two layers.
fn layers(values: &[f64]) -> [Curl; 2] {
    let mut layers = [Curl::default(); 2];
    let of_component = CURL_NODES * CURL_NODES;
    for (k, value) in values.iter().enumerate() {
        let (layer, component) =
            (k / of_component / FIELD_COMPONENTS.len(), k / of_component % FIELD_COMPONENTS.len());
        let component = FIELD_COMPONENTS[component] as usize;
        layers[layer].nodes[k / CURL_NODES % CURL_NODES][k % CURL_NODES][component] = *value;
    }
    layers
}

impl Field {
    /// Whether the drapes held out are foretold better with it, by as much as is asked of an effect and by twice the
    /// standard error. The smoothness is the best of those tried, so that the gain is a little too good.
    #[must_use]
    pub fn is_something(&self) -> bool {
        let [gain, error] = self.gain;
        gain > LEAST_GAIN && gain > 2.0 * error
    }

    /// Whether it is the smoothest that is tried: the same all over the cloth.
    #[must_use]
    pub fn is_even(&self) -> bool {
        self.step_per_m <= STEPS_PER_M[0]
    }

    /// A curvature of a layer at a place on the specimen, given as fractions of its sides along warp and weft \[1/m\].
    #[must_use]
    pub fn at(&self, layer: Layer, component: usize, [warp, weft]: [f64; 2]) -> f64 {
        self.layers[layer as usize].at(warp, weft)[FIELD_COMPONENTS[component] as usize]
    }

    /// Its standard error there \[1/m\].
    #[must_use]
    pub fn error_at(&self, layer: Layer, component: usize, [warp, weft]: [f64; 2]) -> f64 {
        self.errors[layer as usize].at(warp, weft)[FIELD_COMPONENTS[component] as usize]
    }

    /// What is left of it there less two standard errors, with its sign \[1/m\].
    #[must_use]
    pub fn sure_at(&self, layer: Layer, component: usize, place: [f64; 2]) -> f64 {
        let (value, error) =
            (self.at(layer, component, place), self.error_at(layer, component, place));
        value.signum() * (value.abs() - 2.0 * error).max(0.0)
    }

    /// Where it is strongest on a specimen, less two standard errors.
    #[must_use]
    pub fn strongest(&self, specimen: &Specimen) -> Option<Strongest> {
        let places = (0..=LOOKS).flat_map(|i| (0..=LOOKS).map(move |j| [i, j]));
        let places = places.map(|place| place.map(|k| k as f64 / LOOKS as f64));
        let places = places.filter(|place| is_on(specimen, *place));
        let all = places.flat_map(|place| {
            Layer::ALL.into_iter().flat_map(move |layer| {
                (0..FIELD_COMPONENTS.len()).map(move |component| (layer, component, place))
            })
        });
        let strongest = all.map(|(layer, component, place)| Strongest {
            layer,
            component,
            place,
            per_m: self.at(layer, component, place),
            error_per_m: self.error_at(layer, component, place),
        });
        let sure = |s: &Strongest| self.sure_at(s.layer, s.component, s.place).abs();
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

    #[test]
    fn an_even_field_costs_nothing_but_its_size() {
        let even = nalgebra::DVector::from_element(FIELD_NUMBERS, 3.0);
        let cost = even.dot(&(smoothness(0.5) * &even));
        assert!((cost - FIELD_NUMBERS as f64 * 9.0 / SIGMA_PER_M.powi(2)).abs() < 1e-9);
        // one node that stands out pulls at its four neighbours
        let mut node = nalgebra::DVector::zeros(FIELD_NUMBERS);
        node[12] = 2.0;
        let cost = node.dot(&(smoothness(0.5) * &node));
        assert!((cost - (4.0 * 4.0 / 0.25 + 4.0 / SIGMA_PER_M.powi(2))).abs() < 1e-9);
    }

    #[test]
    fn a_field_is_strongest_where_its_node_is_unless_there_is_no_cloth() {
        let mut values = vec![0.0; FIELD_NUMBERS];
        // the layer that stays, warp, node 3 along the warp and 1 along the weft; and a larger one in a corner
        values[75 + 3 * CURL_NODES + 1] = -7.0;
        values[75] = 9.0;
        // and a still larger one that is not sure
        values[6] = 30.0;
        let mut errors = vec![1.0; FIELD_NUMBERS];
        errors[6] = 15.0;
        let field = Field {
            layers: layers(&values),
            errors: layers(&errors),
            step_per_m: 5.0,
            gain: [0.5, 0.2],
        };
        let disc = Specimen { outline: Outline::Disc, ..Specimen::default() };
        let found = field.strongest(&disc).unwrap();
        assert_eq!((found.layer, found.component), (Layer::Stays, 1));
        assert_eq!((found.place, found.per_m, found.error_per_m), ([0.75, 0.25], -7.0, 1.0));
        assert_eq!(field.strongest(&Specimen::default()).unwrap().place, [0.0, 0.0]);
        assert!(field.is_something() && !field.is_even());
        assert!(!Field { gain: [0.5, 0.3], ..field }.is_something());
        assert!(!Field { gain: [0.01, 0.001], ..field }.is_something());
    }
}
