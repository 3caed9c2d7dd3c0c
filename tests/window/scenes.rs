//! The real program on a display of its own: other scenes in an open window, files that change, and loading.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crate::support::bmp::grey_bmp;
use crate::support::desktop::Desktop;
use crate::support::models::{cube, glb};
use crate::viewer::{PATIENCE, end, folder, program, terminate};

/// A viewer whose words on standard error are heard while it runs.
struct Heard {
    child: Child,
    words: Arc<Mutex<String>>,
}

impl Heard {
    fn view(desktop: &Desktop, folder: &Path, scene: &str, options: &[&str]) -> Self {
        let mut command = program();
        command.current_dir(folder).env("DISPLAY", &desktop.display).env("POINTILLIST_LOG", "info");
        let mut child = command
            .arg("view")
            .arg(scene)
            .args(options)
            .args(["--exposure", "1"])
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let (stderr, words) = (child.stderr.take().unwrap(), Arc::new(Mutex::new(String::new())));
        let into = words.clone();
        std::thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                *into.lock().unwrap() += &format!("{line}\n");
            }
        });
        Self { child, words }
    }

    fn words(&self) -> String {
        self.words.lock().unwrap().clone()
    }

    /// Waits until it has said this `times` times.
    fn hears(&mut self, said: &str, times: usize) {
        let start = Instant::now();
        while self.words().matches(said).count() < times {
            assert!(self.child.try_wait().unwrap().is_none(), "it has ended: {}", self.words());
            assert!(start.elapsed() < PATIENCE, "it has not said {said:?} {times} times: {}", self.words());
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

/// A scene of one colour, that of the light in another file.
const SCENE: &str = "<!-- A wall of light. --><scene version=\"3.0.0\"><include filename=\"light.xml\"/>\
    <sensor type=\"perspective\"><film type=\"hdrfilm\"><integer name=\"width\" value=\"320\"/>\
    <integer name=\"height\" value=\"240\"/></film></sensor></scene>";

fn light(gray: &str) -> String {
    format!("<emitter type=\"constant\"><rgb name=\"radiance\" value=\"{gray}\"/></emitter>")
}

fn write(path: PathBuf, text: impl AsRef<[u8]>) {
    std::fs::write(path, text).unwrap();
}

/// Waits until the upper right corner of the window, where no message stands, has this grey.
fn shows(desktop: &Desktop, window: u32, gray: f64) {
    // The plain curve and gamma of the display's defaults.
    let wanted = 255.0 * (1.0 - (-gray).exp()).powf(1.0 / 2.2);
    let (start, mut last) = (Instant::now(), 0);
    while start.elapsed() < PATIENCE {
        let (width, _, bgrx) = desktop.pixels(window).unwrap();
        last = bgrx[4 * (4 * width - 4) as usize + 1];
        if (f64::from(last) - wanted).abs() < 8.0 {
            return;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    panic!("the corner has {last} and not {wanted}");
}

#[test]
fn changed_files_are_read_again_and_bad_ones_leave_the_picture() {
    let folder = folder("reload");
    write(folder.join("scene.xml"), SCENE);
    write(folder.join("light.xml"), light("0.1"));
    let desktop = Desktop::start(400, 300);
    let mut viewer = Heard::view(&desktop, &folder, "scene.xml", &["--no-panel", "--integrator", "path"]);
    let window = desktop.find("ointillist", PATIENCE).unwrap();
    shows(&desktop, window, 0.1);
    // A file that is included, in two steps that are one change.
    write(folder.join("light.xml"), "");
    write(folder.join("light.xml"), light("0.5"));
    viewer.hears("read scene.xml again", 1);
    shows(&desktop, window, 0.5);
    // As editors write: another file takes the name.
    write(folder.join("new"), light("0.2"));
    std::fs::rename(folder.join("new"), folder.join("light.xml")).unwrap();
    viewer.hears("read scene.xml again", 2);
    shows(&desktop, window, 0.2);
    // A mistake is told with its place, and the last picture stays.
    write(folder.join("light.xml"), "<emitter type=\"constnat\"/>");
    viewer.hears("there is no emitter `constnat`", 1);
    assert!(viewer.words().contains("light.xml:1:"), "{}", viewer.words());
    std::thread::sleep(Duration::from_millis(500));
    shows(&desktop, window, 0.2);
    write(folder.join("light.xml"), light("0.7"));
    viewer.hears("read scene.xml again", 3);
    shows(&desktop, window, 0.7);
    let words = viewer.words();
    assert!(terminate(viewer.child).status.success(), "{words}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn files_that_are_dropped_onto_the_window_are_opened() {
    let folder = folder("drop");
    write(folder.join("scene.xml"), SCENE);
    write(folder.join("light.xml"), light("0.1"));
    let (text, binary) = cube();
    write(folder.join("cube.glb"), glb(&text, &binary));
    write(folder.join("bad.glb"), b"glTF");
    let desktop = Desktop::start(400, 300);
    let mut viewer = Heard::view(&desktop, &folder, "scene.xml", &["--no-panel", "--integrator", "path"]);
    let window = desktop.find("ointillist", PATIENCE).unwrap();
    shows(&desktop, window, 0.1);
    assert!(desktop.drop_file(window, &folder.join("bad.glb"), PATIENCE), "{}", viewer.words());
    viewer.hears("this is not valid glTF", 1);
    shows(&desktop, window, 0.1);
    assert!(desktop.title(window).contains("scene"), "{}", desktop.title(window));
    assert!(desktop.drop_file(window, &folder.join("cube.glb"), PATIENCE), "{}", viewer.words());
    viewer.hears("opened ", 1);
    let start = Instant::now();
    let colored = || {
        let (width, height, bgrx) = desktop.pixels(window).unwrap();
        let at = 4 * (height / 2 * width) as usize;
        let row = &bgrx[at..at + 4 * width as usize];
        row.chunks_exact(4).any(|p| p[..3].iter().max().unwrap() - p[..3].iter().min().unwrap() > 60)
    };
    while !colored() && start.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(50));
    }
    assert!(colored(), "no colour of the cube's texture is seen");
    assert!(desktop.title(window).contains("cube"), "{}", desktop.title(window));
    let words = viewer.words();
    assert!(terminate(viewer.child).status.success(), "{words}");
    std::fs::remove_dir_all(folder).unwrap();
}

/// A scene that takes some seconds to read: the window is there before it, and Escape closes it at once.
#[test]
fn the_window_is_there_while_the_scene_is_loaded() {
    let folder = folder("loading");
    // A fan of a million triangles, twice under different names.
    let mut obj: String =
        (0..1_000_000).map(|i| format!("v {} {} {}\n", i % 1000, i / 1000, i % 7)).collect();
    obj.extend((1..999_999).map(|i| format!("f {} {} {}\n", i, i + 1, i + 2)));
    let meshes = ["a.obj", "b.obj", "c.obj", "d.obj"];
    meshes.iter().for_each(|name| write(folder.join(name), &obj));
    let shapes: String = meshes
        .iter()
        .map(|name| format!("<shape type=\"obj\"><string name=\"filename\" value=\"{name}\"/></shape>"))
        .collect();
    write(folder.join("light.xml"), light("0.1"));
    write(folder.join("scene.xml"), SCENE.replace("</scene>", &format!("{shapes}</scene>")));
    let desktop = Desktop::start(400, 300);
    let start = Instant::now();
    let mut viewer = Heard::view(&desktop, &folder, "scene.xml", &["--no-panel"]);
    let window = desktop.find("ointillist", PATIENCE).unwrap();
    println!("the window was there after {:.2?}", start.elapsed());
    // It is made before it is shown.
    let mut seen = desktop.pixels(window);
    while seen.is_none() && start.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(20));
        seen = desktop.pixels(window);
    }
    let (width, height, _) = seen.unwrap();
    assert_eq!((width, height), (320, 240), "the size of the film");
    assert!(viewer.child.try_wait().unwrap().is_none());
    const ESCAPE: u32 = 0xff1b;
    assert!(desktop.focus(window, PATIENCE));
    let closing = Instant::now();
    while viewer.child.try_wait().unwrap().is_none() && closing.elapsed() < PATIENCE {
        desktop.key(ESCAPE, true);
        desktop.key(ESCAPE, false);
        std::thread::sleep(Duration::from_millis(50));
    }
    println!("it was closed after {:.2?}", closing.elapsed());
    let words = viewer.words();
    assert!(end(viewer.child).status.success(), "{words}");
    assert!(closing.elapsed() < Duration::from_secs(20) && !words.contains("read again"), "{words}");
    std::fs::remove_dir_all(folder).unwrap();
}

/// A model by itself, and an error of a file that cannot be read: the program ends with it.
#[test]
fn an_error_of_loading_ends_the_program() {
    let folder = folder("bad");
    write(folder.join("bad.gltf"), "{\n  \"asset\": {\n");
    let desktop = Desktop::start(400, 300);
    let viewer = Heard::view(&desktop, &folder, "bad.gltf", &[]);
    let words = viewer.words.clone();
    assert_eq!(end(viewer.child).status.code(), Some(1));
    std::thread::sleep(Duration::from_millis(200));
    let words = words.lock().unwrap().clone();
    assert!(words.contains("bad.gltf:3:") && !words.contains("panicked"), "{words}");
    std::fs::remove_dir_all(folder).unwrap();
}

/// Pixels along a side of a BMP file that is too large to be read before the first picture.
const LARGE: u32 = 2500;

/// A scene whose textures take long to read is shown before, in grey. One that is damaged is told, and the grey stays.
#[test]
fn large_textures_come_after_the_first_picture() {
    let folder = folder("textures");
    let wall = "<scene version=\"3.0.0\"><emitter type=\"constant\"/><shape type=\"rectangle\"><transform name=\"to_world\">\
                <scale value=\"9\"/><rotate y=\"1\" angle=\"180\"/><translate z=\"3\"/></transform><bsdf type=\"diffuse\">\
                <texture type=\"bitmap\" name=\"reflectance\"><string name=\"filename\" value=\"wall.bmp\"/></texture></bsdf></shape>\
                <sensor type=\"perspective\"><film type=\"hdrfilm\"><integer name=\"width\" value=\"320\"/>\
                <integer name=\"height\" value=\"240\"/></film></sensor></scene>";
    write(folder.join("scene.xml"), wall);
    write(folder.join("wall.bmp"), grey_bmp(LARGE, 230));
    let options = ["--no-panel", "--integrator", "path"];
    let desktop = Desktop::start(400, 300);
    let mut viewer = Heard::view(&desktop, &folder, "scene.xml", &options);
    viewer.hears("shown with one colour for each large picture", 1);
    viewer.hears("scene.xml is complete", 1);
    let window = desktop.find("ointillist", PATIENCE).unwrap();
    shows(&desktop, window, 0.791);
    // A new version of the same scene replaces it at once.
    write(folder.join("wall.bmp"), grey_bmp(LARGE, 100));
    viewer.hears("read scene.xml again", 1);
    shows(&desktop, window, 0.127);
    assert_eq!(viewer.words().matches("shown with one colour").count(), 1);
    assert!(terminate(viewer.child).status.success());
    write(folder.join("wall.bmp"), &grey_bmp(LARGE, 230)[..17_000_000]);
    let mut viewer = Heard::view(&desktop, &folder, "scene.xml", &options);
    viewer.hears("wall.bmp", 1);
    viewer.hears("scene.xml:1:", 1);
    let window = desktop.find("ointillist", PATIENCE).unwrap();
    shows(&desktop, window, 0.2158);
    assert!(terminate(viewer.child).status.success());
    std::fs::remove_dir_all(folder).unwrap();
}

/// The key that starts over brings back what was changed in the display, and tells how to undo it.
#[test]
fn everything_can_be_as_it_was_opened() {
    let folder = folder("start-over");
    write(folder.join("scene.xml"), SCENE);
    write(folder.join("light.xml"), light("0.2"));
    let desktop = Desktop::start(400, 300);
    let mut viewer = Heard::view(&desktop, &folder, "scene.xml", &["--no-panel", "--integrator", "path"]);
    let window = desktop.find("ointillist", PATIENCE).unwrap();
    shows(&desktop, window, 0.2);
    assert!(desktop.focus(window, PATIENCE));
    let press = |keys: &[u32]| {
        [true, false].into_iter().for_each(|down| keys.iter().for_each(|key| desktop.key(*key, down)));
    };
    let (ctrl, shift) = (0xffe3, 0xffe1);
    desktop.pointer(100, 100);
    for down in [true, false] {
        [ctrl, shift].into_iter().for_each(|key| desktop.key(key, down));
        if down {
            (0..12).for_each(|_| [true, false].iter().for_each(|down| desktop.button(4, *down)));
        }
    }
    // Two stops, or four where a step of the wheel counts twice.
    let start = Instant::now();
    while desktop.pixels(window).is_none_or(|(.., bgrx)| bgrx[1] < 185) {
        assert!(start.elapsed() < PATIENCE, "the picture has not become brighter: {}", viewer.words());
        std::thread::sleep(Duration::from_millis(50));
    }
    press(&[ctrl, shift, u32::from(b'r')]);
    viewer.hears("everything is as it was opened", 1);
    shows(&desktop, window, 0.2);
    assert!(terminate(viewer.child).status.success());
    std::fs::remove_dir_all(folder).unwrap();
}
