//! “Did you mean …?”

/// The candidate nearest to `name`, if it is near enough to be a slip of the hand.
pub(crate) fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let name: Vec<char> = name.chars().take(65).collect();
    if name.is_empty() || name.len() > 64 {
        return None;
    }
    let allowed = (name.len() / 3).clamp(1, 3);
    let by_distance = candidates.into_iter().map(|c| (distance(&name, c), c));
    by_distance.min_by_key(|(d, _)| *d).filter(|(d, _)| *d <= allowed).map(|(_, c)| c)
}

/// “did you mean …?”, or a list of what there is.
pub(crate) fn hint(name: &str, candidates: &[&str]) -> String {
    match nearest(name, candidates.iter().copied()) {
        Some(c) => format!("did you mean `{c}`?"),
        None => format!("known here: {}", candidates.join(", ")),
    }
}

/// Edits (insert, delete, replace; case is free) from `a` to `b`: Wagner and Fischer 1974.
fn distance(a: &[char], b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let same = usize::from(!ca.eq_ignore_ascii_case(cb));
            let here = (diagonal + same).min(row[j] + 1).min(row[j + 1] + 1);
            diagonal = std::mem::replace(&mut row[j + 1], here);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_slips_only() {
        assert_eq!(nearest("reflectence", ["radiance", "reflectance"]), Some("reflectance"));
        assert_eq!(nearest("Fov", ["fov", "foo"]), Some("fov"));
        assert_eq!(nearest("zzz", ["fov", "near_clip"]), None);
        assert_eq!(nearest("", ["fov"]), None);
    }
}
