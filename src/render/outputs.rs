//! Output files of a run: checked before the run, replaced only when complete.

use std::path::{Path, PathBuf};
use std::time::Instant;

use miette::{IntoDiagnostic, Result, WrapErr};

use crate::client::compiled_effects::Effects;
use crate::client::{Denoise, DisplayImage, Film, FilmData, Readback, Settings, develop};
use crate::color::Profile;
use crate::denoise::filtered_picture::FilteredPicture;
use crate::denoise::view_filter;
use crate::image::ImageError;
use crate::image::exr::Channel;
use crate::image::png::{PngPicture, Transfer};
use crate::image::stereo::StereoFormat;
use crate::image::write::{FileFormat, check_place, check_target, same_file};
use crate::image::{Attribute, exr, png};
use crate::render::figures::{Seconds, is_special};
use crate::render::options::RenderOptions;
use crate::render::run_spec::{RunEnd, RunSpec, display_options};

/// Pictures of a run beside the film's.
#[derive(Default)]
pub struct Extras {
    /// Additional layers for EXR files.
    pub layers: Vec<Channel>,
    /// The denoised picture: displayed instead of the film, and a layer of EXR files.
    pub denoised: Option<FilteredPicture>,
}

impl Extras {
    /// Everything as channels of an EXR file.
    pub fn into_channels(self) -> Vec<Channel> {
        let mut layers = self.layers;
        layers.extend(self.denoised.iter().flat_map(FilteredPicture::channels));
        layers
    }
}

/// The picture files of a run, or the picture in memory that the caller gets instead.
pub struct Outputs {
    files: Vec<(PathBuf, StereoFormat)>,
    in_memory: bool,
}

impl Outputs {
    /// Takes the paths from the command line, or derives one from the scene's name, and checks that each can be written.
    ///
    /// # Errors
    ///
    /// When an extension is neither `.exr` nor `.png`, or a directory is not writable.
    pub fn plan(args: &RenderOptions) -> Result<Self> {
        let mut paths = args.outputs.clone();
        if paths.is_empty() {
            let stem = args.source.scene.file_stem().unwrap_or("picture".as_ref());
            paths.push(PathBuf::from(stem).with_extension("png"));
        }
        Self::check_as(paths, args.json.as_ref(), &args.source.scene, |path| match args.stereo {
            Some(_) => StereoFormat::of(path),
            None => FileFormat::of(path).map(StereoFormat::Plain),
        })
    }

    /// Checks that these files can be written, and that none is the report or the scene.
    pub fn check(paths: Vec<PathBuf>, json: Option<&PathBuf>, scene: &PathBuf) -> Result<Self> {
        Self::check_as(paths, json, scene, |path| FileFormat::of(path).map(StereoFormat::Plain))
    }

    fn check_as(
        paths: Vec<PathBuf>,
        json: Option<&PathBuf>,
        scene: &PathBuf,
        format: impl Fn(&Path) -> Result<StereoFormat, ImageError>,
    ) -> Result<Self> {
        let check = |path: PathBuf| {
            let format = format(&path).into_diagnostic()?;
            check_place(&path).into_diagnostic()?;
            Ok((path, format))
        };
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
        Ok(Self { files, in_memory: false })
    }

    /// No file: the caller gets what an EXR file would have.
    pub fn in_memory() -> Self {
        Self { files: Vec::new(), in_memory: true }
    }

    /// Whether there are no output files.
    pub fn is_empty(&self) -> bool {
        self.files.is_empty()
    }

    /// The files with their formats.
    pub fn formats(&self) -> &[(PathBuf, StereoFormat)] {
        &self.files
    }

