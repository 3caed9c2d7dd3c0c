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
use pointillist::regress::case_times::{CaseTimes, PassTime};
use pointillist::regress::evidence::Evidence;
use pointillist::regress::judgement::{Judgement, JudgementLevel, judge};
use pointillist::regress::report::{html, record};
use pointillist::regress::run_report::{CaseReport, CaseVerdict, RunReport};

/// Size of the pictures.
const SIZE: [usize; 2] = [48, 32];

/// Most bytes of the page for a case of 256×256 pixels: one that is green, and one that is changed. `src/regress/README.md` states them.
const BYTES: [usize; 2] = [60_000, 150_000];

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

/// A number from −1 to 1 without any pattern: a hash (the finaliser of `MurmurHash3`).
fn uniform(key: [u32; 3]) -> f32 {
    let hash = key.iter().fold(0u32, |hash, word| {
        let mut hash = (hash ^ word).wrapping_add(0x9e37_79b9);
        for factor in [0x85eb_ca6b, 0xc2b2_ae35] {
            hash = (hash ^ (hash >> 15)).wrapping_mul(factor);
        }
        hash ^ (hash >> 16)
    });
    (hash >> 8) as f32 / 8_388_608.0 - 1.0
}

/// Evidence of four renderings of a gradient with noise of up to the part `noisy`, red times `red`.
fn evidence(dir: &Path, name: &str, [width, height]: [usize; 2], noisy: f32, red: f32) -> Evidence {
    let pictures: Vec<Picture> = (0..4u32)
        .map(|seed| {
            let path = dir.join(format!("{name}-{seed}.exr"));
            let mut layers = Layers { width, height, ..Layers::default() };
            for (c, channel) in ["R", "G", "B"].into_iter().enumerate() {
                let factor = if c == 0 { red } else { 1.0 };
                layers.push(
                    channel,
                    (0..width * height).map(|i| {
                        let noise =
                            0.5 * (uniform([i as u32, seed, 3]) + uniform([i as u32, seed, c as u32]));
                        let gradient = (i % width) as f32 / width as f32 + 0.1 * c as f32 + 0.1;
                        factor * gradient * (1.0 + noisy * noise)
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
    let reference = evidence(dir, "reference", SIZE, 0.05, 1.0);
    let level = JudgementLevel { false_alarm: 0.01, relative: 0.0 };
    let case = |name: &str, verdict: CaseVerdict, red: Option<f32>| CaseReport {
        name: name.into(),
        scene: format!("{name}.xml").into(),
        method: "path".into(),
        device: "cpu".into(),
        command: vec!["pointillist".into(), "render".into(), format!("{name}.xml")],
        verdict,
        sentence: "A sentence.".into(),
        judgement: red.map(|red| judge(&evidence(dir, name, SIZE, 0.05, red), &reference, level).unwrap()),
        tolerance: "noise".into(),
        renderings: 4,
        spp: 16,
        seconds: 0.5,
        picture: red.map(|_| format!("{name}.exr").into()),
        reference: red.map(|_| dir.join("reference.exr")),
        log: red.is_none().then(|| "broken.log".into()),
        times: Some(CaseTimes {
            seconds: 0.06,
            paths_per_trace_second: Some(5e5),
            passes: vec![PassTime { name: "splat".into(), milliseconds: 1.5 }],
        }),
        timing: None,
    };
    fs::write(dir.join("broken.log"), "the device was lost\n").unwrap();
    let mut report = RunReport {
        version: "0.1.0".into(),
        folder: dir.into(),
        started: "2026-11-29T22:00:00Z".into(),
        seconds: 2.0,
        false_alarm: 0.01,
        fail_on_slower: None,
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

/// Notes the lowest contrast of a text against its background, with the element. Labels on pictures have a ground of their own that lets the
/// picture through, and are left out.
const CONTRAST: &str = "<script>\
    const linear = (c) => c / 255 <= 0.04045 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4;\
    const luminance = ([r, g, b]) => 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);\
    const numbers = (color) => color.match(/[0-9.]+/g).map(Number);\
    const ground = (element) => {\
        for (let at = element; at; at = at.parentElement) {\
            const color = numbers(getComputedStyle(at).backgroundColor);\
            if (color.length < 4 || color[3] === 1) return color;\
        }\
        return [255, 255, 255];\
    };\
    let lowest = [99, 'none'];\
    for (const element of document.querySelectorAll('main *')) {\
        const has_text = [...element.childNodes].some((node) => node.nodeType === 3 && node.data.trim());\
        if (!has_text || element.closest('.side, svg')) continue;\
        const pair = [numbers(getComputedStyle(element).color), ground(element)].map(luminance).sort((a, b) => b - a);\
        const ratio = (pair[0] + 0.05) / (pair[1] + 0.05);\
        if (ratio < lowest[0]) lowest = [ratio, element.tagName + '.' + element.className];\
    }\
    document.documentElement.setAttribute('data-contrast', lowest.join(' '));\
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
    for part in ["the device was lost", "2026-11-29 22:00", "FLIP: how visible", "Largest: ", "GPU's passes"]
    {
        assert!(dom.contains(part), "{part}: {dom}");
    }

    // Light and dark, whatever the system prefers: every text is readable (WCAG 2.2, success criterion 1.4.3).
    for (mode, media) in [("light", "(max-width: 1px)"), ("dark", "(min-width: 1px)")] {
        let shown = text.replace("(prefers-color-scheme: dark)", media).replace("</body>", CONTRAST);
        fs::write(&page, shown).unwrap();
        let [dom, _] = browse(&browser, &dir, &page, &["--virtual-time-budget=5000", "--dump-dom"]);
        let lowest = dom.split("data-contrast=\"").nth(1).and_then(|rest| rest.split('"').next()).unwrap();
        let (ratio, element) = lowest.split_once(' ').unwrap();
        assert!(ratio.parse::<f64>().unwrap() >= 4.5, "{mode}: {ratio} of {element}");
    }

    fs::write(&page, &text).unwrap();
    let picture = dir.join("page.png");
    browse(&browser, &dir, &page, &[&format!("--screenshot={}", picture.display())]);
    let seen = image::open(&picture).unwrap().to_rgb8();
    assert_eq!(seen.width(), 1000);
    let colors: HashSet<[u8; 3]> = seen.pixels().map(|pixel| pixel.0).collect();
    assert!(colors.len() > 500, "{} colours: the page is blank", colors.len());
}

/// A page of many cases stays one that a browser opens at once.
#[test]
fn a_case_takes_little_of_the_page() {
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join("regress_page_size");
    let _ = fs::remove_dir_all(&dir);
    fs::create_dir_all(&dir).unwrap();
    let (mut report, _) = page(&dir);
    // Noise of about a tenth of the picture in the mean of four renderings.
    let [reference, now] =
        [("reference", 1.0), ("noisy", 1.02)].map(|(name, red)| evidence(&dir, name, [256; 2], 0.35, red));
    let judgement = judge(&now, &reference, JudgementLevel { false_alarm: 0.01, relative: 0.0 }).unwrap();
    for case in &mut report.cases {
        (case.picture, case.log) = (Some("noisy.exr".into()), None);
        case.judgement = Some(Judgement { undecided: false, ..judgement.clone() });
        case.reference = Some(dir.join("reference.exr"));
    }
    for run in 10..40 {
        report.started = format!("2026-11-{}T22:{run}:00Z", run / 10 * 10);
        record(&report, &dir).unwrap();
    }
    let length = |count: usize| {
        let cases = report.cases.iter().take(count).cloned().collect();
        html(&RunReport { cases, ..report.clone() }, &dir).unwrap().len()
    };
    let lengths = [0, 1, 2].map(length);
    for (i, name) in ["a green case", "a changed case"].into_iter().enumerate() {
        let bytes = lengths[i + 1] - lengths[i];
        println!("{name}: {bytes} bytes");
        assert!((10_000..BYTES[i]).contains(&bytes), "{name}: {bytes} bytes");
    }
}

#[test]
fn letters_of_pictures_are_no_text() {
    assert_eq!(without_data("<img src=\"data:image/png;base64,NaN\" alt=\"a\">b"), "<img src=\" alt=\"a\">b");
}
