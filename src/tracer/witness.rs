//! Witnesses: a few paths that look for light which the method of a render may not find.
//!
//! A method cannot estimate light that its own paths have not met yet. Other methods can: bidirectional subpaths find light around corners and
//! caustics on directly visible surfaces, and photons find caustics behind mirrors and glass. A [`Witness`] traces a few paths of both kinds and sums
//! the light of each area of a coarse grid over the picture, and separately that of caustics, for which photons have little
//! noise. `highlights` are found one by one. Nothing of this enters the picture.
//!
//! Caustics behind mirrors and glass are blurred over the lookup disc of the photons, as in [`VcmTracer`](super::integrator::VcmTracer). All other
//! estimates are unbiased, except that single samples much brighter than the rest of their area, such as highlights, are left out.

use std::sync::Arc;

use glam::Vec3;

use crate::color::Xyz;
use crate::color::profile::rec709_from_xyz;
use crate::math::bits::mix;
use crate::scene::desc::{IntegratorKind, LateFind};
use crate::stream::{Highlight, PathCounts, SampleSink, UvWindow, Witnessed, WitnessedArea};
use crate::tracer::MaterialClass;
use crate::tracer::highlights::HighlightFinder;
use crate::tracer::integrator::{CausticWitness, RenderContext, SeenCaustic, WitnessScratch};

/// Cells in which highlights are looked for, for each path of the witnesses.
const CELLS_PER_PATH: f64 = 4.0;

/// Most cells in which highlights are looked for, but one in each area.
const CELLS: f64 = 131_072.0;

/// Cells along a side of an area.
const CELLS_PER_SIDE: [u32; 10] = [1, 2, 3, 4, 6, 8, 11, 16, 23, 32];

/// Two independent witnesses of the view of `context`, in areas of `side` pixels squared: what both have found of a picture of some size once they
/// have traced so many paths together, and the highlights in it. They are made when they are called first, and anew for another size. They look for
/// what this method finds late, if at all; `None` where that is nothing.
pub fn pair(
    context: RenderContext,
    side: u32,
    method: IntegratorKind,
) -> Option<impl FnMut(u64, [u32; 2]) -> Witnessed + Send + 'static> {
    let all = match method.traits().finds_late {
        LateFind::Nothing => return None,
        LateFind::Highlights => None,
        LateFind::SeenCaustics => Some(false),
        LateFind::Indirect => Some(true),
    };
    let context = RenderContext { window: UvWindow::PICTURE, ..context };
    let has_mirrors =
        context.scene.material_class() != MaterialClass::Diffuse && method.traits().finds_deltas;
    let mut made: Option<[Witness; 2]> = None;
    let mut highlights: Option<KnownHighlights> = None;
    Some(move |paths: u64, size: [u32; 2]| {
        let areas = all.map(|all| {
            let make = |number| {
                let seed = mix(u64::from(context.seed) << 32 | number) as u32;
                Witness::new(&RenderContext { seed, ..context.clone() }, size, side, all)
            };
            let known = made.take().filter(|both| both[0].grid.size == size);
            let both = made.insert(known.unwrap_or_else(|| [0, 1].map(make)));
            both.each_mut().map(|witness| {
                witness.trace(paths / 2);
                witness.areas()
            })
        });
        let highlights = has_mirrors.then(|| {
            let known = highlights.take().filter(|known| known.finder.size() == size);
            let none = || KnownHighlights::none(&context, size, side);
            highlights.insert(known.unwrap_or_else(none)).at_least(paths)
        });
        Witnessed { areas: areas.unwrap_or_default(), highlights: highlights.unwrap_or_default() }
    })
}

/// Highlights of a picture, which were looked for in so many cells along a side of each area.
struct KnownHighlights {
    finder: HighlightFinder,
    cells: u32,
    found: Arc<[Highlight]>,
}

impl KnownHighlights {
    /// Nothing is known yet of this picture.
    fn none(context: &RenderContext, size: [u32; 2], side: u32) -> Self {
        Self { finder: HighlightFinder::new(context.clone(), size, side), cells: 0, found: Arc::default() }
    }

    /// Those in as many cells as so many paths of witnesses are worth.
    fn at_least(&mut self, paths: u64) -> Arc<[Highlight]> {
        let per_area = (paths as f64 * CELLS_PER_PATH).min(CELLS) / self.finder.areas().max(1) as f64;
        // As many as the paths tell, so that a render that is resumed states the same; each time about twice as many.
        let enough = |cells: &&u32| f64::from(**cells * **cells) <= per_area;
        let cells = CELLS_PER_SIDE.iter().rfind(enough).copied().unwrap_or(1);
        if cells != self.cells {
            (self.cells, self.found) = (cells, self.finder.find(cells).into());
        }
        self.found.clone()
    }
}

/// A sample of more than so many times the mean of the others in its area is left out, where there are enough others.
const RARE: f64 = 8.0;

/// And where it carries at least this share of what they do.
const SHARE: f64 = 0.125;

/// Enough others.
const FEW: f64 = 7.0;

/// One witness: its paths are independent of those of any render, and of other witnesses.
#[derive(Debug)]
pub struct Witness {
    tracer: CausticWitness,
    scratch: WitnessScratch,
    grid: AreaGrid,
    areas: Vec<WitnessedArea>,
    /// The largest luminance of a camera sample in each.
    largest: Vec<f64>,
    /// The next index, and light paths so far.
    next: u64,
    light_paths: u64,
}

