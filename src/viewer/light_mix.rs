//! The light mix of the window: a film for each group of lights beside that of the picture, and the factors with which the pictures
//! of the groups are added up. Changing a factor changes what is shown and traces nothing anew.

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
use crate::client::window::panel::{LightMixData, MixGroupRow, MixTargetRow};
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

/// Most targets.
const MOST_TARGETS: usize = 16;

/// Pixels around a target whose mean is compared with it.
const SPOT: usize = 2;

/// The colours at the targets are read again after so long.
const REREAD: Duration = Duration::from_millis(500);

/// Pixels of a picture that the mix is to look like, about, of which each counts.
const EXAMPLES: usize = 1 << 16;

/// Halvings of the interval in which the light of a displayed brightness is sought.
const HALVINGS: u32 = 40;

/// What displayed brightness is taken for at most: more is clipped, and the light of it not known.
const BRIGHTEST: f32 = 0.98;

/// A place of the picture, and the colour that it is to be displayed with.
struct MixTarget {
    pixel: [u32; 2],
    /// Display-linear RGB.
    color: MixRgb,
}

/// How a group's light is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
struct MixLight {
    intensity: f32,
    /// Factors on linear R, G, B, of which the largest is 1.
    tint: MixRgb,
}

impl MixLight {
    /// Light as it is in the scene.
    const AS_IT_IS: Self = Self { intensity: 1.0, tint: [1.0; 3] };

    /// The light of these factors; black keeps its colour.
    fn of(factor: MixRgb, before: Self) -> Self {
        let intensity = factor.into_iter().fold(0.0, f32::max);
        let tint = if intensity > 0.0 { factor.map(|c| c / intensity) } else { before.tint };
        Self { intensity, tint }
    }

    fn factor(self) -> MixRgb {
        self.tint.map(|c| c * self.intensity)
    }
}

/// The films of the groups, how each is shown, and what the mix is to look like.
#[derive(Default)]
pub struct LightMix {
    films: Option<GroupFilms>,
    /// In the order of the groups.
    lights: Vec<MixLight>,
    /// The lights of groups by name, for when they are mixed again.
    known: HashMap<String, MixLight>,
    /// The group that is shown alone.
    solo: Option<usize>,
    targets: Vec<MixTarget>,
    /// Whether lights keep their colours where factors are sought.
    keeps_colors: bool,
    /// What a mix would be of, in words, for this scene, size and method.
    offer: Option<(Arc<Scene>, [u32; 2], IntegratorKind, String)>,
    /// The colours of the groups at the targets, and when they were read.
    spots: Option<(Instant, Vec<Vec<MixRgb>>)>,
}

/// The groups of lights of a scene, each emitter one as far as there are not too many.
///
/// # Errors
///
/// Where there is no light, or the method has none.
pub fn groups_of(desc: &SceneDesc, scene: &Scene, run: &RunSpec) -> Result<Vec<LightGroup>> {
    let emitters = groups::emitters(desc);
    if emitters.is_empty() || run.integrator == IntegratorKind::Depth {
        return Err(miette!("there is no light to mix"));
    }
    Ok(groups::each(emitters, &scene.lights().power_shares()))
}

impl LightMix {
    /// Whether groups are traced.
    pub fn is_on(&self) -> bool {
        self.films.is_some()
    }

    /// Whether something else is shown than the picture of all lights as they are.
    pub fn is_mixing(&self) -> bool {
        self.is_on() && self.factors().flatten().any(|factor| factor != 1.0)
    }

    /// The factors by which the light of each group is multiplied.
    fn factors(&self) -> impl Iterator<Item = MixRgb> + use<> {
        let solo = self.solo;
        let factor = move |(i, light): (usize, MixLight)| match solo {
            Some(solo) if solo != i => [0.0; 3],
            _ => light.factor(),
        };
        self.lights.clone().into_iter().enumerate().map(factor)
    }

    /// Begins with empty films of groups. Lights are as they were in the last mix, by name, or else as they are in the scene.
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

    /// The groups; none where they are not traced.
    pub fn groups(&self) -> &[LightGroup] {
        self.films.as_ref().map_or(&[], GroupFilms::groups)
    }

    /// Another epoch begins.
    pub fn begin_epoch(&mut self) {
        self.films.iter_mut().for_each(GroupFilms::clear);
        // They were places of another picture.
        self.targets.clear();
        self.spots = None;
    }

    /// Ends it: the lights are as they are in the scene. What they were is remembered for the next mix.
    pub fn end(&mut self) {
        self.remember();
        *self = Self { known: std::mem::take(&mut self.known), ..Self::default() };
    }

    /// Whether a film of a group has lost samples to an error.
    pub fn is_damaged(&mut self) -> bool {
        self.device_films().any(|film| film.is_damaged())
    }

    /// The films.
    pub fn films(&mut self) -> Option<&mut GroupFilms> {
        self.films.as_mut()
    }

    /// Multiplies a group's light.
    pub fn set(&mut self, group: usize, factor: MixRgb) {
        if let Some(light) = self.lights.get_mut(group) {
            *light = MixLight::of(factor.map(|f| if f.is_finite() { f.max(0.0) } else { 1.0 }), *light);
        }
    }

