//! Tests of `image::layer`.

use pointillist::image::exr::Layers;
use pointillist::image::layer::*;

fn file(names: &[&str]) -> Layers {
    let mut layers = Layers { width: 1, height: 1, ..Layers::default() };
    names.iter().zip(1..).for_each(|(name, i)| layers.push(name, [i as f32]));
    layers
}

#[test]
fn the_picture_is_found_under_any_name() {
    for (names, layer, rgb) in [
        (&["A", "B", "G", "R"][..], "", [4.0, 3.0, 2.0]),
        (&["albedo.B", "albedo.G", "albedo.R", "R", "G", "B"], "", [4.0, 5.0, 6.0]),
        (&["beauty.B", "beauty.G", "beauty.R", "Z"], "beauty", [3.0, 2.0, 1.0]),
        (&["View.Combined.R", "View.Combined.G", "View.Combined.B"], "View.Combined", [1.0, 2.0, 3.0]),
        (&["rgba.red", "rgba.green", "rgba.blue", "variance.Y"], "rgba", [1.0, 2.0, 3.0]),
        (&["Y", "A"], "", [1.0; 3]),
        (&["Y", "beauty.R", "beauty.G", "beauty.B"], "", [1.0; 3]),
        (&["grey.Y"], "grey", [1.0; 3]),
    ] {
        let layers = file(names);
        let found = main(&layers).unwrap_or_else(|| panic!("nothing in {names:?}"));
        assert_eq!((found.name, found.pixels()[0]), (layer, rgb), "{names:?}");
    }
}

#[test]
fn what_is_not_clear_is_not_guessed() {
    let two = ["a.R", "a.G", "a.B", "b.R", "b.G", "b.B", "variance.Y"];
    assert_eq!(main(&file(&two)), None);
    assert_eq!(named(&file(&two), "b").map(|l| l.pixels()), Some(vec![[4.0, 5.0, 6.0]]));
    assert_eq!(named(&file(&two), "c"), None);
    assert_eq!(all(&file(&two)).iter().map(|l| l.name).collect::<Vec<_>>(), ["a", "b", "variance"]);
    for names in [&["Z", "A"][..], &["R", "G"], &["Y", "RY", "BY"], &["X", "Y", "Z"], &["a.Y", "b.Y"], &[]] {
        assert_eq!(main(&file(names)), None, "{names:?}");
    }
}
