//! Reads textures, wherever a reflectance or a factor on light may vary over a surface.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{Affine2, DAffine3, Mat2, Vec2};

use super::document::ElementId;
use super::params::Params;
use super::prefetched::{BitmapError, read_bitmap};
use super::question::Question;
use super::reader::{PluginTable, Reader, Role};
use super::source::Span;
use super::{spectrum, volume};
use crate::image::bitmap::Bitmap;
use crate::scene::desc::MeshAttribute;
use crate::scene::desc::texture::{
    AttributeLayout, AttributeTexture, BitmapTexture, Checkerboard, SpectrumTexture, WrapMode,
};
use crate::scene::diagnostic::{FindingKind, SceneError, shorten};
use crate::scene::limits;
use crate::spectrum::Spectrum;

/// Every `<texture type="…">`.
pub(super) const PLUGINS: PluginTable<SpectrumTexture> = &[
    ("bitmap", bitmap),
    ("checkerboard", checkerboard),
    ("mesh_attribute", mesh_attribute),
    ("product", product),
    ("volume", volume::volume),
];

/// The parameter `name`, a reflectance or a factor: a texture, or a colour or spectrum that is the same everywhere. Nothing if it is
/// not given.
pub(crate) fn read(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    name: &'static str,
) -> Result<Option<SpectrumTexture>, SceneError> {
    params.ask(name, || Question::Value(&["texture"]));
    let Some(id) = params.get_id(name) else { return Ok(None) };
    if reader.document.element(id).tag.name != "texture" {
        return Ok(spectrum::read(reader, params, name, Role::Reflectance)?.map(SpectrumTexture::Uniform));
    }
    shared(reader, id).map(Some)
}

/// Reads a texture; once, however often it is referred to.
pub(crate) fn shared(reader: &mut Reader<'_>, id: ElementId) -> Result<SpectrumTexture, SceneError> {
    if let Some(known) = reader.known.textures.get(&id) {
        return Ok(known.clone());
    }
    let span = reader.document.element(id).span;
    if reader.known.open_textures.contains(&id) || reader.known.open_textures.len() >= limits::REFERENCE_DEPTH
    {
        let message = "this texture contains itself, or too many others within each other";
        return Err(reader.document.error(FindingKind::Reference, span, message));
    }
    let params = Params::new(reader.document, id)?;
    let plugin = reader.plugin(&params, PLUGINS, &[])?;
    reader.known.open_textures.push(id);
    let texture = plugin(reader, &params)?;
    reader.known.open_textures.pop();
    reader.finish(params);
    reader.known.textures.insert(id, texture.clone());
    Ok(texture)
}

/// Tells what the file of a picture, named at `span`, says of its colours that is not used.
pub(super) fn tell_remarks(reader: &mut Reader<'_>, bitmap: &Bitmap, span: Span) {
    if !bitmap.remarks().is_empty() && !reader.document.srgb_pictures {
        let message =
            format!("what this picture says of its colours is not used: {}", bitmap.remarks().join(", "));
        let found = reader.document.finding(FindingKind::File, span, message);
        reader.warn(found.help("convert it to sRGB, or to linear Rec.709 where it holds light").warning());
    }
}

