//! Tests of `image::exr`: files of several views. `foundations/image_files.rs` has those of one.

use std::fs;
use std::path::{Path, PathBuf};

use exr::prelude::*;
use pointillist::image::Attribute;
use pointillist::image::bitmap::Bitmap;
use pointillist::image::compare::Picture;
use pointillist::image::exr as files;
use pointillist::image::exr::Layers;
use pointillist::image::layer;

/// The folder that files of these tests are written to; they stay there for other readers to be tried on.
fn folder() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("stereo");
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// One eye's picture, whose numbers begin at `first`.
fn eye(first: f32) -> Layers {
    let mut layers = Layers { width: 5, height: 3, ..Layers::default() };
    for (i, name) in
        ["R", "G", "B", "camera.X", "variance.Y", "albedo.R", "albedo.G", "albedo.B"].into_iter().enumerate()
    {
        layers.push(name, (0..15).map(|k| first + i as f32 + 0.01 * k as f32));
    }
    let number = |name: &str, value: f32| (name.to_owned(), Attribute::Number(value.into()));
    layers.attributes = vec![number("cameraPaths", 1000.0 * first), number("seed", 3.0)];
    layers.attributes.push(("scene".to_owned(), Attribute::Text("Küche.xml".to_owned())));
    layers
}

fn both() -> Layers {
    Layers::of_views(vec![("left", eye(1.0)), ("right", eye(20.0))]).unwrap()
}

fn sorted(mut layers: Layers) -> Layers {
    layers.channels.sort_by(|a, b| a.0.cmp(&b.0));
    layers.attributes.sort_by(|a, b| a.0.cmp(&b.0));
    layers
}

#[test]
fn views_are_written_and_read_again() {
    let path = folder().join("views.exr");
    files::write(&path, &both()).unwrap();
    let read = files::read(&path).unwrap();
    assert_eq!(read.views, ["left", "right"]);
    for (view, first) in [("left", 1.0), ("right", 20.0)] {
        assert_eq!(sorted(read.view(view).unwrap()), sorted(eye(first)), "{view}");
    }
    assert_eq!(read.view("middle"), None);
    // What differs is told by the name of the view, and what does not once.
    assert_eq!(read.attribute("cameraPaths"), Some(&Attribute::Number(1000.0)));
    assert_eq!(read.attribute("right.cameraPaths"), Some(&Attribute::Number(20_000.0)));
    assert_eq!((read.attributes.len(), read.attribute("right.seed")), (4, None));
    // What was read is written to the same bytes.
    let (bytes, again) = (fs::read(&path).unwrap(), folder().join("again.exr"));
    files::write(&again, &read).unwrap();
    assert!(bytes == fs::read(&again).unwrap());
}

/// By OpenEXR's convention: one part for each view, that of the default view first, with its name as the attribute `view`; channels without it.
#[test]
fn each_view_is_a_part() {
    let path = folder().join("parts.exr");
    files::write(&path, &both()).unwrap();
    let meta = exr::meta::MetaData::read_from_file(&path, true).unwrap();
    let views = meta.headers.iter().map(|part| part.own_attributes.view_name.clone().unwrap().to_string());
    assert_eq!(views.collect::<Vec<_>>(), ["left", "right"]);
    for part in &meta.headers {
        assert!(part.own_attributes.layer_name == part.own_attributes.view_name);
        assert!(part.own_attributes.multi_view_names.is_none());
        let names: Vec<String> = part.channels.list.iter().map(|channel| channel.name.to_string()).collect();
        assert_eq!(names, ["B", "G", "R", "albedo.B", "albedo.G", "albedo.R", "camera.X", "variance.Y"]);
    }
}

/// What readers of one picture see is the left eye's; the right eye's is a layer, and each has its variance.
#[test]
fn a_view_is_compared_by_its_name() {
    let path = folder().join("compared.exr");
    files::write(&path, &both()).unwrap();
    for (wanted, layer, first) in
        [(None, "", 1.0), (Some("left"), "", 1.0), (Some("right"), "right", 20.0), (Some(""), "", 1.0)]
    {
        let picture = Picture::read(&path, wanted).unwrap();
        assert_eq!(
            (picture.layer.as_str(), picture.rgb.at(0, 0)),
            (layer, [first, first + 1.0, first + 2.0])
        );
        assert_eq!(picture.measured().unwrap().variance[0], f64::from(first) + 4.0);
    }
    for (wanted, first) in [("albedo", 6.0), ("albedo.left", 6.0), ("albedo.right", 25.0)] {
        let picture = Picture::read(&path, Some(wanted)).unwrap();
        assert_eq!(picture.rgb.at(0, 0)[0], first, "{wanted}");
        assert!(picture.measured().is_err(), "the variance is not that of the albedo");
    }
    let error = Picture::read(&path, Some("middle")).unwrap_err().to_string();
    assert!(error.contains("“right”") && error.contains("views left, right"), "{error}");
    let texture = Bitmap::read(&path, false, 100).unwrap();
    assert_eq!(texture.remarks(), ["its views other than left: right"]);
}

/// The older form: one part with all channels, the views listed in an attribute (`exrmultiview`, Nuke).
#[test]
fn views_in_one_part_are_read() {
    let path = folder().join("one_part.exr");
    let names =
        ["R", "G", "B", "right.R", "right.G", "right.B", "light.left.Y", "light.right.Y", "mask.data"];
    let channels = names
        .iter()
        .zip(1..)
        .map(|(name, i)| AnyChannel::new(Text::new_or_panic(name), FlatSamples::F32(vec![i as f32; 2])));
    let views = Some(["left", "right"].map(Text::new_or_panic).to_vec());
    let attributes = LayerAttributes { multi_view_names: views, ..LayerAttributes::default() };
    let channels = AnyChannels::sort(channels.collect());
    let part = Layer::new((2, 1), attributes, Encoding::SMALL_LOSSLESS, channels);
    Image::from_layer(part).write().to_file(&path).unwrap();
    let read = files::read(&path).unwrap();
    assert_eq!(read.views, ["left", "right"]);
    let value = |view: &str, name: &str| read.view(view).unwrap().channel(name).map(|values| values[0]);
    assert_eq!(["R", "G", "B", "light.Y"].map(|name| value("left", name)), [1.0, 2.0, 3.0, 7.0].map(Some));
    assert_eq!(["R", "G", "B", "light.Y"].map(|name| value("right", name)), [4.0, 5.0, 6.0, 8.0].map(Some));
    assert_eq!(layer::main(&read).unwrap().pixels()[0], [1.0, 2.0, 3.0]);
    assert_eq!(layer::named(&read, "light.left").unwrap().pixels()[0], [7.0; 3]);
}

#[test]
fn views_that_make_no_file_are_refused() {
    let small = Layers { width: 1, height: 1, ..Layers::default() };
    for (views, part) in [
        (vec![], "no views"),
        (vec![("left", eye(1.0)), ("right", small)], "5×3 and 1×1"),
        (vec![("left", eye(1.0)), ("left", eye(1.0))], "“left”"),
        (vec![("left.eye", eye(1.0))], "“left.eye”"),
        (vec![("left", eye(1.0)), ("", eye(1.0))], "“”"),
    ] {
        let error = Layers::of_views(views).unwrap_err();
        assert!(error.contains(part), "{error}");
    }
    let mut short = both();
    short.channels.last_mut().unwrap().1.pop();
    let error = files::write(&folder().join("short.exr"), &short).unwrap_err().to_string();
    assert!(error.contains("14 values for 5×3 pixels"), "{error}");
}
