//! Pictures for files and for tev, with their regions and the light mix.

use std::path::Path;

use glam::Vec3;
use miette::{IntoDiagnostic, Result};

use crate::client::film::VulkanFilm;
use crate::client::reference::ReferenceFilm;
use crate::client::wavelet::out_of_memory;
use crate::client::{
    ClientError, ColorOutput, Denoise, DisplayImage, Film, FilmCounts, FilmData, FilmSpec, Readback,
    Settings, stereo,
};
use crate::denoise::filtered_picture::FilteredPicture;
use crate::image::Grid;
use crate::image::stereo::StereoFormat;
use crate::image::write::{FileFormat, check_target};
use crate::render::outputs::PendingSnapshot;
use crate::render::run_spec::{RunEnd, RunSpec};
use crate::render::stereo_error::StereoEnd;
use crate::render::stereo_outputs::PendingStereo;
use crate::render::tev::TevLink;
use crate::stream::{PathCounts, Sample};
use crate::study::ErrorQuantile;
use crate::viewer::editor::SceneEditor;
use crate::viewer::light_mix::LightMix;
use crate::viewer::picture::LivePicture;
use crate::viewer::picture::regions::{Regions, per_pixel};
use crate::viewer::screen::Screen;
use crate::viewer::session::RenderSession;

/// The film combined with its regions or light mix, to be saved.
pub struct ComposedFilm<'a> {
    pub film: &'a mut VulkanFilm,
    pub regions: &'a mut Regions,
    pub mix: &'a mut LightMix,
}

impl ComposedFilm<'_> {
    /// Whether regions or a mix are combined with the film.
    fn is_composed(&self, settings: &Settings) -> bool {
        !settings.view.is_error() && (!self.regions.is_empty() || self.mix.is_mixing())
    }
}

impl Film for ComposedFilm<'_> {
    fn add(&mut self, samples: &[Sample]) -> Result<(), ClientError> {
        self.film.add(samples)
    }

    fn count_paths(&mut self, paths: PathCounts) {
        self.film.count_paths(paths);
    }

    fn flush(&mut self) -> Result<(), ClientError> {
        self.film.flush()?;
        self.regions.flush()
    }

    fn clear(&mut self) {
        self.film.clear();
        self.regions.clear();
    }

    fn keep_batch(&mut self, keep: bool) {
        self.film.keep_batch(keep);
    }

    fn counts(&self) -> FilmCounts {
        self.film.counts()
    }

    fn display(&mut self, settings: &Settings) -> Result<DisplayImage, ClientError> {
        if !self.is_composed(settings) {
            return self.film.display(settings);
        }
        let FilmSpec { width, height, .. } = *self.film.spec();
        if self.mix.is_mixing() {
            return ReferenceFilm::show(&self.mix.linear(settings, [width, height])?, settings);
        }
        let linear = self.film.reconstruct(&settings.before_glare(), 1)?;
        let pixels = linear.into_iter().map(Vec3::from).collect();
        let size = [width as usize, height as usize];
        let picture = Grid::from_rows(size[0], size[1], pixels);
        let mut picture = picture.ok_or_else(|| out_of_memory(size))?;
        self.regions.mix_into(&mut picture, per_pixel(self.film), settings)?;
        ReferenceFilm::show(&picture, settings)
    }

    fn begin_display(&mut self, settings: &Settings) -> Result<Readback<DisplayImage>, ClientError> {
        match self.is_composed(settings) {
            true => self.display(settings).map(Readback::ready),
            false => self.film.begin_display(settings),
        }
    }

    fn begin_develop(&mut self) -> Result<Readback<FilmData>, ClientError> {
        match self.regions.is_empty() {
            true => self.film.begin_develop(),
            false => self.develop().map(Readback::ready),
        }
    }

    fn develop(&mut self) -> Result<FilmData, ClientError> {
        let mut data = self.film.develop()?;
        self.regions.mix_into_sums(&mut data, per_pixel(self.film))?;
        Ok(data)
    }
}

/// A picture of the window that a device is still computing; another thread can wait for it and write it.
pub enum WindowSnapshot {
    /// The picture of one eye, or what is displayed of two.
    One(PendingSnapshot),
    /// The sums of two eyes.
    Views(Box<PendingStereo>),
}

