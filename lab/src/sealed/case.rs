//! What a sealed case is drawn from: a seed and its number.
//!
//! In: a seed, a number. Out: a [`Case`], the same for anything drawn before. Kinds come in a fixed
//! order of ten, four with one effect, three with none, two with one that is on no list and one
//! with two, and so do the effects from one such case to the next, each from a place drawn by the
//! seed; so that few cases have all of them. All else is drawn.

use rand::RngExt as _;
use serde::{Deserialize, Serialize};

use super::effect::{Cloth, Effect, LISTED, UNLISTED};
use scan2params::base::frame::GRAVITY_M_S2;
use scan2params::base::seed::{Rng, rng};
use scan2params::calibrate::manifest::{Bench, Face};
use scan2params::fabric::{Fabric, Mixture, MixtureError};
use scan2params::sim::Experiment;

/// How many effects a case has, and of what sort.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// None.
    None,
    /// One that a calibration may name.
    One,
    /// Two of these.
    Two,
    /// One that is on no list.
    Unlisted,
}

impl Kind {
    /// The word in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::One => "one",
            Self::Two => "two",
            Self::Unlisted => "unlisted",
        }
    }
}

/// The order of the kinds, again and again.
const KINDS: [Kind; 10] = [
    Kind::One,
    Kind::None,
    Kind::Unlisted,
    Kind::One,
    Kind::None,
    Kind::One,
    Kind::Two,
    Kind::One,
    Kind::None,
    Kind::Unlisted,
];

/// Bending lengths, the shortest and the longest of the three, with which a standard Cusick drape
/// makes folds that cells of 5 mm resolve \[m\].
const BENDING_LENGTHS_M: [f64; 2] = [12e-3, 30e-3];
/// Specimens that are scanned.
const SCANNED: usize = 3;
/// Fabrics of a prior that are tried for such bending lengths.
const FABRICS: u64 = 20_000;

/// Which drapes a case has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plan {
    /// So many specimens, each draped with its face up and with its face down; the last ones are
    /// held out.
    Specimens(usize),
    /// One specimen, dropped so often with its face up; nothing is held out.
    Drops(usize),
}

/// One fabric in one experiment.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Seed of the run.
    pub seed: u64,
    /// Its place in the run.
    pub index: u64,
    /// How many effects it has.
    pub kind: Kind,
    /// Name of the prior that the fabric is from.
    pub prior: String,
    /// The fabric.
    pub fabric: Fabric,
    /// Its effects.
    pub effects: Vec<Effect>,
    /// The drapes of the case.
    pub plan: Plan,
    /// Specimen and plate: discs are seen as silhouettes, squares are scanned.
    pub bench: Bench,
}

/// Why a case cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// The prior gives no fabric.
    #[error(transparent)]
    Prior(#[from] MixtureError),
    /// The prior has no fabric that folds so.
    #[error(
        "prior `{prior}`: none of {FABRICS} fabrics has bending lengths of {:.0} to {:.0} mm",
        1e3 * BENDING_LENGTHS_M[0], 1e3 * BENDING_LENGTHS_M[1]
    )]
    NoFabric {
        /// The prior.
        prior: String,
    },
}

impl Case {
    /// Case `index` of a run on a bench: several specimens, or one that is dropped so often.
    ///
    /// # Errors
    /// [`CaseError`], which the shipped priors do not give.
    pub fn drawn(
        seed: u64,
        index: u64,
        bench: Bench,
        drops: Option<usize>,
    ) -> Result<Self, CaseError> {
        let mut draw = rng(seed, "sealed case", index);
        let prior = if draw.random_bool(0.5) { Mixture::measured() } else { Mixture::knit_2020() };
        let fabric = foldable(&prior, &mut draw)?;
        let kind = KINDS[(index % KINDS.len() as u64) as usize];
        let cloth = Cloth { density_kg_m2: fabric.density_kg_m2 };
        let effects = effects(kind, bench, turn_of(seed, index), &cloth, &mut draw);
        let plan = match (drops, bench) {
            (Some(drops), _) => Plan::Drops(drops),
            (None, Bench::Cusick) => Plan::Specimens(draw.random_range(5..=6)),
            (None, Bench::Square) => Plan::Specimens(SCANNED),
        };
        let prior = prior.name().to_owned();
        Ok(Self { seed, index, kind, prior, fabric, effects, plan, bench })
    }

