//! Media that emit the light of black bodies, against closed forms and quadrature.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use crate::media::{mean_of, one_number};
use crate::support::agreement::{Method, Plan};
use crate::support::scenes::*;
use pointillist::scene::desc::texture::{SpectrumTexture, WrapMode};
use pointillist::scene::desc::volume::{VolumeGrid, VolumeTexture};
use pointillist::scene::desc::*;
use pointillist::spectrum::{Spectrum, blackbody};
use pointillist::stream::UvWindow;

const METHODS: [Method; 4] = [Method::Path, Method::Photon, Method::Bidirectional, Method::Vcm];
const PLAN: Plan = Plan { side: 1, paths_per_pixel: 1 << 13, seeds: 16, window: UvWindow::PICTURE };

/// The radiance of a black body.
fn body(kelvin: f64) -> Spectrum {
    let point = |nm: i32| (nm as f32, blackbody::radiance(f64::from(nm), kelvin) as f32);
    Spectrum::table(&(360..=830).map(point).collect::<Vec<_>>()).unwrap()
}

/// What takes the slab of [`before_camera`] to the unit cube.
fn slab_to_unit() -> DAffine3 {
    DAffine3::from_scale(DVec3::splat(0.5)) * DAffine3::from_translation(DVec3::new(1.0, 1.0, -2.0))
}

/// A slab of thickness 2, [−1, 1]² × [2, 4], before a camera at the origin that looks along z. What is scattered in it is not followed.
fn before_camera(sigma_t: f32, albedo: f32, light: MediumEmission) -> SceneDesc {
    let mut desc = empty();
    desc.camera.perspective_mut().unwrap().fov = 0.01;
    desc.integrator.max_depth = Some(1);
    let gas = medium(&mut desc, sigma_t, albedo, PhaseDesc::Isotropic);
    desc.media[0].emission = Some(light);
    boundary(&mut desc, ShapeKind::Cube, DAffine3::from_translation(DVec3::new(0.0, 0.0, 3.0)), gas);
    desc
}

/// Asserts what each method finds, within four standard errors and a hundredth.
fn assert_seen(desc: &SceneDesc, expected: f64, what: &str) {
    for method in METHODS {
        let (found, error) = mean_of(desc, method, PLAN);
        println!("{what}, {method:?}: {found:.6} ± {error:.6}, expected {expected:.6}");
        let off = (found - expected).abs();
        // Sums over whole nanometres and integrals differ by a ten-thousandth.
        let within = (4.0 * error + 3e-4 * expected).min(0.02 * expected);
        assert!(off <= within, "{what}, {method:?}: {found} ± {error}, not {expected}");
    }
}

/// Of a slab of one temperature that scatters nothing back to the camera: (1 − α) (1 − exp(−σₜ d)) times the radiance of the black body,
/// whether the temperature is one number or stands in a grid, and whether the density does.
#[test]
fn a_glowing_slab_has_its_closed_form() {
    for (kelvin, sigma_t, albedo) in [(1300.0f32, 2.0f32, 0.0f32), (1900.0, 0.3, 0.25), (6500.0, 4.0, 0.6)] {
        let expected = f64::from(body(kelvin.into()).luminance())
            * f64::from(1.0 - albedo)
            * -(-2.0 * f64::from(sigma_t)).exp_m1();
        let even = MediumEmission { radiance: body(kelvin.into()), grid: None };
        assert_seen(&before_camera(sigma_t, albedo, even), expected, &format!("slab at {kelvin} K"));
        let kelvins = EmissionGrid::Temperatures(one_number(kelvin, slab_to_unit()));
        let light = MediumEmission { radiance: Spectrum::Constant(3.0), grid: Some(kelvins) };
        let mut desc = before_camera(sigma_t, albedo, light);
        let what = format!("slab on a grid at {kelvin} K");
        assert_seen(&desc, 3.0 * expected, &what);
        desc.media[0].sigma_t = SpectrumTexture::Volume(one_number(sigma_t, slab_to_unit()));
        assert_seen(&desc, 3.0 * expected, &format!("{what} with densities on a grid"));
    }
}

/// Between points of a grid the temperature is interpolated, and not the radiance. Beyond its first and last point it is the same.
#[test]
fn temperatures_are_interpolated() {
    let (low, high, sigma_t) = (1200.0f32, 2400.0f32, 0.8f32);
    let grid = Arc::new(VolumeGrid::new([1, 1, 2], 1, vec![low, high]));
    let kelvins = VolumeTexture::new(grid, slab_to_unit(), WrapMode::Clamp, false);
    let grid = Some(EmissionGrid::Temperatures(Arc::new(kelvins)));
    let light = MediumEmission { radiance: Spectrum::Constant(1.0), grid };
    let desc = before_camera(sigma_t, 0.0, light);
    let luminance = |kelvin: f64| f64::from(body(kelvin).luminance());
    let [of_low, of_high] = [low, high].map(|kelvin| luminance(kelvin.into()));
    let (mut expected, mut of_radiance) = (0.0, 0.0);
    let (steps, sigma_t) = (4000, f64::from(sigma_t));
    for i in 0..steps {
        let dt = 2.0 / f64::from(steps);
        let t = (f64::from(i) + 0.5) * dt;
        // The points lie at a quarter and at three quarters of the slab.
        let share = (t - 0.5).clamp(0.0, 1.0);
        let weight = sigma_t * (-sigma_t * t).exp() * dt;
        expected += weight * luminance(f64::from(low) + f64::from(high - low) * share);
        of_radiance += weight * (of_low + (of_high - of_low) * share);
    }
    assert!(of_radiance > 1.3 * expected, "{of_radiance} {expected}");
    assert_seen(&desc, expected, "slab from 1200 K to 2400 K");
}
