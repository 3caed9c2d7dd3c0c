//! Lamps that are seen over mirrors and glass alone: each chain is counted once, whatever the path chooses.

use std::sync::Arc;

use pointillist::color::Xyz;
use pointillist::image::compare::z_test;
use pointillist::scene;
use pointillist::scene::desc::SceneDesc;
use pointillist::stream::{SampleSink, UvWindow};
use pointillist::tracer::integrator::RenderContext;
use pointillist::tracer::{Camera, Integrator, PathTracer, Scene};

use crate::support::agreement::{Method, Plan, measured, repeat};

/// Half of the seeds are for the materials as they are, half for the mixtures, so that no random number is shared.
const PLAN: Plan = Plan { side: 12, paths_per_pixel: 128, seeds: 32, window: UvWindow::PICTURE };

/// Balls of glass and mirror over a floor that is coated black, behind a pane, and two lamps. `bsdf` makes a material of each.
fn still_life(bsdf: impl Fn(&str) -> String, max_depth: u32) -> SceneDesc {
    let glass = bsdf("<bsdf type=\"dielectric\"><float name=\"int_ior\" value=\"1.5\"/></bsdf>");
    let mirror = bsdf("<bsdf type=\"conductor\"><string name=\"material\" value=\"Ag\"/></bsdf>");
    let pane = bsdf("<bsdf type=\"thindielectric\"/>");
    let coat = bsdf("<bsdf type=\"plastic\"><rgb name=\"diffuse_reflectance\" value=\"0\"/></bsdf>");
    let lamp = |at: &str, radiance: &str| {
        format!(
            "<shape type=\"sphere\"><point name=\"center\" value=\"{at}\"/><float name=\"radius\" value=\"0.4\"/>\
             <emitter type=\"area\"><rgb name=\"radiance\" value=\"{radiance}\"/></emitter></shape>"
        )
    };
    let text = format!(
        "<scene version=\"3.0.0\"><integrator type=\"path\"><integer name=\"max_depth\" value=\"{max_depth}\"/></integrator>\
         <sensor type=\"perspective\"><float name=\"fov\" value=\"40\"/>\
         <transform name=\"to_world\"><lookat origin=\"0, 2, 6\" target=\"0, 0.8, 0\" up=\"0, 1, 0\"/></transform></sensor>\
         <shape type=\"sphere\"><point name=\"center\" value=\"-1, 1, 0\"/>{glass}</shape>\
         <shape type=\"sphere\"><point name=\"center\" value=\"1.2, 1, -0.5\"/>{mirror}</shape>\
         <shape type=\"rectangle\"><transform name=\"to_world\"><rotate x=\"1\" angle=\"-90\"/><scale value=\"4\"/></transform>{coat}</shape>\
         <shape type=\"rectangle\"><transform name=\"to_world\"><rotate y=\"1\" angle=\"30\"/><translate x=\"0.8\" y=\"0.5\" z=\"1.5\"/>\
         </transform>{pane}</shape>{}{}</scene>",
        lamp("0, 4, 2", "20"),
        lamp("-2, 2.5, -2", "5, 10, 20"),
    );
    scene::load_str("still_life.xml", &text, &[]).unwrap().desc
}

/// A mixture of a material with itself is the same material, but its deltas are not followed.
fn left_to_chance(bsdf: &str) -> String {
    format!("<bsdf type=\"blendbsdf\"><float name=\"weight\" value=\"0.5\"/>{bsdf}{bsdf}</bsdf>")
}

#[test]
fn every_chain_counts_once() {
    for max_depth in [3, 4, 12] {
        let (followed, chance) =
            (still_life(str::to_owned, max_depth), still_life(left_to_chance, max_depth));
        let half = PLAN.seeds as usize / 2;
        for method in [Method::Path, Method::Bidirectional, Method::Photon, Method::Vcm] {
            let found = measured(&repeat(&followed, method, PLAN)[..half]);
            let chance = measured(&repeat(&chance, method, PLAN)[half..]);
            let test = z_test(&found, &chance, 0.01).expect("equal sizes");
            let noise = found.variance.iter().sum::<f64>() / chance.variance.iter().sum::<f64>();
            println!(
                "{max_depth} {method:?}: ratio {:.5} ± {:.5}, mean z² {:.3}, noise {noise:.3}",
                test.mean_ratio, test.mean_ratio_error, test.mean_z2,
            );
            let off = (test.mean_ratio - 1.0).abs();
            assert!(off < 4.0 * test.mean_ratio_error, "{max_depth} {method:?}: {test:?}");
            assert!(test.mean_ratio_error < 0.02, "{max_depth} {method:?}: {test:?}");
            assert!(test.mean_z2 < 1.6, "{max_depth} {method:?}: {test:?}");
            assert!(noise < 0.95, "{max_depth} {method:?}: {noise}");
        }
    }
}

/// The colours of camera samples.
#[derive(Default)]
struct Colors(Vec<Xyz>);

impl SampleSink for Colors {
    fn camera(&mut self, _: [f32; 2], value: Xyz, _: f32) {
        self.0.push(value);
    }

    fn light(&mut self, _: [f32; 2], _: Xyz) {}
}

/// Where matt surfaces become mirrors and glass in an edit, and where these become matt, chains lead where they do in a scene that is prepared
/// anew.
#[test]
fn an_edit_knows_new_mirrors() {
    let (real, matt) =
        (still_life(str::to_owned, 12), still_life(|_| "<bsdf type=\"diffuse\"/>".to_owned(), 12));
    let samples = |scene: Scene| {
        let camera = Camera::of(&real).expect("the camera is valid");
        let context = RenderContext::new(Arc::new(scene), camera, &real.integrator, 1, UvWindow::PICTURE);
        let (tracer, mut colors) = (PathTracer { context }, Colors::default());
        (0..1 << 15).for_each(|index| tracer.trace(index, &mut (), &mut colors));
        colors.0
    };
    let prepared = |desc: &SceneDesc| Scene::prepare(desc).expect("the scene is valid");
    let edited = |from: &SceneDesc, to: &SceneDesc| prepared(from).edited(to).expect("the scene is valid");
    assert!(samples(edited(&matt, &real)) == samples(prepared(&real)));
    assert!(samples(edited(&real, &matt)) == samples(prepared(&matt)));
}
