//! The choice of a method is deterministic, right where the right one is clear, and made for the reason that it states.

use std::path::Path;
use std::sync::Arc;

use pointillist::scene::desc::IntegratorKind;
use pointillist::scene::{self, SceneDesc};
use pointillist::stream::UvWindow;
use pointillist::tracer::choice::{self, EventCounts, IntegratorChoice, Survey};
use pointillist::tracer::integrator::RenderContext;
use pointillist::tracer::{Camera, Scene};

fn render_context(desc: &SceneDesc) -> RenderContext {
    let scene = Arc::new(Scene::prepare(desc).unwrap());
    RenderContext::new(scene, Camera::of(desc).unwrap(), &desc.integrator, 0, UvWindow::PICTURE)
}

fn of_scene(name: &str) -> RenderContext {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.xml"));
    render_context(&scene::load(&path, &[]).unwrap().desc)
}

fn choose(context: &RenderContext) -> IntegratorChoice {
    choice::choose(context, 1)
}

fn of_file(name: &str) -> IntegratorChoice {
    let choice = choose(&of_scene(name));
    println!("{name}: {:?}: {}", choice.kind, choice.reason);
    for rating in &choice.ratings {
        println!("    {rating:?}");
    }
    choice
}

/// A grey floor and a lamp beside it, seen from in front and above, with what `more` adds.
fn floor(more: &str) -> RenderContext {
    let text = format!(
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"><float name=\"fov\" value=\"40\"/><transform name=\"to_world\">\
         <lookat origin=\"0, 3, -6\" target=\"0, 0.5, 0\" up=\"0, 1, 0\"/></transform></sensor>\
         <shape type=\"rectangle\"><transform name=\"to_world\"><scale value=\"9\"/><rotate x=\"1\" angle=\"-90\"/></transform>\
         <bsdf type=\"diffuse\"/></shape>{more}</scene>"
    );
    render_context(&scene::load_str("floor.xml", &text, &[]).unwrap().desc)
}

const LAMP: &str = "<shape type=\"sphere\"><point name=\"center\" value=\"2, 4, 0\"/><float name=\"radius\" value=\"0.5\"/>\
                    <emitter type=\"area\"><rgb name=\"radiance\" value=\"5\"/></emitter></shape>";

fn ball(bsdf: &str) -> String {
    format!(
        "<shape type=\"sphere\"><point name=\"center\" value=\"0, 0.6, 0\"/><float name=\"radius\" value=\"0.5\"/>{bsdf}</shape>"
    )
}

#[test]
fn a_scene_has_one_choice() {
    let context = floor(LAMP);
    assert_eq!(choose(&context), choose(&context));
    assert_eq!(choose(&context), choice::choose(&context, 4));
    // Neither the seed nor the size of a picture is part of the question.
    assert_eq!(
        choose(&context),
        choose(&RenderContext {
            seed: 7,
            window: UvWindow { min: [0.0; 2], max: [0.5; 2] },
            ..context.clone()
        })
    );
}

#[test]
fn brightness_does_not_matter() {
    let bright = LAMP.replace("value=\"5\"", "value=\"5000\"");
    let times = |choice: IntegratorChoice| choice.ratings.iter().map(|r| r.time()).collect::<Vec<_>>();
    let (dim, bright) = (choose(&floor(LAMP)), choose(&floor(&bright)));
    assert_eq!(dim.kind, bright.kind);
    for (a, b) in times(dim).into_iter().zip(times(bright)) {
        assert!((a / b - 1.0).abs() < 1e-3, "{a} {b}");
    }
}

#[test]
fn light_over_the_ceiling_is_not_left_to_camera_paths() {
    let choice = of_file("cove");
    assert_eq!(choice.kind, IntegratorKind::Bidirectional);
    assert!(choice.reason.contains("over 2 or more bounces"), "{}", choice.reason);
}

#[test]
fn direct_light_is_left_to_camera_paths() {
    for name in ["veach_plates", "furnace"] {
        assert_eq!(of_file(name).kind, IntegratorKind::Path, "{name}");
    }
}

#[test]
fn half_of_the_light_indirect_calls_for_both_ends() {
    assert_eq!(of_file("cornell").kind, IntegratorKind::Bidirectional);
}

#[test]
fn caustics_seen_in_a_mirror_call_for_merging() {
    let choice = of_file("cornell_spheres");
    assert_eq!(choice.kind, IntegratorKind::Vcm);
    assert!(choice.reason.contains("mirrors and glass"), "{}", choice.reason);
    let of = |kind| choice.ratings.iter().find(|r| r.kind == kind).unwrap();
    let (merged, connected) = (of(IntegratorKind::Vcm), of(IntegratorKind::Bidirectional));
    assert!(connected.missed > 0.0 && connected.time() > merged.time(), "{connected:?} {merged:?}");
}

