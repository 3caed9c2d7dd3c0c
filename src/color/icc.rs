//! ICC matrix profiles of displays (ICC.1:2022): the matrix from XYZ and the inverse of the tone curves.
//!
//! Colorants are stored for the profile connection space, whose white is D50. They are brought to D65, which is white here,
//! by undoing the profile's own adaptation (`chad`) and, where there is none, Bradford's.
//!
//! The few tags are read here: `moxcms` would take most of its build time for transforms that the tone mapper does itself.

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};

use crate::color::cie;
use crate::color::profile::{Profile, TRANSFER_STEPS, TransferTable};

/// Why a file does not serve as a display profile.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct IccError(String);

/// White of the profile connection space.
const D50: DVec3 = DVec3::new(0.9642, 1.0, 0.8249);

/// Reads a profile from the bytes of its file; the name is left empty.
///
/// # Errors
/// If the profile is invalid or not supported; the message says why.
pub fn parse(bytes: &[u8]) -> Result<Profile, IccError> {
    matrix_profile(bytes).map_err(IccError)
}

fn matrix_profile(bytes: &[u8]) -> Result<Profile, String> {
    if bytes.len() < 132 || bytes[36..40] != *b"acsp" {
        return Err("it is no ICC profile".to_owned());
    }
    if bytes[16..20] != *b"RGB " || bytes[20..24] != *b"XYZ " {
        return Err("it is not one of RGB by a matrix".to_owned());
    }
    let file = Tags { bytes };
    let colorant = |name| file.xyz(name);
    let to_pcs = DMat3::from_cols(colorant(b"rXYZ")?, colorant(b"gXYZ")?, colorant(b"bXYZ")?);
    let adaptation = match file.tag(b"chad") {
        Some(tag) => matrix(tag)?,
        None => bradford(cie::d65_white(), D50),
    };
    if !(adaptation.determinant().abs() > 1e-3 && to_pcs.determinant().abs() > 1e-4) {
        return Err("its matrix cannot be inverted".to_owned());
    }
    // As measured, then scaled along the cones' axes so that its white is exactly ours.
    let measured = adaptation.inverse() * to_pcs;
    let white = measured * DVec3::ONE;
    let to_xyz = bradford(white, cie::d65_white()) * measured;
    let from_xyz = to_xyz.inverse();
    if !from_xyz.is_finite() {
        return Err("its matrix cannot be inverted".to_owned());
    }
    let primaries = [to_xyz.x_axis, to_xyz.y_axis, to_xyz.z_axis].map(|c| {
        let sum = c.x + c.y + c.z;
        // Rounding puts spectral reds beyond the edge of the diagram, where a file may not name them.
        DVec2::new(c.x / sum, (c.y / sum).min(1.0 - 1e-5 - c.x / sum))
    });
    let curves = [b"rTRC", b"gTRC", b"bTRC"].map(|name| file.curve(name));
    let [red, green, blue] = curves;
    let transfer = table(&[red?, green?, blue?])?;
    Ok(Profile {
        name: String::new(),
        from_xyz: from_xyz.as_mat3(),
        primaries,
        transfer: Some(transfer),
        icc: Some(bytes.into()),
    })
}

/// The tags of a profile.
struct Tags<'a> {
    bytes: &'a [u8],
}

impl<'a> Tags<'a> {
    /// The data of a tag.
    fn tag(&self, name: &[u8; 4]) -> Option<&'a [u8]> {
        let count = u32_at(self.bytes, 128)? as usize;
        let entry = (0..count.min(1000))
            .map(|i| 132 + 12 * i)
            .find(|at| self.bytes.get(*at..at + 4) == Some(name))?;
        let (start, size) =
            (u32_at(self.bytes, entry + 4)? as usize, u32_at(self.bytes, entry + 8)? as usize);
        self.bytes.get(start..start.checked_add(size)?)
    }

    fn wanted(&self, name: &[u8; 4]) -> Result<&'a [u8], String> {
        let text = || String::from_utf8_lossy(name).into_owned();
        self.tag(name).ok_or_else(|| match self.tag(b"A2B0") {
            Some(_) => format!("it works by a table of colours and has no {}", text()),
            None => format!("it has no {}, or ends before it", text()),
        })
    }

    fn xyz(&self, name: &[u8; 4]) -> Result<DVec3, String> {
        let tag = self.wanted(name)?;
        let at = |i: usize| fixed_at(tag, 8 + 4 * i);
        match (tag.get(..4), at(0), at(1), at(2)) {
            (Some(b"XYZ "), Some(x), Some(y), Some(z)) => Ok(DVec3::new(x, y, z)),
            _ => Err(format!("its {} is damaged", String::from_utf8_lossy(name))),
        }
    }

    fn curve(&self, name: &[u8; 4]) -> Result<Curve, String> {
        let tag = self.wanted(name)?;
        let curve = match tag.get(..4) {
            Some(b"curv") => sampled(tag),
            Some(b"para") => parametric(tag),
            _ => None,
        };
        curve.ok_or_else(|| {
            format!("its {} is of a kind that is not known, or damaged", String::from_utf8_lossy(name))
        })
    }
}

