//! Which randomisation of the sequence an index belongs to, when a render is divided into replicates.
//!
//! Chunks of indices alternate between the replicates, so that each has half of the samples at any time. The server
//! traces them so, and whoever compares them on the client's side knows a sample's replicate from its block's first
//! index: no block spans two chunks.

/// Indices a worker claims at once: a power of 4, so that every chunk alone covers the whole screen evenly.
pub const CHUNK: u64 = 1024;

/// Replicates of a divided render. Two, because of what knowing the error costs: R independent randomisations have
/// R^(s − 1/2) times the error of an undivided run whose error falls as N^(−s), and s is .6 to .8 (`tools/bench replicates`).
pub const REPLICATES: usize = 2;

/// Replicate of an index of a divided render, and the index in that replicate's own sequence.
#[inline]
pub fn replicate(index: u64) -> (usize, u64) {
    let (chunk, place) = (index / CHUNK, index % CHUNK);
    ((chunk % REPLICATES as u64) as usize, chunk / REPLICATES as u64 * CHUNK + place)
}

/// Seed of a replicate of a render with this seed: that of the first is the render's own. Others differ by more than
/// 2^30 from any small seed, so that renders with other small seeds stay independent.
pub fn replicate_seed(seed: u32, replicate: usize) -> u32 {
    seed ^ (replicate as u32) << 31
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_alternate_and_every_replicate_sees_its_sequence_from_the_start() {
        assert_eq!(
            [0, 1023, 1024, 2047, 2048].map(replicate),
            [(0, 0), (0, 1023), (1, 0), (1, 1023), (0, 1024)]
        );
        let mut next = [0; REPLICATES];
        for index in 0..10 * CHUNK {
            let (r, own) = replicate(index);
            assert_eq!(own, next[r]);
            next[r] += 1;
        }
        assert_eq!(replicate_seed(7, 0), 7);
        assert_ne!(replicate_seed(7, 1), 7);
        assert_eq!(replicate(u64::MAX), (1, u64::MAX / 2 / CHUNK * CHUNK + 1023));
    }
}
