//! The files a run leaves behind, checked before the run and replaced only when complete.

use std::path::{Path, PathBuf};
use std::time::Instant;

use miette::{IntoDiagnostic, Result, WrapErr};

use crate::client::compiled_effects::Effects;
use crate::client::{Denoise, DisplayImage, Film, FilmData, Readback, Settings, develop};
use crate::color::Profile;
use crate::denoise::filtered_picture::FilteredPicture;
use crate::denoise::view_filter;
use crate::image::exr::Channel;
use crate::image::png::{PngPicture, Transfer};
use crate::image::write::{FileFormat, check_place, check_target, same_file};
use crate::image::{Attribute, exr, png};
use crate::render::figures::{Seconds, is_special};
use crate::render::options::RenderOptions;
use crate::render::run_spec::{RunEnd, RunSpec, display_options};

/// Pictures of a run beside the film's own.
#[derive(Default)]
pub struct Extras {
    /// Layers of EXR files.
    pub layers: Vec<Channel>,
    /// What is displayed instead of the film, and a layer of EXR files.
    pub denoised: Option<FilteredPicture>,
}

/// The picture files of a run.
pub struct Outputs {
    files: Vec<(PathBuf, FileFormat)>,
}

impl Outputs {
    /// Takes the files from the command line, or names one after the scene, and makes sure that each can be written.
    ///
    /// # Errors
    ///
    /// When an ending is neither `.exr` nor `.png` or a folder cannot be written to.
    pub fn plan(args: &RenderOptions) -> Result<Self> {
        let mut paths = args.outputs.clone();
        if paths.is_empty() {
            let stem = args.source.scene.file_stem().unwrap_or("picture".as_ref());
            paths.push(PathBuf::from(stem).with_extension("png"));
        }
        Self::check(paths, args.json.as_ref(), &args.source.scene)
    }

    /// Makes sure that these files can be written, and that none is the report or the scene.
    pub fn check(paths: Vec<PathBuf>, json: Option<&PathBuf>, scene: &PathBuf) -> Result<Self> {
        let check = |path: PathBuf| Ok((path.clone(), check_target(&path).into_diagnostic()?));
        let files = paths.into_iter().map(check).collect::<Result<Vec<_>>>()?;
        if let Some(json) = json.filter(|p| !is_special(p)) {
            check_place(json).into_diagnostic()?;
            if files.iter().map(|(path, _)| path).chain([scene]).any(|path| same_file(path, json)) {
                return Err(miette::miette!(
                    "--json {} would overwrite the picture or the scene; choose another name",
                    json.display()
                ));
            }
        }
        Ok(Self { files })
    }

    /// True when nothing is to be written.
    pub fn is_empty(&self) -> bool {
        self.files.is_empty()
    }

    /// The files.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.files.iter().map(|(path, _)| path)
    }

    /// True when the variance is part of a file, or steers what is shown in one.
    pub fn read_variance(&self, settings: &Settings) -> bool {
        self.writes_exr() || Effects::new(settings, 1).reads_variance()
    }

    /// True when an EXR file is to be written.
    pub fn writes_exr(&self) -> bool {
        self.files.iter().any(|(_, format)| *format == FileFormat::Exr)
    }

    /// Takes the picture from the client and writes every file, with what stands beside it.
    ///
    /// # Errors
    ///
    /// The first file that cannot be written; the others are written all the same.
    pub fn write(
        &self,
        client: &mut dyn Film,
        run: &RunSpec,
        outcome: &RunEnd,
        settings: &Settings,
        extras: Extras,
        seconds: &mut Seconds,
    ) -> Result<()> {
        let mut first_error = Ok(());
        let wants = |format| self.files.iter().any(|(_, f)| *f == format);
        let start = Instant::now();
        let display = || match &extras.denoised {
            Some(picture) => picture.display(settings),
            None => client.display(settings).into_diagnostic(),
        };
        let shown = wants(FileFormat::Png).then(display).transpose()?;
        let mut layers = extras.layers;
        layers.extend(extras.denoised.iter().flat_map(FilteredPicture::channels));
        let shown = shown.map(|shown| FilmSnapshot::Png(shown, client.counts().paths()));
        seconds.display = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let data = wants(FileFormat::Exr).then(|| client.develop()).transpose().into_diagnostic()?;
        let data = data.map(|data| FilmSnapshot::Exr(data, layers));
        for (path, format) in &self.files {
            let snapshot = match format {
                FileFormat::Png => &shown,
                FileFormat::Exr => &data,
            };
            let written = snapshot.as_ref().map_or(Ok(()), |s| s.write(path, run, outcome, settings));
            first_error = first_error.and(written);
        }
        seconds.write = start.elapsed().as_secs_f64();
        first_error.wrap_err("a picture was rendered but could not be saved")
    }
}

