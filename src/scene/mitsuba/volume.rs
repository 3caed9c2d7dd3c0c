//! Reads the texture `volume`, and what it and the coefficients of media may hold: `gridvolume`, whose file is Mitsuba's `.vol`, and `constvolume`.

use std::path::Path;
use std::sync::Arc;

use super::document::ElementId;
use super::grid_file::{GridFile, parse};
use super::params::Params;
use super::reader::{PluginTable, Reader, Role};
use super::source::Span;
use super::texture::{choice, wrap};
use super::{spectrum, value};
use crate::scene::desc::texture::{SpectrumTexture, WrapMode};
use crate::scene::desc::volume::VolumeTexture;
use crate::scene::desc::{EmissionGrid, MediumEmission, MicroflakeDesc, MicroflakeGrid};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::limits;
use crate::spectrum::Spectrum;
use crate::spectrum::blackbody::HOTTEST;
use glam::{DAffine3, DVec3};

/// Every `<volume type="…">`.
pub(super) const PLUGINS: PluginTable<SpectrumTexture> =
    &[("gridvolume", grid), (CONSTANT, |reader, params| constant(reader, params, Role::Reflectance))];

/// The plugin that does not vary.
const CONSTANT: &str = "constvolume";

/// The texture `volume`: what it holds, where a surface lies.
pub(super) fn volume(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<SpectrumTexture, SceneError> {
    let Some(id) = params.object("volume")? else {
        let found = params.fault(FindingKind::Missing, "a texture `volume` holds a <volume>");
        return Err(found.help("add <volume type=\"gridvolume\"> with its file").error());
    };
    read(reader, id, Role::Reflectance)
}

/// What a `<volume>` holds, in which a colour has this role.
pub(super) fn read(
    reader: &mut Reader<'_>,
    id: ElementId,
    role: Role,
) -> Result<SpectrumTexture, SceneError> {
    let params = Params::new(reader.document, id)?;
    let plugin = reader.plugin(&params, PLUGINS, &[])?;
    let read = match params.plugin() {
        CONSTANT => constant(reader, &params, role)?,
        _ => plugin(reader, &params)?,
    };
    reader.finish(params);
    Ok(read)
}

/// The same everywhere.
fn constant(reader: &mut Reader<'_>, params: &Params<'_>, role: Role) -> Result<SpectrumTexture, SceneError> {
    params.default("value", 1);
    params.without_effect(&["to_world"]);
    // A number of a texture need not be a share of light.
    let is_number = params.get("value").is_some_and(|e| matches!(e.tag.name, "float" | "integer"));
    let role = if is_number && role == Role::Reflectance { Role::Unbounded } else { role };
    let value = spectrum::read(reader, params, "value", role)?;
    Ok(value.unwrap_or(Spectrum::Constant(1.0)).into())
}

fn grid(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<SpectrumTexture, SceneError> {
    let PlacedGrid { file, to_grid, wrap, nearest } = placed(reader, params)?;
    if !matches!(file.channels, 1 | 3) {
        let message = format!(
            "this grid has {} channels: their mean counts, as a number without colour",
            file.channels
        );
        params.note(params.error("filename", message).warning());
    }
    rayon::spawn(Spectrum::prepare_textures);
    Ok(SpectrumTexture::Volume(Arc::new(VolumeTexture::new(file.grid.clone(), to_grid, wrap, nearest))))
}

/// A grid and where it lies.
struct PlacedGrid {
    file: Arc<GridFile>,
    to_grid: DAffine3,
    wrap: WrapMode,
    nearest: bool,
}

fn placed(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<PlacedGrid, SceneError> {
    let name = params.filename("a gridvolume", "vol")?;
    let span = params.get("filename").map_or(params.span(), |e| e.span_of("value"));
    let path = reader.document.resolve(&name, span);
    let at = |message: String| reader.document.finding(FindingKind::File, span, message);
    if let Some((format, help)) = sparse_format(&path) {
        let message = format!("{}: grids of {format} are not read", path.display());
        return Err(at(message).help(help).error());
    }
    params.without_effect(&["accel", "max_value", "raw"]);
    let nearest = choice(params, "filter_type", &["trilinear", "nearest"])? == 1;
    let wrap = wrap(params, WrapMode::Clamp)?;
    let to_world = params.to_world()?;
    let use_box = params.boolean("use_grid_bbox", false)?;
    let file = match reader.known.grids.get(&path) {
        Some(known) => known.clone(),
        None => {
            let bytes = reader.document.files.read(&path, limits::GRID_BYTES);
            let bytes = bytes.map_err(|e| reader.document.finding(e.kind(), span, e.to_string()).error())?;
            let file = parse(&bytes).map_err(|message| {
                let found = at(format!("{}: {message}", path.display()));
                found.help("a gridvolume is a `.vol` of version 3, as Mitsuba writes it").error()
            })?;
            count_texels(reader, span, file.grid.len())?;
            let file = Arc::new(file);
            tell(params, &path, &file);
            reader.known.grids.insert(path, file.clone());
            file
        }
    };
    let [low, high] = file.bounds;
    let mut to_unit = to_world;
    if use_box {
        if !(high - low).cmpgt(DVec3::ZERO).all() {
            let found = at("the box of this grid is empty".to_owned());
            return Err(found.help("leave out `use_grid_bbox`: the grid then fills the unit cube").error());
        }
        to_unit *= DAffine3::from_translation(low) * DAffine3::from_scale(high - low);
    }
    let to_grid = to_unit.inverse();
    if !to_grid.is_finite() {
        return Err(params.error("to_world", "the transform of a grid can be inverted").error());
    }
    Ok(PlacedGrid { file, to_grid, wrap, nearest })
}

/// The name of the sparse format that the ending of a file stands for, and how such a file becomes a `.vol`.
fn sparse_format(path: &Path) -> Option<(&'static str, &'static str)> {
    match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "vdb" => Some((
            "OpenVDB",
            "`tools/vdb_to_vol FILE.vdb` writes each grid of it as a `.vol`, and prints the <volume> that lies where the grid does",
        )),
        "nvdb" => Some((
            "NanoVDB",
            "`nanovdb_convert FILE.nvdb FILE.vdb`, a program of OpenVDB, makes a `.vdb` of it, of which `tools/vdb_to_vol FILE.vdb` makes a `.vol`",
        )),
        _ => None,
    }
}

/// Counts the texels of another grid, which is named at `span`, against the limit for a scene.
fn count_texels(reader: &mut Reader<'_>, span: Span, texels: usize) -> Result<(), SceneError> {
    reader.known.texels += texels;
    if reader.known.texels <= limits::TOTAL_TEXELS {
        return Ok(());
    }
    let message = format!("the textures of this scene have more than {} texels", limits::TOTAL_TEXELS);
    Err(reader.document.finding(FindingKind::Limit, span, message).error())
}

/// Tells what of a file is not used.
fn tell(params: &Params<'_>, path: &Path, file: &GridFile) {
    if file.rest > 0 {
        let (path, rest) = (path.display(), file.rest);
        let message = format!("{path} has {rest} bytes behind its values, which are not used");
        params.note(params.error("filename", message).advice());
    }
}

/// The light of black bodies whose temperatures a `<volume>` holds, in units of `scale` K.
pub(super) fn black_bodies(
    reader: &mut Reader<'_>,
    id: ElementId,
    scale: f64,
) -> Result<MediumEmission, SceneError> {
    let params = Params::new(reader.document, id)?;
    reader.plugin(&params, PLUGINS, &[])?;
    let read = match params.plugin() {
        CONSTANT => black_body(&params, "value", scale)?,
        _ => black_bodies_on_grid(reader, &params, scale)?,
    };
    reader.finish(params);
    Ok(read)
}

/// The light of a black body of the temperature that the parameter `name` gives, in units of `scale` K.
pub(super) fn black_body(
    params: &Params<'_>,
    name: &'static str,
    scale: f64,
) -> Result<MediumEmission, SceneError> {
    let Some(temperature) = params.float(name)? else {
        let found = params.fault(FindingKind::Missing, format!("a temperature needs `{name}`"));
        return Err(found.help(format!("add <float name=\"{name}\" value=\"…\"/>, in K")).error());
    };
    let radiance =
        spectrum::of_temperature(temperature * scale).map_err(|e| params.error(name, e).error())?;
    Ok(MediumEmission { radiance, grid: None })
}

/// Hotter bodies emit light that is seen, K.
const GLOWING: f32 = 500.0;

fn black_bodies_on_grid(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    scale: f64,
) -> Result<MediumEmission, SceneError> {
    let PlacedGrid { file, to_grid, wrap, nearest } = placed(reader, params)?;
    if file.channels != 1 {
        let message = format!("a temperature is one number, and this grid has {} channels", file.channels);
        return Err(params.error("filename", message).help("give a grid of one channel").error());
    }
    let span = params.get("filename").map_or(params.span(), |e| e.span_of("value"));
    count_texels(reader, span, file.grid.len())?;
    let (mut dark, mut hottest) = (0, 0.0f32);
    let grid = file.grid.mapped(|value| {
        let kelvin = f64::from(value) * scale;
        let counts = (0.0..=HOTTEST).contains(&kelvin);
        dark += usize::from(!counts);
        let kelvin = if counts { kelvin as f32 } else { 0.0 };
        hottest = hottest.max(kelvin);
        [kelvin]
    });
    if dark > 0 {
        let all = grid.len();
        let message = format!(
            "{dark} of the {all} temperatures of this grid are negative, above {HOTTEST:e} K or no numbers: they count as 0 K"
        );
        params.note(params.error("filename", message).warning());
    }
    if hottest < GLOWING {
        let message =
            format!("no temperature of this grid is above {hottest} K: it emits no light that is seen");
        let help = "temperatures are in K: `temperature_scale` of the medium is a factor on them";
        params.note(params.error("filename", message).help(help).warning());
    }
    let kelvin = Arc::new(VolumeTexture::new(Arc::new(grid), to_grid, wrap, nearest));
    let grid = Some(EmissionGrid::Temperatures(kelvin));
    Ok(MediumEmission { radiance: Spectrum::Constant(1.0), grid })
}

/// The matrices of microflakes that a `<volume>` holds, six numbers at each of its points.
pub(super) fn microflakes(reader: &mut Reader<'_>, id: ElementId) -> Result<MicroflakeDesc, SceneError> {
    let params = Params::new(reader.document, id)?;
    reader.plugin(&params, PLUGINS, &[])?;
    let read = match params.plugin() {
        CONSTANT => uniform_microflakes(&params)?,
        _ => microflake_grid(reader, &params)?,
    };
    reader.finish(params);
    Ok(read)
}

/// One matrix as six numbers, which Mitsuba's documentation promises and 3.9.1 refuses.
fn uniform_microflakes(params: &Params<'_>) -> Result<MicroflakeDesc, SceneError> {
    params.without_effect(&["to_world"]);
    let help = "write <string name=\"value\" value=\"Sxx, Syy, Szz, Sxy, Sxz, Syz\"/>, or give a `gridvolume` of six channels";
    let is_text = params.get("value").is_some_and(|element| element.tag.name == "string");
    let text = if is_text { params.string("value")? } else { None };
    let Some(text) = text else {
        let message = "the matrix of microflakes is six numbers";
        return Err(params.type_fault(message).help(help).error());
    };
    let refused = |message: String| Err(params.error("value", message).help(help).error());
    match value::numbers(&text) {
        Ok(numbers) => match <[f64; 6]>::try_from(numbers.as_slice()) {
            Ok(s) if !is_positive(s) || s[..3].iter().all(|v| *v == 0.0) => refused(NOT_POSITIVE.to_owned()),
            Ok(s) => Ok(MicroflakeDesc::Uniform(s)),
            Err(_) => {
                refused(format!("the matrix of microflakes is six numbers, and these are {}", numbers.len()))
            }
        },
        Err(message) => refused(message),
    }
}

fn microflake_grid(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<MicroflakeDesc, SceneError> {
    let PlacedGrid { file, to_grid, wrap, nearest } = placed(reader, params)?;
    let Some(halves) = &file.halves else {
        let message =
            format!("the matrix of microflakes has six channels, and this grid has {}", file.channels);
        let help = "they are Sxx, Syy, Szz, Sxy, Sxz and Syz";
        return Err(params.error("filename", message).help(help).error());
    };
    let bad = MicroflakeGrid::matrices(halves).filter(|s| !is_positive(s.map(f64::from))).count();
    if bad > 0 {
        let all = file.grid.len();
        let message = format!("{bad} of the {all} matrices of this grid cannot be: {NOT_POSITIVE}");
        return Err(params.error("filename", message).error());
    }
    let grid = MicroflakeGrid::new(halves.clone(), to_grid, wrap, nearest);
    // Mitsuba has no other way to write one matrix.
    let mut all = MicroflakeGrid::matrices(halves);
    let first = all.next().unwrap_or_default();
    match first[..3].iter().any(|v| *v > 0.0) && all.all(|s| s == first) {
        true => Ok(MicroflakeDesc::Uniform(first.map(f64::from))),
        false => Ok(MicroflakeDesc::Grid(Arc::new(grid))),
    }
}

/// What is wrong with a matrix that is not [`is_positive`].
const NOT_POSITIVE: &str = "the matrix of microflakes is positive definite, with finite numbers up to 1e6";

/// True for the matrix of an ellipsoid, which may be flat, a line or nothing.
fn is_positive([xx, yy, zz, xy, xz, yz]: [f64; 6]) -> bool {
    // Minors of a flat one may be below 0 by the rounding of single precision.
    let flat = |a: f64, b: f64, c: f64| a * b - c * c >= -1e-6 * a * b;
    let det = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    [xx, yy, zz].iter().all(|v| (0.0..=1e6).contains(v))
        && flat(xx, yy, xy)
        && flat(xx, zz, xz)
        && flat(yy, zz, yz)
        && det >= -1e-6 * xx * yy * zz
}
