//! OBJ with its materials (MTL): a mesh and a bsdf for each.
//!
//! MTL says how a picture was drawn in 1990 and not what a surface is, so this is a convention, near that of other importers:
//!
//! | MTL | bsdf |
//! |---|---|
//! | `illum` 4, 6, 7 or 9 | `dielectric` with `Ni` |
//! | `illum` 3 or 5 and `Kd` black | `conductor`, a mirror of `Ks` |
//! | `Ks` not black and `Ns` above 1 | `roughplastic`, α = √(2 / (`Ns` + 2)) (Walter et al. 2007), `Ni` where above 1 |
//! | anything else | `diffuse` |
//! | `Ke` | an `area` emitter of the shape |
//! | `d` < 1, `map_d` | `mask` with this opacity |
//! | `map_Kd` | in the place of `Kd` |
//!
//! All but glass are two-sided, since no face of an OBJ file is meant to be black. Colours are linear.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use tobj::Material;

use super::text::{PlyVertices, SceneText, ply};
use super::{CLAY, finding, unreadable};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::files::SceneFiles;
use crate::scene::{limits, mesh};

/// Name of the material of what names none.
const NO_MATERIAL: &str = "clay";

/// Reads an OBJ file and its MTL files.
pub(super) fn read(text: &mut SceneText<'_>, files: &SceneFiles) -> Result<(), SceneError> {
    let path = text.path;
    let bytes = files.read(path, limits::MESH_BYTES).map_err(|e| unreadable(path, &e))?;
    // Without materials it is a mesh like any other.
    if !bytes.windows(6).any(|word| word == b"mtllib") {
        clay(text);
        text.shape("obj", &text.own_name(), NO_MATERIAL, |_| ());
        return Ok(());
    }
    let mesh::NamedParts { mesh, materials, warnings } = mesh::obj_parts(&path.to_string_lossy(), &bytes)?;
    warnings.into_iter().for_each(|warning| text.warn(warning));
    let known = libraries(text, files, &materials.libraries);
    // The triangles of each material, however often the file goes back to it.
    let mut parts: BTreeMap<&str, Vec<[u32; 3]>> = BTreeMap::new();
    let starts = [(0, "")].into_iter().chain(materials.uses.iter().map(|(at, name)| (*at, name.as_str())));
    let ends = materials.uses.iter().map(|(at, _)| *at).chain([mesh.triangles.len()]);
    for ((start, name), end) in starts.zip(ends) {
        let triangles = mesh.triangles.get(start..end).unwrap_or_default();
        if !triangles.is_empty() {
            parts.entry(name).or_default().extend_from_slice(triangles);
        }
    }
    if parts.is_empty() {
        let found =
            finding(path, FindingKind::Mesh, [1, 1], "this mesh has no triangle that can be traced".into());
        return Err(found.help("is it an OBJ file? faces are lines like `f 1 2 3`").error());
    }
    let mut clay_is_there = false;
    for (i, (name, triangles)) in parts.iter().enumerate() {
        let material = known.get(*name);
        let id = match material {
            Some(material) => bsdf(text, material),
            None => {
                if !name.is_empty() {
                    text.note(format!("no MTL file of this model has the material `{name}`: it is clay"));
                }
                if !std::mem::replace(&mut clay_is_there, true) {
                    clay(text);
                }
                NO_MATERIAL.to_owned()
            }
        };
        let file = text.file(&format!("part-{i}.ply"), part(&mesh, triangles));
        let emission = material.map_or([0.0; 3], emission);
        text.shape("ply", &file, &id, |text| {
            if emission != [0.0; 3] {
                text.object("emitter", "area", &[], |text| text.rgb("radiance", emission));
            }
        });
    }
    Ok(())
}

/// These triangles and the vertices that they use.
fn part(mesh: &crate::scene::desc::Mesh, triangles: &[[u32; 3]]) -> Vec<u8> {
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
    let uvs: Vec<_> = order.iter().filter_map(|v| Some(mesh.uvs.get(*v)?.to_array())).collect();
    ply(&PlyVertices { positions: &positions, normals: &normals, uvs: &uvs, colors: &[] }, &triangles)
}

/// The materials of the MTL files, by name; those that cannot be read are noted.
fn libraries(text: &mut SceneText<'_>, files: &SceneFiles, names: &[String]) -> BTreeMap<String, Material> {
    let mut known = BTreeMap::new();
    for name in names {
        let path = text.path.parent().unwrap_or(Path::new("")).join(name.replace('\\', "/"));
        let read = files.read(&path, limits::XML_BYTES).map_err(|e| e.to_string());
        let read = read.and_then(|bytes| {
            let cannot = |why: String| format!("cannot read {}: {why}", path.display());
            let whole = with_whole_colors(&bytes).map_err(cannot)?;
            tobj::load_mtl_buf(&mut &*whole).map_err(|e| cannot(e.to_string()))
        });
        match read {
            Ok((materials, _)) => known.extend(materials.into_iter().map(|m| (m.name.clone(), m))),
            Err(message) => text.note(message),
        }
    }
    known
}