/// Where the picture shows no mirror and no glass, or caustics are off, merging finds nothing and is not tried.
#[test]
fn merging_is_tried_where_it_finds_something() {
    let merges = |context: &RenderContext| {
        Survey::of(context).candidates(context).any(|kind| kind == IntegratorKind::Vcm)
    };
    assert!(!merges(&of_scene("cornell")));
    let spheres = of_scene("cornell_spheres");
    assert!(merges(&spheres));
    let mut off = spheres;
    off.photons.caustics = false;
    assert!(!merges(&off));
}

#[test]
fn what_particles_cannot_show_rules_them_out() {
    let complete = |more: &str| {
        let choice = choose(&floor(&format!("{LAMP}{more}")));
        choice.ratings.iter().find(|r| r.kind == IntegratorKind::Light).unwrap().complete
    };
    assert!(complete(&ball("<bsdf type=\"diffuse\"/>")));
    assert!(complete(&ball("<bsdf type=\"roughconductor\"><float name=\"alpha\" value=\"0.2\"/></bsdf>")));
    for delta in ["conductor", "dielectric", "plastic"] {
        assert!(!complete(&ball(&format!("<bsdf type=\"{delta}\"/>"))), "{delta}");
    }
    // Behind the camera it takes no part in the picture.
    let behind = ball("<bsdf type=\"conductor\"/>").replace("0, 0.6, 0", "0, 0.6, -12");
    assert!(complete(&behind));
}

#[test]
fn without_light_or_surfaces_there_is_a_choice_all_the_same() {
    let choice = choose(&floor(""));
    assert_eq!(choice.kind, IntegratorKind::Path);
    assert!(choice.reason.contains("no light"), "{}", choice.reason);
    let text = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/></scene>";
    let empty = render_context(&scene::load_str("empty.xml", text, &[]).unwrap().desc);
    assert_eq!(choose(&empty).kind, IntegratorKind::Path);
    let dark = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/></scene>";
    assert_eq!(
        choose(&render_context(&scene::load_str("dark.xml", dark, &[]).unwrap().desc)).kind,
        IntegratorKind::Path
    );
}

#[test]
fn a_survey_counts_what_is_there() {
    let survey = Survey::of(&floor(&format!("{LAMP}{}", ball("<bsdf type=\"dielectric\"/>"))));
    assert_eq!(survey.lights, 1);
    assert!(survey.delta_seen > 0.005 && survey.delta_seen < 0.2, "{survey:?}");
}

/// What is recorded is what methods do: a path has one beginning, and one of bidirectional tracing has a share of a light subpath, too.
#[test]
fn events_are_counted_per_path() {
    let context = of_scene("cornell");
    let [path, both, light] = [IntegratorKind::Path, IntegratorKind::Bidirectional, IntegratorKind::Light]
        .map(|kind| EventCounts::of(&context, kind));
    assert!((path.begun - 1.0).abs() < 1e-9 && both.begun > 1.1 && (light.begun - 1.0).abs() < 1e-9);
    assert!(path.light_samples > 1.0 && light.light_samples == 0.0 && path.to_camera == 0.0, "{path:?}");
    assert!(
        light.to_camera > 0.5 && both.connections > 0.5 && both.vertices_of_both == both.vertices,
        "{both:?}"
    );
    assert_eq!(path.vertices_of_both, 0.0);
}

/// Long paths are expensive, so that few are tried: even then no part of the picture may look black to one method and bright to the other.
#[test]
fn unbiased_methods_see_the_same_light() {
    let white = "<bsdf type=\"twosided\"><bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0.95\"/></bsdf></bsdf>";
    let room = format!(
        "<shape type=\"cube\"><transform name=\"to_world\"><scale value=\"14\"/></transform>{white}</shape>{LAMP}"
    );
    for context in [floor(&room), of_scene("cove"), of_scene("cornell")] {
        let choice = choose(&context);
        let path = choice.ratings[0].mean;
        for rating in choice.ratings.iter().filter(|r| r.complete) {
            let ratio = rating.mean / path;
            assert!((ratio - 1.0).abs() < 0.25 && rating.missed <= 0.3, "{path}: {rating:?}");
        }
    }
}

#[test]
fn a_box_is_lit_both_ways() {
    let reason = of_file("cornell").reason;
    let share: f64 = reason.split(" %").next().and_then(|s| s.parse().ok()).expect("a share of light");
    assert!((40.0..80.0).contains(&share), "{reason}");
}
