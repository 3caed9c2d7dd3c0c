//! `UsdPreviewSurface` as `principled`, as the glTF reader maps its materials (`gltf/materials.rs`); clay where there is none.
//!
//! | UsdPreviewSurface | here |
//! |---|---|
//! | `diffuseColor`, `metallic`, `roughness`, `ior` | `base_color`, `metallic`, `roughness`, `eta` |
//! | `useSpecularWorkflow` | a weak grey `specularColor` is an index of refraction; any other becomes base colour and metal (`specular.rs`) |
//! | `clearcoat`, `clearcoatRoughness` | `clearcoat`, `clearcoat_gloss` of the same α |
//! | `opacity`, `opacityThreshold` | `mask`, outside of all else |
//! | `emissiveColor` | the shape's `area` emitter, on both sides if `doubleSided` |
//! | `normal` | `normalmap` |
//! | `occlusion`, `displacement` | not used: light is not baked here, and surfaces are not moved |

use std::collections::BTreeMap;

use openusd::sdf::Value;
use openusd::usd::Stage;

use super::assets::StageAssets;
use super::network::{InputSource, ShaderNetwork};
use super::textures::{StagePictures, TextureNode, TextureRead};
use super::values;
use crate::scene::diagnostic::shorten;
use crate::scene::model::mesh_shape::MeshShape;
use crate::scene::model::picture_changes::ChannelUse;
use crate::scene::model::specular::{STRONGEST, metallic_roughness};
use crate::scene::model::surface::{
    EmittedRadiance, MaterialBitmap, MaterialValue, SurfaceModel, gloss, index_of, is_grey,
};
use crate::scene::model::text::CLAY;
use crate::scene::model::text::SceneText;

/// The attributes of vertices that materials read.
const COLOR: &str = "vertex_color";
const OPACITY: &str = "vertex_opacity";

/// The primvars that a material reads, without `primvars:`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct MaterialNeeds {
    pub(super) uv: Option<String>,
    pub(super) color: Option<String>,
    pub(super) opacity: Option<String>,
}

/// The vertex attributes that a mesh provides for its material.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct MeshGives {
    pub(super) uv: bool,
    pub(super) color: bool,
    pub(super) opacity: bool,
    pub(super) double_sided: bool,
}

/// A material as it is written.
#[derive(Clone)]
pub(super) struct WrittenMaterial {
    pub(super) id: String,
    pub(super) emission: Option<EmittedRadiance>,
}

impl WrittenMaterial {
    /// A mesh of this material. `UsdPreviewSurface` has no media.
    pub(super) fn shape(self, file: String, flat: bool) -> MeshShape {
        MeshShape { file, bsdf: self.id, flat, emission: self.emission, interior: None }
    }
}

/// An input of a surface.
#[derive(Clone)]
enum SurfaceInput {
    Number(f32),
    Rgb([f32; 3]),
    /// A picture: all of its colours, or one channel.
    Texture(Box<TextureNode>, Option<usize>),
    /// An attribute of the vertices.
    Attribute(&'static str),
}

/// The inputs of the surface of a material, where it is one that is known.
#[derive(Clone, Default)]
struct ReadMaterial {
    inputs: BTreeMap<&'static str, SurfaceInput>,
    needs: MaterialNeeds,
    known: bool,
}

/// Inputs of UsdPreviewSurface that are colours.
const COLORS: &[&str] = &["diffuseColor", "emissiveColor", "specularColor", "normal"];
/// Those that are numbers.
const NUMBERS: &[&str] = &[
    "useSpecularWorkflow",
    "metallic",
    "roughness",
    "clearcoat",
    "clearcoatRoughness",
    "opacity",
    "opacityThreshold",
    "ior",
    "occlusion",
    "displacement",
];

/// The materials of a stage.
pub(super) struct StageMaterials {
    stage: Stage,
    read: BTreeMap<String, ReadMaterial>,
    written: BTreeMap<(String, MeshGives), WrittenMaterial>,
    /// Clay of other colours, by its bits.
    paints: BTreeMap<String, String>,
    pub(super) pictures: StagePictures,
}

impl StageMaterials {
    pub(super) fn new(stage: &Stage) -> Self {
        Self {
            stage: stage.clone(),
            read: BTreeMap::new(),
            written: BTreeMap::new(),
            paints: BTreeMap::new(),
            pictures: StagePictures::default(),
        }
    }

