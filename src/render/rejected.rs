//! Rejected values for the user: fault, location, and the command that reproduces it.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::render::run_spec::RunSpec;
use crate::scene::SceneDesc;
use crate::scene::desc::{BsdfId, ShapeDesc};
use crate::scene::edit::objects;
use crate::stream::{Cause, Fault, Rejected, Rejections};
use crate::tracer::Scene;

/// Rejected values of a render. Field names are JSON keys.
#[derive(Clone, Debug, Default, Serialize)]
pub struct RejectedReport {
    /// Number of rejected values: whole samples, and single contributions that samples went without.
    pub total: u64,
    /// Number of whole samples among them.
    pub samples: u64,
    pub by_cause: BTreeMap<&'static str, u64>,
    pub by_origin: Vec<RejectedOrigin>,
    /// The first hundred, each with a replay command.
    pub examples: Vec<RejectedExample>,
}

/// Values rejected in one place for one reason.
#[derive(Clone, Debug, Serialize)]
pub struct RejectedOrigin {
    pub what: String,
    pub count: u64,
}

/// A rejected value.
#[derive(Clone, Debug, Serialize)]
pub struct RejectedExample {
    /// Index of its path in the sequence.
    pub index: u64,
    pub what: String,
    /// The command that traces this path alone and prints its vertices.
    pub replay: String,
}

impl RejectedReport {
    /// Report of the rejected values of `run`.
    pub fn new(run: &RunSpec, desc: &SceneDesc, scene: &Scene, rejections: &Rejections) -> Self {
        let example = |rejected: &Rejected| RejectedExample {
            index: rejected.index,
            what: describe(desc, scene, &rejected.fault),
            replay: run.replay(rejected),
        };
        let origin =
            |(fault, count): (&Fault, u64)| RejectedOrigin { what: describe(desc, scene, fault), count };
        Self {
            total: rejections.total(),
            samples: rejections.samples(),
            by_cause: Cause::ALL.map(|cause| (cause.describe(), rejections.count(cause))).into(),
            by_origin: rejections.faults().map(origin).collect(),
            examples: rejections.examples().iter().map(example).collect(),
        }
    }

    /// Summary in one line, also for a picture file; `None` if nothing was rejected.
    pub fn summary(&self) -> Option<String> {
        let first = self.examples.first()?;
        let parts = [(self.samples, "samples"), (self.total - self.samples, "contributions to samples")];
        let counts =
            parts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}"));
        let counts: Vec<String> = counts.collect();
        Some(format!("{} rejected, the first: {}: {}", counts.join(" and "), first.what, first.replay))
    }
}

/// A fault in words: `light sample infinite at sphere "ball" of dielectric "glass", of light "lamp"`.
pub fn describe(desc: &SceneDesc, scene: &Scene, fault: &Fault) -> String {
    let mut text = format!("{} {}", fault.part.describe(), fault.cause.describe());
    if let Some(number) = fault.surface {
        text += &format!(" at {}", surface(desc, number));
    }
    if let Some(number) = fault.light {
        text += &format!(", from {}", light(desc, scene, number));
    }
    text
}

/// Names the shape of a surface and its material.
pub fn surface(desc: &SceneDesc, surface: u32) -> String {
    let groups = desc.groups.iter().flat_map(|group| &group.shapes);
    let shape: Option<&ShapeDesc> = desc.shapes.iter().chain(groups).nth(surface as usize);
    let Some(shape) = shape else { return format!("surface {surface}") };
    format!("{} of {}", objects::name_of(desc, shape), material(desc, shape.bsdf))
}

fn material(desc: &SceneDesc, id: BsdfId) -> String {
    let plugin = desc.bsdfs.get(id.0 as usize).map_or("no material", |bsdf| bsdf.plugin());
    let name = desc.names.bsdfs.get(id.0 as usize).and_then(|name| name.id.as_deref());
    name.map_or(plugin.to_owned(), |name| format!("{plugin} \"{name}\""))
}

/// Names a light of the prepared scene: the shape that emits, or the emitter.
pub fn light(desc: &SceneDesc, scene: &Scene, light: u32) -> String {
    let source = scene.lights().source(light) as usize;
    let mut shapes = desc.shapes.iter().filter(|shape| shape.emission.is_some());
    let count = shapes.clone().count();
    match shapes.nth(source) {
        Some(shape) => format!("the light of {}", objects::name_of(desc, shape)),
        None => objects::light_name(desc, (source - count.min(source)) as u32),
    }
}
