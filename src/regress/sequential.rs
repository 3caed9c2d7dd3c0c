//! When a case is looked at, and what each look may spend of the probability of a false alarm.

/// Most looks at one case.
const MOST_LOOKS: usize = 4;

/// The looks at a case whose renderings are added until the answer is clear: after 8, 16, 32 and 64 of them, for example.
///
/// The probability of a false alarm is spent in equal parts, whatever the earlier looks showed (Lan and DeMets, *Discrete Sequential
/// Boundaries for Clinical Trials*, Biometrika 70, 1983, with a linear spending function of the looks). By Bonferroni's inequality the
/// looks together do not exceed it, however they depend on each other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Looks {
    /// Number of renderings at each look, ascending.
    pub renderings: Vec<u32>,
}

impl Looks {
    /// From `first` renderings by doubling up to `most`, which is always the last look; at most four looks, so that the last step may be
    /// larger than a doubling. One look if `most` does not exceed `first`.
    pub fn of(first: u32, most: u32) -> Self {
        let first = first.max(1);
        let mut renderings = vec![first];
        let mut next = first.saturating_mul(2);
        while next < most && renderings.len() < MOST_LOOKS - 1 {
            renderings.push(next);
            next = next.saturating_mul(2);
        }
        if most > first {
            renderings.push(most);
        }
        Self { renderings }
    }

    /// The probability of a false alarm of a single look, from that of the case.
    pub fn level(&self, false_alarm: f64) -> f64 {
        false_alarm / self.renderings.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looks_double_up_to_the_budget() {
        assert_eq!(Looks::of(8, 64).renderings, [8, 16, 32, 64]);
        assert_eq!(Looks::of(8, 1000).renderings, [8, 16, 32, 1000]);
        assert_eq!(Looks::of(8, 12).renderings, [8, 12]);
        assert_eq!(Looks::of(8, 8).renderings, [8]);
        assert_eq!(Looks::of(0, 0).renderings, [1]);
        assert_eq!(Looks::of(u32::MAX, u32::MAX).renderings, [u32::MAX]);
    }

    #[test]
    fn the_looks_together_spend_what_the_case_may() {
        for looks in [Looks::of(8, 64), Looks::of(8, 16), Looks::of(8, 8)] {
            let spent = looks.level(0.01) * looks.renderings.len() as f64;
            assert!((spent - 0.01).abs() < 1e-12, "{looks:?} spend {spent}");
        }
    }
}
