//! The light mix of the window: one film per light group beside that of the picture, and the factors with which the group pictures are
//! summed. Changing a factor changes the displayed sum without tracing again.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::{DVec3, Mat3, Vec3};
use miette::{IntoDiagnostic, Result, miette};

use crate::client::film::VulkanFilm;
use crate::client::pass::compose::PictureLayer;
use crate::client::reference::tonemap::ToneMapper;
use crate::client::wavelet::out_of_memory;
use crate::client::{ClientError, Settings};
use crate::color::profile::{rec709_from_xyz, rec709_luminance, xyz_from_rec709};
use crate::gpu::{Cmd, Gpu, Region};
use crate::image::Grid;
use crate::image::bitmap::Bitmap;
use crate::image::mix::{MixExample, MixFreedom, MixRgb, examples_of, factors_like};
use crate::render::light_groups::{self, GroupFilms, GroupMemory};
use crate::render::run_spec::{RunSpec, mix_option};
use crate::scene::desc::IntegratorKind;
use crate::scene::light_groups::{self as groups, LightGroup};
use crate::scene::{SceneDesc, limits};
use crate::tracer::Scene;

/// The light mix as the panel shows it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightMixData {
    /// Whether light groups are traced.
    pub is_on: bool,
    /// Description of the groups and their memory, or why there are none.
    pub summary: String,
    /// The groups.
    pub groups: Vec<MixGroupRow>,
    /// The group shown alone (solo).
    pub solo: Option<usize>,
    /// Colour targets.
    pub targets: Vec<MixTargetRow>,
    /// Whether the fit changes intensities only and keeps tints.
    pub keeps_colors: bool,
}

/// A light group.
#[derive(Clone, Debug, PartialEq)]
pub struct MixGroupRow {
    /// Its name.
    pub name: String,
    /// The names of its lights.
    pub emitters: Vec<String>,
    /// Intensity factor.
    pub intensity: f32,
    /// Additional factors on linear R, G, B; the largest is 1.
    pub tint: [f32; 3],
}

/// A colour target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MixTargetRow {
    /// The pixel.
    pub pixel: [u32; 2],
    /// Display-linear R, G, B.
    pub color: [f32; 3],
}

/// Most colour targets.
const MOST_TARGETS: usize = 16;

/// Half the side of the square around a target whose mean is compared with it, in pixels.
const SPOT: usize = 2;

/// Interval at which the colours at the targets are read back.
const REREAD: Duration = Duration::from_millis(500);

/// Approximate number of pixels of an example picture that enter the fit.
const EXAMPLES: usize = 1 << 16;

/// Bisection steps of the inverse tone curve.
const HALVINGS: u32 = 40;

/// Upper bound on a displayed value that is inverted: above it the value is clipped, and its light unknown.
const BRIGHTEST: f32 = 0.98;

/// A pixel of the picture and the colour it is to be displayed with.
struct MixTarget {
    pixel: [u32; 2],
    /// Display-linear RGB.
    color: MixRgb,
}

/// Intensity and tint of a light group.
#[derive(Clone, Copy, Debug, PartialEq)]
struct MixLight {
    intensity: f32,
    /// Factors on linear R, G, B; the largest is 1.
    tint: MixRgb,
}

impl MixLight {
    /// Unchanged light.
    const AS_IT_IS: Self = Self { intensity: 1.0, tint: [1.0; 3] };

    /// Intensity and tint of an RGB factor; a black factor keeps the previous tint.
    fn of(factor: MixRgb, before: Self) -> Self {
        let intensity = factor.into_iter().fold(0.0, f32::max);
        let tint = if intensity > 0.0 { factor.map(|c| c / intensity) } else { before.tint };
        Self { intensity, tint }
    }

    fn factor(self) -> MixRgb {
        self.tint.map(|c| c * self.intensity)
    }
}

/// Films of the light groups, their factors and the targets of the fit.
#[derive(Default)]
pub struct LightMix {
    films: Option<GroupFilms>,
    /// One per group, in the same order.
    lights: Vec<MixLight>,
    /// Factors of groups by name, kept for the next mix.
    known: HashMap<String, MixLight>,
    /// The group that is shown alone (solo).
    solo: Option<usize>,
    targets: Vec<MixTarget>,
    /// Whether the fit changes intensities only and keeps tints.
    keeps_colors: bool,
    /// Description of the mix on offer, cached by scene, size and method.
    offer: Option<(Arc<Scene>, [u32; 2], IntegratorKind, String)>,
    /// Time of the last readback, and the colours `[group][target]`.
    spots: Option<(Instant, Vec<Vec<MixRgb>>)>,
}

