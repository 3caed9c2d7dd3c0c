//! `--light-groups`: a separate picture for each group of lights, from the same paths as the whole picture ([`stream`](crate::stream)).

use miette::{IntoDiagnostic, Result};
use serde::Serialize;

use crate::client::{ClientError, Film, FilmSpec, develop};
use crate::color::Profile;
use crate::image::Grid;
use crate::image::exr::Channel;
use crate::image::mix::MixRgb;
use crate::image::stereo::Eye;
use crate::render::device::Device;
use crate::render::options::RenderOptions;
use crate::render::outputs::Outputs;
use crate::render::run_spec::RunSpec;
use crate::scene::SceneDesc;
use crate::scene::desc::{AovDesc, NoLight};
use crate::scene::light_groups::{self, Emitter, LightGroup, NamedGroup};
use crate::stream::{Block, BlockEyes};
use crate::tracer::Scene;

/// Bytes per texel of a stream's sums without variance: on the CPU, and on a device.
const SUM_BYTES: [u64; 2] = [32, 91];

/// Bytes per texel of the picture before and after the tone curve, and of its readback.
const SHOWN_BYTES: u64 = 16 + 4 + 4;

/// Memory layout of the films of light groups.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GroupMemory {
    /// Sums in main memory.
    Host,
    /// Images on a device.
    Device,
    /// Images on a device, with those for displaying each picture in a window.
    Window,
    /// As [`Window`](Self::Window) on a device that is the CPU, with sums in main memory too.
    WindowOnProcessor,
}

/// A light group in the report. Field names are JSON keys.
#[derive(Clone, Debug, Serialize)]
pub struct LightGroupReport {
    /// Name of its layer.
    pub name: String,
    /// Names of its emitters.
    pub emitters: Vec<String>,
}

/// Rejects options that are incompatible with light groups, before any work.
pub fn check(args: &RenderOptions, outputs: &Outputs) -> Result<()> {
    if args.light_groups.is_none() {
        return Ok(());
    }
    let refused = [
        (!outputs.writes_exr(), "the pictures of the groups are layers of an EXR file", "give -o FILE.exr"),
        (args.check_plan > 0.0, "--check-plan compares whole samples", "leave --check-plan away"),
        (
            args.reweight_fireflies.is_some(),
            "--reweight-fireflies weights samples by their brightness, of which groups have parts",
            "leave --reweight-fireflies away",
        ),
    ];
    match refused.into_iter().find(|(wrong, ..)| *wrong) {
        Some((_, why, advice)) => Err(miette::miette!(help = advice, "--light-groups: {why}")),
        None => Ok(()),
    }
}

/// Light groups requested by an option for this scene.
///
/// # Errors
///
/// When the scene has no emitter of a given name, or method or other layers are incompatible.
pub fn plan(asked: &[NamedGroup], run: &RunSpec, desc: &SceneDesc, scene: &Scene) -> Result<Vec<LightGroup>> {
    if let Some(NoLight { shows, .. }) = run.integrator.traits().no_light {
        return Err(miette::miette!(
            help = "choose another --integrator",
            "--light-groups: the method `{}` shows {shows}, which are of no light",
            run.integrator.name()
        ));
    }
    let emitters = light_groups::emitters(desc);
    if emitters.is_empty() {
        return Err(miette::miette!(
            help = "leave --light-groups away",
            "--light-groups: the scene has no emitter"
        ));
    }
    let groups = match asked.is_empty() {
        true => light_groups::each(emitters, &scene.lights().power_shares()),
        false => light_groups::named(emitters, asked)
            .map_err(|[what, help]| miette::miette!(help = help, "--light-groups: {what}"))?,
    };
    let of_view = |group: &&LightGroup| Eye::BOTH.iter().any(|eye| eye.name() == group.name);
    if let Some(group) = groups.iter().find(of_view).filter(|_| run.stereo.is_some()) {
        return Err(miette::miette!(
            help = "name the groups by --light-groups 'NAME=EMITTER,…'",
            "--light-groups: with --stereo `{}` is the name of a view of the file, and no layer can have it",
            group.name
        ));
    }
    let taken: Vec<String> = run.aovs.iter().flat_map(AovDesc::channels).collect();
    let layer =
        |group: &&LightGroup| ["R", "G", "B"].iter().any(|c| taken.contains(&format!("{}.{c}", group.name)));
    if let Some(group) = groups.iter().find(layer) {
        return Err(miette::miette!(
            help = "name the groups by --light-groups 'NAME=EMITTER,…', or the layers by --aov NAME:TYPE,…",
            "--light-groups: the layer `{}` would be there twice, as a group and by --aov",
            group.name
        ));
    }
    Ok(groups)
}

/// Light groups of a render, and their films.
pub struct GroupFilms {
    groups: Vec<LightGroup>,
    /// Films of the picture or of the left eye's, in the order of the groups.
    films: Vec<Box<dyn Film>>,
    /// Films of the right eye's; none if there is one eye.
    right_films: Vec<Box<dyn Film>>,
}

