//! Display profiles: primaries, white and the matrix `P` from XYZ to linear RGB (paper §4.3).
//!
//! All matrices are computed in double precision from the chromaticities of the primaries and one white: the XYZ
//! of D65 as the tables of [`cie`] sum it. A surface or light of RGB (1, 1, 1) is
//! therefore exactly neutral on every display (the rounded white of the standards, x = 0.3127, y = 0.3290, differs
//! from it by less than 5e-4).

use std::sync::{Arc, LazyLock};

use glam::{DMat3, DVec2, DVec3, Mat3, Vec3};

use crate::color::cie;

/// A matrix display profile.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Name on the command line.
    pub name: String,
    /// XYZ (D65 white has Y = 1) to linear RGB.
    pub from_xyz: Mat3,
    /// CIE xy chromaticities of red, green and blue, for the heads of picture files; the white is D65.
    pub primaries: [DVec2; 3],
    /// The display's own transfer, of an ICC profile; `None` is a power, the display gamma.
    pub transfer: Option<TransferTable>,
    /// The bytes of the ICC profile that this one was read from, for the heads of picture files; `None` for a named one.
    pub icc: Option<Arc<[u8]>>,
}

/// Signal of each channel at [`TRANSFER_STEPS`] luminances, at the squares of `i / (TRANSFER_STEPS − 1)`: so the steps are
/// even to the eye, and a line between two is exact within 1e-3 of a step of 8 bits.
#[derive(Clone, Debug, PartialEq)]
pub struct TransferTable(pub Arc<[[f32; 3]]>);

/// Entries of a [`TransferTable`].
pub const TRANSFER_STEPS: usize = 1024;

impl TransferTable {
    /// Signals of linear values in 0 … 1.
    #[inline]
    pub fn apply(&self, rgb: Vec3) -> Vec3 {
        let last = self.0.len() - 1;
        let at = rgb.to_array().map(|c| c.sqrt() * last as f32);
        Vec3::from(std::array::from_fn(|k| {
            let i = (at[k] as usize).min(last - 1);
            let (a, b) = (self.0[i][k], self.0[i + 1][k]);
            a + (b - a) * (at[k] - i as f32)
        }))
    }

    /// The least linear values in 0 … 1 whose signals reach `signal`; 1 where none does.
    pub fn invert(&self, signal: f32) -> Vec3 {
        let (mut low, mut high) = (Vec3::ZERO, Vec3::ONE);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            let reached = self.apply(middle).cmpge(Vec3::splat(signal));
            (low, high) = (Vec3::select(reached, low, middle), Vec3::select(reached, middle, high));
        }
        high
    }
}

/// A name and the CIE xy chromaticities of red, green and blue; the white is D65.
type Primaries = (&'static str, [DVec2; 3]);

/// IEC 61966-2-1 (sRGB), the same primaries as ITU-R BT.709.
const SRGB: Primaries = ("srgb", [DVec2::new(0.64, 0.33), DVec2::new(0.30, 0.60), DVec2::new(0.15, 0.06)]);

/// Display P3: primaries of SMPTE RP 431-2 with a D65 white (SMPTE EG 432-1).
const DISPLAY_P3: Primaries =
    ("display-p3", [DVec2::new(0.680, 0.320), DVec2::new(0.265, 0.690), DVec2::new(0.150, 0.060)]);

/// ITU-R BT.2020.
const REC2020: Primaries =
    ("rec2020", [DVec2::new(0.708, 0.292), DVec2::new(0.170, 0.797), DVec2::new(0.131, 0.046)]);

const ALL: [Primaries; 3] = [SRGB, DISPLAY_P3, REC2020];

static REC709: LazyLock<DMat3> = LazyLock::new(|| xyz_from_rgb(SRGB.1));

impl Profile {
    /// sRGB primaries, D65 white.
    pub fn srgb() -> Self {
        Self::new(SRGB)
    }

    /// ITU-R BT.2020 primaries, D65 white.
    pub fn rec2020() -> Self {
        Self::new(REC2020)
    }

    /// The profile of this name, or `None`; [`Profile::names`] lists them.
    pub fn named(name: &str) -> Option<Self> {
        ALL.into_iter().find(|p| p.0 == name).map(Self::new)
    }

    /// The names that [`Profile::named`] knows.
    pub fn names() -> [&'static str; ALL.len()] {
        ALL.map(|p| p.0)
    }

    fn new((name, primaries): Primaries) -> Self {
        let from_xyz = xyz_from_rgb(primaries).inverse().as_mat3();
        Profile { name: name.to_owned(), from_xyz, primaries, transfer: None, icc: None }
    }
}

/// XYZ to scene-linear Rec.709 RGB, the colours of an EXR without a chromaticities attribute.
pub fn rec709_from_xyz() -> Mat3 {
    REC709.inverse().as_mat3()
}

/// Luminances of Rec.709's red, green and blue.
pub fn rec709_luminance() -> Vec3 {
    REC709.row(1).as_vec3()
}

/// Scene-linear Rec.709 RGB to XYZ, in the precision that fitting spectra needs.
pub fn xyz_from_rec709() -> DMat3 {
    *REC709
}

/// Linear RGB of these primaries and this white, CIE xy chromaticities, to scene-linear Rec.709: colours of the same light, without
/// adaptation. `None` where they are not those of three colours.
pub fn rec709_from(primaries: [DVec2; 3], white: DVec2) -> Option<Mat3> {
    let matrix = REC709.inverse() * xyz_from_rgb_of_white(primaries, xyz_of(white));
    (matrix.is_finite() && matrix.determinant().is_normal()).then(|| matrix.as_mat3())
}

/// XYZ of luminance 1 of a chromaticity.
fn xyz_of(xy: DVec2) -> DVec3 {
    DVec3::new(xy.x / xy.y, 1.0, (1.0 - xy.x - xy.y) / xy.y)
}

/// Linear RGB to XYZ of a display, whose white is D65.
fn xyz_from_rgb(primaries: [DVec2; 3]) -> DMat3 {
    xyz_from_rgb_of_white(primaries, cie::d65_white())
}

/// Linear RGB to XYZ from the chromaticities of the primaries: each primary is scaled such that the three sum to
/// the white (SMPTE RP 177).
fn xyz_from_rgb_of_white(primaries: [DVec2; 3], white: DVec3) -> DMat3 {
    let [r, g, b] = primaries.map(xyz_of);
    let unscaled = DMat3::from_cols(r, g, b);
    let scale = unscaled.inverse() * white;
    unscaled * DMat3::from_diagonal(scale)
}
