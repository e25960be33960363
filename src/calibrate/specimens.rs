//! Which drapes are of one specimen: specimens differ, and what the drapes of one have in common
//! may be its own.

/// The specimen of each of some drapes, from 0 on; a drape of an unknown specimen is of one of its
/// own.
pub(super) fn specimens_of(specimens: &[Option<&str>]) -> Vec<usize> {
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
    fn drapes_of_one_name_are_of_one_specimen_and_those_of_none_are_each_of_their_own() {
        assert_eq!(
            specimens_of(&[Some("a"), Some("a"), Some("b"), None, Some("b")]),
            [0, 0, 1, 2, 1]
        );
        assert_eq!(specimens_of(&[None, Some("a"), None]), [0, 1, 2]);
    }
}
