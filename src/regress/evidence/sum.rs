//! Evidence from renderings that are added one after the other, so that none of them has to stay in memory.

use super::{Evidence, finite, grid, hash};
use crate::image::{Grid, ImageError};
use crate::regress::statistics::areas::AreaLayout;

/// What renderings of one picture say so far. A rendering adds the means of its areas and its hash; pixels take 6 numbers of 64 bits,
/// however many renderings there are.
#[derive(Clone, Debug, Default)]
pub struct EvidenceSum {
    /// Width and height.
    size: (usize, usize),
    /// Of each pixel and channel.
    moments: Vec<[Moments; 3]>,
    /// For which pixels all channels of all renderings are finite.
    used: Vec<bool>,
    /// Means of the areas over these pixels, `[renderings][areas]`.
    areas: Vec<Vec<[f32; 3]>>,
    /// Hash of each rendering.
    hashes: Vec<String>,
}

/// Mean of values and sum of their squared differences from it, updated value by value (Welford, *Note on a Method for Calculating
/// Corrected Sums of Squares and Products*, Technometrics 4, 1962).
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    mean: f64,
    squares: f64,
}

impl Moments {
    /// Adds the `n`-th value. From a value that is not finite on, the mean is what the sum of all values is, and the squares are unknown.
    fn add(&mut self, value: f64, n: f64) {
        let difference = value - self.mean;
        if difference.is_finite() {
            self.mean += difference / n;
            self.squares += difference * (value - self.mean);
        } else {
            self.mean += value;
            self.squares = f64::NAN;
        }
    }
}

impl EvidenceSum {
    /// Hash of each rendering's values, in order: equal for the same bits.
    pub fn hashes(&self) -> &[String] {
        &self.hashes
    }

    /// Adds a rendering. Areas hold the pixels that are finite in all renderings: where this one has the first value of a pixel that is not,
    /// those of the earlier renderings are made anew, and `earlier` gives these by their numbers from 0 on.
    ///
    /// # Errors
    /// [`ImageError::Size`] if its size is not that of the others; those of `earlier`. Nothing is added then.
    pub fn add(
        &mut self,
        pixels: &Grid<[f32; 3]>,
        mut earlier: impl FnMut(usize) -> Result<Grid<[f32; 3]>, ImageError>,
    ) -> Result<(), ImageError> {
        let size = (pixels.width(), pixels.height());
        if self.hashes.is_empty() {
            let count = pixels.pixels().len();
            let (moments, used) = (vec![[Moments::default(); 3]; count], vec![true; count]);
            *self = Self { size, moments, used, ..Self::default() };
        }
        let check = |other: (usize, usize)| match other == self.size {
            true => Ok(()),
            false => Err(ImageError::Size { a: self.size, b: other }),
        };
        check(size)?;
        let used: Vec<bool> =
            finite(pixels).iter().zip(&self.used).map(|(now, before)| *now && *before).collect();
        let layout = AreaLayout::new(size.0, size.1);
        let means = |pixels: &Grid<[f32; 3]>| -> Vec<[f32; 3]> {
            layout.means(pixels, &used).into_iter().map(|area| area.map(|v| v as f32)).collect()
        };
        if used != self.used {
            let mut anew = Vec::with_capacity(self.areas.len());
            for number in 0..self.areas.len() {
                let pixels = earlier(number)?;
                check((pixels.width(), pixels.height()))?;
                anew.push(means(&pixels));
            }
            self.areas = anew;
        }
        self.areas.push(means(pixels));
        self.used = used;
        self.hashes.push(hash(pixels));
        let n = self.hashes.len() as f64;
        for (moments, pixel) in self.moments.iter_mut().zip(pixels.pixels()) {
            for (moments, &value) in moments.iter_mut().zip(pixel) {
                moments.add(f64::from(value), n);
            }
        }
        Ok(())
    }

