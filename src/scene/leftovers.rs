//! Data of a file that nothing uses: collected by name, and reported in one note.

/// Names that are kept apart; others are counted together.
const MOST_KINDS: usize = 64;

/// Names that a note lists.
const LISTED: usize = 6;

/// Longest name in a note, characters.
const LONGEST_NAME: usize = 40;

/// Parts of a file that are not used, by name.
#[derive(Clone, Debug, Default)]
pub(crate) struct Leftovers {
    /// Name, occurrences and the line of the first, in the order of the file.
    kinds: Vec<(String, usize, usize)>,
    /// Occurrences beyond [`MOST_KINDS`] names.
    others: usize,
}

impl Leftovers {
    /// Adds an occurrence at a line (from 1).
    pub(crate) fn add(&mut self, name: &str, line: usize) {
        self.add_many(name, line, 1);
    }

    fn add_many(&mut self, name: &str, line: usize, times: usize) {
        if let Some(known) = self.kinds.iter_mut().find(|kind| kind.0 == name) {
            known.1 += times;
        } else if self.kinds.len() < MOST_KINDS {
            self.kinds.push((name.to_owned(), times, line));
        } else {
            self.others += times;
        }
    }

    /// Adds those of later lines.
    pub(crate) fn merge(&mut self, later: &Self) {
        later.kinds.iter().for_each(|(name, times, line)| self.add_many(name, *line, *times));
        self.others += later.others;
    }

    /// Number of different names.
    pub(crate) fn kinds(&self) -> usize {
        self.kinds.len()
    }

    /// True if this name occurred.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.kinds.iter().any(|kind| kind.0 == name)
    }

    /// The note and the line of the first occurrence; nothing if all was used.
    pub(crate) fn note(&self) -> Option<(String, usize)> {
        let line = self.kinds.iter().map(|kind| kind.2).min()?;
        let shown = |(name, times, _): &(String, usize, usize)| {
            let name: String = name.chars().take(LONGEST_NAME).collect();
            if *times == 1 { format!("`{name}`") } else { format!("`{name}` ({times} times)") }
        };
        let listed: Vec<String> = self.kinds.iter().take(LISTED).map(shown).collect();
        let rest: usize = self.kinds.iter().skip(LISTED).map(|kind| kind.1).sum::<usize>() + self.others;
        let more = if rest > 0 { format!(" and {rest} others") } else { String::new() };
        Some((format!("not used: {}{more}", listed.join(", ")), line))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_note_names_kinds_and_counts_the_rest() {
        assert_eq!(Leftovers::default().note(), None);
        let mut left = Leftovers::default();
        left.add("vp", 7);
        let mut later = Leftovers::default();
        (0..100).for_each(|i| later.add(&format!("k{}", i % 80), 10 + i));
        left.merge(&later);
        let (note, line) = left.note().expect("some");
        assert_eq!(line, 7);
        assert_eq!(
            note,
            "not used: `vp`, `k0` (2 times), `k1` (2 times), `k2` (2 times), `k3` (2 times), `k4` (2 times) and 90 others"
        );
        assert!(left.has("vp") && left.kinds() == MOST_KINDS);
    }
}
