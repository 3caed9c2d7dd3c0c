//! MTL files: the statements of materials, each taken by what uses it, so that those that are left can be told.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::scene::diagnostic::{Finding, FindingKind, LineAt};
use crate::scene::leftovers::Leftovers;

/// Options of maps with the words that follow them: fewest, most, and those that change nothing.
const OPTIONS: &[(&str, usize, usize, &[&str])] = &[
    ("-blendu", 1, 1, &["on"]),
    ("-blendv", 1, 1, &["on"]),
    ("-bm", 1, 1, &["1"]),
    ("-boost", 1, 1, &["0"]),
    ("-cc", 1, 1, &["off"]),
    ("-clamp", 1, 1, &["off"]),
    ("-imfchan", 1, 1, &["l", "m"]),
    ("-mm", 2, 2, &["0 1"]),
    ("-o", 1, 3, &["0", "0 0", "0 0 0"]),
    ("-s", 1, 3, &["1", "1 1", "1 1 1"]),
    ("-t", 1, 3, &["0", "0 0", "0 0 0"]),
    ("-texres", 1, 1, &[]),
    ("-type", 1, 1, &[]),
];

/// Statements that ask for nothing with these values. Ambient light is that of the scene.
const NEUTRAL: &[(&str, &[f32])] = &[
    ("ke", &[0.0]),
    ("ks", &[0.0]),
    ("tf", &[1.0]),
    ("tr", &[0.0]),
    ("d", &[1.0]),
    ("sharpness", &[60.0]),
    ("anisor", &[0.0]),
    ("kd", &[0.0, 1.0]),
    ("illum", &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]),
];

/// Statements without a counterpart in a scene where light goes everywhere.
const AMBIENT: [&str; 2] = ["ka", "map_ka"];

/// An MTL file.
pub(super) struct MtlFile {
    path: PathBuf,
    bytes: Vec<u8>,
    /// By name; of several with the same name the last one.
    pub(super) materials: BTreeMap<String, MtlMaterial>,
    /// Statements that belong to no material.
    pub(super) left: Leftovers,
}

/// The statements of a material.
#[derive(Default)]
pub(super) struct MtlMaterial {
    pub(super) name: String,
    /// A part of the model has it.
    pub(super) used: bool,
    statements: Vec<Statement>,
    /// The faults of statements by kind, each with its first line and its number.
    faults: BTreeMap<&'static str, (usize, usize)>,
    /// Options of maps that are not used.
    left: Leftovers,
}

/// A line of a material.
struct Statement {
    /// In small letters.
    keyword: String,
    shown: String,
    line: usize,
    rest: String,
    taken: bool,
}

/// A picture with its options.
pub(super) struct MtlMap {
    pub(super) file: String,
    keyword: String,
    line: usize,
    options: Vec<(String, Vec<String>)>,
}

impl MtlFile {
    /// Reads the statements of a file.
    pub(super) fn new(path: &Path, bytes: Vec<u8>) -> Self {
        let (mut materials, mut left) = (BTreeMap::new(), Leftovers::default());
        let mut open: Option<MtlMaterial> = None;
        let mut close = |open: &mut Option<MtlMaterial>, left: &mut Leftovers, line: usize| {
            if let Some(material) = open.take()
                && let Some(known) = materials.insert(material.name.clone(), material)
            {
                left.add(&format!("newmtl {}", known.name), line);
            }
        };
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
        for (i, line) in text.split(|b| *b == b'\n').enumerate() {
            let line = String::from_utf8_lossy(line);
            let line = line.trim();
            let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            let rest = rest.trim();
            match (keyword, &mut open) {
                ("", _) => {}
                (comment, _) if comment.starts_with('#') => {}
                ("newmtl", _) => {
                    close(&mut open, &mut left, i + 1);
                    open = Some(MtlMaterial { name: rest.to_owned(), ..MtlMaterial::default() });
                }
                (_, None) => left.add(keyword, i + 1),
                (_, Some(material)) => material.statements.push(Statement {
                    keyword: keyword.to_ascii_lowercase(),
                    shown: keyword.to_owned(),
                    line: i + 1,
                    rest: rest.to_owned(),
                    taken: false,
                }),
            }
        }
        close(&mut open, &mut left, 1);
        Self { path: path.to_owned(), bytes, materials, left }
    }

