//! Render orders from a viewer to remote tracers: the `order` of a [`crate::remote::Request`].

use std::path::{Path, PathBuf};

use miette::{Context, IntoDiagnostic, Result};
use serde::{Deserialize, Serialize};

use crate::remote::Token;
use crate::render::forced::Forced;
use crate::render::run_spec::RunSpec;
use crate::render::state::hash_of_files;
use crate::scene::desc::IntegratorKind;
use crate::scene::edit::Edits;
use crate::stream::UvWindow;

/// Largest picture side, pixels.
const MOST_PIXELS: u32 = 1 << 16;

/// Farthest that a sample window may extend beyond the picture, relative to its size.
const FARTHEST: f32 = 0.5;

/// A render order, apart from epoch, seed and number of paths.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RemoteOrder {
    /// Digest of the scene, see [`scene_digest`].
    pub scene: String,
    pub integrator: IntegratorKind,
    pub max_depth: Option<u32>,
    pub rr_depth: u32,
    pub hide_emitters: bool,
    pub replicated: bool,
    /// Film size from the viewer's command line; `None` for the scene's.
    pub film: Option<(u32, u32)>,
    /// Picture size, pixels.
    pub size: [u32; 2],
    /// Screen window of the samples.
    pub window: UvWindow,
    /// Edited camera and parameters.
    pub edits: Edits,
    /// Effects that are forced on or off.
    pub forced: Vec<Forced>,
}

impl RemoteOrder {
    /// An order for the scene with this digest.
    pub fn new(scene: String, run: &RunSpec, size: [u32; 2], window: UvWindow, edits: Edits) -> Self {
        Self {
            scene,
            integrator: run.integrator,
            max_depth: run.max_depth,
            rr_depth: run.rr_depth,
            hide_emitters: run.hide_emitters,
            replicated: run.replicated,
            film: run.size,
            size,
            window,
            edits,
            forced: run.effects.clone(),
        }
    }

    /// Parses and validates an order received over the network.
    ///
    /// # Errors
    ///
    /// A message, if it cannot be parsed or has values out of range.
    pub fn read(text: &str) -> Result<Self, String> {
        let order: Self =
            serde_json::from_str(text).map_err(|error| format!("an order that makes no sense: {error}"))?;
        let sides = order.size.into_iter().chain(order.film.into_iter().flat_map(|(w, h)| [w, h]));
        if !sides.into_iter().all(|side| (1..=MOST_PIXELS).contains(&side)) {
            return Err(format!("pictures have 1 to {MOST_PIXELS} pixels along each side"));
        }
        let UvWindow { min, max } = order.window;
        let inside = |c: f32| (-FARTHEST..=1.0 + FARTHEST).contains(&c);
        let fine = (0..2).all(|i| inside(min[i]) && inside(max[i]) && min[i] < max[i]);
        fine.then_some(order).ok_or_else(|| "the window of the samples is none".to_owned())
    }
}

/// Digest by which viewer and tracer check that they have the same scene: contents of its files, in any order, and the command-line options
/// that affect loading.
///
/// # Errors
///
/// When a file cannot be read.
pub fn scene_digest(files: &[PathBuf], defines: &[(String, String)], lenient: bool) -> Result<String> {
    let mut hashes: Vec<String> =
        files.iter().map(|file| hash_of_files(std::slice::from_ref(file))).collect::<Result<_>>()?;
    hashes.sort_unstable();
    hashes.dedup();
    let words = format!("{hashes:?} {lenient} {defines:?}");
    Ok(blake3::hash(words.as_bytes()).to_hex()[..32].to_string())
}

/// Reads the secret from a file.
///
/// # Errors
///
/// When it cannot be read, or is too short.
pub fn read_token(path: &Path) -> Result<Token> {
    let text = std::fs::read_to_string(path);
    let text = text.into_diagnostic().wrap_err_with(|| format!("cannot read {}", path.display()))?;
    Token::new(&text).ok_or_else(|| {
        miette::miette!(
            help = "make one with `openssl rand -hex 32`",
            "{}: a token has {} characters or more, so that nobody can guess it",
            path.display(),
            Token::SHORTEST
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_checked() {
        let window = UvWindow { min: [-0.1; 2], max: [1.1; 2] };
        let order = RemoteOrder {
            scene: "abc".into(),
            integrator: IntegratorKind::Path,
            max_depth: None,
            rr_depth: 5,
            hide_emitters: false,
            replicated: true,
            film: None,
            size: [640, 480],
            window,
            edits: Edits::default(),
            forced: Vec::new(),
        };
        let read = |order: &RemoteOrder| RemoteOrder::read(&serde_json::to_string(order).expect("JSON"));
        assert_eq!(read(&order), Ok(order.clone()));
        let refused = |change: &dyn Fn(&mut RemoteOrder)| {
            let mut order = order.clone();
            change(&mut order);
            read(&order).is_err()
        };
        assert!(refused(&|order| order.size = [0, 480]));
        assert!(refused(&|order| order.film = Some((1, 1 << 20))));
        assert!(refused(&|order| order.window.max[1] = 1e9));
        assert!(refused(&|order| order.window.max[0] = -0.2));
        assert!(refused(&|order| order.window.min[0] = f32::NAN));
        assert!(RemoteOrder::read("{").is_err() && RemoteOrder::read("[[[[").is_err());
    }
}
