//! Values that can be changed: which they are, their types and ranges.

use glam::{DAffine3, DMat3, DVec3};

use crate::scene::desc::{BsdfId, MediumId, SHARPEST_PHONG, SceneDesc};

pub use super::parameters::BsdfNumber;
use super::parameters::parameters;

/// One value of the scene, by place in the description.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub enum Target {
    /// Factor on the emission of a shape (index into `shapes`).
    Emission(u32),
    /// Colour of the emission of a shape, linear Rec.709 with 1 for its largest component; its luminance stays.
    EmissionColor(u32),
    /// Factor on a light that is not a shape (index into `lights`).
    Light(u32),
    /// Colour of a light that is not a shape, as [`Target::EmissionColor`].
    LightColor(u32),
    /// Reflectance of a diffuse material or of the base of a plastic, linear Rec.709.
    Reflectance(BsdfId),
    /// Interior index of refraction of a dielectric, smooth or rough, or of the coat of a plastic.
    IntIor(BsdfId),
    /// Factor on the specular reflection of a material, linear Rec.709.
    SpecularReflectance(BsdfId),
    /// Factor on the specular transmission of a material, linear Rec.709.
    SpecularTransmittance(BsdfId),
    /// Whether the textures of a material are seen, or their means.
    Textures(BsdfId),
    /// A number of a material.
    Number(BsdfId, BsdfNumber),
    /// Position of a light that is not a shape, world space.
    LightPosition(u32),
    /// Direction in which a light that is not a shape shines, world space, of any length.
    LightDirection(u32),
    /// Transform of a shape or an instance, object space to world space.
    ToWorld(u32),
    /// Factor on the extinction coefficient of a medium.
    Density(MediumId),
    /// Colour of the extinction coefficient of a medium, linear Rec.709 in which only proportions count; its largest component stays.
    ExtinctionColor(MediumId),
    /// Albedo of a medium, linear Rec.709.
    Albedo(MediumId),
    /// Mean cosine of a phase function `hg`.
    Asymmetry(MediumId),
    /// Factor on the emission of a medium.
    MediumEmission(MediumId),
}

/// A new value.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum NewValue {
    /// A factor on what the file says, ≥ 0.
    Scale(f64),
    /// Linear Rec.709.
    Rgb([f64; 3]),
    /// A number.
    Number(f64),
    /// On or off.
    Switch(bool),
    /// A point or a direction.
    Vector([f64; 3]),
    /// An invertible transform.
    Transform(DAffine3),
}

impl NewValue {
    /// Its numbers as a file has them: a switch is 0 or 1, a transform has the sixteen of Mitsuba's `matrix`, row by row.
    pub(crate) fn numbers(self) -> Vec<f64> {
        match self {
            NewValue::Scale(v) | NewValue::Number(v) => vec![v],
            NewValue::Rgb(numbers) | NewValue::Vector(numbers) => numbers.to_vec(),
            NewValue::Switch(on) => vec![f64::from(u8::from(on))],
            NewValue::Transform(DAffine3 { matrix3: m, translation: t }) => {
                let rows = [0, 1, 2].map(|i| [m.x_axis[i], m.y_axis[i], m.z_axis[i], t[i]]);
                [rows.as_flattened(), &LAST_ROW].concat()
            }
        }
    }
}

/// The last row of the matrix of an affine transform.
const LAST_ROW: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// The reason why a value cannot be set.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EditError {
    /// The scene has no such object, or the object has no such value.
    #[error("{object} {index} of this scene has no {parameter} to change")]
    NoTarget {
        /// Kind of object.
        object: &'static str,
        /// Index of the object.
        index: u32,
        /// The value's name.
        parameter: &'static str,
    },
    /// The value is of another type, or out of range.
    #[error("{parameter} cannot be {value}: {wanted}")]
    Value {
        /// The value's name.
        parameter: &'static str,
        /// The given value.
        value: String,
        /// The accepted values.
        wanted: &'static str,
    },
}

/// The kind of an object that can be changed: a list of the description.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ObjectKind {
    /// [`SceneDesc::shapes`].
    Shape,
    /// [`SceneDesc::bsdfs`].
    Bsdf,
    /// [`SceneDesc::lights`].
    Light,
    /// [`SceneDesc::media`].
    Medium,
}

impl ObjectKind {
    pub(crate) const ALL: [ObjectKind; 4] =
        [ObjectKind::Shape, ObjectKind::Bsdf, ObjectKind::Light, ObjectKind::Medium];

    /// The element's name in a file.
    pub(crate) fn tag(self) -> &'static str {
        match self {
            ObjectKind::Shape => "shape",
            ObjectKind::Bsdf => "bsdf",
            ObjectKind::Light => "emitter",
            ObjectKind::Medium => "medium",
        }
    }
}

/// Largest factor on an emission: what a spectrum can hold.
const BRIGHTEST: f64 = 1e30;

/// Largest coordinate.
const FARTHEST: f64 = 1e12;

/// A range of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NumberRange {
    /// Least and greatest number that is accepted.
    accepted: [f64; 2],
    /// Least and greatest number that a slider offers.
    slider: [f64; 2],
    /// The accepted numbers, in words.
    wanted: &'static str,
}

