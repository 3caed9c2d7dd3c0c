//! Identification of a scene and of the arithmetic that traces it, across machines.

use std::path::PathBuf;
use std::sync::Arc;

use miette::{IntoDiagnostic, Result, WrapErr};
use serde::{Deserialize, Serialize};

use crate::client::lod::power_of_two_below;
use crate::color::Xyz;
use crate::render::method::render_context;
use crate::render::run_spec::RunSpec;
use crate::stream::{CHUNK, REPLICATES, Sample, SampleSink};
use crate::tracer::integrator::{IntegratorVisitor, RenderContext, Stereo, visit};
use crate::tracer::sampler::LightSampler;
use crate::tracer::{Camera, Integrator, Sampler, Scene};

/// Properties common to all parts of a picture, besides their settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Hash of all files of the scene.
    pub scene: String,
    /// Hash of the samples of the first chunk, and of random numbers of each randomisation. It differs if another version of the program,
    /// CPU or mathematical library computes other samples.
    pub samples: String,
    /// Unit of colours in the sums: a power of two near the mean luminance of these samples. Independent of the traced part of the
    /// sequence.
    pub luminance_scale: f32,
}

impl Identity {
    /// Identity of a run whose scene consists of these files, and whose `right_eye` has this camera, if there are two.
    ///
    /// # Errors
    ///
    /// When a file can no longer be read.
    pub fn of(
        run: &RunSpec,
        files: &[PathBuf],
        scene: &Arc<Scene>,
        camera: &Camera,
        right_eye: Option<&Camera>,
    ) -> Result<Self> {
        let mut first = FirstChunk::trace(run, scene, camera, right_eye);
        let context = render_context(run, scene.clone(), camera.clone(), run.film.window());
        for replicate in 0..if run.replicated { REPLICATES } else { 1 } {
            first.take_numbers(&context.of_replicate(replicate));
        }
        let samples = first.hash.finalize().to_hex()[..32].to_string();
        Ok(Self { scene: hash_of_files(files)?, samples, luminance_scale: first.luminance_scale() })
    }
}

/// Unit of colours in the exact sums of a run, of both eyes if there are two.
pub fn luminance_scale(
    run: &RunSpec,
    scene: &Arc<Scene>,
    camera: &Camera,
    right_eye: Option<&Camera>,
) -> f32 {
    FirstChunk::trace(run, scene, camera, right_eye).luminance_scale()
}

/// Hash of the contents of files, in order; their paths do not matter.
pub fn hash_of_files(files: &[PathBuf]) -> Result<String> {
    let mut all = blake3::Hasher::new();
    for path in files {
        let mut one = blake3::Hasher::new();
        let read = std::fs::File::open(path).and_then(|file| one.update_reader(file).map(drop));
        read.into_diagnostic().wrap_err_with(|| format!("cannot read {} of the scene", path.display()))?;
        all.update(one.finalize().as_bytes());
    }
    Ok(all.finalize().to_hex()[..32].to_string())
}

/// Traces the first chunk by a method; with two eyes, that of each.
struct FirstPaths<'a> {
    context: RenderContext,
    right_eye: Option<&'a Camera>,
}

impl IntegratorVisitor for FirstPaths<'_> {
    type Output = FirstChunk;

    fn visit<I: Integrator + From<RenderContext>>(self) -> FirstChunk {
        match self.right_eye {
            None => FirstChunk::of(&I::from(self.context), CHUNK),
            Some(right) => FirstChunk::of(&Stereo::new(&self.context, right, I::from), 2 * CHUNK),
        }
    }
}

/// Sink for the samples of the first indices.
struct FirstChunk {
    hash: blake3::Hasher,
    /// Sum and number of positive luminances.
    luminance: (f64, u64),
}

impl FirstChunk {
    fn trace(run: &RunSpec, scene: &Arc<Scene>, camera: &Camera, right_eye: Option<&Camera>) -> Self {
        let context = render_context(run, scene.clone(), camera.clone(), run.film.window());
        visit(run.integrator, FirstPaths { context, right_eye })
    }

    fn of<I: Integrator>(tracer: &I, indices: u64) -> Self {
        let (mut first, mut scratch) =
            (Self { hash: blake3::Hasher::new(), luminance: (0.0, 0) }, I::Scratch::default());
        (0..indices).for_each(|index| tracer.trace(index, &mut scratch, &mut first));
        first
    }

