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

/// Edits (insert, delete, replace, swap neighbours; case is free) from `a` to `b`: Damerau 1964, each
/// letter touched once.
fn distance(a: &[char], b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let same = |i: usize, j: usize| a[i].eq_ignore_ascii_case(&b[j]);
    let mut before: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 0..a.len() {
        let mut row = vec![i + 1];
        for j in 0..b.len() {
            let replaced = last[j] + usize::from(!same(i, j));
            let mut best = replaced.min(row[j] + 1).min(last[j + 1] + 1);
            if i > 0 && j > 0 && same(i, j - 1) && same(i - 1, j) {
                best = best.min(before[j - 1] + 1);
            }
            row.push(best);
        }
        before = std::mem::replace(&mut last, row);
    }
    last[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_slips_only() {
        assert_eq!(nearest("reflectence", ["radiance", "reflectance"]), Some("reflectance"));
        assert_eq!(nearest("Fov", ["fov", "foo"]), Some("fov"));
        assert_eq!(nearest("shpae", ["scene", "shape"]), Some("shape"));
        assert_eq!(nearest("zzz", ["fov", "near_clip"]), None);
        assert_eq!(nearest("", ["fov"]), None);
    }
}
