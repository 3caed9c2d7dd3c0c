//! The emitters of a scene by name, and how they form groups of which a render makes a picture each.

use std::collections::{HashMap, HashSet};

use super::desc::{Name, Place, SceneDesc};
use super::limits::LIGHT_GROUPS as MOST_GROUPS;
use super::suggest;

/// The group of the emitters that no other group has.
pub const OTHERS: &str = "others";

/// Names that other layers of a picture's file have.
const RESERVED: &[&str] = &["camera", "light", "variance", "denoised"];

/// Longest name of an emitter or of a group, in characters.
const LONGEST_NAME: usize = 60;

/// Something that emits: a shape, a light that is no shape, or a medium.
#[derive(Clone, Debug, PartialEq)]
pub struct Emitter {
    /// Its `id`, with `_` for the signs that part names; without one the name of its plugin, with a number if there are several such.
    pub name: String,
    /// Its number: emitting shapes first, then the other lights, then all media, each in the order of the description.
    pub source: usize,
}

/// A group of lights.
#[derive(Clone, Debug, PartialEq)]
pub struct LightGroup {
    /// Its name, which is that of its layer in a picture's file.
    pub name: String,
    /// Its emitters.
    pub emitters: Vec<Emitter>,
}

/// A group of lights as the user names it.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedGroup {
    /// Its name.
    pub name: String,
    /// The names of its emitters.
    pub emitters: Vec<String>,
}

/// Reads `NAME=EMITTER,…;…`; a group of one emitter may be that emitter alone.
///
/// # Errors
///
/// If the text is invalid; the message says why.
pub fn parse(text: &str) -> Result<Vec<NamedGroup>, String> {
    let mut groups = Vec::<NamedGroup>::new();
    for part in text.split(';').map(str::trim).filter(|part| !part.is_empty()) {
        let (name, list) = part.split_once('=').unwrap_or((part, part));
        let name = name.trim().to_owned();
        let emitters: Vec<String> =
            list.split(',').map(|emitter| emitter.trim().to_owned()).filter(|e| !e.is_empty()).collect();
        if name.is_empty() || name.chars().count() > LONGEST_NAME || name.contains(',') || emitters.is_empty()
        {
            return Err(format!(
                "`{part}` is no group: expected NAME=EMITTER,EMITTER,… with a name of up to {LONGEST_NAME} characters"
            ));
        }
        if RESERVED.contains(&name.as_str()) {
            return Err(format!(
                "a group cannot be named `{name}`: the picture's file has such a layer; choose another name"
            ));
        }
        if groups.iter().any(|group| group.name == name) {
            return Err(format!("the group `{name}` is given twice: list all its emitters in one place"));
        }
        groups.push(NamedGroup { name, emitters });
    }
    match groups.is_empty() {
        true => Err("no group is given: expected NAME=EMITTER,EMITTER,…;…".to_owned()),
        false => Ok(groups),
    }
}

/// All emitters of a scene in the order of its file, each name once.
pub fn emitters(desc: &SceneDesc) -> Vec<Emitter> {
    let shapes = desc.shapes.iter().filter(|shape| shape.emission.is_some());
    let shapes = shapes.map(|shape| (shape.place, shape.id.clone(), shape.kind.plugin()));
    let lights = desc.lights.iter().enumerate().map(|(i, light)| {
        let id = desc.names.lights.get(i).and_then(|name| name.id.clone());
        (light.place(), id, light.plugin())
    });
    let mut all: Vec<_> = shapes.chain(lights).enumerate().collect();
    if desc.has_emissive_media() {
        let first = all.len();
        for i in desc.used_media() {
            if let Some(medium) = desc.media.get(i).filter(|medium| medium.shines()) {
                let Name { id, place } = desc.names.media.get(i).cloned().unwrap_or_default();
                all.push((first + i, (place, id, medium.plugin())));
            }
        }
    }
    all.sort_by_key(|(_, (Place { file, line, column }, ..))| (*file, *line, *column));
    let mut named = Vec::<Emitter>::new();
    let (mut taken, mut numbers) = (HashSet::<String>::new(), HashMap::<String, u32>::new());
    for (source, (_, id, kind)) in all {
        let id = id
            .map(|id| id.trim().replace([',', ';', '='], "_").chars().take(LONGEST_NAME).collect::<String>());
        let base = id.filter(|id| !id.is_empty()).unwrap_or_else(|| kind.to_owned());
        // Where it is taken, the first free number behind it: scenes have thousands of lamps without a name.
        let number = numbers.entry(base.clone()).or_insert(1);
        let mut name = base.clone();
        while !taken.insert(name.clone()) {
            *number += 1;
            name = format!("{base}_{number}");
        }
        named.push(Emitter { name, source });
    }
    named
}

