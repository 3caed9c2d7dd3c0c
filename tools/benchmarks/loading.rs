//! Time and memory of a large mesh from the file to a scene that can be traced, by format.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use glam::Vec3;
use pointillist::tracer::Scene;

use super::common::{Outcome, timed};
use super::meshes::bigmesh;

/// What to measure.
#[derive(clap::Args)]
pub struct Arguments {
    /// Times each file is loaded
    #[arg(default_value_t = 5)]
    times: usize,
    /// Folder for the files
    #[arg(long, default_value = "target/loading")]
    folder: PathBuf,
}

/// Writes the landscape of `tools/bench rays` as files, loads each, and prints the best times and the memory per triangle: what the
/// scene holds with its description, and the most that was held on the way.
pub fn run(Arguments { times, folder }: &Arguments) -> Outcome {
    fs::create_dir_all(folder)?;
    let (vertices, faces) = bigmesh().merged();
    let count = faces.len() as f64;
    println!("{} triangles, {} vertices; seconds, then bytes per triangle", faces.len(), vertices.len());
    println!("{:12} {:>6} {:>8} {:>6} {:>6} {:>6}", "file", "read", "prepare", "sum", "held", "peak");
    for (name, plugin, bytes) in [
        ("plain.obj", "obj", obj(&vertices, &faces, false)),
        ("normals.obj", "obj", obj(&vertices, &faces, true)),
        ("binary.ply", "ply", ply(&vertices, &faces)),
    ] {
        fs::write(folder.join(name), bytes)?;
        let scene = folder.join("scene.xml");
        let text = format!(
            "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/>\
             <shape type=\"{plugin}\"><string name=\"filename\" value=\"{name}\"/></shape></scene>"
        );
        fs::write(&scene, text)?;
        let mut best = [f64::INFINITY; 2];
        let (mut held, mut peak) = (f64::NAN, f64::NAN);
        for i in 0..*times {
            let before = memory("VmRSS")?;
            fs::write("/proc/self/clear_refs", "5")?;
            let (loaded, read) = timed(|| pointillist::scene::load(&scene, &[]));
            let loaded = loaded?;
            let (prepared, prepare) = timed(|| Scene::prepare(&loaded.desc));
            let prepared = prepared?;
            if read + prepare < best[0] + best[1] {
                best = [read, prepare];
            }
            // Later runs find memory of the first one at hand.
            if i == 0 {
                (held, peak) = (memory("VmRSS")? - before, memory("VmHWM")? - before);
            }
            drop((loaded, prepared));
        }
        let [read, prepare] = best;
        let sum = read + prepare;
        println!("{name:12} {read:6.2} {prepare:8.2} {sum:6.2} {:6.0} {:6.0}", held / count, peak / count);
    }
    Ok(())
}

/// A line of `/proc/self/status`, in bytes.
fn memory(key: &str) -> Outcome<f64> {
    let status = fs::read_to_string("/proc/self/status")?;
    let line =
        status.lines().find(|line| line.starts_with(key)).ok_or("Linux tells how much memory is used")?;
    let kilobytes: f64 = line.split_whitespace().nth(1).ok_or("a number")?.parse()?;
    Ok(1024.0 * kilobytes)
}

fn obj(vertices: &[Vec3], faces: &[[u32; 3]], normals: bool) -> Vec<u8> {
    let mut text = String::new();
    for p in vertices {
        // A String takes every write.
        let _ = writeln!(text, "v {:.6} {:.6} {:.6}", p.x, p.y, p.z);
    }
    for n in vertices.iter().map(|p| p.normalize_or(Vec3::Y)).filter(|_| normals) {
        let _ = writeln!(text, "vn {:.5} {:.5} {:.5}", n.x, n.y, n.z);
    }
    for [a, b, c] in faces.iter().map(|face| face.map(|i| i + 1)) {
        let _ = match normals {
            true => writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}"),
            false => writeln!(text, "f {a} {b} {c}"),
        };
    }
    text.into_bytes()
}

fn ply(vertices: &[Vec3], faces: &[[u32; 3]]) -> Vec<u8> {
    let mut file = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        faces.len()
    )
    .into_bytes();
    vertices.iter().flat_map(|p| p.to_array()).for_each(|n| file.extend(n.to_le_bytes()));
    for face in faces {
        file.push(3);
        face.iter().for_each(|i| file.extend(i.to_le_bytes()));
    }
    file
}