    /// A finding about a line.
    pub(super) fn finding(&self, line: usize, message: String) -> Finding {
        let text = self.bytes.split(|b| *b == b'\n').nth(line - 1).unwrap_or_default();
        let text = String::from_utf8_lossy(&text[..text.len().min(1000)]);
        let text = text.trim_end();
        let start = text.len() - text.trim_start().len();
        let at = LineAt {
            file: &self.path.to_string_lossy(),
            text,
            line,
            column: start + 1,
            range: (start, text.len()),
        };
        Finding::new(FindingKind::Parameter, at, message)
    }
}

impl MtlMaterial {
    /// True if there is a statement with this keyword, in small letters.
    pub(super) fn has(&self, keyword: &str) -> bool {
        self.statements.iter().any(|s| s.keyword == keyword)
    }

    /// Takes the last statement with one of these keywords.
    fn take(&mut self, keywords: &[&str]) -> Option<(String, String, usize)> {
        let found = self.statements.iter_mut().rev().find(|s| keywords.contains(&s.keyword.as_str()))?;
        found.taken = true;
        Some((found.rest.clone(), found.shown.clone(), found.line))
    }

    /// Takes the highlight, which was looked at before or has no effect beside what is used.
    pub(super) fn take_highlight(&mut self) {
        self.color("ks");
        self.number("ns");
    }

    /// The numbers of the last statement with a keyword, which is not taken.
    fn peek(&self, keyword: &str) -> Vec<f32> {
        let found = self.statements.iter().rev().find(|s| s.keyword == keyword);
        let words = found.map_or("", |s| &s.rest).split_whitespace();
        words.map_while(|word| word.parse().ok()).filter(|v: &f32| v.is_finite()).collect()
    }

    /// A number that is not taken.
    pub(super) fn peek_number(&self, keyword: &str) -> Option<f32> {
        self.peek(keyword).first().copied()
    }

    /// A colour that is not taken.
    pub(super) fn peek_color(&self, keyword: &str) -> Option<[f32; 3]> {
        match self.peek(keyword)[..] {
            [grey] => Some([grey; 3]),
            [r, g, b, ..] => Some([r, g, b]),
            _ => None,
        }
    }

    /// Tells of a statement although it is used in part.
    pub(super) fn leave_statement(&mut self, keyword: &str) {
        if let Some(s) = self.statements.iter_mut().rev().find(|s| s.keyword == keyword) {
            s.taken = false;
        }
    }

    /// Tells of something about a map.
    pub(super) fn leave(&mut self, map: &MtlMap, what: &str) {
        self.left.add(&format!("{what} of {}", map.keyword), map.line);
    }

    fn fault(&mut self, line: usize, what: &'static str) {
        self.faults.entry(what).or_insert((line, 0)).1 += 1;
    }

    /// The numbers of a statement, before a comment.
    fn numbers(&mut self, keyword: &str, most: usize) -> Option<(Vec<f32>, usize)> {
        let (rest, shown, line) = self.take(&[keyword])?;
        let mut words: Vec<&str> =
            rest.split_whitespace().take_while(|word| !word.starts_with('#')).collect();
        if words.first() == Some(&"-halo") {
            words.remove(0);
            self.left.add(&format!("-halo of {shown}"), line);
        }
        let numbers: Vec<f32> = words.iter().map_while(|word| word.parse().ok()).take(most).collect();
        if !numbers.is_empty() && words.len() > numbers.len() {
            self.left.add(&format!("words after the numbers of {shown}"), line);
        }
        Some((numbers, line))
    }