    /// Shows one group alone, or all of them again where it is shown alone already.
    pub fn solo(&mut self, group: usize) {
        self.solo = if self.solo == Some(group) { None } else { Some(group) };
    }

    /// Shows all lights as they are.
    pub fn reset(&mut self) {
        self.lights.fill(MixLight::AS_IT_IS);
        self.solo = None;
        // They are met no more.
        self.targets.clear();
    }

    /// Whether lights keep their colours where factors are sought.
    pub fn keep_colors(&mut self, keeps: bool) {
        self.keeps_colors = keeps;
    }

    /// The options of `pointillist mix` that set these factors; nothing where all are 1.
    pub fn options(&self) -> String {
        let changed = self.groups().iter().zip(self.factors()).filter(|(_, factor)| *factor != [1.0; 3]);
        let options: Vec<String> = changed.map(|(group, factor)| mix_option(&group.name, factor)).collect();
        options.join(" ")
    }

    /// What the panel shows.
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

    /// Tells what a mix would be of and take, unless that is known for this scene, size and method.
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

    /// Samples that the processor has drawn since the last call, and how long that took.
    pub fn take_host_time(&mut self) -> (u64, Duration) {
        let times = self.device_films().map(VulkanFilm::take_host_time);
        times.fold((0, Duration::ZERO), |(samples, time), (more, took)| (samples + more, time + took))
    }

    /// Whether the device has drawn all samples of the groups.
    pub fn are_drawn(&mut self, gpu: &Gpu) -> bool {
        self.device_films().all(|film| gpu.has_completed(film.rasterised()))
    }

    fn device_films(&mut self) -> impl Iterator<Item = &mut VulkanFilm> {
        self.films.iter_mut().flat_map(|films| films.films()).filter_map(|film| film.on_device())
    }

    /// Rasterises what waits.
    pub fn flush(&mut self) -> Result<(), ClientError> {
        self.films.as_mut().map_or(Ok(()), GroupFilms::flush)
    }

    /// Records the pictures of the groups, to be added up.
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

    /// The mix, scene-linear XYZ before glare and tone curve.
    pub fn linear(&mut self, settings: &Settings, size: [u32; 2]) -> Result<Grid<Vec3>, ClientError> {
        let [width, height] = size.map(|n| n as usize);
        let settings = Settings { glare: None, ..without_masking(settings) };
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

    /// Adds a place as a target: at first it is to be displayed as it is.
    ///
    /// # Errors
    ///
    /// When there are too many, and without samples.
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

    /// Gives a target another colour.
    pub fn set_target(&mut self, place: usize, color: MixRgb) {
        if let Some(target) = self.targets.get_mut(place) {
            target.color = color;
        }
    }

    /// Forgets a target.
    pub fn forget_target(&mut self, place: usize) {
        if place < self.targets.len() {
            self.targets.remove(place);
            self.spots = None;
        }
    }

    /// Finds the factors with which the targets are met as nearly as can be.
    ///
    /// # Errors
    ///
    /// Without targets, or without samples.
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

    /// The mean colours of the groups around the targets, read a few times a second at most.
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

    /// Finds the factors with which the mix looks most like this picture: a painted one, which was displayed by these settings, or one of
    /// linear light (EXR, HDR, PFM).
    ///
    /// # Errors
    ///
    /// When it cannot be read, has another size, or there are no samples.
    pub fn look_like(&mut self, path: &Path, settings: &Settings) -> Result<()> {
        let groups = self.pictures()?;
        let size = groups.first().map_or([0, 0], |picture| [picture.width(), picture.height()]);
        let most = usize::try_from(limits::FILM_PIXELS).unwrap_or(usize::MAX);
        let is_light = path.extension().is_some_and(|ending| {
            ["exr", "hdr", "pfm"].iter().any(|light| ending.eq_ignore_ascii_case(light))
        });
        // What was displayed is encoded by the gamma of the display.
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

    /// The linear pictures of all groups.
    fn pictures(&mut self) -> Result<Vec<Grid<MixRgb>>> {
        let Some(films) = &mut self.films else { return Err(miette!("the light mix is off")) };
        if films.films().iter().all(|film| film.counts().paths() == 0) {
            return Err(miette!("there is no picture of the lights yet: try again in a moment"));
        }
        films.pictures()
    }
}

/// The matrix on XYZ that multiplies linear Rec.709.
fn on_xyz(factor: MixRgb) -> Mat3 {
    let scale = Mat3::from_diagonal(Vec3::from(factor));
    xyz_from_rec709().as_mat3() * scale * rec709_from_xyz()
}

fn brightness(rgb: Vec3) -> f32 {
    rec709_luminance().dot(rgb)
}

/// The settings without masking of noise, which needs a variance that films of groups do not keep.
fn without_masking(settings: &Settings) -> Settings {
    Settings { vm: 0.0, ..settings.clone() }
}

/// The settings with which light is displayed as a picture without glare.
fn plain(settings: &Settings) -> Settings {
    Settings { glare: None, view: Default::default(), ..settings.clone() }
}

/// The light, linear Rec.709, that is displayed with this colour: of its chromaticity, and so bright that the tone curve makes it as bright.
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
    // Brightness grows with light; the interval covers what any exposure asks for.
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

    /// What a colour is displayed from is displayed with this colour, by every curve and exposure.
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