/// Light groups of a scene: one per emitter, merged if there are too many.
///
/// # Errors
///
/// If the scene has no lights, or the method does not support groups.
pub fn groups_of(desc: &SceneDesc, scene: &Scene, run: &RunSpec) -> Result<Vec<LightGroup>> {
    let emitters = groups::emitters(desc);
    if emitters.is_empty() || !run.integrator.shows_light() {
        return Err(miette!("there is no light to mix"));
    }
    Ok(groups::each(emitters, &scene.lights().power_shares()))
}

impl LightMix {
    /// Whether light groups are traced.
    pub fn is_on(&self) -> bool {
        self.films.is_some()
    }

    /// Whether the displayed picture differs from the plain sum of all lights.
    pub fn is_mixing(&self) -> bool {
        self.is_on() && self.factors().flatten().any(|factor| factor != 1.0)
    }

    /// RGB factor of each group.
    fn factors(&self) -> impl Iterator<Item = MixRgb> + use<> {
        let solo = self.solo;
        let factor = move |(i, light): (usize, MixLight)| match solo {
            Some(solo) if solo != i => [0.0; 3],
            _ => light.factor(),
        };
        self.lights.clone().into_iter().enumerate().map(factor)
    }

    /// Begins with empty films. Factors are those of the last mix, matched by name, or else 1.
    pub fn begin(&mut self, films: GroupFilms) {
        self.remember();
        let light = |group: &LightGroup| self.known.get(&group.name).copied().unwrap_or(MixLight::AS_IT_IS);
        self.lights = films.groups().iter().map(light).collect();
        self.films = Some(films);
        self.spots = None;
    }

    fn remember(&mut self) {
        let names = self.films.iter().flat_map(|films| films.groups()).map(|group| group.name.clone());
        self.known.extend(names.zip(self.lights.iter().copied()));
    }

    /// Light groups; empty if none are traced.
    pub fn groups(&self) -> &[LightGroup] {
        self.films.as_ref().map_or(&[], GroupFilms::groups)
    }

    /// Clears films and targets for another epoch.
    pub fn begin_epoch(&mut self) {
        self.films.iter_mut().for_each(GroupFilms::clear);
        // Targets are pixels of the previous picture.
        self.targets.clear();
        self.spots = None;
    }

    /// Ends the mix: all lights are unchanged again. Their factors are kept for the next mix.
    pub fn end(&mut self) {
        self.remember();
        *self = Self { known: std::mem::take(&mut self.known), ..Self::default() };
    }

    /// Whether a film of a group has lost samples to an error.
    pub fn is_damaged(&mut self) -> bool {
        self.device_films().any(|film| film.is_damaged())
    }

    /// Films of the groups.
    pub fn films(&mut self) -> Option<&mut GroupFilms> {
        self.films.as_mut()
    }

    /// Sets a group's factor.
    pub fn set(&mut self, group: usize, factor: MixRgb) {
        if let Some(light) = self.lights.get_mut(group) {
            *light = MixLight::of(factor.map(|f| if f.is_finite() { f.max(0.0) } else { 1.0 }), *light);
        }
    }

    /// Shows one group alone, or all of them again if it is alone already.
    pub fn solo(&mut self, group: usize) {
        self.solo = if self.solo == Some(group) { None } else { Some(group) };
    }

    /// Resets all factors to 1.
    pub fn reset(&mut self) {
        self.lights.fill(MixLight::AS_IT_IS);
        self.solo = None;
        // The targets are no longer met.
        self.targets.clear();
    }

    /// Sets whether the fit changes intensities only and keeps tints.
    pub fn keep_colors(&mut self, keeps: bool) {
        self.keeps_colors = keeps;
    }

    /// Options of `pointillist mix` that set these factors; empty if all are 1.
    pub fn options(&self) -> String {
        let changed = self.groups().iter().zip(self.factors()).filter(|(_, factor)| *factor != [1.0; 3]);
        let options: Vec<String> = changed.map(|(group, factor)| mix_option(&group.name, factor)).collect();
        options.join(" ")
    }

    /// Data for the panel.
    pub fn data(&self) -> LightMixData {
        let row = |(group, light): (&LightGroup, &MixLight)| MixGroupRow {
            name: group.name.clone(),
            emitters: group.emitters.iter().map(|emitter| emitter.name.clone()).collect(),
            intensity: light.intensity,
            tint: light.tint,
        };
        let target = |target: &MixTarget| MixTargetRow { pixel: target.pixel, color: target.color };
        LightMixData {
            is_on: self.is_on(),
            summary: self.offer.as_ref().map(|(.., offer)| offer.clone()).unwrap_or_default(),
            groups: self.groups().iter().zip(&self.lights).map(row).collect(),
            solo: self.solo,
            targets: self.targets.iter().map(target).collect(),
            keeps_colors: self.keeps_colors,
        }
    }

