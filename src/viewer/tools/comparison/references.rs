//! The pictures to compare with, snapshots of this session and EXR files, and their differences from the present one.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::Vec3;
use miette::{IntoDiagnostic, Result, miette};

use crate::client::pass::repaint::ShownTexels;
use crate::client::reference::ReferenceFilm;
use crate::client::window::panel::{ColorScale, FalseColorMap, MapChoice};
use crate::client::{Settings, develop};
use crate::color::Profile;
use crate::gpu::Region;
use crate::image::Grid;
use crate::image::compare::{MetricMap, PIXELS_PER_DEGREE, Picture, flip, luminance, rel_mse};
use crate::job::{Job, StopFlag};
use crate::study::ErrorQuantile;
use crate::study::format::{duration, percent};
use crate::viewer::picture::LivePicture;
use crate::viewer::session::RenderSession;
use crate::viewer::tools::comparison::tab::{
    CompareControls, CompareMode, ComparisonData, SmallPicture, SnapshotRow, THUMBNAIL,
};

/// Interval at which a difference is recomputed, since the present picture keeps changing.
const REFRESH: Duration = Duration::from_secs(1);

/// Reading the present picture back blocks the window; at most one part in `SHARE` of the time may be spent on it.
const SHARE: u32 = 20;

/// Upper bound on the memory of all reference pictures, in bytes. The oldest is dropped first; the last one always stays.
const MOST_BYTES: usize = 512 << 20;

/// Longest side, in pixels, of a reference that can be drawn over the present picture: a texture size that every device supports.
const LONGEST_SIDE: usize = 4096;

/// A reference picture.
struct KeptPicture {
    row: SnapshotRow,
    /// Scene-linear XYZ.
    xyz: Arc<Grid<Vec3>>,
    /// Error curve of its render: `[seconds, error]` at each checkpoint, error at 95 %.
    curve: Vec<[f64; 2]>,
}

/// Result of a comparison, computed on another thread.
struct Difference {
    mode: CompareMode,
    /// Inputs that this result was computed from.
    of: DifferenceKey,
    map: Arc<FalseColorMap>,
    summary: String,
}

/// Inputs of a comparison. The result is stale when they change.
#[derive(Clone)]
struct DifferenceKey {
    reference: Arc<Grid<Vec3>>,
    samples: u64,
    exposure: f32,
    size: [u32; 2],
}

impl DifferenceKey {
    fn is_of(&self, reference: &Arc<Grid<Vec3>>) -> bool {
        Arc::ptr_eq(&self.reference, reference)
    }
}

/// Reference pictures, and derived data of the selected one.
#[derive(Default)]
pub struct References {
    list: Vec<KeptPicture>,
    /// Number of the next snapshot.
    next: usize,
    /// The selected reference tone-mapped for display, with the settings used.
    displayed: Option<(Arc<Grid<Vec3>>, Settings, Arc<SmallPicture>)>,
    difference: Option<Difference>,
    /// Computation of the next difference.
    job: Option<Job<Result<Difference>>>,
    /// When the present picture was last read back for a difference, and how long that blocked.
    taken: Option<(Instant, Duration)>,
}

