//! What the study prints.

use super::plants::Plant;
use super::power::{Share, at_most};
use super::study::{PlantStudy, PlantedRow};

/// Probability with which some row fails by chance although all keep what they promise.
const CHANCE: f64 = 0.05;

/// Share of the trials that find a change of places or colours in one case at least.
const FOUND: f64 = 0.9;

/// Prints both tables and what they come to. Returns what failed, a sentence each.
pub fn print(study: &PlantStudy<'_>) -> Vec<String> {
    let mut failures = Vec::new();
    println!("\nRuns without a change");
    println!(
        "{:<36}{:>12}{:>10}{:>10}{:>12}{:>10}{:>10}",
        "case", "changed", "p < .05", "p < .01", "renderings", "whole", "area"
    );
    for row in &study.clean {
        println!(
            "{:<36}{:>12}{:>10}{:>10}{:>12}{:>10}{:>10}",
            row.case,
            format!("{} of {}", row.changed.found, row.changed.trials),
            percent(row.small[0]),
            percent(row.small[1]),
            row.renderings,
            percent(row.detectable[0]),
            percent(row.detectable[1])
        );
    }
    println!(
        "p: of the first look, corrected for the tests in the picture. renderings, whole, area: medians of the renderings of a run, and of the \
         change of brightness of the whole picture and of an area that is stated to be found with 90 %."
    );
    if !study.clean.is_empty() {
        let red = Share {
            found: study.red.iter().filter(|red| **red).count() as u64,
            trials: study.red.len() as u64,
        };
        let allowed = study.plan.false_alarm;
        let fine = red.value() <= allowed;
        println!(
            "{} of {} runs of {} cases are red: {red}; {} is stated: {}",
            red.found,
            red.trials,
            study.clean.len(),
            percent(allowed),
            if fine { "passed" } else { "FAILED" }
        );
        if study.clean.len() < study.plan.cases.len() {
            println!(
                "The probability is divided by {} cases, of which these have a part.",
                study.plan.cases.len()
            );
        }
        failures.extend((!fine).then(|| format!("{red} of the runs without a change are red")));
    }
    if !study.planted.is_empty() {
        failures.extend(print_planted(study));
    }
    for reason in &study.left_out {
        println!("Left out: {reason}");
    }
    for plant in study.unplanted() {
        println!("No case has a place for this change: {}", name(plant));
        failures.push(format!("{} was planted nowhere", name(plant)));
    }
    failures
}

fn print_planted(study: &PlantStudy<'_>) -> Vec<String> {
    println!("\nPlanted changes");
    println!(
        "{:<10}{:<36}{:>22}{:>10}{:>10}{:>12}  {:<28}outcome",
        "change", "case", "change of brightness", "whole", "area", "promised", "found (95 %)"
    );
    let mut failures = Vec::new();
    for row in &study.planted {
        let chance = chance(row);
        let fine = chance >= CHANCE / study.planted.len() as f64;
        println!(
            "{:<10}{:<36}{:>22}{:>10}{:>10}{:>12}  {:<28}{}",
            name(row.plant),
            row.case,
            format!("{} ± {}", percent(row.change[0]), percent(row.change[1])),
            percent(row.detectable[0]),
            percent(row.detectable[1]),
            percent(row.promised),
            row.found,
            if fine { "passed".to_owned() } else { format!("FAILED (p = {chance:.0e})") }
        );
        failures.extend((!fine).then(|| {
            let (plant, promised) = (name(row.plant), percent(row.promised));
            format!("{plant} in {} is found in {} instead of {promised}", row.case, row.found)
        }));
    }
    // The statement promises nothing for changes that leave the brightness alone, but somewhere they are to be seen.
    for plant in [Plant::Texel, Plant::Camera, Plant::Channel, Plant::Device] {
        let most = study.planted.iter().filter(|row| row.plant == plant).map(|row| row.found.value());
        if let Some(most) = most.reduce(f64::max).filter(|most| *most < FOUND) {
            failures.push(format!("{} is found in {} of the trials at most", name(plant), percent(most)));
        }
    }
    println!(
        "change of brightness: of the mean luminance, measured between all renderings of the pools, ± one standard error. promised: the power \
         that the statement of a run without a change has for a uniform change of this size; for `seed` the probability of a false alarm that \
         the case may have. Changes of places or colours that leave the brightness alone are promised next to nothing: what counts is how many \
         are found. passed: not less than promised (for `seed`, not more) by more than chance explains; all rows together fail by chance \
         with a probability of {}. A change of places or colours must be found in {} of the trials in one case at least.",
        percent(CHANCE),
        percent(FOUND)
    );
    failures
}

/// Probability that as few trials as these find the change, or for other seeds as many, if what is promised is true.
fn chance(row: &PlantedRow) -> f64 {
    let Share { found, trials } = row.found;
    match row.plant {
        Plant::Seed => found.checked_sub(1).map_or(1.0, |fewer| 1.0 - at_most(fewer, trials, row.promised)),
        _ => at_most(found, trials, row.promised),
    }
}

fn name(plant: Plant) -> String {
    format!("{plant:?}").to_lowercase()
}

/// A share in per cent with two significant digits.
fn percent(share: f64) -> String {
    let value = 100.0 * share;
    let digits = if value == 0.0 { 1.0 } else { (1.0 - value.abs().log10().floor()).clamp(0.0, 5.0) };
    format!("{value:.*} %", digits as usize)
}
