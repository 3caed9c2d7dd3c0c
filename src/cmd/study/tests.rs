//! The audit of brightness, from real renders to the sentence shown to the user.

use std::path::Path;
use std::sync::Arc;

use clap::Parser;

use crate::cmd::args::StudyArgs;
use crate::cmd::study::about;
use crate::cmd::study::judge::Judge;
use crate::cmd::study::renderer::{RenderLimit, StudyRenderer};
use crate::scene::desc::IntegratorKind;
use crate::study::analysis;
use crate::study::data::Study;
use crate::study::measurement::Measurement;
use crate::study::pages;
use crate::tracer::Scene;

#[derive(Parser)]
struct StudyWords {
    #[command(flatten)]
    args: StudyArgs,
}

fn renderer(scene: &Path) -> StudyRenderer {
    let words = ["study", &scene.display().to_string(), "--device", "cpu", "--size", "48x48"];
    let args = StudyWords::try_parse_from(words).unwrap().args;
    StudyRenderer::new(&args, &about::source(&args, scene.to_path_buf())).unwrap()
}

/// A study that has measured path tracing in this scene, and bidirectional path tracing in the other.
fn studied(renderer: &mut StudyRenderer, other: &Arc<Scene>) -> Study {
    let mut judge = Judge::without_reference(renderer);
    let mut measured = Vec::new();
    for seed in 1..=4 {
        for kind in [IntegratorKind::Path, IntegratorKind::Bidirectional] {
            let run = renderer.run(kind, seed);
            let scene = if kind == IntegratorKind::Path { renderer.scene.clone() } else { other.clone() };
            let limit = RenderLimit::Paths((1 << 16) << (seed / 2));
            let traced = renderer.trace_other(&run, scene, renderer.camera.clone(), limit).unwrap();
            let run = judge.take(renderer, &run, traced, f64::from(seed)).unwrap();
            measured.push(Measurement::Run(Box::new(run)));
        }
    }
    analysis::study(Study::default(), &measured)
}

/// A brightness factor of 1.002 planted in the renders of one method is detected if noise is low, and equal brightness raises no alarm at
/// low or high noise.
#[test]
fn a_planted_factor_is_found_and_clean_renders_are_not_accused() {
    for scene in ["scenes/cornell.xml", "scenes/furnace.xml"] {
        let mut renderer = renderer(Path::new(scene));
        let same = renderer.scene.clone();
        let clean = studied(&mut renderer, &same);
        assert!(
            clean.stability.iter().all(|s| !s.alarm && s.energy.is_some()),
            "{scene}: {:?}",
            clean.stability
        );
        assert!(!pages::terminal(&clean).contains("mean brightness is"));
    }
    let text = std::fs::read_to_string("scenes/furnace.xml").unwrap();
    let brighter =
        text.replace("<rgb name=\"radiance\" value=\"1\"/>", "<rgb name=\"radiance\" value=\"1.002\"/>");
    assert_ne!(brighter, text);
    let folder = std::env::temp_dir().join(format!("pointillist-audit-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("brighter.xml");
    std::fs::write(&file, brighter).unwrap();
    let other = renderer(&file).scene;
    std::fs::remove_dir_all(&folder).unwrap();
    let planted = studied(&mut renderer(Path::new("scenes/furnace.xml")), &other);
    let found = planted.stability.iter().find(|s| s.method == "bidirectional").unwrap();
    assert!(found.alarm && found.energy.unwrap().holds(1.002), "{found:?}");
    assert!(
        pages::terminal(&planted).contains("mean brightness is × 1.002"),
        "{}",
        pages::terminal(&planted)
    );
}
