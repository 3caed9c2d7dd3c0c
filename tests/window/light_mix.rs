//! The light mix in the real window: groups are traced on a key, and saved as layers that add up to the picture.

use pointillist::image::exr;

use crate::support::desktop::Desktop;
use crate::viewer::{Listened, PATIENCE, folder, view_of};

const CTRL: u32 = 0xffe3;

#[test]
fn layers_of_the_groups_add_up_to_the_picture() {
    let (desktop, folder) = (Desktop::start(300, 300), folder("mix"));
    let scene = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/veach_plates.xml");
    let options =
        ["--size", "96x64", "--integrator", "bidirectional", "--samples", "40000", "--no-panel", "--vm", "1"];
    let mut viewer = Listened::new(view_of(&scene, &desktop, &folder, &options));
    viewer.wait_for("the render has ended");
    let window = desktop.find("ointillist", PATIENCE).unwrap();
    assert!(desktop.focus(window, PATIENCE));
    desktop.key(CTRL, true);
    desktop.key(u32::from('l'), true);
    desktop.key(u32::from('l'), false);
    desktop.key(CTRL, false);
    viewer.wait_for("lights are mixed");
    viewer.wait_for_times("the render has ended", 2);
    desktop.key(u32::from('e'), true);
    desktop.key(u32::from('e'), false);
    viewer.wait_for("saved veach_plates-001.exr");
    assert!(viewer.terminate().status.success());
    let layers = exr::read(&folder.join("veach_plates-001.exr")).unwrap();
    let channel = |name: &str| &layers.channels.iter().find(|(channel, _)| channel == name).unwrap().1;
    let groups = ["light_1", "light_2", "light_3", "light_4", "room_light"];
    for axis in ["R", "G", "B"] {
        let whole = channel(axis);
        let parts = groups.map(|group| channel(&format!("{group}.{axis}")));
        assert!(parts.iter().all(|part| part.iter().any(|c| *c > 0.0)), "a group is black");
        let relative = |i: usize| {
            let sum: f64 = parts.iter().map(|part| f64::from(part[i])).sum();
            (sum - f64::from(whole[i])).powi(2) / (f64::from(whole[i]).powi(2) + 0.01)
        };
        let error = (0..whole.len()).map(relative).sum::<f64>() / whole.len() as f64;
        println!("{axis}: relMSE {error:e}");
        assert!(error < 1e-10, "{axis}: {error:e}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}
