//! Films and their reconstruction filters.

use super::document::ElementId;
use super::params::Params;
use super::reader::Reader;
use super::suggest;
use crate::scene::desc::{Crop, FilmDesc, ReconstructionFilter};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::limits;

/// Every film. They differ in what they write, which is not the scene's business here.
const FILMS: &[&str] = &["hdrfilm", "ldrfilm", "specfilm"];

/// Every filter that can be splatted.
const FILTERS: &[(&str, ReconstructionFilter)] = &[
    ("box", ReconstructionFilter::Box),
    ("tent", ReconstructionFilter::Tent),
    ("gaussian", ReconstructionFilter::Gaussian),
];

/// Filters of Mitsuba that have negative lobes; a Gaussian stands in for them.
const REPLACED: &[&str] = &["mitchell", "catmullrom", "lanczos"];

/// The film of a camera without one: Mitsuba's size.
pub(crate) fn default() -> FilmDesc {
    FilmDesc { width: 768, height: 576, crop: None, rfilter: None }
}

/// Reads a film.
pub(crate) fn read(reader: &mut Reader<'_>, id: ElementId) -> Result<FilmDesc, SceneError> {
    let params = Params::new(reader.document, id)?;
    if !FILMS.contains(&params.plugin()) {
        return Err(reader.unknown_plugin(&params, FILMS));
    }
    params.without_effect(&[
        "file_format",
        "pixel_format",
        "component_format",
        "compensate",
        "sample_border",
        "banner",
        "high_quality_edges",
        "attach_log",
    ]);
    let width = side(&params, "width", i64::from(default().width))?;
    let height = side(&params, "height", i64::from(default().height))?;
    if width * height > limits::FILM_PIXELS {
        let message = format!("the film has more than {} pixels", limits::FILM_PIXELS);
        return Err(params.error("width", message).error());
    }
    let crop = crop(&params, width, height)?;
    let rfilter = match params.object("rfilter")? {
        Some(id) => Some(filter(reader, id)?),
        None => None,
    };
    reader.finish(params);
    Ok(FilmDesc { width: width as u32, height: height as u32, crop, rfilter })
}

fn side(params: &Params<'_>, name: &'static str, default: i64) -> Result<i64, SceneError> {
    let v = params.integer(name)?.unwrap_or(default);
    if (1..=limits::FILM_SIDE).contains(&v) {
        return Ok(v);
    }
    Err(params.error(name, format!("a film is 1 to {} pixels wide and high", limits::FILM_SIDE)).error())
}

/// The part to render; `None` when it is the whole film.
fn crop(params: &Params<'_>, width: i64, height: i64) -> Result<Option<Crop>, SceneError> {
    let x = params.integer("crop_offset_x")?.unwrap_or(0);
    let y = params.integer("crop_offset_y")?.unwrap_or(0);
    let w = params.integer("crop_width")?.unwrap_or(width);
    let h = params.integer("crop_height")?.unwrap_or(height);
    let fits = |offset: i64, size: i64, whole: i64| {
        offset >= 0 && size >= 1 && offset.checked_add(size).is_some_and(|end| end <= whole)
    };
    for (name, ok) in [("crop_width", fits(x, w, width)), ("crop_height", fits(y, h, height))] {
        if !ok {
            return Err(params
                .error(name, format!("the crop leaves the film of {width} × {height} pixels"))
                .error());
        }
    }
    let whole = (x, y, w, h) == (0, 0, width, height);
    Ok((!whole).then_some(Crop { x: x as u32, y: y as u32, width: w as u32, height: h as u32 }))
}

fn filter(reader: &mut Reader<'_>, id: ElementId) -> Result<ReconstructionFilter, SceneError> {
    let params = Params::new(reader.document, id)?;
    let known = FILTERS.iter().find(|(name, _)| *name == params.plugin());
    let filter = match known {
        Some((_, filter)) => *filter,
        None if REPLACED.contains(&params.plugin()) => {
            let message = format!("the filter `{}` is replaced by a Gaussian", params.plugin());
            let found =
                reader.document.finding(FindingKind::Plugin, params.element().span_of("type"), message);
            params.note(found.help("filters with negative lobes cannot be splatted").warning());
            params.without_effect(&["A", "B", "lobes"]);
            ReconstructionFilter::Gaussian
        }
        None => {
            let names: Vec<&str> = FILTERS.iter().map(|f| f.0).collect();
            let found = suggest::hint(params.plugin(), &names);
            let message =
                format!("there is no filter `{}`", params.plugin().chars().take(64).collect::<String>());
            let span = params.element().span_of("type");
            return Err(reader.document.finding(FindingKind::Plugin, span, message).help(found).error());
        }
    };
    for name in ["radius", "stddev"] {
        if params.has(name) {
            let found = params.error(name, "filters have a fixed size here; this is not used");
            params.note(found.help("choose a filter on the command line with --filter").warning());
        }
    }
    reader.finish(params);
    Ok(filter)
}
