//! The reference of a study, and the errors of pictures against it.

use std::path::Path;

use miette::{IntoDiagnostic, Result};

use super::folder::StudyFolder;
use super::pictures::{difference, linear, uri};
use super::renderer::{RenderLimit, StudyRender, StudyRenderer};
use super::unbiased;
use crate::app::run_spec::{RunEnd, RunSpec};
use crate::client::develop;
use crate::image::Grid;
use crate::image::compare::{Picture, luminance, rel_mse, smape};
use crate::image::exr;
use crate::stream::Cause;
use crate::study::data::ReferenceImage;
use crate::study::measurement::{Measurement, REGIONS, RenderMeasurement};
use crate::study::{ErrorField, Interval, TileSubset};

/// The reference picture with what is needed to compare with it.
pub struct ReferencePicture {
    rgb: Grid<[f32; 3]>,
    /// As displayed, linear.
    pub shown: Grid<[f32; 3]>,
    /// Its own relMSE, 0 if unknown.
    own: f64,
    relative: [f64; 3],
    mean: f64,
    /// Seconds of the longest render whose error it can measure.
    pub longest: f64,
}

/// Least ratio of the reference's render time to that of a picture.
const LONGER: f64 = 2.5;

const FILE: &str = "reference.exr";

impl ReferencePicture {
    /// Finds the reference: the given picture, or that of an earlier run unless `seconds` are much more than it took, or one that is
    /// rendered now for `seconds`. Measurements against another reference are discarded.
    pub fn find(
        renderer: &mut StudyRenderer,
        folder: &mut StudyFolder,
        given: Option<&Path>,
        seconds: f64,
    ) -> Result<Self> {
        let known = folder.measurements.iter().rev().find_map(|measured| match measured {
            Measurement::Reference(reference) => Some(reference.clone()),
            _ => None,
        });
        let given = given.map(|file| std::path::absolute(file).unwrap_or(file.to_path_buf()));
        let same = |reference: &ReferenceImage| match &given {
            Some(given) => reference.file == given.display().to_string(),
            // A much longer one allows longer pictures.
            None => reference.seconds * LONGER >= seconds,
        };
        if let Some(reference) = known.filter(same)
            && folder.file(&reference.file).exists()
        {
            return Self::read(renderer, &folder.file(&reference.file), &reference);
        }
        let reference = match &given {
            Some(file) => {
                let [file, made_by] = [file.display().to_string(), "given".to_string()];
                ReferenceImage { file, made_by, ..ReferenceImage::default() }
            }
            None => render(renderer, folder, seconds)?,
        };
        let prepared = Self::read(renderer, &folder.file(&reference.file), &reference)?;
        let picture = uri(&prepared.shown).unwrap_or_default();
        folder.keep(Measurement::Reference(ReferenceImage { picture, ..reference }))?;
        Ok(prepared)
    }

    fn read(renderer: &StudyRenderer, file: &Path, reference: &ReferenceImage) -> Result<Self> {
        let rgb = Picture::read(file, None).into_diagnostic()?.rgb;
        let wanted = (renderer.run.film.width as usize, renderer.run.film.height as usize);
        let name = file.display();
        let (width, height) = (rgb.width(), rgb.height());
        miette::ensure!(
            (width, height) == wanted,
            help = "give --size, or another reference",
            "{name} has {width}×{height} pixels, the picture {}×{}",
            wanted.0,
            wanted.1
        );
        if let Some(i) = rgb.pixels().iter().position(|rgb| !rgb.iter().all(|c| c.is_finite())) {
            let (x, y, pixel) = (i % width, i / width, rgb.pixels()[i]);
            miette::bail!(help = "give another reference", "{name}: pixel {x}, {y} is not finite: {pixel:?}");
        }
        Ok(Self {
            shown: develop::shown(&rgb, &renderer.settings),
            own: reference.rel_mse.unwrap_or(0.0),
            relative: reference.relative,
            mean: mean_luminance(&rgb),
            longest: if reference.seconds > 0.0 { reference.seconds / LONGER } else { f64::INFINITY },
            rgb,
        })
    }