    /// Even cloth on the bench, level and in still air.
    #[must_use]
    pub fn plain(&self) -> Experiment {
        match self.bench {
            Bench::Cusick => Experiment::standard_cusick(),
            Bench::Square => Experiment::default(),
        }
    }

    /// The experiment of a specimen with this face up.
    #[must_use]
    pub fn experiment(&self, face: Face) -> Experiment {
        let mut experiment = self.plain();
        self.effects.iter().for_each(|effect| effect.apply(&mut experiment));
        match face {
            Face::Up => experiment,
            Face::Down => experiment.face_down(),
        }
    }

    /// Share by which drapes look larger than they are.
    #[must_use]
    pub fn scale_by(&self) -> f64 {
        self.effects.iter().map(Effect::scale_by).sum()
    }

    /// One over the camera's height above the plate's face \[1/m\]; 0 for one that looks from afar.
    #[must_use]
    pub fn per_height(&self) -> f64 {
        self.effects.iter().map(Effect::per_height).sum()
    }
}

/// A fabric of the prior that folds on the standard plate.
fn foldable(prior: &Mixture, draw: &mut Rng) -> Result<Fabric, CaseError> {
    let seed: u64 = draw.random();
    let [shortest, longest] = BENDING_LENGTHS_M;
    for index in 0..FABRICS {
        let fabric = prior.sample(seed, index)?;
        let si = fabric.in_si();
        let length_m = |k: usize| (si[k] / (fabric.density_kg_m2 * GRAVITY_M_S2)).cbrt();
        if (3..6).all(|k| (shortest..=longest).contains(&length_m(k))) {
            return Ok(fabric);
        }
    }
    Err(CaseError::NoFabric { prior: prior.name().to_owned() })
}

/// How many cases of this kind came before in the run, from a place drawn by the seed.
fn turn_of(seed: u64, index: u64) -> usize {
    let kind = KINDS[(index % KINDS.len() as u64) as usize];
    let of_kind = |kinds: &[Kind]| kinds.iter().filter(|other| **other == kind).count();
    let (rounds, last) = (index / KINDS.len() as u64, (index % KINDS.len() as u64) as usize);
    let first = rng(seed, "sealed effects", 0).random_range(0..LISTED.len() * UNLISTED.len());
    first + rounds as usize * of_kind(&KINDS) + of_kind(&KINDS[..last])
}

/// Whether a bench has a listed effect: a scan has no camera's height, a disc no skew.
fn is_of(name: &str, bench: Bench) -> bool {
    name != if bench == Bench::Cusick { "skew" } else { "perspective" }
}