impl References {
    /// Keeps a snapshot of the displayed picture; returns its name.
    ///
    /// # Errors
    ///
    /// If there is no picture yet.
    pub fn keep(&mut self, session: &RenderSession, picture: &mut LivePicture) -> Result<String> {
        let size = session.size();
        let shown = whole(picture, size)?;
        let xyz = grid(size, &shown)?;
        let displayed =
            shown.displayed.iter().map(|rgb| rgb.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8));
        let displayed = SmallPicture { size: size.map(|n| n as usize), rgb: displayed.collect() };
        let counts = picture.counts();
        let per_pixel = counts.paths() as f64 / (f64::from(size[0]) * f64::from(size[1]));
        let scene = session.run_spec().scene.file_stem().map(|name| name.to_string_lossy().into_owned());
        let mut words = format!(
            "{}: {}, {per_pixel:.1} paths per pixel",
            scene.unwrap_or_default(),
            duration(session.elapsed().as_secs_f64())
        );
        let mut curve = Vec::new();
        if let Some(observer) = &picture.observer {
            let state = observer.state();
            curve = state.checkpoints.iter().map(|c| [c.seconds, c.error]).collect();
            if !curve.is_empty() {
                let p95 = state.estimate.relative[ErrorQuantile::P95.index()].value;
                words += &format!(", error {}", percent(p95));
            }
        }
        self.next += 1;
        let name = format!("Snapshot {}", self.next);
        self.add(
            SnapshotRow { name: name.clone(), words, thumbnail: thumbnail(&displayed).into() },
            xyz,
            curve,
        );
        Ok(name)
    }

    /// Reads a picture from an EXR file; returns its name.
    ///
    /// # Errors
    ///
    /// When the file cannot be read.
    pub fn read(&mut self, path: &Path) -> Result<String> {
        let picture = Picture::read(path, None).into_diagnostic()?;
        let to_xyz = Profile::srgb().from_xyz.inverse();
        let (width, height) = (picture.rgb.width(), picture.rgb.height());
        let pixels = picture.rgb.pixels().iter().map(|rgb| to_xyz * Vec3::from(*rgb)).collect();
        let xyz = Grid::from_rows(width, height, pixels).ok_or_else(|| miette!("no memory"))?;
        let displayed = displayed(&xyz, &Settings::default())?;
        let name = path.file_name().map_or("picture".into(), |name| name.to_string_lossy().into_owned());
        let row = SnapshotRow {
            name: name.clone(),
            words: format!("{width}×{height} pixels"),
            thumbnail: thumbnail(&displayed).into(),
        };
        self.add(row, xyz, Vec::new());
        Ok(name)
    }

    fn add(&mut self, row: SnapshotRow, xyz: Grid<Vec3>, curve: Vec<[f64; 2]>) {
        self.list.push(KeptPicture { row, xyz: Arc::new(xyz), curve });
        let bytes =
            |list: &[KeptPicture]| list.iter().map(|kept| size_of_val(kept.xyz.pixels())).sum::<usize>();
        while self.list.len() > 1 && bytes(&self.list) > MOST_BYTES {
            self.list.remove(0);
        }
    }

    /// Removes a reference from the list.
    pub fn forget(&mut self, place: usize) {
        if place < self.list.len() {
            self.list.remove(place);
            (self.displayed, self.difference) = (None, None);
        }
    }

    /// Index of the last reference in the list.
    pub fn last(&self) -> usize {
        self.list.len().saturating_sub(1)
    }

    /// Whether the list is empty.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Whether a difference is being computed.
    pub fn is_busy(&self) -> bool {
        self.job.as_ref().is_some_and(|job| !job.is_finished())
    }

    /// Error curve of the selected reference, if the comparison is shown.
    pub fn curve(&self, controls: &CompareControls) -> Vec<[f64; 2]> {
        let chosen = self.list.get(controls.chosen).filter(|_| controls.is_shown);
        chosen.map(|snapshot| snapshot.curve.clone()).unwrap_or_default()
    }

    /// False-colour map of the difference, if it is shown.
    pub fn map(&self, controls: &CompareControls) -> Option<Arc<FalseColorMap>> {
        let chosen = &self.list.get(controls.chosen).filter(|_| controls.is_shown)?.xyz;
        let difference = self.difference.as_ref().filter(|difference| difference.of.is_of(chosen));
        difference
            .filter(|difference| difference.mode == controls.mode)
            .map(|difference| difference.map.clone())
    }

    /// Data for the panel; recomputes a stale difference if it is shown.
    pub fn data(
        &mut self,
        controls: &CompareControls,
        settings: &Settings,
        session: &RenderSession,
        picture: &mut LivePicture,
    ) -> ComparisonData {
        let rows = self.list.iter().map(|snapshot| snapshot.row.clone()).collect();
        let mut data = ComparisonData { rows, ..ComparisonData::default() };
        if !controls.is_shown {
            return data;
        }
        let Some(xyz) = self.list.get(controls.chosen).map(|snapshot| snapshot.xyz.clone()) else {
            return data;
        };
        let outcome = match controls.mode {
            CompareMode::Whole | CompareMode::Split => {
                self.displayed(&xyz, settings).map(|displayed| data.picture = Some(displayed))
            }
            mode => self.refresh(mode, &xyz, settings, session, picture),
        };
        data.summary = match (&self.difference, outcome) {
            (_, Err(error)) => error.to_string(),
            (Some(difference), _) if difference.mode == controls.mode && difference.of.is_of(&xyz) => {
                difference.summary.clone()
            }
            _ => String::new(),
        };
        data
    }

    /// Tone-maps a reference with the present settings.
    fn displayed(&mut self, xyz: &Arc<Grid<Vec3>>, settings: &Settings) -> Result<Arc<SmallPicture>> {
        if let Some((known, by, displayed)) = &self.displayed
            && Arc::ptr_eq(known, xyz)
            && by == settings
        {
            return Ok(displayed.clone());
        }
        if xyz.width().max(xyz.height()) > LONGEST_SIDE {
            return Err(miette!(
                "pictures of more than {LONGEST_SIDE} pixels along a side are not drawn over it"
            ));
        }
        // The snapshot already contains glare and post-processes.
        let picture = Arc::new(displayed(xyz, &settings.before_glare())?);
        self.displayed = Some((xyz.clone(), settings.clone(), picture.clone()));
        Ok(picture)
    }

    /// Takes over a finished difference and begins the next one when it is due.
    fn refresh(
        &mut self,
        mode: CompareMode,
        reference: &Arc<Grid<Vec3>>,
        settings: &Settings,
        session: &RenderSession,
        picture: &mut LivePicture,
    ) -> Result<()> {
        if let Some(difference) = Job::take(&mut self.job) {
            self.difference = Some(difference.into_diagnostic()??);
        }
        let counts = picture.counts();
        let of = DifferenceKey {
            reference: reference.clone(),
            samples: counts.camera_samples + counts.light_samples,
            exposure: settings.exposure,
            size: session.size(),
        };
        let is_due = self.difference.as_ref().is_none_or(|known| {
            let changed = known.of.samples != of.samples || known.of.exposure != of.exposure;
            let changed = changed || known.of.size != of.size;
            let rested = self.taken.is_none_or(|(taken, took)| taken.elapsed() > REFRESH.max(SHARE * took));
            known.mode != mode || !known.of.is_of(reference) || changed && rested
        });
        if self.job.is_some() || !is_due {
            return Ok(());
        }
        let size @ [width, height] = session.size();
        if [reference.width(), reference.height()] != size.map(|n| n as usize) {
            self.difference = None;
            let (w, h) = (reference.width(), reference.height());
            return Err(miette!("it has {w}×{h} pixels and the picture {width}×{height}: no difference"));
        }
        if reference.width().max(reference.height()) > LONGEST_SIDE {
            return Err(miette!(
                "pictures of more than {LONGEST_SIDE} pixels along a side are not drawn over it"
            ));
        }
        let start = Instant::now();
        let present = grid(size, &whole(picture, size)?)?;
        self.taken = Some((start, start.elapsed()));
        let settings = settings.clone();
        let compute = move |_: &StopFlag| difference(mode, &present, of, &settings);
        self.job = Some(Job::start("the comparison", compute).into_diagnostic()?);
        Ok(())
    }
}

