//! Writes the text of a scene, and keeps the files in memory that it names.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use glam::DAffine3;

use super::stage;
use crate::scene::diagnostic::{Finding, FindingKind, LineAt, SceneError, SceneWarning};
use crate::scene::files::ReadError;
use crate::scene::limits;

/// Size of the picture of a model, pixels.
const FILM: [u32; 2] = [1280, 720];

/// Reflectance of what has no material.
pub(super) const CLAY: [f32; 3] = [0.6, 0.58, 0.55];

/// A model as a scene.
pub(crate) struct ModelScene {
    /// The text of the scene.
    pub(crate) text: String,
    /// The files that it names and that are on no disk.
    pub(crate) files: BTreeMap<PathBuf, Vec<u8>>,
    pub(crate) warnings: Vec<SceneWarning>,
    /// The model has no camera: that of the text is to be moved by [`frame`](stage::frame).
    pub(crate) unframed: bool,
    /// Its pictures are encoded as sRGB whatever their files say, as glTF demands.
    pub(crate) srgb_pictures: bool,
}

/// A scene that is being written.
pub(super) struct SceneText<'a> {
    /// The model.
    pub(super) path: &'a Path,
    /// The model has a light of its own, so that it needs no sky.
    pub(super) lit: bool,
    /// It has a light all around, of which a scene can have one.
    pub(super) domed: bool,
    /// It has a camera.
    pub(super) framed: bool,
    out: String,
    depth: usize,
    files: BTreeMap<PathBuf, Vec<u8>>,
    ids: BTreeSet<String>,
    /// The last number that was added to an id of this name.
    numbers: BTreeMap<String, usize>,
    warnings: Vec<SceneWarning>,
    /// Messages about places within the model: the first place and how many there are.
    told: BTreeMap<String, (String, usize)>,
    /// Messages beyond the number that is kept.
    untold: usize,
}

impl<'a> SceneText<'a> {
    /// An empty scene for the model `path`.
    pub(super) fn new(path: &'a Path) -> Self {
        Self {
            path,
            lit: false,
            domed: false,
            framed: false,
            out: "<scene version=\"3.0.0\">\n".to_owned(),
            depth: 1,
            files: BTreeMap::new(),
            ids: ["sky", "clay", "coloured clay", "textured"].map(str::to_owned).into(),
            numbers: BTreeMap::new(),
            warnings: Vec::new(),
            told: BTreeMap::new(),
            untold: 0,
        }
    }

    /// True for a text that is longer than any that is read: nothing more is written.
    pub(super) fn is_too_long(&self) -> bool {
        self.out.len() as u64 > limits::TOTAL_XML_BYTES
    }

    /// Writes what stands between the tags of `<tag type="kind" …>`.
    pub(super) fn object(
        &mut self,
        tag: &str,
        kind: &str,
        attributes: &[(&str, &str)],
        inside: impl FnOnce(&mut Self),
    ) {
        if self.is_too_long() {
            return;
        }
        let all: Vec<_> = [("type", kind)].into_iter().chain(attributes.iter().copied()).collect();
        self.element(tag, &all, inside);
    }

    fn element(&mut self, tag: &str, attributes: &[(&str, &str)], inside: impl FnOnce(&mut Self)) {
        self.tag(tag, attributes, ">");
        self.depth += 1;
        inside(self);
        self.depth -= 1;
        let _ = writeln!(self.out, "{:1$}</{tag}>", "", 4 * self.depth);
    }

    /// Writes an opening tag, or with `/>` a whole element.
    fn tag(&mut self, tag: &str, attributes: &[(&str, &str)], end: &str) {
        let _ = write!(self.out, "{:1$}<{tag}", "", 4 * self.depth);
        for (name, value) in attributes {
            let _ = write!(self.out, " {name}=\"{}\"", escaped(value));
        }
        let _ = writeln!(self.out, "{end}");
    }

    /// Writes `<tag name="…" value="…"/>`.
    pub(super) fn value(&mut self, tag: &str, name: &str, value: impl ToString) {
        self.tag(tag, &[("name", name), ("value", &value.to_string())], "/>");
    }

    pub(super) fn rgb(&mut self, name: &str, [r, g, b]: [f32; 3]) {
        self.value("rgb", name, format!("{r} {g} {b}"));
    }

