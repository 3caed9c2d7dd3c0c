//! Manifests and what they mean.

use super::*;

/// A folder with two scenes and a manifest.
fn folder(manifest: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["a.xml", "b/scene.xml"] {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
        std::fs::write(path, "<scene/>").expect("a file");
    }
    if !manifest.is_empty() {
        std::fs::write(folder.path().join(MANIFEST), manifest).expect("a file");
    }
    folder
}

fn plan(manifest: &str, device: Option<&str>) -> RegressPlan {
    read_plan(folder(manifest).path(), device).unwrap_or_else(|error| panic!("{error:?}"))
}

fn names(plan: &RegressPlan) -> Vec<&str> {
    plan.cases.iter().map(|case| case.name.as_str()).collect()
}

/// The error of a manifest, with its place.
fn refusal(manifest: &str) -> String {
    match read_plan(folder(manifest).path(), None) {
        Ok(plan) => panic!("{plan:?}"),
        Err(error) => {
            let mut text = String::new();
            let handler =
                miette::GraphicalReportHandler::new_themed(miette::GraphicalTheme::unicode_nocolor());
            let handler = handler.with_width(400);
            handler.render_report(&mut text, error.as_ref()).expect("a string never fails");
            text
        }
    }
}

#[test]
fn without_a_manifest_scenes_are_found() {
    let plan = plan("", None);
    assert_eq!(names(&plan), ["a", "b"]);
    assert!(plan.references.ends_with("references"));
    assert_eq!(plan.false_alarm, 0.01);
    let case = &plan.cases[1];
    assert!(case.scene.ends_with("b/scene.xml"));
    assert_eq!(case.reference, ReferenceSource::Stored("b".into()));
    assert_eq!((case.budget.seeds, case.budget.most_seeds, case.budget.reference_seeds), (8, 32, 32));
    assert_eq!(case.renderer, CaseRenderer::Pointillist { method: None, device: None, options: vec![] });
    let empty = tempfile::tempdir().expect("a folder");
    assert!(read_plan(empty.path(), None).is_err_and(|error| error.to_string().contains("holds no scene")));
    assert!(read_plan(&empty.path().join("none"), None).is_err());
}

#[test]
fn cases_are_products_of_scenes_methods_and_devices() {
    let manifest = r#"
references = "old"
[defaults]
devices = ["cpu", "NVIDIA H200"]
spp = 4
[[case]]
scene = "*.xml"
methods = ["path", "bidirectional"]
one_reference = ["methods"]
[[case]]
name = "second"
scene = "b/scene.xml"
spp = 8
size = [32, 16]
tolerance = "strict"
"#;
    let whole = plan(manifest, None);
    let expected = [
        "a+path+cpu",
        "a+path+NVIDIA_H200",
        "a+bidirectional+cpu",
        "a+bidirectional+NVIDIA_H200",
        "second+cpu",
        "second+NVIDIA_H200",
    ];
    assert_eq!(names(&whole), expected);
    assert!(whole.references.ends_with("old"));
    assert_eq!(whole.cases[3].reference, ReferenceSource::Stored("a+path+NVIDIA_H200".into()));
    assert_eq!((whole.cases[0].budget.spp, whole.cases[4].budget.spp), (4, 8));
    let strict = &whole.cases[4];
    assert!(strict.tolerance.same_bits && strict.size == Some([32, 16]));
    assert_eq!((strict.budget.most_seeds, strict.budget.reference_seeds), (32, 8));
    // Another device keeps the names of references.
    assert_eq!(names(&plan(manifest, Some("cpu"))), ["a+path+cpu", "a+bidirectional+cpu", "second+cpu"]);
}

#[test]
fn one_reference_for_all_devices_stays_that_of_the_first() {
    let manifest = r#"
[[case]]
scene = "a.xml"
devices = ["cpu", "llvmpipe"]
one_reference = ["devices"]
"#;
    for (device, cases) in [(None, 2), (Some("llvmpipe"), 1)] {
        let plan = plan(manifest, device);
        assert_eq!(plan.cases.len(), cases);
        let stored = ReferenceSource::Stored("a+cpu".into());
        assert!(plan.cases.iter().all(|case| case.reference == stored), "{plan:?}");
    }
}

/// Exceptions name scenes as their cases are named, and the names of the other cases stay.
#[test]
fn exceptions_of_a_pattern_are_no_cases() {
    let folder = folder("[[case]]\nname = \"all\"\nscene = \"*.xml\"\nexcept = [\"c\", \"d*\"]\n");
    for name in ["c.xml", "d1.xml", "d2.xml"] {
        std::fs::write(folder.path().join(name), "<scene/>").expect("a file");
    }
    let plan = read_plan(folder.path(), None).unwrap_or_else(|error| panic!("{error:?}"));
    assert_eq!(names(&plan), ["all-a"]);
}

