//! Tests of `client::window::statistics`.

use pointillist::client::window::statistics::*;

#[test]
fn percentiles_are_nearest_ranks() {
    let mut recent = RecentValues::new(100);
    assert_eq!(recent.percentiles([50.0, 99.0]), [0.0, 0.0]);
    for value in (1..=100).rev() {
        recent.push(value as f32);
    }
    assert_eq!(recent.percentiles([0.0, 1.0, 50.0, 95.0, 99.0, 100.0]), [1.0, 1.0, 50.0, 95.0, 99.0, 100.0]);
    let mut few = RecentValues::new(8);
    few.push(3.0);
    few.push(f32::NAN);
    few.push(1.0);
    assert_eq!(few.percentiles([50.0, 95.0]), [1.0, 3.0]);
}

#[test]
fn only_the_last_values_count() {
    let mut recent = RecentValues::new(3);
    [9.0, 1.0, 2.0, 3.0].into_iter().for_each(|v| recent.push(v));
    assert_eq!(recent.iter().collect::<Vec<_>>(), [1.0, 2.0, 3.0]);
    assert_eq!(recent.last(), Some(3.0));
}
