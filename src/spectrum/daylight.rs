//! Daylight: the radiance of a clear sky and of the sun in it.
//!
//! The sky is that of Hošek and Wilkie, *An Analytic Model for Full Spectral Sky-Dome Radiance*, SIGGRAPH 2012, by its spectral
//! tables; the sun that of Hošek and Wilkie, *Adding a Solar-Radiance Function to the Hošek-Wilkie Skylight Model*,
//! IEEE CG&A 33(3), 2013. Both are in W / (m² sr nm), and so are those of Mitsuba's `sunsky`.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::LazyLock;

use glam::{DVec3, Vec4};

use super::Spectrum;

/// Angle under which the sun is seen, in degrees.
pub const SUN_APERTURE: f64 = 0.5358;

/// Least and greatest turbidity of the model.
pub const TURBIDITY: [f64; 2] = [1.0, 10.0];

/// Columns of the picture of the sky, and its rows from pole to pole, of which the middle one is the horizon.
pub const SKY_SIZE: [usize; 2] = [512, 257];

/// Wavelengths of the tables: 320, 360, … 720 nm.
const WAVELENGTHS: usize = 11;

fn wavelength(i: usize) -> f32 {
    320.0 + 40.0 * i as f32
}

/// Numbers of the model of the sky for one wavelength: the coefficients A to I, and the mean radiance.
const COEFFICIENTS: usize = 10;

/// Control points over the elevation of the sun.
const CONTROLS: usize = 6;

/// Numbers of the sky, `[turbidity 1 … 10][albedo 0, 1][control point][wavelength][coefficient]`, single precision, little endian.
/// Licence: `sky.LICENSE`.
static SKY: &[u8] = include_bytes!("sky.bin");

/// The numbers of the model at one wavelength; a ground of this albedo.
fn coefficients(turbidity: f64, albedo: f64, elevation: f64, wavelength: usize) -> [f64; COEFFICIENTS] {
    let t = (elevation / FRAC_PI_2).cbrt();
    // Bernstein's polynomials of degree 5.
    let bernstein = |k: usize| {
        [1.0, 5.0, 10.0, 10.0, 5.0, 1.0][k] * t.powi(k as i32) * (1.0 - t).powi((CONTROLS - 1 - k) as i32)
    };
    let turbid = turbidity - TURBIDITY[0];
    let first = (turbid as usize).min(8);
    let share = turbid - first as f64;
    let mut sum = [0.0; COEFFICIENTS];
    for (row, by_row) in [(first, 1.0 - share), (first + 1, share)] {
        for (ground, by_ground) in [(0, 1.0 - albedo), (1, albedo)] {
            for k in 0..CONTROLS {
                let at = ((row * 2 + ground) * CONTROLS + k) * WAVELENGTHS + wavelength;
                let numbers = SKY[at * COEFFICIENTS * 4..].chunks_exact(4);
                for (sum, bytes) in sum.iter_mut().zip(numbers) {
                    let value = f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
                    *sum += by_row * by_ground * bernstein(k) * f64::from(value);
                }
            }
        }
    }
    sum
}

/// Linear Rec.709 of the sky in rows of [`SKY_SIZE`] texels from the zenith, black below the horizon; the sun stands `elevation`
/// above the middle of the picture, in radians, and the ground reflects `albedo`. Of an environment's nodes: the first and last
/// row are the poles. `None` where the model has no such sky.
pub fn sky(turbidity: f64, albedo: &Spectrum, elevation: f64) -> Option<Vec<[f32; 3]>> {
    if !(TURBIDITY[0]..=TURBIDITY[1]).contains(&turbidity) || !elevation.is_finite() {
        return None;
    }
    let elevation = elevation.clamp(0.0, FRAC_PI_2);
    // Radiance is linear between its wavelengths, so that its colour is a sum over them.
    let at = |i: usize| {
        let around = [i.checked_sub(1), Some(i), Some(i + 1).filter(|i| *i < WAVELENGTHS)];
        let hat: Vec<_> = around.into_iter().flatten().map(|j| (wavelength(j), f32::from(i == j))).collect();
        let ground = f64::from(albedo.eval(Vec4::splat(wavelength(i))).x).clamp(0.0, 1.0);
        let color = Spectrum::table(&hat)?.emitted_rgb();
        Some((coefficients(turbidity, ground, elevation, i), color))
    };
    let model = (0..WAVELENGTHS).map(at).collect::<Option<Vec<_>>>()?;
    let [width, height] = SKY_SIZE;
    let (sun_sin, sun_cos) = elevation.sin_cos();
    let texel = |i: usize| {
        let (x, y) = (i % width, i / width);
        if y > height / 2 {
            return [0.0; 3];
        }
        let theta = PI * y as f64 / (height - 1) as f64;
        let azimuth = TAU * ((x as f64 + 0.5) / width as f64 - 0.5);
        // The angle to the sun by its half chord, which is accurate near the sun.
        let d = DVec3::new(theta.sin() * azimuth.sin(), theta.cos(), theta.sin() * azimuth.cos());
        let gamma = 2.0 * (0.5 * d.distance(DVec3::new(0.0, sun_sin, sun_cos))).min(1.0).asin();
        let mut rgb = [0.0f32; 3];
        for (coefficients, color) in &model {
            let value = radiance(coefficients, theta.cos().max(0.0), gamma).max(0.0) as f32;
            rgb = [0, 1, 2].map(|c| rgb[c] + value * color[c]);
        }
        rgb.map(|v| v.max(0.0))
    };
    Some((0..width * height).map(texel).collect())
}

