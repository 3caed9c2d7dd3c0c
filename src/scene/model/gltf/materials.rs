//! Materials of glTF as `principled`, which has the same metallic-roughness base (Burley 2012): base colour, α = roughness², index
//! of refraction 1.5.
//!
//! | glTF | here |
//! |---|---|
//! | `alphaMode` `MASK`, `BLEND` | `mask`, outside of all else |
//! | every material that lets no light through | `twosided`: a back face is never meant to be black |
//! | `normalTexture` | `normalmap` |
//! | `KHR_materials_transmission` | `principledthin`; with `KHR_materials_volume` the glass of `principled`, or a `dielectric`: [`glass`](super::glass) |
//! | `KHR_materials_volume`, `KHR_materials_volume_scatter` | the `interior` medium of the shape: [`volume`](super::volume) |
//! | `KHR_materials_unlit` | its base colour, diffuse |
//! | `emissiveFactor`, `emissiveTexture`, `KHR_materials_emissive_strength` | the shape's `area` emitter, on both sides if `doubleSided` |
//! | `COLOR_0` | times the base colour: the vertices have it times the factor, `product` multiplies it with the texture |
//! | alpha of `COLOR_0` | the same under `BLEND`; under `MASK` it [cuts triangles](super::cutout) |
//! | other extensions | [`extensions`](super::extensions), [`specular_glossiness`](super::specular_glossiness) |

use std::collections::BTreeMap;

use serde_json::Value;

use super::buffers::Buffers;
use super::extensions::{
    anisotropy, clearcoat, diffuse_transmission, index_of_refraction, iridescence, sheen,
};
use super::json::{extension, number, numbers, share, shares};
use super::material_reader::{MaterialReader, VertexColors};
use super::pictures::MaterialPictures;
use super::specular_glossiness::{ConvertedMaterial, converted};
use super::textures::TextureUse;
use super::{glass, volume};
use crate::scene::model::picture_changes::Change;
use crate::scene::model::surface::{EmittedRadiance, MaterialBitmap, MaterialValue, SurfaceModel};
use crate::scene::model::text::SceneText;

/// Key of a material: its index, none for the default, and what the vertices give it.
type Key = (Option<usize>, VertexColors);

/// A material that is written, as shapes need it.
#[derive(Clone)]
pub(super) struct GltfMaterial {
    pub(super) bsdf: String,
    pub(super) emission: Option<EmittedRadiance>,
    /// The id of the medium within.
    pub(super) interior: Option<String>,
}

/// The materials that are written already.
pub(super) struct Materials<'r> {
    root: &'r Value,
    known: BTreeMap<Key, GltfMaterial>,
    pictures: MaterialPictures,
}

/// All places of a material where a texture can be that is used; the base colour first.
const TEXTURES: &[&[&str]] = &[
    &["pbrMetallicRoughness", "baseColorTexture"],
    &["extensions", "KHR_materials_pbrSpecularGlossiness", "diffuseTexture"],
    &["pbrMetallicRoughness", "metallicRoughnessTexture"],
    &["extensions", "KHR_materials_pbrSpecularGlossiness", "specularGlossinessTexture"],
    &["emissiveTexture"],
    &["extensions", "KHR_materials_transmission", "transmissionTexture"],
    &["normalTexture"],
    &["extensions", "KHR_materials_clearcoat", "clearcoatTexture"],
    &["extensions", "KHR_materials_clearcoat", "clearcoatRoughnessTexture"],
    &["extensions", "KHR_materials_sheen", "sheenColorTexture"],
    &["extensions", "KHR_materials_diffuse_transmission", "diffuseTransmissionTexture"],
    &["extensions", "KHR_materials_iridescence", "iridescenceTexture"],
    &["extensions", "KHR_materials_iridescence", "iridescenceThicknessTexture"],
];

/// The sets of texture coordinates of the textures of a material.
fn sets(material: &Value) -> impl Iterator<Item = usize> {
    let glossy = !extension(material, "KHR_materials_pbrSpecularGlossiness").is_null();
    // The extension comes with what it replaces.
    let used = TEXTURES.iter().filter(move |path| !(glossy && path[0] == "pbrMetallicRoughness"));
    let infos = used.map(move |path| path.iter().fold(material, |object, name| &object[*name]));
    infos.filter_map(TextureUse::of).map(|texture| texture.set)
}

impl<'r> Materials<'r> {
    /// Those of a file.
    pub(super) fn new(root: &'r Value) -> Self {
        Self { root, known: BTreeMap::new(), pictures: MaterialPictures::default() }
    }

