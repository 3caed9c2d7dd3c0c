//! The golden pictures of `tests/golden/`. Make them anew only after a picture was checked against Mitsuba, and give the
//! reason in the commit message.

use std::path::{Path, PathBuf};

use pointillist::image::exr::{self, Layers};

use super::replicates;

/// Scenes and the side of their golden picture in pixels. Caustics that only a scattered ray can find are so rare
/// that a pixel needs thousands of samples before its mean is normally distributed, as the z-test asks: hence few
/// and large pixels for the box with spheres.
const SCENES: [(&str, u32); 3] = [("cornell", 64), ("cornell_spheres", 12), ("furnace", 64)];

/// Paths of one replicate, over the whole picture.
const SAMPLES: u32 = 1 << 20;

/// Samples per pixel of one replicate of a scene for one plugin.
const PLUGIN_SAMPLES: u64 = 64;

/// A scene, its golden picture, and how to render it.
struct Golden {
    name: String,
    scene: PathBuf,
    picture: PathBuf,
    plan: replicates::Plan,
}

/// Renders and writes all of them, or those with these names.
pub fn make(names: &[String]) -> Result<(), Box<dyn std::error::Error>> {
    let known = all();
    if let Some(unknown) = names.iter().find(|name| known.iter().all(|golden| golden.name != **name)) {
        return Err(format!("there is no scene `{unknown}` with a golden picture").into());
    }
    for Golden { scene, picture, plan, .. } in
        known.iter().filter(|golden| names.is_empty() || names.contains(&golden.name))
    {
        let [width, height] = plan.size.map(|n| n as usize);
        let mut layers = Layers { width, height, ..Layers::default() };
        for ((mean, variance), measured) in
            replicates::CHANNELS.into_iter().zip(replicates::measure(scene, plan))
        {
            layers.push(mean, measured.mean.iter().map(|&v| v as f32));
            layers.push(variance, measured.variance.iter().map(|&v| v as f32));
        }
        exr::write(picture, &layers)?;
        println!("{}", picture.display());
    }
    Ok(())
}

fn all() -> Vec<Golden> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let plan = |size, samples_per_pixel| replicates::Plan { size, samples_per_pixel, seeds: 0..32 };
    let own = SCENES.into_iter().map(|(name, side)| Golden {
        name: name.to_owned(),
        scene: root.join(format!("scenes/{name}.xml")),
        picture: root.join(format!("tests/golden/{name}.exr")),
        plan: plan([side; 2], u64::from(SAMPLES / (side * side))),
    });
    let plugins = replicates::plugin_scenes(root).into_iter().map(|scene| {
        let name = scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let picture = root.join(format!("tests/golden/plugins/{name}.exr"));
        Golden { plan: plan(replicates::plugin_size(&scene), PLUGIN_SAMPLES), name, scene, picture }
    });
    own.chain(plugins).collect()
}
