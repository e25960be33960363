//! What is held out in turn, so that what comes back is told from what is there by chance.
//!
//! In: the specimen of each drape. Out: its unit. Specimens differ, and what the drapes of one have in common may be its own;
//! so the unit is the specimen where there are enough of them, and the drape, dropped anew, where there are not. Then
//! nothing tells what is the cloth's from what is the specimen's.

/// Fewest units that anything can be held out of.
pub const FEWEST_UNITS: usize = 3;

/// What is held out in turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Independent {
    /// Specimens, each with all of its drapes.
    Specimens,
    /// Drapes, where there are too few specimens: what is of one specimen alone then counts as the cloth's.
    Drapes,
}

impl Independent {
    /// The word in files and texts.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Specimens => "specimens",
            Self::Drapes => "drapes",
        }
    }
}

/// The independent units of some drapes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Units {
    /// The unit of each drape, from 0 on.
    pub of: Vec<usize>,
    /// What they are.
    pub independent: Independent,
}

impl Units {
    /// How many there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.of.iter().max().map_or(0, |most| most + 1)
    }

    /// Of some drapes' specimens; drapes of an unknown specimen are of one each.
    #[must_use]
    pub fn of(specimens: &[Option<&str>]) -> Self {
        let mut names: Vec<Option<&str>> = Vec::new();
        let mut of = Vec::new();
        for own in specimens {
            let known = names.iter().position(|name| name.is_some() && name == own);
            of.push(known.unwrap_or(names.len()));
            if known.is_none() {
                names.push(*own);
            }
        }
        let by_drape = names.len() < FEWEST_UNITS && of.len() >= FEWEST_UNITS;
        match by_drape {
            true => Self { of: (0..of.len()).collect(), independent: Independent::Drapes },
            false => Self { of, independent: Independent::Specimens },
        }
    }
}

/// The unit of each of some drapes, from 0 on: its specimen, or itself where that is unknown.
pub(super) fn units_of(specimens: &[Option<&str>]) -> Vec<usize> {
    let mut names: Vec<Option<&str>> = Vec::new();
    let mut of = Vec::new();
    for &own in specimens {
        let known = names.iter().position(|name| name.is_some() && *name == own);
        of.push(known.unwrap_or(names.len()));
        if known.is_none() {
            names.push(own);
        }
    }
    of
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn specimens_are_held_out_where_there_are_enough_of_them_and_drapes_otherwise() {
        let of = |names: &[&'static str]| {
            let known = |name: &&'static str| (!name.is_empty()).then_some(*name);
            Units::of(&names.iter().map(known).collect::<Vec<_>>())
        };
        let units = of(&["a", "a", "b", "c", "b"]);
        assert_eq!((units.of, units.independent), (vec![0, 0, 1, 2, 1], Independent::Specimens));
        let units = of(&["a", "a", "a", "b"]);
        assert_eq!((units.count(), units.independent), (4, Independent::Drapes));
        // an unknown specimen is one of its own
        assert_eq!(of(&["", "a", ""]).of, [0, 1, 2]);
        assert_eq!(of(&["a", "a"]).count(), 1);
    }
}