fn effects(kind: Kind, bench: Bench, turn: usize, cloth: &Cloth, draw: &mut Rng) -> Vec<Effect> {
    let own: Vec<usize> = (0..LISTED.len()).filter(|&k| is_of(LISTED[k], bench)).collect();
    let listed = |turn: usize, draw: &mut Rng| match Effect::listed(own[turn % own.len()], draw) {
        // what is farther off, the scan path itself takes for another specimen
        Effect::Scale { by } if bench == Bench::Square => Effect::Scale { by: 0.5 * by },
        effect => effect,
    };
    match kind {
        Kind::None => Vec::new(),
        Kind::One => vec![listed(turn, draw)],
        Kind::Two => {
            let other = turn + draw.random_range(1..own.len());
            vec![listed(turn, draw), listed(other, draw)]
        }
        Kind::Unlisted => vec![Effect::unlisted(turn, cloth, draw)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn a_case_is_drawn_by_its_seed_and_number_alone() {
        assert_eq!(
            Case::drawn(5, 3, Bench::Cusick, None).unwrap(),
            Case::drawn(5, 3, Bench::Cusick, None).unwrap()
        );
        assert_ne!(
            Case::drawn(5, 3, Bench::Cusick, None).unwrap().fabric,
            Case::drawn(6, 3, Bench::Cusick, None).unwrap().fabric
        );
    }

    #[test]
    fn sixty_cases_have_every_effect_and_every_kind_and_sound_experiments() {
        for bench in [Bench::Cusick, Bench::Square] {
            sixty_cases(bench);
        }
    }

    fn sixty_cases(bench: Bench) {
        let drawn = |index| Case::drawn(2, index, bench, None).unwrap();
        let cases: Vec<Case> = (0..60).map(drawn).collect();
        let count = |kind: Kind| cases.iter().filter(|case| case.kind == kind).count();
        let kinds = [Kind::One, Kind::None, Kind::Unlisted, Kind::Two].map(count);
        assert_eq!(kinds, [24, 18, 12, 6]);
        let named = |kind: Kind| -> BTreeSet<&str> {
            let of_kind = cases.iter().filter(|case| case.kind == kind);
            of_kind.flat_map(|case| case.effects.iter().map(Effect::name)).collect()
        };
        let listed = LISTED.into_iter().filter(|name| is_of(name, bench));
        assert_eq!(named(Kind::One), listed.collect());
        assert_eq!(named(Kind::Unlisted), BTreeSet::from(UNLISTED));
        let priors: BTreeSet<&str> = cases.iter().map(|case| case.prior.as_str()).collect();
        assert_eq!(priors.len(), 2);
        for case in &cases {
            let specimens = if bench == Bench::Cusick { 5..=6 } else { 3..=3 };
            assert!(matches!(case.plan, Plan::Specimens(n) if specimens.contains(&n)));
            let counts = match case.kind {
                Kind::None => 0,
                Kind::One | Kind::Unlisted => 1,
                Kind::Two => 2,
            };
            let names: BTreeSet<&str> = case.effects.iter().map(Effect::name).collect();
            assert_eq!((case.effects.len(), names.len()), (counts, counts), "{case:?}");
            for face in [Face::Up, Face::Down] {
                assert_eq!(case.experiment(face).check(), Ok(()), "{case:?}");
            }
        }
    }

    #[test]
    fn an_odd_effect_changes_its_sign_with_the_face_and_the_room_stays() {
        let case = |effects: &[Effect]| Case {
            effects: effects.to_vec(),
            ..Case::drawn(1, 1, Bench::Cusick, None).unwrap()
        };
        let both = |effects: &[Effect]| {
            let case = case(effects);
            [Face::Up, Face::Down].map(|face| case.experiment(face))
        };
        let [up, down] = both(&[Effect::NaturalCurvature { weft_per_m: 7.0, warp_per_m: -5.0 }]);
        assert_eq!(
            (up.curl.nodes[2][3], down.curl.nodes[2][3]),
            ([7.0, -5.0, 0.0], [-7.0, 5.0, 0.0])
        );
        let [up, down] = both(&[Effect::AsymmetricBending { weft: 0.4, warp: 0.2 }]);
        assert_eq!(down.asymmetric_bending, up.asymmetric_bending.face_down());
        assert_eq!(down.asymmetric_bending.weft, -0.4);
        let [up, down] = both(&[Effect::EdgeCurl { curvature_per_m: 30.0, width_m: 0.01 }]);
        assert_eq!(up.curl.edge.curvature_per_m, -down.curl.edge.curvature_per_m);
        for even in [
            Effect::Softening { length_m: 4e-3 },
            Effect::Friction { coefficient: 0.6 },
            Effect::PlateRadius { by_m: 2e-3 },
            Effect::SpecimenSize { by_m: -3e-3 },
            Effect::Tilt { down_x_rad: 0.02, down_z_rad: -0.01 },
        ] {
            let [up, down] = both(&[even]);
            assert_eq!(up, down);
        }
    }
}
