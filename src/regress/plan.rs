//! What a regression run renders and compares, as plain data.

use std::path::PathBuf;
use std::time::Duration;

/// All cases of a folder.
#[derive(Clone, Debug)]
pub struct RegressPlan {
    /// The folder that was named; names of files in messages and reports are relative to it.
    pub folder: PathBuf,
    /// Folder of the stored references, `NAME.exr` each.
    pub references: PathBuf,
    /// In the order of the manifest; names are unique.
    pub cases: Vec<RegressCase>,
    /// Probability that a run without any change reports one.
    pub false_alarm: f64,
}

/// A scene rendered by one method on one device.
#[derive(Clone, Debug)]
pub struct RegressCase {
    /// Unique in the run, and the name of its files: letters, digits, `_`, `-`, `.`, `+`.
    pub name: String,
    /// The scene file.
    pub scene: PathBuf,
    /// Renders it.
    pub renderer: CaseRenderer,
    /// Size in pixels; `None` for the scene's.
    pub size: Option<[u32; 2]>,
    /// How much is rendered.
    pub budget: CaseBudget,
    /// What counts as a difference.
    pub tolerance: CaseTolerance,
    /// What it is compared with.
    pub reference: ReferenceSource,
}

/// A program that renders a scene to an EXR file.
#[derive(Clone, Debug, PartialEq)]
pub enum CaseRenderer {
    /// This program's `render`, with these options besides scene, size, samples, seed and output.
    Pointillist {
        /// Value of `--integrator`; `None` for the scene's method.
        method: Option<String>,
        /// Value of `--device`; `None` for the best device.
        device: Option<String>,
        /// Further options of `render`.
        options: Vec<String>,
    },
    /// Any program: words of its command line, in which `{scene}`, `{output}`, `{seed}`, `{spp}`, `{width}` and `{height}` are replaced.
    Command {
        /// Name in the manifest.
        name: String,
        /// The program and its arguments.
        words: Vec<String>,
    },
}

/// How much is rendered for a case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CaseBudget {
    /// Samples per pixel of one rendering.
    pub spp: u64,
    /// Renderings with different seeds at first.
    pub seeds: u32,
    /// Most renderings where the answer is undecided.
    pub most_seeds: u32,
    /// Renderings of a reference that `update` makes.
    pub reference_seeds: u32,
    /// Render more, up to `most_seeds`, until a relative change of brightness of this size would have been found.
    pub detect: Option<f64>,
    /// The case is broken if one rendering takes longer.
    pub timeout: Duration,
}

/// What counts as a difference.
#[derive(Clone, Debug, PartialEq)]
pub struct CaseTolerance {
    /// Name of the class, for reports.
    pub class: String,
    /// The sums must be the same, bit for bit.
    pub same_bits: bool,
    /// Relative difference of a value that counts as none, for programs with other tables: 0.001 for 0.1 %.
    pub relative: f64,
}

/// What a case is compared with.
#[derive(Clone, Debug, PartialEq)]
pub enum ReferenceSource {
    /// The stored reference of the case's name, or of another case's (a second device compared with the first).
    Stored(String),
    /// A picture of any program: EXR, with or without variances.
    Picture(PathBuf),
    /// Another program, rendered in the same run with its own samples per pixel.
    Rendered {
        /// The program.
        renderer: CaseRenderer,
        /// Samples per pixel of one of its renderings.
        spp: u64,
    },
}
