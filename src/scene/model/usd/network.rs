//! Networks of shaders (UsdShade): where an input has its value from, through the inputs and outputs of materials and node graphs.

use std::collections::BTreeMap;

use openusd::sdf::{Path, Value};
use openusd::usd::Stage;

use super::prim::{PrimReader, leads_up};
use super::values;
use crate::scene::diagnostic::shorten;
use crate::scene::model::text::SceneText;

/// Connections that are followed from one to the next.
const DEPTH: usize = 32;

/// The prims of one material that were asked.
pub(super) struct ShaderNetwork {
    stage: Stage,
    prims: BTreeMap<String, PrimReader>,
}

/// Where an input has its value from.
#[derive(Clone, Debug)]
pub(super) enum InputSource {
    /// A value that is written down.
    Value(Value),
    /// The output of a shader: its path and the name of the output.
    Output { shader: String, output: String },
}

impl ShaderNetwork {
    pub(super) fn new(stage: &Stage) -> Self {
        Self { stage: stage.clone(), prims: BTreeMap::new() }
    }

    /// The prim at this path.
    pub(super) fn prim(&mut self, path: &str) -> Option<&PrimReader> {
        if !self.prims.contains_key(path) {
            let parsed = Path::new(path).ok().filter(leads_up)?;
            self.prims.insert(path.to_owned(), PrimReader::new(self.stage.prim(parsed)));
        }
        self.prims.get(path)
    }

    /// The `info:id` of a shader.
    pub(super) fn id(&mut self, shader: &str) -> Option<String> {
        let prim = self.prim(shader)?;
        let id = prim.word("info:id");
        if id.is_none() && prim.names().any(|name| name.starts_with("info:")) {
            let names: Vec<String> =
                prim.names().filter(|name| name.starts_with("info:")).map(str::to_owned).collect();
            names.iter().for_each(|name| prim.used(name));
        }
        id
    }

    /// Where the attribute `name` of the prim at `path` has its value from; none where nothing is authored.
    pub(super) fn source(&mut self, path: &str, name: &str) -> Option<InputSource> {
        let (mut path, mut name) = (path.to_owned(), name.to_owned());
        for _ in 0..DEPTH {
            let prim = self.prim(&path)?;
            let connections = prim.connections(&name);
            if connections.len() > 1 {
                prim.fault(format!("`{}` has several sources: the first is used", shorten(&name)));
            }
            let Some((next, attribute)) = connections.first().and_then(Path::split_property) else {
                return prim.value(&name).map(InputSource::Value);
            };
            let (next, attribute) = (next.as_str().to_owned(), attribute.to_owned());
            // A value beside a connection does not count.
            let target = self.prim(&next)?;
            if let Some(output) = attribute.strip_prefix("outputs:")
                && target.kind == "Shader"
            {
                target.used(&attribute);
                let output = output.to_owned();
                return Some(InputSource::Output { shader: next, output });
            }
            if !target.has(&attribute) {
                let message = format!("`{}` is connected to what is not there", shorten(&name));
                self.prim(&path)?.fault(message);
                return None;
            }
            (path, name) = (next, attribute);
        }
        self.prim(&path)?.fault("connections go on and on, or in a circle: they are not followed");
        None
    }

    /// The value of an input that has to be written down.
    pub(super) fn value(&mut self, path: &str, name: &str) -> Option<Value> {
        match self.source(path, name)? {
            InputSource::Value(value) => Some(value),
            InputSource::Output { .. } => {
                let message = format!("`{}` is made by a shader: it is not used", shorten(name));
                self.prim(path)?.fault(message);
                None
            }
        }
    }

    /// Such a value as numbers.
    pub(super) fn numbers<const N: usize>(&mut self, path: &str, name: &str) -> Option<[f32; N]> {
        let value = self.value(path, name)?;
        let numbers =
            values::doubles(&value).filter(|all| all.len() >= N && all.iter().all(|v| v.is_finite()));
        if numbers.is_none() {
            let message =
                format!("`{}` is not as many finite numbers as it should: it is not used", shorten(name));
            self.prim(path)?.fault(message);
        }
        numbers.map(|all| std::array::from_fn(|i| all[i] as f32))
    }

    /// Such a value as a word.
    pub(super) fn word(&mut self, path: &str, name: &str) -> Option<String> {
        self.value(path, name).as_ref().and_then(values::word)
    }

    /// Tells what was wrong with its prims and what of them is not used.
    pub(super) fn finish(self, text: &mut SceneText<'_>) {
        for prim in self.prims.into_values() {
            // Their sources say what they are; what is not connected is for others.
            let quiet: Vec<String> = prim
                .names()
                .filter(|name| {
                    name.starts_with("outputs:") || prim.kind != "Shader" && name.starts_with("inputs:")
                })
                .map(str::to_owned)
                .collect();
            quiet.iter().for_each(|name| prim.used(name));
            prim.finish(text);
        }
    }
}
