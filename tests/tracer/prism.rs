//! A prism against closed forms: angles by Snell's law at each wavelength, and its picture of a bright strip against an integral over
//! wavelengths.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, Vec3, Vec4};

use crate::support::scenes::*;
use pointillist::color::{Xyz, cie};
use pointillist::scene::desc::*;
use pointillist::spectrum::{SampledWavelengths, dispersion::Ior};
use pointillist::stream::{PathCounts, SampleSink, UvWindow};
use pointillist::tracer::accel::Ray;
use pointillist::tracer::bsdf::{Bsdf, ScatteringModel, fresnel};
use pointillist::tracer::integrator::{BidirectionalTracer, RenderContext};
use pointillist::tracer::{Camera, Integrator, PathTracer, Scene};

/// Refracting angle of the prism: 60°.
const APEX: f64 = std::f64::consts::FRAC_PI_3;

fn flint() -> Ior {
    Ior::named("sf11").expect("a named glass")
}

fn index(lambda: f64) -> f64 {
    f64::from(flint().eval(Vec4::splat(lambda as f32)).x)
}

/// An equilateral prism of this side, its edges along y, one of them at −z, centred at the origin.
fn prism(side: f32) -> SceneDesc {
    let mut desc = empty();
    let r = side / 3f32.sqrt();
    let corner = |i: u32, y: f32| {
        let angle = (2.0 * i as f32 / 3.0) * std::f32::consts::PI;
        Vec3::new(r * angle.sin(), y, -r * angle.cos())
    };
    let h = 10.0 * side;
    let positions = (0..3).map(|i| corner(i, -h)).chain((0..3).map(|i| corner(i, h))).collect();
    let mut triangles = vec![[0, 1, 2], [5, 4, 3]];
    for i in 0..3 {
        let j = (i + 1) % 3;
        triangles.extend([[i, i + 3, j], [j, i + 3, j + 3]]);
    }
    desc.meshes.push(Arc::new(Mesh { positions, triangles, ..Mesh::default() }));
    let m = material(&mut desc, glass(flint()));
    shape(&mut desc, ShapeKind::Mesh(MeshId(0)), DAffine3::IDENTITY, m, 0.0);
    desc
}

/// Unit vector at an angle from +x towards +z.
fn towards(angle: f64) -> DVec3 {
    DVec3::new(angle.cos(), 0.0, angle.sin())
}

/// Outward normal of the face towards −x.
fn face() -> DVec3 {
    towards(std::f64::consts::PI + APEX / 2.0)
}

/// Direction, as an angle from +x towards +z, of a ray that meets that face at this angle of incidence, coming from the
/// side of the base.
fn heading(incidence: f64) -> f64 {
    APEX / 2.0 - incidence
}

/// Deviation of a ray by a prism in air, from the angle of incidence (any textbook, as Born and Wolf, §4.7.2).
fn deviation(angle: f64, n: f64) -> f64 {
    let sin = angle.sin();
    angle + (APEX.sin() * (n * n - sin * sin).sqrt() - APEX.cos() * sin).asin() - APEX
}

/// Where each of the four wavelengths leaves a prism of side 1 that is met in the middle of a face: vectors through the
/// scene and its materials, against the formula, near the angle of least deviation and away from it.
#[test]
fn every_wavelength_obeys_snells_law() {
    let scene = prepare(&prism(1.0));
    let middle = face() / (2.0 * 3f64.sqrt());
    for u in [0.0, 0.06, 0.11, 0.2, 0.249] {
        let lambda = SampledWavelengths::sample(u);
        for lane in 0..4 {
            let n = index(f64::from(lambda.lambda()[lane]));
            let least = 2.0 * (n * (APEX / 2.0).sin()).asin() - APEX;
            let best = (least + APEX) / 2.0;
            assert!((deviation(best, n) - least).abs() < 1e-12, "the formula");
            let mut found = Vec::new();
            for step in -8..=8 {
                let incidence = best + f64::from(step) * 0.01;
                let d = towards(heading(incidence));
                let mut ray = Ray::new((middle - d * 3.0).as_vec3(), d.as_vec3());
                for _ in 0..2 {
                    let hit = scene.closest(&ray).expect("the prism");
                    let surface = scene.surface_material(&hit);
                    let bsdf = surface.bsdf::<Bsdf>(&lambda);
                    assert!(bsdf.is_delta() && bsdf.is_dispersive());
                    let (wi, _) =
                        bsdf.refract(surface.frame.to_local(hit.wo), lane).expect("no total reflection");
                    ray = hit.spawn(surface.frame.to_world(wi));
                }
                let cos = ray.direction.as_dvec3().normalize().dot(d).clamp(-1.0, 1.0);
                found.push(cos.acos());
                let exact = deviation(incidence, n);
                assert!((cos.acos() - exact).abs() < 4e-6, "{lambda:?} {step}: {} {exact}", cos.acos());
            }
            let smallest = found.iter().copied().fold(f64::MAX, f64::min);
            assert!((smallest - least).abs() < 3e-6, "{smallest} {least}");
            assert!(found[0] > smallest + 2e-3 && found[16] > smallest + 2e-3, "{found:?}");
        }
    }
}

