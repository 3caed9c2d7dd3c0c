//! The text of a manifest, and checks of its values: every error has line and column.

use std::ops::Range;

use miette::{LabeledSpan, NamedSource, Report, Result};
use serde::de::DeserializeOwned;
use toml::Spanned;

use crate::scene::suggest;

/// Words in braces that a renderer's command may have.
const PLACEHOLDERS: [&str; 6] = ["scene", "output", "seed", "spp", "width", "height"];

/// Options of `render` that the runner writes itself, and the keys to use instead.
const OWN_OPTIONS: [(&str, &str); 13] = [
    ("--integrator", "the key `methods`"),
    ("--device", "the key `devices`"),
    ("--size", "the key `size`"),
    ("--spp", "the key `spp`"),
    ("--samples", "the key `spp`"),
    ("--time", "the key `spp`, because renderings must be of equal effort"),
    ("--error", "the key `detect`, because renderings must be of equal effort"),
    ("--seed", "the option `--seed-base` of `regress run`"),
    ("--deterministic", "nothing, it is given wherever bits can be compared"),
    ("-o", "the option `--results` of `regress run`"),
    ("--output", "the option `--results` of `regress run`"),
    ("--json", "the option `--json` of `regress run`"),
    ("--quiet", "nothing, it is given already"),
];

/// A manifest and its name in messages.
pub(super) struct ManifestText {
    pub(super) name: String,
    pub(super) text: String,
}

impl ManifestText {
    /// Reads all tables.
    pub(super) fn parse<T: DeserializeOwned>(&self) -> Result<T> {
        toml::from_str(&self.text).map_err(|error| {
            let message = error.message().lines().next().unwrap_or_default().to_owned();
            let help = unknown_key(&message)
                .unwrap_or_else(|| "src/regress/README.md lists all keys and their values".into());
            self.error(error.span().unwrap_or(0..0), &help, message)
        })
    }

    /// An error about a part of the file.
    pub(super) fn error(&self, place: Range<usize>, help: &str, message: String) -> Report {
        let label = LabeledSpan::at(place, "here");
        let source = NamedSource::new(&self.name, self.text.clone());
        miette::miette!(labels = vec![label], help = help, "{message}").with_source_code(source)
    }

    /// Checks that a word is one of those known.
    pub(super) fn check_word(&self, word: &Spanned<String>, what: &str, known: &[&str]) -> Result<()> {
        if known.contains(&word.get_ref().as_str()) {
            return Ok(());
        }
        let help = match known {
            [] => format!("the manifest defines no {what}"),
            _ => suggest::hint(word.get_ref(), known),
        };
        Err(self.error(word.span(), &help, format!("there is no {what} `{}`", word.get_ref())))
    }

    /// A number from `least` to `most`.
    pub(super) fn within(&self, value: &Spanned<f64>, least: f64, most: f64, what: &str) -> Result<f64> {
        let number = *value.get_ref();
        if (least..=most).contains(&number) {
            return Ok(number);
        }
        let help = format!("write {what}, from {least} to {most}");
        Err(self.error(value.span(), &help, format!("{number} is out of range")))
    }

    /// A count of `least` or more.
    pub(super) fn at_least(&self, value: &Spanned<u64>, least: u64) -> Result<u64> {
        let count = *value.get_ref();
        if count >= least {
            return Ok(count);
        }
        Err(self.error(value.span(), &format!("write {least} or more"), format!("{count} is out of range")))
    }

    /// A number of renderings.
    pub(super) fn seeds(&self, value: &Spanned<u32>, least: u32) -> Result<u32> {
        let count = *value.get_ref();
        if (least..=1024).contains(&count) {
            return Ok(count);
        }
        let help = format!(
            "write {least} to 1024: variances come from the spread of the renderings, and `most_seeds` is at least `seeds`"
        );
        Err(self.error(value.span(), &help, format!("{count} is out of range")))
    }

    /// A size in pixels.
    pub(super) fn size(&self, value: &Spanned<[u32; 2]>) -> Result<[u32; 2]> {
        let size = *value.get_ref();
        if size.iter().all(|side| (1..=16_384).contains(side)) {
            return Ok(size);
        }
        let help = "write [WIDTH, HEIGHT], each from 1 to 16384 pixels";
        Err(self.error(value.span(), help, format!("{} by {} is no size", size[0], size[1])))
    }

    /// Checks the words of another program: all that a run must tell it is there, and nothing is in braces that would stay there.
    pub(super) fn check_command(&self, command: &Spanned<Vec<String>>, has_size: bool) -> Result<()> {
        let words = command.get_ref();
        let refuse = |help: &str, message: String| Err(self.error(command.span(), help, message));
        if words.first().is_none_or(String::is_empty) {
            return refuse(
                "write the program and its arguments, a string each",
                "this command is empty".into(),
            );
        }
        for name in ["scene", "output", "seed"] {
            let needed = format!("{{{name}}}");
            if !words.iter().any(|word| word.contains(&needed)) {
                let help = "every rendering has a file of its own and a seed of its own";
                return refuse(help, format!("this command lacks {needed}"));
            }
        }
        for name in words.iter().flat_map(|word| names_in_braces(word)) {
            if !PLACEHOLDERS.contains(&name) {
                return refuse(
                    &suggest::hint(name, &PLACEHOLDERS),
                    format!("nothing is known to replace {{{name}}}"),
                );
            }
            if ["width", "height"].contains(&name) && !has_size {
                let help = "write size = [WIDTH, HEIGHT] in the case or in [defaults]";
                return refuse(help, format!("this command has {{{name}}}, and the case no size"));
            }
        }
        Ok(())
    }

    /// Refuses options that the runner writes itself.
    pub(super) fn check_options(&self, options: &Spanned<Vec<String>>) -> Result<()> {
        for option in options.get_ref() {
            let word = option.split('=').next().unwrap_or_default();
            if let Some((_, instead)) = OWN_OPTIONS.iter().find(|(own, _)| *own == word) {
                return Err(self.error(
                    options.span(),
                    &format!("use {instead}"),
                    format!("{word} is no further option"),
                ));
            }
        }
        Ok(())
    }
}

/// Words of letters in braces.
fn names_in_braces(word: &str) -> impl Iterator<Item = &str> {
    let after = word.split('{').skip(1).filter_map(|rest| rest.split_once('}'));
    after
        .map(|(name, _)| name)
        .filter(|name| !name.is_empty() && name.chars().all(|c| c.is_ascii_alphabetic()))
}

/// Advice on an unknown key, from serde's message: unknown field `a`, expected one of `b`, `c`.
fn unknown_key(message: &str) -> Option<String> {
    let mut quoted = message.strip_prefix("unknown field ")?.split('`').skip(1).step_by(2);
    let key = quoted.next()?;
    Some(suggest::hint(key, &quoted.collect::<Vec<_>>()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_keys_have_a_neighbour() {
        let message = "unknown field `sps`, expected one of `size`, `spp`, `seeds`";
        assert_eq!(unknown_key(message).as_deref(), Some("did you mean `spp`?"));
        assert_eq!(unknown_key("unknown field `zzzzzz`, expected `spp`").as_deref(), Some("known here: spp"));
        assert_eq!(unknown_key("missing field `command`"), None);
    }

    #[test]
    fn names_stand_in_braces() {
        assert_eq!(names_in_braces("-o={output}:{seed}").collect::<Vec<_>>(), ["output", "seed"]);
        assert_eq!(names_in_braces("{\"a\": 1} {} {x").count(), 0);
    }
}
