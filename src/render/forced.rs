//! Effects of the tracer that are forced on or off (`--effects`).

use crate::tracer::effects::Effect;

/// One effect that is forced on or off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Forced {
    /// The effect.
    pub effect: Effect,
    /// True: simulated even if the scene does not need it. False: left out even if it does.
    pub on: bool,
}

/// Keeps the last entry of each effect.
pub fn last_of_each(said: &[Forced]) -> Vec<Forced> {
    let again = |i: usize| said[i + 1..].iter().any(|later| later.effect == said[i].effect);
    (0..said.len()).filter(|i| !again(*i)).map(|i| said[i]).collect()
}

impl std::fmt::Display for Forced {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}{}", if self.on { '+' } else { '-' }, self.effect.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_word_counts() {
        let said =
            [(Effect::Lens, false), (Effect::Wavelengths, true), (Effect::Lens, true), (Effect::Lens, false)]
                .map(|(effect, on)| Forced { effect, on });
        assert_eq!(last_of_each(&said), [said[1], said[3]]);
        assert!(last_of_each(&[]).is_empty());
    }
}