    /// A colour: three numbers, or one for a grey.
    pub(super) fn color(&mut self, keyword: &str) -> Option<[f32; 3]> {
        let (numbers, line) = self.numbers(keyword, 3)?;
        let color = match numbers[..] {
            [grey] => Some([grey; 3]),
            [r, g, b] => Some([r, g, b]),
            _ => None,
        };
        let color = color.filter(|color| color.iter().all(|v| v.is_finite()));
        if color.is_none() {
            self.fault(line, "this colour is not read: it has one number or three");
        }
        color
    }

    /// A number.
    pub(super) fn number(&mut self, keyword: &str) -> Option<f32> {
        let (numbers, line) = self.numbers(keyword, 1)?;
        let number = numbers.first().copied().filter(|v| v.is_finite());
        if number.is_none() {
            self.fault(line, "a number is missing");
        }
        number
    }

    /// A picture, of the last statement with one of these keywords.
    pub(super) fn map(&mut self, keywords: &[&str]) -> Option<MtlMap> {
        let (rest, keyword, line) = self.take(keywords)?;
        let mut map = MtlMap { file: String::new(), keyword, line, options: Vec::new() };
        let mut rest = rest.as_str();
        while rest.starts_with('-') {
            let (option, after) = word(rest);
            let known = OPTIONS.iter().find(|known| known.0 == option.to_ascii_lowercase());
            // The values of an option that nobody knows are numbers, or a switch.
            let (least, most) = known.map_or((0, 3), |known| (known.1, known.2));
            let is_value = |word: &str| word.parse::<f32>().is_ok() || matches!(word, "on" | "off");
            let (mut words, mut after) = (Vec::new(), after);
            while words.len() < most {
                let (next, behind) = word(after);
                if next.is_empty() || behind.is_empty() || (words.len() >= least && !is_value(next)) {
                    break;
                }
                words.push(next.to_ascii_lowercase());
                after = behind;
            }
            if words.len() < least || (known.is_none() && after.is_empty()) {
                break;
            }
            map.options.push((option.to_ascii_lowercase(), words));
            rest = after;
        }
        let quoted = rest.strip_prefix('"').and_then(|rest| rest.strip_suffix('"'));
        map.file = quoted.unwrap_or(rest).trim().to_owned();
        if map.file.is_empty() {
            self.fault(line, "the name of a picture is missing");
            return None;
        }
        Some(map)
    }

    /// Ends a map: options that were not taken and that would change something are left.
    pub(super) fn end_map(&mut self, map: &MtlMap) {
        for (option, words) in &map.options {
            let value = words.iter().map(|word| number_text(word)).collect::<Vec<_>>().join(" ");
            let neutral = OPTIONS.iter().any(|known| known.0 == *option && known.3.contains(&value.as_str()));
            if !neutral {
                self.left.add(&format!("{option} of {}", map.keyword), map.line);
            }
        }
    }

    /// All that was not used.
    pub(super) fn left(&self) -> Leftovers {
        let mut left = self.left.clone();
        for Statement { keyword, shown, line, rest, .. } in self.statements.iter().filter(|s| !s.taken) {
            let values: Option<Vec<f32>> = rest.split_whitespace().map(|word| word.parse().ok()).collect();
            let neutral = NEUTRAL.iter().any(|(name, neutral)| {
                let is = |values: &Vec<f32>| neutral.iter().any(|n| values.iter().all(|v| v == n));
                *name == *keyword && values.as_ref().is_some_and(is)
            });
            if !neutral && !AMBIENT.contains(&keyword.as_str()) {
                left.add(shown, *line);
            }
        }
        left
    }

    /// The faults of its statements: the first line, the number, and the kind of each.
    pub(super) fn faults(&self) -> impl Iterator<Item = (usize, usize, &'static str)> {
        self.faults.iter().map(|(what, (line, count))| (*line, *count, *what))
    }
}

impl MtlMap {
    /// Takes the words of an option.
    fn take(&mut self, option: &str) -> Option<Vec<String>> {
        let at = self.options.iter().rposition(|known| known.0 == option)?;
        Some(self.options.remove(at).1)
    }