fn bitmap(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<SpectrumTexture, SceneError> {
    let BitmapParams { bitmap, to_uv, wrap, nearest, .. } = picture(reader, params)?;
    // Ready when the first path needs it, while the rest of the scene is read.
    rayon::spawn(Spectrum::prepare_textures);
    Ok(SpectrumTexture::Bitmap(BitmapTexture::new(bitmap, to_uv, wrap, nearest)))
}

/// The parameters of a `bitmap`, whatever it is used for.
pub(super) struct BitmapParams {
    pub(super) path: PathBuf,
    pub(super) raw: bool,
    pub(super) bitmap: Arc<Bitmap>,
    pub(super) to_uv: Affine2,
    pub(super) wrap: WrapMode,
    pub(super) nearest: bool,
    /// Where the file is named.
    pub(super) span: Span,
}

/// Reads the parameters of a `bitmap`, and its file, once.
pub(super) fn picture(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<BitmapParams, SceneError> {
    let name = params.filename("a bitmap", "png")?;
    let raw = params.boolean("raw", false)?;
    params.without_effect(&["format", "accel"]);
    let nearest = match choice(params, "filter_type", &["bilinear", "nearest", "trilinear", "ewa"])? {
        1 => true,
        0 => false,
        _ => {
            let message = "this filter is read as `bilinear`, as by Mitsuba 3";
            params.note(params.error("filter_type", message).advice());
            false
        }
    };
    let wrap = wrap(params, WrapMode::Repeat)?;
    let to_uv = to_uv(params)?;
    let span = params.get("filename").map_or(params.span(), |e| e.span_of("value"));
    let path = reader.document.resolve(&name, span);
    let bitmap = match reader.known.bitmaps.get(&(path.clone(), raw)) {
        Some(known) => known.clone(),
        None => {
            let at = |kind, message: String| reader.document.finding(kind, span, message);
            let prefetched = reader.known.prefetched.bitmaps.remove(&(path.clone(), raw));
            let read = prefetched.unwrap_or_else(|| read_bitmap(&reader.document.files, &path, raw));
            let bitmap = read.map_err(|e| match e {
                BitmapError::Unreadable(e) => at(e.kind(), e.to_string()).error(),
                BitmapError::Damaged(e) => {
                    let help = "a texture is a PNG, JPEG, WebP, BMP, TGA, KTX2, OpenEXR or Radiance file";
                    at(FindingKind::File, e.to_string()).help(help).error()
                }
            })?;
            reader.known.texels += bitmap.width() * bitmap.height();
            if reader.known.texels > limits::TOTAL_TEXELS {
                let message =
                    format!("the textures of this scene have more than {} texels", limits::TOTAL_TEXELS);
                return Err(at(FindingKind::Limit, message).error());
            }
            tell_remarks(reader, &bitmap, span);
            let bitmap = Arc::new(bitmap);
            reader.known.bitmaps.insert((path.clone(), raw), bitmap.clone());
            bitmap
        }
    };
    Ok(BitmapParams { path, raw, bitmap, to_uv, wrap, nearest, span })
}

/// `wrap_mode`.
pub(super) fn wrap(params: &Params<'_>, default: WrapMode) -> Result<WrapMode, SceneError> {
    let clamps = default == WrapMode::Clamp;
    let names = if clamps { ["clamp", "repeat", "mirror"] } else { ["repeat", "mirror", "clamp"] };
    Ok(match names[choice(params, "wrap_mode", &names)?] {
        "repeat" => WrapMode::Repeat,
        "mirror" => WrapMode::Mirror,
        _ => WrapMode::Clamp,
    })
}

fn checkerboard(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<SpectrumTexture, SceneError> {
    let to_uv = to_uv(params)?;
    let mut color = |name, default: f32| {
        params.default(name, default);
        let given = read(reader, params, name)?;
        Ok(given.unwrap_or(Spectrum::Constant(default).into()))
    };
    let (color0, color1) = (color("color0", 0.4)?, color("color1", 0.2)?);
    Ok(SpectrumTexture::Checkerboard(Arc::new(Checkerboard { color0, color1, to_uv })))
}

/// Two textures multiplied, which Mitsuba has not: models multiply the colours of their vertices with pictures.
fn product(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<SpectrumTexture, SceneError> {
    let mut factor = |name| {
        params.default(name, 1.0);
        let given = read(reader, params, name)?;
        Ok(given.unwrap_or(Spectrum::Constant(1.0).into()))
    };
    let factors = [factor("color0")?, factor("color1")?];
    rayon::spawn(Spectrum::prepare_textures);
    Ok(SpectrumTexture::Product(Arc::new(factors)))
}

fn mesh_attribute(_: &mut Reader<'_>, params: &Params<'_>) -> Result<SpectrumTexture, SceneError> {
    let missing = || params.fault(FindingKind::Missing, "a mesh attribute needs `name`");
    let help =
        "it begins with `vertex_` or `face_`, such as in <string name=\"name\" value=\"vertex_color\"/>";
    let name = params.string("name")?.ok_or_else(|| missing().help(help).error())?;
    if ![MeshAttribute::VERTEX, MeshAttribute::FACE].iter().any(|first| name.starts_with(first)) {
        let found = params.error("name", format!("`{}` names no attribute of a mesh", shorten(&name)));
        return Err(found.help(help).error());
    }
    let scale = params.float("scale")?.unwrap_or(1.0);
    if scale < 0.0 {
        return Err(params.error("scale", "an attribute is not scaled by less than 0").error());
    }
    rayon::spawn(Spectrum::prepare_textures);
    Ok(SpectrumTexture::Attribute(AttributeTexture {
        name: name.into(),
        scale: scale as f32,
        layout: AttributeLayout::UNKNOWN,
        grey: false,
    }))
}

/// The index of the value of the string `name` among `names`, of which the first is the default.
pub(super) fn choice(params: &Params<'_>, name: &'static str, names: &[&str]) -> Result<usize, SceneError> {
    params.default(name, names[0]);
    let Some(given) = params.string(name)? else { return Ok(0) };
    names.iter().position(|known| *known == given).ok_or_else(|| {
        let message = format!("`{}` is no {name}", shorten(&given));
        params.error(name, message).help(format!("it is one of {}", names.join(", "))).error()
    })
}

/// The plane part of `to_uv`; the identity unless given.
pub(super) fn to_uv(params: &Params<'_>) -> Result<Affine2, SceneError> {
    let DAffine3 { matrix3, translation } = params.transform("to_uv")?;
    let column = |v: glam::DVec3| Vec2::new(v.x as f32, v.y as f32);
    Ok(Affine2 {
        matrix2: Mat2::from_cols(column(matrix3.x_axis), column(matrix3.y_axis)),
        translation: column(translation),
    })
}
