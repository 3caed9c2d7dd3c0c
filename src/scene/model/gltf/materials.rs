//! Materials of glTF as `principled`, which has the same metallic-roughness base (Burley 2012): base colour, α = roughness², index
//! of refraction 1.5.
//!
//! | glTF | here |
//! |---|---|
//! | `alphaMode` `MASK`, `BLEND` | `mask`, outside of all else |
//! | every material that lets no light through | `twosided`: a back face is never meant to be black |
//! | `normalTexture` | `normalmap` |
//! | `KHR_materials_transmission` | `principledthin`; with `KHR_materials_volume` the glass of `principled`, its absorption left out |
//! | `KHR_materials_unlit` | its base colour, diffuse |
//! | `emissiveFactor`, `emissiveTexture`, `KHR_materials_emissive_strength` | the shape's `area` emitter, one-sided |
//! | `COLOR_0` | the base colour, where there is no texture |
//!
//! Occlusion textures are left out, since light itself is occluded.

use std::collections::BTreeMap;

use glam::{DAffine3, DMat3, DVec2, DVec3};
use gltf::material::AlphaMode;
use gltf::texture::{MagFilter, TextureTransform, WrappingMode};

use super::buffers::Buffers;
use super::pictures::{Change, MaterialPictures};
use crate::scene::model::text::SceneText;

/// A bitmap of the scene.
#[derive(Clone)]
struct MaterialBitmap {
    file: String,
    raw: bool,
    nearest: bool,
    wrap: &'static str,
    to_uv: DAffine3,
}

/// A number or a colour, or a texture of such.
enum MaterialValue {
    Number(f32),
    Rgb([f32; 3]),
    Texture(MaterialBitmap),
    VertexColors,
}

/// Radiance of a shape.
#[derive(Clone)]
pub(super) enum EmittedRadiance {
    Uniform([f32; 3]),
    Textured(Box<EmissiveTexture>),
}

/// A picture of radiance.
#[derive(Clone)]
pub(super) struct EmissiveTexture(MaterialBitmap);

impl EmittedRadiance {
    /// Writes the parameter `radiance`.
    pub(super) fn write(&self, text: &mut SceneText<'_>) {
        match self {
            Self::Uniform(rgb) => text.rgb("radiance", *rgb),
            Self::Textured(texture) => texture.0.write(text, "radiance"),
        }
    }
}

/// Key of a material: its index, none for the default, and whether the vertices have colours.
type Key = (Option<usize>, bool);

/// The materials that are written already.
#[derive(Default)]
pub(super) struct Materials {
    known: BTreeMap<Key, (String, Option<EmittedRadiance>)>,
    pictures: MaterialPictures,
}

impl MaterialBitmap {
    fn write(&self, text: &mut SceneText<'_>, name: &str) {
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

impl MaterialValue {
    fn write(&self, text: &mut SceneText<'_>, name: &str) {
        match self {
            Self::Number(v) => text.value("float", name, v),
            Self::Rgb(rgb) => text.rgb(name, *rgb),
            Self::Texture(bitmap) => bitmap.write(text, name),
            Self::VertexColors => text.vertex_colors(name),
        }
    }
}

/// A texture of a material, as its several types in the crate have it.
struct TextureUse<'a> {
    texture: gltf::Texture<'a>,
    transform: Option<TextureTransform<'a>>,
    set: u32,
}

impl<'a> TextureUse<'a> {
    fn of(info: gltf::texture::Info<'a>) -> Self {
        let transform = info.texture_transform();
        let set = transform.as_ref().and_then(TextureTransform::tex_coord).unwrap_or(info.tex_coord());
        Self { texture: info.texture(), transform, set }
    }

    fn of_normals(normals: &gltf::material::NormalTexture<'a>) -> Self {
        Self { texture: normals.texture(), transform: None, set: normals.tex_coord() }
    }

