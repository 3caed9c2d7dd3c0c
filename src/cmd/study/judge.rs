//! Errors of a study's pictures against a reference, which is pooled from all of them or given.

use std::path::Path;

use miette::{IntoDiagnostic, Result};

use crate::client::{DisplayImage, FilmSpec, develop};
use crate::cmd::study::folder::StudyFolder;
use crate::cmd::study::pictures::{difference, linear, uri};
use crate::cmd::study::pools::{self, Pools};
use crate::cmd::study::renderer::{StudyRender, StudyRenderer};
use crate::image::Grid;
use crate::image::compare::{Picture, luminance, rel_mse, smape};
use crate::render::run_spec::RunSpec;
use crate::stream::Cause;
use crate::study::data::ReferenceImage;
use crate::study::error::ErrorEstimate;
use crate::study::error_tile::ReplicatePixel;
use crate::study::measurement::{FIGURES, Measurement, REGIONS, RenderMeasurement};
use crate::study::pool::{LACKING, NoisyPixel, PooledPicture, ReferencePool, error_against, own_error};
use crate::study::{ErrorField, Interval, TileSubset};

/// The difference of a picture to the reference is used as its error if it exceeds the reference's own error by this factor. Below, the
/// estimate from its replicates is more precise.
const CLEAR: f64 = 2.0;

/// Least samples per pixel of a picture whose linear error is used.
const LEAST_SAMPLES: f64 = 1.0;

/// Least seconds of a picture whose error map is kept; the page shows the longest.
const SHOWN: f64 = 0.3;

/// Memory limit, in bytes, of pictures kept to be judged again at the end.
const STASH: usize = 1 << 30;

/// Judges the pictures of a study.
pub struct Judge {
    /// Pooled references of full-size pictures and of trials.
    pub pools: Pools,
    /// The given reference.
    given: Option<Grid<[f32; 3]>>,
    /// The reference as displayed, once final or given.
    shown: Option<Grid<[f32; 3]>>,
    stash: Vec<Judged>,
}

/// A picture to be judged again against a better reference.
struct Judged {
    run: RenderMeasurement,
    rgb: Grid<[f32; 3]>,
    is_complete: bool,
    replicates: Vec<ReplicatePixel>,
    /// Error estimated during its render.
    stated: Option<ErrorEstimate>,
    shown: Option<DisplayImage>,
    filtered: Option<DisplayImage>,
}

impl Judge {
    /// A judge with the given reference, or with the pooled pictures of earlier runs in the directory.
    pub fn open(renderer: &StudyRenderer, folder: &mut StudyFolder, given: Option<&Path>) -> Result<Self> {
        let pools = Pools::open(renderer, folder);
        let mut judge = Self { pools, given: None, shown: None, stash: Vec::new() };
        let given = given.map(|file| std::path::absolute(file).unwrap_or(file.to_path_buf()));
        let Some(file) = given else {
            let other =
                |m: &Measurement| matches!(m, Measurement::Reference(known) if known.file != pools::FILE);
            if folder.has(other) {
                // Measurements against a previously given reference are no longer valid.
                let own = ReferenceImage { file: pools::FILE.to_string(), ..ReferenceImage::default() };
                folder.keep(Measurement::Reference(own))?;
            }
            return Ok(judge);
        };
        let rgb = read(renderer, &file)?;
        let shown = develop::shown(&rgb, &renderer.settings);
        let reference = ReferenceImage {
            file: file.display().to_string(),
            made_by: "given".to_string(),
            luminance: mean_luminance(&rgb),
            picture: uri(&shown).unwrap_or_default(),
            ..ReferenceImage::default()
        };
        let known = folder.has(|m| matches!(m, Measurement::Reference(known) if *known == reference));
        if !known {
            folder.keep(Measurement::Reference(reference))?;
        }
        (judge.given, judge.shown) = (Some(rgb), Some(shown));
        Ok(judge)
    }

    /// A judge without any pictures.
    #[cfg(test)]
    pub fn without_reference(renderer: &StudyRenderer) -> Self {
        Self { pools: Pools::empty(renderer), given: None, shown: None, stash: Vec::new() }
    }

    /// Displayed reference, linear sRGB; `None` before there is one.
    pub fn shown(&mut self, renderer: &StudyRenderer) -> Option<&Grid<[f32; 3]>> {
        if self.shown.is_none() {
            self.shown = displayed(&self.pools.full, renderer);
        }
        self.shown.as_ref()
    }

