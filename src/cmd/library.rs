//! The subcommands `render` and `compare` for another program: options by the names of the command line, pictures in memory.

pub use crate::cmd::compare::{ComparedPictures, compare_layers};
pub use crate::render::batch::RenderedPicture;
pub use crate::render::watch::{RenderMoment, RenderWatcher};

use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use clap::Parser;
use glam::{DVec3, Vec3};
use miette::{IntoDiagnostic, Result};

use crate::client::reference::ReferenceFilm;
use crate::client::{DisplayImage, Settings};
use crate::cmd::{Cli, CliCommand, print_messages, run, tell};
use crate::color::profile::xyz_from_rec709;
use crate::image::exr::Layers;
use crate::image::png::{PngPicture, Transfer};
use crate::image::write::{FileFormat, atomically};
use crate::image::{Attribute, Grid, exr, layer, png};
use crate::render::batch::render_in_memory;
use crate::render::options::RenderOptions;
use crate::scene::Loaded;

/// Sets up a process that will call the functions of this module, before it has many threads: messages go to standard error, and the allocator of
/// the GNU C library keeps little free memory, as in the program.
pub fn prepare_process() {
    crate::memory::limit_free_memory();
    print_messages();
}

/// A render in memory: a scene and what is asked for.
#[derive(Clone, Debug)]
pub struct PlannedRender(Box<RenderOptions>);

impl PlannedRender {
    /// A render of `loaded`, which messages call `name`, with options as `pointillist render` has them, such as `--spp` and `16`.
    ///
    /// # Errors
    ///
    /// A sentence for an unknown option or value, and for the options that are about files.
    pub fn new(name: &str, loaded: Arc<Loaded>, words: &[String]) -> Result<Self> {
        let before = ["pointillist", "render", "--quiet"].map(str::to_owned);
        let behind = ["--", name].map(str::to_owned);
        let all = before.iter().chain(words).chain(&behind);
        let command = Cli::try_parse_from(all).map_err(|error| plain(&error))?.command;
        let CliCommand::Render(args) = command else {
            return Err(miette::miette!("these are not the options of a render: {}", words.join(" ")));
        };
        let mut options = RenderOptions::from(*args);
        let source = &options.source;
        let refused = [
            (!options.outputs.is_empty(), "output", "save the picture that is returned"),
            (options.json.is_some(), "json", "the report is part of the picture that is returned"),
            (options.state.is_some() || options.resume, "state", "use the command line to keep a state"),
            (!source.defines.is_empty(), "D", "give the values where the scene is loaded"),
            (source.lenient, "lenient", "say so where the scene is loaded"),
        ];
        if let Some((_, option, advice)) = refused.into_iter().find(|(given, ..)| *given) {
            return Err(miette::miette!(
                help = advice,
                "a render in memory does not take the option `{option}`"
            ));
        }
        options.source.loaded = Some(loaded);
        Ok(Self(Box::new(options)))
    }

    /// Renders; `watcher` is called at least every 20 ms while paths are traced, and may end the render.
    ///
    /// # Errors
    ///
    /// When a step of the run fails.
    pub fn render(&self, watcher: &mut RenderWatcher<'_>) -> Result<RenderedPicture> {
        render_in_memory(&self.0, watcher)
    }
}

/// What a command line was refused for, without the lines on how to use the program.
fn plain(error: &clap::Error) -> miette::Report {
    let text = error.to_string();
    let lines = text.lines().take_while(|line| !line.starts_with("Usage:"));
    let lines: Vec<&str> = lines.map(str::trim).filter(|line| !line.is_empty()).collect();
    miette::miette!("{}", lines.join("; ").trim_start_matches("error: "))
}

/// Runs the program with these words behind its name, and returns its exit code. Prints as the program does.
pub fn command(words: &[String]) -> u8 {
    let program = ["pointillist".to_owned()];
    let code = match Cli::try_parse_from(program.iter().chain(words)) {
        Ok(cli) => run(cli).unwrap_or_else(|report| {
            tell(&format!("{report:?}"));
            ExitCode::FAILURE
        }),
        Err(error) => {
            let _ = error.print();
            return u8::try_from(error.exit_code()).unwrap_or(2);
        }
    };
    // The standard library compares exit codes, and does not tell them.
    (0..=u8::MAX).find(|number| ExitCode::from(*number) == code).unwrap_or(1)
}

/// The bytes of a PNG file of a picture, with the display settings of the program.
///
/// # Errors
///
/// When the picture has no main layer.
pub fn png_bytes(layers: &Layers) -> Result<Vec<u8>> {
    let settings = Settings::default();
    let shown = shown(layers, &settings)?;
    png::encode(of_display(&shown, &settings), &texts(layers)).into_diagnostic()
}

/// Writes a picture to a file: `.exr` with all its channels, or `.png` as it is displayed.
///
/// # Errors
///
/// When the name ends in something else, or the file cannot be written.
pub fn save(path: &Path, layers: &Layers) -> Result<()> {
    match FileFormat::of(path).into_diagnostic()? {
        FileFormat::Exr => exr::write(path, layers).into_diagnostic(),
        FileFormat::Png => atomically(path, &png_bytes(layers)?).into_diagnostic(),
    }
}

