//! What is fuzzed: every reader of the program, as a function of the bytes of a file. `tools/fuzz` runs them under libFuzzer,
//! `tests/broken_files/corpus.rs` runs the corpora and mutations of them as an ordinary test.
//!
//! A new target is a function, a line in [`ALL`], and a folder of small files in `corpus/`.

use std::path::Path;
use std::sync::Arc;

use pointillist::color::{Xyz, icc};
use pointillist::image::bitmap::Bitmap;
use pointillist::image::compare::{self, Picture};
use pointillist::image::{Grid, ImageError, exr};
use pointillist::remote::blocks;
use pointillist::remote::message::{FRAME_HEADER, Kind, Side, ToTracer, ToViewer};
use pointillist::scene::mesh::{self, MeshFormat, MeshOptions};
use pointillist::scene::{LoadOptions, Loaded, SceneError, load_str_with, load_with};
use pointillist::stream::{Block, Sample, SampleSink, UvWindow};
use pointillist::study::data::Study;
use pointillist::study::measurement::Measurement;
use pointillist::study::prediction::{PredictionOutcome, score};
use pointillist::study::{analysis, pages};
use pointillist::tracer::integrator::{BidirectionalTracer, ParticleTracer, PhotonTracer, RenderContext};
use pointillist::tracer::{Camera, Integrator, PathTracer, Scene};

use crate::messages::{assert_has_place, render};

/// One reader.
pub struct Target {
    /// Name, and folder of its corpus.
    pub name: &'static str,
    /// Reads the bytes of a file; true if they were not refused. The folder may be written into.
    pub read: fn(&Path, &[u8]) -> bool,
}

/// All readers.
pub const ALL: &[Target] = &[
    Target { name: "scene", read: scene },
    Target { name: "render", read: render_scene },
    Target { name: "obj", read: |_, bytes| mesh_file(MeshFormat::Obj, bytes) },
    Target { name: "ply", read: |_, bytes| mesh_file(MeshFormat::Ply, bytes) },
    Target { name: "serialized", read: |_, bytes| mesh_file(MeshFormat::Serialized, bytes) },
    Target { name: "model", read: model },
    Target { name: "gltf", read: gltf },
    Target { name: "usd", read: usd },
    Target { name: "volume", read: volume },
    Target { name: "curves", read: curves },
    Target { name: "spectrum", read: spectrum },
    Target { name: "png", read: |_, bytes| bitmap("a.png", bytes) },
    Target { name: "jpg", read: |_, bytes| bitmap("a.jpg", bytes) },
    Target { name: "exr", read: |_, bytes| bitmap("a.exr", bytes) },
    Target { name: "hdr", read: |_, bytes| bitmap("a.hdr", bytes) },
    Target { name: "pfm", read: |_, bytes| bitmap("a.pfm", bytes) },
    Target { name: "tga", read: |_, bytes| bitmap("a.tga", bytes) },
    Target { name: "bmp", read: |_, bytes| bitmap("a.bmp", bytes) },
    Target { name: "ktx2", read: |_, bytes| bitmap("a.ktx2", bytes) },
    Target { name: "layers", read: layers },
    Target { name: "icc", read: |_, bytes| icc::parse(bytes).is_ok() },
    Target { name: "state", read: state },
    Target { name: "message", read: |_, bytes| message(bytes) },
];

/// Files that the scenes of the corpora name.
const NAMED: &[(&str, &[u8])] = &[
    ("part.xml", b"<scene version=\"3.0.0\"><shape type=\"cube\" id=\"c\"/></scene>\n"),
    ("original.xml", include_bytes!("../corpus/scene/all")),
    ("mesh.obj", include_bytes!("../corpus/obj/grid")),
    ("mesh.ply", include_bytes!("../corpus/ply/little")),
    ("picture.png", include_bytes!("../corpus/png/rgb")),
    ("curve.spd", include_bytes!("../corpus/spectrum/samples")),
];

/// Names that messages may begin their place with.
const PLACES: &[&str] =
    &[".xml", ".obj", ".mtl", ".ply", ".serialized", ".gltf", ".glb", ".usd", ".usdz", ".txt", ".spd"];

/// Makes a folder with the files that inputs may name.
pub fn prepare(folder: &Path) {
    std::fs::create_dir_all(folder).expect("a writable folder");
    NAMED.iter().for_each(|(name, bytes)| write(folder, name, bytes));
}

fn write(folder: &Path, name: &str, bytes: &[u8]) {
    std::fs::write(folder.join(name), bytes).expect("a writable folder");
}

/// Renders every message, each of which has a place.
fn told(read: Result<Loaded, SceneError>) -> Option<Loaded> {
    match read {
        Ok(loaded) => {
            loaded.warnings.iter().for_each(|w| assert_has_place("a warning", &render(w), PLACES));
            Some(loaded)
        }
        Err(error) => {
            assert_has_place("an error", &render(&error), PLACES);
            None
        }
    }
}

