//! The golden pictures of `tests/golden/`. Make them anew only after a picture was checked against Mitsuba, and give the
//! reason in the commit message.

use std::path::Path;

use pointillist::image::exr::{self, Layers};

use super::replicates;

/// Scenes and the side of their golden picture in pixels. Caustics that only a scattered ray can find are so rare
/// that a pixel needs thousands of samples before its mean is normally distributed, as the z-test asks: hence few
/// and large pixels for the box with spheres.
const SCENES: [(&str, u32); 3] = [("cornell", 64), ("cornell_spheres", 12), ("furnace", 64)];

/// Paths of one replicate, over the whole picture.
const SAMPLES: u32 = 1 << 20;

/// Renders and writes all of them.
pub fn make() -> Result<(), Box<dyn std::error::Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (name, side) in SCENES {
        let samples_per_pixel = u64::from(SAMPLES / (side * side));
        let plan = replicates::Plan { side, samples_per_pixel, seeds: 0..32 };
        let picture = replicates::measure(&root.join(format!("scenes/{name}.xml")), &plan);
        let mut layers = Layers { width: side as usize, height: side as usize, ..Layers::default() };
        for ((mean, variance), measured) in replicates::CHANNELS.into_iter().zip(picture) {
            layers.push(mean, measured.mean.iter().map(|&v| v as f32));
            layers.push(variance, measured.variance.iter().map(|&v| v as f32));
        }
        let path = root.join(format!("tests/golden/{name}.exr"));
        exr::write(&path, &layers)?;
        println!("{}", path.display());
    }
    Ok(())
}