    /// The files.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.files.iter().map(|(path, _)| path)
    }

    /// Whether the variance is stored in a file or steers a displayed picture.
    pub fn read_variance(&self, settings: &Settings) -> bool {
        self.writes_exr() || Effects::new(settings, 1).reads_variance()
    }

    /// Whether any file is EXR, or the picture in memory has what one has.
    pub fn writes_exr(&self) -> bool {
        self.in_memory || self.files.iter().any(|(_, format)| *format == EXR)
    }

    /// Takes the picture from the client and writes every file with its extras.
    ///
    /// # Errors
    ///
    /// The error of the first file that cannot be written; the others are still written.
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
        let shown = wants(PNG).then(display).transpose()?;
        let layers = extras.into_channels();
        let shown = shown.map(|shown| FilmSnapshot::Png(shown, client.counts().paths()));
        seconds.display = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let data = wants(EXR).then(|| client.develop()).transpose().into_diagnostic()?;
        let data = data.map(|data| FilmSnapshot::Exr(data, layers));
        for (path, format) in &self.files {
            let snapshot = match format {
                StereoFormat::Plain(FileFormat::Png) => &shown,
                StereoFormat::Plain(FileFormat::Exr) => &data,
                // Names of these are refused unless there are two eyes.
                StereoFormat::Jps | StereoFormat::Mpo => &None,
            };
            let written = snapshot.as_ref().map_or(Ok(()), |s| s.write(path, run, outcome, settings));
            first_error = first_error.and(written);
        }
        seconds.write = start.elapsed().as_secs_f64();
        first_error.wrap_err("a picture was rendered but could not be saved")
    }
}

const EXR: StereoFormat = StereoFormat::Plain(FileFormat::Exr);
const PNG: StereoFormat = StereoFormat::Plain(FileFormat::Png);

/// The layers of an EXR file of this film.
pub fn file_layers(
    data: &FilmData,
    run: &RunSpec,
    outcome: &RunEnd,
    beside: &[Channel],
    settings: &Settings,
) -> exr::Layers {
    let (attributes, energy) = (run.attributes(data.counts.paths(), outcome), run.film.filter.energy());
    let mut layers = develop::layers(data, &Profile::srgb(), energy, &attributes);
    layers.channels.extend_from_slice(beside);
    if beside.iter().any(|(name, _)| name.starts_with("denoised.")) {
        layers.attributes.extend(filter_attribute(settings));
    }
    layers
}

/// Writes a displayed picture of so many paths as a PNG file.
pub fn write_png(
    path: &Path,
    shown: &DisplayImage,
    paths: u64,
    run: &RunSpec,
    outcome: &RunEnd,
    settings: &Settings,
) -> Result<(), ImageError> {
    let picture = PngPicture {
        width: shown.width,
        height: shown.height,
        rgb: &shown.rgb,
        transfer: Transfer::of(&settings.profile, settings.gamma),
        primaries: settings.profile.primaries,
    };
    let mut attributes = run.attributes(paths, outcome);
    attributes.push(("display".to_string(), Attribute::Text(display_options(settings))));
    attributes.extend(filter_attribute(settings));
    png::write(path, picture, &attributes)
}

/// A picture still being computed by a device. Another thread waits for it and writes it, because encoding takes longer than a frame, too.
pub enum PendingSnapshot {
    /// Displayed picture, and its number of paths.
    Png(Readback<DisplayImage>, u64),
    /// Sums, and additional channels.
    Exr(Readback<FilmData>, Vec<Channel>),
}

impl PendingSnapshot {
    /// Takes a snapshot in the format given by the extension of `path`. `filtered`: denoised picture displayed instead of the film, if any.
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

/// A snapshot read from a film.
enum FilmSnapshot {
    /// Displayed picture, and its number of paths.
    Png(DisplayImage, u64),
    /// Sums, and additional channels.
    Exr(FilmData, Vec<Channel>),
}

impl FilmSnapshot {
    /// Writes the picture.
    fn write(&self, path: &Path, run: &RunSpec, outcome: &RunEnd, settings: &Settings) -> Result<()> {
        let written = match self {
            FilmSnapshot::Png(shown, paths) => write_png(path, shown, *paths, run, outcome, settings),
            FilmSnapshot::Exr(data, beside) => {
                exr::write(path, &file_layers(data, run, outcome, beside, settings))
            }
        };
        written.into_diagnostic()
    }
}

/// File attribute that names the noise filter.
fn filter_attribute(settings: &Settings) -> Option<(String, Attribute)> {
    let how = format!(
        "by {}, displayed pictures and the layer `denoised` only",
        view_filter::name(settings.denoise)
    );
    (settings.denoise != Denoise::Off).then(|| ("denoised".to_string(), Attribute::Text(how)))
}
