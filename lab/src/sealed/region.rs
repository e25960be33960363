//! Where on a specimen an effect acts that is on no list: what a tracer's strongest place is held
//! against.
//!
//! In: an [`Effect`], the bench, a place on the specimen as fractions of its sides along warp and
//! weft, as [`scan2params::calibrate::field::Strongest`] has it. Out: whether the effect acts
//! there, as far as a field of 5 x 5 nodes can say: a border or a line counts up to half of the
//! distance of two nodes beyond it. And which share of the specimen such a region is, which a place
//! drawn at random would score.

use super::effect::Effect;
use scan2params::calibrate::field::is_on;
use scan2params::sim::Experiment;
use scan2params::sim::experiment::CURL_NODES;

/// Parts of a side between the places by which a region's share is counted.
const LOOKS: usize = 60;

impl Effect {
    /// Whether it acts at a place of the specimen; `None` of an effect that acts nowhere in
    /// particular.
    #[must_use]
    pub fn acts_at(&self, bench: &Experiment, [warp, weft]: [f64; 2]) -> Option<bool> {
        let specimen = &bench.specimen;
        let (x, z) = ((warp - 0.5) * specimen.warp_m, (weft - 0.5) * specimen.weft_m);
        let along_m = |toward_rad: f64| x * toward_rad.cos() + z * toward_rad.sin();
        let resolved_m = 0.5 * specimen.weft_m / (CURL_NODES - 1) as f64;
        match self {
            Self::Hem(hem) => {
                let from_last_m = specimen.reach_m(hem.toward_rad) - along_m(hem.toward_rad);
                Some(from_last_m <= hem.width_m + resolved_m)
            }
            Self::Seam(seam) => {
                let off_m = along_m(seam.toward_rad) - seam.offset_m;
                Some(off_m.abs() <= seam.width_m + resolved_m)
            }
            // the stiff side or the soft one, and not the middle
            Self::StiffnessGradient(gradient) => {
                let last_m = specimen.reach_m(gradient.toward_rad);
                Some(along_m(gradient.toward_rad).abs() >= 0.5 * last_m)
            }
            // the air stays where it is when the cloth is turned over: the half that it meets first
            // with either face up
            Self::Draught(draught) => {
                let hangs = x.hypot(z) > bench.plate.radius_m;
                let windward = along_m(draught.toward_rad).min(along_m(-draught.toward_rad)) < 0.0;
                Some(hangs && windward)
            }
            _ => None,
        }
    }

    /// The share of the specimen at which it acts.
    #[must_use]
    pub fn share(&self, bench: &Experiment) -> Option<f64> {
        let places = (0..=LOOKS).flat_map(|i| (0..=LOOKS).map(move |j| [i, j]));
        let places = places.map(|place| place.map(|k| k as f64 / LOOKS as f64));
        let on = places.filter(|place| is_on(&bench.specimen, *place));
        let acts: Option<Vec<bool>> = on.map(|place| self.acts_at(bench, place)).collect();
        let acts = acts?;
        Some(acts.iter().filter(|acts| **acts).count() as f64 / acts.len() as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scan2params::sim::experiment::{Draught, Hem, Seam, StiffnessGradient};

    #[test]
    fn an_effect_acts_on_its_side_or_line_and_what_is_everywhere_has_no_region() {
        let bench = Experiment::default();
        let quarter = std::f64::consts::FRAC_PI_2;
        let hem = Hem { added_kg_m2: 0.2, width_m: 20e-3, toward_rad: quarter };
        let at = |effect: Effect, place| effect.acts_at(&bench, place);
        // towards the weft's end, 57.5 mm of 300
        let hem = Effect::Hem(hem);
        assert_eq!(
            [[0.5, 1.0], [0.1, 0.85], [0.5, 0.75], [1.0, 0.5]].map(|p| at(hem, p)),
            [true, true, false, false].map(Some)
        );
        assert!((hem.share(&bench).unwrap() - 57.5 / 300.0).abs() < 0.02);
        let seam = Seam { added: 5.0, width_m: 6e-3, toward_rad: 0.0, offset_m: 60e-3 };
        let seam = Effect::Seam(seam);
        assert_eq!(
            [[0.7, 0.0], [0.8, 1.0], [0.5, 0.5], [0.9, 0.5]].map(|p| at(seam, p)),
            [true, true, false, false].map(Some)
        );
        let gradient = StiffnessGradient { ln_factor: 0.5, toward_rad: quarter };
        let gradient = Effect::StiffnessGradient(gradient);
        assert_eq!(
            [[0.5, 0.0], [0.5, 1.0], [1.0, 0.5]].map(|p| at(gradient, p)),
            [true, true, false].map(Some)
        );
        // air that blows along the warp meets the other end first, and presses on no cloth on the
        // plate
        let draught = Effect::Draught(Draught { pressure_pa: 0.2, toward_rad: 0.0 });
        assert_eq!(
            [[0.0, 0.5], [0.4, 0.5], [1.0, 0.5]].map(|p| at(draught, p)),
            [true, false, false].map(Some)
        );
        // across the warp it meets one end with the face up and the other with it down
        let draught = Effect::Draught(Draught { pressure_pa: 0.2, toward_rad: quarter });
        assert_eq!([[0.5, 0.0], [0.5, 1.0]].map(|p| at(draught, p)), [true, true].map(Some));
        let friction = Effect::Friction { coefficient: 0.5 };
        assert_eq!((at(friction, [0.0, 0.0]), friction.share(&bench)), (None, None));
    }
}