impl Witness {
    /// A witness for the picture of `context`, of `size` pixels, in areas of `side` pixels squared. The caustics that it tells apart are those behind mirrors
    /// and glass, which no connection of subpaths finds; or `all`, as a method needs it that does not connect them to the camera.
    pub fn new(context: &RenderContext, size: [u32; 2], side: u32, all: bool) -> Self {
        let grid = AreaGrid { size, side };
        let [columns, rows] = grid.extent();
        Self {
            tracer: CausticWitness::new(context, all),
            scratch: WitnessScratch::default(),
            grid,
            areas: vec![WitnessedArea { areas: 1.0, ..WitnessedArea::default() }; columns * rows],
            largest: vec![0.0; columns * rows],
            next: 0,
            light_paths: 0,
        }
    }

    /// Goes on to at least so many camera paths in all.
    pub fn trace(&mut self, paths: u64) {
        let PathCounts { camera, light } = self.tracer.paths_per_index();
        let (end, to_rgb) = (paths.div_ceil(camera), rec709_from_xyz());
        let mut found = AreaSink { grid: self.grid, areas: &mut self.areas, largest: &mut self.largest };
        for index in self.next..end {
            self.tracer.trace(index, &mut self.scratch, &mut found);
            for SeenCaustic { uv, color, photons } in self.scratch.caustics.drain(..) {
                if let Some(i) = found.at(uv) {
                    let rgb = to_rgb * Vec3::new(color.x, color.y, color.z);
                    let squares = [f64::from(color.y).powi(2), f64::from(rgb.length_squared()) / 3.0];
                    let area = &mut found.areas[i];
                    area.caustics += f64::from(color.y);
                    area.caustic_squares = [0, 1].map(|k| area.caustic_squares[k] + squares[k]);
                    // The square of a sum of photons exceeds that of its expectation by the sum of their squares.
                    area.caustic_pairs += squares[0] * (1.0 - 1.0 / f64::from(photons.max(1.0)));
                }
            }
        }
        let end = end.max(self.next);
        self.light_paths += (end - self.next) * light;
        self.next = end;
    }

    /// The estimate for each area so far, row by row.
    pub fn areas(&self) -> Vec<WitnessedArea> {
        let scaled = |(i, area): (usize, &WitnessedArea)| {
            let scale = 1.0 / (self.grid.uv_area(i) * (self.light_paths as f64).max(1.0));
            let [sum, squares] = area.light;
            let mut area = WitnessedArea { light: [sum * scale, squares * scale * scale], ..*area };
            // A highlight that one sample has met would count for all of its area, and those that none has met for nothing.
            let (largest, others) = (self.largest[i], area.samples - 1.0);
            let rest = area.camera[0] - largest;
            if others >= FEW && largest > RARE * rest / others && largest > SHARE * rest {
                area.camera = [area.camera[0] - largest, area.camera[1] - largest * largest];
                area.samples = others;
            }
            area
        };
        self.areas.iter().enumerate().map(scaled).collect()
    }
}

/// The areas of a picture: squares, of which the last of a row or column may reach beyond it.
#[derive(Clone, Copy, Debug)]
struct AreaGrid {
    /// Pixels of the picture.
    size: [u32; 2],
    /// Pixels along a side of an area.
    side: u32,
}

impl AreaGrid {
    /// Columns and rows.
    fn extent(&self) -> [usize; 2] {
        self.size.map(|n| n.div_ceil(self.side) as usize)
    }

    /// The share of the picture that area `i` has.
    fn uv_area(&self, i: usize) -> f64 {
        let columns = self.extent()[0];
        let share = |at: usize, n: u32| f64::from((n - at as u32 * self.side).min(self.side)) / f64::from(n);
        share(i % columns, self.size[0]) * share(i / columns, self.size[1])
    }
}

/// Sums up samples by area.
struct AreaSink<'a> {
    grid: AreaGrid,
    areas: &'a mut [WitnessedArea],
    largest: &'a mut [f64],
}

impl AreaSink<'_> {
    /// The area that a place on the screen lies in.
    fn at(&self, uv: [f32; 2]) -> Option<usize> {
        let AreaGrid { size: [width, height], side } = self.grid;
        let [x, y] = [uv[0] * width as f32, uv[1] * height as f32];
        // False for NaN.
        let inside = x >= 0.0 && y >= 0.0 && x < width as f32 && y < height as f32;
        let [column, row] = [x, y].map(|n| n as usize / side as usize);
        inside.then(|| row * self.grid.extent()[0] + column)
    }
}

impl SampleSink for AreaSink<'_> {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        let y = f64::from(value.y * weight);
        if let Some(i) = self.at(uv).filter(|_| y.is_finite()) {
            let area = &mut self.areas[i];
            area.samples += 1.0;
            area.camera = [area.camera[0] + y, area.camera[1] + y * y];
            self.largest[i] = self.largest[i].max(y);
        }
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        let y = f64::from(value.y);
        if let Some(i) = self.at(uv).filter(|_| y.is_finite()) {
            let area = &mut self.areas[i];
            area.light = [area.light[0] + y, area.light[1] + y * y];
        }
    }
}