    /// Updates the description of the groups and the memory that a mix would have, unless it is known for this scene, size and method.
    pub fn offer(&mut self, desc: &SceneDesc, scene: &Arc<Scene>, run: &RunSpec, memory: GroupMemory) {
        let size = [run.film.width, run.film.height];
        let known = self.offer.as_ref().is_some_and(|(known, of, method, _)| {
            Arc::ptr_eq(known, scene) && (*of, *method) == (size, run.integrator)
        });
        if self.is_on() || known {
            return;
        }
        let offer = match groups_of(desc, scene, run) {
            Ok(groups) => light_groups::summary(&groups, run, memory),
            Err(why) => why.to_string(),
        };
        self.offer = Some((scene.clone(), size, run.integrator, offer));
    }

    /// Samples rasterised by the CPU since the last call, and the time that took.
    pub fn take_host_time(&mut self) -> (u64, Duration) {
        let times = self.device_films().map(VulkanFilm::take_host_time);
        times.fold((0, Duration::ZERO), |(samples, time), (more, took)| (samples + more, time + took))
    }

    /// Whether the device has rasterised all samples of the groups.
    pub fn are_drawn(&mut self, gpu: &Gpu) -> bool {
        self.device_films().all(|film| gpu.has_completed(film.rasterised()))
    }

    fn device_films(&mut self) -> impl Iterator<Item = &mut VulkanFilm> {
        self.films.iter_mut().flat_map(|films| films.films()).filter_map(|film| VulkanFilm::of(film.as_mut()))
    }

    /// Rasterises the waiting samples.
    pub fn flush(&mut self) -> Result<(), ClientError> {
        self.films.as_mut().map_or(Ok(()), GroupFilms::flush)
    }