impl NumberRange {
    /// A share of light or of a surface.
    pub(crate) const SHARE: Self =
        Self { accepted: [0.0, 1.0], slider: [0.0, 1.0], wanted: "it is a number from 0 to 1" };
    /// Twice a share.
    pub(crate) const DOUBLE_SHARE: Self =
        Self { accepted: [0.0, 2.0], slider: [0.0, 2.0], wanted: "it is a number from 0 to 2" };
    /// A share that is not 0.
    pub(crate) const SOME_SHARE: Self =
        Self { accepted: [1e-3, 1.0], slider: [1e-3, 1.0], wanted: "it is a number from 0.001 to 1" };
    /// Roughness of microfacets.
    pub(crate) const ALPHA: Self =
        Self { accepted: [1e-4, 1e4], slider: [1e-4, 1.0], wanted: "a roughness is from 0.0001 to 10000" };
    /// The thickness of a coat.
    pub(crate) const THICKNESS: Self =
        Self { accepted: [0.0, 1e12], slider: [0.0, 10.0], wanted: "a thickness is from 0 to 1e12" };
    /// The exponent of a Phong lobe.
    pub(crate) const EXPONENT: Self = Self {
        accepted: [0.0, SHARPEST_PHONG as f64],
        slider: [1.0, 1e4],
        wanted: "an exponent is from 0 to 1000000",
    };
    /// The thickness of a film in nm.
    pub(crate) const NANOMETERS: Self = Self {
        accepted: [0.0, 1e5],
        slider: [0.0, 1200.0],
        wanted: "the thickness of a film is from 0 to 100000 nm",
    };
    /// The relative index of a film.
    pub(crate) const FILM_ETA: Self =
        Self { accepted: [1.0, 10.0], slider: [1.0, 3.0], wanted: "the index of a film is from 1 to 10" };
    /// An index of refraction. The reader's bound is above 0, which no slider can say.
    pub(crate) const IOR: Self = Self {
        accepted: [f32::MIN_POSITIVE as f64, 1e3],
        slider: [1e-3, 1e3],
        wanted: "an index of refraction is above 0 and not above 1000",
    };
    /// A mean cosine; the reader's bounds are just below −1 and 1, which no slider can say.
    pub(crate) const ASYMMETRY: Self = Self {
        accepted: [-0.999, 0.999],
        slider: [-0.999, 0.999],
        wanted: "it is a number from -0.999 to 0.999",
    };
    /// An index of refraction relative to what is outside, which differs from it.
    pub(crate) const RELATIVE_IOR: Self = Self {
        accepted: [1.001, 1e3],
        slider: [1.001, 4.0],
        wanted: "this index of refraction is from 1.001 to 1000",
    };
}

/// The type of a value and its range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ValueKind {
    /// A factor from 0.
    Scale,
    /// Three shares of light.
    Reflectance,
    /// A number.
    Number(NumberRange),
    /// On or off.
    Switch,
    /// A point.
    Point,
    /// A direction of any length.
    Direction,
    /// An invertible transform.
    Transform,
}

impl ValueKind {
    /// The value of this type made of `numbers`, if there are as many as it has.
    pub(crate) fn value(self, numbers: &[f64]) -> Option<NewValue> {
        match (self, numbers) {
            (ValueKind::Scale, [v]) => Some(NewValue::Scale(*v)),
            (ValueKind::Reflectance, [r, g, b]) => Some(NewValue::Rgb([*r, *g, *b])),
            (ValueKind::Number(_), [v]) => Some(NewValue::Number(*v)),
            (ValueKind::Switch, [v]) => Some(NewValue::Switch(*v != 0.0)),
            (ValueKind::Point | ValueKind::Direction, [x, y, z]) => Some(NewValue::Vector([*x, *y, *z])),
            (ValueKind::Transform, [a, b, c, x, d, e, f, y, g, h, i, z, last @ ..]) if *last == LAST_ROW => {
                let matrix3 = DMat3::from_cols_array(&[*a, *d, *g, *b, *e, *h, *c, *f, *i]);
                Some(NewValue::Transform(DAffine3 { matrix3, translation: DVec3::new(*x, *y, *z) }))
            }
            _ => None,
        }
    }

