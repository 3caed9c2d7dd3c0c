//! Names of files with `*`.

use std::path::{Path, PathBuf};

/// Files below `folder` that the pattern names, relative to it unless the pattern is absolute, in the order of their names. `*` stands for
/// any part of the name of a file or folder, and for no hidden one.
pub(super) fn expand(folder: &Path, pattern: &str) -> Vec<PathBuf> {
    let mut found = vec![PathBuf::from(if pattern.starts_with('/') { "/" } else { "" })];
    for part in pattern.split('/').filter(|part| !part.is_empty()) {
        if !part.contains('*') {
            found.iter_mut().for_each(|path| path.push(part));
            continue;
        }
        let mut next = Vec::new();
        for base in &found {
            let Ok(entries) = std::fs::read_dir(folder.join(base)) else { continue };
            let names = entries.flatten().filter_map(|entry| entry.file_name().into_string().ok());
            let mut names: Vec<String> =
                names.filter(|name| !name.starts_with('.') && matches(part, name)).collect();
            names.sort();
            next.extend(names.into_iter().map(|name| base.join(name)));
        }
        found = next;
    }
    found.retain(|path| folder.join(path).is_file());
    found
}

/// Whether a name is one that the pattern stands for.
pub(super) fn matches(pattern: &str, name: &str) -> bool {
    let Some((first, rest)) = pattern.split_once('*') else { return pattern == name };
    let Some(name) = name.strip_prefix(first) else { return false };
    let mut ends = name.char_indices().map(|(at, _)| at).chain([name.len()]);
    ends.any(|at| matches(rest, &name[at..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stars_stand_for_any_text() {
        for (pattern, name) in
            [("*.xml", "a.xml"), ("*", ""), ("a*b*c", "a__b_bc"), ("a*", "a"), ("ä*ö", "äxö")]
        {
            assert!(matches(pattern, name), "{pattern} {name}");
        }
        for (pattern, name) in [("*.xml", "a.xml2"), ("a*b", "ab_"), ("a*b*c", "acb"), ("a", "ab")] {
            assert!(!matches(pattern, name), "{pattern} {name}");
        }
    }

    #[test]
    fn patterns_name_files_in_order() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["b/scene.xml", "a/scene.xml", "a/other.xml", ".hidden/scene.xml", "top.xml"] {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
            std::fs::write(path, "").expect("a file");
        }
        let found = |pattern: &str| expand(folder.path(), pattern);
        assert_eq!(found("*/scene.xml"), [Path::new("a/scene.xml"), Path::new("b/scene.xml")]);
        assert_eq!(found("*.xml"), [Path::new("top.xml")]);
        assert_eq!(found("a/other.xml"), [Path::new("a/other.xml")]);
        assert!(found("none.xml").is_empty() && found("a").is_empty());
    }
}
