//! Suggestions for misspelt names.

/// The candidate nearest to `name`, if it is near enough to be a slip of the hand. Case is free.
fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let length = name.chars().take(65).count();
    if !(1..=64).contains(&length) {
        return None;
    }
    let (name, allowed) = (name.to_ascii_lowercase(), (length / 3).clamp(1, 3));
    let distance = |c: &str| strsim::osa_distance(&name, &c.to_ascii_lowercase());
    let by_distance = candidates.into_iter().map(|c| (distance(c), c));
    by_distance.min_by_key(|(d, _)| *d).filter(|(d, _)| *d <= allowed).map(|(_, c)| c)
}

/// “did you mean …?”, or another advice where no candidate is near.
pub(crate) fn nearest_or<'a>(
    name: &str,
    candidates: impl IntoIterator<Item = &'a str>,
    advice: impl Into<String>,
) -> String {
    nearest(name, candidates).map_or_else(|| advice.into(), |near| format!("did you mean `{near}`?"))
}

/// “did you mean …?”, or a list of the known names.
pub(crate) fn hint(name: &str, candidates: &[&str]) -> String {
    nearest_or(name, candidates.iter().copied(), format!("known here: {}", candidates.join(", ")))
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
