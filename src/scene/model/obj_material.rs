//! Materials of MTL files as bsdfs.
//!
//! MTL says how a picture was drawn in 1990 and not what a surface is, so this is a convention, near that of other importers:
//!
//! | MTL | bsdf |
//! |---|---|
//! | `illum` 4, 6, 7 or 9, unless something else says that it is opaque | `dielectric` with `Ni` and the colour `Tf`; rough by `Pr` |
//! | `Pr`, `Pm`, `Ps`, `Pc`, `Pcr`, `aniso` or a map of them | `principled` |
//! | `illum` 3 or 5 and `Kd` black | `conductor`, a mirror of `Ks` |
//! | `Ks` not black or `map_Ks`, and `Ns` above 1 | `roughplastic`, α = √(2 / (`Ns` + 2)) (Walter et al. 2007), `Ni` where above 1 |
//! | anything else | `diffuse` |
//! | `Ke`, `map_Ke` | an `area` emitter of the shape |
//! | `d` < 1, `Tr` > 0, `map_d` | `mask` with this opacity; of a picture with alpha that is the alpha |
//! | `map_Kd` | in the place of `Kd` |
//! | `norm` | `normalmap` |
//! | `bump`, `map_bump` | `bumpmap`; heights have no unit, so that 1 is a hundredth of the model's size |
//!
//! Of the options of maps `-s`, `-o`, `-clamp`, `-bm` and `-blendu off -blendv off` are used. All but glass is two-sided, since no
//! face of an OBJ file is meant to be black. Colours are linear.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;
use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};
use image::{DynamicImage, GrayImage, ImageFormat, Luma};

use super::mtl::MtlMaterial;
use super::text::SceneText;
use crate::image::bitmap;
use crate::scene::files::SceneFiles;
use crate::scene::limits;

/// Statements of the physically based extension that make a material `principled`, with the parameter and its map.
const PRINCIPLED: [(&str, &str, &str); 5] = [
    ("pr", "map_pr", "roughness"),
    ("pm", "map_pm", "metallic"),
    ("ps", "map_ps", "sheen"),
    ("pc", "map_pc", "clearcoat"),
    ("aniso", "map_aniso", "anisotropic"),
];

/// Radiance of the shapes of a material.
pub(super) enum ObjEmission {
    None,
    Uniform([f32; 3]),
    /// A picture and a factor.
    Textured(MtlBitmap, f32),
}

/// A picture as a texture.
pub(super) struct MtlBitmap {
    file: String,
    raw: bool,
    clamp: bool,
    nearest: bool,
    to_uv: DAffine3,
    /// The factor on heights.
    bump: f64,
}

/// A colour, a number or a picture of such.
enum MtlValue {
    Number(f32),
    Rgb([f32; 3]),
    Bitmap(MtlBitmap),
}

impl ObjEmission {
    /// Writes the emitter of a shape, if it emits.
    pub(super) fn write(&self, text: &mut SceneText<'_>) {
        match self {
            Self::None => {}
            Self::Uniform(rgb) => text.object("emitter", "area", &[], |text| text.rgb("radiance", *rgb)),
            Self::Textured(bitmap, scale) => text.object("emitter", "area", &[], |text| {
                text.object("spectrum", "d65", &[("name", "radiance")], |text| {
                    bitmap.write(text, &[]);
                    text.value("float", "scale", scale);
                });
            }),
        }
    }
}

impl MtlBitmap {
    fn write(&self, text: &mut SceneText<'_>, attributes: &[(&str, &str)]) {
        text.object("texture", "bitmap", attributes, |text| {
            text.value("string", "filename", &self.file);
            if self.raw {
                text.value("boolean", "raw", true);
            }
            if self.nearest {
                text.value("string", "filter_type", "nearest");
            }
            if self.clamp {
                text.value("string", "wrap_mode", "clamp");
            }
            if self.to_uv != DAffine3::IDENTITY {
                text.transform("to_uv", &self.to_uv);
            }
        });
    }
}

impl MtlValue {
    fn write(&self, text: &mut SceneText<'_>, name: &str) {
        match self {
            Self::Number(v) => text.value("float", name, v),
            Self::Rgb(rgb) => text.rgb(name, *rgb),
            Self::Bitmap(bitmap) => bitmap.write(text, &[("name", name)]),
        }
    }
}

/// The pictures of all materials of a model.
pub(super) struct ModelPictures<'f> {
    files: &'f SceneFiles,
    /// Those that are not there.
    pub(super) missing: BTreeSet<String>,
    /// The alpha of pictures as pictures of their own; none of those that have none.
    alphas: BTreeMap<String, Option<String>>,
}

