//! Textures of UsdPreviewSurface networks: `UsdUVTexture`, `UsdTransform2d` and the readers of primvars.

use std::collections::BTreeMap;
use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};
use openusd::sdf::Value;

use super::assets::StageAssets;
use super::network::{InputSource, ShaderNetwork};
use crate::image::bitmap;
use crate::scene::diagnostic::shorten;
use crate::scene::limits;
use crate::scene::model::picture_changes::{Change, ChannelUse, ScaledChannels, changed};
use crate::scene::model::surface::MaterialBitmap;
use crate::scene::model::text::SceneText;

/// A picture of a material with all that `UsdUVTexture` says of it.
#[derive(Clone, Debug)]
pub(super) struct TextureNode {
    /// Where its file is.
    pub(super) file: String,
    /// `auto`, `raw` or `sRGB`.
    space: String,
    pub(super) scale: [f32; 4],
    pub(super) bias: [f32; 4],
    wrap: &'static str,
    /// The primvar of its coordinates.
    pub(super) uv: String,
    to_uv: DAffine3,
}

/// The result of reading a texture shader.
pub(super) enum TextureRead {
    Texture(Box<TextureNode>),
    /// The picture is not there.
    Fallback([f32; 4]),
}

impl ShaderNetwork {
    /// Reads a `UsdUVTexture`.
    pub(super) fn texture(&mut self, shader: &str) -> TextureRead {
        let fallback = self.numbers(shader, "inputs:fallback").unwrap_or([0.0, 0.0, 0.0, 1.0]);
        let scale = self.numbers(shader, "inputs:scale").unwrap_or([1.0; 4]);
        let bias = self.numbers(shader, "inputs:bias").unwrap_or([0.0; 4]);
        let space = self.word(shader, "inputs:sourceColorSpace").unwrap_or_else(|| "auto".to_owned());
        let [s, t] = ["inputs:wrapS", "inputs:wrapT"].map(|name| self.word(shader, name));
        let (uv, to_uv) = self.coordinates(shader);
        let file = self.value(shader, "inputs:file");
        let Some(prim) = self.prim(shader) else { return TextureRead::Fallback(fallback) };
        if s != t {
            prim.fault("pictures are continued in both directions as `wrapS` says: `wrapT` is not used");
        }
        let wrap = match s.as_deref() {
            Some("mirror") => "mirror",
            Some("clamp") => "clamp",
            Some("black") => {
                prim.fault("a picture with the wrap `black` is continued by its edge");
                "clamp"
            }
            _ => "repeat",
        };
        let file = match file {
            Some(Value::AssetPath(path)) if !path.is_empty() => path,
            _ => {
                prim.fault("a texture has no file: its fallback is used");
                return TextureRead::Fallback(fallback);
            }
        };
        let Some(found) = file.resolved_path() else {
            let name = shorten(file.asset_path());
            let message = match name.contains("<UDIM>") {
                true => format!("the picture `{name}` of many tiles is not used: its fallback is"),
                false => format!("the picture `{name}` is not found: its fallback is used"),
            };
            prim.fault(message);
            return TextureRead::Fallback(fallback);
        };
        let file = found.to_owned();
        TextureRead::Texture(Box::new(TextureNode { file, space, scale, bias, wrap, uv, to_uv }))
    }

    /// The primvar of texture coordinates of a texture, and what is made of them, with v upwards.
    fn coordinates(&mut self, texture: &str) -> (String, DAffine3) {
        let default = "st".to_owned();
        let mut to_uv = DAffine3::IDENTITY;
        let mut at = (texture.to_owned(), "inputs:st".to_owned());
        // Transforms can follow each other.
        for _ in 0..8 {
            let Some(InputSource::Output { shader, .. }) = self.source(&at.0, &at.1) else {
                return (default, to_uv);
            };
            match self.id(&shader).as_deref() {
                Some("UsdTransform2d") => {
                    to_uv *= self.transform2d(&shader);
                    at = (shader, "inputs:in".to_owned());
                }
                Some(id) if id.starts_with("UsdPrimvarReader_float2") => {
                    return (self.word(&shader, "inputs:varname").unwrap_or(default), to_uv);
                }
                id => {
                    let message = format!(
                        "the shader `{}` makes no texture coordinates: `st` is used",
                        shorten(id.unwrap_or("without id"))
                    );
                    if let Some(prim) = self.prim(&shader) {
                        prim.fault(message);
                    }
                    return (default, to_uv);
                }
            }
        }
        (default, to_uv)
    }

    /// `UsdTransform2d`: scale, then turn against the clock by degrees, then move.
    fn transform2d(&mut self, shader: &str) -> DAffine3 {
        let [angle] = self.numbers(shader, "inputs:rotation").unwrap_or([0.0]);
        let scale: [f32; 2] = self.numbers(shader, "inputs:scale").unwrap_or([1.0; 2]);
        let offset: [f32; 2] = self.numbers(shader, "inputs:translation").unwrap_or([0.0; 2]);
        let (sin, cos) = f64::from(angle).to_radians().sin_cos();
        let [sx, sy] = scale.map(f64::from);
        let columns =
            DMat3::from_cols(DVec3::new(cos, sin, 0.0) * sx, DVec3::new(-sin, cos, 0.0) * sy, DVec3::Z);
        let moved = DVec3::new(f64::from(offset[0]), f64::from(offset[1]), 0.0);
        DAffine3::from_mat3_translation(columns, moved)
    }
}

