//! Saves changes as a scene file that includes the original.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::image::ImageError;
use crate::image::write::atomically;

use crate::scene::desc::{
    CameraDesc, FilmDesc, LensDesc, PerspectiveDesc, Place, ProjectionDesc, ReconstructionFilter, SceneDesc,
};
use crate::scene::mitsuba::{LoadOptions, read_text};

use super::Edits;
use super::camera_text::sensor_parameters;
use super::objects::address;
use super::target::{EditError, NewValue, Target};

/// The reason why changes could not be saved. Nothing was written or replaced then.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// The name given is that of a file the scene was read from.
    #[error("{path} is part of the scene itself and is not overwritten; give another name")]
    Original {
        /// The name.
        path: String,
    },
    /// A folder that the operating system does not find.
    #[error("cannot find the folder {path}: {source}")]
    Io {
        /// The folder.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// The file cannot be written.
    #[error(transparent)]
    Write(#[from] ImageError),
    /// A name that cannot be written to a scene file.
    #[error("{what} `{text}` cannot stand in a scene file: {why}")]
    Text {
        /// The thing that the name belongs to.
        what: &'static str,
        /// The name.
        text: String,
        /// Why not.
        why: &'static str,
    },
    /// A value that does not belong to the scene.
    #[error(transparent)]
    Edit(#[from] EditError),
    /// A camera that the reader would not read back as it is.
    #[error("this camera cannot be saved: {0}")]
    Camera(String),
}

/// Explains the file to people; the reader skips it.
const COMMENT: &str = "    \
    <!-- Changes to a scene, saved by the viewer. The camera, film and sample count given here take the place of the\n         \
    original's, so names set with -D no longer reach those. <edit> is an element of Pointillist: Mitsuba loads this\n         \
    file while it has none, and refuses it rather than show the original's values. -->\n";

/// Most folders that are named. They are for Mitsuba, which looks for meshes only beside the file it was told to load.
const MOST_FOLDERS: usize = 4;

impl Edits {
    /// Writes a scene file `path` that includes `original` and carries the changes, so that loading it gives
    /// `self.apply(desc)`. `desc` is the description as read from `original` with `defines` (the `-D name=value`),
    /// which are written as defaults. Written under another name first and renamed when complete.
    ///
    /// # Errors
    ///
    /// [`SaveError`]; a file that the scene was read from is never replaced.
    pub fn write(
        &self,
        path: &Path,
        original: &Path,
        defines: &[(String, String)],
        desc: &SceneDesc,
    ) -> Result<(), SaveError> {
        let folder = folder_of(path)?;
        let name = path.file_name().ok_or_else(|| SaveError::Text {
            what: "the file name",
            text: path.display().to_string(),
            why: "it names no file",
        })?;
        let target = folder.join(name);
        let files = desc.files.iter().map(PathBuf::as_path).chain([original]);
        if let Ok(existing) = target.canonicalize()
            && files.into_iter().any(|f| f.canonicalize().is_ok_and(|f| f == existing))
        {
            return Err(SaveError::Original { path: path.display().to_string() });
        }
        let text = self.xml(&folder, original, defines, desc)?;
        Ok(atomically(&target, text.as_bytes())?)
    }

    fn xml(
        &self,
        folder: &Path,
        original: &Path,
        defines: &[(String, String)],
        desc: &SceneDesc,
    ) -> Result<String, SaveError> {
        let mut out = String::from("<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<scene version=\"3.0.0\">\n");
        out.push_str(COMMENT);
        for (i, (name, value)) in defines.iter().enumerate() {
            // The last of two with one name counts, of defaults the first.
            if !defines[i + 1..].iter().any(|(n, _)| n == name) {
                let (name, value) = (attribute("the name", name)?, attribute("the value", value)?);
                let _ = writeln!(out, "    <default name=\"{name}\" value=\"{value}\"/>");
            }
        }
        if let Some(camera) = &self.camera {
            out.push_str(&sensor(camera, desc)?);
        }
        let (parent, include) = relative(folder, original)?;
        let mut folders = vec![parent];
        for file in &desc.files {
            if let Ok((other, _)) = relative(folder, file)
                && !folders.contains(&other)
            {
                folders.push(other);
            }
        }
        for other in folders.iter().filter(|f| !f.is_empty()).take(MOST_FOLDERS) {
            let _ = writeln!(out, "    <path value=\"{}\"/>", attribute("the folder", other)?);
        }
        let _ = writeln!(out, "    <include filename=\"{}\"/>", attribute("the path", &include)?);
        for (target, value) in &self.values {
            out.push_str(&edit(desc, *target, *value)?);
        }
        out.push_str("</scene>\n");
        Ok(out)
    }
}

/// One `<edit>`.
fn edit(desc: &SceneDesc, target: Target, value: NewValue) -> Result<String, SaveError> {
    target.get(desc)?;
    target.check(value)?;
    let (parameter, index) = target.parameter();
    let object = parameter.object.tag();
    let none = EditError::NoTarget { object, index, parameter: parameter.label };
    let found = address(desc, parameter.object, index).ok_or(none)?;
    let which = match found.id {
        Some(id) => format!("id=\"{}\"", attribute("the id", id)?),
        None => format!("index=\"{index}\" count=\"{}\" type=\"{}\"", found.count, found.kind),
    };
    let value = value.numbers().iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(", ");
    Ok(format!("    <edit object=\"{object}\" {which} name=\"{}\" value=\"{value}\"/>\n", parameter.name))
}

/// Folder and name of `file` as seen from `folder` (a path without links), with `/` between: relative where they have
/// more than the root in common.
fn relative(folder: &Path, file: &Path) -> Result<(String, String), SaveError> {
    // The file itself may be a link; what it names lies beside the link.
    let parent = folder_of(file)?;
    let unsayable = |why| SaveError::Text { what: "the path", text: file.display().to_string(), why };
    let name = file.file_name().ok_or_else(|| unsayable("it names no file"))?;
    let common = folder.components().zip(parent.components()).take_while(|(a, b)| a == b).count();
    let mut out = PathBuf::new();
    if common > 1 {
        (common..folder.components().count()).for_each(|_| out.push(".."));
        parent.components().skip(common).for_each(|c| out.push(c));
    } else {
        out.push(&parent);
    }
    let text = |p: &Path| p.to_str().map(str::to_owned).ok_or_else(|| unsayable("it is not UTF-8"));
    let words =
        |p: &Path| text(p).map(|t| if std::path::MAIN_SEPARATOR == '/' { t } else { t.replace('\\', "/") });
    Ok((words(&out)?, words(&out.join(name))?))
}

/// `text` as the value of an attribute.
fn attribute(what: &'static str, text: &str) -> Result<String, SaveError> {
    let refuse = |why| Err(SaveError::Text { what, text: text.chars().take(200).collect(), why });
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\t' | '\n' | '\r' => drop(write!(out, "&#{};", c as u32)),
            '$' => return refuse("`$` would be read as the start of a name"),
            '\0'..' ' | '\u{fffe}' | '\u{ffff}' => return refuse("XML has no such character"),
            c => out.push(c),
        }
    }
    Ok(out)
}