    /// The bitmap of this texture by the picture in `file`.
    fn bitmap(&self, file: String, raw: bool) -> MaterialBitmap {
        let sampler = self.texture.sampler();
        let wrap = match sampler.wrap_s() {
            WrappingMode::Repeat => "repeat",
            WrappingMode::MirroredRepeat => "mirror",
            WrappingMode::ClampToEdge => "clamp",
        };
        let nearest = sampler.mag_filter() == Some(MagFilter::Nearest);
        let to_uv = self.transform.as_ref().map_or(DAffine3::IDENTITY, to_uv);
        MaterialBitmap { file, raw, nearest, wrap, to_uv }
    }
}

/// `KHR_texture_transform`: scale, then turn, then move. A turn is against the clock as the picture is seen, with v downwards.
fn to_uv(transform: &TextureTransform<'_>) -> DAffine3 {
    let (sin, cos) = f64::from(transform.rotation()).sin_cos();
    let [scale, offset] = [transform.scale(), transform.offset()].map(|v| DVec2::from(v.map(f64::from)));
    let columns = [DVec3::new(cos, -sin, 0.0) * scale.x, DVec3::new(sin, cos, 0.0) * scale.y, DVec3::Z];
    let to_uv = DAffine3::from_mat3_translation(
        DMat3::from_cols(columns[0], columns[1], columns[2]),
        offset.extend(0.0),
    );
    let usable = to_uv.is_finite() && to_uv.matrix3.determinant().is_normal();
    if usable { to_uv } else { DAffine3::IDENTITY }
}

/// All textures of a material that are used; the base colour first.
fn textures<'a>(material: &gltf::Material<'a>) -> Vec<TextureUse<'a>> {
    let base = material.pbr_metallic_roughness();
    let infos = [
        base.base_color_texture(),
        base.metallic_roughness_texture(),
        material.emissive_texture(),
        material.transmission().and_then(|t| t.transmission_texture()),
    ];
    let normals = material.normal_texture().map(|normals| TextureUse::of_normals(&normals));
    infos.into_iter().flatten().map(TextureUse::of).chain(normals).collect()
}

impl Materials {
    /// The set of texture coordinates that a material uses: that of its first texture.
    pub(super) fn set_of(&self, material: &gltf::Material<'_>) -> u32 {
        textures(material).first().map_or(0, |texture| texture.set)
    }