impl<'f> ModelPictures<'f> {
    pub(super) fn new(files: &'f SceneFiles) -> Self {
        Self { files, missing: BTreeSet::new(), alphas: BTreeMap::new() }
    }

    /// A picture of opacity: of one with alpha that is not 1 everywhere, its alpha.
    fn opacity(&mut self, bitmap: MtlBitmap, text: &mut SceneText<'_>) -> MtlBitmap {
        let alpha = match self.alphas.get(&bitmap.file) {
            Some(known) => known.clone(),
            None => {
                let made = self.alpha(&bitmap.file, text);
                self.alphas.insert(bitmap.file.clone(), made.clone());
                made
            }
        };
        MtlBitmap { file: alpha.unwrap_or(bitmap.file), ..bitmap }
    }

    fn alpha(&self, name: &str, text: &mut SceneText<'_>) -> Option<String> {
        let path = text.path.parent().unwrap_or(Path::new("")).join(name.replace('\\', "/"));
        // A picture that cannot be read is reported where the scene names it.
        let bytes = self.files.read(&path, limits::IMAGE_BYTES).ok()?;
        let picture = bitmap::picture(&path, &bytes, limits::IMAGE_PIXELS).ok()?;
        if !picture.color().has_alpha() {
            return None;
        }
        let picture = picture.into_rgba8();
        let alpha = GrayImage::from_fn(picture.width(), picture.height(), |x, y| {
            Luma([picture.get_pixel(x, y).0[3]])
        });
        if alpha.pixels().all(|texel| texel.0 == [u8::MAX]) {
            return None;
        }
        let mut bytes = Cursor::new(Vec::new());
        DynamicImage::from(alpha).write_to(&mut bytes, ImageFormat::Png).ok()?;
        Some(text.file(&format!("alpha-{}.png", self.alphas.len()), bytes.into_inner()))
    }
}

/// Reads the pictures of a material.
struct MtlPictures<'a, 't> {
    text: &'a SceneText<'t>,
    /// Those that are not there.
    missing: &'a mut BTreeSet<String>,
}

impl MtlPictures<'_, '_> {
    /// The picture of the last statement with one of these keywords, if it is there.
    fn of(&mut self, material: &mut MtlMaterial, keywords: &[&str], raw: bool) -> Option<MtlBitmap> {
        let mut map = material.map(keywords)?;
        if !self.text.is_there(&map.file) {
            self.missing.insert(map.file);
            return None;
        }
        let [scale_u, scale_v] = map.numbers("-s", [1.0; 2]);
        let [offset_u, offset_v] = map.numbers("-o", [0.0; 2]);
        // `v` counts upwards in MTL and downwards here: 1 − ((1 − v) · scale + offset).
        let to_uv = DAffine3::from_mat3_translation(
            DMat3::from_diagonal(DVec3::new(scale_u, scale_v, 1.0)),
            DVec3::new(offset_u, 1.0 - scale_v - offset_v, 0.0),
        );
        let [bump] = if keywords.contains(&"bump") { map.numbers("-bm", [1.0]) } else { [1.0] };
        let clamp = map.switch("-clamp").unwrap_or(false);
        let blends = ["-blendu", "-blendv"].map(|option| map.switch(option));
        let nearest = blends == [Some(false); 2];
        if !nearest && blends.contains(&Some(false)) {
            material.leave(&map, "-blendu or -blendv alone");
        }
        material.end_map(&map);
        Some(MtlBitmap { file: map.file, raw, clamp, nearest, to_uv, bump })
    }
}

/// A colour of the file with numbers from 0 to `most`.
fn color(given: Option<[f32; 3]>, default: f32, most: f32) -> [f32; 3] {
    given.unwrap_or([default; 3]).map(|v| v.clamp(0.0, most))
}

/// True for neither black nor white.
fn is_colored(color: [f32; 3]) -> bool {
    color != [0.0; 3] && color != [1.0; 3]
}