impl WindowSnapshot {
    /// Waits for the picture and writes it.
    ///
    /// # Errors
    ///
    /// When the device was lost meanwhile, or the file cannot be written.
    pub fn write(self, path: &Path, run: &RunSpec, end: &StereoEnd, settings: &Settings) -> Result<()> {
        match self {
            Self::One(snapshot) => snapshot.write(path, run, &end.both, settings),
            Self::Views(pending) => {
                pending.wait()?.write(path, StereoFormat::Plain(FileFormat::Exr), run, end)
            }
        }
    }
}

/// What a display shows of these denoised pictures, of two eyes composed; `None` without them.
fn displayed(denoised: &[FilteredPicture], settings: &Settings) -> Result<Option<DisplayImage>> {
    // Files have 8 bits.
    let settings = &Settings { output: ColorOutput::Sdr, ..settings.clone() };
    Ok(match denoised {
        [left, right] => {
            let eyes = [left.display(settings)?, right.display(settings)?];
            Some(stereo::compose(eyes, settings.stereo, settings).into_diagnostic()?)
        }
        [one] => Some(one.display(settings)?),
        _ => None,
    })
}

impl LivePicture {
    /// State of the render so far, for the metadata of a picture file; for one eye that of both together.
    pub fn outcome(&self, session: &RenderSession, editor: &SceneEditor) -> StereoEnd {
        let rejected = session.rejected(editor).summary();
        let is_whole = self.regions.is_empty() && !session.has_gaps();
        let prefix = session.is_complete() && is_whole;
        let mut end = RunEnd { prefix, rejected, notes: Vec::new() };
        let (at, states) = (ErrorQuantile::P95, self.states_of_eyes());
        // The error of a light mix is not estimated.
        let one = self.observer.as_ref().filter(|_| states.is_none() && !self.mix.is_mixing());
        one.into_iter().for_each(|observer| end.describe(&observer.state(), at));
        let states = states.as_ref().map(|[left, right]| [&**left, &**right]);
        let has_target = self.observer.as_ref().is_some_and(|observer| observer.target().is_some());
        let end = StereoEnd::new(end, states, has_target, at);
        end.with(|end| end.notes.extend(self.composition()))
    }

    /// Denoises all samples of each eye so far, if these settings show the denoised picture; blocks until done. Empty otherwise.
    pub fn filtered(&mut self, run: &RunSpec, settings: &Settings) -> Vec<FilteredPicture> {
        if self.mix.is_mixing() || !self.filter.will_be_ready(run, settings, self.samples()) {
            return Vec::new();
        }
        if self.sharpen().is_err() {
            return Vec::new();
        }
        self.filter.choose(settings);
        self.filter.wait();
        self.filter_now();
        self.filter.wait();
        let pictures = self.filter.take().unwrap_or_default().into_iter();
        // If the device cannot provide the regions it cannot provide the film either, which is reported there.
        let composed: Result<_, _> = pictures.map(|picture| self.composed(picture, settings)).collect();
        composed.unwrap_or_default()
    }

    /// Combines a denoised picture with its regions.
    fn composed(
        &mut self,
        picture: FilteredPicture,
        settings: &Settings,
    ) -> Result<FilteredPicture, ClientError> {
        let film = self.screen.as_ref().and_then(Screen::film).filter(|_| !self.regions.is_empty());
        let Some(whole) = film.map(per_pixel) else { return Ok(picture) };
        let mut xyz = picture.xyz().clone();
        self.regions.mix_into(&mut xyz, whole, settings)?;
        Ok(xyz.into())
    }

    /// The noise filter of the displayed picture.
    pub fn filter_shown(&self, run: &RunSpec, settings: &Settings) -> Denoise {
        let frames = self.filtered_frames(run, settings).unwrap_or_default();
        let is_filtered = !frames.is_empty() && frames.iter().all(|frame| frame.filtered.is_some());
        if is_filtered { settings.denoise } else { Denoise::Off }
    }

