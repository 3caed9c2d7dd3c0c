//! Anaglyphs: matrices that mix the colours of both eyes for glasses with coloured filters.
//!
//! Dubois (“A projection method to generate anaglyph stereo images”, ICASSP 2001) chooses the colour of each pixel such that what
//! both eyes see through the filters has the least squared distance, in CIE XYZ, to what they should see. For given primaries and
//! filters that is one matrix of 3×6 on the **linear** colours of both eyes, scaled such that white stays white; what leaves the
//! range of the display is clipped.

/// The glasses an anaglyph is for; the first colour is the left eye's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Anaglyph {
    /// Red and cyan.
    #[default]
    RedCyan,
    /// Green and magenta.
    GreenMagenta,
    /// Amber and blue.
    AmberBlue,
    /// Red and cyan, of the luminances of both eyes: no retinal rivalry, and no colours.
    Grey,
}

/// Rows of a matrix on linear Rec.709.
type Rows = [[f32; 3]; 3];

/// Weights of luminance in Rec.709 (ITU-R BT.709).
const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];

impl Anaglyph {
    /// The matrices on linear Rec.709 of the left and the right eye, whose products are added. Their rows are those of red, green and blue.
    ///
    /// Red and cyan: Dubois, “Conversion of a stereo pair to anaglyph with the least-squares projection method”, 2009 (for sRGB displays).
    /// Green and magenta, amber and blue: published by Dubois in 2010 (flickr.com/photos/e_dubois/5132528166 and 5230654930). Copies of both
    /// with other signs are in circulation; in these each row of both matrices sums to 1 within the rounding of 1e-3.
    pub const fn matrices(self) -> [Rows; 2] {
        const NONE: [f32; 3] = [0.0; 3];
        match self {
            Self::RedCyan => [
                [[0.437, 0.449, 0.164], [-0.062, -0.062, -0.024], [-0.048, -0.050, -0.017]],
                [[-0.011, -0.032, -0.007], [0.377, 0.761, 0.009], [-0.026, -0.093, 1.234]],
            ],
            Self::GreenMagenta => [
                [[-0.062, -0.158, -0.039], [0.284, 0.668, 0.143], [-0.015, -0.027, 0.021]],
                [[0.529, 0.705, 0.024], [-0.016, -0.015, -0.065], [0.009, 0.075, 0.937]],
            ],
            Self::AmberBlue => [
                [[1.062, -0.205, 0.299], [-0.026, 0.908, 0.068], [-0.038, -0.173, 0.022]],
                [[-0.016, -0.123, -0.017], [0.006, 0.062, -0.017], [0.094, 0.185, 0.911]],
            ],
            Self::Grey => [[LUMINANCE, NONE, NONE], [NONE, LUMINANCE, LUMINANCE]],
        }
    }
}