/// Writes a material, whose heights are multiplied by `height`; returns its id and what it emits.
pub(super) fn write(
    text: &mut SceneText<'_>,
    material: &mut MtlMaterial,
    height: f32,
    of_model: &mut ModelPictures<'_>,
) -> (String, ObjEmission) {
    material.used = true;
    let id = text.id(&material.name);
    let mut pictures = MtlPictures { text, missing: &mut of_model.missing };
    let emission = emission(material, &mut pictures);
    let given_ior = material.number("ni");
    let ior = given_ior.filter(|ior| *ior > 1.0 && *ior < 10.0).unwrap_or(1.5);
    let kd = material.color("kd");
    let diffuse = color(kd, 0.6, 1.0);
    let opacity = match (material.number("d"), material.has("tr")) {
        (Some(d), _) => {
            // 3ds Max writes both.
            if material.peek_number("tr").is_some_and(|tr| (1.0 - d - tr).abs() < 1e-3) {
                material.number("tr");
            }
            d
        }
        (None, true) => 1.0 - material.number("tr").unwrap_or(0.0),
        (None, false) => 1.0,
    };
    let opacity = opacity.clamp(0.0, 1.0);
    let illum = material.number("illum").unwrap_or(2.0) as i32;
    if !(0..=9).contains(&illum) {
        material.leave_statement("illum");
    }
    if matches!(illum, 4 | 6 | 7 | 9) && !is_opaque(material, kd, given_ior, opacity) {
        glass(text, material, &id, ior);
        if kd.is_some_and(is_colored) {
            material.leave_statement("kd");
        }
        return (id, emission);
    }
    let mut number = |material: &mut MtlMaterial, keyword: &str, map: &str| {
        let bitmap = pictures.of(material, &[map], true).map(MtlValue::Bitmap);
        // A map replaces its number.
        let value = material.number(keyword).map(|v| MtlValue::Number(v.clamp(0.0, 1.0)));
        bitmap.or(value)
    };
    let lobes: Vec<(&str, MtlValue)> = PRINCIPLED
        .iter()
        .filter_map(|(keyword, map, name)| Some((*name, number(material, keyword, map)?)))
        .collect();
    let map_kd = pictures.of(material, &["map_kd"], false);
    let textured = map_kd.is_some();
    if textured {
        material.leave_statement("kd");
    }
    let base = map_kd.map_or(MtlValue::Rgb(diffuse), MtlValue::Bitmap);
    let normals = pictures.of(material, &["norm", "map_norm"], true);
    let heights = match &normals {
        Some(_) => None,
        None => pictures.of(material, &["bump", "map_bump"], true),
    };
    let map_d = pictures.of(material, &["map_d"], true);
    let mut surface = MtlSurface { base, lobes, ior, ..MtlSurface::default() };
    if !surface.lobes.is_empty() {
        surface.gloss = material.number("pcr").map(|v| 1.0 - v.clamp(0.0, 1.0));
        // The highlights of older programs, which the extension replaces.
        material.take_highlight();
    } else {
        surface.classic(material, &mut pictures, illum, diffuse == [0.0; 3] && !textured);
    }
    let bumped = |text: &mut SceneText<'_>| match (&normals, &heights) {
        (Some(normals), _) => text.object("bsdf", "normalmap", &[], |text| {
            normals.write(text, &[("name", "normalmap")]);
            surface.write(text);
        }),
        (None, Some(heights)) => text.object("bsdf", "bumpmap", &[], |text| {
            heights.write(text, &[]);
            text.value("float", "scale", heights.bump * f64::from(height));
            surface.write(text);
        }),
        (None, None) => surface.write(text),
    };
    let sides = |text: &mut SceneText<'_>, attributes: &[(&str, &str)]| {
        text.object("bsdf", "twosided", attributes, bumped);
    };
    match map_d.map(|map| MtlValue::Bitmap(of_model.opacity(map, text))) {
        None if opacity == 1.0 => sides(text, &[("id", &id)]),
        map => text.object("bsdf", "mask", &[("id", &id)], |text| {
            map.unwrap_or(MtlValue::Number(opacity)).write(text, "opacity");
            sides(text, &[]);
        }),
    }
    (id, emission)
}

/// Whether a material with an `illum` of glass is opaque by its other statements, as Maya and 3ds Max write it for any surface.
fn is_opaque(material: &MtlMaterial, kd: Option<[f32; 3]>, ior: Option<f32>, opacity: f32) -> bool {
    let filter = material.peek_color("tf");
    let lets_through = opacity < 1.0 || filter.is_some_and(|filter| filter != [1.0; 3]);
    let colored = kd.is_some_and(is_colored);
    material.has("map_kd")
        || material.has("map_d")
        || match ior {
            Some(ior) if ior > 1.0 => false,
            Some(_) => colored || !lets_through,
            None => colored && !lets_through,
        }
}

