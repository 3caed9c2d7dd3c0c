//! Names of channels in files of several views (OpenEXR, “Storing Multi-View Images in OpenEXR Files”).
//!
//! A file has a default view, the first; channels of another have its name before the last part of theirs: `right.R`,
//! `albedo.right.G`. So a program that knows no views finds a picture of the default view.

/// The view of this list that a channel's name tells, or `None` if it tells none: then it is of the default view.
pub(super) fn told<'a>(views: &'a [String], channel: &str) -> Option<&'a str> {
    let view = channel.rsplit('.').nth(1)?;
    views.iter().map(String::as_str).find(|known| *known == view)
}

/// The name of a channel or layer, with that of its view before its last part.
pub(super) fn insert(view: &str, channel: &str) -> String {
    match channel.rsplit_once('.') {
        Some((layer, last)) => format!("{layer}.{view}.{last}"),
        None => format!("{view}.{channel}"),
    }
}

/// The name of a channel without that of its view, which stands before its last part.
pub(super) fn remove(view: &str, channel: &str) -> String {
    let Some((layer, last)) = channel.rsplit_once('.') else { return channel.to_owned() };
    match layer.strip_suffix(view) {
        Some("") => last.to_owned(),
        Some(outer) if outer.ends_with('.') => format!("{outer}{last}"),
        _ => channel.to_owned(),
    }
}

/// The name of a layer whose channels are those of the default view, if `layer` names it with that view's name last: `left` is the layer without
/// a name, `albedo.left` is `albedo`.
pub(super) fn of_default<'a>(views: &[String], layer: &'a str) -> Option<&'a str> {
    match layer.strip_suffix(views.first()?.as_str())? {
        "" => Some(""),
        outer => outer.strip_suffix('.'),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_views_stand_before_the_last_part() {
        let views = ["left".to_owned(), "right".to_owned()];
        for (channel, view, inside) in [
            ("right.R", Some("right"), "R"),
            ("albedo.right.G", Some("right"), "albedo.G"),
            ("a.b.left.Z", Some("left"), "a.b.Z"),
            ("R", None, "R"),
            ("camera.X", None, "camera.X"),
            ("upright.R", None, "upright.R"),
            ("speed.right", None, "speed.right"),
        ] {
            assert_eq!(told(&views, channel), view, "{channel}");
            assert_eq!(remove(view.unwrap_or("right"), channel), inside);
            if let Some(view) = view {
                assert_eq!(insert(view, inside), channel);
            }
        }
        for (layer, found) in
            [("left", Some("")), ("albedo.left", Some("albedo")), ("right", None), ("cleft", None)]
        {
            assert_eq!(of_default(&views, layer), found, "{layer}");
        }
        assert_eq!(of_default(&[], "left"), None);
    }
}