/// A scene file, also one that the window has saved: read as it is, and leniently where that is refused.
fn scene(folder: &Path, bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let name = folder.join("scene.xml");
    let read =
        |lenient| told(load_str_with(&name.to_string_lossy(), text, &LoadOptions { defines: &[], lenient }));
    read(false).is_some() || read(true).is_some()
}

/// A frame of the live protocol, from either side.
fn message(bytes: &[u8]) -> bool {
    let Some((header, payload)) = bytes.split_first_chunk::<FRAME_HEADER>() else { return false };
    [Side::Viewer, Side::Tracer].into_iter().any(|sender| {
        let Ok((kind, length)) = Kind::of_frame(*header, sender) else { return false };
        let Some(payload) = payload.get(..length) else { return false };
        match sender {
            Side::Viewer => ToTracer::read(kind, payload).is_ok(),
            Side::Tracer => match ToViewer::read(kind, payload) {
                Ok(ToViewer::Samples(payload)) => {
                    let sound =
                        |block: &mut Box<Block>| assert!(block.samples().iter().all(Sample::is_sound));
                    blocks::read(payload, &mut Box::default(), sound).is_ok()
                }
                read => read.is_ok(),
            },
        }
    })
}

/// Discards samples: those that are not finite are rejected and counted later, by the stream.
struct Nowhere;

impl SampleSink for Nowhere {
    fn camera(&mut self, _uv: [f32; 2], _value: Xyz, _weight: f32) {}
    fn light(&mut self, _uv: [f32; 2], _value: Xyz) {}
}

/// A scene file, prepared, and some paths of every method through it.
fn render_scene(folder: &Path, bytes: &[u8]) -> bool {
    const PATHS: u64 = 4;
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let name = folder.join("scene.xml");
    let options = LoadOptions { defines: &[], lenient: true };
    let Some(Loaded { desc, .. }) = told(load_str_with(&name.to_string_lossy(), text, &options)) else {
        return false;
    };
    let (Ok(prepared), Ok(camera)) = (Scene::prepare(&desc), Camera::of(&desc)) else { return false };
    let context = RenderContext::new(Arc::new(prepared), camera, &desc.integrator, 0, UvWindow::PICTURE);
    fn trace<I: Integrator>(tracer: &I) {
        let mut scratch = I::Scratch::default();
        (0..PATHS).for_each(|index| tracer.trace(index, &mut scratch, &mut Nowhere));
    }
    trace(&PathTracer { context: context.clone() });
    trace(&ParticleTracer { context: context.clone() });
    trace(&BidirectionalTracer { context: context.clone() });
    trace(&PhotonTracer::new(context, true));
    true
}

/// A mesh in either setting of what changes its reading.
fn mesh_file(format: MeshFormat, bytes: &[u8]) -> bool {
    [false, true].into_iter().fold(false, |any, flag| {
        let attributes = ["vertex_color", "face_weight"].map(str::to_owned).to_vec();
        let (face_normals, flip_tex_coords) = (flag, !flag);
        let options =
            MeshOptions { format, face_normals, flip_tex_coords, attributes, ..MeshOptions::default() };
        let found = match mesh::parse("model.ply", bytes, &options) {
            Ok(found) => found,
            Err(error) => {
                assert_has_place("an error", &render(&error), PLACES);
                return any;
            }
        };
        let count = found.mesh.positions.len();
        let named = found.mesh.triangles.iter().flatten();
        assert!(named.into_iter().all(|i| (*i as usize) < count), "an index out of range");
        assert!(found.mesh.positions.iter().all(|p| p.is_finite()), "a vertex that is not finite");
        found.warnings.iter().for_each(|w| assert_has_place("a warning", &render(w), PLACES));
        true
    })
}

/// A file that is read as a scene of its own.
fn load_model(folder: &Path, name: &str, bytes: &[u8]) -> bool {
    write(folder, name, bytes);
    told(load_with(&folder.join(name), &LoadOptions::default())).is_some()
}

/// A PLY file, or an OBJ file, in which what follows a line `%mtl` is its materials: as a model with light and camera, whose sky takes
/// a hundred times as long as the mesh.
fn model(folder: &Path, bytes: &[u8]) -> bool {
    const CUT: &[u8] = b"\n%mtl\n";
    if bytes.starts_with(b"ply") {
        return load_model(folder, "model.ply", bytes);
    }
    let cut = bytes.windows(CUT.len()).position(|w| w == CUT);
    let (mesh, materials) = cut.map_or((bytes, &[][..]), |at| (&bytes[..at], &bytes[at + CUT.len()..]));
    write(folder, "model.mtl", materials);
    load_model(folder, "model.obj", mesh)
}

fn gltf(folder: &Path, bytes: &[u8]) -> bool {
    let name = if bytes.starts_with(b"glTF") { "model.glb" } else { "model.gltf" };
    load_model(folder, name, bytes)
}

/// A stage: text, a crate or a package.
fn usd(folder: &Path, bytes: &[u8]) -> bool {
    load_model(folder, if bytes.starts_with(b"PK") { "model.usdz" } else { "model.usd" }, bytes)
}

