//! Error and bias of pictures whose fireflies are reweighted, beside those of the same samples as they are.
//!
//! Against a long bidirectional reference: root of relMSE, the same without the worst 0.1 % of pixels, and mean luminance over that of the
//! reference, which is the bias where all seeds have it.

use std::path::{Path, PathBuf};

use pointillist::client::cascades::CascadeFilm;
use pointillist::client::develop::linear_rgb;
use pointillist::client::reference::ReferenceFilm;
use pointillist::client::{Film, FilmSpec, Settings, SplatFilter};
use pointillist::color::Profile;
use pointillist::image::compare::luminance;
use pointillist::image::png::{self, PngPicture, Transfer};
use pointillist::stream::PathCounts;
use pointillist::tracer::Integrator;
use pointillist::tracer::integrator::{BidirectionalTracer, PathTracer, RenderContext};

use super::common::Outcome;
use super::late::Subject;
use super::replicates::Sink;

/// What to measure.
#[derive(clap::Args)]
pub struct Arguments {
    /// Scenes
    #[arg(default_values = ["scenes/veach_door.xml", "scenes/caustic.xml"])]
    scenes: Vec<PathBuf>,
    /// Pixels along a side of the picture
    #[arg(long, default_value_t = 128)]
    size: u32,
    /// Samples per pixel of the last level; levels are powers of 4
    #[arg(long, default_value_t = 256)]
    spp: u64,
    /// Samples per pixel of the reference
    #[arg(long, default_value_t = 4096)]
    reference: u64,
    /// Thresholds κ
    #[arg(long, value_delimiter = ',', default_values = ["1", "4"])]
    kappa: Vec<f32>,
    /// Renders of each
    #[arg(long, default_value_t = 2)]
    runs: u32,
    /// Folder for pictures of the first run
    #[arg(long)]
    pictures: Option<PathBuf>,
}

/// Measures all scenes.
pub fn run(arguments: &Arguments) -> Outcome {
    println!("scene, method, spp, threshold: root of relMSE, trimmed, mean over the reference's");
    for scene in &arguments.scenes {
        let subject = Subject::open(scene, arguments.size)?;
        let reference = subject.reference(arguments.reference);
        let name = scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let context = |seed| subject.context(seed);
        measure::<PathTracer>(&context, &reference, &format!("{name}_path"), arguments)?;
        measure::<BidirectionalTracer>(&context, &reference, &format!("{name}_bidirectional"), arguments)?;
    }
    Ok(())
}

fn measure<I: Integrator + From<RenderContext>>(
    context: &dyn Fn(u32) -> RenderContext,
    reference: &[[f32; 3]],
    name: &str,
    arguments: &Arguments,
) -> Outcome {
    let side = arguments.size;
    let filter = SplatFilter::Box;
    let spec = FilmSpec { width: side, height: side, filter, variance: None, sums: Default::default() };
    let levels: Vec<u64> = (1..).map(|k| 1 << (2 * k)).take_while(|spp| *spp <= arguments.spp).collect();
    let ways = 1 + arguments.kappa.len();
    let mut figures = vec![[0.0; 3]; levels.len() * ways];
    for seed in 0..arguments.runs {
        let integrator = I::from(context(seed));
        let per = integrator.paths_per_index();
        let mut films: Vec<Box<dyn Film>> = vec![Box::new(ReferenceFilm::new(spec, 1)?)];
        for kappa in &arguments.kappa {
            let make = |spec| -> Result<Box<dyn Film>, _> { Ok(Box::new(ReferenceFilm::new(spec, 1)?)) };
            films.push(Box::new(CascadeFilm::new(Box::new(make), spec, *kappa)?));
        }
        let (mut scratch, mut sink, mut index) = (Default::default(), Sink::new(side as usize), 0);
        for (level, spp) in levels.iter().enumerate() {
            let end = (spp * u64::from(side).pow(2)).div_ceil(per.camera.max(per.light));
            while index < end {
                sink.samples.clear();
                let first = index;
                while index < end && sink.samples.len() < 4096 {
                    integrator.trace(index, &mut scratch, &mut sink);
                    index += 1;
                }
                let n = index - first;
                for film in &mut films {
                    film.add(&sink.samples)?;
                    film.count_paths(PathCounts { camera: per.camera * n, light: per.light * n });
                }
            }
            for (way, film) in films.iter_mut().enumerate() {
                let picture = linear_rgb(&film.develop()?, &Profile::srgb());
                let sums = &mut figures[level * ways + way];
                *sums = std::array::from_fn(|i| {
                    sums[i] + errors(&picture, reference)[i] / f64::from(arguments.runs)
                });
                if let Some(folder) = arguments.pictures.as_ref().filter(|_| seed == 0) {
                    std::fs::create_dir_all(folder)?;
                    write(film.as_mut(), &folder.join(format!("{name}_{spp}_{way}.png")))?;
                }
            }
        }
    }
    for (level, spp) in levels.iter().enumerate() {
        for way in 0..ways {
            let [rel, trimmed, mean] = figures[level * ways + way];
            let kappa = way
                .checked_sub(1)
                .map_or("as they are".to_string(), |i| format!("κ = {}", arguments.kappa[i]));
            println!("{name}, {spp}, {kappa}: {:.3}, {:.3}, {mean:.3}", rel.sqrt(), trimmed.sqrt());
        }
    }
    Ok(())
}

/// relMSE, the same without the worst 0.1 % of the pixels, and mean luminance over the reference's.
fn errors(picture: &[[f32; 3]], reference: &[[f32; 3]]) -> [f64; 3] {
    let error = |(x, r): (&[f32; 3], &[f32; 3])| {
        let square: f64 = [0, 1, 2].map(|c| f64::from(x[c] - r[c]).powi(2)).iter().sum();
        square / 3.0 / (luminance(*r).powi(2) + 0.01)
    };
    let mut all: Vec<f64> = picture.iter().zip(reference).map(error).collect();
    all.sort_by(f64::total_cmp);
    let n = all.len();
    let kept = n - n.div_ceil(1000);
    let mean = |pixels: &[[f32; 3]]| pixels.iter().map(|p| luminance(*p)).sum::<f64>();
    let whole = all.iter().sum::<f64>() / n as f64;
    [whole, all[..kept].iter().sum::<f64>() / kept as f64, mean(picture) / mean(reference)]
}

/// The picture without blur, as a PNG file.
fn write(film: &mut dyn Film, path: &Path) -> Outcome {
    let data = film.develop()?;
    let settings = Settings::default();
    let tone = pointillist::client::reference::tonemap::tonemap;
    let xyz = pointillist::client::develop::linear_xyz(&data).into_iter().map(glam::Vec3::from).collect();
    let grid = pointillist::image::Grid::from_rows(data.width as usize, data.height as usize, xyz);
    let shown = tone(&grid.ok_or("a picture without pixels")?, &settings);
    let picture = PngPicture {
        width: shown.width,
        height: shown.height,
        rgb: &shown.rgb,
        transfer: Transfer::Gamma(settings.gamma),
        primaries: settings.profile.primaries,
    };
    Ok(png::write(path, picture, &[])?)
}
