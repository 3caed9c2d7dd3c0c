//! OBJ with its materials (MTL): a mesh and a bsdf for each (`obj_material.rs`).

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;

use super::mtl::MtlFile;
use super::obj_material::{self, ModelPictures, ObjEmission};
use super::text::{CLAY, finding, unreadable};
use super::text::{PlyVertices, SceneText, ply};
use crate::scene::desc::{Mesh, MeshAttribute};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::files::SceneFiles;
use crate::scene::limits;
use crate::scene::mesh::{self, MISSING_UV};

/// Name of the material of what names none.
const NO_MATERIAL: &str = "clay";

/// The same in the colours of the vertices.
const COLORED: &str = "coloured clay";

/// Reads an OBJ file and its MTL files.
pub(super) fn read(text: &mut SceneText<'_>, files: &SceneFiles) -> Result<(), SceneError> {
    let path = text.path;
    let bytes = files.read(path, limits::MESH_BYTES).map_err(|e| unreadable(path, &e))?;
    // Without materials it is a mesh like any other.
    if !bytes.windows(6).any(|word| word == b"mtllib") {
        clay(text, begins_with_color(&bytes).then_some(MeshAttribute::VERTEX_COLOR));
        text.shape("obj", &text.own_name(), NO_MATERIAL, |_| ());
        return Ok(());
    }
    let mesh::NamedParts { mesh, materials, warnings } = mesh::obj_parts(&path.to_string_lossy(), &bytes)?;
    warnings.into_iter().for_each(|warning| text.warn(warning));
    let mut known = libraries(text, files, &materials.libraries);
    let parts = parts(&mesh, &materials.uses);
    if parts.is_empty() {
        let found =
            finding(path, FindingKind::Mesh, [1, 1], "this mesh has no triangle that can be traced".into());
        return Err(found.help("is it an OBJ file? faces are lines like `f 1 2 3`").error());
    }
    let colored = !mesh.attributes.is_empty();
    let (mut clay_is_there, mut colors_left, mut unknown) = (false, 0, Vec::new());
    let mut pictures = ModelPictures::new(files);
    let height = 0.01 * diagonal(&mesh);
    for (i, (name, triangles)) in parts.iter().enumerate() {
        let material = known.iter_mut().rev().find_map(|file| file.materials.get_mut(*name));
        let of_material = material.is_some();
        let (id, emission) = match material {
            Some(material) => obj_material::write(text, material, height, &mut pictures),
            None => {
                if !name.is_empty() {
                    unknown.push(*name);
                }
                if !std::mem::replace(&mut clay_is_there, true) {
                    clay(text, None);
                    if colored {
                        clay_as(text, COLORED, Some(MeshAttribute::VERTEX_COLOR));
                    }
                }
                (if colored { COLORED } else { NO_MATERIAL }.to_owned(), ObjEmission::None)
            }
        };
        colors_left += usize::from(of_material && colored);
        write_part(text, i, &mesh, triangles, colored && !of_material, &id, |text| emission.write(text));
    }
    for name in unknown {
        text.note(format!("no MTL file of this model has the material `{name}`: it is clay"));
    }
    if colors_left > 0 {
        text.note(format!(
            "the colours of vertices are not used where a material has its own, as {colors_left} have"
        ));
    }
    if !pictures.missing.is_empty() {
        let names: Vec<String> = pictures.missing.into_iter().collect();
        text.note(format!("{} pictures are not found and not used: {}", names.len(), names.join(", ")));
    }
    known.iter().for_each(|file| tell(text, file));
    Ok(())
}

/// One note for what an MTL file says and nothing uses, and one for each kind of fault in what is used.
fn tell(text: &mut SceneText<'_>, file: &MtlFile) {
    let mut left = file.left.clone();
    let mut faults: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    for material in file.materials.values().filter(|material| material.used) {
        left.merge(&material.left());
        for (line, count, what) in material.faults() {
            let known = faults.entry(what).or_insert((line, 0));
            *known = (known.0.min(line), known.1 + count);
        }
    }
    for (what, (line, count)) in faults {
        let times = if count > 1 { format!(", {count} times") } else { String::new() };
        text.warn(file.finding(line, format!("in line {line}: {what}{times}")).label("the first").warning());
    }
    if let Some((note, line)) = left.note() {
        text.warn(file.finding(line, note).label("the first").warning());
    }
}

/// Length of the diagonal of the box around a mesh.
fn diagonal(mesh: &Mesh) -> f32 {
    let finite = mesh.positions.iter().filter(|p| p.is_finite());
    let boxed = finite.fold(None, |boxed: Option<[glam::Vec3; 2]>, p| {
        let [lo, hi] = boxed.unwrap_or([*p; 2]);
        Some([lo.min(*p), hi.max(*p)])
    });
    boxed.map_or(0.0, |[lo, hi]| lo.distance(hi))
}

