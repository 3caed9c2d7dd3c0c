//! `pointillist regress bisect`: the first changed commit of scenes and of a renderer, and nothing left behind.
#![cfg(unix)]

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::regress::{command, folder, prepare, regress, scene, text, update, wait_for, write};

#[track_caller]
fn git(place: &Path, words: &[&str]) -> String {
    let mut git = Command::new("git");
    git.arg("-C").arg(place).args(["-c", "user.name=A", "-c", "user.email=a@example.org"]);
    git.args(["-c", "commit.gpgsign=false", "-c", "core.hooksPath=/dev/null"]).args(words);
    ["GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE"].iter().for_each(|name| {
        git.env_remove(name);
    });
    let output = git.output().unwrap();
    assert!(output.status.success(), "git {words:?}: {}", text(&output.stderr));
    text(&output.stdout).trim().to_owned()
}

fn commit(place: &Path, subject: &str) {
    git(place, &["add", "--all"]);
    git(place, &["commit", "--quiet", "--message", subject]);
}

/// A repository of five commits of a scene, of which the third changes the picture; with a reference of the first.
fn five_commits(name: &str) -> PathBuf {
    let place = folder(name);
    prepare(&place, "[[case]]\nscene = \"a.xml\"\n", &[]);
    git(&place, &["init", "--quiet"]);
    write(&place, ".gitignore", "references\nresults\n");
    let albedos = [0.5, 0.5, 0.8, 0.8, 0.8];
    for (albedo, subject) in
        albedos.iter().zip(["first", "second", "is the first lighter one", "fourth", "fifth"])
    {
        write(&place, "a.xml", &format!("{}<!-- {subject} -->\n", scene(*albedo)));
        commit(&place, subject);
        if subject == "first" {
            update(&place);
        }
    }
    place
}

/// What a search must leave as it is.
fn state(place: &Path) -> [String; 4] {
    [
        &["rev-parse", "HEAD"][..],
        &["status", "--porcelain"],
        &["worktree", "list"],
        &["for-each-ref", "refs/bisect"],
    ]
    .map(|words| git(place, words))
}

#[test]
fn the_first_changed_commit_of_a_scene_is_found() {
    let place = five_commits("bisect_scene");
    // What is not committed is neither used nor lost.
    write(&place, "a.xml", "not even a scene");
    write(&place, "new.txt", "new");
    let before = state(&place);
    let output = regress(&place, &["bisect", "a", "--good", "HEAD~4"], 0);
    let (out, errors) = (text(&output.stdout), text(&output.stderr));
    let third = git(&place, &["rev-parse", "HEAD~2"]);
    let wanted = format!("{third} is the first changed commit: is the first lighter one\na: ");
    assert!(out.starts_with(&wanted) && out.contains("brightness"), "{out}{errors}");
    assert!(errors.contains("equal: ") && errors.contains("changed: "), "{errors}");
    assert_eq!(state(&place), before);
    assert_eq!(std::fs::read_to_string(place.join("a.xml")).unwrap(), "not even a scene");
    assert!(place.join("new.txt").exists() && !place.join("results").exists());
}

