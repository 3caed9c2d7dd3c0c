//! The parameters of the materials of models: values with textures, and the bsdf that all of them share, by the names of
//! `principled` (Burley 2012).

use glam::DAffine3;

use super::text::SceneText;

/// A bitmap of the scene.
#[derive(Clone)]
pub(super) struct MaterialBitmap {
    pub(super) file: String,
    /// Its numbers are linear.
    pub(super) raw: bool,
    pub(super) nearest: bool,
    /// `repeat`, `mirror` or `clamp`.
    pub(super) wrap: &'static str,
    pub(super) to_uv: DAffine3,
}

impl MaterialBitmap {
    pub(super) fn write(&self, text: &mut SceneText<'_>, name: &str) {
        text.object("texture", "bitmap", &[("name", name)], |text| {
            text.value("string", "filename", &self.file);
            if self.raw {
                text.value("boolean", "raw", true);
            }
            if self.nearest {
                text.value("string", "filter_type", "nearest");
            }
            if self.wrap != "repeat" {
                text.value("string", "wrap_mode", self.wrap);
            }
            if self.to_uv != DAffine3::IDENTITY {
                text.transform("to_uv", &self.to_uv);
            }
        });
    }
}

/// A number or a colour, or a texture of such.
#[derive(Clone)]
pub(super) enum MaterialValue {
    Number(f32),
    Rgb([f32; 3]),
    Texture(MaterialBitmap),
    /// An attribute of the mesh.
    Attribute(&'static str),
    /// A texture times an attribute of the mesh.
    Product(MaterialBitmap, &'static str),
}

impl MaterialValue {
    pub(super) fn write(&self, text: &mut SceneText<'_>, name: &str) {
        match self {
            Self::Number(v) => text.value("float", name, v),
            Self::Rgb(rgb) => text.rgb(name, *rgb),
            Self::Texture(bitmap) => bitmap.write(text, name),
            Self::Attribute(of) => text.attribute(name, of),
            Self::Product(bitmap, of) => {
                text.object("texture", "product", &[("name", name)], |text| {
                    bitmap.write(text, "color0");
                    text.attribute("color1", of);
                });
            }
        }
    }
}

/// Radiance of a shape.
#[derive(Clone)]
pub(super) struct EmittedRadiance {
    pub(super) value: MaterialValue,
    /// The back shines, too.
    pub(super) both_sides: bool,
}

impl EmittedRadiance {
    /// Writes the parameter `radiance`.
    pub(super) fn write(&self, text: &mut SceneText<'_>) {
        self.value.write(text, "radiance");
    }
}

/// Parameters of a bsdf.
pub(super) type Parameters = Vec<(&'static str, MaterialValue)>;

/// A bsdf with its parameters.
pub(super) struct SurfaceModel {
    pub(super) kind: &'static str,
    pub(super) parameters: Parameters,
    /// Light gets through.
    pub(super) transmits: bool,
}

impl SurfaceModel {
    /// Writes the bsdf `id`, bent by `normals`, with `opacity` outside of all else.
    pub(super) fn write(
        &self,
        text: &mut SceneText<'_>,
        id: &str,
        normals: Option<&MaterialBitmap>,
        opacity: Option<&MaterialValue>,
    ) {
        let Self { kind, parameters, transmits } = self;
        let surface = |text: &mut SceneText<'_>, attributes: &[(&str, &str)]| {
            text.object("bsdf", kind, attributes, |text| {
                parameters.iter().for_each(|(name, value)| value.write(text, name));
            });
        };
        let bent = |text: &mut SceneText<'_>, attributes: &[(&str, &str)]| match normals {
            None => surface(text, attributes),
            Some(normals) => text.object("bsdf", "normalmap", attributes, |text| {
                normals.write(text, "normalmap");
                surface(text, &[]);
            }),
        };
        let sides = |text: &mut SceneText<'_>, attributes: &[(&str, &str)]| match *transmits {
            true => bent(text, attributes),
            false => text.object("bsdf", "twosided", attributes, |text| bent(text, &[])),
        };
        match opacity {
            None => sides(text, &[("id", id)]),
            Some(opacity) => text.object("bsdf", "mask", &[("id", id)], |text| {
                opacity.write(text, "opacity");
                sides(text, &[]);
            }),
        }
    }
}

/// `clearcoat_gloss` of the α that a roughness means: it runs from α = .1 to α = .001.
pub(super) fn gloss(roughness: f32) -> f32 {
    ((0.1 - roughness * roughness) / 0.099).clamp(0.0, 1.0)
}

/// Luminance of a linear colour (BT.709).
pub(super) fn luminance([r, g, b]: [f32; 3]) -> f32 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Whether a colour is a grey.
pub(super) fn is_grey([r, g, b]: [f32; 3]) -> bool {
    r == g && g == b
}

/// The index of refraction that reflects this much at normal incidence.
pub(super) fn index_of(at_normal: f32) -> f32 {
    let root = at_normal.clamp(0.0, 0.9).sqrt();
    (1.0 + root) / (1.0 - root)
}
