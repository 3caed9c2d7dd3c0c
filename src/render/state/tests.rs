//! Merged parts equal the whole picture, however it was divided and merged; parts of other pictures are rejected.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use crate::client::Film;
use crate::color::Xyz;
use crate::math::random::Random;
use crate::render::load;
use crate::render::method::render_context;
use crate::render::options::SceneOptions;
use crate::render::run_spec::RunSpec;
use crate::render::state::*;
use crate::scene::desc::{IntegratorKind, StereoConvergence, StereoRig};
use crate::stream::{CHUNK, PathCounts, Sample, SampleSink};
use crate::tracer::accel::SimdKernel;
use crate::tracer::integrator::{BidirectionalTracer, PathTracer, RenderContext, Replicated};
use crate::tracer::{Camera, Integrator, Scene};

/// A picture and the samples of each of its indices, traced with every kernel supported by this CPU.
struct TracedPicture {
    about: StateHeader,
    paths: PathCounts,
    by_kernel: Vec<Vec<Vec<Sample>>>,
}

#[derive(Default)]
struct Collector(Vec<Sample>);

impl SampleSink for Collector {
    fn camera(&mut self, uv: [f32; 2], xyz: Xyz, w: f32) {
        self.0.push(Sample { uv, xyz: xyz * w, w });
    }

    fn light(&mut self, uv: [f32; 2], xyz: Xyz) {
        self.0.push(Sample { uv, xyz, w: -1.0 });
    }
}

const INDICES: u64 = 4 * CHUNK + 321;

fn trace(scene: &str, integrator: IntegratorKind) -> TracedPicture {
    let source = SceneOptions {
        size: Some((24, 16)),
        integrator: Some(integrator),
        device: Some("cpu".to_string()),
        ..SceneOptions::of(scene.into())
    };
    let input = load::load(&source).unwrap();
    let desc = &input.loaded.desc;
    let mut run = input.run(&source, "cpu".to_string());
    run.film.variance = Some(Default::default());
    let camera = Camera::of(desc).unwrap();
    let kernels = SimdKernel::ALL.into_iter().filter(|kernel| kernel.is_available());
    let scenes: Vec<Arc<Scene>> =
        kernels.map(|kernel| load::prepare(Scene::prepare, desc, kernel).unwrap().into()).collect();
    let identity = Identity::of(&run, &input.files, &scenes[0], &camera, None).unwrap();
    let indices = 0..INDICES;
    let goal = RenderGoal { indices: indices.clone(), time: None, error: None };
    let about =
        StateHeader { program: String::new(), ..StateHeader::empty(run.clone(), identity, indices, goal) };
    let context = |scene: &Arc<Scene>| render_context(&run, scene.clone(), camera.clone(), run.film.window());
    let by_kernel = scenes.iter().map(|scene| match run.integrator {
        IntegratorKind::Bidirectional => samples_of::<BidirectionalTracer>(&context(scene)),
        _ => samples_of::<PathTracer>(&context(scene)),
    });
    let by_kernel: Vec<(PathCounts, Vec<Vec<Sample>>)> = by_kernel.collect();
    let paths = by_kernel[0].0;
    TracedPicture { about, paths, by_kernel: by_kernel.into_iter().map(|(_, samples)| samples).collect() }
}

fn samples_of<I: Integrator + From<RenderContext>>(
    context: &RenderContext,
) -> (PathCounts, Vec<Vec<Sample>>) {
    let tracer = Replicated::new(context, true, I::from);
    let mut scratch = Default::default();
    let samples = (0..INDICES).map(|index| {
        let mut out = Collector::default();
        tracer.trace(index, &mut scratch, &mut out);
        out.0
    });
    (tracer.paths_per_index(), samples.collect())
}

impl TracedPicture {
    /// State of a part, whose samples come from threads and kernels chosen by `random`.
    fn part(&self, range: Range<u64>, random: &mut Random) -> RenderState {
        let threads = [1, 2, 7][pick(random, 3)];
        let mut state = RenderState::new(self.about.clone(), threads).unwrap();
        let samples = &self.by_kernel[pick(random, self.by_kernel.len())];
        for index in range.clone() {
            let samples = &samples[index as usize];
            state.sums.film.count_paths(self.paths);
            state.sums.film.add(samples).unwrap();
            state.sums.replicates.as_mut().unwrap().add(index, self.paths, samples);
        }
        state.sums.film.flush().unwrap();
        state.about.indices.add(range).unwrap();
        state
    }
}