/// A file that a shape, or the light around it, names.
fn named(folder: &Path, name: &str, bytes: &[u8], body: &str) -> bool {
    write(folder, name, bytes);
    let text = format!("<scene version=\"3.0.0\"><sensor type=\"perspective\"/>{body}</scene>");
    let scene = folder.join("scene.xml");
    told(load_str_with(&scene.to_string_lossy(), &text, &LoadOptions::default())).is_some()
}

fn curves(folder: &Path, bytes: &[u8]) -> bool {
    ["linearcurve", "bsplinecurve"].into_iter().fold(false, |any, kind| {
        let body = format!("<shape type=\"{kind}\"><string name=\"filename\" value=\"hair.txt\"/></shape>");
        named(folder, "hair.txt", bytes, &body) || any
    })
}

fn spectrum(folder: &Path, bytes: &[u8]) -> bool {
    let body = "<emitter type=\"constant\"><spectrum name=\"radiance\" filename=\"light.spd\"/></emitter>";
    named(folder, "light.spd", bytes, body)
}

fn volume(folder: &Path, bytes: &[u8]) -> bool {
    let body = "<shape type=\"cube\"><bsdf type=\"diffuse\"><texture type=\"volume\" name=\"reflectance\">\
                <volume type=\"gridvolume\"><string name=\"filename\" value=\"smoke.vol\"/></volume>\
                </texture></bsdf></shape><emitter type=\"constant\"/>";
    named(folder, "smoke.vol", bytes, body)
}

/// Most pixels of a picture here: larger ones take the same way, and longer.
const PIXELS: usize = 1 << 18;

/// A picture of a texture or an environment.
fn bitmap(name: &str, bytes: &[u8]) -> bool {
    match Bitmap::decode(Path::new(name), bytes, bytes.len().is_multiple_of(2), PIXELS) {
        Ok(picture) => {
            let corner = [picture.width() - 1, picture.height() - 1];
            assert!(picture.width() * picture.height() <= PIXELS, "more pixels than allowed");
            let _ = (picture.texel(0, 0), picture.texel(corner[0], corner[1])); // that they are there is what counts
            true
        }
        Err(error) => {
            assert_short(&error);
            false
        }
    }
}

/// The message of a picture names its file and is of a readable size.
fn assert_short(error: &ImageError) {
    let message = error.to_string();
    assert!(message.len() < 20_000, "{} bytes of message", message.len());
}

/// An EXR file as `compare` takes it: its layers, and all metrics against itself turned around.
fn layers(folder: &Path, bytes: &[u8]) -> bool {
    write(folder, "layers.exr", bytes);
    let path = folder.join("layers.exr");
    let all = exr::read(&path).map_err(|error| assert_short(&error));
    let picture = Picture::read(&path, None).map_err(|error| assert_short(&error));
    let (Ok(all), Ok(picture)) = (all, picture) else { return false };
    assert_eq!(picture.rgb.pixels().len(), all.width * all.height);
    assert!(picture.not_finite() <= picture.rgb.pixels().len());
    if picture.rgb.pixels().len() <= 4096 {
        let (width, height) = (picture.rgb.width(), picture.rgb.height());
        let turned = picture.rgb.pixels().iter().rev().copied().collect();
        let turned = Grid::from_rows(width, height, turned).expect("the same size");
        let shown = |grid: &Grid<[f32; 3]>| {
            let pixels = grid
                .pixels()
                .iter()
                .map(|rgb| rgb.map(|v| if v.is_finite() { v.clamp(0.0, 1.0) } else { v }));
            Grid::from_rows(width, height, pixels.collect()).expect("the same size")
        };
        let (a, b) = (shown(&picture.rgb), shown(&turned));
        compare::rel_mse(&picture.rgb, &turned).expect("the same size");
        compare::smape(&picture.rgb, &turned).expect("the same size");
        compare::delta_e(&a, &b).expect("the same size");
        compare::flip(&a, &b, compare::PIXELS_PER_DEGREE).expect("the same size");
        if let Ok(measured) = picture.measured() {
            // Variances that are none are refused.
            let _ = compare::relative_standard_error(measured);
            let _ = compare::z_test(measured, measured, 0.01);
        }
    }
    true
}

/// What the program keeps of earlier runs: a study or its measurements, and predictions with their outcomes, a line each.
fn state(_: &Path, bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let publish = |study: &Study| {
        let _ = (pages::csv(study), pages::terminal(study), pages::html(study)); // that they return is what counts
        pages::svg_files(study);
    };
    let kept: Vec<PredictionOutcome> =
        text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    score(&kept);
    let measured: Vec<Measurement> =
        text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    if !measured.is_empty() {
        publish(&analysis::study(Study::default(), &measured));
    }
    let study = serde_json::from_str::<Study>(text);
    study.iter().for_each(publish);
    study.is_ok() || !measured.is_empty() || !kept.is_empty()
}
