//! Options of `pointillist regress`.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

use crate::regress::run::ShardOfCases;

/// Options of `pointillist regress`.
#[derive(Args, Debug)]
pub struct RegressArgs {
    /// What is done.
    #[command(subcommand)]
    pub command: RegressCommand,
}

/// What `pointillist regress` does.
#[derive(Subcommand, Debug)]
pub enum RegressCommand {
    /// Render all cases and judge each against its reference: same bits, equal within noise, changed, or broken.
    ///
    /// The exit code is 0 if nothing changed, 1 if something did, 2 if a case is broken or the run was interrupted. Each rendering is a process of
    /// its own: one that crashes, hangs or runs out of memory is one broken case. A run that was killed or interrupted goes on when it is called
    /// again.
    Run(RegressRunArgs),

    /// Render new references, after showing what changes by them.
    Update(RegressUpdateArgs),

    /// Join the results of shards into one report.
    Merge(RegressMergeArgs),

    /// Find the first commit that changed the picture of a case.
    ///
    /// `git bisect` runs in a temporary worktree: the checkout stays as it is. At each step the renderer is built, if there is a command for it, and
    /// the case is judged against its present reference, with the present manifest. Revisions that cannot be built or rendered are skipped.
    Bisect(RegressBisectArgs),

    /// List the cases, and what each is compared with.
    List(RegressListArgs),
}

/// The folder, and devices other than those of its manifest.
#[derive(Args, Clone, Debug)]
pub struct RegressFolder {
    /// Folder with a regress.toml; without one its *.xml and */scene.xml are the cases.
    pub dir: PathBuf,

    /// Render on this device instead of those of the manifest, see `render --device`.
    #[arg(long, value_name = "NAME|INDEX|cpu")]
    pub device: Option<String>,
}

/// Files of results.
#[derive(Args, Clone, Debug)]
pub struct RegressOutputs {
    /// Folder of the results: evidence, log and figures of each case, and the history of runs [default: DIR/results].
    #[arg(long, value_name = "FOLDER", help_heading = "Output")]
    pub results: Option<PathBuf>,

    /// Write the page with pictures here [default: index.html in the folder of the results].
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub html: Option<PathBuf>,

    /// Write JUnit XML, as continuous integration reads it.
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub junit: Option<PathBuf>,

    /// Write the report as JSON; `-` is standard output.
    #[arg(long, value_name = "FILE|-", help_heading = "Output")]
    pub json: Option<PathBuf>,

    /// Print annotations on what changed or is broken, in the words of this service.
    #[arg(long, value_name = "SERVICE", help_heading = "Output")]
    pub annotations: Option<AnnotationService>,
}

/// Whose annotations are printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AnnotationService {
    /// Workflow commands of GitHub Actions
    Github,
}

/// Options of `pointillist regress run`.
#[derive(Args, Debug)]
pub struct RegressRunArgs {
    /// What is rendered.
    #[command(flatten)]
    pub folder: RegressFolder,

    /// Only cases of this name, or with this word in their names; may be given several times.
    #[arg(long = "case", value_name = "WORD")]
    pub cases: Vec<String>,

    /// Only every N-th case, beginning with case K; `regress merge` joins the results of all N.
    #[arg(long, value_name = "K/N", value_parser = shard)]
    pub shard: Option<ShardOfCases>,

    /// Exit code 0 once the shard has come to its end, whatever the verdicts: that of `regress merge` tells. Called again before it is
    /// merged, the shard keeps what it has.
    #[arg(long, requires = "shard", conflicts_with = "fail_on_slower")]
    pub for_merge: bool,

    /// Begin anew although an earlier run was interrupted.
    #[arg(long)]
    pub fresh: bool,

    /// First seed [default: 1000, or above those of the reference]. Other seeds give an independent verdict: bits are then compared only where
    /// the class of tolerance asks for them.
    #[arg(long, value_name = "N")]
    pub seed_base: Option<u32>,

    /// Cases that are rendered at the same time. Each rendering uses all cores unless the manifest's `options` say otherwise.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: u16,

    /// Files of results.
    #[command(flatten)]
    pub outputs: RegressOutputs,

    /// After the pictures, compare times with those of another pointillist: both render each case by turns, and the ratios are judged.
    #[arg(long, value_name = "BINARY", help_heading = "Time")]
    pub time_against: Option<PathBuf>,

    /// Pairs of renderings at first.
    #[arg(long, value_name = "N", default_value_t = 5, requires = "time_against", help_heading = "Time")]
    #[arg(value_parser = clap::value_parser!(u32).range(2..=1000))]
    pub time_pairs: u32,

