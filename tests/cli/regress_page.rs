//! The page of a regression run in a real browser: its script moves the sliders, and nothing on it is broken.
//!
//! Needs Chromium (`tools/setup --test` installs it). Where there is none, `POINTILLIST_NO_BROWSER=1` leaves these tests out.

use std::collections::HashSet;
use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use pointillist::image::compare::Picture;
use pointillist::image::exr::{self, Layers};
use pointillist::regress::evidence::Evidence;
use pointillist::regress::judgement::{JudgementLevel, judge};
use pointillist::regress::report::{html, record};
use pointillist::regress::run_report::{CaseReport, CaseVerdict, RunReport};

/// Size of the pictures.
const SIZE: (usize, usize) = (48, 32);

/// A browser that runs without a window, or `None` if it need not be there.
fn browser() -> Option<PathBuf> {
    let folders: Vec<PathBuf> = env::split_paths(&env::var_os("PATH").unwrap_or_default()).collect();
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let mut found = names.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    let found = found.find(|path| path.is_file());
    assert!(
        found.is_some() || env::var_os("POINTILLIST_NO_BROWSER").is_some(),
        "there is no Chromium on the PATH: run tools/setup --test, or set POINTILLIST_NO_BROWSER=1 to leave this test out"
    );
    found
}

/// Standard output and standard error of the browser for a page.
fn browse(browser: &Path, dir: &Path, page: &Path, options: &[&str]) -> [String; 2] {
    let mut command = Command::new("timeout");
    command.args(["--kill-after=5", "120"]).arg(browser);
    command.args([
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--hide-scrollbars",
        "--window-size=1000,1600",
    ]);
    command.args(["--enable-logging=stderr", "--no-first-run", "--disable-dev-shm-usage"]);
    command.arg(format!("--user-data-dir={}", dir.join("profile").display())).args(options);
    let output = command.arg(format!("file://{}", page.display())).output().unwrap();
    let [out, errors] =
        [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    assert!(output.status.success(), "{}: {errors}", output.status);
    [out, errors]
}

/// Evidence of four renderings of a gradient with some noise, red times `red`.
fn evidence(dir: &Path, name: &str, red: f32) -> Evidence {
    let pictures: Vec<Picture> = (0..4u32)
        .map(|seed| {
            let path = dir.join(format!("{name}-{seed}.exr"));
            let (width, height) = SIZE;
            let mut layers = Layers { width, height, ..Layers::default() };
            for (c, channel) in ["R", "G", "B"].into_iter().enumerate() {
                let factor = if c == 0 { red } else { 1.0 };
                layers.push(
                    channel,
                    (0..width * height).map(|i| {
                        let noise = (i as u32 * 3 + c as u32 + 7919 * seed).wrapping_mul(2_654_435_761) >> 16;
                        let gradient = (i % width) as f32 / width as f32 + 0.1 * c as f32 + 0.1;
                        factor * gradient * (0.95 + 0.1 * noise as f32 / 65_536.0)
                    }),
                );
            }
            exr::write(&path, &layers).unwrap();
            Picture::read(&path, None).unwrap()
        })
        .collect();
    let evidence = Evidence::of_pictures(&pictures).unwrap();
    evidence.write(&dir.join(format!("{name}.exr")), &[]).unwrap();
    evidence
}

/// A run with a changed, an equal and a broken case, and its page beside the pictures.
fn page(dir: &Path) -> (RunReport, String) {
    let reference = evidence(dir, "reference", 1.0);
    let level = JudgementLevel { false_alarm: 0.01, relative: 0.0 };
    let case = |name: &str, verdict: CaseVerdict, red: Option<f32>| CaseReport {
        name: name.into(),
        scene: format!("{name}.xml").into(),
        method: "path".into(),
        device: "cpu".into(),
        command: vec!["pointillist".into(), "render".into(), format!("{name}.xml")],
        verdict,
        sentence: "A sentence.".into(),
        judgement: red.map(|red| judge(&evidence(dir, name, red), &reference, level).unwrap()),
        tolerance: "noise".into(),
        renderings: 4,
        spp: 16,
        seconds: 0.5,
        picture: red.map(|_| format!("{name}.exr").into()),
        reference: red.map(|_| dir.join("reference.exr")),
        log: red.is_none().then(|| "broken.log".into()),
        timing: None,
    };
    fs::write(dir.join("broken.log"), "the device was lost\n").unwrap();
    let mut report = RunReport {
        version: "0.1.0".into(),
        folder: dir.into(),
        started: "2026-11-29T22:00:00Z".into(),
        seconds: 2.0,
        false_alarm: 0.01,
        cases: vec![
            case("equal", CaseVerdict::EqualWithinNoise, Some(1.0)),
            case("changed", CaseVerdict::Changed, Some(1.3)),
            case("broken", CaseVerdict::Broken, None),
        ],
    };
    record(&report, dir).unwrap();
    report.started = "2026-11-30T22:00:00Z".into();
    record(&report, dir).unwrap();
    let text = html(&report, dir).unwrap();
    (report, text)
}

/// A document without the values of `data:` URIs, whose letters mean nothing.
fn without_data(dom: &str) -> String {
    let mut parts = dom.split("data:image/");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |text, part| text + part.split_once('"').map_or("", |(_, rest)| rest))
}

