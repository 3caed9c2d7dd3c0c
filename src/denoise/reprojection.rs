//! Reprojection after a camera move: the last picture is transferred to the new view where both show the same surface point.
//!
//! The reprojected picture is displayed until there are enough samples, with a weight in equivalent samples per pixel; it never enters
//! the sums or files. Disoccluded surfaces are filled in from their surroundings and the first samples (Bishop et al. 1994, Dayal et al.
//! 2005).

use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;

use crate::denoise::filtered_picture::{FilteredPicture, HalfMeans};
use crate::denoise::steering::SteeringMap;
use crate::denoise::view_filter::FeatureGrid;
use crate::image::{Grid, push_pull};
use crate::study::Replicates;
use crate::tracer::Camera;
use crate::tracer::camera::CameraLines;
use crate::tracer::features::Features;

/// Upper bound on the weight of a reprojected picture, samples per pixel.
pub const MOST_WORTH: f32 = 4.0;

/// Factor on the weight behind a mirror, glass or a medium: reflections in curved surfaces move with the camera, and light scattered in a medium
/// comes from many distances.
const DETACHED_WORTH: f32 = 0.25;

/// Once the samples exceed [`MOST_WORTH`] by this factor, the reprojected picture is dropped.
const GONE: f32 = 4.0;

/// Tolerance between a surface point and the surface hit in the other view, relative to the camera distance; behind mirrors, glass and media,
/// relative tolerance of the path lengths.
const SAME_PLACE: f32 = 0.01;
const SAME_DISTANCE: f32 = 0.03;

/// Smallest cosine between normals of the same surface.
const SAME_NORMAL: f32 = 0.8;

/// Largest difference of albedo on the same surface behind mirrors or media.
const SAME_ALBEDO: f32 = 0.1;

/// Smallest sum of bilinear weights of pixels that show the same surface.
const LEAST_SEEN: f32 = 0.1;

/// Smallest known fraction of a picture that may be displayed without samples: with less, most of the filled-in content is wrong.
const LEAST_KNOWN: f32 = 0.6;

/// Side of the blocks in which reprojected picture and samples are compared, pixels.
const BLOCK: usize = 16;

/// Number of samples, in a pixel or in the area of a coarser one, that suffice to fill it in.
const ENOUGH: f32 = 4.0;

/// Surface points seen by the pixels of a view.
pub struct ViewSurfaces {
    /// `None` for a camera whose picture is not carried over to another view.
    lines: Option<CameraLines>,
    /// Width and height in pixels.
    size: [usize; 2],
    /// Pixels between neighbouring hits, per axis.
    step: usize,
    hits: Grid<Features>,
    /// World-space positions; behind mirrors those of the mirror image, in media those at the mean distance.
    places: Grid<Vec3>,
}

impl ViewSurfaces {
    /// From the first hits of these rays over a picture of `size` pixels. `None` if memory runs out.
    pub fn new(camera: &Camera, size: [usize; 2], rays: FeatureGrid, hits: Grid<Features>) -> Option<Self> {
        let [width, height] = [hits.width(), hits.height()];
        let mut places = Grid::try_filled(width, height, Vec3::ZERO)?;
        places.pixels_mut().par_chunks_mut(width).zip(hits.pixels().par_chunks(width)).enumerate().for_each(
            |(y, (places, hits))| {
                for (x, (place, hit)) in places.iter_mut().zip(hits).enumerate() {
                    let Some(ray) = rays.ray(camera, [x, y], size) else { continue };
                    *place = ray.origin + ray.direction * hit.distance;
                }
            },
        );
        Some(Self { lines: camera.lines(), size, step: rays.step, hits, places })
    }

    /// Width and height of the picture in pixels.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// First hits of the rays.
    pub fn hits(&self) -> &Grid<Features> {
        &self.hits
    }
}

