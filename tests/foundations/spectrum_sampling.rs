//! Hero wavelength sampling is unbiased: estimates over random wavelengths agree with sums over the tables.

use glam::{DVec3, Vec4};
use pointillist::color::cie;
use pointillist::color::profile::rec709_from_xyz;
use pointillist::math::random::Random;
use pointillist::spectrum::{SampledWavelengths, Spectrum, dispersion::Ior, metals};

/// Mean of `to_xyz` over `n` samples, and its standard error.
fn estimate(spectrum: &Spectrum, hero_only: bool, numbers: impl Iterator<Item = f32>) -> (DVec3, DVec3) {
    let (mut n, mut sum, mut squares) = (0.0, DVec3::ZERO, DVec3::ZERO);
    for u in numbers {
        let mut lambda = SampledWavelengths::sample(u);
        if hero_only {
            lambda.terminate_companions();
        }
        let xyz = lambda.to_xyz(spectrum.sample(&lambda));
        let v = DVec3::new(xyz.x.into(), xyz.y.into(), xyz.z.into());
        (n, sum, squares) = (n + 1.0, sum + v, squares + v * v);
    }
    let mean = sum / n;
    let variance = squares / n - mean * mean;
    (mean, DVec3::from_array((variance / n).to_array().map(f64::sqrt)))
}

/// The same by the tables, with the spectrum averaged over each nanometre.
fn tabulated(spectrum: &Spectrum) -> DVec3 {
    let steps = 400;
    cie::integrate(|lambda, _| {
        let at = |i: usize| lambda - 0.5 + (i as f32 + 0.5) / steps as f32;
        (0..steps).map(|i| f64::from(spectrum.eval(Vec4::splat(at(i))).x)).sum::<f64>() / steps as f64
    })
}

fn spectra() -> Vec<(&'static str, Spectrum)> {
    let laser = [(531.8, 0.0), (532.0, 40.0), (532.2, 0.0)];
    let steps = [(300.0, 1.0), (589.0, 1.0), (589.01, 0.1), (900.0, 0.1)];
    vec![
        ("equal energy", Spectrum::Constant(1.0)),
        ("D65", Spectrum::d65(1.0)),
        ("orange light", Spectrum::emission_rgb([17.0, 12.0, 4.0])),
        ("blue surface", Spectrum::reflectance_rgb([0.05, 0.1, 0.7])),
        ("laser line", Spectrum::table(&laser).expect("valid points")),
        ("step", Spectrum::table(&steps).expect("valid points")),
        ("eta of gold", metals::named("Au").expect("gold").0),
    ]
}

#[test]
fn random_wavelengths_estimate_the_tabulated_integral() {
    // 7 spectra · 2 modes · 3 components: the 1 % level, Šidák-corrected, is |z| < 3.67.
    for hero_only in [false, true] {
        for (seed, (name, spectrum)) in spectra().into_iter().enumerate() {
            let mut random = Random(seed as u64 + 100 * u64::from(hero_only));
            let numbers = std::iter::repeat_with(|| random.f32()).take(1 << 20);
            let (mean, error) = estimate(&spectrum, hero_only, numbers);
            let z = (mean - tabulated(&spectrum)) / error;
            println!("{name:14} hero only {hero_only:5}: z = {z:.2}");
            assert!(
                z.abs().max_element() < 3.67,
                "{name}: {mean} should be {}, z = {z}",
                tabulated(&spectrum)
            );
        }
    }
}

#[test]
fn stratified_wavelengths_meet_it_within_1e_4() {
    let n = 1 << 20;
    for hero_only in [false, true] {
        for (name, spectrum) in spectra() {
            let numbers = (0..n).map(|i| i as f32 / n as f32);
            let (mean, _) = estimate(&spectrum, hero_only, numbers);
            let exact = tabulated(&spectrum);
            let off = ((mean - exact) / exact.max_element()).abs().max_element();
            assert!(off < 1e-4, "{name}: {mean} should be {exact}, off by {off}");
        }
    }
}

