//! `--simd`: pictures do not depend on it, figures name it, other words are refused.

use std::path::Path;
use std::process::{Command, Output};

use pointillist::tracer::accel::SimdKernel;
use serde_json::Value;

fn run(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(args).output().unwrap()
}

/// EXR, PNG and figures of one deterministic picture. Its name is the same for all, in folders of their own.
#[track_caller]
fn picture(name: &str, scene: &str, options: &[&str]) -> ([Vec<u8>; 2], Value) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("simd_cli").join(name);
    std::fs::create_dir_all(&folder).unwrap();
    let files = ["a.exr", "a.png"].map(|file| folder.join(file).to_str().unwrap().to_string());
    let args = ["render", scene, "--deterministic", "--device", "cpu", "--spp", "4", "--size", "64x64", "-q"];
    let args = [&args[..], &["-o", &files[0], "-o", &files[1], "--json", "-"], options].concat();
    let output = run(&args);
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    (files.map(|file| std::fs::read(file).unwrap()), serde_json::from_slice(&output.stdout).unwrap())
}

/// The same bytes by every kernel that this processor has, and by none that is named.
#[test]
fn pictures_do_not_depend_on_the_kernel() {
    let there = || SimdKernel::ALL.into_iter().filter(|kernel| kernel.is_available());
    for (scene, method) in [("scenes/cornell_spheres.xml", "path"), ("scenes/caustic.xml", "bidirectional")] {
        let of = |simd: &str| picture(simd, scene, &["--integrator", method, "--simd", simd]);
        let (first, figures) = of("scalar");
        assert_eq!(figures["simd"], "scalar");
        for kernel in there() {
            let (bytes, figures) = of(kernel.name());
            assert_eq!(figures["simd"], kernel.name());
            assert!(bytes == first, "{scene}, {method}: {} differs from scalar", kernel.name());
        }
        let (bytes, figures) = of("auto");
        assert_eq!(figures["simd"], SimdKernel::best().name());
        assert!(bytes == first, "{scene}, {method}: auto differs from scalar");
        // The comparison can tell pictures apart.
        let (other, figures) = picture("seed", scene, &["--integrator", method, "--seed", "1"]);
        assert_eq!(figures["simd"], SimdKernel::best().name());
        assert!(other[0] != first[0] && other[1] != first[1], "{scene}: the seed changes nothing");
    }
    println!("compared here: {}", there().map(SimdKernel::name).collect::<Vec<_>>().join(", "));
}

/// Both scenes of `--check-plan`, the planned one and the general one, are walked as asked, and agree.
#[test]
fn plans_are_checked_by_every_kernel() {
    for kernel in SimdKernel::ALL.into_iter().filter(|kernel| kernel.is_available()) {
        let options = ["--check-plan", "0.2", "--simd", kernel.name()];
        let (_, figures) = picture(&format!("check-{}", kernel.name()), "scenes/cornell.xml", &options);
        assert!(figures["plan_check"]["paths"].as_u64().unwrap() > 0);
        assert_eq!(figures["plan_check"]["different"], 0);
    }
}

#[test]
fn other_words_are_refused() {
    for subcommand in ["render", "view", "bench", "explain", "study"] {
        let output = run(&[subcommand, "scenes/cornell.xml", "--simd", "neon"]);
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success(), "{subcommand} accepts neon");
        let words = ["neon", "--simd", "auto", "scalar", "avx2", "avx512"];
        assert!(words.iter().all(|word| errors.contains(word)), "{subcommand}: {errors}");
    }
}

/// What the processor lacks is an error that says what it has, before anything is traced.
#[test]
fn what_the_processor_lacks_is_refused() {
    for kernel in SimdKernel::ALL.into_iter().filter(|kernel| !kernel.is_available()) {
        let output = run(&["explain", "scenes/cornell.xml", "--simd", kernel.name()]);
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success(), "{} runs without its instructions", kernel.name());
        assert!(errors.contains(kernel.name()) && errors.contains("scalar"), "{errors}");
    }
}