/// The main layer after the tone curve, or if it is there the one through the noise filter.
fn shown(layers: &Layers, settings: &Settings) -> Result<DisplayImage> {
    let main = layer::named(layers, "denoised").or_else(|| layer::main(layers));
    let main = main.ok_or_else(|| miette::miette!("the picture has no layer R, G, B"))?;
    let to_xyz = xyz_from_rec709();
    let xyz = |rgb: [f32; 3]| (to_xyz * DVec3::from(rgb.map(f64::from))).as_vec3().max(Vec3::ZERO);
    let pixels = main.pixels().into_iter().map(xyz).collect();
    let grid = Grid::from_rows(layers.width, layers.height, pixels);
    let grid = grid.ok_or_else(|| miette::miette!("a channel of the picture is cut short"))?;
    ReferenceFilm::show(&grid, settings).into_diagnostic()
}

fn of_display<'a>(shown: &'a DisplayImage, settings: &Settings) -> PngPicture<'a> {
    PngPicture {
        width: shown.width,
        height: shown.height,
        rgb: &shown.rgb,
        transfer: Transfer::Gamma(settings.gamma),
        primaries: settings.profile.primaries,
    }
}

/// The attributes that are texts: others belong to the sums, which a PNG file does not have.
fn texts(layers: &Layers) -> Vec<(String, Attribute)> {
    let is_text = |(_, value): &&(String, Attribute)| matches!(value, Attribute::Text(_));
    layers.attributes.iter().filter(is_text).cloned().collect()
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use crate::scene::load_str;

    const SCENE: &str = r#"<scene version="3.0.0">
        <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="16"/>
            <integer name="height" value="12"/></film></sensor>
        <shape type="sphere"><point name="center" value="0, 0, 4"/></shape>
        <emitter type="constant" id="sky"/>
    </scene>"#;

    fn planned(words: &[&str]) -> Result<PlannedRender> {
        let loaded = Arc::new(load_str("scene.xml", SCENE, &[]).expect("valid"));
        let words: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
        PlannedRender::new("scene.xml", loaded, &words)
    }

    #[test]
    fn pictures_in_memory_have_the_layers_of_files() {
        let words =
            ["--spp", "4", "--device", "cpu", "--deterministic", "--aov", "depth", "--light-groups=lamp=sky"];
        let planned = planned(&words).expect("known options");
        let mut looks = 0;
        let rendered = planned.render(&mut |mut moment| {
            looks += 1;
            assert!((0.0..=1.0).contains(&moment.share));
            assert_eq!(moment.picture().expect("a picture").width, 16);
            ControlFlow::Continue(())
        });
        let rendered = rendered.expect("a picture");
        assert!(looks > 0);
        for name in ["R", "variance.Y", "camera.W", "depth.T", "lamp.G"] {
            let channel = rendered.layers.channel(name);
            assert_eq!(channel.map(<[f32]>::len), Some(16 * 12), "{name}: {:?}", names(&rendered.layers));
        }
        assert_eq!(rendered.report["seed"], 0);
        assert!(png_bytes(&rendered.layers).expect("it is shown").starts_with(b"\x89PNG"));
        let both = [&rendered.layers; 2];
        let compared = compare_layers(both, &["flip".to_owned(), "z".to_owned()], None).expect("two metrics");
        assert_eq!(compared[0].metric["value"], 0.0);
        assert_eq!(compared[0].map.pixels().len(), 16 * 12);
    }

    fn names(layers: &Layers) -> Vec<&str> {
        layers.channels.iter().map(|(name, _)| name.as_str()).collect()
    }

    /// The looks of a watcher leave no trace in a picture that is deterministic.
    #[test]
    fn watching_changes_no_bit() {
        let planned = planned(&["--spp", "8", "--device", "cpu", "--deterministic"]).expect("known options");
        let seen = planned.render(&mut |mut moment| {
            moment.picture().expect("a picture");
            ControlFlow::Continue(())
        });
        let alone = planned.render(&mut |_| ControlFlow::Continue(()));
        let channels = |picture: Result<RenderedPicture>| picture.expect("a picture").layers.channels;
        assert_eq!(channels(seen), channels(alone));
    }

    #[test]
    fn watchers_end_renders() {
        let planned = planned(&["--time", "3600", "--device", "cpu"]).expect("known options");
        let rendered = planned.render(&mut |moment| match moment.samples_per_pixel > 0.0 {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        });
        let rendered = rendered.expect("a picture");
        assert_eq!(rendered.report["interrupted"], true);
        assert!(rendered.layers.channel("R").is_some_and(|red| red.iter().any(|v| *v > 0.0)));
    }

    #[test]
    fn options_are_refused_by_name() {
        let told = |words: &[&str]| planned(words).expect_err("refused").to_string();
        assert!(told(&["--sppp", "4"]).contains("--sppp"));
        assert!(told(&["--spp", "many"]).contains("many"));
        assert!(told(&["-o", "picture.exr"]).contains("`output`"));
        assert!(told(&["--lenient"]).contains("`lenient`"));
    }

    #[test]
    fn commands_have_exit_codes() {
        let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(command(&words("plugins shape")), 0);
        assert_eq!(command(&words("info there/is/no.exr")), 1);
        assert_eq!(command(&words("plugins --no-such-option")), 2);
    }
}
