//! Numbers of the contests as text.

use super::contest::{Contestant, Question};
use crate::common::median;

/// Width of the first column, of a yardstick's, of another's.
const WIDTHS: [usize; 3] = [19, 8, 21];

/// How many times as fast `who` is as `yardstick`: geometric mean over the rounds, and its standard error.
fn ratio(rounds: &[Vec<f64>], who: usize, yardstick: usize) -> (f64, f64) {
    let logs: Vec<f64> = rounds.iter().map(|r| (r[yardstick] / r[who]).ln()).collect();
    let n = logs.len() as f64;
    let mean = logs.iter().sum::<f64>() / n;
    let variance = logs.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    (mean.exp(), mean.exp() * (variance / n).sqrt())
}

/// Where a contestant of this name stands.
fn find(contestants: &[Box<dyn Contestant>], name: &str) -> Option<usize> {
    contestants.iter().position(|c| c.name() == name)
}

/// The head of a table of contests.
pub fn head(contestants: &[Box<dyn Contestant>]) {
    print!("{:<1$}", "rays", WIDTHS[0]);
    let yardsticks = ["Embree", "robust"].map(|y| find(contestants, y));
    for (i, c) in contestants.iter().enumerate() {
        print!("{:>1$}", c.name(), if yardsticks.contains(&Some(i)) { WIDTHS[1] } else { WIDTHS[2] });
    }
    println!();
}

/// A row: million rays per second; of all but the yardsticks the ratio to Embree with its error, and that to Embree robust.
pub fn row(contestants: &[Box<dyn Contestant>], kind: &str, question: Question, rounds: &[Vec<f64>]) {
    print!("{:<1$}", format!("{kind} {}", question.name()), WIDTHS[0]);
    let yardsticks = ["Embree", "robust"].map(|y| find(contestants, y));
    for i in 0..contestants.len() {
        let speed = 1e-6 / median(rounds.iter().map(|r| r[i]).collect());
        if yardsticks.contains(&Some(i)) {
            print!("{speed:>width$.2}", width = WIDTHS[1]);
            continue;
        }
        let mut text = format!("{speed:.2}");
        if let Some(y) = yardsticks[0] {
            let (ratio, error) = ratio(rounds, i, y);
            text += &format!(" {ratio:.2}±{}", format!("{error:.2}").trim_start_matches('0'));
        }
        if let Some(y) = yardsticks[1] {
            text += &format!(" {:.2}", ratio(rounds, i, y).0);
        }
        print!("{text:>width$}", width = WIDTHS[2]);
    }
    println!();
}

/// Memory and time to build, of those with a tree of their own.
pub fn built(name: &str, bytes: usize, triangles: usize, seconds: Vec<f64>) {
    let best = seconds.iter().copied().fold(f64::INFINITY, f64::min);
    println!("  {name:<8} {:>6.1} {best:>10.3} {:>10.3}", bytes as f64 / triangles as f64, median(seconds));
}