/// Signal to luminance of one channel.
enum Curve {
    /// Even steps of the signal.
    Sampled(Vec<f64>),
    /// `(a·x + b)^g + e` from `d` on, `c·x + f` below: `[g, a, b, c, d, e, f]`.
    Parametric([f64; 7]),
}

impl Curve {
    fn at(&self, x: f64) -> f64 {
        match self {
            Curve::Sampled(values) => {
                let last = values.len() - 1;
                let p = x * last as f64;
                let i = (p as usize).min(last.saturating_sub(1));
                values[i] + (values[(i + 1).min(last)] - values[i]) * (p - i as f64)
            }
            Curve::Parametric([g, a, b, c, d, e, f]) => {
                if x >= *d {
                    (a * x + b).max(0.0).powf(*g) + e
                } else {
                    c * x + f
                }
            }
        }
    }
}

/// `curv`: nothing is linear, one number a power of 8.8 bits, more are samples of 16 bits.
fn sampled(tag: &[u8]) -> Option<Curve> {
    let count = u32_at(tag, 8)? as usize;
    let data = tag.get(12..12usize.checked_add(count.checked_mul(2)?)?)?;
    let values: Vec<f64> =
        data.chunks_exact(2).map(|b| f64::from(u16::from_be_bytes([b[0], b[1]]))).collect();
    Some(match values[..] {
        [] => Curve::Parametric([1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        [power] => Curve::Parametric([power / 256.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        _ => Curve::Sampled(values.into_iter().map(|v| v / 65535.0).collect()),
    })
}

/// `para`: five kinds of power with a straight beginning.
fn parametric(tag: &[u8]) -> Option<Curve> {
    let kind = u16::from_be_bytes([*tag.get(8)?, *tag.get(9)?]);
    let p = |i: usize| fixed_at(tag, 12 + 4 * i);
    let g = p(0)?;
    Some(Curve::Parametric(match kind {
        0 => [g, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        1 => [g, p(1)?, p(2)?, 0.0, -p(2)? / p(1)?, 0.0, 0.0],
        2 => [g, p(1)?, p(2)?, 0.0, -p(2)? / p(1)?, p(3)?, p(3)?],
        3 => [g, p(1)?, p(2)?, p(3)?, p(4)?, 0.0, 0.0],
        4 => [g, p(1)?, p(2)?, p(3)?, p(4)?, p(5)?, p(6)?],
        _ => return None,
    }))
}

/// Inverts the curves by bisection; they must rise, from about 0 to about 1.
fn table(curves: &[Curve; 3]) -> Result<TransferTable, String> {
    for curve in curves {
        let steps = (0..=256).map(|i| curve.at(f64::from(i) / 256.0));
        let rises = steps.clone().is_sorted_by(|a, b| *b >= *a - 1e-6);
        if !(rises && curve.at(0.0).abs() < 0.1 && (curve.at(1.0) - 1.0).abs() < 0.1) {
            return Err("its tone curves do not rise from 0 to 1".to_owned());
        }
    }
    let signal = |curve: &Curve, y: f64| {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            *(if curve.at(middle) < y { &mut low } else { &mut high }) = middle;
        }
        // Where the curve is flat at 0, black is still black.
        (if y <= 0.0 { 0.0 } else { high }) as f32
    };
    let entry = |i: usize| {
        let y = (i as f64 / (TRANSFER_STEPS - 1) as f64).powi(2);
        std::array::from_fn(|k| signal(&curves[k], y))
    };
    Ok(TransferTable((0..TRANSFER_STEPS).map(entry).collect::<Arc<[[f32; 3]]>>()))
}

/// Bradford's adaptation from one white to another (ICC.1:2022, annex E).
fn bradford(from: DVec3, to: DVec3) -> DMat3 {
    let cones =
        DMat3::from_cols_array(&[0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296]);
    cones.inverse() * DMat3::from_diagonal((cones * to) / (cones * from)) * cones
}

/// An `sf32` of nine numbers, in rows.
fn matrix(tag: &[u8]) -> Result<DMat3, String> {
    let mut rows = [0.0; 9];
    for (i, value) in rows.iter_mut().enumerate() {
        *value = fixed_at(tag, 8 + 4 * i).ok_or("its chad is damaged")?;
    }
    Ok(DMat3::from_cols_array(&rows).transpose())
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    let b = bytes.get(at..at.checked_add(4)?)?;
    Some(u32::from_be_bytes([b[0], b[1], b[2], b[3]]))
}

/// An s15Fixed16Number.
fn fixed_at(bytes: &[u8], at: usize) -> Option<f64> {
    u32_at(bytes, at).map(|v| f64::from(v as i32) / 65536.0)
}