    /// Displayed reference for pictures of this film.
    pub fn shown_on(&mut self, renderer: &StudyRenderer, film: &FilmSpec) -> Option<Grid<[f32; 3]>> {
        match *film == renderer.run.film {
            true => self.shown(renderer).cloned(),
            false => displayed(&self.pools.trial, renderer),
        }
    }

    /// Measures a render against the present reference, and adds it to the pool if its method is unbiased. Keeps its picture for
    /// [`finish`](Self::finish).
    pub fn take(
        &mut self,
        renderer: &mut StudyRenderer,
        run: &RunSpec,
        traced: StudyRender,
        budget: f64,
    ) -> Result<RenderMeasurement> {
        let is_trial = run.film != renderer.run.film;
        let mut measured = self.recorded(renderer, run, &traced, budget);
        let (mut shown, mut filtered) = (None, None);
        if !is_trial {
            let start = std::time::Instant::now();
            shown = Some(renderer.show(&renderer.settings.clone())?);
            measured.display_seconds = start.elapsed().as_secs_f64();
            // The filter takes about as long as a short picture.
            filtered = if budget >= 1.0 { renderer.filtered(&run.film, &traced)?.map(|f| f.0) } else { None };
        }
        let stated = traced.estimate();
        let StudyRender { rgb, is_complete, pixels: replicates, .. } = traced;
        let is_complete = is_complete && measured.samples_per_pixel >= LEAST_SAMPLES;
        let mut judged = Judged { run: measured, rgb, is_complete, replicates, stated, shown, filtered };
        if is_complete && !judged.run.biased {
            self.pools.of(is_trial).add(&judged.run.method, judged.pooled());
        }
        self.judge(&mut judged)?;
        let run = judged.run.clone();
        let bytes = |judged: &Judged| judged.rgb.pixels().len() * 50;
        self.stash.push(judged);
        while self.stash.iter().map(bytes).sum::<usize>() > STASH {
            self.stash.remove(0);
        }
        Ok(run)
    }

    /// Judges all pictures again against the final reference, and adds display metrics: FLIP, the displayed picture. Stops after `left`
    /// seconds; the remaining pictures keep their figures against the earlier reference.
    pub fn finish(
        &mut self,
        renderer: &mut StudyRenderer,
        folder: &mut StudyFolder,
        left: &dyn Fn() -> f64,
    ) -> Result<()> {
        if self.given.is_none() {
            self.shown = None;
        }
        self.shown(renderer);
        if self.given.is_none()
            && let Some(reference) = self.describe()
        {
            pools::save(&self.pools, folder)?;
            folder.keep(Measurement::Reference(reference))?;
        }
        let mut had: Vec<(String, f64)> = Vec::new();
        let mut stash = std::mem::take(&mut self.stash);
        // The longest first, since they are displayed and time may run out.
        stash.sort_by(|a, b| b.run.budget.total_cmp(&a.run.budget));
        for judged in &mut stash {
            if left() < 0.0 {
                break;
            }
            self.judge(judged)?;
            if let Some(shown) = &judged.shown {
                let of = (judged.run.method.clone(), judged.run.budget);
                let first = !had.contains(&of);
                had.push(of);
                let picture = linear(shown, &renderer.settings);
                if let Some(reference) = &self.shown {
                    let (flip, map) = difference(&picture, reference);
                    judged.run.flip = Some(flip);
                    judged.run.error_map = map.filter(|_| first && judged.run.budget >= SHOWN);
                    let filtered = judged.filtered.as_ref().map(|shown| linear(shown, &renderer.settings));
                    judged.run.flip_filtered = filtered.map(|shown| difference(&shown, reference).0);
                }
                let wanted = judged.run.budget >= SHOWN || FIGURES.contains(&judged.run.budget);
                judged.run.picture = uri(&picture).filter(|_| wanted);
            }
            folder.keep(Measurement::Run(Box::new(judged.run.clone())))?;
        }
        self.stash.clear();
        Ok(())
    }