/// The groups that are formed without being told: each emitter is one, in the order of the file. Where these are too many, emitters whose names
/// differ in a number at their end are one group; where groups are still too many, the strongest stay by themselves and all others are one.
/// `power` has the share of each emitter's light by its number; emitters that it does not tell of, which are media, count as strong.
pub fn each(emitters: Vec<Emitter>, power: &[f32]) -> Vec<LightGroup> {
    let too_many = emitters.len() > MOST_GROUPS;
    let mut groups = Vec::<LightGroup>::new();
    for emitter in emitters {
        let name = if too_many { stem(&emitter.name).to_owned() } else { emitter.name.clone() };
        match groups.iter_mut().find(|group| group.name == name) {
            Some(group) => group.emitters.push(emitter),
            None => groups.push(LightGroup { name, emitters: vec![emitter] }),
        }
    }
    for LightGroup { name, emitters } in &mut groups {
        if let [alone] = emitters.as_slice() {
            name.clone_from(&alone.name);
        }
    }
    if groups.len() > MOST_GROUPS {
        let power_of = |group: &LightGroup| -> f32 {
            group
                .emitters
                .iter()
                .map(|emitter| power.get(emitter.source).copied().unwrap_or(f32::INFINITY))
                .sum()
        };
        // Of equals the first ones.
        let mut by_power: Vec<usize> = (0..groups.len()).collect();
        by_power.sort_by(|a, b| power_of(&groups[*b]).total_cmp(&power_of(&groups[*a])));
        let strongest = &by_power[..MOST_GROUPS - 1];
        let (mut strong, mut weak) = (Vec::new(), Vec::new());
        for (i, group) in groups.into_iter().enumerate() {
            if strongest.contains(&i) { strong.push(group) } else { weak.extend(group.emitters) }
        }
        add_others(&mut strong, weak);
        groups = strong;
    }
    for i in 0..groups.len() {
        let (before, group) = groups.split_at_mut(i);
        let Some(LightGroup { name, .. }) = group.first_mut() else { continue };
        let is_free = |name: &str| !RESERVED.contains(&name) && before.iter().all(|group| group.name != name);
        *name = free_name(std::mem::take(name), is_free);
    }
    groups
}

/// The name, or if it is taken the first free one of those with a number behind it.
fn free_name(name: String, is_free: impl Fn(&str) -> bool) -> String {
    let numbered = (2..).map(|n| format!("{name}_{n}"));
    std::iter::once(name.clone()).chain(numbered).find(|name| is_free(name)).unwrap_or(name)
}

/// Adds the emitters that are in no group as the group [`OTHERS`].
fn add_others(groups: &mut Vec<LightGroup>, others: Vec<Emitter>) {
    match groups.iter_mut().find(|group| group.name == OTHERS) {
        _ if others.is_empty() => {}
        Some(group) => group.emitters.extend(others),
        None => groups.push(LightGroup { name: OTHERS.to_owned(), emitters: others }),
    }
}

/// The name without a number at its end and what parts the two.
fn stem(name: &str) -> &str {
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
    if stem.len() == name.len() {
        return name;
    }
    let stem = stem.trim_end_matches(['_', '-', '.', ' ']);
    if stem.is_empty() { name } else { stem }
}

/// The groups that the user names; the emitters that none of them names are the group [`OTHERS`].
///
/// # Errors
///
/// If a name fits no emitter or no group is left; the two texts are the message and the help.
pub fn named(emitters: Vec<Emitter>, wanted: &[NamedGroup]) -> Result<Vec<LightGroup>, [String; 2]> {
    let mut free: Vec<Option<Emitter>> = emitters.iter().cloned().map(Some).collect();
    let mut groups = Vec::<LightGroup>::new();
    for NamedGroup { name: group, emitters: names } in wanted {
        let mut own = Vec::new();
        for name in names {
            let Some(at) = emitters.iter().position(|emitter| emitter.name == *name) else {
                let names: Vec<&str> = emitters.iter().map(|emitter| emitter.name.as_str()).collect();
                let what = format!("the scene has no emitter `{name}` for the group `{group}`");
                return Err([what, known(name, &names)]);
            };
            let Some(emitter) = free[at].take() else {
                let what = format!("the emitter `{name}` is named twice");
                return Err([what, "each emitter belongs to one group".to_owned()]);
            };
            own.push(emitter);
        }
        groups.push(LightGroup { name: group.clone(), emitters: own });
    }
    add_others(&mut groups, free.into_iter().flatten().collect());
    if groups.len() > MOST_GROUPS {
        let what = format!("{} groups of lights are more than {MOST_GROUPS}", groups.len());
        return Err([
            what,
            format!("emitters that no group names are the group `{OTHERS}`, which counts, too"),
        ]);
    }
    Ok(groups)
}

