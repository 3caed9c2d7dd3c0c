//! A prim whose properties are accounted for: what nobody asks for is told.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};

use openusd::sdf::{Path, Value};
use openusd::usd::{Prim, TimeCode};

use super::values::{self, Tuples};
use crate::scene::diagnostic::shorten;
use crate::scene::model::text::SceneText;

/// Properties that say nothing about how a prim looks: bounds for culling, data of applications and of their windows.
const SILENT: &[&str] = &["extent", "extentsHint", "xformOpOrder", "info:implementationSource", "proxyPrim"];

/// First parts of such names.
const SILENT_SPACES: &[&str] = &["userProperties:", "ui:", "customData:", "assetInfo:"];

/// A prim that is being read. Faults are kept until [`PrimReader::finish`].
pub(super) struct PrimReader {
    pub(super) prim: Prim,
    /// Its path, for messages.
    pub(super) path: String,
    /// Its type; empty where it has none.
    pub(super) kind: String,
    names: BTreeSet<String>,
    left: RefCell<BTreeSet<String>>,
    faults: RefCell<Vec<String>>,
}

/// Runs a call into the crate. It indexes tables of crate files (`usdc`) with numbers of the file and so panics on broken ones:
/// `read_token`, `resolve_string`, `read_path_vec`, and `read_floats` with a table of values.
pub(super) fn guarded<T, E: std::fmt::Display>(call: impl FnOnce() -> Result<T, E>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(call)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(error)) => Err(shorten(&format!("{error:#}"))),
        Err(_) => Err("its data are broken".to_owned()),
    }
}

/// Whether each step from a path to the prim above it makes it shorter. The crate goes up until it has arrived, which it never has
/// where a name holds a `.` or a `}`.
pub(super) fn leads_up(path: &Path) -> bool {
    let mut at = path.clone();
    while let Some(above) = at.parent() {
        if above.as_str().len() >= at.as_str().len() {
            return false;
        }
        at = above;
    }
    true
}

impl PrimReader {
    pub(super) fn new(prim: Prim) -> Self {
        let path = prim.path().as_str().to_owned();
        let mut faults = Vec::new();
        let mut keep = |error: String| faults.push(format!("a prim cannot be read: {error}"));
        let kind = guarded(|| prim.type_name()).unwrap_or_else(|error| {
            keep(error);
            None
        });
        let kind = kind.map(|kind| kind.as_str().to_owned()).unwrap_or_default();
        let names = guarded(|| prim.property_names()).unwrap_or_else(|error| {
            keep(error);
            Vec::new()
        });
        let names: BTreeSet<String> = names.iter().map(|name| name.as_str().to_owned()).collect();
        let left = RefCell::new(names.clone());
        Self { prim, path, kind, names, left, faults: RefCell::new(faults) }
    }

    /// The last part of its path.
    pub(super) fn name(&self) -> &str {
        self.path.rsplit('/').next().unwrap_or_default()
    }