    /// What the renderings say together; the variance of a single one is 0.
    ///
    /// # Errors
    /// [`ImageError::Size`] for none.
    pub fn evidence(&self) -> Result<Evidence, ImageError> {
        let renderings = self.hashes.len();
        if renderings == 0 {
            return Err(ImageError::Size { a: (0, 0), b: (0, 0) });
        }
        let n = renderings as f64;
        let mean = self.moments.iter().map(|pixel| pixel.map(|moments| moments.mean as f32));
        let of_mean = |moments: Moments| (moments.squares / (n - 1.0).max(1.0) / n) as f32;
        let variance = self.moments.iter().map(|pixel| pixel.map(of_mean));
        Ok(Evidence {
            renderings,
            mean: grid(self.size, mean.collect())?,
            variance: grid(self.size, variance.collect())?,
            areas: if renderings > 1 { self.areas.clone() } else { Vec::new() },
            hashes: self.hashes.clone(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;
    use crate::regress::statistics::areas::mean_and_variance;
    use crate::regress::statistics::synthetic::{SyntheticScene, gamma, rendering};

    /// Renderings of a picture of 24×20 pixels, whose areas at the lower border are smaller.
    fn renderings() -> Vec<Grid<[f32; 3]>> {
        let (expected, mut random) = (SyntheticScene::new(24).expected(), Random(5));
        let cut = |pixels: Grid<[f32; 3]>| {
            let values = pixels.pixels()[..24 * 20].to_vec();
            Grid::from_rows(24, 20, values).expect("as many values as pixels")
        };
        (0..6).map(|_| cut(rendering(&expected, gamma, &mut random))).collect()
    }

    /// Mean and variance of the mean of a pixel's channel, from all values at once.
    fn at_once(all: &[Grid<[f32; 3]>], i: usize, c: usize) -> [f64; 2] {
        let (mean, variance) = mean_and_variance(all.iter().map(|pixels| f64::from(pixels.pixels()[i][c])));
        [mean, variance / all.len() as f64]
    }

    /// The sum says what all renderings at once say, also where a pixel is not finite from the third rendering on.
    #[test]
    fn one_after_the_other_is_as_all_at_once() {
        let mut all = renderings();
        let (broken, infinite) = (24 * 9 + 3, 24 * 19 + 23);
        for spoilt in [false, true] {
            if spoilt {
                all[2].pixels_mut()[broken][1] = f32::NAN;
                all[4].pixels_mut()[infinite][0] = f32::INFINITY;
            }
            let (mut sum, mut asked) = (EvidenceSum::default(), Vec::new());
            for (number, pixels) in all.iter().enumerate() {
                let added = sum.add(pixels, |earlier| {
                    asked.push((number, earlier));
                    Ok(all[earlier].clone())
                });
                added.expect("one size");
            }
            let wanted = [(2, 0), (2, 1), (4, 0), (4, 1), (4, 2), (4, 3)];
            assert_eq!(asked, if spoilt { wanted.to_vec() } else { Vec::new() });
            let found = sum.evidence().expect("renderings");
            for (i, pixel) in found.mean.pixels().iter().enumerate() {
                for (c, &value) in pixel.iter().enumerate() {
                    let [mean, variance] = at_once(&all, i, c);
                    let now = [f64::from(value), f64::from(found.variance.pixels()[i][c])];
                    match mean.is_finite() {
                        true => {
                            assert!((now[0] - mean).abs() <= 1e-6 * mean.abs(), "{i}: {now:?} {mean}");
                            assert!((now[1] - variance).abs() <= 1e-6 * variance, "{i}: {now:?} {variance}");
                        }
                        false => {
                            assert_eq!(now[0].to_string(), mean.to_string());
                            assert!(now[1].is_nan());
                        }
                    }
                }
            }
            let used = finite(&found.mean);
            assert_eq!(used.iter().filter(|used| !**used).count(), if spoilt { 2 } else { 0 });
            let layout = AreaLayout::new(24, 20);
            for (pixels, areas) in all.iter().zip(&found.areas) {
                let wanted: Vec<[f32; 3]> =
                    layout.means(pixels, &used).into_iter().map(|area| area.map(|v| v as f32)).collect();
                assert_eq!(*areas, wanted);
            }
            let together = Evidence::of_grids(&all.iter().collect::<Vec<_>>()).expect("one size");
            assert_eq!((&together.areas, &together.hashes), (&found.areas, &found.hashes));
            assert_eq!(together.hashes, all.iter().map(hash).collect::<Vec<_>>());
        }
    }

    /// Renderings with the same bits have no variance at all, whatever their values.
    #[test]
    fn equal_values_have_no_variance() {
        let pixels = Grid::try_filled(9, 9, [0.1, 1e-7, 3e8]).expect("memory");
        let all = Evidence::of_grids(&[&pixels; 7]).expect("one size");
        assert_eq!(all.mean, pixels);
        assert!(all.variance.pixels().iter().flatten().all(|variance| *variance == 0.0));
    }

    /// A rendering that cannot be added leaves the sum as it was.
    #[test]
    fn what_is_refused_leaves_no_trace() {
        let mut all = renderings();
        let mut sum = EvidenceSum::default();
        assert!(sum.evidence().is_err());
        for pixels in &all[..2] {
            sum.add(pixels, |_| unreachable!("all pixels are finite")).expect("one size");
        }
        let before = sum.evidence().expect("renderings");
        let other = Grid::try_filled(24, 21, [1.0; 3]).expect("memory");
        let refused = sum.add(&other, |_| unreachable!("its size is wrong"));
        assert!(matches!(refused, Err(ImageError::Size { a: (24, 20), b: (24, 21) })), "{refused:?}");
        all[2].pixels_mut()[0] = [f32::NAN; 3];
        let lost = || ImageError::Size { a: (24, 20), b: (0, 0) };
        assert!(sum.add(&all[2], |_| Err(lost())).is_err());
        assert_eq!(sum.evidence().expect("renderings"), before);
    }
}
