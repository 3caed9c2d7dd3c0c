//! Output files of a run: checked before the run, replaced only when complete.

use std::path::{Path, PathBuf};
use std::time::Instant;

use miette::{IntoDiagnostic, Result, WrapErr};

use crate::client::compiled_effects::Effects;
use crate::client::{Denoise, DisplayImage, Film, FilmData, Readback, Settings, develop, stereo};
use crate::color::Profile;
use crate::denoise::filtered_picture::FilteredPicture;
use crate::denoise::view_filter;
use crate::image::ImageError;
use crate::image::exr::Channel;
use crate::image::png::{PngPicture, Transfer};
use crate::image::stereo::{Eye, StereoFormat, StereoLayout, pair_paths, write_jps, write_mpo};
use crate::image::write::{FileFormat, check_place, check_target, same_file};
use crate::image::{Attribute, exr, png};
use crate::render::figures::{Seconds, is_special};
use crate::render::options::RenderOptions;
use crate::render::run_spec::{RunEnd, RunSpec, display_options};

/// Pictures of a run beside the film's.
#[derive(Default)]
pub struct Extras<'a> {
    /// Additional layers for EXR files.
    pub layers: Vec<Channel>,
    /// The denoised picture: displayed instead of the film, and a layer of EXR files.
    pub denoised: Option<FilteredPicture>,
    /// The picture of the right eye, if the film is the left eye's.
    pub right: Option<RightPicture<'a>>,
}

/// The picture of the right eye.
pub struct RightPicture<'a> {
    pub film: &'a mut dyn Film,
    /// Its additional layers for EXR files.
    pub layers: Vec<Channel>,
    /// How a PNG file shows both eyes; `None` for a file of each.
    pub layout: Option<StereoLayout>,
}

/// The pictures of both eyes.
struct BothEyes<'a> {
    films: [&'a mut dyn Film; 2],
    /// Their additional layers for EXR files.
    layers: [Vec<Channel>; 2],
    layout: Option<StereoLayout>,
}

/// The picture files of a run.
pub struct Outputs {
    files: Vec<(PathBuf, StereoFormat)>,
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
        Ok(Self { files })
    }

    /// Whether there are no output files.
    pub fn is_empty(&self) -> bool {
        self.files.is_empty()
    }

    /// The files.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.files.iter().map(|(path, _)| path)
    }

    /// Whether the variance is stored in a file or steers a displayed picture.
    pub fn read_variance(&self, settings: &Settings) -> bool {
        self.writes_exr() || Effects::new(settings, 1).reads_variance()
    }

    /// Whether any file is EXR.
    pub fn writes_exr(&self) -> bool {
        self.files.iter().any(|(_, format)| *format == EXR)
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
        extras: Extras<'_>,
        seconds: &mut Seconds,
    ) -> Result<()> {
        if let Some(right) = extras.right {
            let eyes = BothEyes {
                films: [client, right.film],
                layers: [extras.layers, right.layers],
                layout: right.layout,
            };
            return self.write_eyes(eyes, run, outcome, settings, seconds);
        }
        let mut first_error = Ok(());
        let wants = |format| self.files.iter().any(|(_, f)| *f == format);
        let start = Instant::now();
        let display = || match &extras.denoised {
            Some(picture) => picture.display(settings),
            None => client.display(settings).into_diagnostic(),
        };
        let shown = wants(PNG).then(display).transpose()?;
        let mut layers = extras.layers;
        layers.extend(extras.denoised.iter().flat_map(FilteredPicture::channels));
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

    /// As [`write`](Self::write), for two eyes.
    fn write_eyes(
        &self,
        BothEyes { films: [left, right], layers: [left_layers, right_layers], layout }: BothEyes<'_>,
        run: &RunSpec,
        outcome: &RunEnd,
        settings: &Settings,
        seconds: &mut Seconds,
    ) -> Result<()> {
        let start = Instant::now();
        let coding = stereo::coding(settings).into_diagnostic()?;
        let paths = left.counts().paths();
        let shows = self.files.iter().any(|(_, format)| *format != EXR);
        let display = |film: &mut dyn Film| film.display(settings).into_diagnostic();
        let shown = shows.then(|| Ok::<_, miette::Report>([display(left)?, display(right)?])).transpose()?;
        let grids = shown.clone().map(|eyes| eyes.map(stereo::grid));
        let develop = |film: &mut dyn Film| film.develop().into_diagnostic();
        let eyes = self
            .writes_exr()
            .then(|| {
                let left = file_layers(&develop(left)?, run, outcome, left_layers);
                let right = file_layers(&develop(right)?, run, outcome, right_layers);
                let eyes = Eye::BOTH.map(Eye::name).into_iter().zip([left, right]).collect();
                exr::Layers::of_views(eyes).map_err(|reason| miette::miette!("{reason}"))
            })
            .transpose()?;
        seconds.display = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let mut first_error = Ok(());
        for (path, format) in &self.files {
            let written = match format {
                StereoFormat::Plain(FileFormat::Exr) => {
                    eyes.iter().try_for_each(|eyes| exr::write(path, eyes)).into_diagnostic()
                }
                StereoFormat::Plain(FileFormat::Png) => match (layout, &shown) {
                    (_, None) => Ok(()),
                    (Some(layout), Some(eyes)) => {
                        stereo::compose(eyes.clone(), layout, settings).into_diagnostic().and_then(|shown| {
                            FilmSnapshot::Png(shown, paths).write(path, run, outcome, settings)
                        })
                    }
                    (None, Some(eyes)) => pair_paths(path).iter().zip(eyes).try_for_each(|(path, eye)| {
                        FilmSnapshot::Png(eye.clone(), paths).write(path, run, outcome, settings)
                    }),
                },
                StereoFormat::Jps | StereoFormat::Mpo => {
                    let write = if *format == StereoFormat::Jps { write_jps } else { write_mpo };
                    let eyes = grids.iter().map(|[left, right]| [left, right]);
                    eyes.into_iter().try_for_each(|eyes| write(path, eyes, &coding)).into_diagnostic()
                }
            };
            first_error = first_error.and(written);
        }
        seconds.write = start.elapsed().as_secs_f64();
        first_error.wrap_err("a picture was rendered but could not be saved")
    }
}

const EXR: StereoFormat = StereoFormat::Plain(FileFormat::Exr);
const PNG: StereoFormat = StereoFormat::Plain(FileFormat::Png);

/// The layers of an EXR file of this film.
fn file_layers(data: &FilmData, run: &RunSpec, outcome: &RunEnd, beside: Vec<Channel>) -> exr::Layers {
    let (attributes, energy) = (run.attributes(data.counts.paths(), outcome), run.film.filter.energy());
    let mut layers = develop::layers(data, &Profile::srgb(), energy, &attributes);
    layers.channels.extend(beside);
    layers
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
                let mut layers = file_layers(data, run, outcome, beside.clone());
                if beside.iter().any(|(name, _)| name.starts_with("denoised.")) {
                    layers.attributes.extend(filter_attribute(settings));
                }
                exr::write(path, &layers)
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
