//! The film on the CPU: accumulators, batches and the order of the passes.

use std::borrow::Cow;

use glam::{Vec3, Vec4};

use crate::client::Film;
use crate::client::compiled_effects::Effects;
use crate::client::error::ClientError;
use crate::client::lod::StreamLod;
use crate::client::post_process::PictureGrid;
use crate::client::reference::accumulator::Accumulator;
use crate::client::reference::adaptive_filter::adaptive_filter;
use crate::client::reference::bilateral::bilateral;
use crate::client::reference::error_view::error_view;
use crate::client::reference::glare::ReferenceGlare;
use crate::client::reference::mips::{Pyramid, pyramid};
use crate::client::reference::reconstruct::{ReconstructParameters, StreamView, reconstruct};
use crate::client::reference::sums::HostSums;
use crate::client::reference::tonemap::tonemap;
use crate::client::settings::{
    ColorOutput, DisplayImage, DisplayView, FilmCounts, FilmData, FilmSpec, Settings,
};
use crate::client::state::FilmState;
use crate::image::Grid;
use crate::stream::{PathCounts, Sample};

/// A film whose passes are plain Rust: `--device cpu`, and the definition that the Vulkan film is tested against.
///
/// The same samples in the same order give the same bits for any number of threads.
pub struct ReferenceFilm {
    pub(super) state: FilmState,
    pub(super) pool: rayon::ThreadPool,
    pub(super) sums: HostSums,
    glare: ReferenceGlare,
    /// Whether only full batches are rasterised.
    keep_batch: bool,
}

impl ReferenceFilm {
    /// An empty film with `threads` threads of its own; 0 takes one per core.
    ///
    /// # Errors
    /// [`ClientError::Extent`] for a side of 0 or too large, [`ClientError::Threads`] when the system
    /// gives no threads.
    pub fn new(spec: FilmSpec, threads: usize) -> Result<Self, ClientError> {
        Self::with_sums(FilmState::new(spec)?, HostSums::default(), threads)
    }

    /// A film that already contains these samples.
    ///
    /// # Errors
    /// [`ClientError::Threads`].
    pub fn with_sums(state: FilmState, sums: HostSums, threads: usize) -> Result<Self, ClientError> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|i| format!("film {i}"))
            .build()
            .map_err(|e| ClientError::Threads { threads, reason: e.to_string() })?;
        Ok(Self { state, pool, sums, glare: ReferenceGlare::default(), keep_batch: false })
    }

    /// Restores sums read from a film of the same specification, including its overscan.
    ///
    /// # Errors
    /// [`ClientError::Memory`].
    pub fn restore(&mut self, data: &FilmData) -> Result<(), ClientError> {
        self.clear();
        self.sums.restore(self.state.spec(), data)?;
        self.state.add_counts(data.counts);
        self.state.set_scale(data.luminance_scale);
        Ok(())
    }

    /// Displays a scene-linear XYZ picture at its own size: glare, post-processes, tone curve and encoding in 8 bits.
    ///
    /// # Errors
    /// [`ClientError::Memory`].
    pub fn show(picture: &Grid<Vec3>, settings: &Settings) -> Result<DisplayImage, ClientError> {
        let settings = Settings { output: ColorOutput::Sdr, ..settings.clone() };
        Self::encode(picture, &settings, &mut ReferenceGlare::default())
    }

    /// Rasterises the batch, unless partial batches are to be kept.
    fn complete(&mut self) -> Result<(), ClientError> {
        if self.keep_batch { Ok(()) } else { self.flush() }
    }

    fn encode(
        picture: &Grid<Vec3>,
        settings: &Settings,
        glare: &mut ReferenceGlare,
    ) -> Result<DisplayImage, ClientError> {
        let bytes = size_of_val(picture.pixels()) as u64;
        let no_memory = |what| ClientError::Memory { what, bytes };
        let (effects, mut picture) = (Effects::new(settings, 1), Cow::Borrowed(picture));
        if let Some(kind) = settings.glare.filter(|_| effects.glare) {
            picture = Cow::Owned(glare.apply(&picture, &kind).ok_or(no_memory("glare"))?);
        }
        let Some(post) = effects.post(settings) else { return Ok(tonemap(&picture, settings)) };
        let grid = PictureGrid { extent: [picture.width() as u32, picture.height() as u32], detail: 1 };
        let picture = post.apply(&picture, grid).ok_or(no_memory("post-processes"))?;
        Ok(tonemap(&picture, settings))
    }
}

impl Film for ReferenceFilm {
    fn add(&mut self, samples: &[Sample]) -> Result<(), ClientError> {
        for sample in samples {
            if self.state.take(sample) {
                self.sums.push(*sample);
                if self.state.is_full() {
                    self.flush()?;
                }
            }
        }
        Ok(())
    }

    fn count_paths(&mut self, paths: PathCounts) {
        self.state.count_paths(paths);
    }

    fn flush(&mut self) -> Result<(), ClientError> {
        if !self.state.start_raster() {
            return Ok(());
        }
        let Self { state, pool, sums, .. } = self;
        pool.install(|| sums.raster(state))
    }

