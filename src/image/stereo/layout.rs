//! Layouts: the place of both eyes' pixels in a composed picture.

use super::{Anaglyph, Eye};

/// How the pictures of both eyes become one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum StereoLayout {
    /// The left eye's picture at the left, for a viewer with parallel eyes or a stereoscope.
    #[default]
    SideBySide,
    /// The same, each at half its width: for television sets.
    SideBySideHalf,
    /// The left eye's picture above the right eye's.
    OverUnder,
    /// The same, each at half its height.
    OverUnderHalf,
    /// The right eye's picture at the left, for a viewer who squints.
    CrossEyed,
    /// Mixed for coloured glasses.
    Anaglyph(Anaglyph),
    /// Even rows, from the top one on, are the left eye's: for screens that polarise every second row.
    RowInterlaced,
    /// Even columns are the left eye's: for screens with a parallax barrier.
    ColumnInterlaced,
    /// The top left pixel and all other white fields of a chessboard are the left eye's: for DLP screens.
    Checkerboard,
    /// Not one picture but two, each in a layer of a window's images (quad-buffered stereo): for displays that show each eye a layer.
    Swapchain,
}

/// What a pixel of a composed picture shows; pixels are `[column, row]` of both eyes' pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StereoSource {
    /// A pixel of one eye.
    Pixel(Eye, [usize; 2]),
    /// The mean light of two neighbours of one eye; at the end of an odd row or column both are the last.
    Mean(Eye, [[usize; 2]; 2]),
    /// The pixel of both eyes, mixed by the matrices of these glasses.
    Mix(Anaglyph, [usize; 2]),
}

impl StereoLayout {
    /// All that make one picture, in the order in which they are listed.
    pub const ALL: [Self; 12] = [
        Self::SideBySide,
        Self::SideBySideHalf,
        Self::OverUnder,
        Self::OverUnderHalf,
        Self::CrossEyed,
        Self::Anaglyph(Anaglyph::RedCyan),
        Self::Anaglyph(Anaglyph::GreenMagenta),
        Self::Anaglyph(Anaglyph::AmberBlue),
        Self::Anaglyph(Anaglyph::Grey),
        Self::RowInterlaced,
        Self::ColumnInterlaced,
        Self::Checkerboard,
    ];

    /// The name on the command line, and that in the panel.
    const fn names(self) -> (&'static str, &'static str) {
        match self {
            Self::SideBySide => ("side-by-side", "Side by side"),
            Self::SideBySideHalf => ("side-by-side-half", "Side by side, half width"),
            Self::OverUnder => ("over-under", "Over/under"),
            Self::OverUnderHalf => ("over-under-half", "Over/under, half height"),
            Self::CrossEyed => ("cross-eyed", "Cross-eyed"),
            Self::Anaglyph(Anaglyph::RedCyan) => ("anaglyph", "Anaglyph, red–cyan"),
            Self::Anaglyph(Anaglyph::GreenMagenta) => ("anaglyph-green-magenta", "Anaglyph, green–magenta"),
            Self::Anaglyph(Anaglyph::AmberBlue) => ("anaglyph-amber-blue", "Anaglyph, amber–blue"),
            Self::Anaglyph(Anaglyph::Grey) => ("anaglyph-grey", "Anaglyph, grey"),
            Self::RowInterlaced => ("row-interlaced", "Interlaced rows"),
            Self::ColumnInterlaced => ("column-interlaced", "Interlaced columns"),
            Self::Checkerboard => ("checkerboard", "Checkerboard"),
            Self::Swapchain => ("swapchain", "A layer of the window for each eye"),
        }
    }

    /// Its name on the command line and in files.
    pub const fn name(self) -> &'static str {
        self.names().0
    }

    /// Its name in the panel.
    pub const fn label(self) -> &'static str {
        self.names().1
    }

    /// Whether pixels of the composed picture mix the light of several, so that their encoding must be known.
    pub const fn mixes_light(self) -> bool {
        matches!(self, Self::SideBySideHalf | Self::OverUnderHalf | Self::Anaglyph(_))
    }

    /// The layout of one picture that has this name, or `None`.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|layout| layout.name() == name)
    }

    /// The layout in which files show what a window shows in this one: layers stand side by side.
    pub const fn in_one_picture(self) -> Self {
        match self {
            Self::Swapchain => Self::SideBySide,
            layout => layout,
        }
    }

    /// Width and height of the composed picture of two of this size, or of each layer; half of an odd number is rounded up. `None` where a
    /// number overflows.
    pub fn size(self, [width, height]: [usize; 2]) -> Option<[usize; 2]> {
        Some(match self {
            Self::SideBySide | Self::CrossEyed => [width.checked_mul(2)?, height],
            Self::SideBySideHalf => [width.div_ceil(2).checked_mul(2)?, height],
            Self::OverUnder => [width, height.checked_mul(2)?],
            Self::OverUnderHalf => [width, height.div_ceil(2).checked_mul(2)?],
            Self::Anaglyph(_)
            | Self::RowInterlaced
            | Self::ColumnInterlaced
            | Self::Checkerboard
            | Self::Swapchain => [width, height],
        })
    }

    /// What the pixel `[x, y]` of the composed picture of two of this size shows; of layers that is the pixel of the left eye's.
    pub fn source(self, size: [usize; 2], pixel: [usize; 2]) -> StereoSource {
        let [x, y] = pixel;
        match self {
            Self::SideBySide => tile(size, pixel, 0, Eye::BOTH),
            Self::CrossEyed => tile(size, pixel, 0, [Eye::Right, Eye::Left]),
            Self::OverUnder => tile(size, pixel, 1, Eye::BOTH),
            Self::SideBySideHalf => half_tile(size, pixel, 0),
            Self::OverUnderHalf => half_tile(size, pixel, 1),
            Self::Anaglyph(glasses) => StereoSource::Mix(glasses, pixel),
            Self::RowInterlaced => StereoSource::Pixel(Eye::BOTH[y % 2], pixel),
            Self::ColumnInterlaced => StereoSource::Pixel(Eye::BOTH[x % 2], pixel),
            Self::Checkerboard => StereoSource::Pixel(Eye::BOTH[(x + y) % 2], pixel),
            Self::Swapchain => StereoSource::Pixel(Eye::Left, pixel),
        }
    }
}

/// Whole pictures one after the other along an axis.
fn tile(size: [usize; 2], mut pixel: [usize; 2], axis: usize, eyes: [Eye; 2]) -> StereoSource {
    let second = pixel[axis] >= size[axis];
    pixel[axis] -= if second { size[axis] } else { 0 };
    StereoSource::Pixel(eyes[usize::from(second)], pixel)
}

/// Pictures of half the extent one after the other along an axis.
fn half_tile(size: [usize; 2], pixel: [usize; 2], axis: usize) -> StereoSource {
    let half = size[axis].div_ceil(2);
    let second = pixel[axis] >= half;
    let first = 2 * (pixel[axis] - if second { half } else { 0 });
    let at = |place: usize| {
        let mut pixel = pixel;
        pixel[axis] = place.min(size[axis] - 1);
        pixel
    };
    StereoSource::Mean(Eye::BOTH[usize::from(second)], [at(first), at(first + 1)])
}
