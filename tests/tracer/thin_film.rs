//! Interference in thin films: against closed forms, and against the characteristic matrix in double precision.

use glam::Vec4;
use pointillist::tracer::bsdf::{ThinFilm, fresnel};

/// A complex number.
#[derive(Clone, Copy)]
struct Complex(f64, f64);

impl Complex {
    fn plus(self, b: Self) -> Self {
        Self(self.0 + b.0, self.1 + b.1)
    }

    fn times(self, by: f64) -> Self {
        Self(self.0 * by, self.1 * by)
    }

    fn squared(self) -> f64 {
        self.0 * self.0 + self.1 * self.1
    }
}

/// Reflectance by the characteristic matrix of one layer (H. A. Macleod, *Thin-Film Optical Filters*, §2.4): B = cos δ + i sin δ η_s / η,
/// C = i η sin δ + η_s cos δ, r = (η₀ B − C) / (η₀ B + C), with η = n cos θ across the plane of incidence and n / cos θ within it.
fn characteristic(cos: f64, film: f64, base: f64, thickness: f64, lambda: f64) -> f64 {
    let sin2 = 1.0 - cos * cos;
    let [in_film, in_base] = [film, base].map(|n| (1.0 - sin2 / (n * n)).sqrt());
    let delta = std::f64::consts::TAU * film * thickness * in_film / lambda;
    let reflectance = |admittance: fn(f64, f64) -> f64| {
        let [outside, layer, under] =
            [(1.0, cos), (film, in_film), (base, in_base)].map(|(n, c)| admittance(n, c));
        let b = Complex(delta.cos(), delta.sin() * under / layer);
        let c = Complex(under * delta.cos(), layer * delta.sin());
        let (up, down) = (b.times(outside).plus(c.times(-1.0)), b.times(outside).plus(c));
        up.squared() / down.squared()
    };
    0.5 * (reflectance(|n, c| n * c) + reflectance(|n, c| n / c))
}

#[test]
fn reflectances_are_those_of_the_characteristic_matrix() {
    let lambda = Vec4::new(400.0, 500.0, 600.0, 750.0);
    let (mut compared, mut worst) = (0, 0f64);
    for film in [1.0, 1.1, 1.33, 1.8, 3.0] {
        for base in [1.1, 1.5, 2.4, 20.0] {
            for thickness in [0.0, 20.0, 137.0, 450.0, 1500.0] {
                for degrees in [0.0f64, 10.0, 45.0, 70.0, 85.0, 89.0] {
                    let cos = degrees.to_radians().cos();
                    let got = ThinFilm::new(1.0, film, thickness, lambda)
                        .reflectance(cos as f32, Vec4::splat(base));
                    for (got, lambda) in got.to_array().into_iter().zip(lambda.to_array()) {
                        let [film, base, thickness, lambda] = [film, base, thickness, lambda].map(f64::from);
                        let wanted = characteristic(cos, film, base, thickness, lambda);
                        worst = worst.max((f64::from(got) - wanted).abs());
                        compared += 1;
                    }
                }
            }
        }
    }
    println!("{compared} reflectances, largest difference {worst:.1e}");
    // A phase of 100 in single precision is exact to 1e-5.
    assert!(worst < 2e-5, "{worst}");
}

#[test]
fn known_films() {
    let lambda = Vec4::splat(550.0);
    let at_normal = |film: f32, thickness: f32, base: f32| {
        ThinFilm::new(1.0, film, thickness, lambda).reflectance(1.0, Vec4::splat(base)).x
    };
    // A quarter wave of the index √n reflects nothing; half a wave, or none, is not there.
    assert!(at_normal(1.5, 550.0 / 6.0, 2.25) < 1e-12);
    let bare = fresnel::dielectric(1.0, Vec4::splat(2.25)).x;
    for absent in [0.0, 550.0 / 3.0] {
        assert!((at_normal(1.5, absent, 2.25) - bare).abs() < 1e-6, "{absent}");
    }
    // A black film of soap in front of nothing: no phase, no reflection.
    assert!(at_normal(1.33, 0.0, 1.0) < 1e-7);
    // Total reflection, and grazing.
    let water_to_air = ThinFilm::new(1.0, 1.2, 300.0, lambda);
    assert_eq!(water_to_air.reflectance(0.2, Vec4::splat(0.75)), Vec4::ONE);
    assert_eq!(water_to_air.reflectance(0.0, Vec4::splat(1.5)), Vec4::ONE);
}

/// The film reflects the same to both sides, and at all angles no more than arrives.
#[test]
fn reflectances_stay_within_bounds() {
    let lambda = Vec4::new(380.0, 470.0, 620.0, 780.0);
    for eta in [1.0, 1.000_001, 1.3, 10.0] {
        for base in [0.1, 0.999, 1.0, 1.000_1, 1.5, 2000.0] {
            for thickness in [0.0, 1e-3, 400.0, 1e5] {
                for cos in [0.0, 1e-30, 1e-7, 1e-3, 0.3, 0.999_999, 1.0] {
                    let r = ThinFilm::new(1.0, eta, thickness, lambda).reflectance(cos, Vec4::splat(base));
                    let fits = r.to_array().into_iter().all(|r| (0.0..=1.0).contains(&r));
                    assert!(fits, "{eta} {base} {thickness} {cos}: {r}");
                }
            }
        }
    }
}