const COLUMNS: usize = 32;
/// Angle of incidence in the middle of the picture, and width of the lamp as an angle.
const INCIDENCE: f64 = 1.105;
const LAMP: f64 = 0.007;

/// Where the lamp is, as an angle: what the middle of the picture shows at 560 nm.
fn lamp_angle() -> f64 {
    heading(INCIDENCE) + deviation(INCIDENCE, index(560.0))
}

/// A row of pixels that looks through the prism at a bright strip as good as infinitely far away.
fn spectroscope() -> SceneDesc {
    let mut desc = prism(6.0);
    let frame = |z: DVec3| DMat3::from_cols(DVec3::Y.cross(z), DVec3::Y, z);
    let along = towards(heading(INCIDENCE));
    let middle = face() * (6.0 / (2.0 * 3f64.sqrt()));
    desc.camera = look(DVec3::ZERO, DVec3::Z, 13.0);
    desc.camera.to_world = DAffine3::from_mat3_translation(frame(along), middle - along * 4.0);
    (desc.film.width, desc.film.height) = (COLUMNS as u32, 1);
    let black = material(&mut desc, grey(0.0));
    let (far, out) = (1e5, towards(lamp_angle()));
    let size = DVec3::new(far * (LAMP / 2.0).tan(), far * 0.02, 1.0);
    let at = DAffine3::from_mat3_translation(frame(-out), out * far) * DAffine3::from_scale(size);
    shape(&mut desc, ShapeKind::Rectangle, at, black, 10.0);
    // Two refractions and the lamp: no light that was reflected within.
    desc.integrator.max_depth = Some(3);
    desc
}

/// The picture by integration over wavelengths and pixels.
fn reference(camera: &Camera) -> Vec<[f64; 3]> {
    let rows = cie::Rows::get();
    let through =
        |cos: f64, n: f64| 1.0 - f64::from(fresnel::dielectric(cos as f32, Vec4::splat(n as f32)).x);
    let step = 0.1;
    let spectrum: Vec<_> = (0..4010)
        .map(|i| 379.55 + f64::from(i) * step)
        .map(|lambda| (index(lambda), rows.at(lambda as f32)))
        .collect();
    const FINE: usize = 24;
    let at = |x: f64| {
        let d = camera.ray([x, 0.5], [0.5; 2]).unwrap().direction.as_dvec3();
        let angle = d.z.atan2(d.x);
        let incidence = APEX / 2.0 - angle;
        let mut sum = [0.0; 3];
        for (n, row) in &spectrum {
            if (angle + deviation(incidence, *n) - lamp_angle()).abs() < LAMP / 2.0 {
                let first = (incidence.sin() / n).asin();
                let t = through(incidence.cos(), *n) * through((APEX - first).cos(), 1.0 / n);
                (0..3).for_each(|k| sum[k] += 10.0 * t * step * f64::from(row[k]) / FINE as f64);
            }
        }
        sum
    };
    let column = |c: usize| {
        let parts = (0..FINE).map(|i| at((c as f64 + (i as f64 + 0.5) / FINE as f64) / COLUMNS as f64));
        parts.fold([0.0; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]])
    };
    (0..COLUMNS).map(column).collect()
}

/// Sums of XYZ and weight per column.
struct Row(Vec<[f64; 4]>);

impl SampleSink for Row {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        let sum = &mut self.0[((uv[0] * COLUMNS as f32) as usize).min(COLUMNS - 1)];
        for (s, v) in sum.iter_mut().zip([value.x, value.y, value.z, weight]) {
            *s += f64::from(v);
        }
    }
    fn light(&mut self, _: [f32; 2], _: Xyz) {}
}

fn render<I: Integrator>(tracer: &I, paths: u64) -> Vec<[f64; 3]> {
    let mut row = Row(vec![[0.0; 4]; COLUMNS]);
    let mut scratch = I::Scratch::default();
    let PathCounts { camera, .. } = tracer.paths_per_index();
    (0..paths / camera).for_each(|i| tracer.trace(i, &mut scratch, &mut row));
    row.0.iter().map(|[x, y, z, w]| [x / w, y / w, z / w]).collect()
}

