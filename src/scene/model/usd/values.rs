//! Values of attributes as numbers and words, whatever their precision.

use bytemuck::cast_slice;
use openusd::sdf::Value;

/// An array of tuples of `width` numbers; a single tuple is an array of one.
#[derive(Clone, Debug, Default)]
pub(super) struct Tuples {
    pub(super) width: usize,
    pub(super) values: Vec<f32>,
}

impl Tuples {
    pub(super) fn new(width: usize, values: Vec<f32>) -> Self {
        Self { width, values }
    }

    pub(super) fn len(&self) -> usize {
        self.values.len().checked_div(self.width).unwrap_or(0)
    }

    /// The first `N` numbers of tuple `i`, as far as it has them; 0 for others.
    pub(super) fn get<const N: usize>(&self, i: usize) -> Option<[f32; N]> {
        if self.width == 0 {
            return None;
        }
        let tuple = self.values.get(i.checked_mul(self.width)?..)?.get(..self.width)?;
        Some(std::array::from_fn(|k| tuple.get(k).copied().unwrap_or(0.0)))
    }

    /// All tuples.
    pub(super) fn all<const N: usize>(&self) -> Vec<[f32; N]> {
        (0..self.len()).filter_map(|i| self.get(i)).collect()
    }
}

/// Numbers of single precision, alone or in an array.
pub(super) fn tuples(value: &Value) -> Option<Tuples> {
    let narrow =
        |width: usize, values: &[f64]| Tuples::new(width, values.iter().map(|v| *v as f32).collect());
    let half =
        |width: usize, values: &[half::f16]| Tuples::new(width, values.iter().map(|v| v.to_f32()).collect());
    Some(match value {
        Value::Bool(v) => Tuples::new(1, vec![f32::from(u8::from(*v))]),
        Value::Int(v) => Tuples::new(1, vec![*v as f32]),
        Value::Half(v) => half(1, &[*v]),
        Value::Float(v) => Tuples::new(1, vec![*v]),
        Value::Double(v) => narrow(1, &[*v]),
        Value::HalfVec(v) => half(1, v),
        Value::FloatVec(v) => Tuples::new(1, v.clone()),
        Value::DoubleVec(v) => narrow(1, v),
        Value::IntVec(v) => Tuples::new(1, v.iter().map(|v| *v as f32).collect()),
        Value::Vec2h(v) => half(2, cast_slice(std::slice::from_ref(v))),
        Value::Vec2f(v) => Tuples::new(2, cast_slice(std::slice::from_ref(v)).to_vec()),
        Value::Vec2d(v) => narrow(2, cast_slice(std::slice::from_ref(v))),
        Value::Vec3h(v) => half(3, cast_slice(std::slice::from_ref(v))),
        Value::Vec3f(v) => Tuples::new(3, cast_slice(std::slice::from_ref(v)).to_vec()),
        Value::Vec3d(v) => narrow(3, cast_slice(std::slice::from_ref(v))),
        Value::Vec4h(v) => half(4, cast_slice(std::slice::from_ref(v))),
        Value::Vec4f(v) => Tuples::new(4, cast_slice(std::slice::from_ref(v)).to_vec()),
        Value::Vec4d(v) => narrow(4, cast_slice(std::slice::from_ref(v))),
        Value::Vec2hVec(v) => half(2, cast_slice(v)),
        Value::Vec2fVec(v) => Tuples::new(2, cast_slice(v).to_vec()),
        Value::Vec2dVec(v) => narrow(2, cast_slice(v)),
        Value::Vec3hVec(v) => half(3, cast_slice(v)),
        Value::Vec3fVec(v) => Tuples::new(3, cast_slice(v).to_vec()),
        Value::Vec3dVec(v) => narrow(3, cast_slice(v)),
        Value::Vec4hVec(v) => half(4, cast_slice(v)),
        Value::Vec4fVec(v) => Tuples::new(4, cast_slice(v).to_vec()),
        Value::Vec4dVec(v) => narrow(4, cast_slice(v)),
        Value::Quath(q) => Tuples::new(4, vec![q.w.to_f32(), q.x.to_f32(), q.y.to_f32(), q.z.to_f32()]),
        Value::Quatf(q) => Tuples::new(4, vec![q.w, q.x, q.y, q.z]),
        Value::Quatd(q) => narrow(4, &[q.w, q.x, q.y, q.z]),
        Value::QuathVec(v) => {
            Tuples::new(4, v.iter().flat_map(|q| [q.w, q.x, q.y, q.z].map(|v| v.to_f32())).collect())
        }
        Value::QuatfVec(v) => Tuples::new(4, v.iter().flat_map(|q| [q.w, q.x, q.y, q.z]).collect()),
        Value::QuatdVec(v) => {
            Tuples::new(4, v.iter().flat_map(|q| [q.w, q.x, q.y, q.z].map(|v| v as f32)).collect())
        }
        _ => return None,
    })
}

/// The numbers of one tuple or matrix in double precision.
pub(super) fn doubles(value: &Value) -> Option<Vec<f64>> {
    Some(match value {
        Value::Int(v) => vec![f64::from(*v)],
        Value::Uint(v) => vec![f64::from(*v)],
        Value::Int64(v) => vec![*v as f64],
        Value::Uint64(v) => vec![*v as f64],
        Value::Double(v) => vec![*v],
        Value::Vec2d(v) => cast_slice(std::slice::from_ref(v)).to_vec(),
        Value::Vec3d(v) => cast_slice(std::slice::from_ref(v)).to_vec(),
        Value::Vec4d(v) => cast_slice(std::slice::from_ref(v)).to_vec(),
        Value::Quatd(q) => vec![q.w, q.x, q.y, q.z],
        Value::Matrix4d(m) => m.0.to_vec(),
        other => {
            let Tuples { width, values } = tuples(other).filter(|tuples| tuples.len() == 1)?;
            values.into_iter().take(width).map(f64::from).collect()
        }
    })
}

/// Whole numbers.
pub(super) fn integers(value: &Value) -> Option<Vec<i64>> {
    Some(match value {
        Value::Int(v) => vec![i64::from(*v)],
        Value::IntVec(v) => v.iter().map(|v| i64::from(*v)).collect(),
        Value::UintVec(v) => v.iter().map(|v| i64::from(*v)).collect(),
        Value::Int64Vec(v) => v.clone(),
        Value::Uint64Vec(v) => v.iter().map(|v| i64::try_from(*v).unwrap_or(i64::MAX)).collect(),
        _ => return None,
    })
}

/// A word.
pub(super) fn word(value: &Value) -> Option<String> {
    Some(match value {
        Value::Token(v) => v.as_str().to_owned(),
        Value::String(v) => v.clone(),
        _ => return None,
    })
}

/// A list of words.
pub(super) fn words(value: &Value) -> Option<Vec<String>> {
    Some(match value {
        Value::TokenVec(v) => v.iter().map(|v| v.as_str().to_owned()).collect(),
        Value::StringVec(v) => v.clone(),
        _ => return None,
    })
}

/// Yes or no.
pub(super) fn truth(value: &Value) -> Option<bool> {
    match value {
        Value::Bool(v) => Some(*v),
        Value::Int(v) => Some(*v != 0),
        _ => None,
    }
}