/// A picture that a device still computes, to be waited for and written on another thread, because encoding takes longer than a
/// frame, too.
pub enum PendingSnapshot {
    /// The displayed picture, and the number of paths in it.
    Png(Readback<DisplayImage>, u64),
    /// The sums, and channels beside them.
    Exr(Readback<FilmData>, Vec<Channel>),
}

impl PendingSnapshot {
    /// Takes the picture; the ending of `path` says which. `filtered` is what is displayed instead of the film, if anything is.
    pub fn take(
        path: &Path,
        film: &mut dyn Film,
        settings: &Settings,
        filtered: Option<DisplayImage>,
    ) -> Result<Self> {
        Ok(match check_target(path).into_diagnostic()? {
            FileFormat::Png => {
                let paths = film.counts().paths();
                let shown = filtered.map(Readback::ready).map_or_else(|| film.begin_display(settings), Ok);
                Self::Png(shown.into_diagnostic()?, paths)
            }
            FileFormat::Exr => Self::Exr(film.begin_develop().into_diagnostic()?, Vec::new()),
        })
    }

    /// Waits for the picture and writes it.
    pub fn write(self, path: &Path, run: &RunSpec, outcome: &RunEnd, settings: &Settings) -> Result<()> {
        let snapshot = match self {
            Self::Png(shown, paths) => FilmSnapshot::Png(shown.wait().into_diagnostic()?, paths),
            Self::Exr(data, layers) => FilmSnapshot::Exr(data.wait().into_diagnostic()?, layers),
        };
        snapshot.write(path, run, outcome, settings)
    }
}

/// A picture taken from a film.
enum FilmSnapshot {
    /// The displayed picture, and the number of paths in it.
    Png(DisplayImage, u64),
    /// The sums, and channels beside them.
    Exr(FilmData, Vec<Channel>),
}

impl FilmSnapshot {
    /// Writes the picture.
    fn write(&self, path: &Path, run: &RunSpec, outcome: &RunEnd, settings: &Settings) -> Result<()> {
        let written = match self {
            FilmSnapshot::Png(shown, paths) => {
                let picture = PngPicture {
                    width: shown.width,
                    height: shown.height,
                    rgb: &shown.rgb,
                    transfer: Transfer::Gamma(settings.gamma),
                    primaries: settings.profile.primaries,
                };
                let mut attributes = run.attributes(*paths, outcome);
                attributes.push(("display".to_string(), Attribute::Text(display_options(settings))));
                attributes.extend(filter_attribute(settings));
                png::write(path, picture, &attributes)
            }
            FilmSnapshot::Exr(data, beside) => {
                let (attributes, energy) =
                    (run.attributes(data.counts.paths(), outcome), run.film.filter.energy());
                let mut layers = develop::layers(data, &Profile::srgb(), energy, &attributes);
                if beside.iter().any(|(name, _)| name.starts_with("denoised.")) {
                    layers.attributes.extend(filter_attribute(settings));
                }
                layers.channels.extend(beside.iter().cloned());
                exr::write(path, &layers)
            }
        };
        written.into_diagnostic()
    }
}

/// What a file says of the noise filter.
fn filter_attribute(settings: &Settings) -> Option<(String, Attribute)> {
    let how = format!(
        "by {}, displayed pictures and the layer `denoised` only",
        view_filter::name(settings.denoise)
    );
    (settings.denoise != Denoise::Off).then(|| ("denoised".to_string(), Attribute::Text(how)))
}
