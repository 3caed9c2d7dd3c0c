//! Environment maps with a sun, with black rows, and with texels that are no radiance.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DMat3, Vec3};

use pointillist::math::distribution_2d::Distribution2d;
use pointillist::spectrum::EmissionMap;
use pointillist::spectrum::emission_map::{TexelRepairs, repair};
use pointillist::tracer::light::{DirectionSampling, EnvironmentMap};

use crate::Row;
use crate::support::scenes::Random;

const SIZE: [usize; 2] = [48, 24];

/// A dim sky with black rows, one of them at a pole, and a sun of 10⁶ times its brightness at `sun`.
fn texels(sun: [usize; 2]) -> Vec<[f32; 3]> {
    let [width, height] = SIZE;
    let mut random = Random(5);
    let mut texels: Vec<[f32; 3]> = (0..width * height)
        .map(|i| if (i / width) % 5 == 3 || i / width == height - 1 { [0.0; 3] } else { [random.f32(); 3] })
        .collect();
    texels[sun[1] * width + sun[0]] = [1e6; 3];
    texels
}

fn light(texels: &[[f32; 3]]) -> EnvironmentMap {
    EnvironmentMap::new(Arc::new(EmissionMap::new(SIZE[0], texels).unwrap()), DMat3::IDENTITY)
}

/// The integral over the sphere of `density`, by the middles of a fine grid over each cell between the nodes: columns are half a texel off, and
/// rows are even in the angle to the pole.
fn integral(density: impl Fn(Vec3, [usize; 2]) -> f64) -> f64 {
    let ([width, height], fine) = (SIZE, 16);
    let mut sum = 0.0;
    for (x, y) in (0..width).flat_map(|x| (0..height - 1).map(move |y| (x, y))) {
        let [top, bottom] = [y, y + 1].map(|y| 1.0 - (PI * y as f64 / (height - 1) as f64).cos());
        for (i, j) in (0..fine).flat_map(|i| (0..fine).map(move |j| (i, j))) {
            let [s, t] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(fine));
            let (sin, cos) = ((x as f64 + s + 0.5) * TAU / width as f64).sin_cos();
            let up = top + (bottom - top) * t;
            let r = (up * (2.0 - up)).sqrt();
            let d = Vec3::new((r * sin) as f32, (1.0 - up) as f32, (-r * cos) as f32);
            sum += density(d, [x, y]) * (bottom - top) * TAU / width as f64 / f64::from(fine * fine);
        }
    }
    sum
}

/// The density of directions integrates to 1, with a sun at a pole, at the seam, or beside black rows.
///
/// The bound is the rounding of a place to its cell: of the sun's, which has nearly all of the density, one of 48 columns, 10⁻⁵ of a column off.
#[test]
fn n22_density_of_a_sun() {
    for sun in [[20, 0], [47, 11], [7, 22]] {
        let (width, height) = (SIZE[0], SIZE[1]);
        let texels = texels(sun);
        let map = light(&texels);
        // Texels as they are, each over the sine of its own row: the solid angle of the rows at the poles is none.
        let sine = |y: usize| (PI * y as f64 / (height - 1) as f64).sin();
        let weights: Vec<f64> =
            (0..texels.len()).map(|i| f64::from(texels[i][0]) * sine(i / width)).collect();
        let total: f64 = weights.iter().sum();
        let naive = |_: Vec3, [x, y]: [usize; 2]| {
            weights[y * width + x] / total * (width * (height - 1)) as f64 / (TAU * PI * sine(y))
        };
        Row {
            case: &format!("N22 sky with black rows and a sun of 1e6:1 at column {}, row {}", sun[0], sun[1]),
            measure: "error of the integral of the density",
            figure: (integral(|d, _| f64::from(map.pdf_direction(d).0)) - 1.0).abs(),
            naive: ("texels over the sine of their row", (integral(naive) - 1.0).abs()),
            bound: 2e-5,
        }
        .check();
    }
}

/// Beside a sun of 10⁶ times their brightness all texels of a row are chosen as often as is told. Random numbers are multiples of 2⁻²⁴, all of
/// which are tried.
#[test]
fn n22_choice_beside_a_sun() {
    let width = 2048;
    let mut random = Random(9);
    let mut weights: Vec<f32> = (0..width).map(|_| random.f32() + 0.1).collect();
    weights[700] = 1e6;
    let chosen = Distribution2d::new(width, &weights).unwrap();
    let total: f32 = weights.iter().sum();
    let mut table = vec![0.0f32];
    for w in &weights {
        table.push(table[table.len() - 1] + w / total);
    }
    let steps = 1u32 << 24;
    let (mut counts, mut naive) = (vec![0u32; width], vec![0u32; width]);
    for i in 0..steps {
        let u = i as f32 / steps as f32;
        counts[chosen.sample([u, 0.5]).cell[0]] += 1;
        naive[table.partition_point(|v| *v <= u).clamp(1, width) - 1] += 1;
    }
    let worst = |counts: &[u32], told: &dyn Fn(usize) -> f64| {
        let off = |i: usize| (f64::from(counts[i]) / f64::from(steps) / told(i) - 1.0).abs();
        (0..width).map(off).fold(0.0, f64::max)
    };
    Row {
        case: "N22 texels beside a sun of 1e6:1",
        measure: "relative error of the probability that is told",
        figure: worst(&counts, &|i| f64::from(chosen.probability([i, 0]))),
        naive: ("sums in single precision", worst(&naive, &|i| f64::from(weights[i] / total))),
        bound: 1e-6,
    }
    .check();
}

/// Texels that are infinite, no numbers or negative count as 0 and are counted; all others stay.
#[test]
fn b3_n22_texels_that_are_no_radiance() {
    let mut faulty = texels([20, 5]);
    let mut clean = faulty.clone();
    let faults = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1e-6, -0.0, f32::MIN];
    for (k, i) in (0..faulty.len()).step_by(7).enumerate() {
        let fault = faults[k % faults.len()];
        faulty[i][k % 3] = fault;
        if fault.is_finite() { clean[i][k % 3] = 0.0 } else { clean[i] = [0.0; 3] }
    }
    let n = faulty.len().div_ceil(7);
    let naive = f64::from(faulty.iter().map(|t| t[1]).sum::<f32>());
    assert!(EmissionMap::new(SIZE[0], &faulty).is_err());
    let repairs = repair(&mut faulty);
    let of = |kinds: [usize; 3]| (0..n).filter(|k| kinds.contains(&(k % 6))).count();
    let zeros = (0..n).filter(|k| k % 6 == 4).count();
    assert_eq!(repairs, TexelRepairs { not_finite: of([0, 1, 2]), negative: of([3, 4, 5]) - zeros });
    let wrong = faulty.iter().zip(&clean).filter(|(a, b)| a != b).count();
    let map = light(&faulty);
    assert!((integral(|d, _| f64::from(map.pdf_direction(d).0)) - 1.0).abs() < 2e-5);
    Row {
        case: &format!("B3 N22 {n} of {} texels infinite, no numbers or negative", faulty.len()),
        measure: "texels that are not what they were, or 0",
        figure: wrong as f64,
        naive: ("sum of them as they are", naive),
        bound: 0.0,
    }
    .check();
}
