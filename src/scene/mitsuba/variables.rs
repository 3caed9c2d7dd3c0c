//! `$names`: set by `default` in the file or by `-D` on the command line.

use std::collections::BTreeMap;

use crate::scene::diagnostic::{Finding, FindingKind, LineAt, SceneWarning, shorten};
use crate::scene::limits;

/// A `$name`.
struct Variable {
    value: String,
    /// Set on the command line, not by a `default`.
    fixed: bool,
    used: bool,
}

/// All `$names` known so far.
pub(crate) struct Variables(BTreeMap<String, Variable>);

/// Why a value cannot be made.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Unresolved {
    /// No such name.
    Unknown(String),
    /// More than [`limits::SUBSTITUTED_BYTES`].
    TooLong,
}

impl Variables {
    /// The `-D name=value` of the command line; the last of two with one name counts.
    pub(crate) fn new(overrides: &[(String, String)]) -> Self {
        let fixed =
            |(n, v): &(String, String)| (n.clone(), Variable { value: v.clone(), fixed: true, used: false });
        Self(overrides.iter().map(fixed).collect())
    }

    /// Sets a name that has no value yet.
    pub(crate) fn set_default(&mut self, name: &str, value: &str) {
        let variable = Variable { value: value.to_owned(), fixed: false, used: false };
        self.0.entry(name.to_owned()).or_insert(variable);
    }

    /// Replaces each `$name`; the longest known name counts, as `$width` before `$w`.
    pub(crate) fn substitute(&mut self, value: &str) -> Result<String, Unresolved> {
        let mut out = String::with_capacity(value.len());
        let mut rest = value;
        while let Some(at) = rest.find('$') {
            out.push_str(&rest[..at]);
            rest = &rest[at + 1..];
            let word_end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
            let word = &rest[..word_end];
            let ends = word.char_indices().map(|(i, c)| i + c.len_utf8()).take(256);
            let end = ends.filter(|&e| self.0.contains_key(&word[..e])).max().unwrap_or(0);
            let Some(variable) = self.0.get_mut(&word[..end]) else {
                return Err(Unresolved::Unknown(shorten(word)));
            };
            variable.used = true;
            out.push_str(&variable.value);
            rest = &rest[end..];
            if out.len() > limits::SUBSTITUTED_BYTES {
                return Err(Unresolved::TooLong);
            }
        }
        out.push_str(rest);
        Ok(out)
    }

    /// A warning for each name of the command line that no value used.
    pub(crate) fn unused(&self) -> Vec<SceneWarning> {
        let used: Vec<&str> = self.0.iter().filter(|(_, v)| v.used).map(|(n, _)| n.as_str()).collect();
        let known = match used.as_slice() {
            [] => "the scene uses no names at all".to_owned(),
            names => format!("it uses: {}", names.join(", ")),
        };
        let mut warnings = Vec::new();
        for (name, v) in self.0.iter().filter(|(_, v)| v.fixed && !v.used) {
            let text = format!("-D {name}={}", v.value);
            let at =
                LineAt { file: "command line", text: &text, line: 1, column: 4, range: (3, 3 + name.len()) };
            let found = Finding::new(FindingKind::Reference, at, format!("the scene does not use `${name}`"));
            warnings.push(found.help(known.clone()).warning());
        }
        warnings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_known_name_counts() {
        let mut v = Variables::new(&[("w".into(), "1".into())]);
        v.set_default("w", "9");
        v.set_default("width", "2");
        assert_eq!(v.substitute("$w $width $wide a$w.b$width$w"), Ok("1 2 1ide a1.b21".into()));
        assert_eq!(v.substitute("$é"), Err(Unresolved::Unknown("é".into())));
        assert_eq!(v.substitute("a$"), Err(Unresolved::Unknown(String::new())));
        v.set_default("big", &"x".repeat(limits::SUBSTITUTED_BYTES / 2));
        assert_eq!(v.substitute("$big$big$big"), Err(Unresolved::TooLong));
    }
}
