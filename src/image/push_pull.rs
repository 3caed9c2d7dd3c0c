//! Fills pixels of low weight from a pyramid of coarser ones (push–pull, Gortler et al. 1996).

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::Grid;

/// Means of `sums`, each `[weight · value, weight]`. Where the weight is below `enough` the remainder comes from pixels twice as large,
/// recursively, so that values are smooth where nothing is known; zero if the whole picture is empty. `None` if memory runs out.
pub fn fill(sums: Grid<Vec4>, enough: f32) -> Option<Grid<Vec3>> {
    let mut levels = vec![sums];
    while let Some(finer) = levels.last().filter(|level| wants_coarser(level, enough)) {
        levels.push(halved(finer)?);
    }
    let mut filled: Option<Grid<Vec3>> = None;
    for sums in levels.iter().rev() {
        let mut picture = Grid::try_filled(sums.width(), sums.height(), Vec3::ZERO)?;
        each_row(&mut picture, |y, out| {
            for (x, out) in out.iter_mut().enumerate() {
                let sum = sums.at(x, y);
                let own = if sum.w > 0.0 { sum.truncate() / sum.w } else { Vec3::ZERO };
                let share = (sum.w / enough).min(1.0);
                *out = match &filled {
                    Some(coarser) if share < 1.0 => between(coarser, [x, y]).lerp(own, share),
                    _ => own,
                };
            }
        });
        filled = Some(picture);
    }
    filled
}

fn wants_coarser(sums: &Grid<Vec4>, enough: f32) -> bool {
    sums.pixels().len() > 1 && sums.pixels().par_iter().any(|sum| sum.w < enough)
}

/// Sums over squares of 2×2 pixels.
fn halved(sums: &Grid<Vec4>) -> Option<Grid<Vec4>> {
    let height = sums.height();
    let mut coarser = Grid::try_filled(sums.width().div_ceil(2), height.div_ceil(2), Vec4::ZERO)?;
    each_row(&mut coarser, |y, out| {
        for row in (2 * y..(2 * y + 2).min(height)).map(|y| sums.row(y)) {
            for (x, sum) in row.iter().enumerate() {
                out[x / 2] += *sum;
            }
        }
    });
    Some(coarser)
}

/// Bilinear interpolation of the coarser level at the centre of a pixel.
fn between(coarser: &Grid<Vec3>, place: [usize; 2]) -> Vec3 {
    let size = [coarser.width(), coarser.height()];
    // The nearer centre has weight 3/4; values are clamped beyond the last centre.
    let [columns, rows] = [0, 1].map(|axis| {
        let near = place[axis] / 2;
        let is_before = place[axis].is_multiple_of(2);
        let far = if is_before { near.saturating_sub(1) } else { (near + 1).min(size[axis] - 1) };
        [(near, 0.75), (far, 0.25)]
    });
    let row = |y: usize| columns.map(|(x, weight)| coarser.at(x, y) * weight).into_iter().sum::<Vec3>();
    rows.map(|(y, weight)| row(y) * weight).into_iter().sum()
}

/// Computes all rows, on all threads if that pays off.
fn each_row<T: Copy + Send>(grid: &mut Grid<T>, make: impl Fn(usize, &mut [T]) + Sync) {
    const FEW: usize = 1 << 15;
    let width = grid.width();
    let pixels = grid.pixels_mut();
    match pixels.len() < FEW {
        true => pixels.chunks_mut(width).enumerate().for_each(|(y, row)| make(y, row)),
        false => pixels.par_chunks_mut(width).enumerate().for_each(|(y, row)| make(y, row)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(width: usize, height: usize, sum: impl Fn(usize, usize) -> Vec4) -> Grid<Vec4> {
        let pixels = (0..width * height).map(|i| sum(i % width, i / width)).collect();
        Grid::from_rows(width, height, pixels).expect("of this size")
    }

    #[test]
    fn what_is_known_stays_and_a_constant_fills_all() {
        let sums =
            grid(13, 7, |x, y| if (x, y) == (5, 2) { Vec4::new(6.0, 4.0, 2.0, 2.0) } else { Vec4::ZERO });
        let filled = fill(sums, 1.0).expect("memory");
        assert!(filled.pixels().iter().all(|value| value.distance(Vec3::new(3.0, 2.0, 1.0)) < 1e-5));
        let known = grid(13, 7, |x, y| Vec4::new(x as f32, y as f32, 0.0, 1.0));
        let filled = fill(known, 1.0).expect("memory");
        assert!((0..7).all(|y| (0..13).all(|x| filled.at(x, y) == Vec3::new(x as f32, y as f32, 0.0))));
        let nothing = fill(grid(4, 4, |_, _| Vec4::ZERO), 1.0).expect("memory");
        assert!(nothing.pixels().iter().all(|value| *value == Vec3::ZERO));
    }

    #[test]
    fn little_knowledge_counts_for_little() {
        // A pixel of weight 1 where 4 are enough, among known ones: a quarter of its value is its own, and slightly more through the
        // coarser level.
        let sums =
            grid(8, 8, |x, y| if (x, y) == (3, 3) { Vec4::ONE } else { Vec4::new(0.0, 0.0, 0.0, 4.0) });
        let value = fill(sums, 4.0).expect("memory").at(3, 3).x;
        assert!((0.25..0.35).contains(&value), "{value}");
    }
}