/// Difference of two pictures of equal size.
fn difference(
    mode: CompareMode,
    present: &Grid<Vec3>,
    of: DifferenceKey,
    settings: &Settings,
) -> Result<Difference> {
    let from_xyz = Profile::srgb().from_xyz;
    let rgb = |xyz: &Grid<Vec3>| {
        let pixels = xyz.pixels().iter().map(|xyz| (from_xyz * *xyz).to_array()).collect();
        Grid::from_rows(xyz.width(), xyz.height(), pixels).ok_or_else(|| miette!("no memory"))
    };
    let (a, b) = (rgb(present)?, rgb(&of.reference)?);
    let error = rel_mse(&a, &b).into_diagnostic()?.trimmed;
    let (map, summary) = match mode {
        CompareMode::Flip => {
            let shown =
                |rgb| develop::shown(rgb, &Settings { exposure: settings.exposure, ..Settings::default() });
            let MetricMap { map, mean, .. } =
                flip(&shown(&a), &shown(&b), PIXELS_PER_DEGREE).into_diagnostic()?;
            let values = map.pixels().iter().map(|v| f64::from(*v)).collect::<Vec<_>>();
            (values, format!("FLIP {mean:.4}, relMSE {error:.2e}"))
        }
        _ => {
            let mean =
                b.pixels().iter().map(|rgb| luminance(*rgb)).sum::<f64>() / b.pixels().len().max(1) as f64;
            let away = |(a, b): (&[f32; 3], &[f32; 3])| {
                let (a, b) = (luminance(*a), luminance(*b));
                (a - b).abs() / (b.abs() + 0.01 * mean).max(1e-30)
            };
            let values: Vec<f64> = a.pixels().iter().zip(b.pixels()).map(away).collect();
            let average = values.iter().sum::<f64>() / values.len().max(1) as f64;
            (values, format!("mean difference {}, relMSE {error:.2e}", percent(average)))
        }
    };
    let grid = [present.width(), present.height()];
    let (kind, scale) = match mode {
        CompareMode::Flip => (MapChoice::Flip, ColorScale { low: 0.0, high: 0.5, logarithmic: false }),
        _ => (MapChoice::Difference, ColorScale { low: 0.001, high: 1.0, logarithmic: true }),
    };
    let cells = grid.map(|n| n as f64);
    let map = Arc::new(FalseColorMap { kind, grid, cells, values: map, scale, shares: Vec::new() });
    Ok(Difference { mode, of, map, summary })
}

