//! Tests of `client::glare::fourier`.

use pointillist::client::glare::fourier::*;

#[test]
fn transforms_are_long_enough_and_not_much_longer() {
    for (pixels, half) in
        [(1, 1), (2, 2), (3, 3), (33, 36), (512, 512), (1080, 1152), (1920, 1920), (4096, 4096)]
    {
        assert_eq!(FourierAxis::new(pixels).half, half, "{pixels} pixels");
    }
    for pixels in 1..=5000 {
        let axis = FourierAxis::new(pixels);
        assert!(axis.half >= pixels && axis.half * 4 <= pixels * 5, "{pixels} pixels: {}", axis.half);
        assert_eq!(axis.radices.iter().product::<u32>() as usize, axis.half);
        assert!(axis.radices.len() <= 8 || pixels > 4096, "{:?}", axis.radices);
    }
}

/// The stages in the order that the shader runs them, against the definition.
#[test]
fn places_have_the_frequencies_that_the_stages_leave() {
    let axis = FourierAxis { pixels: 60, half: 60, radices: vec![3, 5, 4] };
    assert_eq!(axis.frequencies()[..3], [0, 15, 30]);
    for pixels in [1, 7, 24, 45, 240, 1152] {
        let mut all = FourierAxis::new(pixels).frequencies();
        all.sort_unstable();
        assert!(all.iter().enumerate().all(|(i, f)| *f as usize == i), "{pixels} pixels");
    }
    let [one, quarter] = [0, 30].map(|k| axis.twiddles()[k]);
    assert!(one == [1.0, 0.0] && (quarter[0].abs() < 1e-7) && quarter[1] == -1.0);
}
