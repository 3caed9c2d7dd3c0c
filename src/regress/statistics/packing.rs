//! Values rounded to what their noise leaves meaningful, and areas as bytes, so that references are small.

use std::io::{self, Read, Write};

use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use half::f16;

use super::areas::mean_and_variance;
use crate::image::Grid;

/// The step that values of this standard error are rounded to: the largest power of two of at most half of it. 0 for exact values.
fn step(error: f64) -> f64 {
    let step = (error / 2.0).log2().floor().exp2();
    if step.is_finite() { step } else { 0.0 }
}

/// The nearest multiple of `step`; values that are not finite, and all values for a step of 0, stay as they are.
fn rounded(value: f32, step: f64) -> f32 {
    let multiple = (f64::from(value) / step).round() * step;
    if multiple.is_finite() { multiple as f32 } else { value }
}

/// A value rounded to a step of at most half of its standard error, and its variance with step²/12 added, what the rounding adds: at most
/// 1/48. The variance keeps three bits of mantissa (within 6 %).
pub fn coarse(value: f32, variance: f32) -> [f32; 2] {
    let variance = f64::from(variance);
    let step = step(variance.sqrt());
    [rounded(value, step), few_bits((variance + step * step / 12.0) as f32)]
}

/// A value as a half float holds it, for all programs to show, and the value itself where that is another one: 0 elsewhere.
pub fn shown_and_exact(value: f32) -> [f32; 2] {
    let shown = f16::from_f32(value).to_f32();
    let largest = f16::MAX.to_f32();
    let is_exact = shown == value || value.is_nan();
    if is_exact { [shown, 0.0] } else { [shown.clamp(-largest, largest), value] }
}

/// Side of the blocks of pixels that share a variance.
const BLOCK: usize = 4;

/// A pixel keeps its own variance where that exceeds the mean of its block by this factor.
const STANDS_OUT: f32 = 4.0;

/// Variances equal over blocks of 4×4 pixels: the mean of the block, but for pixels of more than four times that. Their own estimate from a few
/// renderings is not better than that.
pub fn shared_variances(variances: &Grid<[f32; 3]>) -> Vec<[f32; 3]> {
    let (width, height) = (variances.width(), variances.height());
    let mut shared = Vec::with_capacity(width * height);
    for y in 0..height {
        for x in 0..width {
            shared.push(std::array::from_fn(|c| {
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
                if own <= STANDS_OUT * mean { mean } else { own }
            }));
        }
    }
    shared
}

/// The nearest value with three bits of mantissa; others than positive finite ones, and the very largest, stay as they are.
fn few_bits(value: f32) -> f32 {
    const DROPPED: u32 = 20;
    if !value.is_finite() || value <= 0.0 {
        return value;
    }
    let bits = (value.to_bits() + (1 << (DROPPED - 1))) & !((1 << DROPPED) - 1);
    let near = f32::from_bits(bits);
    if near.is_finite() { near } else { value }
}

/// The areas of all renderings as compressed bytes, each rounded to a step of at most half of the spread of its renderings, which adds at most
/// 1/48 to their variance.
///
/// Of each area and channel the mean and the step, then for each rendering, area and channel the number of steps from that mean, positive
/// and negative ones by turns (0, −1, 1, −2, …); all in planes of the bytes of equal rank, the lowest first; compressed by zlib.
///
/// # Errors
/// Those of the compression.
pub fn pack_areas(areas: &[Vec<[f32; 3]>]) -> io::Result<Vec<u8>> {
    fn value(row: &[f32], column: usize) -> f64 {
        f64::from(row.get(column).copied().unwrap_or_default())
    }
    let rows: Vec<&[f32]> = areas.iter().map(|areas| areas.as_flattened()).collect();
    let columns = rows.first().map_or(0, |row| row.len());
    let scales: Vec<[f32; 2]> = (0..columns)
        .map(|column| {
            let (mean, variance) = mean_and_variance(rows.iter().map(|row| value(row, column)));
            let step = step(variance.sqrt());
            [rounded(mean as f32, step), step as f32]
        })
        .collect();
    let mut steps = Vec::with_capacity(rows.len() * columns);
    for row in &rows {
        steps.extend(scales.iter().enumerate().map(|(column, [mean, step])| {
            // No rendering is further from the mean than √n times the spread; for a step of 0 this is 0.
            let steps = ((value(row, column) - f64::from(*mean)) / f64::from(*step)).round() as i16;
            (steps << 1) ^ (steps >> 15)
        }));
    }
    let mut planes = Vec::with_capacity(8 * columns + 2 * steps.len());
    for which in 0..2 {
        for byte in 0..4 {
            planes.extend(scales.iter().map(|scale| scale[which].to_le_bytes()[byte]));
        }
    }
    for byte in 0..2 {
        planes.extend(steps.iter().map(|steps| steps.to_le_bytes()[byte]));
    }
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(&planes)?;
    encoder.finish()
}