    /// Most pairs where intervals are wide; never fewer than --time-pairs.
    #[arg(long, value_name = "N", default_value_t = 20, requires = "time_against", help_heading = "Time")]
    #[arg(value_parser = clap::value_parser!(u32).range(2..=1000))]
    pub most_time_pairs: u32,

    /// Exit code 1 if some time of a case is certainly longer by more than this, and 2 if a case cannot be timed.
    #[arg(long, value_name = "PERCENT", requires = "time_against", help_heading = "Time", value_parser = percent)]
    pub fail_on_slower: Option<f64>,

    /// Show no progress bar.
    #[arg(long, short, help_heading = "Output")]
    pub quiet: bool,
}

/// Options of `pointillist regress update`.
#[derive(Args, Debug)]
pub struct RegressUpdateArgs {
    /// What is rendered.
    #[command(flatten)]
    pub folder: RegressFolder,

    /// Only cases of these names, or with these words in their names.
    #[arg(value_name = "CASE")]
    pub cases: Vec<String>,

    /// Why the references change: it is kept in their files.
    #[arg(long, value_name = "TEXT", required_unless_present = "dry_run", value_parser = clap::builder::NonEmptyStringValueParser::new())]
    pub reason: Option<String>,

    /// Only show what would change; nothing is written.
    #[arg(long)]
    pub dry_run: bool,

    /// Show no progress bar.
    #[arg(long, short)]
    pub quiet: bool,
}

/// Options of `pointillist regress merge`.
#[derive(Args, Debug)]
pub struct RegressMergeArgs {
    /// What was rendered.
    #[command(flatten)]
    pub folder: RegressFolder,

    /// The folders of results of all shards.
    #[arg(value_name = "RESULTS", required = true)]
    pub parts: Vec<PathBuf>,

    /// Only cases of this name, or with this word in their names, as in the runs of the shards; may be given several times.
    #[arg(long = "case", value_name = "WORD")]
    pub cases: Vec<String>,

    /// Exit code 1 if some time of a case is certainly longer by more than this, and 2 if a case has no times: of shards with --time-against.
    #[arg(long, value_name = "PERCENT", help_heading = "Time", value_parser = percent)]
    pub fail_on_slower: Option<f64>,

    /// Files of results.
    #[command(flatten)]
    pub outputs: RegressOutputs,
}

/// Options of `pointillist regress bisect`.
#[derive(Args, Debug)]
pub struct RegressBisectArgs {
    /// What is rendered.
    #[command(flatten)]
    pub folder: RegressFolder,

    /// The case: its name, or a word that only its name contains.
    pub case: String,

    /// A revision whose picture is that of the reference.
    #[arg(long, value_name = "REV")]
    pub good: String,

    /// A later revision whose picture has changed.
    #[arg(long, value_name = "REV", default_value = "HEAD")]
    pub bad: String,

    /// Shell command that builds the renderer, at the top level of the worktree.
    #[arg(long, value_name = "COMMAND", value_parser = clap::builder::NonEmptyStringValueParser::new())]
    pub build: Option<String>,

    /// Search the repository of this folder, that of the renderer for example [default: that of the scenes].
    #[arg(long, value_name = "DIR")]
    pub repository: Option<PathBuf>,

    /// Show no progress.
    #[arg(long, short)]
    pub quiet: bool,
}

/// Options of `pointillist regress list`.
#[derive(Args, Debug)]
pub struct RegressListArgs {
    /// What is listed.
    #[command(flatten)]
    pub folder: RegressFolder,
}

fn shard(text: &str) -> Result<ShardOfCases, &'static str> {
    let parse = || {
        let (number, of) = text.split_once('/')?;
        Some(ShardOfCases { number: number.parse().ok()?, of: of.parse().ok()? })
    };
    parse()
        .filter(|shard| (1..=shard.of).contains(&shard.number))
        .ok_or("expected K/N with K from 1 to N, such as 2/8")
}

fn percent(text: &str) -> Result<f64, &'static str> {
    let value = text.trim_end_matches('%').trim_end().parse::<f64>().ok();
    value.filter(|value| value.is_finite() && *value >= 0.0).ok_or("expected per cent, 0 or more, such as 5")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_counted_from_one() {
        assert_eq!(shard("2/8"), Ok(ShardOfCases { number: 2, of: 8 }));
        for wrong in ["0/8", "9/8", "1/0", "1", "a/b", "-1/2"] {
            assert!(shard(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn per_cent_is_a_number_from_zero_on() {
        assert_eq!([percent("5"), percent("2.5 %"), percent("0")], [Ok(5.0), Ok(2.5), Ok(0.0)]);
        for wrong in ["-1", "nan", "inf", "%", "five"] {
            assert!(percent(wrong).is_err(), "{wrong}");
        }
    }
}