    /// The primvars that the material at `path` reads; none for one that is not known.
    pub(super) fn needs(&mut self, path: &str, text: &mut SceneText<'_>) -> Option<MaterialNeeds> {
        if !self.read.contains_key(path) {
            let read = read(&self.stage, path, text);
            self.read.insert(path.to_owned(), read);
        }
        self.read.get(path).filter(|read| read.known).map(|read| read.needs.clone())
    }

    /// Writes the material at `path`, once for each kind of mesh that has it. It has to be known.
    pub(super) fn written(
        &mut self,
        path: &str,
        gives: MeshGives,
        assets: &StageAssets,
        text: &mut SceneText<'_>,
    ) -> WrittenMaterial {
        let key = (path.to_owned(), gives);
        if let Some(known) = self.written.get(&key) {
            return known.clone();
        }
        let read = self.read.get(path).cloned().unwrap_or_default();
        let id = text.id(path.rsplit('/').next().unwrap_or("material"));
        let mut writer =
            SurfaceWriter { inputs: &read.inputs, gives, path, assets, text, pictures: &mut self.pictures };
        writer.write(&id);
        let written = WrittenMaterial { emission: writer.emission(), id };
        self.written.insert(key, written.clone());
        written
    }

    /// Writes a material for what has none: in the colours of its vertices, or in one colour, which defaults to clay.
    pub(super) fn paint(
        &mut self,
        gives: MeshGives,
        color: Option<[f32; 3]>,
        opacity: f32,
        text: &mut SceneText<'_>,
    ) -> WrittenMaterial {
        let color = match (gives.color, color) {
            (true, _) => MaterialValue::Attribute(COLOR),
            (false, color) => MaterialValue::Rgb(color.unwrap_or(CLAY)),
        };
        let opacity = match gives.opacity {
            true => Some(MaterialValue::Attribute(OPACITY)),
            false => (opacity < 1.0).then(|| MaterialValue::Number(opacity.max(0.0))),
        };
        let number = |value: &MaterialValue| match value {
            MaterialValue::Rgb(rgb) => format!("{rgb:?}"),
            MaterialValue::Number(v) => format!("{v}"),
            _ => "vertices".to_owned(),
        };
        let key = format!("{} {:?}", number(&color), opacity.as_ref().map(number));
        let id = self.paints.entry(key).or_insert_with(|| {
            let id = text.id("paint");
            let parameters = vec![("reflectance", color)];
            let surface = SurfaceModel { kind: "diffuse", parameters, transmits: false };
            surface.write(text, &id, None, opacity.as_ref());
            id
        });
        WrittenMaterial { id: id.clone(), emission: None }
    }
}

/// Reads the material at `path`.
fn read(stage: &Stage, path: &str, text: &mut SceneText<'_>) -> ReadMaterial {
    let mut network = ShaderNetwork::new(stage);
    let mut material = ReadMaterial::default();
    let surface = network.source(path, "outputs:surface");
    match surface {
        Some(InputSource::Output { shader, .. }) => match network.id(&shader).as_deref() {
            Some("UsdPreviewSurface") => {
                material.known = true;
                inputs(&mut network, &shader, &mut material);
            }
            id => {
                let id = shorten(id.unwrap_or("without id"));
                text.tell(
                    format!("the surface shader `{id}` is not known: it is clay, or the displayColor"),
                    path,
                );
            }
        },
        _ => {
            let other = network.prim(path).map(|prim| {
                let others =
                    prim.names().filter(|name| name.starts_with("outputs:") && name.ends_with(":surface"));
                others.map(shorten).collect::<Vec<_>>().join(", ")
            });
            text.tell(
                match other.filter(|names| !names.is_empty()) {
                    Some(names) => {
                        format!("a material has no surface but {names}: it is clay, or the displayColor")
                    }
                    None => "a material has no surface, or is not there: it is clay, or the displayColor"
                        .to_owned(),
                },
                path,
            );
        }
    }
    for name in ["outputs:displacement", "outputs:volume"] {
        if let Some(prim) = network.prim(path)
            && prim.has(name)
            && !prim.connections(name).is_empty()
            // The preview surface is its own displacement, which is told with its input.
            && name != "outputs:displacement"
        {
            prim.fault(format!("`{name}` is not used"));
        }
    }
    network.finish(text);
    material
}

/// Reads the inputs of a preview surface.
fn inputs(network: &mut ShaderNetwork, shader: &str, material: &mut ReadMaterial) {
    for (names, is_color) in [(COLORS, true), (NUMBERS, false)] {
        for name in names {
            let attribute = format!("inputs:{name}");
            let Some(source) = network.source(shader, &attribute) else { continue };
            let read = match source {
                InputSource::Value(value) => constant(&value, is_color),
                InputSource::Output { shader: from, output } => {
                    made(network, &from, &output, name, is_color, &mut material.needs)
                }
            };
            match read {
                Some(read) => drop(material.inputs.insert(name, read)),
                None => {
                    if let Some(prim) = network.prim(shader) {
                        prim.fault(format!(
                            "`{attribute}` is not of a kind that can be used: it has its default"
                        ));
                    }
                }
            }
        }
    }
    if let Some(prim) = network.prim(shader) {
        for name in ["occlusion", "displacement"] {
            let zero = |input: &SurfaceInput| matches!(input, SurfaceInput::Number(v) if *v == 0.0);
            if material.inputs.get(name).is_some_and(|input| name == "occlusion" || !zero(input)) {
                prim.fault(format!("`inputs:{name}` is not used"));
            }
        }
        // It says how highlights fade with the opacity: they do here.
        prim.used("inputs:opacityMode");
    }
}

fn constant(value: &Value, is_color: bool) -> Option<SurfaceInput> {
    let numbers = values::doubles(value)?;
    if !numbers.iter().all(|v| v.is_finite()) {
        return None;
    }
    match (is_color, numbers.as_slice()) {
        (true, [r, g, b, ..]) => Some(SurfaceInput::Rgb([*r as f32, *g as f32, *b as f32])),
        (_, [v, ..]) if is_color => Some(SurfaceInput::Rgb([*v as f32; 3])),
        (_, [v, ..]) => Some(SurfaceInput::Number(*v as f32)),
        _ => None,
    }
}

/// The value that another shader makes.
fn made(
    network: &mut ShaderNetwork,
    shader: &str,
    output: &str,
    input: &str,
    is_color: bool,
    needs: &mut MaterialNeeds,
) -> Option<SurfaceInput> {
    let id = network.id(shader)?;
    if id == "UsdUVTexture" {
        let channel = ["r", "g", "b", "a"].iter().position(|name| *name == output);
        let channel = if is_color { channel } else { Some(channel.unwrap_or(0)) };
        return Some(match network.texture(shader) {
            TextureRead::Fallback(v) => match (is_color, channel) {
                (true, None) => SurfaceInput::Rgb([v[0], v[1], v[2]]),
                (true, Some(i)) => SurfaceInput::Rgb([v[i]; 3]),
                (false, i) => SurfaceInput::Number(v[i.unwrap_or(0)]),
            },
            TextureRead::Texture(node) => {
                match &needs.uv {
                    Some(first) if *first != node.uv => network.prim(shader)?.fault(
                        "the textures of a material have several sets of coordinates: that of the first is used",
                    ),
                    _ => needs.uv = Some(node.uv.clone()),
                }
                SurfaceInput::Texture(node, channel)
            }
        });
    }
    if id.starts_with("UsdPrimvarReader_float") {
        let name = network.word(shader, "inputs:varname")?;
        let fallback = network.value(shader, "inputs:fallback");
        let slot = match (is_color, input) {
            (true, "diffuseColor") => Some((&mut needs.color, COLOR)),
            (false, "opacity") => Some((&mut needs.opacity, OPACITY)),
            _ => None,
        };
        let free = slot.filter(|(known, _)| known.as_ref().is_none_or(|known| *known == name));
        return match free {
            Some((known, attribute)) => {
                *known = Some(name);
                Some(SurfaceInput::Attribute(attribute))
            }
            None => {
                let message = format!("a primvar as `{input}` is not used: its fallback is");
                network.prim(shader)?.fault(message);
                fallback.and_then(|value| constant(&value, is_color))
            }
        };
    }
    let message = format!("the shader `{}` is not known: what it makes is not used", shorten(&id));
    network.prim(shader)?.fault(message);
    None
}

/// A material that is being written.
struct SurfaceWriter<'a, 't> {
    inputs: &'a BTreeMap<&'static str, SurfaceInput>,
    gives: MeshGives,
    path: &'a str,
    assets: &'a StageAssets,
    text: &'a mut SceneText<'t>,
    pictures: &'a mut StagePictures,
}

impl SurfaceWriter<'_, '_> {
    fn tell(&mut self, message: impl Into<String>) {
        self.text.tell(message, self.path);
    }

