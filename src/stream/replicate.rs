//! Replicates: independent randomisations of the sequence, from whose difference the error is estimated.
//!
//! Chunks of path indices alternate between the replicates, so that each has half of the samples at any time. The tracer
//! follows this rule, and a consumer finds a block's replicate from its first index: no block spans two chunks.

/// Indices that a worker claims at once: a power of 4, so that every chunk covers the whole screen evenly.
pub const CHUNK: u64 = 1024;

/// Number of replicates. Two keep the price of the estimate low: if the error of one randomisation falls as N^(−s), then R
/// independent ones with the same number of samples have R^(s − 1/2) times its error, and s is .6 to .8.
pub const REPLICATES: usize = 2;

/// The replicate of a path index, and the index in that replicate's own sequence.
#[inline]
pub fn replicate(index: u64) -> (usize, u64) {
    let (chunk, place) = (index / CHUNK, index % CHUNK);
    ((chunk % REPLICATES as u64) as usize, chunk / REPLICATES as u64 * CHUNK + place)
}

/// The eye of a path index, 0 for the left one, and the index in that eye's own sequence, in a render for two eyes: chunks alternate between them.
/// Where the render is divided into replicates, `index` is one of a replicate's own.
#[inline]
pub fn eye(index: u64) -> (usize, u64) {
    let (chunk, place) = (index / CHUNK, index % CHUNK);
    ((chunk % 2) as usize, chunk / 2 * CHUNK + place)
}

/// The seed of a replicate in a render with seed `seed`. The first replicate has the same seed. Those of the others differ by
/// more than 2^30 from any small seed, so that renders with other small seeds stay independent.
pub fn replicate_seed(seed: u32, replicate: usize) -> u32 {
    seed ^ (replicate as u32) << 31
}

/// The seed of one of several tracers that add to the same picture of seed `seed`: each has a sequence of its own, so that no sample is
/// counted twice, whichever of them come and go. Tracer 0 has the same seed; the others differ by an odd step modulo 2^31, and so from each
/// other and from every second replicate.
pub fn tracer_seed(seed: u32, tracer: u32) -> u32 {
    seed ^ (tracer.wrapping_mul(0x9e37_79b1) & 0x7fff_ffff)
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn no_two_sequences_of_a_picture_are_the_same() {
        let seeds = (0..10_000).flat_map(|tracer| [0, 1].map(|k| replicate_seed(tracer_seed(7, tracer), k)));
        assert_eq!(seeds.collect::<HashSet<_>>().len(), 20_000);
        assert_eq!(tracer_seed(7, 0), 7);
    }

    #[test]
    fn eyes_and_replicates_take_all_turns() {
        let mut next = [[0; 2]; REPLICATES];
        for index in (0..32 * CHUNK).step_by(CHUNK as usize) {
            let (part, own) = replicate(index);
            let (eye, own) = eye(own);
            assert_eq!(own, next[part][eye]);
            next[part][eye] += CHUNK;
        }
        assert_eq!(next, [[8 * CHUNK; 2]; REPLICATES]);
    }
}