#[test]
fn references_of_other_programs() {
    let manifest = r#"
[renderer.other]
command = ["./other", "{scene}", "-s{seed}", "-n{spp}", "-o", "{output}"]
spp = 64
[[case]]
scene = "a.xml"
against = "other"
[[case]]
name = "picture"
scene = "a.xml"
against = "pictures/{scene}.exr"
[[case]]
name = "theirs"
scene = "a.xml"
renderer = "other"
against = "a"
"#;
    let plan = plan(manifest, None);
    assert!(matches!(&plan.cases[0].reference, ReferenceSource::Rendered { spp: 64, .. }));
    assert!(
        matches!(&plan.cases[1].reference, ReferenceSource::Picture(path) if path.ends_with("pictures/picture.exr"))
    );
    assert!(matches!(&plan.cases[2].renderer, CaseRenderer::Command { name, .. } if name == "other"));
    assert_eq!(plan.cases[2].reference, ReferenceSource::Stored("a".into()));
}

/// Every mistake has its line, column, and advice.
#[test]
fn mistakes_have_a_place_and_advice() {
    for (manifest, place, wanted) in [
        ("[defaults]\nssp = 3\n", ":2:1", "did you mean `spp`?"),
        ("[defaults]\nspp = \"many\"\n", ":2:7", "invalid type"),
        ("[defaults]\nspp = \n", ":2:", "README"),
        ("[[case]]\nscene = \"c.xml\"\n", ":2:9", "no file is called c.xml"),
        ("[[case]]\nspp = 3\n", ":1:", "has no scene"),
        ("[[case]]\nscene = \"a.xml\"\nmethods = [\"pth\"]\n", ":3:12", "did you mean `path`?"),
        ("[[case]]\nscene = \"a.xml\"\ntolerance = \"stict\"\n", ":3:13", "did you mean `strict`?"),
        ("[[case]]\nscene = \"a.xml\"\nseeds = 1\n", ":3:9", "2 to 1024"),
        ("[[case]]\nscene = \"a.xml\"\nseeds = 64\nmost_seeds = 8\n", ":4:14", "64 to 1024"),
        ("[[case]]\nscene = \"a.xml\"\noptions = [\"--seed\"]\n", ":3:11", "--seed-base"),
        ("[[case]]\nscene = \"a.xml\"\nagainst = \"bb\"\n", ":3:11", "no case, renderer or .exr file"),
        ("[[case]]\nscene = \"a.xml\"\n[[case]]\nscene = \"a.xml\"\n", ":4:9", "two cases are called a"),
        ("[[case]]\nscene = \"a.xml\"\ntolerance = \"strict\"\nagainst = \"x.exr\"\n", ":4:11", "same bits"),
        ("[defaults]\nscene = \"a.xml\"\n[[case]]\n", ":2:9", "no default"),
        ("[defaults]\nexcept = [\"a\"]\n[[case]]\nscene = \"a.xml\"\n", ":2:10", "no default"),
        ("[[case]]\nscene = \"*.xml\"\nexcept = [\"aa\"]\n", ":3:11", "no scene of this case is called aa"),
        ("[[case]]\nscene = \"*.xml\"\nexcept = [\"*\"]\n", ":3:10", "no scene of this case is left"),
        ("false_alarm = 2\n[[case]]\nscene = \"a.xml\"\n", ":1:15", "a probability"),
        (
            "[renderer.x]\ncommand = [\"x\", \"{scene}\", \"{output}\"]\n[[case]]\nscene = \"a.xml\"\nrenderer = \"x\"\n",
            ":2:11",
            "lacks {seed}",
        ),
        (
            "[renderer.x]\ncommand = [\"x\", \"{scene}\", \"{output}\", \"{seed}\", \"{sp}\"]\n[[case]]\nscene = \"a.xml\"\nrenderer = \"x\"\n",
            ":2:11",
            "did you mean `spp`?",
        ),
        (
            "[renderer.x]\ncommand = [\"x\", \"{scene}\", \"{output}\", \"{seed}\"]\n[[case]]\nscene = \"a.xml\"\nrenderer = \"x\"\nmethods = [\"path\"]\n",
            ":6:11",
            "for cases that Pointillist renders",
        ),
    ] {
        let text = refusal(manifest);
        assert!(text.contains(&format!("{MANIFEST}{place}")) && text.contains(wanted), "{manifest}\n{text}");
    }
}