    /// Hashes random numbers of a randomisation at the start and far out in the sequence: the samples of the first chunk belong to the
    /// first randomisation and depend only on the beginning of the sequence, not on the division of the screen into cells.
    fn take_numbers(&mut self, context: &RenderContext) {
        for index in [0, 1 << 40] {
            let path = Sampler::in_cells(index, context.seed, &context.cells);
            let (start, vertices) = (path.camera(), [path.vertex(0), path.vertex(1)]);
            // In a group of 2^5 paths that share 2^4 light subpaths.
            let group = context.cells.visit_of_group(index, 5, context.seed);
            let light = LightSampler::of_group(group, 4, 1).vertex(1);
            for x in start.screen {
                self.hash.update(&x.to_bits().to_le_bytes());
            }
            let directions = vertices.iter().chain([&light]).flat_map(|v| [v.light, v.bsdf]);
            for f in directions.flatten().chain([start.wavelength, start.time]) {
                self.hash.update(&f.to_bits().to_le_bytes());
            }
        }
    }

    fn luminance_scale(&self) -> f32 {
        let (sum, lit) = self.luminance;
        if lit > 0 { power_of_two_below(sum / lit as f64) } else { 1.0 }
    }

    fn take(&mut self, sample: Sample) {
        self.hash.update(bytemuck::bytes_of(&sample));
        if sample.is_sound() && sample.xyz.y > 0.0 {
            self.luminance.0 += f64::from(sample.xyz.y);
            self.luminance.1 += 1;
        }
    }
}

impl SampleSink for FirstChunk {
    fn camera(&mut self, uv: [f32; 2], xyz: Xyz, w: f32) {
        self.take(Sample { uv, xyz: xyz * w, w });
    }

    fn light(&mut self, uv: [f32; 2], xyz: Xyz) {
        self.take(Sample { uv, xyz, w: -1.0 });
    }

    fn camera_of_other_eye(&mut self, uv: [f32; 2], xyz: Xyz, w: f32) {
        self.camera(uv, xyz, w);
    }

    fn light_of_other_eye(&mut self, uv: [f32; 2], xyz: Xyz) {
        self.light(uv, xyz);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::SplatFilter;
    use crate::render::load;
    use crate::render::options::SceneOptions;

    /// If two divisions of the screen yield the same first samples for part of the sequence, their identities still differ. Sizes with
    /// equal divisions have equal identities.
    #[test]
    fn the_division_of_the_screen_is_part_of_the_identity() {
        let mut source = SceneOptions::of("scenes/cornell.xml".into());
        (source.size, source.filter) = (Some((64, 64)), Some(SplatFilter::Box));
        let input = load::load(&source).expect("the scene can be read");
        let desc = &input.loaded.desc;
        let scene = Arc::new(Scene::prepare(desc).expect("the scene is valid"));
        let camera = Camera::of(desc).expect("the camera is valid");
        let of = |side: u32| {
            let mut run = input.run(&source, "cpu".to_string());
            (run.film.width, run.film.height) = (side, side);
            let first = FirstChunk::trace(&run, &scene, &camera, None).hash.finalize();
            (first, Identity::of(&run, &[], &scene, &camera, None).expect("no files").samples)
        };
        let [usual, alike, other] = [64, 65, 4096].map(of);
        assert_eq!(usual, alike);
        assert_eq!(usual.0, other.0);
        assert_ne!(usual.1, other.1);
    }

    /// Renders with and without a second randomisation have different identities, even if the first is the same: the second one's numbers
    /// are hashed too.
    #[test]
    fn the_second_randomisation_is_part_of_the_identity() {
        let source = SceneOptions::of("scenes/cornell.xml".into());
        let input = load::load(&source).expect("the scene can be read");
        let desc = &input.loaded.desc;
        let scene = Arc::new(Scene::prepare(desc).expect("the scene is valid"));
        let camera = Camera::of(desc).expect("the camera is valid");
        let [one, two] = [false, true].map(|replicated| {
            let run = RunSpec { replicated, ..input.run(&source, "cpu".to_string()) };
            Identity::of(&run, &[], &scene, &camera, None).expect("no files").samples
        });
        assert_ne!(one, two);
    }

    /// A state of two eyes is known by the samples of both: another place of the right one is another picture.
    #[test]
    fn both_eyes_are_part_of_the_identity() {
        let source = SceneOptions::of("scenes/cornell.xml".into());
        let input = load::load(&source).expect("the scene can be read");
        let desc = &input.loaded.desc;
        let scene = Arc::new(Scene::prepare(desc).expect("the scene is valid"));
        let camera = Camera::of(desc).expect("the camera is valid");
        let mut moved = desc.clone();
        moved.camera.to_world.translation.x += 0.01;
        let moved = Camera::of(&moved).expect("the camera is valid");
        let run = input.run(&source, "cpu".to_string());
        let [one, same, apart] = [None, Some(&camera), Some(&moved)]
            .map(|right| Identity::of(&run, &[], &scene, &camera, right).expect("no files").samples);
        assert!(one != same && same != apart && one != apart);
    }
}