    pub(super) fn reference(&mut self, id: &str) {
        self.tag("ref", &[("id", id)], "/>");
    }

    /// Writes a reference of this name.
    pub(super) fn named_reference(&mut self, name: &str, id: &str) {
        self.tag("ref", &[("name", name), ("id", id)], "/>");
    }

    /// Writes a transform of this name.
    pub(super) fn transform(&mut self, name: &str, matrix: &DAffine3) {
        let rows = glam::DMat4::from(*matrix).transpose().to_cols_array();
        let numbers: Vec<String> = rows.iter().map(f64::to_string).collect();
        self.element("transform", &[("name", name)], |text| {
            text.tag("matrix", &[("value", &numbers.join(" "))], "/>");
        });
    }

    /// Writes an attribute of the mesh as the parameter `name`.
    pub(super) fn attribute(&mut self, name: &str, attribute: &str) {
        self.object("texture", "mesh_attribute", &[("name", name)], |text| {
            text.value("string", "name", attribute);
        });
    }

    /// Writes a shape by a mesh file with the material `bsdf`.
    pub(super) fn shape(&mut self, kind: &str, file: &str, bsdf: &str, more: impl FnOnce(&mut Self)) {
        self.object("shape", kind, &[], |text| {
            text.value("string", "filename", file);
            text.reference(bsdf);
            more(text);
        });
    }

    /// An `id` like `wanted` that nothing has yet.
    pub(super) fn id(&mut self, wanted: &str) -> String {
        let plain = |c: char| if c.is_alphanumeric() || " -_.".contains(c) { c } else { '_' };
        let name: String = wanted.trim().chars().take(60).map(plain).collect();
        let name = if name.is_empty() { "object".to_owned() } else { name };
        let mut id = name.clone();
        while !self.ids.insert(id.clone()) {
            let number = self.numbers.entry(name.clone()).or_insert(1);
            *number += 1;
            id = format!("{name} {number}");
        }
        id
    }

    /// The model's own name in its text.
    pub(super) fn own_name(&self) -> String {
        self.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// True if a file that the model names is on the disk.
    pub(super) fn is_there(&self, name: &str) -> bool {
        self.path.parent().unwrap_or(Path::new("")).join(name.replace('\\', "/")).is_file()
    }

    /// Keeps a file; returns the name that the text has for it.
    pub(super) fn file(&mut self, name: &str, bytes: Vec<u8>) -> String {
        let name = format!("{}/{name}", self.own_name());
        // As the reader resolves it.
        let path = self.path.parent().unwrap_or(Path::new("")).join(name.replace('\\', "/"));
        self.files.insert(path, bytes);
        name
    }

    /// Notes something of the model that is not shown as it says.
    pub(super) fn note(&mut self, message: impl Into<String>) {
        let found = finding(self.path, FindingKind::Parameter, [1, 1], message.into());
        self.warn(found.label("in this model").warning());
    }

    /// Notes at the end of the reading that something at `place` is not shown as it says, once for all places.
    pub(super) fn tell(&mut self, message: impl Into<String>, place: &str) {
        let message = message.into();
        if let Some((_, count)) = self.told.get_mut(&message) {
            *count += 1;
        } else if self.told.len() < limits::WARNINGS / 2 {
            self.told.insert(message, (place.to_owned(), 1));
        } else {
            self.untold += 1;
        }
    }

    pub(super) fn warn(&mut self, warning: SceneWarning) {
        if self.warnings.len() < limits::WARNINGS {
            self.warnings.push(warning);
        }
    }

    /// Writes a camera with a field of view of `fov` degrees along `axis`, for a picture of this width over its height.
    pub(super) fn camera(&mut self, fov: f64, axis: &str, aspect: Option<f64>, more: impl FnOnce(&mut Self)) {
        self.sensor("perspective", aspect, |text| {
            text.value("float", "fov", fov);
            text.value("string", "fov_axis", axis);
            more(text);
        });
    }

    /// Writes a camera of this plugin, for a picture of this width over its height.
    pub(super) fn sensor(&mut self, kind: &str, aspect: Option<f64>, inside: impl FnOnce(&mut Self)) {
        let [width, height] = FILM;
        let width = aspect.map_or(width, |a| (f64::from(height) * a).round().clamp(16.0, 8192.0) as u32);
        self.object("sensor", kind, &[], |text| {
            inside(text);
            text.object("film", "hdrfilm", &[], |text| {
                text.value("integer", "width", width);
                text.value("integer", "height", height);
            });
        });
    }

    /// The scene, with a sky and a camera where the model has none.
    pub(super) fn finish(mut self) -> ModelScene {
        for (message, (place, count)) in std::mem::take(&mut self.told) {
            self.note(match count {
                1 => format!("{message} ({place})"),
                _ => format!("{message} ({place} and {} more)", count - 1),
            });
        }
        if self.untold > 0 {
            self.note(format!("{} more remarks of other kinds are not listed", self.untold));
        }
        if !self.lit {
            let sky = self.file("sky.pfm", stage::sky());
            self.object("emitter", "envmap", &[("id", "sky")], |text| text.value("string", "filename", sky));
        }
        if !self.framed {
            self.camera(stage::FOV, "smaller", None, |_| ());
        }
        let Self { out, files, warnings, framed, .. } = self;
        ModelScene { text: out + "</scene>\n", files, warnings, unframed: !framed, srgb_pictures: false }
    }
}

/// A finding about a model as a whole, or at a line and column of it.
pub(super) fn finding(
    path: &Path,
    kind: FindingKind,
    [line, column]: [usize; 2],
    message: String,
) -> Finding {
    let file = path.to_string_lossy();
    Finding::new(kind, LineAt { file: &file, text: "", line, column, range: (0, 0) }, message)
}

/// The error of a file that cannot be read.
pub(super) fn unreadable(path: &Path, error: &ReadError) -> SceneError {
    finding(path, error.kind(), [1, 1], error.to_string()).error()
}

/// Text as the value of an attribute.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// The vertices of a mesh; what is empty is not there.
#[derive(Default)]
pub(super) struct PlyVertices<'a> {
    pub(super) positions: &'a [[f32; 3]],
    pub(super) normals: &'a [[f32; 3]],
    pub(super) uvs: &'a [[f32; 2]],
    pub(super) colors: &'a [[f32; 3]],
}

