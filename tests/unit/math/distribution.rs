//! Properties of `math::distribution` and `math::distribution_2d`, for weights of every exponent.

use pointillist::math::distribution::Distribution;
use pointillist::math::distribution_2d::Distribution2d;
use proptest::collection::vec;
use proptest::prelude::*;

/// A weight of any exponent that single precision has, denormals included, or zero.
fn weight() -> impl Strategy<Value = f32> {
    prop_oneof![1 => Just(0.0), 8 => (0u32..f32::INFINITY.to_bits()).prop_map(f32::from_bits)]
}

fn weights(most: usize) -> impl Strategy<Value = Vec<f32>> {
    vec(weight(), 1..most).prop_filter("some weight", |w| w.iter().any(|w| *w > 0.0))
}

/// Twice the rounding of a probability to single precision.
const ROUNDING: f64 = 1.0 / (1 << 23) as f64;

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// `sample` is the inverse of the sums of what `probability` reports, and these are the shares of the weights but for cells that go
    /// to entries that have less than one.
    #[test]
    fn sampling_inverts_the_sums_of_probabilities(weights in weights(300), u in vec(0.0..1.0f64, 50)) {
        let d = Distribution::new(&weights).expect("finite weights");
        let total: f64 = weights.iter().map(|w| f64::from(*w)).sum();
        let cell = 1.0 / (1u64 << 32) as f64;
        let mut sums = vec![0.0];
        for (i, w) in weights.iter().enumerate() {
            let (p, share) = (f64::from(d.probability(i)), f64::from(*w) / total);
            prop_assert_eq!(*w > 0.0, p > 0.0);
            let most = weights.len() as f64 * cell + ROUNDING * share;
            prop_assert!((p - share).abs() <= most, "entry {}: {} instead of {}", i, p, share);
            sums.push(sums[i] + p);
        }
        prop_assert!((sums[weights.len()] - 1.0).abs() < ROUNDING);
        for u in u {
            let choice = d.sample(u);
            prop_assert_eq!(choice.probability, d.probability(choice.index));
            prop_assert!(weights[choice.index] > 0.0);
            let place = sums[choice.index] - ROUNDING..sums[choice.index + 1] + ROUNDING;
            prop_assert!(place.contains(&u), "{} is not in {:?}", u, place);
        }
    }

    /// Only ratios count: a power of two, which rounds nothing, changes nothing.
    #[test]
    fn scaled_weights_have_the_same_probabilities(
        weights in vec(0.0..1.0f32, 1..64).prop_map(|mut w| { w[0] += 0.5; w }),
        exponent in -60..60i32,
    ) {
        let scaled: Vec<f32> = weights.iter().map(|w| w * 2f32.powi(exponent)).collect();
        let of = |weights: &[f32]| {
            let d = Distribution::new(weights).expect("a positive weight");
            let square = Distribution2d::new(1, weights).expect("a positive weight");
            (0..weights.len()).map(|i| [d.probability(i), square.probability([0, i])]).collect::<Vec<_>>()
        };
        prop_assert_eq!(of(&weights), of(&scaled));
    }

    /// Every cell with weight has a probability, together they are 1, and a sample has that of its cell and lies within it.
    #[test]
    fn cells_of_a_grid_are_sampled_as_they_say(
        width in 1..20usize,
        weights in weights(20),
        rows in 1..10usize,
        u in vec((0..1u32 << 24, 0..1u32 << 24), 50),
    ) {
        let cells: Vec<f32> = weights.iter().copied().cycle().take(width * rows.max(weights.len().div_ceil(width))).collect();
        let d = Distribution2d::new(width, &cells).expect("finite weights");
        let mut sum = 0.0;
        for (i, w) in cells.iter().enumerate() {
            let p = d.probability([i % width, i / width]);
            prop_assert_eq!(*w > 0.0, p > 0.0);
            sum += f64::from(p);
        }
        prop_assert!((sum - 1.0).abs() < 1e-6, "{}", sum);
        let step = |u: u32| u as f32 / (1u32 << 24) as f32;
        for (a, b) in u {
            let choice = d.sample([step(a), step(b)]);
            prop_assert!(cells[choice.cell[1] * width + choice.cell[0]] > 0.0);
            prop_assert_eq!(choice.probability, d.probability(choice.cell));
            prop_assert!(choice.offset.iter().all(|v| *v > 0.0 && *v < 1.0));
            // A larger number never gives an earlier row, nor an earlier place in the same row.
            let next = d.sample([step(a), step((b + 1).min((1 << 24) - 1))]);
            let place = |y: usize, offset: f32| y as f64 + f64::from(offset);
            prop_assert!(place(next.cell[1], next.offset[1]) >= place(choice.cell[1], choice.offset[1]));
        }
    }
}
