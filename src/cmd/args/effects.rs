//! `--effects +x,-y`.

use crate::render::forced::Forced;
use crate::tracer::effects::Effect;

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
}
