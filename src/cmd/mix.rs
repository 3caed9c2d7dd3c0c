//! `pointillist mix`: weighted sum of the light-group pictures in an EXR file, without rendering again.

use std::path::Path;

use glam::{DVec3, Vec3};
use miette::{IntoDiagnostic, Result, WrapErr};

use crate::client::Settings;
use crate::client::reference::ReferenceFilm;
use crate::cmd::args::MixArgs;
use crate::color::profile::xyz_from_rec709;
use crate::image::bitmap::Bitmap;
use crate::image::exr::Layers;
use crate::image::mix::{MixExample, MixFreedom, MixRgb, examples_of, factors_like, mix as mixed};
use crate::image::png::{PngPicture, Transfer};
use crate::image::write::{FileFormat, check_target, same_file};
use crate::image::{Attribute, Grid, exr, layer, png};
use crate::render::figures::print;
use crate::render::process::tell;
use crate::render::run_spec::LIGHT_GROUPS;
use crate::render::run_spec::mix_option;
use crate::scene::light_groups;
use crate::scene::limits;

/// Runs the subcommand.
///
/// # Errors
///
/// For a file that cannot be read or has no light groups, an unknown group, an example of another size, and outputs that cannot be written.
pub fn mix(args: &MixArgs) -> Result<()> {
    check(args)?;
    let layers = read(&args.picture)?;
    let groups = groups_of(&args.picture, &layers)?;
    let set = set_factors(args, &groups)?;
    let pictures: Vec<&[MixRgb]> = groups.iter().map(|(_, pixels)| pixels.as_slice()).collect();
    let factors = match &args.like {
        Some(like) => find_factors(args, like, &layers, &pictures, &set)?,
        None => set.iter().map(|factors| factors.unwrap_or([1.0; 3])).collect(),
    };
    let told: Vec<String> =
        groups.iter().zip(&factors).map(|((name, _), rgb)| mix_option(name, *rgb)).collect();
    print(&(told.join(" ") + "\n"), "the factors");
    let picture = mixed(&pictures, &factors);
    let mut written = Ok(());
    for path in &args.outputs {
        let one = match check_target(path).into_diagnostic()? {
            FileFormat::Png => write_png(path, &picture, &layers, args.exposure, &told),
            FileFormat::Exr => write_exr(path, &picture, &layers, &groups, &factors, &told),
        };
        written = written.and(one);
    }
    written.wrap_err("the mix could not be saved")
}

/// Reads the picture; of several views the default one, with a note.
fn read(path: &Path) -> Result<Layers> {
    let layers = exr::read(path).into_diagnostic()?;
    let [default, _, ..] = &layers.views[..] else { return Ok(layers) };
    let views = layers.views.join(", ");
    tell(&format!("note: {} has the views {views}: only {default} is mixed", path.display()));
    Ok(layers.view(default).unwrap_or_default())
}

/// Checks, before anything is read, that the outputs can be written and are not inputs.
fn check(args: &MixArgs) -> Result<()> {
    for path in &args.outputs {
        check_target(path).into_diagnostic()?;
        if let Some(input) = [Some(&args.picture), args.like.as_ref()]
            .into_iter()
            .flatten()
            .find(|input| same_file(input, path))
        {
            return Err(miette::miette!("-o would overwrite {}: give another name", input.display()));
        }
    }
    match args.outputs.is_empty() && args.like.is_none() {
        true => Err(miette::miette!(
            help = "-o FILE.png or -o FILE.exr writes the mix, --like FILE finds factors",
            "there is nothing to do"
        )),
        false => Ok(()),
    }
}

/// Light groups of a picture file: names, and linear colours per pixel.
fn groups_of(path: &Path, layers: &Layers) -> Result<Vec<(String, Vec<MixRgb>)>> {
    let Some(Attribute::Text(text)) = layers.attribute(LIGHT_GROUPS) else {
        return Err(miette::miette!(
            help = "`pointillist render SCENE --light-groups -o FILE.exr` makes such a file",
            "{} has no pictures of groups of lights",
            path.display()
        ));
    };
    let groups = light_groups::parse(text).map_err(|why| miette::miette!("{}: {why}", path.display()))?;
    let picture = |group: light_groups::NamedGroup| match layer::named(layers, &group.name) {
        Some(layer) => Ok((group.name, layer.pixels())),
        None => Err(miette::miette!(
            "{} has lost the layer `{}` of a group of lights",
            path.display(),
            group.name
        )),
    };
    groups.into_iter().map(picture).collect()
}