/// The last picture of a view, and the first hit of each pixel.
pub struct KnownView {
    pub surfaces: Arc<ViewSurfaces>,
    pub picture: FilteredPicture,
    /// Weight in equivalent samples per pixel.
    pub worth: Grid<f32>,
    /// Number of moves that its samples have been carried over, on average; `None` where samples are not steered.
    pub moves: Option<Grid<f32>>,
}

/// The mean of a reprojected picture and the samples of the present view.
pub struct MixedView {
    pub picture: FilteredPicture,
    /// As [`KnownView::worth`].
    pub worth: Grid<f32>,
    /// As [`KnownView::moves`].
    pub moves: Option<Grid<f32>>,
}

/// A picture reprojected to the present view.
pub struct Prior {
    /// XYZ; zero where unknown.
    picture: Grid<Vec3>,
    /// Weight in equivalent samples per pixel; 0 where unknown.
    worth: Grid<f32>,
    /// Number of moves that its samples have been carried over, this one included; `None` where that is not known.
    moves: Option<Grid<f32>>,
}

/// What a view shows at a pixel of another one.
struct CarriedPixel {
    /// XYZ.
    picture: Vec3,
    /// Weight in equivalent samples.
    worth: f32,
    /// Earlier moves that its samples have been carried over.
    moves: f32,
}

impl Prior {
    /// Reprojects a known view to the camera of `to`. `None` if memory runs out, and if a picture of either camera has no straight
    /// [lines](Camera::lines).
    pub fn new(known: &KnownView, to: &ViewSurfaces) -> Option<Self> {
        let lines = [known.surfaces.lines?, to.lines?];
        let [width, height] = to.size;
        let mut picture = Grid::try_filled(width, height, Vec3::ZERO)?;
        let mut worth = Grid::try_filled(width, height, 0.0)?;
        let mut moves = grid_if(known.moves.is_some(), to.size)?;
        let rows = picture.pixels_mut().par_chunks_mut(width).zip(worth.pixels_mut().par_chunks_mut(width));
        rows.zip(rows_of(&mut moves, height)).enumerate().for_each(|(y, ((picture, worth), mut moves))| {
            for (x, (picture, worth)) in picture.iter_mut().zip(worth).enumerate() {
                if let Some(seen) = look_up(known, to, lines, [x, y]) {
                    (*picture, *worth) = (seen.picture, seen.worth);
                    if let Some(moves) = &mut moves {
                        moves[x] = seen.moves + 1.0;
                    }
                }
            }
        });
        Some(Self { picture, worth, moves })
    }

    /// Whether enough is known to display it without samples.
    pub fn is_enough(&self) -> bool {
        is_enough(self.worth.pixels().iter().copied())
    }

    /// Picture to display before there are enough samples for a filter: unknown pixels are filled in from their surroundings and the
    /// samples so far, if any. `None` if memory runs out.
    pub fn filled(&self, samples: &Replicates) -> Option<FilteredPicture> {
        let [width, height] = [self.picture.width(), self.picture.height()];
        let mut finest = Grid::try_filled(width, height, Vec4::ZERO)?;
        let rows = finest.pixels_mut().par_chunks_mut(width).enumerate();
        rows.for_each(|(y, out)| {
            for (x, out) in out.iter_mut().enumerate() {
                *out = self.picture.at(x, y).extend(1.0) * ENOUGH;
                if self.worth.at(x, y) == 0.0 {
                    *out = samples.pixel(x, y).into();
                }
            }
        });
        push_pull::fill(finest, ENOUGH).map(FilteredPicture::from)
    }

