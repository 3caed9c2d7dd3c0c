//! Values rounded to what their noise leaves meaningful, and areas as channels, so that references are small.

use super::areas::mean_and_variance;
use crate::image::Grid;

/// The step that values of this standard error are rounded to: the largest power of two of at most a quarter of it. 0 for exact values.
pub fn step(error: f64) -> f64 {
    let step = (error / 4.0).log2().floor().exp2();
    if step.is_finite() { step } else { 0.0 }
}

/// The nearest multiple of `step`; values that are not finite, and all values for a step of 0, stay as they are.
pub fn rounded(value: f32, step: f64) -> f32 {
    let multiple = (f64::from(value) / step).round() * step;
    if multiple.is_finite() { multiple as f32 } else { value }
}

/// Side of the blocks of pixels that share a variance.
const BLOCK: usize = 4;

/// A pixel keeps its own variance where that exceeds the mean of its block by this factor.
const STANDS_OUT: f32 = 4.0;

/// Variances with one bit of mantissa (within 20 %), equal over blocks of 4×4 pixels but for pixels of more than four times the mean of their
/// block. Their own estimate from a few renderings is not better than that.
pub fn coarse_variances(variances: &Grid<[f32; 3]>) -> Vec<[f32; 3]> {
    let (width, height) = (variances.width(), variances.height());
    let mut coarse = Vec::with_capacity(width * height);
    for y in 0..height {
        for x in 0..width {
            coarse.push(std::array::from_fn(|c| {
                let (mut sum, mut count) = (0.0, 0.0);
                for ny in y / BLOCK * BLOCK..(y / BLOCK * BLOCK + BLOCK).min(height) {
                    for nx in x / BLOCK * BLOCK..(x / BLOCK * BLOCK + BLOCK).min(width) {
                        let value = f64::from(variances.at(nx, ny)[c]);
                        if value.is_finite() {
                            (sum, count) = (sum + value, count + 1.0);
                        }
                    }
                }
                let (own, mean) = (variances.at(x, y)[c], (sum / count) as f32);
                // Also where `own` is not finite.
                one_bit(if own <= STANDS_OUT * mean { mean } else { own })
            }));
        }
    }
    coarse
}

/// The nearest value of the form 2ⁿ or 1.5 · 2ⁿ; others than positive finite ones, and the very largest, stay as they are.
fn one_bit(value: f32) -> f32 {
    const DROPPED: u32 = 22;
    if !value.is_finite() || value <= 0.0 {
        return value;
    }
    let bits = (value.to_bits() + (1 << (DROPPED - 1))) & !((1 << DROPPED) - 1);
    let near = f32::from_bits(bits);
    if near.is_finite() { near } else { value }
}

/// The areas of all renderings as channels of `pixels` values: one after the other by area, channel and rendering, each rounded to the spread of
/// its renderings ([`step`]), and 0 behind the last.
pub fn pack_areas(areas: &[Vec<[f32; 3]>], pixels: usize) -> Vec<Vec<f32>> {
    let mut values = Vec::new();
    for area in 0..areas.first().map_or(0, Vec::len) {
        for channel in 0..3 {
            let row: Vec<f32> =
                areas.iter().filter_map(|rendering| rendering.get(area)).map(|v| v[channel]).collect();
            let (_, variance) = mean_and_variance(row.iter().map(|&v| f64::from(v)));
            let step = step(variance.sqrt());
            values.extend(row.into_iter().map(|v| rounded(v, step)));
        }
    }
    let channels = values.chunks(pixels.max(1)).map(|chunk| {
        let mut channel = chunk.to_vec();
        channel.resize(pixels, 0.0);
        channel
    });
    channels.collect()
}

/// The `count` areas of every rendering from the channels of [`pack_areas`]; `None` if these hold too few values.
pub fn unpack_areas(channels: &[&[f32]], renderings: usize, count: usize) -> Option<Vec<Vec<[f32; 3]>>> {
    let held: usize = channels.iter().map(|channel| channel.len()).sum();
    let needed = count.checked_mul(3)?.checked_mul(renderings)?;
    if needed > held {
        return None;
    }
    let mut areas = vec![vec![[0.0; 3]; count]; renderings];
    for (i, value) in channels.iter().copied().flatten().take(needed).enumerate() {
        let (column, rendering) = (i / renderings, i % renderings);
        areas[rendering][column / 3][column % 3] = *value;
    }
    Some(areas)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_rounded_to_a_quarter_of_their_error() {
        assert_eq!((step(1.0), step(0.9), step(0.0), step(f64::NAN)), (0.25, 0.125, 0.0, 0.0));
        assert_eq!((rounded(1.3, 0.25), rounded(-1.3, 0.25), rounded(1.3, 0.0)), (1.25, -1.25, 1.3));
        assert_eq!((rounded(0.0, 0.0), rounded(f32::INFINITY, 0.25)), (0.0, f32::INFINITY));
        // A step below the precision of the value changes nothing.
        assert_eq!(rounded(1.3, 2f64.powi(-40)), 1.3);
    }

    #[test]
    fn variances_keep_one_bit_and_stand_out_where_they_do() {
        for (value, near) in [(1.1, 1.0), (1.3, 1.5), (1.8, 2.0), (6.1e-5, 2f32.powi(-14)), (0.0, 0.0)] {
            assert_eq!(one_bit(value), near);
        }
        assert_eq!((one_bit(f32::MAX), one_bit(f32::INFINITY)), (f32::MAX, f32::INFINITY));
        let mut variances = Grid::try_filled(8, 3, [1.0; 3]).expect("memory");
        variances.pixels_mut()[0] = [29.0; 3];
        variances.pixels_mut()[23] = [f32::NAN; 3];
        let coarse = coarse_variances(&variances);
        // The mean of the first block is 40 / 12.
        assert_eq!([coarse[0][0], coarse[1][0], coarse[4][0], coarse[22][0]], [32.0, 3.0, 1.0, 1.0]);
        assert!(coarse[23][0].is_nan());
    }

    #[test]
    fn areas_survive_packing_and_cut_ones_are_refused() {
        let areas: Vec<Vec<[f32; 3]>> =
            (0..5u16).map(|r| vec![[f32::from(r), 1.0, -f32::from(r) * 64.0]; 7]).collect();
        let channels = pack_areas(&areas, 40);
        let channels: Vec<&[f32]> = channels.iter().map(Vec::as_slice).collect();
        assert_eq!(channels.iter().map(|c| c.len()).collect::<Vec<_>>(), [40; 3]);
        assert_eq!(unpack_areas(&channels, 5, 7).expect("all are there"), areas);
        assert!(unpack_areas(&channels[..2], 5, 7).is_none());
        assert!(unpack_areas(&channels, usize::MAX, 7).is_none());
    }
}