/// Factors set on the command line, by group.
fn set_factors(args: &MixArgs, groups: &[(String, Vec<MixRgb>)]) -> Result<Vec<Option<MixRgb>>> {
    let mut factors = vec![None; groups.len()];
    for (name, rgb) in &args.set {
        let Some(at) = groups.iter().position(|(group, _)| group == name) else {
            let known: Vec<&str> = groups.iter().map(|(group, _)| group.as_str()).collect();
            return Err(miette::miette!(
                help = light_groups::known(name, &known),
                "--set {name}: {} has no such group of lights",
                args.picture.display()
            ));
        };
        if factors[at].replace(*rgb).is_some() {
            return Err(miette::miette!("--set {name} is given twice: give one factor for each group"));
        }
    }
    Ok(factors)
}

/// Fits the factors to an example picture; factors set on the command line are fixed.
fn find_factors(
    args: &MixArgs,
    like: &Path,
    layers: &Layers,
    pictures: &[&[MixRgb]],
    set: &[Option<MixRgb>],
) -> Result<Vec<MixRgb>> {
    let example = read_example(like)?;
    if (example.width(), example.height()) != (layers.width, layers.height) {
        return Err(miette::miette!(
            help = "scale one of them: pixels are compared with pixels",
            "--like {} has {}×{} pixels, and the picture {}×{}",
            like.display(),
            example.width(),
            example.height(),
            layers.width,
            layers.height
        ));
    }
    // Integer formats clip at 1; values above 1 in float formats are valid.
    let clips = !like.extension().is_some_and(|e| {
        e.eq_ignore_ascii_case("exr") || e.eq_ignore_ascii_case("hdr") || e.eq_ignore_ascii_case("pfm")
    });
    let examples = examples_of(example.pixels(), |rgb| !(clips && rgb.iter().any(|c| *c >= 1.0)));
    let off: Vec<MixRgb> = set.iter().map(|factors| factors.unwrap_or_default()).collect();
    let fixed = mixed(pictures, &off);
    let rest = |example: MixExample| {
        let fixed = fixed[example.pixel];
        MixExample { color: [0, 1, 2].map(|c| example.color[c] - fixed[c]), ..example }
    };
    let open: Vec<&[MixRgb]> =
        pictures.iter().zip(set).filter(|(_, set)| set.is_none()).map(|(picture, _)| *picture).collect();
    let freedom = if args.keep_colors { MixFreedom::Intensity } else { MixFreedom::Color };
    let mut found = factors_like(&open, examples.into_iter().map(rest), freedom).into_iter();
    Ok(set.iter().map(|set| set.or_else(|| found.next()).unwrap_or([1.0; 3])).collect())
}

/// Reads a picture as linear colours.
fn read_example(path: &Path) -> Result<Grid<MixRgb>> {
    let most = usize::try_from(limits::FILM_PIXELS).unwrap_or(usize::MAX);
    Ok(Bitmap::read(path, false, most).into_diagnostic()?.into_linear())
}

fn attributes(layers: &Layers, told: &[String]) -> Vec<(String, Attribute)> {
    let kept = layers.attributes.iter().filter(|(name, _)| name != "mix").cloned();
    kept.chain([("mix".to_owned(), Attribute::Text(told.join(" ")))]).collect()
}

fn write_png(path: &Path, picture: &[MixRgb], layers: &Layers, exposure: f32, told: &[String]) -> Result<()> {
    let to_xyz = xyz_from_rec709();
    let xyz = |rgb: &MixRgb| (to_xyz * DVec3::from(rgb.map(f64::from))).as_vec3().max(Vec3::ZERO);
    let grid = Grid::from_rows(layers.width, layers.height, picture.iter().map(xyz).collect());
    let grid = grid.ok_or_else(|| miette::miette!("the picture is incomplete"))?;
    let settings = Settings { exposure, ..Settings::default() };
    let shown = ReferenceFilm::show(&grid, &settings).into_diagnostic()?;
    let shown = PngPicture {
        width: shown.width,
        height: shown.height,
        rgb: &shown.rgb,
        transfer: Transfer::of(&settings.profile, settings.gamma),
        primaries: settings.profile.primaries,
    };
    let text = |(_, value): &(String, Attribute)| matches!(value, Attribute::Text(_));
    let attributes: Vec<_> = attributes(layers, told).into_iter().filter(text).collect();
    png::write(path, shown, &attributes).into_diagnostic()
}

/// Writes the mix, and the groups multiplied by their factors.
fn write_exr(
    path: &Path,
    picture: &[MixRgb],
    layers: &Layers,
    groups: &[(String, Vec<MixRgb>)],
    factors: &[MixRgb],
    told: &[String],
) -> Result<()> {
    let (width, height) = (layers.width, layers.height);
    let mut mix = Layers { width, height, attributes: attributes(layers, told), ..Layers::default() };
    for (c, axis) in ["R", "G", "B"].into_iter().enumerate() {
        mix.push(axis, picture.iter().map(|pixel| pixel[c]));
        for ((name, pixels), factors) in groups.iter().zip(factors) {
            mix.push(&format!("{name}.{axis}"), pixels.iter().map(|pixel| pixel[c] * factors[c]));
        }
    }
    exr::write(path, &mix).into_diagnostic()
}