    /// Weighted mean of the denoised picture of the samples so far (`samples` per pixel, of which some may have been `steered`) and the
    /// reprojected one, and the weight of the result. Where the samples contradict, the reprojected picture gets a smaller weight. `None`
    /// if memory runs out.
    pub fn mixed(
        &self,
        halves: &HalfMeans,
        filtered: &FilteredPicture,
        samples: f32,
        steered: Option<&SteeringMap>,
    ) -> Option<MixedView> {
        let size @ [width, height] = [self.picture.width(), self.picture.height()];
        let trust = self.trust(halves)?;
        let fade = (1.0 - samples / (GONE * MOST_WORTH)).max(0.0);
        let mut picture = Grid::try_filled(width, height, Vec3::ZERO)?;
        let mut worth = Grid::try_filled(width, height, 0.0)?;
        let mut moves = grid_if(steered.is_some(), size)?;
        let rows = picture.pixels_mut().par_chunks_mut(width).zip(worth.pixels_mut().par_chunks_mut(width));
        rows.zip(rows_of(&mut moves, height)).enumerate().for_each(|(y, ((picture, worth), mut moves))| {
            for (x, (picture, worth)) in picture.iter_mut().zip(worth).enumerate() {
                let old = self.worth.at(x, y) * fade * between_blocks(&trust, [x, y]);
                *worth = old + steered.map_or(samples, |map| map.effective_samples([x, y], samples));
                let share = old / worth.max(f32::MIN_POSITIVE);
                *picture = filtered.xyz().at(x, y).lerp(self.picture.at(x, y), share);
                if let Some(moves) = &mut moves {
                    moves[x] = share * self.moves.as_ref().map_or(1.0, |moves| moves.at(x, y));
                }
            }
        });
        Some(MixedView { picture: picture.into(), worth, moves })
    }

    /// Whether the reprojected picture is dropped at this many samples per pixel.
    pub fn is_gone(samples: f32) -> bool {
        samples >= GONE * MOST_WORTH
    }

    /// Agreement with the samples per block: variance of the samples' mean over the mean squared difference. `None` if memory runs out.
    fn trust(&self, halves: &HalfMeans) -> Option<Grid<f32>> {
        let [width, height] = [self.picture.width(), self.picture.height()];
        let blocks = [width, height].map(|n| n.div_ceil(BLOCK));
        // Per block and half: luminance and number of the samples, and luminance of the reprojected picture in the same pixels.
        let compared = |i: usize| {
            let [left, top] = [i % blocks[0], i / blocks[0]].map(|n| n * BLOCK);
            let (mut sums, mut counts, mut known) = ([0.0f32; 2], [0.0f32; 2], 0.0);
            for y in top..(top + BLOCK).min(height) {
                for x in left..(left + BLOCK).min(width) {
                    if self.worth.at(x, y) > 0.0 {
                        for half in 0..2 {
                            let seen = halves.0[half].at(x, y);
                            if seen.w > 0.0 {
                                sums[half] += seen.y * seen.w;
                                counts[half] += seen.w;
                                known += self.picture.at(x, y).y * seen.w;
                            }
                        }
                    }
                }
            }
            let both = counts[0] + counts[1];
            let enough = counts[0] > 0.0 && counts[1] > 0.0;
            let noise = if enough { 0.5 * (sums[0] / counts[0] - sums[1] / counts[1]) } else { 0.0 };
            let difference = if enough { (sums[0] + sums[1] - known) / both } else { 0.0 };
            [noise * noise, difference * difference]
        };
        let squares: Vec<_> = (0..blocks[0] * blocks[1]).into_par_iter().map(compared).collect();
        let squares = Grid::from_rows(blocks[0], blocks[1], squares)?;
        let trusted = |i: usize| {
            let [x, y] = [i % blocks[0], i / blocks[0]];
            let near = |at: usize, size: usize| at.saturating_sub(1)..(at + 2).min(size);
            let around = near(y, blocks[1]).flat_map(|y| near(x, blocks[0]).map(move |x| [x, y]));
            let [noise, difference] =
                around.fold([0.0; 2], |sum, [x, y]| [0, 1].map(|i| sum[i] + squares.at(x, y)[i]));
            // A difference of up to twice the noise is no contradiction.
            let excess = (difference - 4.0 * noise).max(0.0);
            if excess > 0.0 { noise / (noise + excess) } else { 1.0 }
        };
        Grid::from_rows(blocks[0], blocks[1], (0..blocks[0] * blocks[1]).map(trusted).collect())
    }
}

