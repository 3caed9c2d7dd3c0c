//! The two pictures, and what must not be written over them.

use std::path::Path;

use miette::{IntoDiagnostic, Report, Result};

use super::figures::Pair;
use crate::app::args::CompareArgs;
use crate::app::report::is_special;
use crate::client::Settings;
use crate::client::develop;
use crate::image::ImageError;
use crate::image::compare::Picture;
use crate::image::write::{check_place, check_target, destination};

/// Checks, before anything is read, that map and figures can be written, and over neither picture nor each other.
///
/// # Errors
///
/// What is wrong with a place.
pub fn check_places(args: &CompareArgs) -> Result<()> {
    if let Some(map) = &args.map {
        check_target(map).into_diagnostic()?;
    }
    let json = args.json.as_deref().filter(|path| !is_special(path));
    if let Some(json) = json {
        check_place(json).into_diagnostic()?;
    }
    let same = |a: &Path, b: &Path| matches!((destination(a), destination(b)), (Ok(a), Ok(b)) if a == b);
    let written = [("--map", args.map.as_deref()), ("--json", json)];
    for (option, path) in written.iter().filter_map(|(option, path)| Some((option, (*path)?))) {
        for (input, what) in [(&args.picture, "picture"), (&args.reference, "reference")] {
            if same(path, input) {
                return Err(miette::miette!(
                    "{option} {} would overwrite the {what}: give another name",
                    path.display()
                ));
            }
        }
    }
    match (&args.map, json) {
        (Some(map), Some(json)) if same(map, json) => {
            Err(miette::miette!("--map and --json name the same file {}: give two names", map.display()))
        }
        _ => Ok(()),
    }
}

/// Reads both pictures and shows them through the tone curve.
///
/// # Errors
///
/// The first file that cannot be read, or that the two differ in size.
pub fn read(args: &CompareArgs) -> Result<Pair> {
    let [of_picture, of_reference] = match &args.layers[..] {
        [] => [None, None],
        [both] => [Some(both.as_str()); 2],
        [picture, reference] => [Some(picture.as_str()), Some(reference.as_str())],
        _ => return Err(miette::miette!("--layer takes one name for both files, or one for each")),
    };
    let read = |path: &Path, layer| Picture::read(path, layer).map_err(advise);
    let picture = read(&args.picture, of_picture)?;
    let reference = read(&args.reference, of_reference)?;
    let size = |p: &Picture| (p.rgb.width(), p.rgb.height());
    let (a, b) = (size(&picture), size(&reference));
    if a != b {
        return Err(miette::miette!(
            help = "render or cut both to the same size",
            "{} has {}×{} pixels and {} has {}×{}: they cannot be compared",
            args.picture.display(),
            a.0,
            a.1,
            args.reference.display(),
            b.0,
            b.1
        ));
    }
    let settings = Settings { exposure: args.exposure, ..Settings::default() };
    let displayed = [&picture, &reference].map(|p| develop::shown(&p.rgb, &settings));
    Ok(Pair { picture, reference, displayed })
}

/// An error of reading with what to do about it, where its own words do not say.
fn advise(error: ImageError) -> Report {
    let help = match &error {
        ImageError::Read { .. } => "check the path: the picture comes first, then the reference",
        ImageError::Layer { .. } => {
            "`--layer NAME` chooses one for both files, `--layer NAME,NAME` one for each"
        }
        _ => return Report::msg(error),
    };
    miette::miette!(help = help, "{error}")
}
