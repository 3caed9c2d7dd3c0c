//! Properties of `math::warp`.

use pointillist::math::warp::*;
use proptest::prelude::*;

/// A random number as the sampler gives them.
fn number() -> impl Strategy<Value = f32> {
    prop_oneof![1 => Just(0), 1 => Just((1u32 << 24) - 1), 8 => 0..1u32 << 24]
        .prop_map(|n| n as f32 / (1u32 << 24) as f32)
}

/// A density of any ratio to others that [`linear`] takes, or zero.
fn density() -> impl Strategy<Value = f32> {
    prop_oneof![1 => Just(0.0), 4 => (-59.0..59.0f32).prop_map(f32::exp2)]
}

/// The integral from 0 to `x` of the density that is linear from `a` to `b`.
fn cumulative(x: f32, a: f32, b: f32) -> f64 {
    let [x, a, b] = [x, a, b].map(f64::from);
    x * (2.0 * a + (b - a) * x) / (a + b)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    /// The inverse of the integral, whatever the exponents of the ends.
    #[test]
    fn linear_inverts_its_integral(u in number(), a in density(), b in density()) {
        prop_assume!(a + b > 0.0);
        let x = linear(u, a, b);
        prop_assert!((0.0..=1.0).contains(&x));
        // Five roundings of x and half of those three under the root, where x times its density is at most 2.
        prop_assert!((cumulative(x, a, b) - f64::from(u)).abs() <= 8e-7, "{} instead of {}", cumulative(x, a, b), u);
    }

    /// A bilinear density is the mean of its corners on average, so those are 4 together.
    #[test]
    fn bilinear_densities_are_normalised(corners in [[density(), density()], [density(), density()]]) {
        prop_assume!(corners.as_flattened().iter().any(|v| *v > 1e-30));
        let at = |x, y| f64::from(bilinear_pdf([x, y], corners));
        let sum = at(0.0, 0.0) + at(1.0, 0.0) + at(0.0, 1.0) + at(1.0, 1.0);
        prop_assert!((sum - 4.0).abs() < 4e-6, "{}", sum);
    }

    /// The concentric map takes squares around the middle to circles around it.
    #[test]
    fn squares_become_circles(u in [number(), number()]) {
        let side = u.map(|u| (2.0 * u - 1.0).abs());
        prop_assert!((disk(u).length() - side[0].max(side[1])).abs() < 2e-7);
    }

    /// Directions of cones of any width are unit vectors within them.
    #[test]
    fn cones_hold_their_directions(u in [number(), number()], exponent in -20.0..0.301f32) {
        let h = 10f32.powf(exponent).min(2.0);
        let v = cone(u, h);
        prop_assert!((v.length() - 1.0).abs() < 3e-7);
        // sin² = h (2 − h); beyond the hemisphere by the cosine.
        let sin2 = v.x * v.x + v.y * v.y;
        prop_assert!(if h < 1.0 { sin2 <= h * (2.0 - h) * 1.000_001 } else { v.z >= 1.0 - h - 3e-7 }, "{}", v);
    }
}