    fn clear(&mut self) {
        self.sums.clear();
        self.state.clear();
    }

    fn keep_batch(&mut self, keep: bool) {
        self.keep_batch = keep;
    }

    fn counts(&self) -> FilmCounts {
        self.state.counts()
    }

    fn display(&mut self, settings: &Settings) -> Result<DisplayImage, ClientError> {
        self.complete()?;
        let settings = Settings { output: ColorOutput::Sdr, ..settings.clone() };
        let (spec, lods) = (self.state.spec(), self.state.lods(self.state.samples()));
        let p = ReconstructParameters {
            spec: *spec,
            method: settings.reconstruction,
            kernel: settings.kernel,
            vm: settings.vm,
            luminance_scale: self.state.scale(),
            light_scale: self.state.light_scale(),
            detail: 1,
        };
        let effects = Effects::new(&settings, 1);
        if effects.reads_variance() && spec.variance.is_none() {
            return Err(ClientError::NoVariance);
        }
        self.pool.install(|| {
            let levels = |light: bool| {
                let sums = self.sums.stream(usize::from(light));
                match effects.adapts(spec, light) {
                    true => Levels::adapted(sums, spec, p.luminance_scale.recip()),
                    false => Levels::of(sums, spec, &effects),
                }
            };
            let (camera, light) = (levels(false)?, levels(true)?);
            let camera = camera.as_ref().zip(lods[0]).map(|(levels, lod)| levels.view(lod, false));
            let light = light.as_ref().zip(lods[1]).map(|(levels, lod)| levels.view(lod, true));
            let picture = match settings.view {
                DisplayView::Picture | DisplayView::FalseColor | DisplayView::Clipping => {
                    masked(&p, &effects, [camera, light])
                }
                DisplayView::CameraVariance => error_view(&p, camera.as_ref()),
                DisplayView::LightVariance => error_view(&p, light.as_ref()),
            };
            let picture = picture.ok_or_else(|| Accumulator::out_of_memory("the displayed picture", spec))?;
            Self::encode(&picture, &settings, &mut self.glare)
        })
    }

    fn develop(&mut self) -> Result<FilmData, ClientError> {
        self.complete()?;
        let pad = self.state.spec().pad();
        Ok(self.sums.develop(&self.state, pad))
    }
}

/// Noise masking and reconstruction of both streams; `None` if memory runs out.
fn masked(
    p: &ReconstructParameters,
    effects: &Effects,
    streams: [Option<StreamView<'_>>; 2],
) -> Option<Grid<Vec3>> {
    let mut filtered = [const { None }; 2];
    for (stream, filtered) in streams.iter().zip(&mut filtered) {
        if let Some(stream) = stream.as_ref().filter(|s| effects.bilateral(&s.lod) && !s.filtered) {
            *filtered = Some(bilateral(p, stream)?);
        }
    }
    let [camera, light] = [0, 1].map(|i| {
        let stream = streams[i].as_ref()?;
        let (color, variance) = match &filtered[i] {
            Some(filtered) => (std::slice::from_ref(filtered), None),
            None => (stream.color, stream.variance),
        };
        Some(StreamView { color, variance, ..*stream })
    });
    reconstruct(p, camera.as_ref(), light.as_ref())
}

/// Mip levels of one stream, rebuilt for each repaint.
struct Levels {
    color: Pyramid<Vec4>,
    variance: Option<Pyramid<f32>>,
    /// Whether the colour is filtered: level 0 alone, without overscan.
    filtered: bool,
}

impl Levels {
    /// Levels of the sums, with those of the variance if they are read; `None` without sums.
    fn of(
        sums: Option<&Accumulator>,
        spec: &FilmSpec,
        effects: &Effects,
    ) -> Result<Option<Self>, ClientError> {
        let Some(sums) = sums else {
            return Ok(None);
        };
        let no_memory = || Accumulator::out_of_memory("the mip levels", spec);
        let color = sums.color(spec).and_then(pyramid).ok_or_else(no_memory)?;
        let variance = if effects.reads_variance() {
            Some(sums.variance(spec).and_then(pyramid).ok_or_else(no_memory)?)
        } else {
            None
        };
        Ok(Some(Self { color, variance, filtered: false }))
    }

    /// Adaptively filtered sums; `None` without sums.
    fn adapted(
        sums: Option<&Accumulator>,
        spec: &FilmSpec,
        inverse_scale: f32,
    ) -> Result<Option<Self>, ClientError> {
        let Some(sums) = sums else {
            return Ok(None);
        };
        let filtered = sums.picture(spec).and_then(|sums| adaptive_filter(sums, inverse_scale, 0));
        let no_memory = || Accumulator::out_of_memory("the adaptive filter", spec);
        Ok(Some(Self { color: vec![filtered.ok_or_else(no_memory)?], variance: None, filtered: true }))
    }

    /// Input of the reconstruction; `summed` for the light stream.
    fn view(&self, lod: StreamLod, summed: bool) -> StreamView<'_> {
        let variance = self.variance.as_deref();
        StreamView { color: &self.color, variance, lod, summed, filtered: self.filtered }
    }
}