    /// Describes the final reference.
    fn describe(&self) -> Option<ReferenceImage> {
        let pool = &self.pools.full;
        let pixels = pool.reference(None)?;
        let [median, p95, p99, rel_mse] = own_error(&pixels, pool.size());
        let picture = self.shown.as_ref().and_then(uri).unwrap_or_default();
        Some(ReferenceImage {
            file: pools::FILE.to_string(),
            made_by: pool.methods().join(", "),
            samples_per_pixel: pool.samples(),
            relative: [median, p95, p99],
            rel_mse: Some(rel_mse),
            picture,
            ..ReferenceImage::default()
        })
    }

    /// Computes the figures of a picture that depend on the reference.
    fn judge(&self, judged: &mut Judged) -> Result<()> {
        if !judged.is_complete {
            return Ok(());
        }
        let run = &judged.run;
        let pool = if run.is_trial { &self.pools.trial } else { &self.pools.full };
        let without = (!run.biased).then(|| (run.method.as_str(), judged.pooled()));
        let given = self.given.as_ref().filter(|_| !run.is_trial);
        let reference = match given {
            Some(rgb) => {
                let exact = |mean: &[f32; 3]| NoisyPixel { mean: *mean, ..NoisyPixel::default() };
                Some(rgb.pixels().iter().map(exact).collect())
            }
            None => pool.reference(without),
        };
        let missing = if given.is_some() { 0.0 } else { pool.missing(&run.method) };
        let size = size(run.size[0], run.size[1]);
        let Some(reference) = reference else {
            let own = ErrorField::new(&judged.replicates, size).map(|field| field.estimate(TileSubset::All));
            let run = &mut judged.run;
            run.relative = own.map(|own| own.relative);
            (run.rel_mse, run.noise) = (own.map(|own| own.rel_mse), own.map(|own| own.rel_mse));
            return Ok(());
        };
        let rgb: Vec<[f32; 3]> = reference.iter().map(|pixel| pixel.mean).collect();
        let noise = ErrorField::noise(&judged.replicates, &rgb, size);
        let against = error_against(judged.rgb.pixels(), &reference, size);
        let own = own_error(&reference, size);
        let estimate =
            |field: &Option<ErrorField>| field.as_ref().map(|field| field.estimate(TileSubset::All));
        let (stated, found) = (estimate(&noise), estimate(&against));
        let clear = found.is_some_and(|found| found.relative[1].value >= CLEAR * own[1]);
        let trusts = !run.biased && missing <= LACKING && !clear;
        // A less precise reference cannot judge a more precise biased picture, which states its own bias.
        let is_hidden = run.biased && !clear;
        let figures = match (trusts, is_hidden) {
            (true, _) => stated.or(found),
            (_, true) => judged.stated.or(found),
            _ => found,
        };
        let reference = Grid::from_rows(size[0], size[1], rgb).unwrap_or_default();
        // The reference's own error is subtracted, but at most half.
        let trimmed = rel_mse(&judged.rgb, &reference).into_diagnostic()?.trimmed;
        let run = &mut judged.run;
        let is_known = |found: &ErrorEstimate| (0..3).all(|i| found.relative[i].value >= CLEAR * own[i]);
        // The error of a given reference is unknown.
        run.truth = found
            .filter(|found| given.is_none() && is_known(found))
            .map(|found| found.relative.map(|error| error.value));
        run.trimmed = Some((trimmed - own[3]).max(0.5 * trimmed));
        run.smape = Some(smape(&judged.rgb, &reference).into_diagnostic()?.mean);
        run.relative = figures.map(|figures| figures.relative);
        run.rel_mse = figures.map(|figures| figures.rel_mse);
        run.noise = stated.map(|stated| stated.rel_mse);
        run.missing = missing;
        if !run.is_trial {
            let field = if trusts || is_hidden { noise.or(against) } else { against };
            run.regions = field.map(|field| field.coarse(REGIONS)).unwrap_or_default();
        }
        Ok(())
    }

    /// Relative error and relMSE of a picture against the final reference of its size.
    pub fn error_of(&self, rgb: &Grid<[f32; 3]>) -> Option<[Interval; 2]> {
        let exact = |rgb: &[f32; 3]| NoisyPixel { mean: *rgb, ..NoisyPixel::default() };
        let size = [rgb.width(), rgb.height()];
        let is_full = size == self.pools.full.size();
        let given = self.given.as_ref().filter(|_| is_full);
        let given = given.map(|rgb| rgb.pixels().iter().map(exact).collect());
        let pool = if is_full { &self.pools.full } else { &self.pools.trial };
        let reference = given.or_else(|| pool.reference(None))?;
        let found = error_against(rgb.pixels(), &reference, size)?.estimate(TileSubset::All);
        Some([found.relative[1], found.rel_mse])
    }