/// The pictures that were made, by their file and what was made of it.
#[derive(Default)]
pub(super) struct StagePictures {
    known: BTreeMap<(String, String), Result<String, String>>,
    /// Whether the colours of a file are numbers, where nothing says so.
    raw: BTreeMap<String, bool>,
    texels: usize,
}

impl StagePictures {
    /// A texture as a bitmap of its colours, or of one channel; an error where its picture cannot be read.
    pub(super) fn bitmap(
        &mut self,
        node: &TextureNode,
        channel: Option<usize>,
        then: ChannelUse,
        assets: &StageAssets,
        text: &mut SceneText<'_>,
    ) -> Result<MaterialBitmap, String> {
        let linear = self.is_raw(node, assets)?;
        let plain = node.scale == [1.0; 4] && node.bias == [0.0; 4] && matches!(then, ChannelUse::Share);
        let change = match channel {
            None if plain => Change::None,
            _ => Change::Scaled(ScaledChannels { channel, scale: node.scale, bias: node.bias, linear, then }),
        };
        let raw = channel.is_some() || linear || matches!(then, ChannelUse::Light);
        let file = self.file(&node.file, change, assets, text)?;
        // The picture has v downwards.
        let flip = upside_down();
        let to_uv = if node.to_uv == DAffine3::IDENTITY { node.to_uv } else { flip * node.to_uv * flip };
        Ok(MaterialBitmap { file, raw, nearest: false, wrap: node.wrap, to_uv })
    }

    /// The picture as normals: their shares of colour are halves of them, plus a half.
    pub(super) fn normals(
        &mut self,
        node: &TextureNode,
        assets: &StageAssets,
        text: &mut SceneText<'_>,
    ) -> Result<MaterialBitmap, String> {
        let scale = node.scale.map(|v| 0.5 * v);
        let bias = node.bias.map(|v| 0.5 * v + 0.5);
        let halved = TextureNode { scale, bias, space: "raw".to_owned(), ..node.clone() };
        let halved = match (scale[..3] == [1.0; 3], bias[..3] == [0.0; 3]) {
            (true, true) => TextureNode { scale: [1.0; 4], bias: [0.0; 4], ..halved },
            _ => halved,
        };
        self.bitmap(&halved, None, ChannelUse::Share, assets, text)
    }

    /// Whether the colours of a picture are numbers: as it says, else those of pictures with one channel, or with more than 8 bits.
    fn is_raw(&mut self, node: &TextureNode, assets: &StageAssets) -> Result<bool, String> {
        match node.space.as_str() {
            "raw" => return Ok(true),
            "sRGB" => return Ok(false),
            _ => {}
        }
        if let Some(known) = self.raw.get(&node.file) {
            return Ok(*known);
        }
        let bytes = assets.bytes(&node.file)?;
        let raw = match image::ImageReader::new(std::io::Cursor::new(&bytes)).with_guessed_format() {
            Ok(reader) => {
                use image::ImageDecoder as _;
                reader.into_decoder().is_ok_and(|decoder| {
                    let color = decoder.color_type();
                    color.channel_count() < 3 || color.bytes_per_pixel() > color.channel_count()
                })
            }
            Err(_) => false,
        };
        self.raw.insert(node.file.clone(), raw);
        Ok(raw)
    }

    /// The name of a picture in the text.
    pub(super) fn file(
        &mut self,
        file: &str,
        change: Change,
        assets: &StageAssets,
        text: &mut SceneText<'_>,
    ) -> Result<String, String> {
        let key = (file.to_owned(), format!("{change:?}"));
        if let Some(known) = self.known.get(&key) {
            return known.clone();
        }
        let made = self.made(file, change, assets, text);
        self.known.insert(key, made.clone());
        made
    }

    fn made(
        &mut self,
        file: &str,
        change: Change,
        assets: &StageAssets,
        text: &mut SceneText<'_>,
    ) -> Result<String, String> {
        let number = self.known.len();
        let is_packed = file.ends_with(']');
        if matches!(change, Change::None) && !is_packed {
            return Ok(beside(text.path, file));
        }
        let bytes = assets.bytes(file)?;
        let own = file.trim_end_matches(']').rsplit(['/', '[']).next().unwrap_or(file);
        let stem = Path::new(own).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if matches!(change, Change::None) {
            let ending = Path::new(own).extension().unwrap_or_default().to_string_lossy().into_owned();
            return Ok(text.file(&format!("{stem}-{number}.{ending}"), bytes));
        }
        let picture = bitmap::picture(Path::new(own), &bytes, limits::IMAGE_PIXELS)
            .map_err(|e| format!("the picture `{}` cannot be read: {e}", shorten(own)))?
            .into_rgba8();
        self.texels += (picture.width() * picture.height()) as usize;
        if self.texels > limits::TOTAL_TEXELS {
            return Err(format!("its materials need more than {} texels", limits::TOTAL_TEXELS));
        }
        let (ending, bytes) = changed(&picture, change).map_err(|e| e.to_string())?;
        Ok(text.file(&format!("{stem}-{number}.{ending}"), bytes))
    }
}

/// Texture coordinates with v in the other direction.
pub(super) fn upside_down() -> DAffine3 {
    DAffine3::from_mat3_translation(DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0)), DVec3::Y)
}

/// The name of a file of the disk as the text has it: relative to the model where it is below its folder.
pub(super) fn beside(model: &Path, file: &str) -> String {
    let folder = model.parent().unwrap_or(Path::new(""));
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    Path::new(file)
        .strip_prefix(&folder)
        .map_or_else(|_| file.to_owned(), |rest| rest.to_string_lossy().into_owned())
}
