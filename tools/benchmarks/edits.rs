//! Time from an edit to the scene that can be traced.

use std::path::PathBuf;

use glam::{DAffine3, DVec3};
use pointillist::scene::SceneDesc;
use pointillist::scene::desc::BsdfId;
use pointillist::scene::edit::{Edits, NewValue, Target};
use pointillist::tracer::Scene;

use super::common::{Outcome, timed};

/// What to measure.
#[derive(clap::Args)]
pub struct Arguments {
    /// Scenes
    #[arg(default_value = "scenes/cornell_spheres.xml")]
    scenes: Vec<PathBuf>,
    /// Edits of each kind
    #[arg(long, default_value_t = 15)]
    times: usize,
}

/// Prints the median time of preparing each scene, of changing a colour in it, and of moving its largest shape by small steps.
pub fn run(Arguments { scenes, times }: &Arguments) -> Outcome {
    println!("{:28} {:>10} {:>10} {:>10}   median milliseconds", "scene", "prepare", "colour", "move");
    for path in scenes {
        let desc = pointillist::scene::load(path, &[])?.desc;
        let (scene, prepare) = timed(|| Scene::prepare(&desc));
        let scene = scene?;
        let mut colored = (0..desc.bsdfs.len() as u32).rev().map(|i| Target::Reflectance(BsdfId(i)));
        let colored = colored.find(|target| target.get(&desc).is_ok()).ok_or("no colour to change")?;
        let largest = (0..desc.shapes.len()).max_by_key(|i| desc.faces(&desc.shapes[*i]));
        let largest = largest.ok_or("no shape to move")?;
        let color = |i: usize| NewValue::Rgb([0.2 + 0.001 * i as f64; 3]);
        let color = median(&scene, &desc, *times, |i| (colored, color(i)))?;
        let step = 0.01 * desc.object_bounds(largest as u32).map_or(1.0, |[a, b]| (b - a).max_element());
        let file = desc.shapes[largest].to_world;
        let place =
            |i: usize| NewValue::Transform(DAffine3::from_translation(DVec3::splat(i as f64 * step)) * file);
        let moved = median(&scene, &desc, *times, |i| (Target::ToWorld(largest as u32), place(i)))?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        println!("{name:28} {:10.2} {:10.2} {:10.2}", 1e3 * prepare, 1e3 * color, 1e3 * moved);
    }
    Ok(())
}

/// The median time, in seconds, from an edit to its scene, each made from the one before.
fn median(
    scene: &Scene,
    desc: &SceneDesc,
    times: usize,
    edit: impl Fn(usize) -> (Target, NewValue),
) -> Outcome<f64> {
    let (mut before, mut seconds) = (scene.edited(desc)?, Vec::new());
    for i in 1..=times {
        let (target, value) = edit(i);
        let (edited, took) = timed(|| -> Outcome<Scene> {
            let mut edits = Edits::default();
            edits.set(target, value)?;
            Ok(before.edited(&edits.apply(desc)?)?)
        });
        before = edited?;
        seconds.push(took);
    }
    seconds.sort_by(f64::total_cmp);
    Ok(seconds[seconds.len() / 2])
}
