//! USD: Pixar's Universal Scene Description, as text (`usda`), as binary crates (`usdc`) and in packages (`usdz`).
//!
//! The crate `openusd` reads and composes the layers: sublayers, references, payloads, variants, inherits, instances. What it gives
//! is read here by schema.
//!
//! ```text
//! assets      files for the crate: layers, packages, pictures; text_check, crate_check: what it would choke on
//! prim        a prim whose properties are accounted for; values: numbers and words; transform; primvars
//! walk        prims with what they inherit; instances and prototypes; place: items at their places in the world
//! mesh, polygons, solids, strands   what has a surface; skel: the pose of what has a skeleton
//! bindings, materials, network, textures   UsdShade and UsdPreviewSurface
//! lights, camera                    UsdLux, and cameras
//! ```
//!
//! Up is y in the scene: a stage with z up is turned. Lengths are those of the stage, whatever `metersPerUnit`: nothing that is seen
//! depends on it, since UsdLux measures light in units of the stage. An attribute has its default, else the first of its times:
//! animations are not played.

mod assets;
mod bindings;
mod camera;
mod crate_check;
mod crate_values;
mod lights;
mod materials;
mod mesh;
mod network;
mod place;
mod polygons;
mod prim;
mod primvars;
mod skel;
mod solids;
mod strands;
mod text_check;
mod textures;
mod transform;
mod values;
mod walk;

use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;

use glam::DAffine3;
use openusd::pcp;
use openusd::usd::Stage;
use openusd::usda::parser::Parser;

use super::text::{SceneText, finding, unreadable};
use crate::scene::diagnostic::{FindingKind, LineAt, SceneError, shorten};
use crate::scene::files::SceneFiles;
use crate::scene::limits;
use assets::{StageAssets, StageResolver};
use prim::guarded;
use walk::StageWalker;

/// Stack of the reader: the crate goes down a level for each level of prims and of arcs.
const STACK: usize = 256 << 20;

/// Reads a USD file.
pub(super) fn read(text: &mut SceneText<'_>, files: &SceneFiles) -> Result<(), SceneError> {
    let path = text.path;
    // The first read tells what is wrong with the file itself.
    drop(files.read(path, limits::MESH_BYTES).map_err(|e| unreadable(path, &e))?);
    let files = files.on_disk();
    std::thread::scope(|scope| {
        let work = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, || show(text, files));
        let wrong = |what: &str| finding(path, FindingKind::Mesh, [1, 1], what.to_owned()).error();
        match work.map(std::thread::ScopedJoinHandle::join) {
            Ok(Ok(result)) => result,
            Ok(Err(_)) => Err(wrong("this USD file is broken in a way that its reader does not know")),
            Err(_) => Err(wrong("there is no memory for a thread that reads this file")),
        }
    })
}

/// Opens the stage and writes its scene.
fn show(text: &mut SceneText<'_>, files: SceneFiles) -> Result<(), SceneError> {
    let path = text.path;
    let wrong = |what: String| finding(path, FindingKind::Mesh, [1, 1], what).error();
    let assets = Rc::new(StageAssets::new(files));
    let root = assets.root_layer(path).map_err(|e| wrong(format!("this is no USD file: {e}")))?;
    let resolver = StageResolver(Rc::clone(&assets));
    let stage = guarded(|| Stage::builder().resolver(resolver).open(&root))
        .map_err(|error| unparsable(path, &root, &assets, &error))?;
    let to_world = upwards(&stage, text);
    let mut walker = StageWalker::new(&stage, Rc::clone(&assets), text);
    let shown = walker.stage(&to_world);
    tell_arcs(&stage, &assets, text);
    match shown {
        Ok(0) => Err(wrong("this stage shows nothing that has a surface".to_owned())),
        Ok(_) => Ok(()),
        Err(error) => Err(wrong(error)),
    }
}

/// The transform from the stage to a scene whose up is y. Tells what the stage says of times.
fn upwards(stage: &Stage, text: &mut SceneText<'_>) -> DAffine3 {
    let axis = guarded(|| stage.stage_metadata("upAxis")).ok().flatten();
    match axis.as_ref().and_then(values::word).as_deref() {
        Some("Z") => DAffine3::from_rotation_x(-std::f64::consts::FRAC_PI_2),
        None | Some("Y") => DAffine3::IDENTITY,
        Some(other) => {
            text.note(format!("`upAxis` is {}: y is up", shorten(other)));
            DAffine3::IDENTITY
        }
    }
}

