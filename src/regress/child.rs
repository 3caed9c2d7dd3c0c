//! A rendering as a child process: its log, its time limit, its end.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Shortest and longest wait between two looks at whether a child has ended.
const WAITS: [Duration; 2] = [Duration::from_micros(200), Duration::from_millis(20)];

/// In between, this part of the time since its start, so that its time is known as precisely.
const PART: u32 = 200;

/// Bytes at the end of a log from which its gist is taken.
const TAIL: u64 = 8192;

/// Longest gist of a log, in characters.
const LONGEST_GIST: usize = 400;

/// Runs a program in `folder` and waits for its end; standard output and standard error are appended to `log`, after the command.
///
/// The program and its children are a process group, so that Ctrl-C does not reach them; they are killed after `timeout`.
///
/// # Errors
/// A sentence that says how it failed, with the gist of what it wrote.
pub fn run_child(words: &[String], folder: &Path, log: &Path, timeout: Duration) -> Result<(), String> {
    run_child_unless(words, folder, log, timeout, &|| false)
}

/// As [`run_child`]; the program and its children are also killed once `is_unwanted`.
///
/// # Errors
/// Those of [`run_child`].
pub fn run_child_unless(
    words: &[String],
    folder: &Path,
    log: &Path,
    timeout: Duration,
    is_unwanted: &dyn Fn() -> bool,
) -> Result<(), String> {
    let [program, arguments @ ..] = words else { return Err("its command is empty".into()) };
    let cannot = |error: std::io::Error| format!("cannot write {}: {error}", log.display());
    let mut file = OpenOptions::new().create(true).append(true).open(log).map_err(cannot)?;
    writeln!(file, "$ {}", words.join(" ")).map_err(cannot)?;
    let begin = file.seek(SeekFrom::End(0)).map_err(cannot)?;
    let copy = || file.try_clone().map_err(cannot);
    let mut command = Command::new(program);
    command.args(arguments).current_dir(folder).env("NO_COLOR", "1");
    command.stdin(Stdio::null()).stdout(copy()?).stderr(copy()?);
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let start = Instant::now();
    let mut child = command.spawn().map_err(|error| format!("cannot start {program}: {error}"))?;
    loop {
        match child.try_wait() {
            Ok(Some(status)) if status.success() => return Ok(()),
            Ok(Some(status)) => return Err(format!("{}: {}", ending(status), gist(&tail(log, begin)))),
            Ok(None) if start.elapsed() > timeout => {
                kill(&mut child);
                let limit = timeout.as_secs_f64();
                return Err(format!(
                    "took longer than {limit} s and was killed: {}",
                    gist(&tail(log, begin))
                ));
            }
            Ok(None) if is_unwanted() => {
                kill(&mut child);
                return Err("was interrupted".into());
            }
            Ok(None) => {}
            Err(error) => {
                kill(&mut child);
                return Err(format!("cannot wait for {program}: {error}"));
            }
        }
        std::thread::sleep((start.elapsed() / PART).clamp(WAITS[0], WAITS[1]));
    }
}

/// Kills a child and its own children.
fn kill(child: &mut Child) {
    // The child has not been waited for, so its number is still its own.
    #[cfg(unix)]
    let _ = rustix::process::kill_process_group(
        rustix::process::Pid::from_child(child),
        rustix::process::Signal::KILL,
    );
    let _ = child.kill();
    let _ = child.wait();
}

/// How a process ended, in words.
fn ending(status: ExitStatus) -> String {
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        let name = match signal {
            4 => " (SIGILL)",
            6 => " (SIGABRT)",
            7 => " (SIGBUS)",
            8 => " (SIGFPE)",
            9 => " (SIGKILL, as by the system when memory runs out)",
            11 => " (SIGSEGV)",
            15 => " (SIGTERM)",
            _ => "",
        };
        return format!("was ended by signal {signal}{name}");
    }
    match status.code() {
        Some(code) => format!("ended with exit code {code}"),
        None => "ended without an exit code".into(),
    }
}

