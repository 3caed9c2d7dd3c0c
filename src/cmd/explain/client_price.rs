//! Costs of the client's effects: passes on the device, and the noise filter on the CPU.

use std::time::Instant;

use miette::Result;

use crate::client::effect_list::ClientEffect;
use crate::client::{Denoise, FilmSpec, Settings};
use crate::cmd::bench::PassTimes;
use crate::cmd::explain::price_list::PriceList;
use crate::color::Xyz;
use crate::denoise::filtered_picture::{FilteredPicture, HalfMeans};
use crate::denoise::view_filter::ViewFilter;
use crate::gpu::Inventory;
use crate::render::effect_plan::PlannedEffect;
use crate::render::process;
use crate::scene::desc::IntegratorKind;
use crate::stream::{CHUNK, PathCounts, Sample};
use crate::study::Replicates;
use crate::tracer::{Camera, Scene};

/// Number of pictures denoised for a measurement.
const FILTERED: usize = 7;

/// Frames for measuring the costs of the client's effects.
pub struct ClientFrames<'a> {
    settings: &'a Settings,
    kind: IntegratorKind,
}

impl<'a> ClientFrames<'a> {
    /// Frames of a run by this method, displayed with these settings.
    pub fn new(settings: &'a Settings, kind: IntegratorKind) -> Self {
        Self { settings, kind }
    }

    /// Number of measurements for `plan`.
    pub fn steps(&self, plan: &[PlannedEffect]) -> usize {
        1 + plan.iter().filter(|entry| self.other(entry).is_some()).count()
    }

    /// Measures time and memory of the client's effects and reports each to `list` at once. `measure` runs frames with given settings and
    /// method; it is called once for the requested ones, and once for every effect that is toggled to measure the difference. Returns the
    /// resources of the first run, if it was completed.
    pub fn charge(
        &self,
        plan: &mut [PlannedEffect],
        list: &PriceList,
        mut measure: impl FnMut(&Settings, IntegratorKind) -> Result<PassTimes>,
    ) -> Result<Option<Inventory>> {
        let mut measure = |what: &str, settings: &Settings, kind| -> Result<Option<PassTimes>> {
            list.begin(what);
            let measured = measure(settings, kind)?;
            list.done();
            // Ctrl-C ends frames early.
            Ok(Some(measured).filter(|_| !list.is_over()))
        };
        let Some(base) = measure("frames", self.settings, self.kind)? else { return Ok(None) };
        let all = time_of(&base, |_| true);
        for entry in plan.iter_mut().filter(|entry| !is_of_processor(entry.name)) {
            let Some(ClientEffect { passes, changes, images, .. }) = entry.client else { continue };
            let other = match self.other(entry) {
                None => None,
                Some((settings, kind)) => match measure(entry.name, &settings, kind)? {
                    None => break,
                    other => other,
                },
            };
            let [own, changed] = [passes, changes].map(|names| {
                let of = |measured| time_of(measured, |name| names.contains(&name));
                (of(&base), other.as_ref().map_or(0.0, of))
            });
            let cost = &mut entry.cost;
            let something = |ms: f64| Some(ms).filter(|ms| *ms > 0.0);
            if entry.on {
                let changed = if other.is_some() { changed.0 - changed.1 } else { 0.0 };
                cost.milliseconds = something(own.0 + changed);
                cost.share = cost.milliseconds.map(|ms| ms / all);
            } else if other.is_some() {
                cost.if_on = something(own.1 + changed.1 - changed.0);
            }
            let of_its_own = |name: &str| entry.on && images.iter().any(|image| name.starts_with(image));
            let memory = base.inventory.memory.iter().filter(|(name, _)| of_its_own(name));
            cost.bytes = Some(memory.map(|(_, bytes)| bytes).sum());
            list.priced(entry);
        }
        Ok(Some(base.inventory))
    }

    /// Settings and method with the effect toggled, if that requires other ones.
    fn other(&self, entry: &PlannedEffect) -> Option<(Settings, IntegratorKind)> {
        let ClientEffect { changes, can_switch, .. } = entry.client.as_ref()?;
        let switched = |effect: &str, on| {
            let mut settings = self.settings.clone();
            settings.switch(effect, on);
            Some((settings, self.kind))
        };
        match entry.name {
            name if is_of_processor(name) => None,
            "light-stream" if !entry.on => Some((self.settings.clone(), IntegratorKind::Bidirectional)),
            // The variance is accumulated only with an effect that reads it.
            "variance" if !entry.on => switched("masking", true),
            name if *can_switch && (!entry.on || !changes.is_empty()) => switched(name, !entry.on),
            _ => None,
        }
    }
}

/// Whether the effect takes no GPU time.
fn is_of_processor(name: &str) -> bool {
    ["noise-filter", "reprojection", "steering"].contains(&name)
}

/// Measures the noise filter, which runs on the CPU: time per picture, and for the feature buffers once per view.
pub fn charge_filter(
    plan: &mut [PlannedEffect],
    list: &PriceList,
    scene: &Scene,
    camera: &Camera,
    film: &FilmSpec,
) {
    let Some(entry) = plan.iter_mut().find(|entry| entry.name == "noise-filter") else { return };
    list.begin(entry.name);
    let milliseconds = |since: Instant| since.elapsed().as_secs_f64() * 1e3;
    let start = Instant::now();
    let Some(mut filter) = ViewFilter::new(scene, camera, film, &process::is_interrupted) else {
        return;
    };
    entry.cost.once = Some(milliseconds(start));
    let mut replicates = Replicates::new([film.width, film.height], film.filter.energy());
    for (first_index, y) in (0..2).flat_map(|half| (0..film.height).map(move |y| (half * CHUNK, y))) {
        let place = |at: u32, size: u32| (at as f32 + 0.5) / size as f32;
        let sample = |x| Sample {
            uv: [place(x, film.width), place(y, film.height)],
            xyz: Xyz { x: 1.0, y: 1.0, z: 1.0 },
            w: 1.0,
        };
        let row: Vec<_> = (0..film.width).map(sample).collect();
        replicates.add(first_index, PathCounts { camera: row.len() as u64, light: 0 }, &row);
    }
    let mut times: Vec<_> = (0..FILTERED)
        .take_while(|_| !list.is_over())
        .filter_map(|_| {
            let start = Instant::now();
            let halves = HalfMeans::of(&replicates).ok()?;
            let made = FilteredPicture::of(&replicates, &halves, None, &mut filter, Denoise::Wavelet);
            made.ok().map(|_| milliseconds(start))
        })
        .collect();
    times.sort_by(f64::total_cmp);
    let median = times.get(times.len() / 2).copied();
    entry.cost.once = entry.cost.once.filter(|_| median.is_some());
    match entry.on {
        true => entry.cost.milliseconds = median,
        false => entry.cost.if_on = median,
    }
    list.done();
    list.priced(entry);
}

/// Median milliseconds per frame of the passes accepted by `is`, without nested passes.
fn time_of(measured: &PassTimes, is: impl Fn(&str) -> bool) -> f64 {
    let median = |times: &[f64]| times.get(times.len() / 2).copied().unwrap_or(0.0);
    // The fold of the variance is nested in its pass.
    let counts = |name: &str| !is_yardstick(name) && name != "variance fold" && is(name);
    measured.passes.iter().filter(|(name, _)| counts(name)).map(|(_, times)| median(times)).sum()
}

/// Whether a pass or image belongs to the yardstick and not to the picture.
pub fn is_yardstick(name: &str) -> bool {
    name.starts_with("copy")
}
