//! Whether all give the same answers.

use pointillist::tracer::accel::Ray;

use super::contest::{Contestant, Question};

/// Relative difference of two distances that counts.
const TOLERANCE: f32 = 1e-4;

/// Compares every contestant with `reference` on every `stride`-th ray of all lists.
pub fn agree(contestants: &[Box<dyn Contestant>], reference: usize, lists: &[Vec<Ray>], stride: usize) {
    let rays: Vec<Ray> = lists.iter().flat_map(|l| l.iter().step_by(stride).copied()).collect();
    let answers = |who: &dyn Contestant, question: Question| {
        let mut found = vec![0.0; rays.len()];
        who.prepare();
        question.ask(who, &rays, &mut found);
        found
    };
    let theirs = [Question::Closest, Question::Occluded].map(|q| answers(&*contestants[reference], q));
    println!("{} rays against {}, differences:", rays.len(), contestants[reference].name());
    // Floats resolve distances of no less than 1e-7 of the coordinates, however near the hit.
    println!(
        "  {:<8} {:>8} {:>12} {:>12} {:>16} {:>9}",
        "", "hit/miss", "|dt|/t>1e-4", "max |dt|/t", "max |dt|/(t+|o|)", "occluded"
    );
    for (_, who) in contestants.iter().enumerate().filter(|(i, _)| *i != reference) {
        let ours = [Question::Closest, Question::Occluded].map(|q| answers(&**who, q));
        let (mut missed, mut apart, mut most, mut large) = (0, 0, 0f32, 0f32);
        for ((a, b), ray) in ours[0].iter().zip(&theirs[0]).zip(&rays) {
            if a.is_finite() != b.is_finite() {
                missed += 1;
            } else if a.is_finite() {
                let difference = (a - b).abs() / b.abs().max(f32::MIN_POSITIVE);
                apart += usize::from(difference > TOLERANCE);
                most = most.max(difference);
                large = large.max((a - b).abs() / (b * ray.direction.length() + ray.origin.length()));
            }
        }
        let shadows = ours[1].iter().zip(&theirs[1]).filter(|(a, b)| a != b).count();
        println!("  {:<8} {missed:>8} {apart:>12} {most:>12.1e} {large:>16.1e} {shadows:>9}", who.name());
    }
}
