//! Arbitrary output variables: layers beside the picture that describe the surface seen first and the media before it, as lists of `name:type`.

use crate::image::stereo::Eye;
use crate::scene::limits;

/// A quantity of the first surface that a camera ray hits; 0 if it hits none. Definitions and names are those of Mitsuba 3, but that surfaces which
/// nobody sees, as the boundaries of media, are looked through. Those of the media before that surface, and the last, are ours alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub enum AovKind {
    /// Diffuse reflectance of the material, linear Rec.709.
    Albedo,
    /// Distance along the ray from the near clip plane, world units.
    Depth,
    /// Position, world space.
    Position,
    /// Texture coordinates.
    Uv,
    /// Unit geometric normal of the front, world space.
    GeometricNormal,
    /// Unit shading normal of the front, world space.
    ShadingNormal,
    /// Number of the triangle in the file of its mesh, counted from 0 with those that are left out; of the first triangle of a face of a cube, 0 on other shapes.
    PrimIndex,
    /// Number of the shape in the scene, counted from 1; of what a group holds, that of the instance.
    ShapeIndex,
    /// Transmittance of all media from the near clip plane to the first surface, or to infinity where there is none: the linear Rec.709 of a white
    /// surface there under D65. 1 where there is no medium.
    Transmittance,
    /// Mean distance along the ray from the near clip plane at which light that is scattered before the first surface was scattered last, when equal
    /// light comes from everywhere: ∫ t σₛ T dt / ∫ σₛ T dt with the transmittance T up to t, both of luminance under D65; world units.
    /// 0 where nothing scatters.
    ScatteringDepth,
    /// How far right that point is in the left eye's picture, less how far in the right eye's, pixels: positive (crossed) in front of the plane in which
    /// the eyes converge, as [`Disparity`](crate::scene::desc::Disparity) has it. Where there is no surface it is that of infinity. It is 0
    /// without a second eye.
    Disparity,
}

/// Name in files, kind, and channels, which are separated from the name of the layer by a dot.
const KINDS: &[(&str, AovKind, &[&str])] = &[
    ("albedo", AovKind::Albedo, &["R", "G", "B"]),
    ("depth", AovKind::Depth, &["T"]),
    ("position", AovKind::Position, &["X", "Y", "Z"]),
    ("uv", AovKind::Uv, &["U", "V"]),
    ("geo_normal", AovKind::GeometricNormal, &["X", "Y", "Z"]),
    ("sh_normal", AovKind::ShadingNormal, &["X", "Y", "Z"]),
    ("prim_index", AovKind::PrimIndex, &["I"]),
    ("shape_index", AovKind::ShapeIndex, &["I"]),
    ("transmittance", AovKind::Transmittance, &["R", "G", "B"]),
    ("scattering_depth", AovKind::ScatteringDepth, &["T"]),
    ("disparity", AovKind::Disparity, &["x"]),
];

/// Types that Mitsuba supports and this program does not.
const LEFT_OUT: &[&str] = &["dp_du", "dp_dv", "duv_dx", "duv_dy", "boundary_test"];

/// Names of the layers of the picture itself.
const RESERVED: &[&str] = &["camera", "light", "variance"];

/// Longest name of a layer, bytes.
const LONGEST_NAME: usize = 64;

impl AovKind {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        self.entry().0
    }

    /// The names of its channels.
    pub fn channels(self) -> &'static [&'static str] {
        self.entry().2
    }

    fn entry(self) -> &'static (&'static str, AovKind, &'static [&'static str]) {
        KINDS.iter().find(|entry| entry.1 == self).unwrap_or(&KINDS[0])
    }

    /// Names of all kinds.
    pub fn names() -> Vec<&'static str> {
        KINDS.iter().map(|entry| entry.0).collect()
    }
}

/// A layer.
#[derive(Clone, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub struct AovDesc {
    /// Its name, which stands before its channels.
    pub name: String,
    /// Its content.
    pub kind: AovKind,
}

impl std::fmt::Display for AovDesc {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}", self.name, self.kind.name())
    }
}

impl AovDesc {
    /// Full names of its channels.
    pub fn channels(&self) -> impl Iterator<Item = String> {
        self.channels_of(None)
    }

    /// Full names of its channels in the picture of this eye. A disparity is of one eye or the other, and the name of its layer ends in `L` or
    /// `R`: `disparityL.x` and `disparityR.x`, as in the stereo pictures of the OpenEXR project.
    pub fn channels_of(&self, eye: Option<Eye>) -> impl Iterator<Item = String> {
        let ending = match (self.kind, eye) {
            (AovKind::Disparity, Some(Eye::Left)) => "L",
            (AovKind::Disparity, Some(Eye::Right)) => "R",
            _ => "",
        };
        self.kind.channels().iter().map(move |channel| format!("{}{ending}.{channel}", self.name))
    }
}

/// The layers of a list, and the items that Mitsuba knows and this program does not.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AovList {
    /// The layers.
    pub layers: Vec<AovDesc>,
    /// `name:type` of those that are left out.
    pub left_out: Vec<String>,
}

/// Reads a list `name:type,name:type` (separated by commas or blanks); a type alone is also its name.
///
/// # Errors
///
/// A sentence, for an unknown type, a name that cannot be used or stands twice, and too many layers.
pub fn parse(list: &str) -> Result<AovList, String> {
    let mut found = AovList::default();
    let items = list.split(|c: char| c == ',' || c.is_whitespace()).filter(|item| !item.is_empty());
    for item in items {
        let shown: String = item.chars().take(LONGEST_NAME).collect();
        let (name, kind) = item.rsplit_once(':').unwrap_or((item, item));
        if LEFT_OUT.contains(&kind) {
            found.left_out.push(shown);
            continue;
        }
        let Some((_, kind, _)) = KINDS.iter().find(|entry| entry.0 == kind) else {
            let known = AovKind::names().join(", ");
            return Err(format!("`{shown}` names no layer: write name:type, with one of the types {known}"));
        };
        let usable = (1..=LONGEST_NAME).contains(&name.len()) && !name.contains(char::is_control);
        if !usable || RESERVED.contains(&name) {
            let reserved = RESERVED.join(", ");
            return Err(format!(
                "`{shown}`: the name of a layer has 1 to {LONGEST_NAME} bytes and is none of {reserved}"
            ));
        }
        let layer = AovDesc { name: name.to_owned(), kind: *kind };
        let taken = |channel| found.layers.iter().flat_map(AovDesc::channels).any(|other| other == channel);
        if layer.channels().any(taken) {
            return Err(format!("`{shown}`: another layer has channels of the same name"));
        }
        if found.layers.len() == limits::AOVS {
            return Err(format!("these are more than {} layers", limits::AOVS));
        }
        found.layers.push(layer);
    }
    Ok(found)
}

/// Number of channels of all layers together.
pub fn channel_count(layers: &[AovDesc]) -> usize {
    layers.iter().map(|layer| layer.kind.channels().len()).sum()
}