/// The `count` areas of every rendering from the bytes of [`pack_areas`]; `None` if these are not of as many.
pub fn unpack_areas(packed: &[u8], renderings: usize, count: usize) -> Option<Vec<Vec<[f32; 3]>>> {
    let columns = count.checked_mul(3)?;
    let values = columns.checked_mul(renderings)?;
    let needed = columns.checked_mul(8)?.checked_add(values.checked_mul(2)?)?;
    let mut planes = Vec::new();
    ZlibDecoder::new(packed).take((needed as u64).checked_add(1)?).read_to_end(&mut planes).ok()?;
    if planes.len() != needed {
        return None;
    }
    let (scales, steps) = planes.split_at(8 * columns);
    let scale = |which: usize, column: usize| {
        let bytes = std::array::from_fn(|byte| scales[(4 * which + byte) * columns + column]);
        f64::from(f32::from_le_bytes(bytes))
    };
    let scales: Vec<[f64; 2]> = (0..columns).map(|column| [scale(0, column), scale(1, column)]).collect();
    let area = |rendering: usize, area: usize, channel: usize| {
        let column = 3 * area + channel;
        let at = rendering * columns + column;
        let alternating = i16::from_le_bytes([steps[at], steps[values + at]]);
        let steps = ((alternating >> 1) & i16::MAX) ^ -(alternating & 1);
        let [mean, step] = scales[column];
        (mean + f64::from(steps) * step) as f32
    };
    let rendering = |r: usize| (0..count).map(|a| std::array::from_fn(|c| area(r, a, c))).collect();
    Some((0..renderings).map(rendering).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_rounded_to_half_of_their_error() {
        assert_eq!((step(1.0), step(0.9), step(0.0), step(f64::NAN)), (0.5, 0.25, 0.0, 0.0));
        assert_eq!((rounded(1.3, 0.25), rounded(-1.3, 0.25), rounded(1.3, 0.0)), (1.25, -1.25, 1.3));
        assert_eq!((rounded(0.0, 0.0), rounded(f32::INFINITY, 0.25)), (0.0, f32::INFINITY));
        // A step below the precision of the value changes nothing.
        assert_eq!(rounded(1.3, 2f64.powi(-40)), 1.3);
    }

    /// What rounding adds is in the variance: the mean square of the distance from the values themselves is that of the variance kept, on average.
    #[test]
    fn rounding_is_part_of_the_variance() {
        let (mut added, mut told, mut variances) = (0.0, 0.0, 0.0);
        for i in 0..20_000 {
            let variance = 2f64.powf(8.0 * f64::from(i % 1000) / 1000.0 - 4.0);
            let value = (3.0 + 0.618_034 * f64::from(i) % 10.0) as f32;
            let [rounded, kept] = coarse(value, variance as f32);
            let error = f64::from(rounded) - f64::from(value);
            added += error * error / variance / 20_000.0;
            told += step(variance.sqrt()).powi(2) / 12.0 / variance / 20_000.0;
            variances += f64::from(kept) / variance / 20_000.0;
            assert!(error.abs() <= 0.25 * variance.sqrt() + 1e-6, "{value} {rounded}");
        }
        assert!((added / told - 1.0).abs() < 0.05 && (0.008..0.021).contains(&told), "{added} {told}");
        assert!((variances - 1.0 - told).abs() < 0.004, "{variances} {told}");
    }

    #[test]
    fn variances_keep_three_bits_and_stand_out_where_they_do() {
        let small = 1.125 * 2f32.powi(-14);
        for (value, near) in [(1.1, 1.125), (1.05, 1.0), (1.95, 2.0), (1.01 * small, small), (0.0, 0.0)] {
            assert_eq!(few_bits(value), near);
        }
        assert_eq!((few_bits(f32::MAX), few_bits(f32::INFINITY)), (f32::MAX, f32::INFINITY));
        let mut variances = Grid::try_filled(8, 3, [1.0; 3]).expect("memory");
        variances.pixels_mut()[0] = [29.0; 3];
        variances.pixels_mut()[23] = [f32::NAN; 3];
        let shared = shared_variances(&variances);
        let mean = 40.0 / 12.0;
        assert_eq!([shared[0][0], shared[1][0], shared[4][0], shared[22][0]], [29.0, mean, 1.0, 1.0]);
        assert!(shared[23][0].is_nan());
    }

    #[test]
    fn values_that_half_floats_do_not_hold_are_kept_beside_them() {
        for value in [0.0, 0.25, -65504.0, f32::INFINITY] {
            assert_eq!(shown_and_exact(value), [value, 0.0]);
        }
        assert!(shown_and_exact(f32::NAN)[0].is_nan());
        let [shown, exact] = shown_and_exact(0.3);
        assert!(exact == 0.3 && shown != 0.3 && (shown - 0.3).abs() < 1e-4, "{shown} {exact}");
        assert_eq!((shown_and_exact(1e9), shown_and_exact(1e-9)), ([65504.0, 1e9], [0.0, 1e-9]));
    }

    #[test]
    fn areas_survive_packing_and_cut_ones_are_refused() {
        // The spread is the root of 2.5, the step ½: all are multiples of it.
        let areas: Vec<Vec<[f32; 3]>> =
            (0..5u16).map(|r| vec![[f32::from(r), 0.3, -f32::from(r) * 64.0]; 7]).collect();
        let packed = pack_areas(&areas).expect("packed");
        assert_eq!(unpack_areas(&packed, 5, 7).expect("all are there"), areas);
        assert!(unpack_areas(&packed[..packed.len() / 2], 5, 7).is_none());
        for (renderings, count) in [(4, 7), (6, 7), (5, 6), (5, 8), (usize::MAX, 7), (5, usize::MAX)] {
            assert!(unpack_areas(&packed, renderings, count).is_none(), "{renderings} {count}");
        }
    }
}
