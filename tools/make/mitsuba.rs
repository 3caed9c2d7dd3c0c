//! The meshes of `tools/bench rays` as Mitsuba 3 scenes, to look at them or to render them.

use std::fs::File;
use std::io::{BufWriter, Error, Write};
use std::path::Path;

use glam::Vec3;

use super::MeshFormat;
use super::meshes::{self, Light, Model, Part};

/// Writes `spheres.xml` and `bigmesh.xml` (512 × 512) with one file per material beside them.
pub fn write(folder: &Path, format: MeshFormat) -> Result<(), Box<dyn std::error::Error>> {
    for make in [meshes::spheres, meshes::bigmesh] {
        let model = make();
        write_model(&model, folder, format)
            .map_err(|e| format!("cannot write {} to {}: {e}", model.name, folder.display()))?;
        let triangles: usize = model.parts.iter().map(|p| p.faces.len()).sum();
        println!("{}/{}.xml: {} triangles", folder.display(), model.name, triangles + 2);
    }
    Ok(())
}

/// Writes one model: a mesh per part, and the scene that names them.
fn write_model(model: &Model, folder: &Path, format: MeshFormat) -> Result<(), Error> {
    let kind = if format == MeshFormat::Obj { "obj" } else { "ply" };
    std::fs::create_dir_all(folder)?;
    let numbers = |v: &[f32]| v.iter().map(f32::to_string).collect::<Vec<_>>().join(", ");
    let point = |v: Vec3| numbers(&v.to_array());
    let Model { camera, light: Light { centre, half: [u, v], radiance }, .. } = model;
    let mut xml = format!(
        r#"<?xml version="1.0" encoding="utf-8"?>
<!-- Written by tools/make/mitsuba.rs. Names to set with -D: spp, res. -->
<scene version="3.0.0">
  <default name="spp" value="64"/>
  <default name="res" value="512"/>

  <integrator type="path"/>

  <sensor type="perspective">
    <float name="fov" value="{}"/>
    <transform name="to_world">
      <lookat origin="{}" target="{}" up="0, 1, 0"/>
    </transform>
    <sampler type="independent">
      <integer name="sample_count" value="$spp"/>
    </sampler>
    <film type="hdrfilm">
      <integer name="width" value="$res"/>
      <integer name="height" value="$res"/>
    </film>
  </sensor>

  <emitter type="constant">
    <rgb name="radiance" value="{}"/>
  </emitter>
"#,
        camera.fov,
        point(camera.origin),
        point(camera.target),
        numbers(&model.sky)
    );
    let n = u.cross(*v).normalize();
    let rows: Vec<String> = (0..3)
        .map(|i| format!("{} {} {} {}", u[i], v[i], n[i], centre[i]))
        .chain(["0 0 0 1".into()])
        .collect();
    xml += &format!(
        r#"
  <shape type="rectangle">
    <transform name="to_world">
      <matrix value="{}"/>
    </transform>
    <emitter type="area">
      <rgb name="radiance" value="{}"/>
    </emitter>
  </shape>
"#,
        rows.join("  "),
        numbers(radiance)
    );
    for part in &model.parts {
        let name = format!("{}_{}.{kind}", model.name, part.name);
        let mut out = BufWriter::new(File::create(folder.join(&name))?);
        match format {
            MeshFormat::Obj => obj(part, &mut out)?,
            MeshFormat::Ply => ply(part, &mut out)?,
        }
        out.flush()?;
        xml += &format!(
            r#"
  <shape type="{kind}">
    <string name="filename" value="{name}"/>
    <boolean name="face_normals" value="{}"/>
    <bsdf type="twosided">
      <bsdf type="diffuse">
        <rgb name="reflectance" value="{}"/>
      </bsdf>
    </bsdf>
  </shape>
"#,
            !part.smooth,
            numbers(&part.colour)
        );
    }
    std::fs::write(folder.join(format!("{}.xml", model.name)), xml + "</scene>\n")
}

fn ply(part: &Part, out: &mut impl Write) -> Result<(), Error> {
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        part.vertices.len(),
        part.faces.len()
    )?;
    for c in part.vertices.iter().flat_map(Vec3::to_array) {
        out.write_all(&c.to_le_bytes())?;
    }
    for face in &part.faces {
        out.write_all(&[3])?;
        face.iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))?;
    }
    Ok(())
}

fn obj(part: &Part, out: &mut impl Write) -> Result<(), Error> {
    part.vertices.iter().try_for_each(|v| writeln!(out, "v {} {} {}", v.x, v.y, v.z))?;
    part.faces.iter().try_for_each(|[a, b, c]| writeln!(out, "f {} {} {}", a + 1, b + 1, c + 1))
}