/// The pictures have the reference as their mean, in every column and of all three values; what remains has no period, and
/// the hue runs one way from red to violet.
fn assert_spectrum(name: &str, pictures: &[Vec<[f64; 3]>], exact: &[[f64; 3]]) {
    let r = pictures.len() as f64;
    let most = exact.iter().map(|v| v[1]).fold(0.0, f64::max);
    let mut hues = Vec::new();
    for k in 0..3 {
        let (mut z, mut total, mut expected, mut noise) = (Vec::new(), 0.0, 0.0, 0.0);
        for c in 0..COLUMNS {
            let mean = pictures.iter().map(|p| p[c][k]).sum::<f64>() / r;
            let variance = pictures.iter().map(|p| (p[c][k] - mean).powi(2)).sum::<f64>() / (r - 1.0) / r;
            (total, expected, noise) = (total + mean, expected + exact[c][k], noise + variance);
            // Where next to nothing is expected a few paths are no normal distribution.
            if exact[c][k] > 0.02 * most {
                z.push((mean - exact[c][k]) / variance.sqrt());
                assert!(variance.sqrt() < 0.05 * exact[c][k], "{name} {c}: too much noise to tell");
            }
        }
        let n = z.len() as f64;
        let mean_z2 = z.iter().map(|z| z * z).sum::<f64>() / n;
        let largest = z.iter().fold(0f64, |a, z| a.max(z.abs()));
        let power = |f: usize| {
            let (mut c, mut s) = (0.0, 0.0);
            for (i, z) in z.iter().enumerate() {
                let (sin, cos) = (std::f64::consts::TAU * f as f64 * i as f64 / n).sin_cos();
                (c, s) = (c + z * cos, s + z * sin);
            }
            (c * c + s * s) / (n * mean_z2)
        };
        let peak = (1..z.len() / 2).map(power).fold(0.0, f64::max);
        println!(
            "{name} {k}: {n} columns, ratio {:.5} ± {:.5}, mean z² {mean_z2:.2}, largest {largest:.2}, peak {peak:.2}",
            total / expected,
            noise.sqrt() / expected
        );
        // Columns are correlated: paths that one has too many of, its neighbour lacks, so this noise is an upper bound.
        assert!(
            (total - expected).abs() < 4.0 * noise.sqrt() && noise.sqrt() < 5e-3 * expected,
            "{name} {k}"
        );
        assert!(mean_z2 < 2.2 && largest < 5.0, "{name} {k}: {z:?}");
        // Powers of noise are distributed exponentially with mean 1: one above 9 in 8000.
        assert!(peak < 9.0 && z.len() > 12, "{name} {k}: a period in {z:?}");
    }
    for c in 0..COLUMNS {
        let [x, y, z] = [0, 1, 2].map(|k| pictures.iter().map(|p| p[c][k]).sum::<f64>());
        if exact[c][1] > 0.02 * most {
            let sum = x + y + z;
            let hue = (y / sum - 1.0 / 3.0).atan2(x / sum - 1.0 / 3.0);
            hues.push(if hue < -1.2 { hue + std::f64::consts::TAU } else { hue });
        }
    }
    // From the violet at 4 rad over blue, green and yellow to the red at −0.1.
    let (up, down) = (hues.windows(2).all(|w| w[0] < w[1]), hues.windows(2).all(|w| w[0] > w[1]));
    let range = (hues[0] - hues[hues.len() - 1]).abs();
    println!("{name}: hues {hues:.2?}");
    assert!((up || down) && range > 3.5, "{name}: {hues:?}");
}

#[test]
fn the_spectrum_is_the_integral_over_wavelengths() {
    let desc = spectroscope();
    let scene = Arc::new(Scene::prepare(&desc).expect("valid"));
    let camera = Camera::of(&desc).expect("valid");
    let exact = reference(&camera);
    let context =
        |seed| RenderContext::new(scene.clone(), camera.clone(), &desc.integrator, seed, UvWindow::PICTURE);
    let path = |seed| PathTracer { context: context(seed) };
    let paths = COLUMNS as u64 * 4096;
    let pictures: Vec<_> = (0..16).map(|seed| render(&path(seed), paths)).collect();
    assert_spectrum("path", &pictures, &exact);
    let both = |seed| render(&BidirectionalTracer { context: context(seed) }, paths * 4);
    let pictures: Vec<_> = (100..116).map(both).collect();
    assert_spectrum("bidirectional", &pictures, &exact);
}