    /// Regions or light mix of the picture, for the metadata of its files.
    pub fn composition(&self) -> Vec<(&'static str, String)> {
        let mix = Some(self.mix.options()).filter(|options| !options.is_empty());
        let regions = Some(self.regions.in_words()).filter(|words| !words.is_empty());
        let notes = [("displayedMix", mix), ("regions", regions)];
        notes.into_iter().filter_map(|(name, note)| Some((name, note?))).collect()
    }

    /// Takes a snapshot of the picture, to be written by another thread: as it is shown, or the sums of each eye.
    pub fn snapshot(
        &mut self,
        path: &Path,
        session: &RenderSession,
        settings: &Settings,
    ) -> Result<WindowSnapshot> {
        let frames = self.filtered_frames(session.run_spec(), settings).unwrap_or_default();
        let denoised: Option<Vec<_>> = frames.iter().map(|frame| frame.filtered.clone()).collect();
        let denoised = denoised.unwrap_or_default().into_iter();
        let denoised: Result<Vec<_>, _> = denoised.map(|picture| self.composed(picture, settings)).collect();
        self.snapshot_of(path, session, settings, &denoised.into_diagnostic()?)
    }

    /// The same with these denoised pictures, one for each eye, if there are any.
    pub fn snapshot_of(
        &mut self,
        path: &Path,
        session: &RenderSession,
        settings: &Settings,
        denoised: &[FilteredPicture],
    ) -> Result<WindowSnapshot> {
        self.sharpen().into_diagnostic()?;
        let Some(film) = self.screen.as_mut().and_then(Screen::film_mut) else {
            return Err(miette::miette!("there is no picture to save"));
        };
        if film.is_damaged() {
            return Err(miette::miette!(
                "samples were lost to an error of the device: change something, then save"
            ));
        }
        if film.has_right_eye() && check_target(path).into_diagnostic()? == FileFormat::Exr {
            let sums: Result<[_; 2], _> = film.begin_develop_eyes().into_diagnostic()?.try_into();
            let sums = sums.map_err(|_| miette::miette!("the picture of the right eye is missing"))?;
            let layers = [0, 1].map(|eye: usize| {
                denoised.get(eye).map(FilteredPicture::channels).into_iter().flatten().collect()
            });
            return Ok(WindowSnapshot::Views(Box::new(PendingStereo::of_sums(sums, layers, settings))));
        }
        let shown = displayed(denoised, settings)?;
        // In index order the sums must stay those of whole batches until the render is complete.
        film.keep_batch(session.run_spec().deterministic && !session.is_complete());
        let mut film = ComposedFilm { film, regions: &mut self.regions, mix: &mut self.mix };
        let snapshot = PendingSnapshot::take(path, &mut film, settings, shown);
        film.keep_batch(false);
        let snapshot = match (snapshot, self.mix.films()) {
            (Ok(PendingSnapshot::Exr(data, mut layers)), Some(films)) => {
                layers.extend(films.channels()?);
                Ok(PendingSnapshot::Exr(data, layers))
            }
            (snapshot, _) => snapshot,
        };
        // The display may have left another encoding in the film's picture than the window's.
        self.repaint = true;
        snapshot.map(WindowSnapshot::One)
    }

    /// Sends the film to tev, unless it is empty.
    pub fn send_to_tev(
        &mut self,
        tev: &mut TevLink,
        name: &str,
        session: &RenderSession,
    ) -> Result<(), ClientError> {
        self.sharpen()?;
        let film = self.screen.as_mut().and_then(Screen::film_mut);
        let Some(film) = film.filter(|film| film.counts().paths() > 0) else { return Ok(()) };
        let film = &mut ComposedFilm { film, regions: &mut self.regions, mix: &mut self.mix };
        film.keep_batch(session.run_spec().deterministic && !session.is_complete());
        let sent = tev.send(name, film);
        film.keep_batch(false);
        sent
    }

    /// Takes the film out of the window, for the files written at the end. `None` also on a device error; the retained samples remain.
    pub fn take_film(&mut self) -> Option<VulkanFilm> {
        self.sharpen().ok()?;
        self.screen.as_mut().and_then(Screen::take_film)
    }
}