    /// The accepted values, in words.
    pub(crate) fn wanted(self) -> &'static str {
        match self {
            ValueKind::Scale => "it is a factor from 0 to 1e30",
            ValueKind::Reflectance => "it is a colour of three numbers from 0 to 1",
            ValueKind::Number(range) => range.wanted,
            ValueKind::Switch => "it is 1 for on or 0 for off",
            ValueKind::Point => "it is a point of three finite numbers",
            ValueKind::Direction => "it is a direction of three finite numbers, not all 0",
            ValueKind::Transform => {
                "it is an invertible matrix of sixteen numbers, row by row, the last row 0 0 0 1"
            }
        }
    }

    /// Least and greatest number.
    fn bounds(self) -> [f64; 2] {
        match self {
            ValueKind::Scale => [0.0, BRIGHTEST],
            ValueKind::Reflectance | ValueKind::Switch => [0.0, 1.0],
            ValueKind::Number(range) => range.slider,
            ValueKind::Point | ValueKind::Direction | ValueKind::Transform => [-FARTHEST, FARTHEST],
        }
    }

    fn accepts(self, value: NewValue) -> bool {
        // None of these comparisons holds for what is not a number.
        let near = |v: DVec3| v.abs().max_element() <= FARTHEST && v.is_finite();
        match (self, value) {
            (ValueKind::Scale, NewValue::Scale(v)) => (0.0..=BRIGHTEST).contains(&v),
            (ValueKind::Reflectance, NewValue::Rgb(rgb)) => rgb.iter().all(|v| (0.0..=1.0).contains(v)),
            (ValueKind::Number(NumberRange { accepted: [least, most], .. }), NewValue::Number(v)) => {
                (least..=most).contains(&v)
            }
            (ValueKind::Switch, NewValue::Switch(_)) => true,
            (ValueKind::Point, NewValue::Vector(v)) => near(v.into()),
            (ValueKind::Direction, NewValue::Vector(v)) => {
                near(v.into()) && DVec3::from(v).try_normalize().is_some()
            }
            (ValueKind::Transform, NewValue::Transform(DAffine3 { matrix3: m, translation })) => {
                let columns = [m.x_axis, m.y_axis, m.z_axis];
                let inverse = m.determinant().recip();
                near(translation) && columns.into_iter().all(near) && inverse.is_finite()
            }
            _ => false,
        }
    }
}

/// A value of a kind of objects that can be changed.
#[derive(Debug)]
pub(crate) struct EditableParameter {
    /// Its name in a saved file.
    pub(crate) name: &'static str,
    /// Its name for the user.
    pub(crate) label: &'static str,
    /// Kind of the objects that have the value.
    pub(crate) object: ObjectKind,
    /// Type and range of the value.
    pub(crate) range: ValueKind,
    /// The target of an object by its index.
    pub(crate) target: fn(u32) -> Target,
    /// Reads the value; `None` where the object has no such value.
    pub(crate) get: fn(&SceneDesc, u32) -> Option<NewValue>,
    /// Changes an object that has it, by an accepted value.
    pub(super) set: fn(&mut SceneDesc, u32, NewValue),
}

impl Target {
    /// Its line in the table, and the index of its object.
    pub(crate) fn parameter(self) -> (&'static EditableParameter, u32) {
        let (Target::Emission(index)
        | Target::EmissionColor(index)
        | Target::Light(index)
        | Target::LightColor(index)
        | Target::Reflectance(BsdfId(index))
        | Target::IntIor(BsdfId(index))
        | Target::SpecularReflectance(BsdfId(index))
        | Target::SpecularTransmittance(BsdfId(index))
        | Target::Textures(BsdfId(index))
        | Target::Number(BsdfId(index), _)
        | Target::LightPosition(index)
        | Target::LightDirection(index)
        | Target::ToWorld(index)
        | Target::Density(MediumId(index))
        | Target::ExtinctionColor(MediumId(index))
        | Target::Albedo(MediumId(index))
        | Target::Asymmetry(MediumId(index))
        | Target::MediumEmission(MediumId(index))) = self;
        let found = parameters().find(|p| (p.target)(index) == self);
        (found.expect("every target has its line: held by a test"), index)
    }

    /// Reads the value from `desc`: the factor 1, a colour or a number.
    ///
    /// # Errors
    ///
    /// [`EditError::NoTarget`] when the scene has no such value.
    pub fn get(self, desc: &SceneDesc) -> Result<NewValue, EditError> {
        let (p, index) = self.parameter();
        let none = EditError::NoTarget { object: p.object.tag(), index, parameter: p.label };
        (p.get)(desc, index).ok_or(none)
    }

    /// The value's name for the user, such as `reflectance`.
    pub fn label(self) -> &'static str {
        self.parameter().0.label
    }

    /// Least and greatest value a slider can offer, of each component.
    pub fn bounds(self) -> [f64; 2] {
        self.parameter().0.range.bounds()
    }

    /// Checks a value for this target: its type and its range.
    ///
    /// # Errors
    ///
    /// [`EditError::Value`] that says what is accepted.
    pub fn check(self, value: NewValue) -> Result<(), EditError> {
        let (p, _) = self.parameter();
        if p.range.accepts(value) {
            return Ok(());
        }
        let value = match value.numbers().as_slice() {
            [v] => format!("{v:?}"),
            numbers => format!("{numbers:?}"),
        };
        Err(EditError::Value { parameter: p.label, value, wanted: p.range.wanted() })
    }

    /// Changes `desc`.
    ///
    /// # Errors
    ///
    /// The errors of [`Target::get`] and [`Target::check`]; `desc` then remains unchanged.
    pub fn set(self, desc: &mut SceneDesc, value: NewValue) -> Result<(), EditError> {
        self.get(desc)?;
        self.check(value)?;
        let (p, index) = self.parameter();
        (p.set)(desc, index, value);
        Ok(())
    }
}
