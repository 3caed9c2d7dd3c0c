//! Error of the camera paths per region of the screen, by which adaptive sampling distributes them.

use crate::math::bits::interleave;
use crate::stream::UvWindow;
use crate::study::Replicates;
use crate::study::error::relative_squares;

impl Replicates {
    /// Mean squared relative error of the camera stream in 2^level × 2^level regions of the screen `window`, in the order of
    /// [`interleave`], smoothed over neighbouring regions. The denominator is that of stated errors. `None` while the replicates have
    /// reached too few pixels.
    ///
    /// Light paths contribute noise too, but camera paths cannot reduce it.
    pub fn region_errors(&self, window: &UvWindow, level: u32) -> Option<Vec<f64>> {
        let [width, height] = self.size();
        let squares = relative_squares(&self.camera_pixels()?, [width, height])?;
        let side = 1usize << level;
        let place = |at: usize, len: usize, axis: usize| {
            let uv = (at as f32 + 0.5) / len as f32;
            let within = (uv - window.min[axis]) / (window.max[axis] - window.min[axis]);
            ((within * side as f32) as usize).min(side - 1)
        };
        let mut sums = vec![[0.0; 2]; side * side];
        for (i, square) in squares.iter().enumerate() {
            let [sum, count] = &mut sums[place(i / width, height, 1) * side + place(i % width, width, 0)];
            (*sum, *count) = (*sum + square, *count + 1.0);
        }
        let near = |at: usize| at.saturating_sub(1)..(at + 2).min(side);
        let mut errors = vec![0.0; side * side];
        for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
            let around = near(y).flat_map(|v| near(x).map(move |u| (u, v)));
            let [sum, count] = around.fold([0.0; 2], |[sum, count], (u, v)| {
                let weight = f64::from(2 - u32::from(u != x)) * f64::from(2 - u32::from(v != y));
                let [a, b] = sums[v * side + u];
                [sum + weight * a, count + weight * b]
            });
            errors[interleave([x as u32, y as u32]) as usize] = if count > 0.0 { sum / count } else { 0.0 };
        }
        Some(errors)
    }
}