/// What a known view is worth at a place of another one.
#[derive(Clone, Copy, Debug)]
pub struct CarriedWorth {
    pub uv: [f32; 2],
    /// Equivalent samples per pixel; 0 where unknown.
    pub samples: f32,
    /// Number of moves that they have been carried over, this one included.
    pub moves: f32,
}

/// What a known view is worth at one pixel for each ray of `to`; as much as can be where the ray hits nothing. `None` if it shows too little to be displayed, and if a picture of either
/// camera has no straight [lines](Camera::lines).
pub fn carried_worth(known: &KnownView, to: &ViewSurfaces) -> Option<Vec<CarriedWorth>> {
    let lines = [known.surfaces.lines?, to.lines?];
    let [columns, rows] = [to.hits.width(), to.hits.height()];
    let at_ray = |ray: usize| {
        let middle = |at: usize, size: usize| (at * to.step + to.step / 2).min(size - 1);
        let pixel = [middle(ray % columns, to.size[0]), middle(ray / columns, to.size[1])];
        let uv = [0, 1].map(|i| (pixel[i] as f32 + 0.5) / to.size[i] as f32);
        let seen = look_up(known, to, lines, pixel);
        let [samples, moves] = seen.map_or([0.0; 2], |seen| [seen.worth, seen.moves + 1.0]);
        // What is infinitely far is seen without noise, and needs no samples.
        let is_noiseless = is_sky(&to.hits.at(ray % columns, ray / columns));
        let needed = if is_noiseless { [MOST_WORTH, 0.0] } else { [samples, moves] };
        (samples, CarriedWorth { uv, samples: needed[0], moves: needed[1] })
    };
    let (known, carried): (Vec<f32>, Vec<CarriedWorth>) =
        (0..columns * rows).into_par_iter().map(at_ray).unzip();
    is_enough(known.into_iter()).then_some(carried)
}

/// Whether enough is known with these numbers of equivalent samples to display it without samples.
fn is_enough(worth: impl ExactSizeIterator<Item = f32>) -> bool {
    let all = worth.len();
    worth.filter(|worth| *worth > 0.0).count() as f32 >= LEAST_KNOWN * all as f32
}

/// A grid of this size if it `is_wanted`. `None` if memory runs out.
fn grid_if(is_wanted: bool, [width, height]: [usize; 2]) -> Option<Option<Grid<f32>>> {
    if is_wanted { Grid::try_filled(width, height, 0.0).map(Some) } else { Some(None) }
}

/// The rows of a grid, if there is one, of `height` rows.
fn rows_of(grid: &mut Option<Grid<f32>>, height: usize) -> Vec<Option<&mut [f32]>> {
    match grid {
        Some(grid) => {
            let width = grid.width();
            grid.pixels_mut().chunks_mut(width).map(Some).collect()
        }
        None => std::iter::repeat_with(|| None).take(height).collect(),
    }
}