    /// Whether it has a property of this name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.names.contains(name)
    }

    /// The names of its properties.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(String::as_str)
    }

    /// Notes that this property needs no word.
    pub(super) fn used(&self, name: &str) {
        self.left.borrow_mut().remove(name);
    }

    /// Keeps a message about this prim.
    pub(super) fn fault(&self, message: impl Into<String>) {
        self.faults.borrow_mut().push(message.into());
    }

    /// The value of an attribute: its default, else the first of its times.
    pub(super) fn value(&self, name: &str) -> Option<Value> {
        if !self.has(name) {
            return None;
        }
        self.used(name);
        let attribute = self.prim.attribute(name);
        let samples = guarded(|| attribute.num_time_samples()).unwrap_or(0);
        let mut value = guarded(|| attribute.get::<Value>());
        if samples > 0 && matches!(value, Ok(None)) {
            let times = guarded(|| attribute.time_sample_times()).unwrap_or_default();
            if let Some(first) = times.first() {
                value = guarded(|| attribute.get_at::<Value>(TimeCode::new(*first)));
            }
        }
        if samples > 1 {
            self.fault("animations are not played: what is shown is the default or the first time");
        }
        match value {
            Ok(value) => value.filter(|value| !matches!(value, Value::ValueBlock | Value::None)),
            Err(error) => {
                self.fault(format!("`{}` cannot be read: {error}", shorten(name)));
                None
            }
        }
    }

    /// The value of an attribute by `read`; one of another type is told.
    fn typed<T>(&self, name: &str, what: &str, read: impl FnOnce(&Value) -> Option<T>) -> Option<T> {
        let value = self.value(name)?;
        let read = read(&value);
        if read.is_none() {
            self.fault(format!("`{}` is {what}: it is not used", shorten(name)));
        }
        read
    }

    pub(super) fn number(&self, name: &str) -> Option<f64> {
        let first = |value: &Value| values::doubles(value).and_then(|all| all.first().copied());
        self.typed(name, "no number", |value| first(value).filter(|v| v.is_finite()))
    }

    /// The numbers of one tuple or matrix.
    pub(super) fn doubles(&self, name: &str, count: usize) -> Option<Vec<f64>> {
        self.typed(name, "not as many finite numbers as it should", |value| {
            values::doubles(value).filter(|all| all.len() == count && all.iter().all(|v| v.is_finite()))
        })
    }

    pub(super) fn rgb(&self, name: &str) -> Option<[f32; 3]> {
        self.doubles(name, 3).map(|v| [v[0] as f32, v[1] as f32, v[2] as f32])
    }

    pub(super) fn tuples(&self, name: &str) -> Option<Tuples> {
        self.typed(name, "no list of numbers", values::tuples)
    }

    pub(super) fn integers(&self, name: &str) -> Option<Vec<i64>> {
        self.typed(name, "no list of whole numbers", values::integers)
    }

    pub(super) fn word(&self, name: &str) -> Option<String> {
        self.typed(name, "no word", values::word)
    }

    pub(super) fn truth(&self, name: &str) -> Option<bool> {
        self.typed(name, "neither true nor false", values::truth)
    }

    /// The file of an attribute: as it is written, and where it is found.
    pub(super) fn asset(&self, name: &str) -> Option<(String, Option<String>)> {
        self.typed(name, "no file", |value| match value {
            Value::AssetPath(path) if !path.is_empty() => {
                Some((path.asset_path().to_owned(), path.resolved_path().map(str::to_owned)))
            }
            _ => None,
        })
    }

    /// Metadata of an attribute as a word.
    pub(super) fn metadata(&self, name: &str, key: &str) -> Option<Value> {
        guarded(|| self.prim.attribute(name).get_metadata::<Value>(key)).ok().flatten()
    }

    /// The targets of a relationship.
    pub(super) fn targets(&self, name: &str) -> Vec<openusd::sdf::Path> {
        if !self.has(name) {
            return Vec::new();
        }
        self.used(name);
        guarded(|| self.prim.relationship(name).targets()).unwrap_or_else(|error| {
            self.fault(format!("`{}` cannot be read: {error}", shorten(name)));
            Vec::new()
        })
    }

    /// The sources that an attribute is connected to.
    pub(super) fn connections(&self, name: &str) -> Vec<openusd::sdf::Path> {
        if !self.has(name) {
            return Vec::new();
        }
        self.used(name);
        guarded(|| self.prim.attribute(name).connections()).unwrap_or_default()
    }

    /// The API schemas that are applied.
    pub(super) fn schemas(&self) -> Vec<String> {
        let all = guarded(|| self.prim.api_schemas()).unwrap_or_default();
        all.iter().map(|name| name.as_str().to_owned()).collect()
    }

    /// Tells what was wrong, and which properties nobody asked for.
    pub(super) fn finish(self, text: &mut SceneText<'_>) {
        for fault in self.faults.take() {
            text.tell(fault, &self.path);
        }
        let of = if self.kind.is_empty() { "prims without a type" } else { &self.kind };
        for name in self.left.take() {
            let silent = SILENT.contains(&name.as_str())
                || SILENT_SPACES.iter().any(|space| name.starts_with(space))
                || (name.starts_with("primvars:") && name.ends_with(":indices"));
            if !silent {
                let (name, of) = (shorten(&name), shorten(of));
                text.tell(format!("`{name}` of {of} is not used"), &self.path);
            }
        }
    }
}
