//! `--denoise oidn`: what is said where the library is missing, and what it makes where it is installed.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use pointillist::client::oidn;
use pointillist::image::compare::Picture;
use serde_json::Value;

/// A folder of this test's own, empty.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("oidn").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// The program with this library, or that of the environment.
fn run(library: Option<&str>, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).envs(library.map(|file| (oidn::VARIABLE, file)));
    command.args(args).output().unwrap()
}

const RENDER: [&str; 8] = [
    "render",
    "scenes/cornell.xml",
    "--size=64x64",
    "--device=cpu",
    "--quiet",
    "--json=-",
    "--deterministic",
    "--integrator=bidirectional",
];

/// Files that are no such library: the message names variable, file and fault, and tells how to get one. Nothing is rendered.
#[test]
fn without_the_library_it_is_an_error_that_says_how_to_get_it() {
    let place = folder("without");
    let file = place.join("a.png").display().to_string();
    let cases = [
        ("/nowhere/libOpenImageDenoise.so.2", "No such file"),
        ("scenes/cornell.xml", ""),
        // A library, and another one.
        ("libc.so.6", "has no oidnNewDevice"),
    ];
    for (library, fault) in cases {
        for args in [
            [&RENDER[..], &["--denoise=oidn", "--spp=4", "-o", &file]].concat(),
            vec!["view", "scenes/cornell.xml", "--denoise=oidn"],
        ] {
            let output = run(Some(library), &args);
            let said = String::from_utf8_lossy(&output.stderr);
            // Lines are broken at a width, also within a path.
            let plain = |text: &str| text.replace(['\n', '│', ' '], "");
            let said = plain(&said);
            assert!(!output.status.success(), "{library}");
            for words in ["--denoise oidn", &format!("OIDN_LIBRARY={library}"), fault, "pip install pyoidn"] {
                assert!(said.contains(&plain(words)), "{library}: {words:?} is not in {said}");
            }
            assert!(!said.contains("window"), "{said}");
        }
        let output = run(Some(library), &["devices"]);
        let listed = String::from_utf8_lossy(&output.stdout);
        assert!(
            output.status.success()
                && listed.contains(&format!(
                    "(no --denoise oidn: Open Image Denoise cannot be loaded from OIDN_LIBRARY={library}"
                )),
            "{listed}"
        );
        // Whoever does not ask for it does not need it.
        assert!(
            run(Some(library), &[&RENDER[..], &["--denoise=wavelet", "--spp=4", "-o", &file]].concat())
                .status
                .success()
        );
        std::fs::remove_file(&file).unwrap();
    }
}

/// As the wavelets it changes what is displayed and nothing else, and files and report say so.
#[test]
fn with_the_library_noise_is_filtered() {
    let library = match oidn::library() {
        Ok(library) => library,
        Err(error) => {
            // `tools/test` names the library where `tools/setup` could install it.
            assert!(std::env::var_os("OIDN_LIBRARY").is_none(), "{error}");
            return println!("skipped: {error}");
        }
    };
    let listed = run(None, &["devices"]);
    let line = format!("oidn  Open Image Denoise {}, for --denoise oidn: ", library.version());
    assert!(String::from_utf8_lossy(&listed.stdout).contains(&line), "{line}");
    let place = folder("with");
    let out = |name: &str| place.join(name).display().to_string();
    let render = |more: &[&str]| -> Value {
        let output = run(None, &[&RENDER[..], more].concat());
        assert!(output.status.success(), "{more:?}: {}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let (plain, shown) = (out("plain.exr"), out("plain.png"));
    let a = render(&["--spp=4", "-o", &plain, "-o", &shown]);
    let files = ["1", "2"].map(|threads| {
        let (sums, shown) = (out(&format!("{threads}.exr")), out(&format!("{threads}.png")));
        let b = render(&["--spp=4", "--denoise", "oidn", "--threads", threads, "-o", &sums, "-o", &shown]);
        assert_eq!(b["error"]["besides"], "the noise filter, of the picture without it");
        assert_eq!(a["error"]["p95"], b["error"]["p95"]);
        (std::fs::read(sums).unwrap(), std::fs::read(shown).unwrap())
    });
    assert!(files[0] == files[1], "the same bytes for any number of threads");
    let has = |bytes: &[u8], text: &str| bytes.windows(text.len()).any(|part| part == text.as_bytes());
    let by = format!("by oidn {}", library.version());
    assert!(has(&files[0].0, "denoised.G") && has(&files[0].0, &by) && has(&files[0].1, "--denoise oidn"));
    let picture = |file: &str, layer| Picture::read(Path::new(file), layer).unwrap();
    let one = out("1.exr");
    assert!(picture(&plain, None).rgb.pixels() == picture(&one, None).rgb.pixels());
    assert_ne!(std::fs::read(&shown).unwrap(), files[0].1);
    // Nearer to the picture of many samples, and as bright.
    let reference = out("reference.exr");
    render(&["--spp=256", "-o", &reference]);
    let [reference, noisy, filtered] =
        [picture(&reference, None), picture(&one, None), picture(&one, Some("denoised"))];
    let luminance = |picture: &Picture| -> Vec<f32> {
        picture.rgb.pixels().iter().map(|[r, g, b]| 0.2126 * r + 0.7152 * g + 0.0722 * b).collect()
    };
    let [reference, noisy, filtered] = [reference, noisy, filtered].map(|picture| luminance(&picture));
    // The edges of the lamp, brighter than all else, have an error of their own.
    let median = |picture: &[f32]| {
        let mut off: Vec<f32> =
            picture.iter().zip(&reference).map(|(a, b)| (a - b).abs() / (b + 0.01)).collect();
        off.sort_by(f32::total_cmp);
        off[off.len() / 2]
    };
    let sum = |picture: &[f32]| picture.iter().sum::<f32>();
    let [filtered_off, noisy_off] = [&filtered, &noisy].map(|picture| median(picture));
    assert!(filtered_off < 0.75 * noisy_off, "{filtered_off} of {noisy_off}");
    assert!((sum(&filtered) / sum(&reference) - 1.0).abs() < 0.06, "{}", sum(&filtered) / sum(&reference));
}