/// Glass. Its own reflectance follows from its index.
fn glass(text: &mut SceneText<'_>, material: &mut MtlMaterial, id: &str, ior: f32) {
    let filter = color(material.color("tf"), 1.0, 1.0);
    let alpha = material.number("pr").map_or(0.0, |roughness| roughness.clamp(0.0, 1.0).powi(2));
    material.take_highlight();
    let kind = if alpha > 1e-3 { "roughdielectric" } else { "dielectric" };
    text.object("bsdf", kind, &[("id", id)], |text| {
        text.value("float", "int_ior", ior);
        if filter != [1.0; 3] {
            text.rgb("specular_transmittance", filter);
        }
        if alpha > 1e-3 {
            text.value("float", "alpha", alpha);
        }
    });
}

/// The emission of a material.
fn emission(material: &mut MtlMaterial, pictures: &mut MtlPictures<'_, '_>) -> ObjEmission {
    let bitmap = pictures.of(material, &["map_ke"], false);
    let [r, g, b] = color(material.color("ke"), 0.0, 1e6);
    match bitmap {
        Some(bitmap) => {
            let most = r.max(g).max(b);
            if [r, g, b] != [most; 3] {
                material.leave_statement("ke");
            }
            ObjEmission::Textured(bitmap, if most > 0.0 { most } else { 1.0 })
        }
        None if [r, g, b] == [0.0; 3] => ObjEmission::None,
        None => ObjEmission::Uniform([r, g, b]),
    }
}

/// One side of an opaque surface.
struct MtlSurface {
    base: MtlValue,
    /// Parameters of `principled`; for none it is one of the older models.
    lobes: Vec<(&'static str, MtlValue)>,
    gloss: Option<f32>,
    ior: f32,
    /// A mirror of this colour.
    mirror: Option<MtlValue>,
    /// α of a coat, and its colour where that is a picture.
    coat: Option<(f32, Option<MtlBitmap>)>,
}

impl Default for MtlSurface {
    fn default() -> Self {
        Self {
            base: MtlValue::Number(0.6),
            lobes: Vec::new(),
            gloss: None,
            ior: 1.5,
            mirror: None,
            coat: None,
        }
    }
}

impl MtlSurface {
    /// A mirror, a coat or none, by `illum`, `Ks` and `Ns`.
    fn classic(
        &mut self,
        material: &mut MtlMaterial,
        pictures: &mut MtlPictures<'_, '_>,
        illum: i32,
        black: bool,
    ) {
        let exponent = material.peek_number("ns").unwrap_or(0.0);
        let specular = color(material.peek_color("ks"), 0.0, 1.0);
        let shines = specular != [0.0; 3] || material.has("map_ks");
        if matches!(illum, 3 | 5) && black {
            let map = pictures.of(material, &["map_ks"], false);
            self.mirror = Some(map.map_or(MtlValue::Rgb(specular), MtlValue::Bitmap));
            material.take_highlight();
        } else if shines && exponent > 1.0 {
            let map = pictures.of(material, &["map_ks"], false);
            self.coat = Some(((2.0 / (exponent + 2.0)).sqrt().clamp(1e-3, 1.0), map));
            material.take_highlight();
            // A coat reflects by its index; how much a grey `Ks` says has no counterpart.
            if specular != [specular[0]; 3] {
                material.leave_statement("ks");
            }
        } else if !shines {
            material.number("ns");
        }
    }

    fn write(&self, text: &mut SceneText<'_>) {
        if !self.lobes.is_empty() {
            text.object("bsdf", "principled", &[], |text| {
                self.base.write(text, "base_color");
                self.lobes.iter().for_each(|(name, value)| value.write(text, name));
                if let Some(gloss) = self.gloss {
                    text.value("float", "clearcoat_gloss", gloss);
                }
                text.value("float", "eta", self.ior);
            });
        } else if let Some(mirror) = &self.mirror {
            text.object("bsdf", "conductor", &[], |text| {
                text.value("string", "material", "none");
                mirror.write(text, "specular_reflectance");
            });
        } else if let Some((alpha, map)) = &self.coat {
            text.object("bsdf", "roughplastic", &[], |text| {
                self.base.write(text, "diffuse_reflectance");
                if let Some(map) = map {
                    map.write(text, &[("name", "specular_reflectance")]);
                }
                text.value("float", "alpha", alpha);
                text.value("float", "int_ior", self.ior);
            });
        } else {
            text.object("bsdf", "diffuse", &[], |text| self.base.write(text, "reflectance"));
        }
    }
}
