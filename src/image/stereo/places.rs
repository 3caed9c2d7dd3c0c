//! Places of both eyes' pictures in the composed picture, and back: for pointers, and for what is drawn over it.

use super::{Eye, StereoLayout, StereoSource};

impl StereoLayout {
    /// The eye that is shown at a place of the composed picture of two of this size, and the place in its picture, both in pixels `[x, y]`
    /// from the left top corner. Where both eyes are mixed or shown at once it is the left one. `None` beside the picture.
    ///
    /// The pixel is that of [`source`](Self::source); a pixel that shows two neighbours has a half for each.
    pub fn place_of_eye(self, size: [usize; 2], [x, y]: [f64; 2]) -> Option<(Eye, [f64; 2])> {
        let composed = self.size(size)?.map(|n| n as f64);
        if !((0.0..composed[0]).contains(&x) && (0.0..composed[1]).contains(&y)) {
            return None;
        }
        let within = [x.fract(), y.fract()];
        Some(match self.source(size, [x as usize, y as usize]) {
            StereoSource::Pixel(eye, pixel) => (eye, [0, 1].map(|i| pixel[i] as f64 + within[i])),
            StereoSource::Mix(_, pixel) => (Eye::Left, [0, 1].map(|i| pixel[i] as f64 + within[i])),
            StereoSource::Mean(eye, [first, second]) => {
                (eye, [0, 1].map(|i| first[i] as f64 + within[i] * (second[i] - first[i] + 1) as f64))
            }
        })
    }

    /// Where the left eye's picture of this size stands in the composed picture: the place of its left top corner, and composed pixels per
    /// pixel of it along each axis.
    pub fn left_eye(self, [width, _]: [f64; 2]) -> ([f64; 2], [f64; 2]) {
        match self {
            Self::CrossEyed => ([width, 0.0], [1.0; 2]),
            Self::SideBySideHalf => ([0.0; 2], [0.5, 1.0]),
            Self::OverUnderHalf => ([0.0; 2], [1.0, 0.5]),
            Self::SideBySide
            | Self::OverUnder
            | Self::Anaglyph(_)
            | Self::RowInterlaced
            | Self::ColumnInterlaced
            | Self::Checkerboard
            | Self::Swapchain => ([0.0; 2], [1.0; 2]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every place of the left eye's picture is found where it is shown, but for pixels that show the right eye instead.
    #[test]
    fn places_are_found_again() {
        for size in [[6, 4], [5, 3]] {
            for layout in StereoLayout::ALL.into_iter().chain([StereoLayout::Swapchain]) {
                let (corner, scale) = layout.left_eye(size.map(|n| n as f64));
                let mut found = 0;
                for (x, y) in (0..size[0]).flat_map(|x| (0..size[1]).map(move |y| (x, y))) {
                    let place = [x as f64 + 0.25, y as f64 + 0.75];
                    let shown = [0, 1].map(|i| corner[i] + scale[i] * place[i]);
                    let (eye, back) = layout.place_of_eye(size, shown).expect("within");
                    // The last column or row of an odd number has a composed pixel of its own, half of which stands for nothing else.
                    let is_last =
                        (0..2).any(|i| scale[i] < 1.0 && size[i] % 2 == 1 && back[i] >= size[i] as f64 - 1.0);
                    if eye == Eye::Left && !is_last {
                        assert!(
                            (0..2).all(|i| (back[i] - place[i]).abs() < 1e-9),
                            "{layout:?} {place:?}: {back:?}"
                        );
                    }
                    found += usize::from(eye == Eye::Left);
                }
                assert!(2 * found >= size[0] * size[1], "{layout:?}: {found}");
                assert_eq!(layout.place_of_eye(size, [-0.5, 0.0]), None);
                let beyond = layout.size(size).expect("small").map(|n| n as f64);
                assert_eq!(layout.place_of_eye(size, beyond), None);
            }
        }
    }

    #[test]
    fn the_right_eye_stands_beside_below_or_between() {
        let at = |layout: StereoLayout, place| layout.place_of_eye([6, 4], place).expect("within");
        assert_eq!(at(StereoLayout::SideBySide, [7.5, 1.5]), (Eye::Right, [1.5, 1.5]));
        assert_eq!(at(StereoLayout::CrossEyed, [1.5, 1.5]), (Eye::Right, [1.5, 1.5]));
        assert_eq!(at(StereoLayout::OverUnder, [1.5, 5.5]), (Eye::Right, [1.5, 1.5]));
        assert_eq!(at(StereoLayout::SideBySideHalf, [4.25, 0.5]), (Eye::Right, [2.5, 0.5]));
        assert_eq!(at(StereoLayout::RowInterlaced, [1.5, 1.5]), (Eye::Right, [1.5, 1.5]));
        assert_eq!(at(StereoLayout::ALL[5], [1.5, 1.5]), (Eye::Left, [1.5, 1.5]));
    }
}