/// True if the first vertex of an OBJ file has a colour after its position.
fn begins_with_color(bytes: &[u8]) -> bool {
    let mut lines = bytes.split(|b| *b == b'\n').map(<[u8]>::trim_ascii);
    let first = lines.find_map(|line| {
        line.strip_prefix(b"v").filter(|rest| rest.starts_with(b" ") || rest.starts_with(b"\t"))
    });
    let numbers = first.unwrap_or_default().split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    let numbers = numbers.map_while(|word| std::str::from_utf8(word).ok()?.parse::<f32>().ok());
    numbers.take(6).count() == 6
}

/// The triangles of each material, however often the file goes back to it.
pub(super) fn parts<'a>(mesh: &Mesh, uses: &'a [(usize, String)]) -> BTreeMap<&'a str, Vec<[u32; 3]>> {
    let mut parts: BTreeMap<&str, Vec<[u32; 3]>> = BTreeMap::new();
    let starts = [(0, "")].into_iter().chain(uses.iter().map(|(at, name)| (*at, name.as_str())));
    let ends = uses.iter().map(|(at, _)| *at).chain([mesh.triangles.len()]);
    for ((start, name), end) in starts.zip(ends) {
        let triangles = mesh.triangles.get(start..end).unwrap_or_default();
        if !triangles.is_empty() {
            parts.entry(name).or_default().extend_from_slice(triangles);
        }
    }
    parts
}

/// Writes part `i` of a model, with its colours where they are used, as a shape with the material `id`.
pub(super) fn write_part(
    text: &mut SceneText<'_>,
    i: usize,
    mesh: &Mesh,
    triangles: &[[u32; 3]],
    colored: bool,
    id: &str,
    more: impl FnOnce(&mut SceneText<'_>),
) {
    let mut place: HashMap<u32, u32> = HashMap::new();
    let mut order = Vec::new();
    let mut moved = |v: u32| {
        *place.entry(v).or_insert_with(|| {
            order.push(v as usize);
            order.len() as u32 - 1
        })
    };
    let triangles: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(&mut moved)).collect();
    let positions: Vec<_> = order.iter().map(|v| mesh.positions[*v].to_array()).collect();
    let normals: Vec<_> = order.iter().filter_map(|v| Some(mesh.normals.get(*v)?.to_array())).collect();
    let of_uvs = || order.iter().filter_map(|v| mesh.uvs.get(*v));
    // A part may have none of those of the file.
    let has_uvs = of_uvs().any(|uv| *uv != MISSING_UV);
    let uvs: Vec<_> = of_uvs().filter(|_| has_uvs).map(|uv| uv.to_array()).collect();
    let colors =
        mesh.attributes.first().filter(|_| colored).map_or(&[][..], |colors| colors.values.as_chunks().0);
    let colors: Vec<[f32; 3]> = order.iter().filter_map(|v| colors.get(*v).copied()).collect();
    let vertices = PlyVertices { positions: &positions, normals: &normals, uvs: &uvs, colors: &colors };
    let file = text.file(&format!("part-{i}.ply"), ply(&vertices, &triangles));
    text.shape("ply", &file, id, more);
}

/// The MTL files; those that cannot be read are noted.
fn libraries(text: &mut SceneText<'_>, files: &SceneFiles, names: &[String]) -> Vec<MtlFile> {
    let mut known = Vec::new();
    // A line names one file, whose name may have blanks, or several.
    let several = |name: &String| match text.is_there(name) {
        true => vec![name.clone()],
        false => {
            let words: Vec<String> = name.split_whitespace().map(str::to_owned).collect();
            if words.iter().any(|word| text.is_there(word)) { words } else { vec![name.clone()] }
        }
    };
    let mut names: Vec<String> = names.iter().flat_map(several).collect();
    let mut seen = BTreeSet::new();
    names.retain(|name| seen.insert(name.clone()));
    for name in names {
        let path = text.path.parent().unwrap_or(Path::new("")).join(name.replace('\\', "/"));
        match files.read(&path, limits::XML_BYTES) {
            Ok(bytes) => known.push(MtlFile::new(&path, bytes.into_owned())),
            Err(error) => text.note(error.to_string()),
        }
    }
    known
}

/// Writes the material of what has none, in the colours of a mesh attribute if it is given.
pub(super) fn clay(text: &mut SceneText<'_>, attribute: Option<&str>) {
    clay_as(text, NO_MATERIAL, attribute);
}

fn clay_as(text: &mut SceneText<'_>, id: &str, attribute: Option<&str>) {
    text.object("bsdf", "twosided", &[("id", id)], |text| {
        text.object("bsdf", "diffuse", &[], |text| match attribute {
            Some(name) => text.attribute("reflectance", name),
            None => text.rgb("reflectance", CLAY),
        });
    });
}
