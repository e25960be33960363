//! The part of a long list of work that one machine does.

/// Part `index` of `of`: what stands at a place of the list that leaves that remainder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 0.
    pub index: u64,
    /// At least 1.
    pub of: u64,
}

impl Default for Shard {
    fn default() -> Self {
        Self { index: 0, of: 1 }
    }
}

impl Shard {
    /// Whether a place of the list, counted from 0, is in this part.
    #[must_use]
    pub fn holds(self, place: u64) -> bool {
        place % self.of.max(1) == self.index
    }
}

/// `index-of-of`, as names of files have it.
impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}-of-{}", self.index, self.of)
    }
}

/// A text that names no part of a run.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a shard: give i/N with i from 0 to N-1")]
pub struct ShardError(String);

impl std::str::FromStr for Shard {
    type Err = ShardError;

    /// Reads `i/N` with 0 <= i < N.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let parse = |part: &str| part.trim().parse::<u64>().ok();
        text.split_once('/')
            .and_then(|(index, of)| Some(Self { index: parse(index)?, of: parse(of)? }))
            .filter(|shard| shard.index < shard.of)
            .ok_or_else(|| ShardError(text.to_owned()))
    }
}