/// Advice for a name that is not known: the nearest one, if one is near, and all.
pub fn known(name: &str, names: &[&str]) -> String {
    let near = suggest::nearest_or(name, names.iter().copied(), "");
    format!("{near}{}known here: {}", if near.is_empty() { "" } else { " " }, names.join(", "))
}

/// The number of the group of each emitter, by the number of the emitter.
pub fn of_sources(groups: &[LightGroup]) -> Vec<u8> {
    let pairs =
        groups.iter().zip(0u8..).flat_map(|(group, n)| group.emitters.iter().map(move |e| (e.source, n)));
    let mut numbers = vec![0; pairs.clone().map(|(source, _)| source + 1).max().unwrap_or(0)];
    pairs.for_each(|(source, n)| numbers[source] = n);
    numbers
}

/// The groups as [`parse`] reads them.
pub fn text(groups: &[LightGroup]) -> String {
    let list = |group: &LightGroup| {
        let names: Vec<&str> = group.emitters.iter().map(|emitter| emitter.name.as_str()).collect();
        format!("{}={}", group.name, names.join(","))
    };
    groups.iter().map(list).collect::<Vec<_>>().join(";")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(names: &[&str]) -> Vec<Emitter> {
        names.iter().enumerate().map(|(source, name)| Emitter { name: (*name).to_owned(), source }).collect()
    }

    fn names(groups: &[LightGroup]) -> Vec<&str> {
        groups.iter().map(|group| group.name.as_str()).collect()
    }

    #[test]
    fn few_emitters_are_a_group_each() {
        let groups = each(all(&["lamp_1", "sky", "light"]), &[]);
        assert_eq!(names(&groups), ["lamp_1", "sky", "light_2"], "a layer `light` is there already");
        assert_eq!(of_sources(&groups), [0, 1, 2]);
    }

    #[test]
    fn many_emitters_are_joined_by_name_and_then_by_power() {
        let lamps: Vec<String> = (1..=9).map(|n| format!("lamp_{n:02}")).collect();
        let mut list: Vec<&str> = lamps.iter().map(String::as_str).collect();
        list.push("sky");
        list.push("neon_1");
        assert_eq!(names(&each(all(&list), &[])), ["lamp", "sky", "neon_1"]);
        let letters = ["a", "b", "c", "d", "e", "f", "g", "h", "i"];
        let groups = each(all(&letters), &[9.0, 1.0, 8.0, 7.0, 6.0, 5.0, 4.0, 1.0, 1.0]);
        assert_eq!(names(&groups), ["a", "b", "c", "d", "e", "f", "g", OTHERS]);
        assert_eq!(of_sources(&groups), [0, 1, 2, 3, 4, 5, 6, 7, 7]);
        let groups = each(all(&letters), &[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 9.0]);
        assert_eq!(text(&groups), "a=a;b=b;c=c;d=d;e=e;f=f;i=i;others=g,h");
    }

    #[test]
    fn the_user_names_groups() {
        let wanted = parse("key = lamp1, lamp2; sky").expect("valid");
        let groups = named(all(&["lamp1", "sky", "lamp2", "neon"]), &wanted).expect("all are there");
        assert_eq!(text(&groups), "key=lamp1,lamp2;sky=sky;others=neon");
        assert_eq!(of_sources(&groups), [0, 1, 0, 2]);
    }

    #[test]
    fn what_is_wrong_is_said() {
        for (bad, why) in [
            ("", "no group"),
            ("=a", "no group"),
            ("a=", "no group"),
            ("a=b;a=c", "twice"),
            ("light=a", "such a layer"),
        ] {
            let said = parse(bad).expect_err(bad);
            assert!(said.contains(why), "{bad}: {said}");
        }
        let refused = |spec: &str| {
            named(all(&["lamp1", "sky"]), &parse(spec).expect("valid")).expect_err(spec).join("; ")
        };
        assert_eq!(
            refused("key=lamp3"),
            "the scene has no emitter `lamp3` for the group `key`; did you mean `lamp1`? known here: lamp1, sky"
        );
        assert!(refused("key=sky,lamp1;fill=sky").contains("named twice"));
    }
}
