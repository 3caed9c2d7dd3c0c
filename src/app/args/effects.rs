//! `--effects +x,-y`.

use crate::tracer::effects::Effect;

/// One effect that is forced on or off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Forced {
    /// The effect.
    pub effect: Effect,
    /// True: simulated although nothing calls for it. False: left out although something does.
    pub on: bool,
}

/// Reads `+name` or `-name`.
pub fn effect(text: &str) -> Result<Forced, String> {
    let text = text.trim();
    let (on, name) = match (text.strip_prefix('+'), text.strip_prefix('-')) {
        (Some(name), _) => (true, name),
        (_, Some(name)) => (false, name),
        _ => return Err("begin it with + (on) or - (off)".to_string()),
    };
    match Effect::named(name) {
        Some(effect) => Ok(Forced { effect, on }),
        None => {
            let names: Vec<&str> = Effect::ALL.iter().map(|f| f.name()).collect();
            Err(format!(
                "no such effect; there are {} (those of the display have options of their own)",
                names.join(", ")
            ))
        }
    }
}

/// The last switch of each effect.
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
    fn names_and_signs() {
        assert_eq!(effect("-dispersion"), Ok(Forced { effect: Effect::Dispersion, on: false }));
        assert_eq!(effect(" +lens").map(|f| f.to_string()), Ok("+lens".to_string()));
        for bad in ["dispersion", "+", "-nothing", "", "--lens"] {
            assert!(effect(bad).is_err(), "{bad:?} was accepted");
        }
    }

    #[test]
    fn the_last_word_counts() {
        let said =
            ["-lens", "+wavelengths", "+lens", "-lens", "-lens"].map(|text| effect(text).expect("valid"));
        assert_eq!(last_of_each(&said), [said[1], said[4]]);
        assert!(last_of_each(&[]).is_empty());
    }
}