#[test]
fn the_wrong_density_is_found_out() {
    // The same estimator as if the density were uniform: far outside of what the test above accepts.
    let (mut random, n) = (Random(7), 1 << 16);
    let mut y = 0.0;
    for _ in 0..n {
        let lambda = SampledWavelengths::sample(random.f32());
        y += lambda.lambda().to_array().map(|l| cie::Rows::get().at(l).y * 401.0 / 4.0).iter().sum::<f32>();
    }
    assert!((y / n as f32 - 1.0).abs() > 0.05, "{}", y / n as f32);
}

#[test]
fn one_wavelength_has_more_noise_than_four_of_equal_steps() {
    let mut random = Random(3);
    let numbers: Vec<f32> = std::iter::repeat_with(|| random.f32()).take(1 << 16).collect();
    let (_, four) = estimate(&Spectrum::d65(1.0), false, numbers.iter().copied());
    let (_, one) = estimate(&Spectrum::d65(1.0), true, numbers.iter().copied());
    // Independent wavelengths would gain a factor 2; equal steps of a good density gain more than twice that.
    assert!((one / four).min_element() > 4.0, "{one} {four}");
}

/// Variances of linear Rec.709 red, green and blue, relative to luminance², of one estimate from four wavelengths
/// at equal steps; `draw` gives wavelength in nm and density per nm. The mean is checked on the way.
fn noise_of_rgb(spectrum: &Spectrum, draw: impl Fn(f64) -> (f64, f64)) -> DVec3 {
    let to_rgb = rec709_from_xyz().as_dmat3();
    let (n, mut sum, mut squares) = (4096, DVec3::ZERO, DVec3::ZERO);
    for i in 0..n {
        let mut xyz = DVec3::ZERO;
        for lane in 0..4 {
            let (lambda, pdf) = draw((f64::from(i) + 0.5) / f64::from(4 * n) + f64::from(lane) * 0.25);
            let value = f64::from(spectrum.eval(Vec4::splat(lambda as f32)).x) / pdf / 4.0;
            xyz += cie::Rows::get().at(lambda as f32).truncate().as_dvec3() * value;
        }
        let rgb = to_rgb * xyz;
        (sum, squares) = (sum + rgb, squares + rgb * rgb);
    }
    let (mean, exact) = (sum / f64::from(n), tabulated(spectrum));
    assert!((mean - to_rgb * exact).abs().max_element() < 2e-3 * exact.y, "{mean} is not right");
    (squares / f64::from(n) - mean * mean) / (exact.y * exact.y)
}

#[test]
fn three_lobes_leave_less_noise_in_rgb_than_one() {
    // pbrt-v4 (`SampleVisibleWavelengths`): the single lobe about 538 nm that the density here replaces.
    let one_lobe = |u: f64| {
        let lambda = 538.0 - 138.888_889 * (0.856_910_62 - 1.827_501_97 * u).atanh();
        (lambda, 0.003_939_804_2 / (0.0072 * (lambda - 538.0)).cosh().powi(2))
    };
    let ours = |u: f64| {
        let drawn = SampledWavelengths::sample(u as f32);
        (f64::from(drawn.lambda().x), f64::from(drawn.pdf().x))
    };
    let (mut sum_three, mut sum_one) = (0.0, 0.0);
    for rgb in [[1.0, 1.0, 1.0], [0.63, 0.065, 0.05], [0.14, 0.45, 0.09]] {
        let spectrum = Spectrum::emission_rgb(rgb);
        let (three, one) = (noise_of_rgb(&spectrum, ours), noise_of_rgb(&spectrum, one_lobe));
        println!("{rgb:?}: {three:.4} with three lobes, {one:.4} with one");
        (sum_three, sum_one) = (sum_three + three.element_sum(), sum_one + one.element_sum());
    }
    assert!(sum_three < sum_one / 4.0, "{sum_three} {sum_one}");
}

#[test]
fn a_prism_gives_each_lane_its_own_index() {
    let lambda = SampledWavelengths::sample(0.4);
    let n = Ior::named("sf10").expect("a known glass").sample(&lambda).0.to_array();
    let mut by_wavelength: Vec<_> = lambda.lambda().to_array().into_iter().zip(n).collect();
    by_wavelength.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert!(by_wavelength.windows(2).all(|w| w[0].1 > w[1].1), "{by_wavelength:?}");
}