    /// The number of an input that has one.
    fn constant(&self, name: &str) -> Option<f32> {
        match self.inputs.get(name) {
            Some(SurfaceInput::Number(v)) => Some(*v),
            _ => None,
        }
    }

    /// The bitmap of a picture; without coordinates the mesh has none.
    fn bitmap(
        &mut self,
        node: &TextureNode,
        channel: Option<usize>,
        then: ChannelUse,
    ) -> Option<MaterialBitmap> {
        if !self.gives.uv {
            return None;
        }
        let bitmap = self.pictures.bitmap(node, channel, then, self.assets, self.text);
        bitmap.map_err(|error| self.tell(error)).ok()
    }

    fn color(&mut self, name: &str, default: [f32; 3], then: ChannelUse) -> MaterialValue {
        match self.inputs.get(name).cloned() {
            Some(SurfaceInput::Rgb(rgb)) => MaterialValue::Rgb(rgb.map(|v| v.max(0.0))),
            Some(SurfaceInput::Number(v)) => MaterialValue::Rgb([v.max(0.0); 3]),
            Some(SurfaceInput::Texture(node, channel)) => {
                self.bitmap(&node, channel, then).map_or(MaterialValue::Rgb(default), MaterialValue::Texture)
            }
            Some(SurfaceInput::Attribute(of)) if self.gives.color => MaterialValue::Attribute(of),
            _ => MaterialValue::Rgb(default),
        }
    }