    /// Takes a switch.
    pub(super) fn switch(&mut self, option: &str) -> Option<bool> {
        self.take(option).map(|words| words.first().is_some_and(|word| word == "on"))
    }

    /// Takes the finite numbers of an option, where fewer are given those of `default`.
    pub(super) fn numbers<const N: usize>(&mut self, option: &str, default: [f64; N]) -> [f64; N] {
        let mut numbers = default;
        for (number, word) in numbers.iter_mut().zip(self.take(option).iter().flatten()) {
            *number = word.parse().ok().filter(|v: &f64| v.is_finite()).unwrap_or(*number);
        }
        numbers
    }
}

/// The first word, and what follows it without blanks in front.
fn word(text: &str) -> (&str, &str) {
    let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    (word, rest.trim_start())
}

/// A number in its shortest form, so that `1.000` is `1`; other words as they are.
fn number_text(word: &str) -> String {
    word.parse::<f32>().map_or_else(|_| word.to_owned(), |v| v.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn material(text: &str) -> MtlMaterial {
        let text = format!("newmtl a\n{text}");
        MtlFile::new(Path::new("a.mtl"), text.into_bytes()).materials.remove("a").expect("a material")
    }

    #[test]
    fn names_of_pictures_may_have_blanks_and_options() {
        for (line, file, left) in [
            ("map_Kd a.png", "a.png", None),
            ("map_Kd wood tex 2.png", "wood tex 2.png", None),
            ("map_Kd -bm 1.0 wood tex 2.png", "wood tex 2.png", None),
            (
                "map_Kd -s 2 2 1 -o 0.5 maps/plain.png",
                "maps/plain.png",
                Some("`-s of map_Kd`, `-o of map_Kd`"),
            ),
            ("map_Kd -clamp on -blendu on \"a b.png\"", "a b.png", Some("`-clamp of map_Kd`")),
            ("map_Kd -mm 0.1 2 2.png", "2.png", Some("`-mm of map_Kd`")),
            ("map_Kd -new 1 2 a b.png", "a b.png", Some("`-new of map_Kd`")),
            ("map_Kd -odd.png", "-odd.png", None),
            ("map_Kd -s 1 1 1 5", "5", None),
            ("map_Kd -type sphere a.png", "a.png", Some("`-type of map_Kd`")),
        ] {
            let mut material = material(line);
            let map = material.map(&["map_kd"]).expect(line);
            material.end_map(&map);
            assert_eq!(map.file, file, "{line}");
            let note = material.left().note().map(|note| note.0);
            assert_eq!(note, left.map(|left| format!("not used: {left}")), "{line}");
        }
        for line in ["map_Kd", "map_Kd -s 2", "map_Kd \"\""] {
            let mut material = material(line);
            let file = material.map(&["map_kd"]).map(|map| map.file);
            assert!(file.is_none_or(|file| file == "-s 2"), "{line}");
        }
    }

    #[test]
    fn what_is_not_taken_is_left_unless_it_asks_for_nothing() {
        let mut material =
            material("Kd 1 0 0\nKd 0.5 # grey\nKs 0 0 0\nKe 0 0 1\nsharpness 60\nnew 1\nTf 1 1 1\nKa 1 0 0");
        assert_eq!(material.color("kd"), Some([0.5; 3]));
        assert_eq!(material.left().note().expect("some").0, "not used: `Kd`, `Ke`, `new`");
        let mut short = self::material("Kd 0.5 1\nNi\nd 0.5 0.5");
        assert_eq!((short.color("kd"), short.number("ni"), short.number("d")), (None, None, Some(0.5)));
        assert_eq!(short.faults().map(|fault| fault.0).collect::<Vec<_>>(), [3, 2]);
        assert_eq!(short.left().note().expect("some").0, "not used: `words after the numbers of d`");
        let stray = MtlFile::new(Path::new("a.mtl"), b"Kd 1\nnewmtl a\nnewmtl a\n".to_vec());
        assert_eq!(stray.left.note().expect("some").0, "not used: `Kd`, `newmtl a`");
    }
}