    fn material(&self, index: Option<usize>) -> &'r Value {
        index.map_or(&Value::Null, |i| &self.root["materials"][i])
    }

    /// The set of texture coordinates that a material uses: that of its first texture. None without a texture.
    pub(super) fn set_of(&self, index: Option<usize>) -> Option<usize> {
        sets(self.material(index)).next()
    }

    /// The factor on the colours of vertices, and the `alphaMode`, which says what their opacity means.
    pub(super) fn vertex_factor(&self, index: Option<usize>) -> ([f32; 4], &'r str) {
        let material = self.material(index);
        (base_factor(material), material["alphaMode"].as_str().unwrap_or("OPAQUE"))
    }

    /// The least opacity that is shown, if `alphaMode` is `MASK`.
    pub(super) fn cutoff(&self, index: Option<usize>) -> Option<f32> {
        let material = self.material(index);
        (material["alphaMode"].as_str() == Some("MASK")).then(|| number(material, "alphaCutoff", 0.5))
    }

    /// Whether the base colour has a texture, which may have opacities of its own.
    pub(super) fn has_texture(&self, index: Option<usize>) -> bool {
        let material = self.material(index);
        let glossy = extension(material, "KHR_materials_pbrSpecularGlossiness");
        let base = if glossy.is_null() {
            &material["pbrMetallicRoughness"]["baseColorTexture"]
        } else {
            &glossy["diffuseTexture"]
        };
        !base.is_null()
    }

    /// Writes a material, once.
    pub(super) fn of(
        &mut self,
        index: Option<usize>,
        colors: VertexColors,
        text: &mut SceneText<'_>,
        buffers: &mut Buffers<'r>,
    ) -> Result<GltfMaterial, String> {
        if let Some(known) = self.known.get(&(index, colors)) {
            return Ok(known.clone());
        }
        let material = self.material(index);
        let bsdf = text.id(material["name"].as_str().unwrap_or("material"));
        let mut reader = MaterialReader {
            root: self.root,
            material,
            index,
            colors,
            text,
            buffers,
            pictures: &mut self.pictures,
        };
        let mut sets = sets(material);
        let first = sets.next();
        if sets.any(|set| Some(set) != first) {
            reader.tell(
                "the textures of a material have several sets of coordinates: that of the first is used",
            );
        }
        reader.write(&bsdf)?;
        let emission = reader.emission()?;
        let interior = volume::interior(&mut reader, &bsdf);
        let written = GltfMaterial { bsdf, emission, interior };
        self.known.insert((index, colors), written.clone());
        Ok(written)
    }
}

/// Factor on the base colour.
fn base_factor(material: &Value) -> [f32; 4] {
    let glossy = extension(material, "KHR_materials_pbrSpecularGlossiness");
    match glossy.is_null() {
        true => shares(&material["pbrMetallicRoughness"], "baseColorFactor", [1.0; 4]),
        false => shares(glossy, "diffuseFactor", [1.0; 4]),
    }
}

