//! The composed picture.

use glam::Vec3;

use super::{Anaglyph, DisplayCoding, StereoError, StereoLayout, StereoSource};
use crate::image::Grid;

/// Encoded R, G, B `[height][width]`, rows from the top.
type Encoded = Grid<[u8; 3]>;

/// Composes the display pictures of the left and the right eye, in the encoding of both.
///
/// Where pixels are averaged (half layouts) or mixed (anaglyphs) that is done in linear light; anaglyphs also in the primaries of Rec.709,
/// which their matrices are for, whatever those of the display are. All other layouts copy pixels. What a window shows in layers is composed
/// [in one picture](StereoLayout::in_one_picture).
///
/// # Errors
///
/// Pictures of different sizes, and a composed picture that does not fit into memory.
pub fn compose(
    eyes: [&Encoded; 2],
    layout: StereoLayout,
    coding: &DisplayCoding,
) -> Result<Encoded, StereoError> {
    let [left, right] = eyes.map(|eye| [eye.width(), eye.height()]);
    if left != right {
        return Err(StereoError::Size { left, right });
    }
    let layout = layout.in_one_picture();
    let memory = StereoError::Memory { size: left };
    let size = layout.size(left).ok_or_else(|| memory.clone())?;
    let mut composed = Grid::try_filled(size[0], size[1], [0; 3]).ok_or(memory)?;
    for y in 0..size[1] {
        for (x, pixel) in composed.row_mut(y).iter_mut().enumerate() {
            *pixel = match layout.source(left, [x, y]) {
                StereoSource::Pixel(eye, [x, y]) => eyes[eye as usize].at(x, y),
                StereoSource::Mean(eye, pixels) => {
                    let [a, b] = pixels.map(|[x, y]| coding.decode(eyes[eye as usize].at(x, y)));
                    coding.encode(0.5 * (a + b))
                }
                StereoSource::Mix(glasses, [x, y]) => {
                    let light = eyes.map(|eye| coding.rec709_from_display(coding.decode(eye.at(x, y))));
                    coding.encode(coding.display_from_rec709(mix(glasses, light)))
                }
            };
        }
    }
    Ok(composed)
}

/// Linear Rec.709 in 0 … 1 of the anaglyph of both eyes' linear Rec.709.
fn mix(glasses: Anaglyph, [left, right]: [Vec3; 2]) -> Vec3 {
    let [of_left, of_right] = glasses.matrices();
    let sum = |c: usize| Vec3::from(of_left[c]).dot(left) + Vec3::from(of_right[c]).dot(right);
    Vec3::new(sum(0), sum(1), sum(2)).clamp(Vec3::ZERO, Vec3::ONE)
}