/// The folder that a file lies in, without links.
fn folder_of(file: &Path) -> Result<PathBuf, SaveError> {
    let folder = file.parent().filter(|p| *p != Path::new("")).unwrap_or(Path::new("."));
    let error = |source| SaveError::Io { path: folder.display().to_string(), source };
    folder.canonicalize().map_err(error)
}

/// A complete `<sensor>`: `camera`, and film and sample count of `desc`. Stands in front of the include, because the
/// first of two sensors counts, here as in Mitsuba.
///
/// # Errors
///
/// [`SaveError::Camera`] when the reader would not read the same camera and film back.
fn sensor(camera: &CameraDesc, desc: &SceneDesc) -> Result<String, SaveError> {
    let mut out = sensor_parameters(camera, "    ");
    out.push_str(&film_element(&desc.film));
    if let Some(n) = desc.samples_per_pixel {
        let _ = writeln!(
            out,
            "        <sampler type=\"independent\">\n            <integer name=\"sample_count\" value=\"{n}\"/>\n        </sampler>"
        );
    }
    // The medium stands in the original, which the check does not read.
    check_sensor(&format!("{out}{SENSOR_END}"), &CameraDesc { medium: None, ..camera.clone() }, &desc.film)?;
    if let Some(medium) = camera.medium {
        let name = desc.names.media.get(medium.0 as usize).and_then(|name| name.id.as_deref());
        let unnamed =
            || SaveError::Camera("its medium has no id by which the new sensor could name it".to_owned());
        let _ = writeln!(out, "        <ref id=\"{}\"/>", attribute("the id", name.ok_or_else(unnamed)?)?);
    }
    Ok(out + SENSOR_END)
}

/// Ends a sensor.
const SENSOR_END: &str = "    </sensor>\n";

fn film_element(film: &FilmDesc) -> String {
    let mut out = String::from("        <film type=\"hdrfilm\">\n");
    let mut integer = |name: &str, v: u32| {
        let _ = writeln!(out, "            <integer name=\"{name}\" value=\"{v}\"/>");
    };
    integer("width", film.width);
    integer("height", film.height);
    if let Some(crop) = film.crop {
        integer("crop_offset_x", crop.x);
        integer("crop_offset_y", crop.y);
        integer("crop_width", crop.width);
        integer("crop_height", crop.height);
    }
    let parameter = |plugin: &str, name: &str, value: f64| {
        format!(
            "            <rfilter type=\"{plugin}\">\n                <float name=\"{name}\" value=\"{value:?}\"/>\n            </rfilter>\n"
        )
    };
    out += &match film.rfilter {
        Some(ReconstructionFilter::Box) => "            <rfilter type=\"box\"/>\n".to_owned(),
        Some(ReconstructionFilter::Tent { radius }) => parameter("tent", "radius", radius),
        Some(ReconstructionFilter::Gaussian { stddev }) => parameter("gaussian", "stddev", stddev),
        None => String::new(),
    };
    out.push_str("        </film>\n");
    out
}

/// The camera without what is not written: the places in the file, and the focus and the blades of a pinhole.
fn comparable(camera: &CameraDesc) -> CameraDesc {
    let mut camera = CameraDesc { place: Place::default(), ..camera.clone() };
    match &mut camera.projection {
        ProjectionDesc::Perspective(PerspectiveDesc { lens, .. }) if lens.radius == 0.0 => {
            *lens = LensDesc::PINHOLE;
        }
        ProjectionDesc::Batch(cameras) => cameras.iter_mut().for_each(|camera| *camera = comparable(camera)),
        _ => (),
    }
    camera
}

/// Reads the element back: an element that the reader refuses or understands otherwise must not be written.
fn check_sensor(sensor: &str, camera: &CameraDesc, film: &FilmDesc) -> Result<(), SaveError> {
    let text = format!("<scene version=\"3.0.0\">{sensor}</scene>");
    let read = read_text("camera", &text, Default::default(), &LoadOptions::default());
    let read = read.map_err(|e| SaveError::Camera(e.to_string()))?.desc;
    if comparable(&read.camera) == comparable(camera) && read.film == *film {
        return Ok(());
    }
    Err(SaveError::Camera("a number of it does not survive being written".to_owned()))
}
