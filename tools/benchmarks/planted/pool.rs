//! Many renderings of a case, from which trials draw.

use std::ops::{ControlFlow, Range};
use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;

use pointillist::cmd::library::PlannedRender;
use pointillist::image::Grid;
use pointillist::image::compare::{Picture, luminance};
use pointillist::regress::plan::{CaseRenderer, RegressCase, RegressPlan};
use pointillist::regress::renderings::{CaseRenderings, CaseStop, picture_options};
use pointillist::scene::{Loaded, SceneDesc};

use super::super::common::{Outcome, timed};

/// The device of pools that processes render.
pub const DEVICE: &str = "llvmpipe";

/// Renderings of a case with independent seeds.
#[derive(Clone, Debug)]
pub struct Pool {
    /// Linear Rec.709.
    pub renderings: Vec<Grid<[f32; 3]>>,
}

impl Pool {
    /// Renders in this process, on the CPU, with the samples, size, method and options of the case.
    ///
    /// # Errors
    /// For options that a render in memory does not take, and when one fails.
    pub fn of_scene(case: &RegressCase, desc: &SceneDesc, seeds: Range<u32>) -> Outcome<Self> {
        let loaded = Arc::new(Loaded { desc: desc.clone(), warnings: Vec::new() });
        let renderer = on(&case.renderer, "cpu");
        // As many renderings at a time as there are cores, with one thread each.
        let render = |seed| -> Result<Grid<[f32; 3]>, String> {
            let words = picture_options(&renderer, case.size, case.budget.spp, seed);
            let mut words = words.ok_or("it is rendered by another program")?;
            words.push("--deterministic".to_owned());
            if !words.iter().any(|word| word == "--threads") {
                words.extend(["--threads", "1"].map(str::to_owned));
            }
            let name = case.scene.display().to_string();
            let planned = PlannedRender::new(&name, loaded.clone(), &words).map_err(|e| e.to_string())?;
            let rendered = planned.render(&mut |_| ControlFlow::Continue(())).map_err(|e| e.to_string())?;
            Ok(Picture::choose(&case.scene, &rendered.layers, None).map_err(|e| e.to_string())?.rgb)
        };
        let (renderings, seconds) =
            timed(|| seeds.clone().into_par_iter().map(render).collect::<Result<Vec<_>, _>>());
        eprintln!("{}: seeds {seeds:?} rendered in {seconds:.0} s", case.name);
        Ok(Self { renderings: renderings? })
    }

    /// Renders by processes of a program on llvmpipe.
    ///
    /// # Errors
    /// When one of them fails.
    pub fn of_program(
        plan: &RegressPlan,
        case: &RegressCase,
        program: &Path,
        seeds: Range<u32>,
    ) -> Outcome<Self> {
        let folder = tempfile::tempdir()?;
        let log = folder.path().join("log");
        let renderings = CaseRenderings::new(plan, case, program, [folder.path(), &log], "pool");
        let mut renderings = renderings.by(&on(&case.renderer, DEVICE), case.budget.spp);
        let (end, seconds) = timed(|| renderings.add(seeds.clone()));
        end.map_err(|stop| match stop {
            CaseStop::Broken(reason) => reason,
            CaseStop::Interrupted => "interrupted".to_owned(),
        })?;
        let device = renderings.tally().device.clone().unwrap_or_default();
        eprintln!("{}: seeds {seeds:?} rendered in {seconds:.0} s on {device}", case.name);
        if !device.contains(DEVICE) {
            return Err(format!("{} was rendered on {device} instead of {DEVICE}", case.name).into());
        }
        let pictures = seeds.map(|seed| Ok(Picture::read(&renderings.picture(seed), None)?.rgb));
        Ok(Self { renderings: pictures.collect::<Outcome<Vec<_>>>()? })
    }

    /// The same renderings, red and blue swapped.
    pub fn swapped(&self) -> Self {
        let mut pool = self.clone();
        for grid in &mut pool.renderings {
            grid.pixels_mut().iter_mut().for_each(|rgb| rgb.swap(0, 2));
        }
        pool
    }

    /// Mean luminance of each rendering, over the pixels that are finite.
    fn brightness(&self) -> Vec<f64> {
        let mean = |grid: &Grid<[f32; 3]>| {
            let finite = grid.pixels().iter().map(|rgb| luminance(*rgb)).filter(|y| y.is_finite());
            let (sum, count) = finite.fold((0.0, 0.0), |(sum, count), y| (sum + y, count + 1.0));
            sum / f64::max(count, 1.0)
        };
        self.renderings.iter().map(mean).collect()
    }
}

/// Relative change of the mean luminance from the pool of a reference to that of runs, and its standard error. With `paired`, the runs are changed
/// copies of the same renderings.
pub fn change_of_brightness(reference: &Pool, run: &Pool, paired: bool) -> [f64; 2] {
    let sides = [run, reference].map(Pool::brightness);
    let [now, then] = sides.each_ref().map(|values| moments(values));
    let ratio = now[0] / then[0];
    let error = if paired {
        let rests: Vec<f64> = sides[0].iter().zip(&sides[1]).map(|(a, b)| a - ratio * b).collect();
        moments(&rests)[1]
    } else {
        now[1].hypot(ratio * then[1])
    };
    [ratio - 1.0, error / then[0].abs()]
}

/// Mean and its standard error.
fn moments(values: &[f64]) -> [f64; 2] {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    [mean, (squares / (n * (n - 1.0))).sqrt()]
}

/// The renderer of a case on another device.
fn on(renderer: &CaseRenderer, device: &str) -> CaseRenderer {
    let mut renderer = renderer.clone();
    if let CaseRenderer::Pointillist { device: of_case, .. } = &mut renderer {
        *of_case = Some(device.to_owned());
    }
    renderer
}
