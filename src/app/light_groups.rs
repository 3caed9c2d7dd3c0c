//! `--light-groups`: a picture for each group of lights, from the same paths as the picture of all ([`stream`](crate::stream)).

use miette::{IntoDiagnostic, Result};
use serde::Serialize;

use super::args::RenderArgs;
use super::args::values::LightGroupsArg;
use super::device::Device;
use super::layers::Channel;
use super::outputs::Outputs;
use super::run_spec::RunSpec;
use crate::client::{ClientError, Film, FilmSpec, develop};
use crate::color::Profile;
use crate::scene::SceneDesc;
use crate::scene::desc::{AovDesc, IntegratorKind};
use crate::scene::light_groups::{self, Emitter, LightGroup};
use crate::stream::Block;
use crate::tracer::Scene;

/// Bytes per texel of the sums of a stream, on the processor and on a device, where no variance is kept.
const SUM_BYTES: [u64; 2] = [32, 91];

/// A group, for the report. The names of the fields are the keys in JSON.
#[derive(Clone, Debug, Serialize)]
pub struct LightGroupReport {
    /// The name of its layer.
    pub name: String,
    /// Its emitters.
    pub emitters: Vec<String>,
}

/// Refuses what does not go together with groups of lights, before any work.
pub fn check(args: &RenderArgs, outputs: &Outputs) -> Result<()> {
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

/// The groups that an option asks for in this scene.
///
/// # Errors
///
/// When the scene has no emitter of a name, and for what the method or the other layers do not allow.
pub fn plan(arg: &LightGroupsArg, run: &RunSpec, desc: &SceneDesc, scene: &Scene) -> Result<Vec<LightGroup>> {
    if run.integrator == IntegratorKind::Depth {
        return Err(miette::miette!(
            help = "choose another --integrator",
            "--light-groups: the method `depth` shows distances, which are of no light"
        ));
    }
    let emitters = light_groups::emitters(desc);
    if emitters.is_empty() {
        return Err(miette::miette!(
            help = "leave --light-groups away",
            "--light-groups: the scene has no emitter"
        ));
    }
    let groups = match arg.0.is_empty() {
        true => light_groups::each(emitters, &scene.lights().power_shares()),
        false => light_groups::named(emitters, &arg.0)
            .map_err(|[what, help]| miette::miette!(help = help, "--light-groups: {what}"))?,
    };
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

/// The groups of a render and their films.
pub struct GroupFilms {
    groups: Vec<LightGroup>,
    films: Vec<Box<dyn Film>>,
    /// Bytes of the sums of all films, estimated.
    bytes: u64,
}

impl GroupFilms {
    /// Empty films on `device`.
    ///
    /// # Errors
    ///
    /// As for the film of the picture.
    pub fn new(groups: Vec<LightGroup>, run: &RunSpec, device: &Device, threads: usize) -> Result<Self> {
        let spec = FilmSpec { variance: None, ..run.film };
        let films = groups.iter().map(|_| device.client(spec, threads, None)).collect::<Result<Vec<_>>>()?;
        let streams = match run.integrator {
            IntegratorKind::Bidirectional | IntegratorKind::Vcm => 2,
            _ => 1,
        };
        let texels: u64 = spec.padded_extent().map(u64::from).iter().product();
        let bytes = SUM_BYTES[usize::from(device.gpu().is_some())] * streams * texels * films.len() as u64;
        Ok(Self { groups, films, bytes })
    }

    /// One line about the groups and their memory.
    pub fn summary(&self) -> String {
        let list = |group: &LightGroup| {
            let names: Vec<&str> = group.emitters.iter().map(|emitter| emitter.name.as_str()).collect();
            match names.as_slice() {
                [one] if *one == group.name => group.name.clone(),
                _ => format!("{} ({})", group.name, names.join(", ")),
            }
        };
        let groups: Vec<String> = self.groups.iter().map(list).collect();
        format!(
            "{} groups of lights: {}; their films take {:.1} MiB in addition to the picture's",
            groups.len(),
            groups.join(", "),
            self.bytes as f64 / f64::from(1 << 20)
        )
    }

    /// Adds the samples of a block to the films.
    pub fn add(&mut self, block: &Block) -> Result<(), ClientError> {
        self.films.iter_mut().for_each(|film| film.count_paths(block.header.paths));
        self.films.iter_mut().zip(block.groups()).try_for_each(|(film, samples)| film.add(samples))
    }

    /// Rasterises what has been added.
    pub fn flush(&mut self) -> Result<(), ClientError> {
        self.films.iter_mut().try_for_each(|film| film.flush())
    }

    /// The pictures as layers of an EXR file, linear Rec.709.
    pub fn channels(&mut self) -> Result<Vec<Channel>> {
        let mut channels = Vec::new();
        for (group, film) in self.groups.iter().zip(&mut self.films) {
            let rgb = develop::linear_rgb(&film.develop().into_diagnostic()?, &Profile::srgb());
            for (c, axis) in ["R", "G", "B"].into_iter().enumerate() {
                let name = format!("{}.{axis}", group.name);
                channels.push((name, rgb.iter().map(|pixel| pixel[c]).collect()));
            }
        }
        Ok(channels)
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