/// The last bytes of a log, of what was written after `begin`.
fn tail(log: &Path, begin: u64) -> String {
    let read = || -> std::io::Result<Vec<u8>> {
        let mut file = File::open(log)?;
        let end = file.seek(SeekFrom::End(0))?;
        file.seek(SeekFrom::Start(begin.max(end.saturating_sub(TAIL))))?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    String::from_utf8_lossy(&read().unwrap_or_default()).into_owned()
}

/// The gist of what a program wrote: our own error with its place and advice, or the last lines of another program.
fn gist(text: &str) -> String {
    let is_excerpt = |line: &str| {
        let rest = line.trim_start_matches(|c: char| c.is_ascii_digit() || c == ' ');
        rest.starts_with(['│', '·']) && !line.starts_with('│')
    };
    let lines = text.lines().map(str::trim).filter(|line| !is_excerpt(line));
    let frame = |c: char| c == ' ' || "×╭╰├─│┬▶⚠".contains(c);
    let error = lines.clone().position(|line| line.starts_with('×'));
    let lines: Vec<&str> = lines
        .skip(error.unwrap_or(0))
        .map(|line| line.trim_matches(frame))
        .filter(|line| !line.is_empty())
        .collect();
    let chosen = match error {
        Some(_) => &lines[..lines.len().min(6)],
        None => &lines[lines.len().saturating_sub(3)..],
    };
    if chosen.is_empty() {
        return "it wrote no message".into();
    }
    let text = chosen.join(" ");
    let mut short: String = text.chars().filter(|c| !c.is_control()).take(LONGEST_GIST).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    short
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    fn shell(script: &str, timeout: f64) -> (Result<(), String>, String) {
        let folder = tempfile::tempdir().expect("a folder");
        let log = folder.path().join("log");
        let words = ["/bin/sh", "-c", script].map(String::from);
        let end = run_child(&words, folder.path(), &log, Duration::from_secs_f64(timeout));
        (end, std::fs::read_to_string(log).expect("a log"))
    }

    #[test]
    fn ends_are_told_with_the_last_words() {
        let (end, log) = shell("echo out; echo err >&2", 60.0);
        assert_eq!(end, Ok(()));
        assert!(
            log.starts_with("$ /bin/sh -c") && log.contains("\nout\n") && log.contains("\nerr\n"),
            "{log}"
        );
        assert_eq!(shell("echo why; exit 3", 60.0).0, Err("ended with exit code 3: why".into()));
        assert_eq!(
            shell("kill -SEGV $$", 60.0).0,
            Err("was ended by signal 11 (SIGSEGV): it wrote no message".into())
        );
        let folder = tempfile::tempdir().expect("a folder");
        let log = folder.path().join("log");
        let end = run_child(&["/none/such".to_owned()], folder.path(), &log, Duration::from_secs(1));
        assert!(end.is_err_and(|error| error.starts_with("cannot start /none/such")));
    }

    /// The child of the child would keep the test waiting and the file growing.
    #[test]
    fn a_child_that_hangs_is_killed_with_its_children() {
        let folder = tempfile::tempdir().expect("a folder");
        let late = folder.path().join("late");
        let script = format!("(sleep 1.5; touch '{}') & sleep 600", late.display());
        let start = Instant::now();
        let (end, _) = shell(&script, 0.2);
        assert!(end.is_err_and(|error| error.starts_with("took longer than 0.2 s")));
        assert!(start.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_secs(3));
        assert!(!late.exists());
    }

    #[test]
    fn our_own_errors_keep_place_and_advice() {
        let text = "a warning\n  × there is no shape `blob`\n   ╭─[scene.xml:7:3]\n 7 │   <shape type=\"blob\"/>\n   ·   ──┬──\n   ·     ╰── here\n   ╰────\n  help: did you mean `sphere`?\n";
        assert_eq!(gist(text), "there is no shape `blob` [scene.xml:7:3] help: did you mean `sphere`?");
        assert_eq!(gist("a\nb\nc\nd\n"), "b c d");
    }
}