    /// Measures a picture of another program.
    pub fn peer(&mut self, renderer: &StudyRenderer, rgb: &Grid<[f32; 3]>) -> Result<RenderMeasurement> {
        let [width, height] = size(renderer.run.film.width, renderer.run.film.height);
        miette::ensure!(
            (rgb.width(), rgb.height()) == (width, height),
            "{}×{} pixels, but the picture has {width}×{height}",
            rgb.width(),
            rgb.height()
        );
        let shown = develop::shown(rgb, &renderer.settings);
        let flip = self.shown(renderer).map(|reference| difference(&shown, reference));
        let run = RenderMeasurement {
            peer: true,
            biased: true,
            size: [width as u32, height as u32],
            flip: flip.as_ref().map(|flip| flip.0),
            error_map: flip.and_then(|flip| flip.1),
            picture: uri(&shown),
            ..RenderMeasurement::default()
        };
        let mut judged = Judged {
            run,
            rgb: rgb.clone(),
            is_complete: true,
            replicates: Vec::new(),
            stated: None,
            shown: None,
            filtered: None,
        };
        self.judge(&mut judged)?;
        // The noise of another program's picture cannot be separated from its bias.
        Ok(RenderMeasurement { biased: false, noise: None, ..judged.run })
    }

    /// The figures of a render that need no reference.
    fn recorded(
        &self,
        renderer: &StudyRenderer,
        run: &RunSpec,
        traced: &StudyRender,
        budget: f64,
    ) -> RenderMeasurement {
        let (total, paths) = (traced.stats.total(), traced.data.counts.paths());
        let rejections = total.rejections;
        let rejected = |cause: Cause| {
            let example = rejections.examples().iter().find(|example| example.fault.cause == cause);
            let command = example.map(|example| run.replay(example)).unwrap_or_default();
            (cause.describe().to_string(), rejections.count(cause), command)
        };
        let [width, height] = run.film.padded_extent().map(f64::from);
        RenderMeasurement {
            method: run.integrator.name().to_string(),
            biased: run.integrator.has_photons(),
            size: [run.film.width, run.film.height],
            is_trial: run.film != renderer.run.film,
            budget,
            seed: run.seed,
            seconds: traced.driven.wall.as_secs_f64(),
            trace_seconds: total.cpu.unwrap_or(total.busy).as_secs_f64(),
            splat_seconds: traced.driven.rasterise.as_secs_f64(),
            samples_per_pixel: paths as f64 / (width * height),
            paths,
            stated: traced.estimate().map(|estimate| estimate.relative),
            brightness: traced.brightness(),
            rejected: Cause::ALL.into_iter().map(rejected).filter(|(_, count, _)| *count > 0).collect(),
            predictions: traced.predictions.clone(),
            ..RenderMeasurement::default()
        }
    }
}

impl Judged {
    fn pooled(&self) -> PooledPicture<'_> {
        PooledPicture {
            samples: self.run.samples_per_pixel,
            rgb: self.rgb.pixels(),
            replicates: &self.replicates,
        }
    }
}

/// Reference of a pool as displayed, linear sRGB.
fn displayed(pool: &ReferencePool, renderer: &StudyRenderer) -> Option<Grid<[f32; 3]>> {
    let rgb = pool.reference(None)?.into_iter().map(|pixel| pixel.mean).collect();
    let [width, height] = pool.size();
    Some(develop::shown(&Grid::from_rows(width, height, rgb)?, &renderer.settings))
}

fn size(width: u32, height: u32) -> [usize; 2] {
    [width as usize, height as usize]
}

fn mean_luminance(rgb: &Grid<[f32; 3]>) -> f64 {
    rgb.pixels().iter().map(|&rgb| luminance(rgb)).sum::<f64>() / rgb.pixels().len().max(1) as f64
}

/// Reads a given reference.
fn read(renderer: &StudyRenderer, file: &Path) -> Result<Grid<[f32; 3]>> {
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
    Ok(rgb)
}