/// Radiance at the angle `gamma` from the sun and the cosine `cos` to the zenith (Hošek and Wilkie 2012, eq. 8 and 9).
fn radiance([a, b, c, d, e, f, g, h, i, mean]: &[f64; COEFFICIENTS], cos: f64, gamma: f64) -> f64 {
    let cos_gamma = gamma.cos();
    let mie = (1.0 + cos_gamma * cos_gamma) / (1.0 + i * i - 2.0 * i * cos_gamma).powf(1.5);
    let around_the_sun = c + d * (e * gamma).exp() + f * cos_gamma * cos_gamma + g * mie + h * cos.sqrt();
    mean * (1.0 + a * (b / (cos + 0.01)).exp()) * around_the_sun
}

/// Pieces between the elevations of the table.
const ELEVATIONS: usize = 24;

/// The rows of the table.
static SUN: LazyLock<Vec<[f32; WAVELENGTHS]>> = LazyLock::new(|| {
    let lines = include_str!("sun.csv").lines().filter(|line| !line.starts_with('#'));
    let row = |line: &str| {
        let mut values = line.split(',').map(|v| v.parse().expect("the table holds numbers"));
        [(); WAVELENGTHS].map(|()| values.next().expect("a value for each wavelength"))
    };
    lines.map(row).collect()
});

/// Radiance of the disc of the sun, even over all of it, at `elevation` in radians.
pub fn sun(turbidity: f64, elevation: f64) -> Spectrum {
    let piece = |at: f64, pieces: usize| {
        let first = (at.max(0.0) as usize).min(pieces - 1);
        (first, (at - first as f64).clamp(0.0, 1.0) as f32)
    };
    let (t, turbid) = piece(turbidity - TURBIDITY[0], 9);
    let (e, high) = piece((elevation.max(0.0) / FRAC_PI_2).cbrt() * ELEVATIONS as f64, ELEVATIONS);
    let at = |t: usize, e: usize, i: usize| SUN[t * (ELEVATIONS + 1) + e][i];
    let mix = |a: f32, b: f32, s: f32| a + (b - a) * s;
    let point = |i: usize| {
        let [low, up] = [e, e + 1].map(|e| mix(at(t, e, i), at(t + 1, e, i), turbid));
        (wavelength(i), mix(low, up, high))
    };
    let points: Vec<_> = (0..WAVELENGTHS).map(point).collect();
    Spectrum::table(&points).unwrap_or(Spectrum::Constant(0.0))
}

/// A date and a time, by the clock of a time zone.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs, reason = "the names are those of the calendar")]
pub struct DateTime {
    pub year: i32,
    pub month: i32,
    pub day: i32,
    pub hour: f64,
    pub minute: f64,
    pub second: f64,
    /// Hours ahead of universal time.
    pub timezone: f64,
}

/// Where the sun stands at this time for an observer at this latitude and longitude in degrees: north of the equator and east of
/// Greenwich are positive. Its elevation, and its azimuth from north by east, in radians.
///
/// Blanco-Muriel, Alarcón-Padilla, López-Moratalla, Lara-Coira, *Computing the Solar Vector*, Solar Energy 70(5), 2001.
pub fn solar_position(time: &DateTime, [latitude, longitude]: [f64; 2]) -> [f64; 2] {
    let DateTime { year, month, day, hour, minute, second, timezone } = *time;
    let hours = hour - timezone + (minute + second / 60.0) / 60.0;
    // The number of the Julian day by whole numbers (Fliegel and Van Flandern, CACM 11(10), 1968).
    let winter = (month - 14) / 12;
    let julian = 1461 * (year + 4800 + winter) / 4 + 367 * (month - 2 - 12 * winter) / 12
        - 3 * ((year + 4900 + winter) / 100) / 4
        + day
        - 32_075;
    // Days since noon of the first of January 2000.
    let days = f64::from(julian) - 0.5 + hours / 24.0 - 2_451_545.0;
    let node = 2.1429 - 0.001_039_459_4 * days;
    let anomaly = 6.240_060_0 + 0.017_201_969_9 * days;
    let longitude_of_sun = 4.895_063_0
        + 0.017_202_791_698 * days
        + 0.033_416_07 * anomaly.sin()
        + 0.000_348_94 * (2.0 * anomaly).sin()
        - 0.000_113_4
        - 0.000_020_3 * node.sin();
    let obliquity = 0.409_092_8 - 6.2140e-9 * days + 0.000_039_6 * node.cos();
    let (sin, cos) = longitude_of_sun.sin_cos();
    let right_ascension = (obliquity.cos() * sin).atan2(cos);
    let declination = (obliquity.sin() * sin).asin();
    let sidereal = 6.697_424_324_2 + 0.065_709_828_3 * days + hours;
    let hour_angle = (15.0 * sidereal + longitude).to_radians() - right_ascension;
    let (latitude_sin, latitude_cos) = latitude.to_radians().sin_cos();
    let zenith =
        (latitude_cos * hour_angle.cos() * declination.cos() + declination.sin() * latitude_sin).acos();
    let azimuth =
        (-hour_angle.sin()).atan2(declination.tan() * latitude_cos - latitude_sin * hour_angle.cos());
    // Radius of the earth over its distance from the sun.
    let parallax = 6_371.01 / 149_597_890.0 * zenith.sin();
    [FRAC_PI_2 - zenith - parallax, azimuth]
}
