//! Judgements in words.

use super::judgement::Judgement;
use super::plan::CaseBudget;
use crate::study::format::{percent, round_percent};

/// One sentence on a judgement after so many renderings.
pub fn of_judgement(judgement: &Judgement, budget: &CaseBudget, renderings: u32) -> String {
    let told = if judgement.changed { change(judgement) } else { no_change(judgement, renderings) };
    match budget.detect {
        Some(wanted) if !judgement.changed && judgement.detectable > wanted => {
            format!(
                "{told}, not the {} that were asked for: raise `most_seeds` or `spp`",
                round_percent(wanted)
            )
        }
        _ => told,
    }
}

/// What changed, by the test that says so most clearly.
fn change(judgement: &Judgement) -> String {
    let clearest = judgement.tests.iter().min_by(|a, b| a.p_value.total_cmp(&b.p_value));
    let by = match clearest {
        Some(test) => {
            let place = test.place.map(|[x, y]| format!(" at pixel {x}, {y}")).unwrap_or_default();
            format!(" by {}{place}", test.name)
        }
        None => String::new(),
    };
    let [red, green, blue] = judgement.brightness.map(signed);
    format!(
        "a difference that noise does not explain{by} (p = {}); brightness R {red}, G {green}, B {blue}",
        probability(judgement.p_value)
    )
}

fn no_change(judgement: &Judgement, renderings: u32) -> String {
    let open = match judgement.undecided {
        true => format!(" after {renderings} renderings, but p = {} is low", probability(judgement.p_value)),
        false => String::new(),
    };
    let found = match judgement.detectable.is_finite() {
        true => format!("a change of brightness of {} would have been found", percent(judgement.detectable)),
        false => "no change of brightness would have been found with so few renderings: raise `seeds`".into(),
    };
    format!("no difference that noise does not explain{open}; {found}")
}

/// A ratio and its standard error as a change: `+0.50 % ± 0.02 %`.
fn signed([ratio, error]: [f64; 2]) -> String {
    let change = percent(ratio - 1.0);
    let sign = if ratio > 1.0 { "+" } else { "" };
    format!("{sign}{change} ± {}", percent(error))
}

/// A probability with two digits.
fn probability(p: f64) -> String {
    if p >= 0.001 { format!("{p:.2}") } else { format!("{p:.0e}") }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::regress::judgement::JudgedTest;

    #[test]
    fn judgements_are_sentences() {
        let test =
            |name: &str, p_value, place| JudgedTest { name: name.into(), statistic: 1.0, p_value, place };
        let mut judgement = Judgement {
            changed: true,
            undecided: false,
            p_value: 2e-9,
            tests: vec![test("brightness", 0.2, None), test("the largest area", 1e-9, Some([3, 4]))],
            brightness: [[1.005, 0.0002], [0.99, 0.001], [f64::NAN, f64::NAN]],
            detectable: 0.004,
            detectable_area: 0.1,
        };
        let timeout = Duration::from_secs(1);
        let mut budget =
            CaseBudget { spp: 1, seeds: 2, most_seeds: 2, reference_seeds: 2, detect: Some(0.002), timeout };
        let text = of_judgement(&judgement, &budget, 8);
        assert!(text.contains("by the largest area at pixel 3, 4 (p = 2e-9)"), "{text}");
        assert!(text.contains("R +0.50 % ± 0.020 %, G −1.00 % ± 0.10 %, B — ± —"), "{text}");
        judgement.changed = false;
        let text = of_judgement(&judgement, &budget, 8);
        assert!(text.contains("0.40 % would have been found, not the 0.2 % that were asked for"), "{text}");
        budget.detect = None;
        (judgement.undecided, judgement.p_value, judgement.detectable) = (true, 0.02, f64::INFINITY);
        let text = of_judgement(&judgement, &budget, 8);
        assert!(
            text.contains("after 8 renderings, but p = 0.02 is low") && text.contains("raise `seeds`"),
            "{text}"
        );
    }
}