/// The error of a file that the crate does not open, with the line where it stopped.
fn unparsable(path: &Path, root: &str, assets: &StageAssets, error: &str) -> SceneError {
    let plain = |what: String| finding(path, FindingKind::Mesh, [1, 1], what).error();
    match parse_error(root, assets) {
        Some((line, column, text, what)) => {
            let file = path.to_string_lossy();
            let end = text.len();
            let at = LineAt {
                file: &file,
                text: &text,
                line,
                column,
                range: (end.min(column.saturating_sub(1)), end),
            };
            let message = format!("this is not valid USD: {what}");
            crate::scene::diagnostic::Finding::new(FindingKind::Mesh, at, message).error()
        }
        None => plain(format!("this is not valid USD: {}", last_of(error))),
    }
}

/// Line, column, text of the line and message of what is wrong in a layer that is text.
fn parse_error(layer: &str, assets: &StageAssets) -> Option<(usize, usize, String, String)> {
    let bytes = assets.layer(layer).ok()?;
    let text = std::str::from_utf8(&bytes).ok()?;
    if bytes.starts_with(crate_check::MAGIC) {
        return None;
    }
    guarded(|| -> Result<_, String> {
        let mut parser = Parser::new(text);
        let Err(error) = parser.parse() else { return Ok(None) };
        let place = parser.last_error_highlight();
        let what = last_of(&format!("{error:#}"));
        Ok(place.map(|at| (at.line, at.column, at.line_text.chars().take(200).collect(), what)))
    })
    .ok()
    .flatten()
}

/// The cause of an error of the crate, which names the outermost first.
fn last_of(error: &str) -> String {
    shorten_more(error.rsplit(": ").next().unwrap_or(error))
}

fn shorten_more(text: &str) -> String {
    text.chars().take(160).collect()
}

/// The message about a layer that another layer names and that cannot be read, with its line if it has one.
fn unreadable_layer(assets: &StageAssets, name: &str, named_by: &str, reason: &str) -> String {
    let name_of = shorten(name);
    match parse_error(&assets.named_by(name, named_by), assets) {
        Some((line, column, _, what)) => {
            format!("the layer `{name_of}` cannot be read: line {line}, column {column}: {what}")
        }
        None => format!("the layer `{name_of}` cannot be read: {}", last_of(reason)),
    }
}

/// Tells what the composition did not find or could not read, once for each file.
fn tell_arcs(stage: &Stage, assets: &StageAssets, text: &mut SceneText<'_>) {
    let errors = guarded(|| Ok::<_, String>(stage.composition_errors())).unwrap_or_default();
    let mut told: BTreeMap<String, (String, usize)> = BTreeMap::new();
    for error in &errors {
        let (message, place) = match error {
            pcp::Error::UnresolvedLayer { asset_path, site_path, .. } => (
                format!("the layer `{}` is not found: it is left out", shorten(asset_path)),
                site_path.as_str(),
            ),
            pcp::Error::UnresolvedSublayer { asset_path, .. } => {
                (format!("the sublayer `{}` is not found: it is left out", shorten(asset_path)), "")
            }
            pcp::Error::MalformedLayer { asset_path, introduced_by, site_path, reason, .. } => {
                (unreadable_layer(assets, asset_path, introduced_by, reason), site_path.as_str())
            }
            pcp::Error::MalformedSublayer { asset_path, introduced_by, reason, .. } => {
                (unreadable_layer(assets, asset_path, introduced_by, reason), "")
            }
            pcp::Error::ArcCycle(chain) => (
                format!(
                    "an arc of layers leads back to itself: it is left out ({})",
                    shorten(&format!("{:?}", chain.composing))
                ),
                "",
            ),
            other => (format!("the composition says: {}", shorten_more(&other.to_string())), ""),
        };
        told.entry(message).or_insert((place.to_owned(), 0)).1 += 1;
    }
    for (message, (place, _)) in told {
        text.tell(message, if place.is_empty() { "its layers" } else { &place });
    }
}