/// What a known view shows at a pixel.
fn look_up(
    known: &KnownView,
    to: &ViewSurfaces,
    [from_lines, to_lines]: [CameraLines; 2],
    [x, y]: [usize; 2],
) -> Option<CarriedPixel> {
    let size = to.size;
    let near = [x / to.step, y / to.step];
    let hit = to.hits.at(near[0], near[1]);
    let uv = Vec2::new((x as f32 + 0.5) / size[0] as f32, (y as f32 + 0.5) / size[1] as f32);
    let (origin, direction) = to_lines.line(uv);
    let from = &known.surfaces;
    let is_sky = is_sky(&hit);
    let place = match hit.is_detached {
        true => origin + direction * (hit.distance / direction.length()),
        false => on_centre(to.places.at(near[0], near[1]), hit, origin, direction),
    };
    let (uv, distance) = match is_sky {
        true => (from_lines.project_direction(direction)?, 0.0),
        false => from_lines.project(place)?,
    };
    let (_, direction_there) = from_lines.line(uv);
    let is_front = |normal: Vec3, direction: Vec3| normal.dot(direction) < 0.0;
    let is_same = |x: usize, y: usize| {
        let there = from.hits.at(x, y);
        if there.is_detached != hit.is_detached || self::is_sky(&there) != is_sky {
            return false;
        }
        match (is_sky, hit.is_detached) {
            (true, _) => true,
            (_, true) => {
                (there.distance - distance).abs() <= SAME_DISTANCE * distance
                    && (there.albedo - hit.albedo).abs().max_element() <= SAME_ALBEDO
            }
            _ => {
                is_front(there.normal, direction_there) == is_front(hit.normal, direction)
                    && there.normal.dot(hit.normal) >= SAME_NORMAL
                    && hit.normal.dot(from.places.at(x, y) - place).abs() <= SAME_PLACE * distance
            }
        }
    };
    let [width, height] = from.size;
    let (mut picture, mut worth, mut moves, mut total) = (Vec3::ZERO, 0.0, 0.0, 0.0);
    let corner = [uv.x * width as f32 - 0.5, uv.y * height as f32 - 0.5];
    for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        let [x, y] = [corner[0].floor() + dx, corner[1].floor() + dy];
        let weight = (1.0 - (corner[0] - x).abs()) * (1.0 - (corner[1] - y).abs());
        let (x, y) = (x.clamp(0.0, (width - 1) as f32) as usize, y.clamp(0.0, (height - 1) as f32) as usize);
        if weight > 0.0 && is_same(x, y) {
            picture += weight * known.picture.xyz().at(x, y);
            worth += weight * known.worth.at(x, y).min(MOST_WORTH);
            moves += weight * known.moves.as_ref().map_or(0.0, |moves| moves.at(x, y));
            total += weight;
        }
    }
    // Seen from nearer, a pixel covers only part of the area that the other view averaged.
    let closer = if is_sky || hit.is_detached { 1.0 } else { (hit.distance / distance).powi(2).min(1.0) };
    let trust = if hit.is_detached { DETACHED_WORTH } else { 1.0 };
    (total >= LEAST_SEEN).then(|| CarriedPixel {
        picture: picture / total,
        worth: worth * closer * trust,
        moves: moves / total,
    })
}

/// True for what is infinitely far, also where a thin medium is before it.
fn is_sky(hit: &Features) -> bool {
    hit.distance == 0.0 || hit.normal == Vec3::ZERO && !hit.is_detached
}

/// Intersection of the ray through a pixel's centre with the tangent plane of the surface that another ray of the pixel hit at `place`.
fn on_centre(place: Vec3, hit: Features, origin: Vec3, direction: Vec3) -> Vec3 {
    let t = hit.normal.dot(place - origin) / hit.normal.dot(direction);
    let on_plane = origin + direction * t;
    let is_near = on_plane.distance_squared(place) <= (0.05 * hit.distance).powi(2);
    if is_near { on_plane } else { place }
}

/// Bilinear interpolation of a grid of blocks at a pixel.
fn between_blocks(blocks: &Grid<f32>, at: [usize; 2]) -> f32 {
    let size = [blocks.width(), blocks.height()];
    let axis = |i: usize| {
        let t = ((at[i] as f32 + 0.5) / BLOCK as f32 - 0.5).clamp(0.0, (size[i] - 1) as f32);
        let first = t as usize;
        (first, (first + 1).min(size[i] - 1), t.fract())
    };
    let ((x, right, fx), (y, below, fy)) = (axis(0), axis(1));
    let row = |y: usize| blocks.at(x, y) + fx * (blocks.at(right, y) - blocks.at(x, y));
    row(y) + fy * (row(below) - row(y))
}

#[cfg(test)]
mod tests;