    fn number(&mut self, name: &str, default: f32, then: ChannelUse) -> MaterialValue {
        match self.inputs.get(name).cloned() {
            Some(SurfaceInput::Number(v)) => MaterialValue::Number(v.clamp(0.0, 1.0)),
            Some(SurfaceInput::Texture(node, channel)) => self
                .bitmap(&node, Some(channel.unwrap_or(0)), then)
                .map_or(MaterialValue::Number(default), MaterialValue::Texture),
            Some(SurfaceInput::Attribute(of)) if self.gives.opacity => MaterialValue::Attribute(of),
            _ => MaterialValue::Number(default),
        }
    }

    fn write(&mut self, id: &str) {
        let opacity = self.opacity();
        let normals = match self.inputs.get("normal").cloned() {
            Some(SurfaceInput::Texture(node, None)) if self.gives.uv => {
                let read = self.pictures.normals(&node, self.assets, self.text);
                read.map_err(|error| self.tell(error)).ok()
            }
            Some(SurfaceInput::Rgb([x, y, _])) if x == 0.0 && y == 0.0 => None,
            Some(_) => {
                self.tell("`inputs:normal` is used as the colours of a picture alone");
                None
            }
            None => None,
        };
        let (color, metallic, eta) = self.base();
        let roughness = self.number("roughness", 0.5, ChannelUse::Share);
        let mut parameters = vec![
            ("base_color", color),
            ("metallic", metallic),
            ("roughness", roughness),
            ("eta", MaterialValue::Number(eta)),
        ];
        let coat = self.number("clearcoat", 0.0, ChannelUse::Share);
        if !matches!(coat, MaterialValue::Number(0.0)) {
            self.tell("`clearcoat` is the coat of `principled`, which takes no light from its base");
            let rough = self.number("clearcoatRoughness", 0.01, ChannelUse::Gloss);
            if matches!(rough, MaterialValue::Number(v) if v * v > 0.1) {
                self.tell("`clearcoatRoughness` above .316 counts as .316");
            }
            let rough = match rough {
                MaterialValue::Number(v) => MaterialValue::Number(gloss(v)),
                other => other,
            };
            parameters.extend([("clearcoat", coat), ("clearcoat_gloss", rough)]);
        }
        let surface = SurfaceModel { kind: "principled", parameters, transmits: false };
        surface.write(self.text, id, normals.as_ref(), opacity.as_ref());
    }