    /// Records the reconstruction of the group pictures, to be summed.
    pub fn record(
        &mut self,
        cmd: &mut Cmd<'_>,
        settings: &Settings,
        detail: u32,
    ) -> Result<Vec<PictureLayer<'_>>, ClientError> {
        let (factors, settings) = (self.factors(), without_masking(settings));
        let films = self.device_films().zip(factors).filter(|(_, factor)| *factor != [0.0; 3]);
        let layer = |(film, factor): (_, MixRgb)| {
            let film: &mut VulkanFilm = film;
            let whole = Region { origin: [0, 0], extent: [film.spec().width, film.spec().height] };
            let xyz = film.linear(cmd, None, &settings, detail)?;
            Ok(PictureLayer { xyz, origin: [0, 0], matrix: on_xyz(factor), shares: vec![(whole, 1.0)] })
        };
        films.map(layer).collect()
    }

    /// Mixed picture, scene-linear XYZ before glare and tone curve.
    pub fn linear(&mut self, settings: &Settings, size: [u32; 2]) -> Result<Grid<Vec3>, ClientError> {
        let [width, height] = size.map(|n| n as usize);
        let settings = without_masking(settings).before_glare();
        let factors = self.factors();
        let mut sum = vec![Vec3::ZERO; width * height];
        for (film, factor) in self.device_films().zip(factors).filter(|(_, factor)| *factor != [0.0; 3]) {
            let matrix = on_xyz(factor);
            for (sum, xyz) in sum.iter_mut().zip(film.reconstruct(&settings, 1)?) {
                *sum += matrix * Vec3::from(xyz);
            }
        }
        Grid::from_rows(width, height, sum).ok_or_else(|| out_of_memory([width, height]))
    }

    /// Adds a pixel as a target whose wanted colour is the one displayed now.
    ///
    /// # Errors
    ///
    /// If there are too many targets, or no samples.
    pub fn add_target(&mut self, pixel: [u32; 2], settings: &Settings) -> Result<()> {
        if self.targets.len() == MOST_TARGETS {
            return Err(miette!("there are {MOST_TARGETS} targets already: remove one"));
        }
        self.targets.push(MixTarget { pixel, color: [0.0; 3] });
        self.spots = None;
        let spots = match self.spots() {
            Ok(spots) => spots,
            Err(error) => {
                self.targets.pop();
                return Err(error);
            }
        };
        let here = spots.iter().filter_map(|spots| spots.last()).zip(self.factors());
        let rgb = here.map(|(spot, factor)| Vec3::from(*spot) * Vec3::from(factor)).sum::<Vec3>();
        let xyz = (xyz_from_rec709() * rgb.as_dvec3()).as_vec3();
        if let Some(target) = self.targets.last_mut() {
            target.color = ToneMapper::new(&plain(settings)).linear(xyz).to_array();
        }
        Ok(())
    }

    /// Sets the wanted colour of a target.
    pub fn set_target(&mut self, place: usize, color: MixRgb) {
        if let Some(target) = self.targets.get_mut(place) {
            target.color = color;
        }
    }

    /// Removes a target.
    pub fn forget_target(&mut self, place: usize) {
        if place < self.targets.len() {
            self.targets.remove(place);
            self.spots = None;
        }
    }

    /// Finds the factors with which the mix comes closest to the target colours.
    ///
    /// # Errors
    ///
    /// If there are no targets, or no samples.
    pub fn meet_targets(&mut self, settings: &Settings) -> Result<()> {
        if self.targets.is_empty() {
            return Err(miette!("there is no target: add a place whose colour is known"));
        }
        let spots = self.spots()?;
        let colors: Vec<MixRgb> =
            self.targets.iter().map(|target| light_of(target.color, settings)).collect();
        self.solve(&spots, &colors);
        Ok(())
    }

    /// Mean colours of the groups around the targets, read back a few times a second at most.
    fn spots(&mut self) -> Result<Vec<Vec<MixRgb>>> {
        if let Some((read, spots)) = &self.spots
            && read.elapsed() < REREAD
        {
            return Ok(spots.clone());
        }
        let groups = self.pictures()?;
        let spot = |picture: &Grid<MixRgb>, [x, y]: [u32; 2]| -> MixRgb {
            let near = |at: u32, n: usize| {
                let at = (at as usize).min(n - 1);
                at.saturating_sub(SPOT)..(at + SPOT + 1).min(n)
            };
            let (rows, columns) = (near(y, picture.height()), near(x, picture.width()));
            let count = (rows.len() * columns.len()) as f32;
            let places = rows.flat_map(|y| columns.clone().map(move |x| [x, y]));
            let sum = places.fold(Vec3::ZERO, |sum, [x, y]| sum + Vec3::from(picture.at(x, y)));
            (sum / count).to_array()
        };
        let of_group =
            |picture: &Grid<MixRgb>| self.targets.iter().map(|target| spot(picture, target.pixel)).collect();
        let spots: Vec<Vec<MixRgb>> = groups.iter().map(of_group).collect();
        self.spots = Some((Instant::now(), spots.clone()));
        Ok(spots)
    }

    /// Fits the factors so that the mix looks most like an example picture: a display-encoded one, taken to be displayed with these
    /// settings, or scene-linear (EXR, HDR, PFM).
    ///
    /// # Errors
    ///
    /// When the file cannot be read, has another size, or there are no samples.
    pub fn look_like(&mut self, path: &Path, settings: &Settings) -> Result<()> {
        let groups = self.pictures()?;
        let size = groups.first().map_or([0, 0], |picture| [picture.width(), picture.height()]);
        let most = usize::try_from(limits::FILM_PIXELS).unwrap_or(usize::MAX);
        let is_light = path.extension().is_some_and(|ending| {
            ["exr", "hdr", "pfm"].iter().any(|light| ending.eq_ignore_ascii_case(light))
        });
        // A display-encoded picture is decoded with the gamma of the display.
        let mut example = Bitmap::read(path, !is_light, most).into_diagnostic()?.into_linear();
        if !is_light {
            let decode = |c: f32| c.max(0.0).powf(settings.gamma);
            example.pixels_mut().iter_mut().for_each(|color| *color = color.map(decode));
        }
        if [example.width(), example.height()] != size {
            return Err(miette!(
                "{} has {}×{} pixels, and the picture {}×{}: scale it",
                path.display(),
                example.width(),
                example.height(),
                size[0],
                size[1]
            ));
        }
        // An odd step visits all columns.
        let step = example.pixels().len().div_ceil(EXAMPLES) | 1;
        let some = |pixels: &[MixRgb]| -> Vec<MixRgb> { pixels.iter().step_by(step).copied().collect() };
        let groups: Vec<Vec<MixRgb>> = groups.iter().map(|picture| some(picture.pixels())).collect();
        let colors = some(example.pixels());
        let clipped = |color: &MixRgb| !is_light && color.iter().any(|c| *c >= BRIGHTEST);
        let known: Vec<usize> = (0..colors.len()).filter(|i| !clipped(&colors[*i])).collect();
        let light = |color: MixRgb| if is_light { color } else { light_of(color, settings) };
        let colors: Vec<MixRgb> = known.iter().map(|i| light(colors[*i])).collect();
        let groups: Vec<Vec<MixRgb>> =
            groups.iter().map(|picture| known.iter().map(|i| picture[*i]).collect()).collect();
        self.solve(&groups, &colors);
        Ok(())
    }

    fn solve(&mut self, groups: &[Vec<MixRgb>], colors: &[MixRgb]) {
        let pictures: Vec<&[MixRgb]> = groups.iter().map(Vec::as_slice).collect();
        let freedom = if self.keeps_colors { MixFreedom::Intensity } else { MixFreedom::Color };
        let examples: Vec<MixExample> = examples_of(colors, |_| true);
        let found = factors_like(&pictures, examples, freedom);
        for (light, factor) in self.lights.iter_mut().zip(found) {
            *light = MixLight::of(factor, *light);
        }
        self.solo = None;
    }

    /// Linear pictures of all groups.
    fn pictures(&mut self) -> Result<Vec<Grid<MixRgb>>> {
        let Some(films) = &mut self.films else { return Err(miette!("the light mix is off")) };
        if films.films().iter().all(|film| film.counts().paths() == 0) {
            return Err(miette!("there is no picture of the lights yet: try again in a moment"));
        }
        films.pictures()
    }
}

