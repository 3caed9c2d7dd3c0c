//! Additional EXR layers (`--aov`), rendered in a separate pass after the picture with the same camera and filter.
//!
//! Each pixel is the filtered mean over its camera rays. Rays are jittered within a fixed grid per pixel, so that the
//! layers are the same in every run.

use std::ops::Range;

use miette::Result;
use rayon::prelude::*;

use crate::client::FilmSpec;
use crate::image::exr::Channel;
use crate::image::stereo::Eye;
use crate::math::random::Random;
use crate::render::process::tell;
use crate::render::run_spec::RunSpec;
use crate::scene::desc::aov::{AovDesc, AovKind, channel_count};
use crate::scene::limits;
use crate::tracer::aov::AovTracer;
use crate::tracer::{Camera, Scene};

/// Least and greatest number of rays per pixel along each axis.
const SIDE: [f64; 2] = [4.0, 8.0];

/// Rows of pixels per work item.
const BAND: u32 = 16;

/// Layers of at least this many bytes are reported.
const WORTH_TELLING: u64 = 1 << 29;

/// Increments of the R2 sequence (Roberts 2018) for points on the lens.
const R2: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];

/// Refuses layers that need two eyes where there is one.
pub fn check_eyes(layers: &[AovDesc], has_two: bool) -> Result<()> {
    match layers.iter().find(|layer| layer.kind == AovKind::Disparity) {
        Some(layer) if !has_two => Err(miette::miette!(
            help = "render with --stereo, or leave the layer away: --aov LIST has others than the scene asks for",
            "the layer `{layer}` is the disparity between the pictures of two eyes, and there is one"
        )),
        _ => Ok(()),
    }
}

/// Checks that the layers fit into memory, and reports large ones.
pub fn check(layers: &[AovDesc], film: &FilmSpec) -> Result<()> {
    let (channels, pixels) = (channel_count(layers) as u64, u64::from(film.width) * u64::from(film.height));
    let bytes = 4 * channels * pixels;
    let size = || {
        format!(
            "{channels} channels of {}×{} pixels take {:.1} GB",
            film.width,
            film.height,
            bytes as f64 / 1e9
        )
    };
    if bytes > limits::AOV_BYTES {
        return Err(miette::miette!(
            help = "ask for fewer layers with --aov, or for a smaller picture with --size",
            "the layers beside the picture are too large: {}",
            size()
        ));
    }
    if bytes > WORTH_TELLING {
        tell(&format!("note: the layers beside the picture are large: {}", size()));
    }
    Ok(())
}

/// Renders the requested layers; `spp`: samples per pixel of the picture.
pub fn trace(run: &RunSpec, scene: &Scene, camera: &Camera, spp: f64) -> Vec<Channel> {
    trace_seen(run, scene, camera, spp, None)
}

/// As [`trace`], for an eye of a render for two, with the cameras of the left and of the right eye.
pub fn trace_eye(run: &RunSpec, scene: &Scene, eye: Eye, cameras: [&Camera; 2], spp: f64) -> Vec<Channel> {
    trace_seen(run, scene, cameras[eye as usize], spp, Some((eye, cameras)))
}

fn trace_seen(
    run: &RunSpec,
    scene: &Scene,
    camera: &Camera,
    spp: f64,
    eyes: Option<(Eye, [&Camera; 2])>,
) -> Vec<Channel> {
    if run.aovs.is_empty() {
        return Vec::new();
    }
    let tracer = AovTracer::new(scene, camera, &run.aovs);
    let tracer = match eyes {
        Some((_, cameras)) => tracer.with_eyes(cameras, run.film.width),
        None => tracer,
    };
    let pass = LayerPass {
        tracer,
        camera,
        film: &run.film,
        channels: channel_count(&run.aovs),
        side: spp.sqrt().ceil().clamp(SIDE[0], SIDE[1]) as u32,
    };
    let bands: Vec<u32> = (0..run.film.height).step_by(BAND as usize).collect();
    let bands: Vec<Vec<f32>> =
        bands.into_par_iter().map(|y| pass.band(y..(y + BAND).min(run.film.height))).collect();
    let names = run.aovs.iter().flat_map(|layer| layer.channels_of(eyes.map(|(eye, _)| eye)));
    let of =
        |c: usize| bands.iter().flat_map(move |band| band.iter().skip(c).step_by(pass.channels).copied());
    names.enumerate().map(|(c, name)| (name, of(c).collect())).collect()
}

/// Inputs of every band.
struct LayerPass<'a> {
    tracer: AovTracer<'a>,
    camera: &'a Camera,
    film: &'a FilmSpec,
    channels: usize,
    /// Rays per pixel along each axis.
    side: u32,
}

impl LayerPass<'_> {
    /// Pixels of these rows, `[row][width][channel]`. Traces the surrounding rows within the filter's reach too.
    fn band(&self, rows: Range<u32>) -> Vec<f32> {
        let FilmSpec { width, filter, .. } = *self.film;
        let (pad, pixels) = (self.film.pad(), ((rows.end - rows.start) * width) as usize);
        let (mut sums, mut weights) = (vec![0.0; pixels * self.channels], vec![0.0f32; pixels]);
        let mut values = vec![0.0f32; self.channels];
        // Positions are relative to the corner of the padding.
        for y in rows.start..rows.end + 2 * pad {
            for x in 0..width + 2 * pad {
                let mut random = Random(u64::from(y) << 32 | u64::from(x));
                let turn = [random.f64(), random.f64()];
                for i in 0..self.side * self.side {
                    let cell = [i % self.side, i / self.side];
                    let at = [0, 1].map(|k| {
                        f64::from([x, y][k]) + (f64::from(cell[k]) + random.f64()) / f64::from(self.side)
                    });
                    let lens = [0, 1].map(|k| ((turn[k] + f64::from(i) * R2[k]).fract() as f32).min(LAST));
                    match self.camera.ray(self.uv(at), lens) {
                        Some(ray) => self.tracer.along(&ray, &mut values),
                        None => values.fill(0.0),
                    }
                    let [across, down] = at.map(|p| filter.taps(p as f32));
                    for (j, weight_y) in down.weights.into_iter().enumerate() {
                        let row = i64::from(down.first) + j as i64 - i64::from(pad) - i64::from(rows.start);
                        for (k, weight_x) in across.weights.into_iter().enumerate() {
                            let column = i64::from(across.first) + k as i64 - i64::from(pad);
                            let inside = (0..i64::from(rows.end - rows.start)).contains(&row)
                                && (0..i64::from(width)).contains(&column);
                            let weight = weight_x * weight_y;
                            if !inside || weight == 0.0 {
                                continue;
                            }
                            let pixel = row as usize * width as usize + column as usize;
                            weights[pixel] += weight;
                            let sums = &mut sums[pixel * self.channels..][..self.channels];
                            sums.iter_mut().zip(&values).for_each(|(sum, value)| *sum += weight * value);
                        }
                    }
                }
            }
        }
        for (sums, weight) in sums.chunks_mut(self.channels).zip(weights) {
            // A narrow filter may have missed every ray.
            sums.iter_mut().for_each(|sum| *sum /= weight.max(f32::MIN_POSITIVE));
        }
        sums
    }

    /// Screen position of a point in padded pixels.
    fn uv(&self, at: [f64; 2]) -> [f64; 2] {
        let pad = f64::from(self.film.pad());
        [(at[0] - pad) / f64::from(self.film.width), (at[1] - pad) / f64::from(self.film.height)]
    }
}

/// The largest number below 1.
const LAST: f32 = 1.0 - f32::EPSILON / 2.0;
