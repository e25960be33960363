//! Seeds: sample k of a run is the same bytes for any order, thread
//! count or the shard.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// The generator used everywhere: portable and counter-based, so that streams
/// are independent.
pub type Rng = ChaCha8Rng;

/// The generator of item `index` in the stream `purpose` of a run.
///
/// `purpose` keeps the streams apart (fabric, drop, noise, ...), so that adding
/// a draw to one leaves the others as they were.
#[must_use]
pub fn rng(run_seed: u64, purpose: &str, index: u64) -> Rng {
    let mut seed = [0_u8; 32];
    seed[..8].copy_from_slice(&run_seed.to_le_bytes());
    seed[8..16].copy_from_slice(&fnv1a(purpose.as_bytes()).to_le_bytes());
    seed[16..24].copy_from_slice(&index.to_le_bytes());
    ChaCha8Rng::from_seed(seed)
}

/// FNV-1a, 64 bits: a fixed hash (the standard library's may change).
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt as _;

    #[test]
    fn same_arguments_give_the_same_stream_and_others_do_not() {
        let draw = |seed, purpose, index| rng(seed, purpose, index).random::<u64>();
        assert_eq!(draw(1, "fabric", 7), draw(1, "fabric", 7));
        assert_ne!(draw(1, "fabric", 7), draw(2, "fabric", 7));
        assert_ne!(draw(1, "fabric", 7), draw(1, "drop", 7));
        assert_ne!(draw(1, "fabric", 7), draw(1, "fabric", 8));
    }
}