impl MaterialReader<'_, '_, '_> {
    /// Factor on the base colour and opacity, without what is in the vertices.
    fn factor(&self) -> [f32; 4] {
        let [r, g, b, a] = base_factor(self.material);
        let [r, g, b] = if self.colors.rgb { [1.0; 3] } else { [r, g, b] };
        [r, g, b, if self.colors.opacity { 1.0 } else { a }]
    }

    /// A colour times that of the vertices.
    fn tinted(&self, color: MaterialValue) -> MaterialValue {
        match color {
            color if !self.colors.rgb => color,
            MaterialValue::Texture(bitmap) => MaterialValue::Product(bitmap, "vertex_color"),
            _ => MaterialValue::Attribute("vertex_color"),
        }
    }

    fn write(&mut self, id: &str) -> Result<(), String> {
        let material = self.material;
        let glossy = extension(material, "KHR_materials_pbrSpecularGlossiness");
        let base = &material["pbrMetallicRoughness"];
        let image = if glossy.is_null() { &base["baseColorTexture"] } else { &glossy["diffuseTexture"] };
        let opacity = self.opacity(image)?;
        let normals = self.normals()?;
        let surface = match glossy {
            Value::Null => self.metallic_roughness(base)?,
            glossy => {
                let material = converted(self, glossy, self.colors.rgb)?;
                self.glossy(material)?
            }
        };
        surface.write(self.text, id, normals.as_ref(), opacity.as_ref());
        Ok(())
    }

    /// The opacity; none where all is opaque.
    fn opacity(&mut self, image: &Value) -> Result<Option<MaterialValue>, String> {
        let [.., factor] = self.factor();
        let mode = self.material["alphaMode"].as_str().unwrap_or("OPAQUE");
        let cutoff = (mode == "MASK").then(|| number(self.material, "alphaCutoff", 0.5));
        if mode == "OPAQUE" {
            return Ok(None);
        }
        let of_vertices = self.colors.opacity.then_some("vertex_opacity");
        let bitmap = self.bitmap(image, Change::Alpha { factor, cutoff }, true)?;
        Ok(match (bitmap, of_vertices, cutoff) {
            (Some(bitmap), Some(attribute), _) => Some(MaterialValue::Product(bitmap, attribute)),
            (Some(bitmap), None, _) => Some(MaterialValue::Texture(bitmap)),
            (None, Some(attribute), _) => Some(MaterialValue::Attribute(attribute)),
            (None, None, Some(cutoff)) => (factor < cutoff).then_some(MaterialValue::Number(0.0)),
            (None, None, None) => Some(MaterialValue::Number(factor)).filter(|_| factor != 1.0),
        })
    }

    fn normals(&mut self) -> Result<Option<MaterialBitmap>, String> {
        let info = &self.material["normalTexture"];
        let scale = number(info, "scale", 1.0);
        self.bitmap(info, if scale == 1.0 { Change::None } else { Change::Bend(scale) }, true)
    }

    /// The bsdf of a material with `pbrMetallicRoughness`.
    fn metallic_roughness(&mut self, base: &Value) -> Result<SurfaceModel, String> {
        let material = self.material;
        let transmission = extension(material, "KHR_materials_transmission");
        let through = share(transmission, "transmissionFactor", 0.0);
        let solid = volume::is_solid(material);
        let [r, g, b, _] = self.factor();
        let factor = [r, g, b];
        let bitmap = self.bitmap(&base["baseColorTexture"], Change::times(factor), false)?;
        let color = self.tinted(bitmap.map_or(MaterialValue::Rgb(factor), MaterialValue::Texture));
        if !extension(material, "KHR_materials_unlit").is_null() {
            self.tell("`KHR_materials_unlit` is rendered as a diffuse surface, which light falls on");
            self.tell_extensions("KHR_materials_unlit", &[]);
            return Ok(SurfaceModel {
                kind: "diffuse",
                parameters: vec![("reflectance", color)],
                transmits: false,
            });
        }
        let packed = &base["metallicRoughnessTexture"];
        let roughness = self.channel(packed, 1, share(base, "roughnessFactor", 1.0))?;
        let metallic = self.channel(packed, 2, share(base, "metallicFactor", 1.0))?;
        let through = self.channel(&transmission["transmissionTexture"], 0, through)?;
        let refracts = !matches!(through, MaterialValue::Number(0.0));
        if refracts
            && solid
            && let Some(glass) = glass::dispersive(self, &color, &roughness, [&metallic, &through])
        {
            return Ok(glass);
        }
        let diffuse = diffuse_transmission(self, base)?;
        if diffuse.is_some() && refracts && solid {
            self.tell("`KHR_materials_diffuse_transmission` is not used for glass");
        }
        let diffuse = diffuse.filter(|_| !(refracts && solid));
        let transmits = refracts || diffuse.is_some();
        let kind = if transmits && !(refracts && solid) { "principledthin" } else { "principled" };
        let mut parameters = vec![("base_color", color)];
        if kind == "principled" {
            parameters.push(("metallic", metallic));
        } else if !matches!(metallic, MaterialValue::Number(0.0)) {
            self.tell("`metallicFactor` is not used for what is thin and lets light through");
        }
        if refracts {
            parameters.push(("spec_trans", through));
        }
        parameters.extend(diffuse.map(|value| ("diff_trans", value)));
        let eta = index_of_refraction(self, transmits);
        self.layers(SurfaceModel { kind, parameters, transmits }, roughness, eta)
    }

    /// The bsdf of a material with `KHR_materials_pbrSpecularGlossiness`.
    fn glossy(&mut self, material: ConvertedMaterial) -> Result<SurfaceModel, String> {
        let ConvertedMaterial { color, metallic, roughness, eta } = material;
        let used = [
            "KHR_materials_clearcoat",
            "KHR_materials_sheen",
            "KHR_materials_anisotropy",
            "KHR_materials_iridescence",
        ];
        self.tell_extensions("KHR_materials_pbrSpecularGlossiness", &used);
        let parameters = vec![("base_color", self.tinted(color)), ("metallic", metallic)];
        self.layers(SurfaceModel { kind: "principled", parameters, transmits: false }, roughness, eta)
    }

    /// Adds what every kind may have.
    fn layers(
        &mut self,
        mut surface: SurfaceModel,
        roughness: MaterialValue,
        eta: f32,
    ) -> Result<SurfaceModel, String> {
        let (roughness, anisotropic) = anisotropy(self, roughness);
        let parameters = &mut surface.parameters;
        parameters.push(("roughness", roughness));
        parameters.extend(anisotropic.map(|v| ("anisotropic", MaterialValue::Number(v))));
        parameters.push(("eta", MaterialValue::Number(eta)));
        parameters.extend(sheen(self)?);
        parameters.extend(clearcoat(self, surface.kind)?);
        parameters.extend(iridescence(self, surface.kind)?);
        Ok(surface)
    }

    fn emission(&mut self) -> Result<Option<EmittedRadiance>, String> {
        let material = self.material;
        let strength =
            number(extension(material, "KHR_materials_emissive_strength"), "emissiveStrength", 1.0);
        let factor = numbers(material, "emissiveFactor", [0.0; 3]).map(|v| (v * strength).clamp(0.0, 1e9));
        if factor == [0.0; 3] {
            return Ok(None);
        }
        let bitmap = self.bitmap(&material["emissiveTexture"], Change::Light(factor), true)?;
        let value = bitmap.map_or(MaterialValue::Rgb(factor), MaterialValue::Texture);
        let both_sides = material["doubleSided"].as_bool() == Some(true);
        Ok(Some(EmittedRadiance { value, both_sides }))
    }
}
