//! Russian roulette: when paths end at random, for all integrators.

use super::sampler::attainable;

/// No path survives with certainty: two mirrors must not hold it for ever.
const MAX_SURVIVAL: f32 = 0.95;

/// Roulette begins here at the latest, whatever the scene says. In a closed white room nothing else ends a path, and one
/// path must not keep a worker from hearing an abort.
const LATEST: u32 = 1024;

/// Paths whose throughput exceeds the inverse of this are spared. By experiment on the Cornell box: against 1, the error
/// times time is 6 % lower in RGB and 1 to 2 % in luminance; 2 and 3, a square root, or an earlier start gain no more.
const SURVIVAL: f32 = 1.5;

/// When and how roulette ends a path.
#[derive(Clone, Copy, Debug)]
pub struct Policy {
    /// Roulette begins with this number of segments at the latest, whatever the scene says.
    pub latest: u32,
    /// Probability of survival over throughput.
    pub survival: f32,
}

/// Subpaths from a light. Each vertex adds much the same to the picture whatever its throughput, so they end early: error
/// times time of particle tracing in a room with lights in a cove is 8 % lower than from the 8th segment on with 1.5.
pub const FROM_LIGHT: Policy = Policy { latest: 3, survival: 2.0 };

/// Subpaths from a light whose vertices many camera subpaths choose from. Error times time of bidirectional path tracing is 4 % (Cornell box) to
/// 8 % (a room with lights in a cove) lower than by [`FROM_LIGHT`].
pub const CONNECTED_FROM_LIGHT: Policy = Policy { latest: 2, survival: 1.0 };

/// Camera subpaths, each connected to the light subpaths of a group. relMSE times time of bidirectional path tracing over
/// that with 1.5, 128², luminance: behind a door .86, `rough.xml` .91, `staircase2` .95, cove .98, Cornell box .98, `veach-bidir` 1.04, with
/// mirror and glass 1.05.
pub const FROM_CAMERA: Policy = Policy { latest: 3, survival: 3.0 };

/// Branches of a camera path: one of them is cheap to lose. By experiment on the Cornell box, with one branch or two, error times
/// time is 9 to 15 % above that of 2 with 1.5, 25 to 37 % with 1, and 2 to 5 % with 3; from the first segment on it is 9 % above.
pub const OF_BRANCHES: Policy = Policy { latest: 2, survival: 2.0 };

/// Camera paths that have not split.
pub const OF_PATHS: Policy = Policy { latest: LATEST, survival: SURVIVAL };

/// The factor on the throughput of a path that survives with this probability, or a little less than 1; `None` when it
/// ends. Until roulette is `armed`, every path survives whose probability is positive.
#[inline]
pub fn survival_factor(probability: f32, armed: bool, u: f32) -> Option<f32> {
    if !armed {
        return (probability > 0.0).then_some(1.0);
    }
    // NaN does not survive; `min` would take it for the other number.
    let survival = attainable(if probability > MAX_SURVIVAL { MAX_SURVIVAL } else { probability });
    (u < survival).then(|| 1.0 / survival)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Over all random numbers the mean throughput stays, and no path survives with certainty.
    #[test]
    fn roulette_keeps_the_mean() {
        for carried in [0.001f32, 0.1, 0.6, 0.7, 1.0, 3.0] {
            let n = 10_000;
            let (mut sum, mut lived) = (0.0, 0);
            for i in 0..n {
                if let Some(factor) = survival_factor(SURVIVAL * carried, true, (i as f32 + 0.5) / n as f32) {
                    (sum, lived) = (sum + factor * 0.5 * carried, lived + 1);
                }
            }
            let mean = sum / n as f32;
            assert!(
                (mean / (0.5 * carried) - 1.0).abs() < 0.05 / (carried * 1e3).max(1.0) + 1e-3,
                "{carried}: {mean}"
            );
            assert!(lived > 0 && lived < n, "{carried}: {lived} of {n} live");
        }
        assert_eq!(survival_factor(f32::NAN, true, 0.0), None);
    }
}