/// One line about the groups and the memory of their films.
pub fn summary(groups: &[LightGroup], run: &RunSpec, memory: GroupMemory) -> String {
    let list = |group: &LightGroup| {
        let names: Vec<&str> = group.emitters.iter().map(|emitter| emitter.name.as_str()).collect();
        match names.as_slice() {
            [one] if *one == group.name => group.name.clone(),
            _ => format!("{} ({})", group.name, names.join(", ")),
        }
    };
    let streams = run.integrator.streams().into_iter().filter(|filled| *filled).count() as u64;
    let per_texel = match memory {
        GroupMemory::Host => SUM_BYTES[0],
        GroupMemory::Device => SUM_BYTES[1],
        GroupMemory::Window => SUM_BYTES[1],
        GroupMemory::WindowOnProcessor => SUM_BYTES.iter().sum(),
    };
    let shown = match memory {
        GroupMemory::Host | GroupMemory::Device => 0,
        GroupMemory::Window | GroupMemory::WindowOnProcessor => SHOWN_BYTES,
    };
    let texels: u64 = run.film.padded_extent().map(u64::from).iter().product();
    let eyes = if run.stereo.is_some() { 2 } else { 1 };
    let bytes = (per_texel * streams + shown) * texels * groups.len() as u64 * eyes;
    let list: Vec<String> = groups.iter().map(list).collect();
    let (count, list, mebibytes) = (groups.len(), list.join(", "), bytes as f64 / f64::from(1 << 20));
    let in_addition = format!("{mebibytes:.1} MiB in addition to the picture's");
    let apart =
        if eyes > 1 { "; paths tell of lights for one eye each, so that the eyes share none" } else { "" };
    match count {
        1 => format!("1 group of lights: {list}; its film takes {in_addition}{apart}"),
        _ => format!("{count} groups of lights: {list}; their films take {in_addition}{apart}"),
    }
}

impl GroupFilms {
    /// Empty films on `device`.
    ///
    /// # Errors
    ///
    /// As for the film of the picture.
    pub fn new(groups: Vec<LightGroup>, run: &RunSpec, device: &Device, threads: usize) -> Result<Self> {
        Self::with(groups, run, |spec| device.client(spec, threads, None))
    }

    /// Empty films created by `make`.
    ///
    /// # Errors
    ///
    /// Those of `make`.
    pub fn with<E>(
        groups: Vec<LightGroup>,
        run: &RunSpec,
        make: impl Fn(FilmSpec) -> Result<Box<dyn Film>, E>,
    ) -> Result<Self, E> {
        let spec = FilmSpec { variance: None, ..run.film };
        let films = || groups.iter().map(|_| make(spec)).collect::<Result<Vec<_>, E>>();
        let (films, right_films) = (films()?, if run.stereo.is_some() { films()? } else { Vec::new() });
        Ok(Self { groups, films, right_films })
    }

    /// The groups.
    pub fn groups(&self) -> &[LightGroup] {
        &self.groups
    }

    /// The films of the picture or of the left eye's, in the order of the groups.
    pub fn films(&mut self) -> &mut [Box<dyn Film>] {
        &mut self.films
    }

    fn all(&mut self) -> impl Iterator<Item = &mut Box<dyn Film>> {
        self.films.iter_mut().chain(&mut self.right_films)
    }

    /// Discards all samples.
    pub fn clear(&mut self) {
        self.all().for_each(|film| film.clear());
    }

    /// Adds the samples of a block, which are of one of these eyes, to its films. Its paths count for both.
    pub fn add(&mut self, block: &Block, eyes: BlockEyes) -> Result<(), ClientError> {
        self.all().for_each(|film| film.count_paths(block.header.paths));
        let is_left = eyes.of_index(block.header.first_index) == 0;
        let films = if is_left { &mut self.films } else { &mut self.right_films };
        films.iter_mut().zip(block.groups()).try_for_each(|(film, samples)| film.add(samples))
    }

    /// Rasterises the waiting samples.
    pub fn flush(&mut self) -> Result<(), ClientError> {
        self.all().try_for_each(|film| film.flush())
    }

    /// The pictures, linear Rec.709; with two eyes those of the left one.
    pub fn pictures(&mut self) -> Result<Vec<Grid<MixRgb>>> {
        self.films.iter_mut().map(picture).collect()
    }

    /// The pictures as layers of an EXR file, linear Rec.709; with two eyes those of the left one.
    pub fn channels(&mut self) -> Result<Vec<Channel>> {
        channels(&self.groups, &mut self.films)
    }

    /// The pictures of the right eye as layers of its view; none if there is one eye.
    pub fn right_channels(&mut self) -> Result<Vec<Channel>> {
        channels(&self.groups, &mut self.right_films)
    }

    /// The groups, for the report.
    pub fn report(&self) -> Vec<LightGroupReport> {
        let name = |emitter: &Emitter| emitter.name.clone();
        let report = |group: &LightGroup| LightGroupReport {
            name: group.name.clone(),
            emitters: group.emitters.iter().map(name).collect(),
        };
        self.groups.iter().map(report).collect()
    }
}

/// The picture of a film, linear Rec.709.
fn picture(film: &mut Box<dyn Film>) -> Result<Grid<MixRgb>> {
    let data = film.develop().into_diagnostic()?;
    let pixels = develop::linear_rgb(&data, &Profile::srgb());
    let picture = Grid::from_rows(data.width as usize, data.height as usize, pixels);
    picture.ok_or_else(|| miette::miette!("the picture is incomplete"))
}

/// The pictures of these films of groups as layers.
fn channels(groups: &[LightGroup], films: &mut [Box<dyn Film>]) -> Result<Vec<Channel>> {
    let mut channels = Vec::new();
    for (group, film) in groups.iter().zip(films) {
        let picture = picture(film)?;
        for (c, axis) in ["R", "G", "B"].into_iter().enumerate() {
            let name = format!("{}.{axis}", group.name);
            channels.push((name, picture.pixels().iter().map(|pixel| pixel[c]).collect()));
        }
    }
    Ok(channels)
}
