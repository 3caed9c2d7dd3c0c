//! `pointillist info`: describes a state or a picture file.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use miette::{IntoDiagnostic, Result, WrapErr};

use crate::cmd::args::InfoArgs;
use crate::image::png::PngDescription;
use crate::image::write::FileFormat;
use crate::image::{Attribute, exr, png};
use crate::render::figures::{human, print};
use crate::render::state::file::MAGIC;
use crate::render::state::{StateFile, StateHeader};

/// Runs the subcommand.
///
/// # Errors
///
/// For the first file that cannot be read or is not of a kind that the program writes.
pub fn info(args: &InfoArgs) -> Result<()> {
    for path in &args.files {
        print(&format!("{}\n{}", path.display(), describe(path)?), "the description");
    }
    Ok(())
}

/// Describes a file.
fn describe(path: &Path) -> Result<String> {
    let mut start = [0; MAGIC.len()];
    let read = File::open(path).and_then(|mut file| file.read(&mut start));
    read.into_diagnostic().wrap_err_with(|| format!("cannot read {}", path.display()))?;
    if start == MAGIC {
        return Ok(state(&StateFile::open(path)?.about));
    }
    let unknown = || miette::miette!("{} is neither a state nor a picture in EXR or PNG", path.display());
    match FileFormat::of(path).map_err(|_| unknown())? {
        FileFormat::Exr => {
            let layers = exr::read(path).into_diagnostic()?;
            let names: Vec<&str> = layers.channels.iter().map(|(name, _)| name.as_str()).collect();
            let mut text = lines(&[("size", format!("{}×{}", layers.width, layers.height))]);
            if !layers.views.is_empty() {
                text += &lines(&[("views", layers.views.join(" "))]);
            }
            text += &lines(&[("channels", names.join(" "))]);
            Ok(text + &attributes(&layers.attributes))
        }
        FileFormat::Png => {
            let PngDescription { size, attributes: texts } = png::describe(path).into_diagnostic()?;
            Ok(lines(&[("size", format!("{}×{}", size[0], size[1]))]) + &attributes(&texts))
        }
    }
}

/// Describes a state.
fn state(about: &StateHeader) -> String {
    let run = &about.run;
    let until = match (about.goal.indices.end, about.goal.time, about.goal.error) {
        (_, Some(time), _) => format!("{} s of rendering", time.as_secs_f64()),
        (_, None, Some(target)) => format!("an error of {} in {}", target.error, target.at.share()),
        (end, None, None) => format!("index {end}"),
    };
    let mut text = lines(&[
        ("written by", about.program.clone()),
        ("scene", run.scene.display().to_string()),
        ("hash of its files", about.identity.scene.clone()),
        ("hash of samples", about.identity.samples.clone()),
        ("size", format!("{}×{}", run.film.width, run.film.height)),
        ("method", run.integrator.name().to_string()),
        ("seed", run.seed.to_string()),
        ("randomisations", if run.replicated { "2" } else { "1" }.to_string()),
    ]);
    if let Some(rig) = &run.stereo {
        text += &lines(&[("eyes", rig.to_string())]);
    }
    if let Some(share) = about.share {
        text += &lines(&[("part", share.to_string())]);
    }
    text += &lines(&[
        ("until", until),
        ("indices", about.indices.to_string()),
        ("complete", if about.is_complete() { "yes" } else { "no" }.to_string()),
        ("paths", human(about.counts.paths() as f64)),
        ("samples per pixel", format!("{:.2}", about.samples_per_pixel())),
        ("rendering time", format!("{:.1} s", about.seconds)),
        ("rejected values", about.rejections.total().to_string()),
    ]);
    if let Some(last) = about.progress.checkpoints.last() {
        text += &lines(&[("error at the last checkpoint", format!("{:.2} %", 100.0 * last.error))]);
    }
    text + &lines(&[("command", run.command(about.picture.start, about.counts.paths()))])
}

fn attributes(attributes: &[(String, Attribute)]) -> String {
    attributes.iter().map(|(name, value)| lines(&[(name, value.to_string())])).collect()
}

fn lines(pairs: &[(&str, String)]) -> String {
    pairs.iter().map(|(name, value)| format!("  {name}: {value}\n")).collect()
}