/// The lines of an MTL file in which every colour has three numbers, which `tobj` takes for granted: one alone is a grey.
fn with_whole_colors(bytes: &[u8]) -> Result<Vec<u8>, String> {
    let mut whole = Vec::with_capacity(bytes.len());
    for (number, line) in bytes.split(|b| *b == b'\n').enumerate() {
        let words: Vec<&[u8]> = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).collect();
        match words[..] {
            [name @ (b"Ka" | b"Kd" | b"Ks" | b"Ke"), grey] => {
                whole.extend_from_slice(&[name, grey, grey, grey].join(&b' '));
            }
            [b"Ka" | b"Kd" | b"Ks" | b"Ke"] | [b"Ka" | b"Kd" | b"Ks" | b"Ke", _, _] => {
                return Err(format!("line {}: a colour has one number or three", number + 1));
            }
            _ => whole.extend_from_slice(line),
        }
        whole.push(b'\n');
    }
    Ok(whole)
}

/// Writes the material of what has none.
fn clay(text: &mut SceneText<'_>) {
    text.object("bsdf", "twosided", &[("id", NO_MATERIAL)], |text| {
        text.object("bsdf", "diffuse", &[], |text| text.rgb("reflectance", CLAY));
    });
}

/// A colour of the file with numbers from 0 to `most`.
fn color(given: Option<[f32; 3]>, default: f32, most: f32) -> [f32; 3] {
    given.unwrap_or([default; 3]).map(|v| if v.is_finite() { v.clamp(0.0, most) } else { default })
}

fn emission(material: &Material) -> [f32; 3] {
    color(material.emissive, 0.0, 1e6)
}

/// The name of a picture without the options in front of it.
fn picture(name: &str) -> String {
    let name =
        if name.trim_start().starts_with('-') { name.rsplit(' ').next().unwrap_or(name) } else { name };
    name.trim().to_owned()
}

/// Writes a material; returns its id.
fn bsdf(text: &mut SceneText<'_>, material: &Material) -> String {
    let id = text.id(&material.name);
    let (diffuse, specular) = (color(material.diffuse, 0.6, 1.0), color(material.specular, 0.0, 1.0));
    let (illum, ior) = (material.illumination_model.unwrap_or(2), material.optical_density.unwrap_or(1.5));
    let ior = if ior > 1.0 && ior < 10.0 { ior } else { 1.5 };
    let opacity = material.dissolve.filter(|d| d.is_finite()).unwrap_or(1.0).clamp(0.0, 1.0);
    if matches!(illum, 4 | 6 | 7 | 9) {
        text.object("bsdf", "dielectric", &[("id", &id)], |text| text.value("float", "int_ior", ior));
        return id;
    }
    if material.normal_texture.is_some()
        || material.unknown_param.keys().any(|k| k.to_lowercase().contains("bump"))
    {
        text.note(format!("the bump map of `{}` is left out", material.name));
    }
    let reflectance = |text: &mut SceneText<'_>, name: &str| match &material.diffuse_texture {
        Some(file) => bitmap(text, name, &picture(file), false),
        None => text.rgb(name, diffuse),
    };
    let exponent = material.shininess.filter(|n| n.is_finite()).unwrap_or(0.0);
    let mirror = matches!(illum, 3 | 5) && diffuse == [0.0; 3] && material.diffuse_texture.is_none();
    let surface = |text: &mut SceneText<'_>, attributes: &[(&str, &str)]| {
        text.object("bsdf", "twosided", attributes, |text| {
            if mirror {
                text.object("bsdf", "conductor", &[], |text| {
                    text.value("string", "material", "none");
                    text.rgb("specular_reflectance", specular);
                });
            } else if specular != [0.0; 3] && exponent > 1.0 {
                text.object("bsdf", "roughplastic", &[], |text| {
                    reflectance(text, "diffuse_reflectance");
                    text.value("float", "alpha", (2.0 / (exponent + 2.0)).sqrt().clamp(1e-3, 1.0));
                    text.value("float", "int_ior", ior);
                });
            } else {
                text.object("bsdf", "diffuse", &[], |text| reflectance(text, "reflectance"));
            }
        });
    };
    match &material.dissolve_texture {
        None if opacity == 1.0 => surface(text, &[("id", &id)]),
        map => text.object("bsdf", "mask", &[("id", &id)], |text| {
            match map {
                Some(file) => bitmap(text, "opacity", &picture(file), true),
                None => text.value("float", "opacity", opacity),
            }
            surface(text, &[]);
        }),
    }
    id
}

/// Writes a picture as the parameter `name`.
fn bitmap(text: &mut SceneText<'_>, name: &str, file: &str, raw: bool) {
    text.object("texture", "bitmap", &[("name", name)], |text| {
        text.value("string", "filename", file);
        if raw {
            text.value("boolean", "raw", true);
        }
    });
}
