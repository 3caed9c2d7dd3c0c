//! The two halves of a picture: the sums of both randomisations, pixel by pixel, for the [noise filter](crate::client::wavelet).
//!
//! A sample counts in the one pixel that it lies in, whatever the film's filter: neighbours have no noise in common, which the filter
//! relies on.

use glam::Vec4;

use crate::client::wavelet::HalfPicture;
use crate::image::Grid;
use crate::stream::{PathCounts, REPLICATES, Sample, replicate};

/// Sums of both halves; those of a stream are made with its first sample.
#[derive(Clone, Debug)]
pub struct Halves {
    size: [usize; 2],
    parts: [HalfSums; REPLICATES],
}

/// Sums `[X, Y, Z, W]` of the camera and of the light stream of one randomisation.
#[derive(Clone, Debug, Default)]
struct HalfSums {
    streams: [Vec<Vec4>; 2],
    paths: PathCounts,
}

impl Halves {
    /// Empty halves of a picture of this size.
    pub fn new(size: [u32; 2]) -> Self {
        Self { size: size.map(|n| n as usize), parts: Default::default() }
    }

    /// Adds a block that begins at path `first_index`; no block spans two randomisations.
    pub fn add(&mut self, first_index: u64, paths: PathCounts, samples: &[Sample]) {
        let [width, height] = self.size;
        let part = &mut self.parts[replicate(first_index).0];
        part.paths.camera = part.paths.camera.saturating_add(paths.camera);
        part.paths.light = part.paths.light.saturating_add(paths.light);
        for sample in samples {
            let [x, y] = [sample.uv[0] * width as f32, sample.uv[1] * height as f32];
            // False for NaN as well.
            if !(x >= 0.0 && y >= 0.0 && x < width as f32 && y < height as f32) {
                continue;
            }
            let sums = &mut part.streams[usize::from(sample.w < 0.0)];
            if sums.is_empty() {
                sums.resize(width * height, Vec4::ZERO);
            }
            let xyz = sample.xyz;
            sums[y as usize * width + x as usize] += Vec4::new(xyz.x, xyz.y, xyz.z, sample.w.abs());
        }
    }

    /// Both halves as pictures; `None` without memory. Where only light paths are shown, every pixel is known.
    pub fn pictures(&self) -> Option<[HalfPicture; 2]> {
        let [a, b] = &self.parts;
        let camera = !(a.streams[0].is_empty() && b.streams[0].is_empty());
        Some([self.picture(a, camera)?, self.picture(b, camera)?])
    }

    /// Sums `[X, Y, Z, W]` of both halves together, of the camera and of the light stream; empty for a stream without samples.
    pub fn sums(&self) -> [Vec<[f32; 4]>; 2] {
        [0, 1].map(|stream| {
            let [a, b] = self.parts.each_ref().map(|part| &part.streams[stream]);
            let at = |sums: &Vec<Vec4>, i: usize| sums.get(i).copied().unwrap_or_default();
            (0..a.len().max(b.len())).map(|i| (at(a, i) + at(b, i)).to_array()).collect()
        })
    }

    fn picture(&self, part: &HalfSums, camera: bool) -> Option<HalfPicture> {
        let [width, height] = self.size;
        let mut picture = Grid::try_filled(width, height, Vec4::ZERO)?;
        let light_scale = (width * height) as f32 / part.paths.light as f32;
        for (i, out) in picture.pixels_mut().iter_mut().enumerate() {
            let [seen, lit] = part.streams.each_ref().map(|sums| sums.get(i).copied().unwrap_or_default());
            if camera && seen.w > 0.0 {
                *out = (seen / seen.w).with_w(seen.w);
            } else if !camera && part.paths.light > 0 {
                *out = Vec4::W;
            }
            if out.w > 0.0 && part.paths.light > 0 {
                *out += (lit * light_scale).with_w(0.0);
            }
        }
        Some(picture)
    }
}
