//! Makes the golden pictures of `tests/golden/` anew: `tools/golden`. Only after a picture was checked against
//! Mitsuba; the reason belongs into the commit message.

use std::path::Path;

use pointillist::image::compare::Measured;
use pointillist::image::exr::{self, Layers};

#[path = "../tests/support/replicates.rs"]
mod replicates;

const PLAN: replicates::Plan = replicates::Plan { side: 64, samples_per_pixel: 256, seeds: 0..32 };

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for name in ["cornell", "cornell_spheres", "furnace"] {
        let picture = replicates::measure(&root.join(format!("scenes/{name}.xml")), &PLAN);
        let mut layers = Layers { width: picture.width, height: picture.height, ..Layers::default() };
        for channel in ["R", "G", "B"] {
            layers.push(channel, picture.mean.iter().map(|&y| y as f32));
        }
        layers.push(Measured::VARIANCE_CHANNEL, picture.variance.iter().map(|&v| v as f32));
        let path = root.join(format!("tests/golden/{name}.exr"));
        match exr::write(&path, &layers) {
            Ok(()) => println!("{}", path.display()),
            Err(error) => eprintln!("{error}"),
        }
    }
}