    /// Measures the errors of a picture: everything of a [`RenderMeasurement`] that follows from its pixels.
    pub fn judge(&self, rgb: &Grid<[f32; 3]>, shown: &Grid<[f32; 3]>) -> Result<RenderMeasurement> {
        let error = rel_mse(rgb, &self.rgb).into_diagnostic()?;
        let size = [rgb.width(), rgb.height()];
        let field = ErrorField::against(rgb.pixels(), self.rgb.pixels(), size);
        let figures = field.as_ref().map(|field| field.estimate(TileSubset::All)).unwrap_or_default();
        // The error of the reference itself is subtracted, but never more than half.
        let off = |value: f64, own: f64| (value - own).max(0.5 * value);
        let squared = |i: usize| figures.relative[i].map(|e| off(e * e, self.relative[i].powi(2)).sqrt());
        let (flip, error_map) = difference(shown, &self.shown);
        let whole = off(error.whole, self.own);
        let spread = |interval: Interval| match interval.value > 0.0 {
            true => interval.map(|x| x / interval.value * whole),
            false => Interval::exact(whole),
        };
        Ok(RenderMeasurement {
            rel_mse: spread(figures.rel_mse),
            trimmed: off(error.trimmed, self.own),
            relative: [0, 1, 2].map(squared),
            smape: smape(rgb, &self.rgb).into_diagnostic()?.mean,
            flip,
            energy: mean_luminance(rgb) / self.mean.max(1e-30),
            regions: field.map(|field| field.coarse(REGIONS)).unwrap_or_default(),
            picture: uri(shown),
            error_map,
            ..RenderMeasurement::default()
        })
    }

    /// Measures the errors of a render and adds its times, samples and predictions.
    pub fn judge_run(
        &self,
        renderer: &StudyRenderer,
        run: &RunSpec,
        traced: &StudyRender,
        budget: f64,
    ) -> Result<RenderMeasurement> {
        let shown = linear(&traced.shown, &renderer.settings);
        let (total, paths) = (traced.stats.total(), traced.data.counts.paths());
        let size = [self.rgb.width(), self.rgb.height()];
        let noise = ErrorField::noise(&traced.pixels, self.rgb.pixels(), size);
        let filtered = renderer.filtered(traced)?.map(|shown| linear(&shown, &renderer.settings));
        let rejections = total.rejections;
        let rejected = |cause: Cause| {
            let example = rejections.examples().iter().find(|example| example.fault.cause == cause);
            let command = example.map(|example| run.replay(example)).unwrap_or_default();
            (cause.describe().to_string(), rejections.count(cause), command)
        };
        Ok(RenderMeasurement {
            method: run.integrator.name().to_string(),
            budget,
            seed: run.seed,
            seconds: traced.driven.wall.as_secs_f64(),
            trace_seconds: total.cpu.unwrap_or(total.busy).as_secs_f64(),
            splat_seconds: traced.driven.rasterise.as_secs_f64(),
            display_seconds: traced.display_seconds,
            samples_per_pixel: paths as f64 / renderer.texels(),
            paths,
            flip_filtered: filtered.map(|shown| difference(&shown, &self.shown).0),
            noise: noise.map(|field| field.estimate(TileSubset::All).rel_mse),
            stated: traced.estimate().map(|estimate| estimate.relative),
            rejected: Cause::ALL.into_iter().map(rejected).filter(|(_, count, _)| *count > 0).collect(),
            predictions: traced.predictions.clone(),
            ..self.judge(&traced.rgb, &shown)?
        })
    }
}

fn mean_luminance(rgb: &Grid<[f32; 3]>) -> f64 {
    rgb.pixels().iter().map(|&rgb| luminance(rgb)).sum::<f64>() / rgb.pixels().len().max(1) as f64
}

/// Renders a reference by the unbiased method that suits the scene.
fn render(renderer: &mut StudyRenderer, folder: &StudyFolder, seconds: f64) -> Result<ReferenceImage> {
    let run = RunSpec { seed: SEED, ..unbiased(renderer) };
    let traced = renderer.trace(&run, RenderLimit::Time(std::time::Duration::from_secs_f64(seconds)))?;
    miette::ensure!(
        !traced.driven.interrupted && !traced.state.checkpoints.is_empty(),
        help = "give more --budget, a smaller --size, or a picture with --against",
        "the reference needs more time: too little of it was rendered to be compared with"
    );
    let file = folder.file(FILE);
    let mut layers = exr::Layers {
        width: traced.rgb.width(),
        height: traced.rgb.height(),
        attributes: run.attributes(traced.data.counts.paths(), &RunEnd::default()),
        ..exr::Layers::default()
    };
    for (i, name) in ["R", "G", "B"].into_iter().enumerate() {
        layers.push(name, traced.rgb.pixels().iter().map(|rgb| rgb[i]));
    }
    exr::write(&file, &layers).into_diagnostic()?;
    Ok(ReferenceImage {
        file: FILE.to_string(),
        made_by: run.integrator.name().to_string(),
        seconds: traced.driven.wall.as_secs_f64(),
        samples_per_pixel: traced.data.counts.paths() as f64 / renderer.texels(),
        rel_mse: Some(traced.state.estimate.rel_mse.value),
        relative: traced.state.estimate.relative.map(|i| i.value),
        picture: String::new(),
    })
}

/// Seed of references: no run has it.
const SEED: u32 = 0x5eed;