    /// Base colour, metallic and index of refraction.
    fn base(&mut self) -> (MaterialValue, MaterialValue, f32) {
        let color = self.color("diffuseColor", [0.18; 3], ChannelUse::Share);
        let given = self.constant("ior").unwrap_or(1.5);
        let eta = if (1.0..10.0).contains(&given) { given } else { 1.5 };
        if eta != given {
            self.tell("an index of refraction that is not from 1 to 10 counts as 1.5");
        }
        if self.constant("useSpecularWorkflow").unwrap_or(0.0) == 0.0 {
            if self.inputs.contains_key("specularColor") {
                self.tell("`specularColor` is not used without `useSpecularWorkflow`");
            }
            return (color, self.number("metallic", 0.0, ChannelUse::Share), eta);
        }
        if self.inputs.contains_key("metallic") {
            self.tell("`metallic` is not used with `useSpecularWorkflow`");
        }
        let specular = match self.inputs.get("specularColor").cloned() {
            Some(SurfaceInput::Rgb(rgb)) => rgb.map(|v| v.clamp(0.0, 1.0)),
            None => [0.0; 3],
            Some(_) => {
                self.tell("`specularColor` is used as one colour alone: .04 stands for its picture");
                [0.04; 3]
            }
        };
        if is_grey(specular) && specular[0] <= STRONGEST {
            return (color, MaterialValue::Number(0.0), index_of(specular[0]));
        }
        match color {
            MaterialValue::Rgb(rgb) => {
                let (color, metallic) = metallic_roughness(rgb, specular);
                (MaterialValue::Rgb(color), MaterialValue::Number(metallic), index_of(0.04))
            }
            color => {
                self.tell(
                    "a strong or coloured `specularColor` is not used beside a picture of the diffuse colour",
                );
                (color, MaterialValue::Number(0.0), index_of(0.04))
            }
        }
    }

    /// The opacity; none where all is opaque.
    fn opacity(&mut self) -> Option<MaterialValue> {
        let cutoff = self.constant("opacityThreshold").filter(|v| *v > 0.0);
        let value = self.number("opacity", 1.0, cutoff.map_or(ChannelUse::Share, ChannelUse::Cutoff));
        match (value, cutoff) {
            (MaterialValue::Number(v), Some(cutoff)) => (v < cutoff).then_some(MaterialValue::Number(0.0)),
            (MaterialValue::Number(v), None) => (v < 1.0).then_some(MaterialValue::Number(v)),
            (MaterialValue::Attribute(of), Some(_)) => {
                self.tell("`opacityThreshold` is not used for the opacity of vertices");
                Some(MaterialValue::Attribute(of))
            }
            (value, _) => Some(value),
        }
    }

    fn emission(&mut self) -> Option<EmittedRadiance> {
        let value = match self.color("emissiveColor", [0.0; 3], ChannelUse::Light) {
            MaterialValue::Rgb(rgb) if rgb == [0.0; 3] => return None,
            MaterialValue::Rgb(rgb) => MaterialValue::Rgb(rgb.map(|v| v.clamp(0.0, 1e9))),
            MaterialValue::Attribute(_) => {
                self.tell("a primvar as `emissiveColor` is not used");
                return None;
            }
            value => value,
        };
        Some(EmittedRadiance { value, both_sides: self.gives.double_sided })
    }
}
