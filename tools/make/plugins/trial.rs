//! Documentation runs: finds by trial what a plugin cannot do without, and listens to what its reader asks for.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::Path;

use flate2::{Compression, write::ZlibEncoder};

use pointillist::scene::mitsuba::{Question, questions};
use pointillist::scene::{FindingKind, SceneError};

use super::PluginPlace;

/// The id of the plugin that is tried.
const ID: &str = "tried";

/// Most parameters that a plugin can require.
const MOST_REQUIRED: usize = 6;

/// Most parameters that are given only because the message changes, as that of two lists of different lengths does.
const MOST_BLIND: usize = 2;

/// A plugin to be tried, and the folder of [`samples`].
pub(super) struct DocumentationRun<'a> {
    pub(super) kind: &'static str,
    /// Where it can stand; each is tried.
    pub(super) places: &'a [PluginPlace],
    pub(super) name: &'static str,
    pub(super) folder: &'a Path,
}

/// What is known of a plugin.
pub(super) struct LearnedPlugin {
    pub(super) questions: Vec<Asked>,
    /// Parameters without which it cannot be read; true for a nested element.
    pub(super) required: Vec<(&'static str, bool)>,
    /// Why it could not be read.
    pub(super) problem: Option<String>,
}

/// A parameter, or the tag of what is nested, and what a reader wants to know of it.
type Asked = (&'static str, Question);

/// A parameter that is given, or a nested element, and its text.
#[derive(Clone)]
struct GivenParameter {
    name: &'static str,
    nested: bool,
    xml: String,
}

/// What came of one reading.
struct RunOutcome {
    questions: Vec<Asked>,
    problem: Option<SceneError>,
}

impl DocumentationRun<'_> {
    /// Tries the plugin with as little as possible, then with each of its other parameters.
    pub(super) fn learn(&self) -> LearnedPlugin {
        let mut best: Option<RunOutcome> = None;
        for place in self.places {
            let mut given = Vec::new();
            let outcome = self.solve(place, &mut given);
            if outcome.problem.is_none() {
                return self.explore(place, &given, outcome);
            }
            if best.as_ref().is_none_or(|best| best.questions.len() < outcome.questions.len()) {
                best = Some(outcome);
            }
        }
        let RunOutcome { questions, problem } =
            best.unwrap_or(RunOutcome { questions: Vec::new(), problem: None });
        LearnedPlugin { questions, required: Vec::new(), problem: problem.map(|e| e.to_string()) }
    }

    /// Adds to `given` until the plugin can be read: what its reader asked for last comes first. Something that helps lets the
    /// reader succeed, come to further questions or to another problem.
    fn solve(&self, place: &PluginPlace, given: &mut Vec<GivenParameter>) -> RunOutcome {
        let mut outcome = self.read(place, given);
        if outcome.problem.is_none() || given.len() >= MOST_REQUIRED {
            return outcome;
        }
        let known = parameters(&outcome.questions);
        for (name, question) in different(&outcome.questions).into_iter().rev() {
            for candidate in candidates(name, &question) {
                if given.iter().any(|g| g.name == candidate.name && g.nested == candidate.nested) {
                    continue;
                }
                given.push(candidate);
                let next = self.read(place, given);
                let other = given.len() <= MOST_BLIND && other_problem(&outcome, &next);
                if next.problem.is_none() || parameters(&next.questions).len() > known.len() || other {
                    let solved = self.solve(place, given);
                    if solved.problem.is_none() {
                        return solved;
                    }
                    outcome.questions.extend(solved.questions);
                }
                given.pop();
            }
        }
        outcome
    }

    /// What else is asked when one more parameter is given.
    fn explore(&self, place: &PluginPlace, given: &[GivenParameter], first: RunOutcome) -> LearnedPlugin {
        let fails_without = |i: usize| {
            let rest: Vec<GivenParameter> = [&given[..i], &given[i + 1..]].concat();
            self.read(place, &rest).problem.is_some()
        };
        let required = (0..given.len())
            .filter(|i| fails_without(*i))
            .map(|i| (given[i].name, given[i].nested))
            .collect();
        let mut questions = first.questions.clone();
        let mut refused = Vec::new();
        for (name, question) in different(&first.questions) {
            if given.iter().any(|g| g.name == name && g.nested == (question == Question::Nested)) {
                continue;
            }
            let tried = candidates(name, &question).into_iter().map(|candidate| {
                let outcome = self.read(place, &[given, &[candidate]].concat());
                questions.extend(outcome.questions);
                outcome.problem.is_some()
            });
            // Some readers ask for elements within the plugin only to refuse them.
            let all_fail = tried.fold(true, |all, fails| all & fails);
            if question == Question::Nested && all_fail {
                refused.push((name, question));
            }
        }
        questions.retain(|asked| !refused.contains(asked));
        LearnedPlugin { questions, required, problem: None }
    }

    /// Reads a scene with the plugin and these parameters.
    fn read(
        &self,
        PluginPlace { before, attributes, after }: &PluginPlace,
        given: &[GivenParameter],
    ) -> RunOutcome {
        let (kind, plugin) = (self.kind, self.name);
        let given: String = given.iter().map(|g| g.xml.as_str()).collect();
        let sensor = if kind == "sensor" { "" } else { "<sensor type='perspective'/>" };
        let text = format!(
            "<scene version='3.0.0'>{before}<{kind} type='{plugin}' id='{ID}' {attributes}>{given}</{kind}>{after}{sensor}</scene>"
        );
        let (questions, problem) = questions(&self.folder.join("scene.xml"), &text, ID);
        RunOutcome { questions, problem }
    }
}

/// True for a plugin that is refused for another reason, which is not that a parameter is written as it cannot be.
fn other_problem(before: &RunOutcome, now: &RunOutcome) -> bool {
    let text = |outcome: &RunOutcome| outcome.problem.as_ref().map(ToString::to_string);
    text(before) != text(now) && now.problem.as_ref().is_some_and(|e| e.kind() != FindingKind::Parameter)
}

/// The different parameters that were asked for.
fn parameters(questions: &[Asked]) -> BTreeSet<(&'static str, bool)> {
    questions.iter().map(|(name, question)| (*name, *question == Question::Nested)).collect()
}

/// Each question once, in the order in which they were asked first.
fn different(questions: &[Asked]) -> Vec<Asked> {
    let mut once = Vec::new();
    for asked in questions {
        if !once.contains(asked) {
            once.push(asked.clone());
        }
    }
    once
}

/// Values that a parameter may be given.
fn candidates(name: &'static str, question: &Question) -> Vec<GivenParameter> {
    let nested = *question == Question::Nested;
    let value = |tag: &str, value: &str| format!("<{tag} name='{name}' value='{value}'/>");
    let file = "<string name='filename' value='sample.png'/>";
    let textures = vec![
        format!("<texture name='{name}' type='checkerboard'/>"),
        format!("<texture name='{name}' type='bitmap'>{file}</texture>"),
    ];
    let texts = match question {
        Question::Nested => match name {
            "bsdf" => vec!["<bsdf type='diffuse'/>".to_owned(), "<bsdf type='diffuse'/>".repeat(2)],
            "shape" => vec![
                "<shape type='sphere'/>".to_owned(),
                "<shape type='shapegroup'><shape type='sphere'/></shape>".to_owned(),
            ],
            "texture" => vec![
                "<texture type='checkerboard'/>".to_owned(),
                format!("<texture type='bitmap'>{file}</texture>"),
            ],
            "integrator" => vec!["<integrator type='path'/>".to_owned()],
            "emitter" => vec!["<emitter type='area'/>".to_owned()],
            "sensor" => vec!["<sensor type='perspective'/>".to_owned()],
            "film" => vec!["<film type='hdrfilm'/>".to_owned()],
            "rfilter" => vec!["<rfilter type='box'/>".to_owned()],
            "sampler" => vec!["<sampler type='independent'/>".to_owned()],
            "volume" => vec!["<volume type='constvolume'/>".to_owned()],
            "medium" => vec!["<medium type='homogeneous'/>".to_owned()],
            "phase" => vec!["<phase type='hg'/>".to_owned(), "<phase type='hg'/>".repeat(2)],
            _ => Vec::new(),
        },
        Question::File(ending) => vec![value("string", &format!("sample.{ending}"))],
        Question::Value(tags) => match tags.first().copied().unwrap_or_default() {
            "float" => vec![value("float", "0.5"), value("float", "700")],
            "integer" => vec![value("integer", "1")],
            "boolean" => vec![value("boolean", "true")],
            "string" => vec![value("string", "1, 2"), value("string", "x"), value("string", "vertex_x")],
            "rgb" | "spectrum" => vec![value("rgb", "0.5")],
            "point" | "vector" => vec![value("point", "0, 0, 2")],
            "transform" => vec![format!("<transform name='{name}'/>")],
            "medium" => vec![format!("<medium name='{name}' type='homogeneous'/>")],
            "volume" => {
                let six = "<string name='value' value='1, 1, 1, 0, 0, 0'/>";
                vec![format!("<volume name='{name}' type='constvolume'>{six}</volume>")]
            }
            "texture" => [vec![value("rgb", "0.5")], textures].concat(),
            _ => Vec::new(),
        },
        // What is asked next tells more.
        Question::Given => [vec![value("float", "0.5")], textures].concat(),
        Question::Default(_) | Question::Idle => Vec::new(),
    };
    texts.into_iter().map(|xml| GivenParameter { name, nested, xml }).collect()
}

/// A folder with a small file of each ending that a reader may ask for.
pub(super) fn samples() -> std::io::Result<tempfile::TempDir> {
    let folder = tempfile::tempdir()?;
    let triangle = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].concat();
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
               element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    // Points of a curve with their radii.
    let curve = "0 0 0 0.1\n0 0 1 0.1\n0 1 2 0.1\n0 1 3 0.1\n";
    // Its head, then zlib of: single precision, no name, counts, positions, indices; then a dictionary of one mesh.
    let mut serialized = vec![0x1c, 0x04, 4, 0];
    let mut zlib = ZlibEncoder::new(&mut serialized, Compression::default());
    zlib.write_all(&[0x00, 0x10, 0, 0, 0])?;
    [3_u64, 1].iter().try_for_each(|n| zlib.write_all(&n.to_le_bytes()))?;
    triangle.iter().try_for_each(|v| zlib.write_all(&v.to_le_bytes()))?;
    [0_u32, 1, 2].iter().try_for_each(|i| zlib.write_all(&i.to_le_bytes()))?;
    zlib.finish()?;
    serialized.extend([0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0]);
    // A portable float map of 2 × 2 white pixels: pictures are told by what they begin with, whatever their ending.
    let white = 1.0_f32.to_le_bytes().repeat(2 * 2 * 3);
    let picture = [&b"PF\n2 2\n-1\n"[..], &white].concat();
    // A grid of 2 × 2 × 2 bytes of one channel, in the unit cube.
    let mut grid = b"VOL\x03".to_vec();
    grid.extend([3, 2, 2, 2, 1_i32].iter().flat_map(|n| n.to_le_bytes()));
    grid.extend([0.0, 0.0, 0.0, 1.0, 1.0, 1.0_f32].iter().flat_map(|v| v.to_le_bytes()));
    grid.extend([0, 255, 0, 255, 0, 255, 0, 255]);
    for (ending, bytes) in [
        ("vol", &grid[..]),
        ("obj", obj.as_bytes()),
        ("ply", ply.as_bytes()),
        ("serialized", &serialized),
        ("txt", curve.as_bytes()),
        ("exr", &picture),
        ("png", &picture),
    ] {
        std::fs::write(folder.path().join(format!("sample.{ending}")), bytes)?;
    }
    Ok(folder)
}