#[test]
fn mistakes_are_told_and_leave_nothing() {
    let place = five_commits("bisect_mistakes");
    let other = five_commits("bisect_other");
    let nowhere = tempfile::tempdir().unwrap();
    let before = [state(&place), state(&other)];
    let (nowhere, elsewhere) = (nowhere.path().display().to_string(), other.display().to_string());
    for (words, wanted) in [
        (&["a", "--good", "nonsense"][..], "nonsense is no revision of"),
        (&["a", "--good", "HEAD"], "are the same commit"),
        (&["a", "--good", "HEAD~1"], "the good revision HEAD~1 has changed already"),
        (
            &["a", "--good", "HEAD~4", "--bad", "HEAD~3"],
            "the bad revision HEAD~3 has the picture of the reference",
        ),
        (
            &["a", "--good", "HEAD~4", "--build", "exit 7"],
            "cannot be judged: the build ended with exit code 7",
        ),
        (&["a", "--good", "HEAD~4", "--repository", &nowhere], "is in no checkout of git"),
        (&["a", "--good", "HEAD~4", "--repository", &elsewhere], "neither its scene nor its renderer"),
        (&["b", "--good", "HEAD~4"], "no case has b in its name"),
    ] {
        let output = regress(&place, &[&["bisect"][..], words].concat(), 2);
        // Long lines are broken between words.
        let errors = text(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(errors.contains(wanted), "{words:?}: {errors}");
    }
    assert_eq!([state(&place), state(&other)], before);
}

/// Renders the scene that the build has made beside this script.
const RENDER: &str = r#"exec "$PROGRAM" render "$(dirname "$0")/built.xml" -o "$2" --seed "$3" --spp 2 --replicates 1 --device cpu --quiet
"#;

/// A renderer with a repository of its own: what cannot be built is skipped, and told where it hides the answer.
#[test]
fn the_first_changed_commits_of_a_renderer_are_found() {
    let place = folder("bisect_renderer");
    let (scenes, renderer) = (place.join("scenes"), place.join("renderer"));
    [&scenes, &renderer].iter().for_each(|folder| std::fs::create_dir(folder).unwrap());
    let manifest = "[renderer.own]\ncommand = [\"/bin/sh\", \"../renderer/render\", \"{scene}\", \"{output}\", \"{seed}\"]\n\
                    [[case]]\nscene = \"a.xml\"\nrenderer = \"own\"\n";
    prepare(&scenes, manifest, &["a.xml"]);
    let regress = |words: &[&str]| {
        let mut command = command(&scenes, words);
        command.env("PROGRAM", env!("CARGO_BIN_EXE_pointillist")).output().unwrap()
    };
    git(&renderer, &["init", "--quiet"]);
    write(&renderer, ".gitignore", "built.xml\n");
    write(&renderer, "render", RENDER);
    for (albedo, subject) in
        [0.5, 0.5, 0.8, 0.8, 0.8].iter().zip(["first", "broken", "third", "fourth", "fifth"])
    {
        let text = if subject == "broken" { String::new() } else { scene(*albedo) };
        write(&renderer, "source.xml", &format!("{text}<!-- {subject} -->\n"));
        commit(&renderer, subject);
        if subject == "first" {
            std::fs::copy(renderer.join("source.xml"), renderer.join("built.xml")).unwrap();
            let output = regress(&["update", "--reason", "a test"]);
            assert!(output.status.success(), "{}", text_of(&output));
        }
    }
    let before = state(&renderer);
    let repository = renderer.display().to_string();
    let build = "grep -q sensor source.xml && cp source.xml built.xml";
    let words = ["bisect", "a", "--good", "HEAD~4", "--repository", &repository, "--build", build];
    let output = regress(&words);
    assert_eq!(output.status.code(), Some(2), "{}", text_of(&output));
    let out = text(&output.stdout);
    let subjects =
        ["first\n", "broken\n", "third\n", "fourth\n", "fifth\n"].map(|subject| out.contains(subject));
    assert_eq!(subjects, [false, true, true, false, false], "{}", text_of(&output));
    assert!(
        text(&output.stderr).contains("skipped: the build ended with exit code 1"),
        "{}",
        text_of(&output)
    );
    assert_eq!(state(&renderer), before);
}

fn text_of(output: &std::process::Output) -> String {
    format!("{}{}", text(&output.stdout), text(&output.stderr))
}

#[test]
fn ctrl_c_ends_a_build_and_leaves_nothing() {
    let place = five_commits("bisect_interrupted");
    let before = state(&place);
    let begun = folder("bisect_interrupted_build").join("begun");
    let build = format!("touch '{}'; sleep 600", begun.display());
    let mut command = command(&place, &["bisect", "a", "--good", "HEAD~4", "--build", &build]);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    wait_for(&mut child, &begun);
    assert_ne!(state(&place)[2], before[2], "the build runs in a worktree");
    let start = Instant::now();
    let sent = Command::new("kill").args(["-s", "INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("interrupted"), "{}", text(&output.stderr));
    assert!(start.elapsed() < Duration::from_secs(60));
    assert_eq!(state(&place), before);
}
