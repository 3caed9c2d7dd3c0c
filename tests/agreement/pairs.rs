//! Tests every pair of methods on one scene for equal expectation, in blocks of the picture and as a whole.

use crate::support::agreement::{Method, Plan, repeat};
use crate::support::welch;
use pointillist::scene::desc::SceneDesc;
use pointillist::spectrum::SampledWavelengths;
use pointillist::stream::UvWindow;
use pointillist::tracer::bsdf::{Bsdf, ScatteringModel};
use pointillist::tracer::{Camera, Scene};

/// The methods that are compared.
pub const METHODS: [Method; 5] =
    [Method::Path, Method::Particle, Method::Bidirectional, Method::Photon, Method::Vcm];

/// The relative difference of a block, and of the mean, that counts as none for photon mapping: its bias at the number of paths
/// of [`PLAN`] where light has no sharp features (`tools/benchmarks/photon_bias.rs` shows how it shrinks).
pub const PHOTONS: f64 = 0.02;

/// 64 blocks, 32 repetitions of 16 384 paths.
pub const PLAN: Plan = Plan { side: 8, paths_per_pixel: 256, seeds: 32, window: UvWindow::PICTURE };

/// The significance level of each of the two tests of a scene: about the probability of a false alarm.
const LEVEL: f64 = 1e-3;

/// The sharpest lobe that light subpaths can connect to the camera, as the density per steradian of its peak: that of a metal of
/// roughness 0.05. A sharper one gives a block so few and so strong particles that 32 repetitions say nothing.
const SHARPEST: f32 = 32.0;

/// True for the blocks where light subpaths can reach the camera: where no ray of a fine grid first meets a mirror, clear glass, a
/// coat, or a lobe that is nearly one of these.
fn seen_from_lights(desc: &SceneDesc, side: usize) -> Vec<bool> {
    let scene = Scene::prepare(desc).expect("the scene is valid");
    let camera = Camera::of(desc).expect("the camera is valid");
    let lambda = SampledWavelengths::sample(0.5);
    let mut seen = vec![true; side * side];
    let fine = 32 * side;
    for (i, j) in (0..fine).flat_map(|i| (0..fine).map(move |j| (i, j))) {
        let uv = [i, j].map(|k| (k as f64 + 0.5) / fine as f64);
        // Over the lens, too, where there is one.
        let lens = [(i * 5 % 32) as f32 / 32.0, (j * 11 % 32) as f32 / 32.0];
        if let Some(hit) = camera.ray(uv, lens).and_then(|ray| scene.closest(&ray)) {
            let surface = scene.surface_material(&hit);
            let wo = surface.frame.to_local(hit.wo);
            // Of both lobes, where there are two, the one of the mirror direction or of going straight on.
            let sharp = |lobe| {
                let sample = surface.bsdf::<Bsdf>(&lambda).sample(wo, [0.5; 2], lobe);
                sample.is_some_and(|s| s.delta || s.pdf.0 > SHARPEST)
            };
            seen[j / 32 * side + i / 32] &= !(sharp(0.0) || sharp(1.0));
        }
    }
    seen
}

/// Fails when two of [`METHODS`] differ on this scene.
///
/// Each pair takes Welch's t-test in every block, at a level divided by the number of blocks and pairs (Bonferroni), and one on the
/// mean of the blocks, whose variance comes from the repetitions, so that correlation between neighbours counts.
pub fn assert_all_pairs(name: &str, desc: &SceneDesc, plan: Plan, photons: f64) {
    assert_pairs(name, desc, &METHODS, plan, photons);
}

/// As [`assert_all_pairs`], for these methods.
pub fn assert_pairs(name: &str, desc: &SceneDesc, methods: &[Method], plan: Plan, photons: f64) {
    let visible = seen_from_lights(desc, plan.side);
    let pictures: Vec<_> = methods.iter().map(|method| repeat(desc, *method, plan)).collect();
    let pairs: Vec<_> = (0..methods.len()).flat_map(|b| (0..b).map(move |a| (a, b))).collect();
    let mut failures = Vec::new();
    for &(a, b) in &pairs {
        let from_light = [a, b].iter().any(|&i| methods[i] == Method::Particle);
        let blocks: Vec<usize> = (0..plan.side.pow(2)).filter(|&i| visible[i] || !from_light).collect();
        let biased = [a, b].iter().any(|&i| matches!(methods[i], Method::Photon | Method::Vcm));
        let (share, n) = (if biased { photons } else { 0.0 }, f64::from(plan.seeds));
        let test = |of: &dyn Fn(&[f64]) -> f64| {
            let [a, b] = [a, b].map(|i| welch::moments(pictures[i].iter().map(|p| of(p))));
            let (t, freedom) = welch::t(a, b, share * a.0.abs(), n);
            (t, welch::p_value(t, freedom), a, b)
        };
        let results: Vec<_> = blocks.iter().map(|&i| test(&|p| p[i])).collect();
        let worst = (0..blocks.len()).min_by(|&i, &j| results[i].1.total_cmp(&results[j].1)).expect("blocks");
        let whole = test(&|p| blocks.iter().map(|&i| p[i]).sum::<f64>() / blocks.len() as f64);
        let squares = results.iter().map(|r| r.0 * r.0).sum::<f64>() / blocks.len() as f64;
        let line = format!(
            "{name}: {:?} and {:?}, {} blocks: mean t² {squares:.2}, worst block {:?} t {:.2} p {:.1e}; means {:.5} and {:.5}, \
             {:+.3} % ± {:.3} %, p {:.1e}",
            methods[a],
            methods[b],
            blocks.len(),
            (blocks[worst] % plan.side, blocks[worst] / plan.side),
            results[worst].0,
            results[worst].1,
            whole.2.0,
            whole.3.0,
            100.0 * (whole.3.0 / whole.2.0 - 1.0),
            100.0 * (whole.2.1 + whole.3.1).sqrt() / whole.2.0,
            whole.1,
        );
        println!("{line}");
        let pairs = pairs.len() as f64;
        if results[worst].1 * pairs * (blocks.len() as f64) < LEVEL || whole.1 * pairs < LEVEL {
            failures.push(line);
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
