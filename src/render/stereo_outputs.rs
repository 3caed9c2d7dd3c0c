//! Files of the pictures of two eyes, at the end of a run and of snapshots on the way.

use std::path::Path;
use std::time::Instant;

use miette::{IntoDiagnostic, Result, WrapErr};

use crate::client::{ClientError, DisplayImage, Film, FilmData, Readback, Settings, stereo};
use crate::image::exr;
use crate::image::stereo::{Eye, StereoFormat, StereoLayout, pair_paths, write_jps, write_mpo};
use crate::image::write::FileFormat;
use crate::render::figures::Seconds;
use crate::render::outputs::{Extras, Outputs, file_layers, write_png};
use crate::render::run_spec::{RunEnd, RunSpec};
use crate::render::stereo_error::StereoEnd;

/// The pictures of both eyes, the left one first.
pub struct EyePictures<'a> {
    pub films: [&'a mut dyn Film; 2],
    pub extras: [Extras; 2],
    /// How a PNG file shows both; `None` for a file of each.
    pub layout: Option<StereoLayout>,
}

/// What the films of both eyes hold at one moment; a device may still be computing it. Another thread can wait for it and write it.
pub struct PendingStereo {
    /// Displayed pictures, if a file shows them.
    shown: Option<[Readback<DisplayImage>; 2]>,
    /// Sums, if a file holds them.
    sums: Option<[Readback<FilmData>; 2]>,
    taken: TakenStereo,
}

/// What the films of both eyes held at one moment, the left one's first.
pub struct TakenStereo {
    shown: Option<[DisplayImage; 2]>,
    sums: Option<[FilmData; 2]>,
    /// Channels beside the sums.
    layers: [Vec<exr::Channel>; 2],
    /// Paths of both together.
    paths: u64,
    layout: Option<StereoLayout>,
    settings: Settings,
}

/// Writes every file of a run for two eyes.
///
/// # Errors
///
/// The error of the first file that cannot be written; the others are still written.
pub fn write(
    outputs: &Outputs,
    pictures: EyePictures<'_>,
    run: &RunSpec,
    end: &StereoEnd,
    settings: &Settings,
    seconds: &mut Seconds,
) -> Result<()> {
    let start = Instant::now();
    let taken = PendingStereo::take(outputs, pictures, settings)?.wait()?;
    seconds.display = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let mut first_error = Ok(());
    for (path, format) in outputs.formats() {
        first_error = first_error.and(taken.write(path, *format, run, end));
    }
    seconds.write = start.elapsed().as_secs_f64();
    first_error.wrap_err("a picture was rendered but could not be saved")
}

impl PendingStereo {
    /// Takes what the files need.
    ///
    /// # Errors
    ///
    /// When a film cannot be read.
    pub fn take(outputs: &Outputs, pictures: EyePictures<'_>, settings: &Settings) -> Result<Self> {
        let EyePictures { films, extras, layout } = pictures;
        let shows = outputs.formats().iter().any(|(_, format)| !is_exr(*format));
        let paths = films[0].counts().paths();
        let (mut shown, mut sums, mut layers) = (Vec::new(), Vec::new(), [Vec::new(), Vec::new()]);
        for ((film, extras), layers) in films.into_iter().zip(extras).zip(&mut layers) {
            if shows {
                shown.push(match &extras.denoised {
                    Some(picture) => Readback::ready(picture.display(settings)?),
                    None => film.begin_display(settings).into_diagnostic()?,
                });
            }
            if outputs.writes_exr() {
                sums.push(film.begin_develop().into_diagnostic()?);
                *layers = extras.into_channels();
            }
        }
        let taken =
            TakenStereo { shown: None, sums: None, layers, paths, layout, settings: settings.clone() };
        Ok(Self { shown: shown.try_into().ok(), sums: sums.try_into().ok(), taken })
    }

    /// What EXR files need: the sums of both eyes, the left one's first, and the channels beside them.
    pub fn of_sums(
        sums: [Readback<FilmData>; 2],
        layers: [Vec<exr::Channel>; 2],
        settings: &Settings,
    ) -> Self {
        let settings = settings.clone();
        let taken = TakenStereo { shown: None, sums: None, layers, paths: 0, layout: None, settings };
        Self { shown: None, sums: Some(sums), taken }
    }

    /// Waits until the device has computed it.
    ///
    /// # Errors
    ///
    /// When the device was lost meanwhile.
    pub fn wait(self) -> Result<TakenStereo> {
        Ok(TakenStereo { shown: wait_for(self.shown)?, sums: wait_for(self.sums)?, ..self.taken })
    }
}

/// Waits for what is read from both films, if it is.
fn wait_for<T: Send + 'static>(eyes: Option<[Readback<T>; 2]>) -> Result<Option<[T; 2]>> {
    let both = |[left, right]: [Readback<T>; 2]| Ok::<_, ClientError>([left.wait()?, right.wait()?]);
    eyes.map(both).transpose().into_diagnostic()
}

impl TakenStereo {
    /// Both pictures as views of an EXR file, if their sums were taken.
    pub fn views(&self, run: &RunSpec, end: &StereoEnd) -> Result<Option<exr::Layers>> {
        let Some(sums) = &self.sums else { return Ok(None) };
        let view = |eye: Eye| {
            let (at, settings) = (eye as usize, &self.settings);
            (eye.name(), file_layers(&sums[at], run, &end.eyes[at], &self.layers[at], settings))
        };
        let views = exr::Layers::of_views(Eye::BOTH.map(view).into());
        views.map(Some).map_err(|reason| miette::miette!("{reason}"))
    }

    /// Writes one file, or a pair.
    ///
    /// # Errors
    ///
    /// When it cannot be written, and for layouts of displays whose values are not those of 8-bit pictures.
    pub fn write(&self, path: &Path, format: StereoFormat, run: &RunSpec, end: &StereoEnd) -> Result<()> {
        if is_exr(format) {
            let views = self.views(run, end)?;
            return views.map_or(Ok(()), |views| exr::write(path, &views).into_diagnostic());
        }
        let Some(shown) = &self.shown else { return Ok(()) };
        let write_shown = |path: &Path, shown: &DisplayImage, end: &RunEnd| {
            write_png(path, shown, self.paths, run, end, &self.settings).into_diagnostic()
        };
        match (format, self.layout) {
            (StereoFormat::Plain(_), Some(layout)) => {
                let composed = stereo::compose(shown.clone(), layout, &self.settings).into_diagnostic()?;
                write_shown(path, &composed, &end.both)
            }
            (StereoFormat::Plain(_), None) => {
                let mut eyes = pair_paths(path).into_iter().zip(shown).zip(&end.eyes);
                eyes.try_for_each(|((path, shown), end)| write_shown(&path, shown, end))
            }
            (StereoFormat::Jps | StereoFormat::Mpo, _) => {
                let write = if format == StereoFormat::Jps { write_jps } else { write_mpo };
                let coding = stereo::coding(&self.settings).into_diagnostic()?;
                let [left, right] = shown.clone().map(stereo::grid);
                write(path, [&left, &right], &coding).into_diagnostic()
            }
        }
    }
}

fn is_exr(format: StereoFormat) -> bool {
    format == StereoFormat::Plain(FileFormat::Exr)
}
