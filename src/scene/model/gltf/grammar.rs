//! The grammar of glTF 2.0 and of its extensions with what becomes of each property.
//!
//! [`check`] walks a whole file. Properties of materials and extensions, which the crate does not check, are refused here where they
//! have a wrong type. What the tables do not list, and what they list as not used, is told with its place, once for all alike: an
//! exporter's new extension or a misspelt property never vanishes without a word.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use serde_json::{Map, Value};

use super::grammar_tables::{EXTENSIONS, INNOCENT, KINDS, MAPS, REQUIRED};
use crate::scene::diagnostic::shorten;
use crate::scene::model::text::SceneText;

/// The rule for a property.
#[derive(Clone, Copy)]
pub(super) enum Rule {
    /// It is used, and the crate checks it.
    Kept,
    Number,
    /// From 0 to 1.
    Share,
    Numbers(usize),
    /// Each from 0 to 1.
    Shares(usize),
    /// Not negative.
    Whole,
    Boolean,
    Text,
    /// One of these words.
    Word(&'static [&'static str]),
    /// One of these numbers.
    Code(&'static [u64]),
    /// The index of an entry of this list of the file.
    Index(&'static str),
    /// An object of this kind.
    Object(&'static str),
    /// A list of such objects.
    List(&'static str),
    /// Nothing is lost without it.
    Silent,
    /// It is not used, for this reason.
    Told(&'static str),
}

/// The rules of the extension `name` of objects of one kind.
fn rule_of_extension(kind: &str, name: &str) -> Option<Rule> {
    let found = EXTENSIONS.iter().find(|(of, known, _)| *of == kind && *known == name);
    found.map(|(.., rule)| *rule).or(INNOCENT.contains(&name).then_some(Rule::Silent))
}

/// Whether a file may require this extension.
pub(super) fn is_supported(name: &str) -> bool {
    let used = |(_, known, rule): &(&str, &str, Rule)| *known == name && !matches!(rule, Rule::Told(_));
    name == "KHR_mesh_quantization" || INNOCENT.contains(&name) || EXTENSIONS.iter().any(used)
}

/// Whether an attribute of vertices is one of those that the specification names and that are read.
pub(super) fn is_attribute(name: &str) -> bool {
    let rules = KINDS.iter().find(|(kind, _)| *kind == "attributes").map_or(&[][..], |(_, rules)| *rules);
    rules.iter().any(|(known, _)| is_named(known, name))
}

/// Tells what of a file is not used.
///
/// # Errors
///
/// The place of the first value that has a wrong type.
pub(super) fn check(root: &Value, text: &mut SceneText<'_>) -> Result<(), String> {
    let mut walk = FileWalk { root, text, place: String::new(), extensions: BTreeSet::new() };
    walk.object("file", root)?;
    let FileWalk { extensions, .. } = walk;
    for name in root["extensionsUsed"].as_array().into_iter().flatten().filter_map(Value::as_str) {
        if !extensions.contains(name) && !is_supported(name) {
            let message = format!("the extension `{}` is not supported", shorten(name));
            text.tell(message, "extensionsUsed");
        }
    }
    Ok(())
}

/// A walk through a file.
struct FileWalk<'a, 'r, 't> {
    root: &'a Value,
    text: &'r mut SceneText<'t>,
    place: String,
    /// The extensions that some object has.
    extensions: BTreeSet<&'a str>,
}

impl<'a> FileWalk<'a, '_, '_> {
    fn wrong<T>(&self, what: impl std::fmt::Display) -> Result<T, String> {
        Err(format!("this is not valid glTF: {} is {what}", self.here()))
    }

    /// The place for messages.
    fn here(&self) -> &str {
        let place = self.place.trim_start_matches('.');
        if place.is_empty() { "the top of the file" } else { place }
    }

    fn tell(&mut self, message: String) {
        let place = self.here().to_owned();
        self.text.tell(message, &place);
    }

    /// Walks on at a place below this one.
    fn below(
        &mut self,
        at: std::fmt::Arguments<'_>,
        walk: impl FnOnce(&mut Self) -> Result<(), String>,
    ) -> Result<(), String> {
        let length = self.place.len();
        let _ = self.place.write_fmt(at);
        walk(self)?;
        self.place.truncate(length);
        Ok(())
    }

    fn object(&mut self, kind: &'static str, value: &'a Value) -> Result<(), String> {
        let Some(members) = value.as_object() else { return self.wrong("no object") };
        let rules = KINDS.iter().find(|(name, _)| *name == kind).map_or(&[][..], |(_, rules)| *rules);
        if let Some((_, missing)) =
            REQUIRED.iter().find(|(of, name)| *of == kind && !members.contains_key(*name))
        {
            return self.wrong(format_args!("without `{missing}`"));
        }
        let is_map = MAPS.contains(&kind);
        for (key, value) in members {
            match (key.as_str(), value.as_object()) {
                ("name" | "extras", _) if !is_map => {}
                ("extensions", Some(extensions)) if !is_map => self.extensions(kind, extensions)?,
                _ => match rules.iter().find(|(name, _)| is_named(name, key)) {
                    Some((_, rule)) => {
                        let plain = shorten(key);
                        self.below(format_args!(".{plain}"), |walk| walk.value(*rule, &plain, value))?;
                    }
                    None => self.tell(format!("`{}` of `{kind}` is not used", shorten(key))),
                },
            }
        }
        Ok(())
    }

    fn extensions(&mut self, kind: &'static str, extensions: &'a Map<String, Value>) -> Result<(), String> {
        for (name, value) in extensions {
            self.extensions.insert(name);
            let plain = shorten(name);
            match rule_of_extension(kind, name) {
                Some(Rule::Told(reason)) => {
                    self.tell(format!("the extension `{plain}`{} is not used: {reason}", members(value)));
                }
                Some(rule) => {
                    self.below(format_args!(".extensions.{plain}"), |walk| walk.value(rule, &plain, value))?;
                }
                None => self.tell(format!(
                    "the extension `{plain}`{} of `{kind}` is not supported: it is left out",
                    members(value)
                )),
            }
        }
        Ok(())
    }

    fn value(&mut self, rule: Rule, name: &str, value: &'a Value) -> Result<(), String> {
        let numbers = |n: usize| {
            let list = value.as_array().filter(|list| list.len() == n)?;
            list.iter().map(Value::as_f64).collect::<Option<Vec<f64>>>()
        };
        let share = |v: &f64| (0.0..=1.0).contains(v);
        let checked = |fits: bool, what: &str| if fits { Ok(()) } else { self.wrong(what) };
        match rule {
            Rule::Kept | Rule::Silent => Ok(()),
            Rule::Number => checked(value.is_number(), "no number"),
            Rule::Whole => checked(value.is_u64(), "no whole number"),
            Rule::Boolean => checked(value.is_boolean(), "neither true nor false"),
            Rule::Text => checked(value.is_string(), "no text"),
            Rule::Word(words) => checked(
                value.as_str().is_some_and(|word| words.contains(&word)),
                "none of the words that stand here",
            ),
            Rule::Code(codes) => checked(
                value.as_u64().is_some_and(|code| codes.contains(&code)),
                "none of the codes that stand here",
            ),
            Rule::Index(list) => {
                let count = self.root[list].as_array().map_or(0, Vec::len) as u64;
                checked(
                    value.as_u64().is_some_and(|i| i < count),
                    &format!("no index into the {count} {list}"),
                )
            }
            Rule::Numbers(n) => checked(numbers(n).is_some(), &format!("no list of {n} numbers")),
            Rule::Share | Rule::Shares(_) => {
                let given = match rule {
                    Rule::Shares(n) => numbers(n),
                    _ => value.as_f64().map(|v| vec![v]),
                };
                let Some(given) = given else { return self.wrong("not the numbers that stand here") };
                if !given.iter().all(share) {
                    self.tell(format!("`{name}` is from 0 to 1: the nearest of these counts"));
                }
                Ok(())
            }
            Rule::Object(kind) => self.object(kind, value),
            Rule::List(kind) => {
                let Some(list) = value.as_array() else { return self.wrong("no list") };
                for (i, value) in list.iter().enumerate() {
                    self.below(format_args!("[{i}]"), |walk| walk.object(kind, value))?;
                }
                Ok(())
            }
            Rule::Told(reason) => {
                self.tell(format!("`{name}` is not used: {reason}"));
                Ok(())
            }
        }
    }
}

/// Whether a rule is that of a property: `JOINTS_` is that of all sets of joints.
fn is_named(rule: &str, key: &str) -> bool {
    match rule.strip_suffix('#') {
        Some(first) => key.strip_prefix(first).is_some_and(|set| set.parse::<u32>().is_ok()),
        None => rule == key,
    }
}

/// The names of the first members of an extension.
fn members(value: &Value) -> String {
    let Some(members) = value.as_object().filter(|members| !members.is_empty()) else { return String::new() };
    let names: Vec<String> = members.keys().take(6).map(|name| shorten(name)).collect();
    format!(" ({}{})", names.join(", "), if members.len() > 6 { ", …" } else { "" })
}
