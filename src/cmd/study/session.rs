//! A study while it is measured: its parts, its time, and what they share.

use std::time::Instant;

use clap::ValueEnum;

use crate::cmd::args::StudyArgs;
use crate::cmd::args::study::StudySection;
use crate::cmd::study::folder::StudyFolder;
use crate::cmd::study::judge::Judge;
use crate::cmd::study::renderer::StudyRenderer;
use crate::render::process::tell;
use crate::render::run_spec::{ChoiceReport, RunSpec};
use crate::scene::desc::IntegratorKind;
use crate::study::data::Study;
use crate::study::{analysis, pages};

/// Parts in order, with their fractions of the remaining budget, and a note on what is missing without them.
pub const PARTS: [(StudySection, f64, &str); 6] = [
    (StudySection::Methods, 0.65, "convergence, prices, pictures, predictions, stability: --knobs methods"),
    (StudySection::Effects, 0.5, "effects: --knobs effects"),
    (StudySection::Options, 0.6, "options: --knobs options"),
    (StudySection::Display, 0.6, "display: --knobs display"),
    (StudySection::Numeric, 0.2, "numeric choices: --knobs numeric"),
    (StudySection::Replicates, 1.0, "replicates: --knobs replicates"),
];

/// A study that is being measured.
pub struct StudySession {
    pub renderer: StudyRenderer,
    pub folder: StudyFolder,
    pub judge: Judge,
    /// Result of `--integrator auto`, with all methods it has tried.
    pub choice: ChoiceReport,
}

/// Time limit of a part of the study.
pub struct TimeBudget {
    pub start: Instant,
    pub seconds: f64,
    pub quiet: bool,
}

impl TimeBudget {
    /// Seconds left; negative once exceeded.
    pub fn left(&self) -> f64 {
        self.seconds - self.start.elapsed().as_secs_f64()
    }

    /// Reports to the user what is being measured.
    pub fn say(&self, text: &str) {
        if !self.quiet {
            tell(&format!("  {text}"));
        }
    }
}

/// Whether a part is requested.
pub fn wanted(args: &StudyArgs, knob: StudySection) -> bool {
    args.knobs.is_empty() || args.knobs.contains(&knob)
}

impl StudySession {
    /// A run by the method that is fastest so far, or else the one that `auto` chooses, for measuring effects, options and display.
    pub fn chosen(&self) -> RunSpec {
        let film = &self.renderer.run.film;
        let study = Study { size: [film.width, film.height], ..Study::default() };
        let study = analysis::study(study, &self.folder.measurements);
        let fastest = pages::fastest(&study);
        let fastest = fastest.and_then(|name: String| IntegratorKind::from_str(&name, false).ok());
        self.renderer.run(fastest.unwrap_or(self.choice.kind), 1)
    }

    /// The same by an unbiased method: bidirectional path tracing in place of methods with photons.
    pub fn unbiased(&self) -> RunSpec {
        let mut run = self.chosen();
        if run.integrator.has_photons() {
            run.integrator = IntegratorKind::Bidirectional;
        }
        run
    }
}
