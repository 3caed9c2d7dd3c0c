//! Selection of the picture's channels in EXR files of any program.
//!
//! Programs name them `R`, `beauty.R`, `ViewLayer.Combined.R`, `rgba.red`: the layer name ends at the last dot. A layer has colours in `R G
//! B` (or `red green blue`, in any case), or grey in `Y` alone.

use crate::image::exr::Layers;
use crate::image::views;

/// The colours of one layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer<'a> {
    /// Name without the channel's; empty for the unnamed layer.
    pub name: &'a str,
    /// Red, green and blue; all the same for grey.
    channels: [&'a [f32]; 3],
    grey: bool,
}

impl Layer<'_> {
    /// Whether it has a single grey channel.
    pub fn is_grey(&self) -> bool {
        self.grey
    }

    /// R, G, B in rows from the top.
    pub fn pixels(&self) -> Vec<[f32; 3]> {
        let [r, g, b] = self.channels;
        r.iter().zip(g).zip(b).map(|((r, g), b)| [*r, *g, *b]).collect()
    }
}

/// The layer of this name; `None` if it does not exist or has neither colours nor grey. In a file of several views, `right` and
/// `albedo.right` are layers of the view `right`, and the name of the default view may be left out.
pub fn named<'a>(layers: &'a Layers, name: &str) -> Option<Layer<'a>> {
    let find = |name: &str| all(layers).into_iter().find(|layer| layer.name == name);
    find(name).or_else(|| find(views::of_default(&layers.views, name)?))
}

/// The unnamed layer, else the only one with R, G and B, else the only grey one; `None` if there is none, or several.
pub fn main(layers: &Layers) -> Option<Layer<'_>> {
    let all = all(layers);
    let mut fitting: Vec<&Layer<'_>> = all.iter().filter(|layer| layer.name.is_empty()).collect();
    for grey in [false, true] {
        if fitting.is_empty() {
            fitting.extend(all.iter().filter(|layer| layer.grey == grey));
        }
    }
    match fitting[..] {
        [only] => Some(*only),
        _ => None,
    }
}

/// All layers with colours or grey, in the order of the file's channels.
pub fn all(layers: &Layers) -> Vec<Layer<'_>> {
    let mut names: Vec<&str> = Vec::new();
    for (channel, _) in &layers.channels {
        let (name, _) = split(channel);
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names.into_iter().filter_map(|name| layer(layers, name)).collect()
}

fn layer<'a>(layers: &'a Layers, name: &'a str) -> Option<Layer<'a>> {
    let find = |wanted: &[&str]| {
        let is = |channel: &str| {
            let (prefix, last) = split(channel);
            prefix == name && wanted.iter().any(|w| last.eq_ignore_ascii_case(w))
        };
        layers.channels.iter().find(|(channel, _)| is(channel)).map(|(_, values)| values.as_slice())
    };
    if let (Some(r), Some(g), Some(b)) = (find(&["R", "red"]), find(&["G", "green"]), find(&["B", "blue"])) {
        return Some(Layer { name, channels: [r, g, b], grey: false });
    }
    // Y together with X and Z, or with chroma, is not grey.
    let colours = ["R", "G", "X", "RY", "BY"];
    let y = find(&["Y"]).filter(|_| find(&colours).is_none())?;
    Some(Layer { name, channels: [y; 3], grey: true })
}

/// Splits a name into layer and channel.
fn split(channel: &str) -> (&str, &str) {
    channel.rsplit_once('.').unwrap_or(("", channel))
}