    /// Writes a material, once; returns its id and what it emits.
    pub(super) fn of<'a>(
        &mut self,
        material: &gltf::Material<'a>,
        colored: bool,
        text: &mut SceneText<'_>,
        buffers: &mut Buffers<'a>,
    ) -> Result<(String, Option<EmittedRadiance>), String> {
        let key = (material.index(), colored);
        if let Some(known) = self.known.get(&key) {
            return Ok(known.clone());
        }
        let id = text.id(material.name().unwrap_or("material"));
        let sets: Vec<u32> = textures(material).iter().map(|texture| texture.set).collect();
        if sets.windows(2).any(|pair| pair[0] != pair[1]) {
            text.note(format!(
                "the textures of `{id}` have several sets of coordinates: that of the first is used"
            ));
        }
        self.write(&id, material, colored, text, buffers)?;
        let emission = self.emission(material, text, buffers)?;
        self.known.insert(key, (id.clone(), emission.clone()));
        Ok((id, emission))
    }

    fn write<'a>(
        &mut self,
        id: &str,
        material: &gltf::Material<'a>,
        colored: bool,
        text: &mut SceneText<'_>,
        buffers: &mut Buffers<'a>,
    ) -> Result<(), String> {
        let base = material.pbr_metallic_roughness();
        let [r, g, b, a] = base.base_color_factor().map(share);
        let image = base.base_color_texture().map(TextureUse::of);
        let mut picture = |texture: &TextureUse<'a>, change, raw, text: &mut SceneText<'_>| {
            let file = self.pictures.of(&texture.texture, change, text, buffers)?;
            Ok::<_, String>(texture.bitmap(file, raw))
        };
        let color = match &image {
            Some(texture) => {
                let change = if [r, g, b] == [1.0; 3] { Change::None } else { Change::Times([r, g, b]) };
                MaterialValue::Texture(picture(texture, change, false, text)?)
            }
            None if colored && !material.unlit() => MaterialValue::VertexColors,
            None => MaterialValue::Rgb([r, g, b]),
        };
        let opacity = match (material.alpha_mode(), &image) {
            (AlphaMode::Opaque, _) => None,
            (AlphaMode::Blend, None) => Some(MaterialValue::Number(a)),
            (AlphaMode::Mask, None) => {
                Some(MaterialValue::Number(if a < share(material.alpha_cutoff().unwrap_or(0.5)) {
                    0.0
                } else {
                    1.0
                }))
            }
            (mode, Some(texture)) => {
                let cutoff = material.alpha_cutoff().unwrap_or(0.5);
                let cutoff = (mode == AlphaMode::Mask).then(|| share(cutoff));
                Some(MaterialValue::Texture(picture(
                    texture,
                    Change::Alpha { factor: a, cutoff },
                    true,
                    text,
                )?))
            }
        };
        let opacity = opacity.filter(|opacity| !matches!(opacity, MaterialValue::Number(1.0)));
        let packed = base.metallic_roughness_texture().map(TextureUse::of);
        let mut channel = |channel, factor: f32, text: &mut SceneText<'_>| match &packed {
            Some(texture) if factor > 0.0 => {
                picture(texture, Change::Channel { channel, factor }, true, text).map(MaterialValue::Texture)
            }
            _ => Ok(MaterialValue::Number(factor)),
        };
        let roughness = channel(1, share(base.roughness_factor()), text)?;
        let metallic = channel(2, share(base.metallic_factor()), text)?;
        let normals = match material.normal_texture() {
            Some(normals) => {
                let scale = Some(normals.scale()).filter(|s| s.is_finite()).unwrap_or(1.0);
                let change = if scale == 1.0 { Change::None } else { Change::Bend(scale) };
                Some(picture(&TextureUse::of_normals(&normals), change, true, text)?)
            }
            None => None,
        };
        let transmission = material.transmission().map_or(0.0, |t| share(t.transmission_factor()));
        let thin = material.volume().is_none_or(|volume| volume.thickness_factor() <= 0.0);
        let eta = material.ior().filter(|n| (1.0..10.0).contains(n)).unwrap_or(1.5);
        let surface = |text: &mut SceneText<'_>, attributes: &[(&str, &str)]| {
            if material.unlit() {
                return text.object("bsdf", "diffuse", attributes, |text| color.write(text, "reflectance"));
            }
            let kind = if transmission > 0.0 && thin { "principledthin" } else { "principled" };
            text.object("bsdf", kind, attributes, |text| {
                color.write(text, "base_color");
                roughness.write(text, "roughness");
                if kind == "principled" {
                    metallic.write(text, "metallic");
                }
                if transmission > 0.0 {
                    text.value("float", "spec_trans", transmission);
                }
                text.value("float", "eta", eta);
            });
        };
        let bent = |text: &mut SceneText<'_>, attributes: &[(&str, &str)]| match &normals {
            None => surface(text, attributes),
            Some(normals) => text.object("bsdf", "normalmap", attributes, |text| {
                normals.write(text, "normalmap");
                surface(text, &[]);
            }),
        };
        let sides = |text: &mut SceneText<'_>, attributes: &[(&str, &str)]| match transmission > 0.0 {
            true => bent(text, attributes),
            false => text.object("bsdf", "twosided", attributes, |text| bent(text, &[])),
        };
        match &opacity {
            None => sides(text, &[("id", id)]),
            Some(opacity) => text.object("bsdf", "mask", &[("id", id)], |text| {
                opacity.write(text, "opacity");
                sides(text, &[]);
            }),
        }
        Ok(())
    }

    fn emission<'a>(
        &mut self,
        material: &gltf::Material<'a>,
        text: &mut SceneText<'_>,
        buffers: &mut Buffers<'a>,
    ) -> Result<Option<EmittedRadiance>, String> {
        let strength = material.emissive_strength().unwrap_or(1.0);
        let factor = material.emissive_factor().map(|v| v * strength);
        let factor = factor.map(|v| if v.is_finite() { v.clamp(0.0, 1e9) } else { 0.0 });
        if factor == [0.0; 3] {
            return Ok(None);
        }
        let Some(texture) = material.emissive_texture().map(TextureUse::of) else {
            return Ok(Some(EmittedRadiance::Uniform(factor)));
        };
        let file = self.pictures.of(&texture.texture, Change::Light(factor), text, buffers)?;
        let bitmap = texture.bitmap(file, true);
        Ok(Some(EmittedRadiance::Textured(Box::new(EmissiveTexture(bitmap)))))
    }
}

/// A number from 0 to 1; what is none is 1.
fn share(v: f32) -> f32 {
    if v.is_nan() { 1.0 } else { v.clamp(0.0, 1.0) }
}