/// Notes errors where the document shows them, before any script of the page runs.
const WATCH: &str = "<body><script>\
    const failed = (text) => document.documentElement.setAttribute('data-failed', text);\
    addEventListener('error', (event) => failed(event.message), true);\
    console.error = failed;</script>";

/// A user: moves the first slider, presses the space bar on the second one once, and an arrow key is left to the browser.
const USE: &str = "<script>\
    const [first, second] = document.querySelectorAll('.ab input');\
    first.value = 20; first.dispatchEvent(new Event('input'));\
    second.dispatchEvent(new KeyboardEvent('keydown', { key: ' ', cancelable: true }));\
    const images = [...document.images];\
    Promise.all(images.map((image) => image.decode())).then(\
        () => document.documentElement.setAttribute('data-decoded', images.length), (error) => failed(error.message));\
    </script></body>";

#[test]
fn sliders_move_and_nothing_on_the_page_is_broken() {
    let Some(browser) = browser() else { return };
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join("regress_page");
    let _ = fs::remove_dir_all(&dir);
    fs::create_dir_all(&dir).unwrap();
    let (report, text) = page(&dir);
    assert_eq!((text.matches("<body>").count(), text.matches("</body>").count()), (1, 1));
    let page = dir.join("page.html");
    fs::write(&page, text.replace("<body>", WATCH).replace("</body>", USE)).unwrap();

    let [dom, errors] = browse(&browser, &dir, &page, &["--virtual-time-budget=5000", "--dump-dom"]);
    assert!(!errors.contains("CONSOLE"), "{errors}");
    let dom = without_data(&dom);
    assert!(!dom.contains("data-failed=\""), "{dom}");
    for part in ["--at: 20%", "20 % this run", "--at: 100%", "100 % this run"] {
        assert!(dom.contains(part), "{part}: {dom}");
    }
    // Of each compared case: in the table, two in the slider, two maps.
    assert!(dom.contains("data-decoded=\"10\""), "{dom}");
    for bad in ["NaN", "undefined", "cannot be shown"] {
        assert!(!dom.contains(bad), "{bad}: {dom}");
    }
    for case in &report.cases {
        assert!(dom.contains(&format!(">{}</a>", case.name)), "{}: {dom}", case.name);
    }
    for part in ["the device was lost", "2026-11-29 22:00", "FLIP: how visible", "Largest: "] {
        assert!(dom.contains(part), "{part}: {dom}");
    }

    let picture = dir.join("page.png");
    browse(&browser, &dir, &page, &[&format!("--screenshot={}", picture.display())]);
    let seen = image::open(&picture).unwrap().to_rgb8();
    assert_eq!(seen.width(), 1000);
    let colors: HashSet<[u8; 3]> = seen.pixels().map(|pixel| pixel.0).collect();
    assert!(colors.len() > 500, "{} colours: the page is blank", colors.len());
}

#[test]
fn letters_of_pictures_are_no_text() {
    assert_eq!(without_data("<img src=\"data:image/png;base64,NaN\" alt=\"a\">b"), "<img src=\" alt=\"a\">b");
}
