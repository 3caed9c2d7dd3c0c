//! Light lost towards the corners of the picture, as by a lens.

use std::ops::RangeInclusive;

use glam::{Vec2, Vec3};

use crate::client::layout::blocks;
use crate::client::post_process::post_pass::{PictureGrid, PostProcess, PostSlider, number};
use crate::image::Grid;

const RANGE: RangeInclusive<f32> = 0.0..=1.0;

/// Parameters of the vignette.
#[derive(clap::Args, Clone, Debug, Default, PartialEq)]
pub struct Vignette {
    /// Share of the light that the corners of the picture lose; it grows with the square of the distance from the middle, and 0 is off.
    #[arg(id = "vignette", long, value_name = "SHARE", default_value_t = 0.0)]
    #[arg(value_parser = |text: &str| number(text, RANGE))]
    pub corner_loss: f32,
}

blocks! {
    /// Constants of `vignette.frag`.
    VignettePush, 16 {
        /// The middle of the picture, in units of half its diagonal.
        middle: [f32; 2],
        /// Half diagonals per texel.
        scale: f32,
        /// Share of the light that is lost half a diagonal away from the middle.
        corner_loss: f32,
    }
}

impl PostProcess for Vignette {
    const NAME: &'static str = "vignette";
    const SHADER: &'static str = "vignette.frag";
    type Push = VignettePush;

    fn is_on(&self) -> bool {
        self.corner_loss > 0.0
    }

    fn example() -> Self {
        Self { corner_loss: 0.5 }
    }

    fn options(&self) -> String {
        format!("--vignette {}", self.corner_loss)
    }

    fn sliders(&mut self) -> Vec<PostSlider<'_>> {
        let hint = "Share of the light that the corners lose";
        let value = &mut self.corner_loss;
        vec![PostSlider { label: "Vignette", hint, value, default: 0.0, range: RANGE }]
    }

    fn push(&self, PictureGrid { extent, detail }: PictureGrid) -> VignettePush {
        let middle = Vec2::from(extent.map(|n| 0.5 * n as f32));
        let half_diagonal = middle.length();
        VignettePush {
            middle: (middle / half_diagonal).into(),
            scale: detail as f32 / half_diagonal,
            corner_loss: self.corner_loss,
        }
    }

    fn texel(&self, push: &VignettePush, picture: &Grid<Vec3>, [x, y]: [usize; 2]) -> Vec3 {
        let from_middle = (Vec2::new(x as f32, y as f32) + 0.5) * push.scale - Vec2::from(push.middle);
        picture.at(x, y) * (1.0 - push.corner_loss * from_middle.length_squared()).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The middle keeps its light, the corners lose their share, half way there it is a quarter of that; whatever the internal resolution.
    #[test]
    fn the_loss_grows_with_the_square_of_the_distance() {
        let vignette = Vignette { corner_loss: 0.4 };
        for detail in [1, 2, 4] {
            let grid = PictureGrid { extent: [4000, 3000], detail };
            let (push, texels) = (vignette.push(grid), 4000 / detail as usize);
            let picture = Grid::try_filled(texels, 3000 / detail as usize, Vec3::ONE).expect("memory");
            for (x, kept) in [(0, 0.6), (texels / 4, 0.9), (texels / 2, 1.0), (texels - 1, 0.6)] {
                let got = vignette.texel(&push, &picture, [x, 3 * x / 4]).y;
                assert!((got - kept).abs() < 2e-3, "detail {detail}, column {x}: {got} instead of {kept}");
            }
        }
    }
}
