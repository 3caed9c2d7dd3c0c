//! The histogram of the displayed picture, refreshed a few times a second while it is visible.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::client::pass::repaint::ShownTexels;
use crate::client::window::panel::{BINS_PER_STOP, DISPLAY_BINS, Histogram, STOPS};
use crate::client::zones;
use crate::gpu::Region;
use crate::viewer::picture::LivePicture;

/// Shortest interval between two histograms.
const REFRESH: Duration = Duration::from_millis(300);

/// Most pixels read back for one histogram; a larger picture is sampled in evenly spaced bands of rows.
const MOST_PIXELS: u32 = 1 << 18;

/// The last histogram.
#[derive(Default)]
pub struct HistogramCache(Option<(Instant, Arc<Histogram>)>);

impl HistogramCache {
    /// Histogram of the picture at this exposure; `None` before there is a picture.
    pub fn get(
        &mut self,
        picture: &mut LivePicture,
        size: [u32; 2],
        exposure: f32,
    ) -> Option<Arc<Histogram>> {
        if self.0.as_ref().is_none_or(|(made, _)| made.elapsed() >= REFRESH)
            && let Some(shown) = rows(picture, size)
        {
            self.0 = Some((Instant::now(), Arc::new(histogram(&shown, exposure))));
        }
        self.0.as_ref().map(|(_, histogram)| histogram.clone())
    }
}

/// Pixels of the whole picture, or of evenly spaced bands of rows.
fn rows(picture: &mut LivePicture, [width, height]: [u32; 2]) -> Option<ShownTexels> {
    let every = width.saturating_mul(height).div_ceil(MOST_PIXELS).max(1);
    if every == 1 {
        return picture.shown(Region { origin: [0, 0], extent: [width, height] }).ok().flatten();
    }
    // A few bands rather than many single rows, because each is a separate readback.
    let bands = 16.min(height);
    let rows = (height / bands / every).max(1);
    let mut all = ShownTexels::default();
    for band in 0..bands {
        let region = Region { origin: [0, band * (height / bands)], extent: [width, rows] };
        let shown = picture.shown(region).ok().flatten()?;
        all.xyz.extend(shown.xyz);
        all.displayed.extend(shown.displayed);
    }
    Some(all)
}

fn histogram(shown: &ShownTexels, exposure: f32) -> Histogram {
    let [low, high] = STOPS;
    let stops = (high - low) as usize;
    let mut made = Histogram {
        luminance: vec![0.0; stops * BINS_PER_STOP],
        displayed: std::array::from_fn(|_| vec![0.0; DISPLAY_BINS]),
        ..Histogram::default()
    };
    let share = 1.0 / shown.xyz.len().max(1) as f32;
    let middle = zones::middle() as f32;
    for [_, y, _] in &shown.xyz {
        let stop = (exposure * y / middle).log2();
        if stop >= low && stop < high {
            made.luminance[((stop - low) * BINS_PER_STOP as f32) as usize] += share;
        }
    }
    // Same thresholds as the clipping view, encoded with a gamma of 2.2.
    let black = zones::BLACK.powf(1.0 / 2.2);
    for rgb in &shown.displayed {
        for (bins, value) in made.displayed.iter_mut().zip(rgb) {
            let bin = (value.clamp(0.0, 1.0) * DISPLAY_BINS as f32) as usize;
            bins[bin.min(DISPLAY_BINS - 1)] += share;
        }
        made.clipped += if rgb.iter().any(|c| *c > 0.998) { share } else { 0.0 };
        made.black += if rgb.iter().all(|c| *c < black) { share } else { 0.0 };
    }
    made
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_those_of_the_pixels() {
        let middle = zones::middle() as f32;
        let shown = ShownTexels {
            xyz: vec![[0.0, middle, 0.0], [0.0, 2.0 * middle, 0.0], [0.0; 3], [0.0, 1e9, 0.0]],
            displayed: vec![[0.18; 3], [0.5, 0.4, 0.3], [0.0; 3], [1.0, 1.0, 0.9]],
        };
        let made = histogram(&shown, 1.0);
        let zero = (-STOPS[0]) as usize * BINS_PER_STOP;
        assert_eq!((made.luminance[zero], made.luminance[zero + BINS_PER_STOP]), (0.25, 0.25));
        assert_eq!(made.luminance.iter().sum::<f32>(), 0.5, "what lies outside is not shown");
        assert_eq!((made.clipped, made.black), (0.25, 0.25));
        assert_eq!(made.displayed[0].iter().sum::<f32>(), 1.0);
        let brighter = histogram(&shown, 2.0);
        assert_eq!(brighter.luminance[zero + BINS_PER_STOP], 0.25);
    }
}