fn pick(random: &mut Random, count: usize) -> usize {
    ((random.f32() * count as f32) as usize).min(count - 1)
}

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("pointillist-state-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// For any division, order, tree of merges, number of threads and kernel, the bytes of the state equal those of the whole.
#[test]
fn parts_are_the_whole_however_it_is_cut_and_merged() {
    let folder = folder("cuts");
    let mut random = Random(20);
    for (scene, integrator) in [
        ("scenes/cornell.xml", IntegratorKind::Path),
        ("scenes/prism.xml", IntegratorKind::Path),
        ("scenes/cornell_spheres.xml", IntegratorKind::Bidirectional),
    ] {
        let traced = trace(scene, integrator);
        let bytes = |state: &mut RenderState| {
            let file = folder.join("sum.state");
            state.write(&file).unwrap();
            std::fs::read(file).unwrap()
        };
        let whole = bytes(&mut traced.part(0..INDICES, &mut Random(1)));
        for round in 0..334 {
            // Divisions anywhere, including within chunks.
            let mut cuts: Vec<u64> =
                (0..pick(&mut random, 9)).map(|_| pick(&mut random, INDICES as usize) as u64).collect();
            cuts.extend([0, INDICES]);
            cuts.sort_unstable();
            let mut parts: Vec<RenderState> =
                cuts.windows(2).map(|cut| traced.part(cut[0]..cut[1], &mut random)).collect();
            while parts.len() > 1 {
                let mut from = parts.swap_remove(pick(&mut random, parts.len()));
                let onto = pick(&mut random, parts.len());
                let file = folder.join("part.state");
                from.write(&file).unwrap();
                parts[onto].add(StateFile::open(&file).unwrap()).unwrap();
            }
            assert!(bytes(&mut parts.remove(0)) == whole, "{scene}, round {round}, cuts {cuts:?}");
        }
    }
    std::fs::remove_dir_all(folder).unwrap();
}

/// A file with any byte changed or missing is rejected.
#[test]
fn damage_is_found() {
    let folder = folder("damage");
    let file = folder.join("a.state");
    trace("scenes/cornell.xml", IntegratorKind::Path).part(0..CHUNK, &mut Random(1)).write(&file).unwrap();
    let bytes = std::fs::read(&file).unwrap();
    assert!(StateFile::open(&file).is_ok());
    let mut random = Random(5);
    for _ in 0..200 {
        let mut other = bytes.clone();
        match pick(&mut random, 3) {
            0 => other.truncate(pick(&mut random, bytes.len())),
            1 => other.push(7),
            _ => other[pick(&mut random, bytes.len())] ^= 1 << pick(&mut random, 8),
        }
        std::fs::write(&file, other).unwrap();
        let error = StateFile::open(&file).err().map(|error| error.to_string()).unwrap();
        assert!(error.contains("a.state"), "{error}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

/// Parts of a picture are divided at chunk borders, without gaps.
#[test]
fn shares_cover_the_picture() {
    for (picture, of) in [(0..1, 3), (0..100_000, 7), (1000..1_000_000_000_000, 1000), (5..5000, 1)] {
        let mut next = picture.start;
        for number in 1..=of {
            let part = Share { number, of }.indices(&picture);
            assert_eq!(part.start, next);
            assert!(number == of || (part.end - picture.start).is_multiple_of(CHUNK));
            next = part.end;
        }
        assert_eq!(next, picture.end);
        let beyond = Share { number: of + 1, of }.indices(&picture);
        assert!(beyond.start == next && beyond.end >= next);
    }
}

/// The sums of both eyes come back from a file as they were, each its own, and are added eye by eye. A file of one eye has the format of
/// before, and does not pass for two.
#[test]
fn both_eyes_come_back() {
    let folder = folder("eyes");
    let traced = trace("scenes/cornell.xml", IntegratorKind::Path);
    let rig = StereoRig { interocular: 0.1, convergence: StereoConvergence::OffAxis { distance: 1.0 / 3.0 } };
    let about = StateHeader {
        run: RunSpec { stereo: Some(rig), ..traced.about.run.clone() },
        right_eye: Some(Default::default()),
        ..traced.about.clone()
    };
    let samples = &traced.by_kernel[0];
    // The right eye has the samples of other indices, some of them twice.
    let part = |range: Range<u64>| {
        let mut state = RenderState::new(about.clone(), 1).unwrap();
        for index in range.clone() {
            let right = state.right_eye.as_mut().unwrap();
            for (sums, from) in [(&mut state.sums, index), (right, index / 2)] {
                let samples = &samples[from as usize];
                sums.film.count_paths(traced.paths);
                sums.film.add(samples).unwrap();
                sums.replicates.as_mut().unwrap().add(index, traced.paths, samples);
            }
        }
        state.about.indices.add(range).unwrap();
        state
    };
    let file = folder.join("a.state");
    let bytes = |state: &mut RenderState| {
        state.write(&file).unwrap();
        std::fs::read(&file).unwrap()
    };
    let whole = bytes(&mut part(0..INDICES));
    assert_eq!(whole[8], 2);
    let mut first = part(0..CHUNK);
    bytes(&mut part(CHUNK..INDICES));
    first.add(StateFile::open(&file).unwrap()).unwrap();
    assert!(bytes(&mut first) == whole);
    let read = StateFile::open(&file).unwrap().about;
    assert_eq!(read.run.stereo, Some(rig), "numbers have all their digits");
    let [left, right] = [first.sums.film.sums(0), first.right_eye.as_ref().unwrap().film.sums(0)];
    assert!(left.unwrap().pixels() != right.unwrap().pixels());
    let one = traced.part(0..CHUNK, &mut Random(1));
    assert!(one.about.difference(&about).is_some_and(|how| how.starts_with("stereo is ")));
    let mut one = one;
    assert_eq!(bytes(&mut one)[8], 1);
    let refused = part(CHUNK..INDICES).add(StateFile::open(&file).unwrap());
    assert!(refused.is_err_and(|error| error.to_string().contains("as many eyes")));
    std::fs::remove_dir_all(folder).unwrap();
}