/// Reads back the whole displayed picture.
fn whole(picture: &mut LivePicture, size: [u32; 2]) -> Result<ShownTexels> {
    let shown = picture.shown(Region { origin: [0, 0], extent: size }).into_diagnostic()?;
    shown.ok_or_else(|| miette!("there is no picture yet"))
}

fn grid([width, height]: [u32; 2], shown: &ShownTexels) -> Result<Grid<Vec3>> {
    let pixels = shown.xyz.iter().map(|xyz| Vec3::from(*xyz)).collect();
    Grid::from_rows(width as usize, height as usize, pixels)
        .ok_or_else(|| miette!("no memory for a snapshot"))
}

fn displayed(xyz: &Grid<Vec3>, settings: &Settings) -> Result<SmallPicture> {
    let shown = ReferenceFilm::show(xyz, settings).into_diagnostic()?;
    Ok(SmallPicture { size: [xyz.width(), xyz.height()], rgb: shown.rgb })
}

/// Downsamples a picture to a thumbnail by taking the central pixel of each square.
fn thumbnail(picture: &SmallPicture) -> SmallPicture {
    let [width, height] = picture.size;
    let scale =
        (width as f64 / f64::from(THUMBNAIL[0])).max(height as f64 / f64::from(THUMBNAIL[1])).max(1.0);
    let size = [width, height].map(|n| ((n as f64 / scale).round() as usize).max(1));
    let at = |i: usize, n: usize| (((i as f64 + 0.5) * scale) as usize).min(n - 1);
    let places = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
    let rgb = places.map(|(x, y)| picture.rgb[at(y, height) * width + at(x, width)]).collect();
    SmallPicture { size, rgb }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_pictures_have_no_difference() {
        let grid = |value: f32| Grid::from_rows(16, 8, vec![Vec3::splat(value); 128]).expect("a grid");
        let of = |value: f32| DifferenceKey {
            reference: grid(value).into(),
            samples: 1,
            exposure: 1.0,
            size: [1, 1],
        };
        for mode in [CompareMode::Difference, CompareMode::Flip] {
            let same = difference(mode, &grid(0.5), of(0.5), &Settings::default()).expect("same size");
            assert!(same.map.values.iter().all(|v| *v == 0.0), "{}", same.summary);
            let other = difference(mode, &grid(0.5), of(0.4), &Settings::default()).expect("same size");
            assert!(other.map.values.iter().all(|v| *v > 0.0), "{}", other.summary);
        }
        let other = difference(CompareMode::Difference, &grid(0.5), of(0.4), &Settings::default());
        let summary = other.expect("same size").summary;
        assert!(summary.starts_with("mean difference 24.8 %"), "{summary}");
    }

    #[test]
    fn thumbnails_fit() {
        let picture = SmallPicture { size: [640, 200], rgb: vec![[7; 3]; 128_000] };
        assert_eq!(thumbnail(&picture).size, [96, 30]);
        let tiny = SmallPicture { size: [3, 2], rgb: vec![[7; 3]; 6] };
        assert_eq!(thumbnail(&tiny), tiny);
    }
}
