//! A temporary worktree of a repository, and what `git` does in it.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use tempfile::TempDir;

use crate::render::process::tell;

/// Variables by which a surrounding `git` (a hook, for example) names another repository.
const SURROUNDING: [&str; 5] =
    ["GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE", "GIT_COMMON_DIR", "GIT_OBJECT_DIRECTORY"];

/// One commit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BisectCommit {
    /// Its full hash.
    pub hash: String,
    /// The first line of its message.
    pub subject: String,
}

impl BisectCommit {
    /// The beginning of its hash and its subject.
    pub fn name(&self) -> String {
        format!("{} {}", self.hash.get(..10).unwrap_or(&self.hash), self.subject)
    }
}

/// What `git bisect` says after a revision is judged.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum BisectAnswer {
    /// This one is to be judged next.
    Next(String),
    /// This is the first bad one.
    First(String),
    /// One of these is, which could not be judged.
    OneOf(Vec<String>),
}

/// A worktree in a temporary folder, which goes away with this value. Nothing is checked out in the repository's own.
pub(super) struct GitTree {
    /// Top level of the user's checkout.
    pub repository: PathBuf,
    /// Top level of the worktree.
    pub path: PathBuf,
    /// Holds the worktree, and has room for other files.
    pub place: TempDir,
}

/// Top level of the checkout that holds a folder.
pub(super) fn top_level(folder: &Path) -> Result<PathBuf, String> {
    let top = git(folder, &["rev-parse", "--show-toplevel"]);
    let top = top.map_err(|reason| format!("{} is in no checkout of git: {reason}", folder.display()))?;
    Path::new(&top).canonicalize().map_err(|error| format!("cannot open {top}: {error}"))
}

/// The commit of a revision.
pub(super) fn commit(repository: &Path, revision: &str) -> Result<BisectCommit, String> {
    let unknown = || format!("{revision} is no revision of {}", repository.display());
    // It would be taken for an option.
    if revision.starts_with('-') || revision.is_empty() {
        return Err(unknown());
    }
    let name = format!("{revision}^{{commit}}");
    let hash = git(repository, &["rev-parse", "--verify", "--quiet", &name]).map_err(|_| unknown())?;
    let subject = git(repository, &["log", "-1", "--format=%s", &hash])?;
    Ok(BisectCommit { hash, subject })
}

impl GitTree {
    /// Makes a worktree of this revision.
    pub fn new(repository: PathBuf, hash: &str) -> Result<Self, String> {
        let place = tempfile::Builder::new().prefix("pointillist-bisect-").tempdir();
        let place = place.map_err(|error| format!("cannot make a temporary folder: {error}"))?;
        let real = place.path().canonicalize().map_err(|error| error.to_string())?;
        let tree = Self { repository, path: real.join("pointillist-bisect"), place };
        let path = tree.path.display().to_string();
        git(&tree.repository, &["worktree", "add", "--quiet", "--detach", &path, hash])?;
        Ok(tree)
    }

    /// Checks out a revision. What a build has changed of the files of the repository is lost, and what it has made stays.
    pub fn check_out(&self, hash: &str) -> Result<(), String> {
        git(&self.path, &["checkout", "--quiet", "--force", "--detach", hash]).map(|_| ())
    }

    /// Runs `git bisect`, without checking anything out.
    pub fn bisect(&self, words: &[&str]) -> Result<BisectAnswer, String> {
        let (is_fine, out, errors) = run_git(&self.path, &[&["bisect"], words].concat())?;
        let is_hash = |word: &str| word.len() >= 40 && word.chars().all(|c| c.is_ascii_hexdigit());
        let first = out.lines().find_map(|line| {
            let (hash, _) = line.split_once(" is the first ")?;
            is_hash(hash).then(|| hash.to_owned())
        });
        if let Some(first) = first {
            return Ok(BisectAnswer::First(first));
        }
        if out.lines().any(|line| line == "We cannot bisect more!") {
            let hashes = out.lines().filter(|line| is_hash(line)).map(String::from);
            return Ok(BisectAnswer::OneOf(hashes.collect()));
        }
        match is_fine {
            true => git(&self.path, &["rev-parse", "--verify", "BISECT_HEAD"]).map(BisectAnswer::Next),
            false => Err(format!("git bisect {} failed: {}", words.join(" "), gist(&errors, &out))),
        }
    }
}

impl Drop for GitTree {
    fn drop(&mut self) {
        let path = self.path.display().to_string();
        if self.path.exists()
            && let Err(reason) = git(&self.repository, &["worktree", "remove", "--force", "--force", &path])
        {
            tell(&format!("{reason}; `git worktree prune` removes what is left of it in the repository"));
        }
    }
}

/// Runs `git`; its standard output without spaces around it.
fn git(folder: &Path, words: &[&str]) -> Result<String, String> {
    match run_git(folder, words)? {
        (true, out, _) => Ok(out.trim().to_owned()),
        (false, out, errors) => Err(format!("git {} failed: {}", words.join(" "), gist(&errors, &out))),
    }
}

/// Runs `git` in a process group of its own, so that Ctrl-C does not end it halfway, and without the hooks of the repository. Returns whether it
/// succeeded, with standard output and error.
fn run_git(folder: &Path, words: &[&str]) -> Result<(bool, String, String), String> {
    let mut command = Command::new("git");
    command.arg("-C").arg(folder);
    command.args(["-c", "core.hooksPath=/dev/null", "-c", "advice.detachedHead=false"]).args(words);
    command.env("LC_ALL", "C").stdin(Stdio::null());
    SURROUNDING.iter().for_each(|name| {
        command.env_remove(name);
    });
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let output = command.output().map_err(|error| format!("cannot start git: {error}"))?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Ok((output.status.success(), text(&output.stdout), text(&output.stderr)))
}

/// The first line of what `git` says of a failure.
fn gist(errors: &str, out: &str) -> String {
    let mut lines = errors.lines().chain(out.lines()).map(str::trim).filter(|line| !line.is_empty());
    lines.next().unwrap_or("it gave no reason").to_owned()
}