/// A mesh as a PLY file.
pub(super) fn ply(vertices: &PlyVertices<'_>, triangles: &[[u32; 3]]) -> Vec<u8> {
    ply_with_opacities(vertices, &[], triangles)
}

/// A mesh as a PLY file, with the attribute `vertex_opacity` unless it is empty.
pub(super) fn ply_with_opacities(
    vertices: &PlyVertices<'_>,
    opacities: &[f32],
    triangles: &[[u32; 3]],
) -> Vec<u8> {
    let PlyVertices { positions, normals, uvs, colors } = vertices;
    let mut header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", positions.len());
    let columns: [(&str, usize); 5] = [
        ("x y z", 3),
        ("nx ny nz", normals.len()),
        ("u v", uvs.len()),
        ("r g b", colors.len()),
        ("opacity_0", opacities.len()),
    ];
    for name in columns.iter().filter(|c| c.1 > 0).flat_map(|c| c.0.split(' ')) {
        let _ = writeln!(header, "property float {name}");
    }
    let faces = triangles.len();
    let _ = write!(header, "element face {faces}\nproperty list uchar int vertex_indices\nend_header\n");
    let per_vertex = 4 * columns.iter().filter(|c| c.1 > 0).map(|c| c.0.split(' ').count()).sum::<usize>();
    let mut out = Vec::with_capacity(header.len() + per_vertex * positions.len() + 13 * faces);
    out.extend_from_slice(header.as_bytes());
    for (i, position) in positions.iter().enumerate() {
        let of = |all: &[[f32; 3]]| all.get(i).copied();
        out.extend_from_slice(bytemuck::bytes_of(position));
        of(normals).iter().for_each(|v| out.extend_from_slice(bytemuck::bytes_of(v)));
        uvs.get(i).iter().for_each(|v| out.extend_from_slice(bytemuck::bytes_of(*v)));
        of(colors).iter().for_each(|v| out.extend_from_slice(bytemuck::bytes_of(v)));
        opacities.get(i).iter().for_each(|v| out.extend_from_slice(bytemuck::bytes_of(*v)));
    }
    for triangle in triangles {
        out.push(3);
        out.extend_from_slice(bytemuck::bytes_of(triangle));
    }
    out
}