/// The XYZ-to-XYZ matrix that multiplies linear Rec.709 by a factor.
fn on_xyz(factor: MixRgb) -> Mat3 {
    let scale = Mat3::from_diagonal(Vec3::from(factor));
    xyz_from_rec709().as_mat3() * scale * rec709_from_xyz()
}

fn brightness(rgb: Vec3) -> f32 {
    rec709_luminance().dot(rgb)
}

/// The settings without noise masking, which needs a variance that the films of groups do not accumulate.
fn without_masking(settings: &Settings) -> Settings {
    Settings { vm: 0.0, ..settings.clone() }
}

/// The settings for displaying light as it is.
fn plain(settings: &Settings) -> Settings {
    Settings { view: Default::default(), ..settings.before_glare() }
}

/// Inverts the tone curve: the light, linear Rec.709, that is displayed with this colour; it has its chromaticity, and its intensity is
/// found by bisection.
fn light_of(color: MixRgb, settings: &Settings) -> MixRgb {
    let luminance = brightness(Vec3::from(color)).clamp(0.0, BRIGHTEST);
    if luminance <= 0.0 {
        return [0.0; 3];
    }
    let settings = plain(settings);
    let tone = ToneMapper::new(&settings);
    let rgb = Vec3::from(color) / brightness(Vec3::from(color));
    let xyz = (xyz_from_rec709() * DVec3::from(rgb.to_array().map(f64::from))).as_vec3();
    let is_darker = |light: f32| brightness(tone.linear(xyz * light)) < luminance;
    // Displayed brightness is monotonic in intensity; the interval covers any exposure.
    let (mut low, mut high) = (-40.0f32, 40.0f32);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if is_darker(middle.exp2()) { low = middle } else { high = middle }
    }
    (rgb * (0.5 * (low + high)).exp2()).to_array()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::ToneCurve;

    /// The light found for a displayed colour is displayed with that colour, by every curve and exposure.
    #[test]
    fn light_is_found_from_what_is_displayed() {
        for curve in [ToneCurve::Paper, ToneCurve::PbrNeutral, ToneCurve::AgX] {
            for exposure in [1e-3, 1.0, 50.0] {
                let settings = Settings { curve, exposure, ..Settings::default() };
                for grey in [0.01, 0.2, 0.7] {
                    let [r, g, b] = light_of([grey; 3], &settings);
                    let xyz = (xyz_from_rec709() * DVec3::new(r.into(), g.into(), b.into())).as_vec3();
                    let shown = ToneMapper::new(&settings).linear(xyz);
                    let off = (brightness(shown) - grey).abs();
                    assert!(off < 1e-3, "{curve:?} {exposure}: {shown} for {grey}");
                }
            }
        }
        assert_eq!(light_of([0.0; 3], &Settings::default()), [0.0; 3]);
    }

    #[test]
    fn a_factor_of_one_changes_nothing_and_white_scales_all() {
        let xyz = Vec3::new(0.3, 0.5, 0.2);
        assert!((on_xyz([1.0; 3]) * xyz - xyz).abs().max_element() < 1e-6);
        assert!((on_xyz([2.5; 3]) * xyz - xyz * 2.5).abs().max_element() < 1e-5);
    }
}
