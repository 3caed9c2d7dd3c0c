//! The table of values that can be changed.

use glam::Vec4;

use crate::scene::desc::{BsdfId, LightDesc, ProjectorDesc, SceneDesc};
use crate::spectrum::Spectrum;
use crate::spectrum::dispersion::{Ior, SODIUM_D};

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
}

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
}

impl ObjectKind {
    pub(crate) const ALL: [ObjectKind; 3] = [ObjectKind::Shape, ObjectKind::Bsdf, ObjectKind::Light];

    /// The element's name in a file.
    pub(crate) fn tag(self) -> &'static str {
        match self {
            ObjectKind::Shape => "shape",
            ObjectKind::Bsdf => "bsdf",
            ObjectKind::Light => "emitter",
        }
    }
}

/// Largest factor on an emission: what a spectrum can hold.
const BRIGHTEST: f64 = 1e30;

/// The type of a value and its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ValueKind {
    /// A factor from 0.
    Scale,
    /// Three shares of light.
    Reflectance,
    /// An index of refraction.
    Ior,
}

impl ValueKind {
    /// The value of this type made of `numbers`, if there are as many as it has.
    pub(crate) fn value(self, numbers: &[f64]) -> Option<NewValue> {
        match (self, numbers) {
            (ValueKind::Scale, [v]) => Some(NewValue::Scale(*v)),
            (ValueKind::Reflectance, [r, g, b]) => Some(NewValue::Rgb([*r, *g, *b])),
            (ValueKind::Ior, [v]) => Some(NewValue::Number(*v)),
            _ => None,
        }
    }

    /// The accepted values, in words.
    fn wanted(self) -> &'static str {
        match self {
            ValueKind::Scale => "it is a factor from 0 to 1e30",
            ValueKind::Reflectance => "it is a colour of three numbers from 0 to 1",
            ValueKind::Ior => "an index of refraction is above 0 and not above 1000",
        }
    }

    /// Least and greatest number.
    fn bounds(self) -> [f64; 2] {
        match self {
            ValueKind::Scale => [0.0, BRIGHTEST],
            ValueKind::Reflectance => [0.0, 1.0],
            // The reader's bound is above 0, which no slider can say.
            ValueKind::Ior => [1e-3, 1e3],
        }
    }

    fn accepts(self, value: NewValue) -> bool {
        // None of these comparisons holds for what is not a number.
        match (self, value) {
            (ValueKind::Scale, NewValue::Scale(v)) => (0.0..=BRIGHTEST).contains(&v),
            (ValueKind::Reflectance, NewValue::Rgb(rgb)) => rgb.iter().all(|v| (0.0..=1.0).contains(v)),
            (ValueKind::Ior, NewValue::Number(v)) => crate::scene::bsdf::is_ior(v) && v as f32 > 0.0,
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
    set: fn(&mut SceneDesc, u32, NewValue),
}

/// Everything that can be changed. A new [`Target`] is one line here.
pub(crate) const PARAMETERS: &[EditableParameter] = &[
    EditableParameter {
        name: "emission_scale",
        label: "emission",
        object: ObjectKind::Shape,
        range: ValueKind::Scale,
        target: Target::Emission,
        get: |desc, i| desc.shapes.get(i as usize)?.emission.as_ref().map(|_| NewValue::Scale(1.0)),
        set: |desc, i, v| desc.shapes[i as usize].emission.iter_mut().for_each(|s| scale(s, v)),
    },
    EditableParameter {
        name: "emission_color",
        label: "emission colour",
        object: ObjectKind::Shape,
        range: ValueKind::Reflectance,
        target: Target::EmissionColor,
        get: |desc, i| {
            let shape = desc.shapes.get(i as usize)?;
            shape.emission.as_ref().filter(|_| shape.emission_profile.texture.is_none()).map(hue)
        },
        set: |desc, i, v| desc.shapes[i as usize].emission.iter_mut().for_each(|s| tint(s, v)),
    },
    EditableParameter {
        name: "emission_scale",
        label: "emission",
        object: ObjectKind::Light,
        range: ValueKind::Scale,
        target: Target::Light,
        get: |desc, i| desc.lights.get(i as usize).map(|_| NewValue::Scale(1.0)),
        set: |desc, i, v| scale(desc.lights[i as usize].spectrum_mut(), v),
    },
    EditableParameter {
        name: "emission_color",
        label: "emission colour",
        object: ObjectKind::Light,
        range: ValueKind::Reflectance,
        target: Target::LightColor,
        get: |desc, i| match desc.lights.get(i as usize)? {
            LightDesc::Map { .. } | LightDesc::SunSky(_) => None, // its texels have colours of their own
            LightDesc::Projector(ProjectorDesc { picture: Some(_), .. }) => None,
            light => Some(hue(light.spectrum())),
        },
        set: |desc, i, v| tint(desc.lights[i as usize].spectrum_mut(), v),
    },
    EditableParameter {
        name: "reflectance",
        label: "reflectance",
        object: ObjectKind::Bsdf,
        range: ValueKind::Reflectance,
        target: |i| Target::Reflectance(BsdfId(i)),
        get: reflectance,
        set: set_reflectance,
    },
    EditableParameter {
        name: "int_ior",
        label: "index of refraction",
        object: ObjectKind::Bsdf,
        range: ValueKind::Ior,
        target: |i| Target::IntIor(BsdfId(i)),
        get: int_ior,
        set: set_int_ior,
    },
];

impl Target {
    /// Its line in the table, and the index of its object.
    pub(crate) fn parameter(self) -> (&'static EditableParameter, u32) {
        use Target::{Emission, EmissionColor, IntIor, Light, LightColor, Reflectance};
        let (Emission(index)
        | EmissionColor(index)
        | Light(index)
        | LightColor(index)
        | Reflectance(BsdfId(index))
        | IntIor(BsdfId(index))) = self;
        let found = PARAMETERS.iter().find(|p| (p.target)(index) == self);
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
        let value = match value {
            NewValue::Scale(v) | NewValue::Number(v) => format!("{v:?}"),
            NewValue::Rgb(rgb) => format!("{rgb:?}"),
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

fn scale(spectrum: &mut Spectrum, value: NewValue) {
    if let NewValue::Scale(factor) = value {
        *spectrum = spectrum.scaled(factor as f32);
    }
}

/// The colour of an emission, with 1 for its largest component.
fn hue(spectrum: &Spectrum) -> NewValue {
    let rgb = spectrum.emitted_rgb();
    let most = rgb.into_iter().fold(0.0, f32::max);
    NewValue::Rgb(rgb.map(|v| if most > 0.0 { f64::from((v / most).clamp(0.0, 1.0)) } else { 1.0 }))
}

/// Another colour of the same luminance, through the same smooth spectra as an `rgb` of a file. Black has no colour.
fn tint(spectrum: &mut Spectrum, value: NewValue) {
    let NewValue::Rgb(rgb) = value else { return };
    let tinted = Spectrum::emission_rgb(rgb.map(|v| v as f32));
    let (before, after) = (spectrum.luminance(), tinted.luminance());
    if after > 0.0 {
        *spectrum = tinted.scaled(before / after);
    }
}

fn reflectance(desc: &SceneDesc, index: u32) -> Option<NewValue> {
    let albedo = desc.bsdfs.get(index as usize)?.parts().albedo?.uniform()?;
    Some(NewValue::Rgb(albedo.reflected_rgb().map(|v| f64::from(v).clamp(0.0, 1.0))))
}

/// Through the same smooth spectra as an `rgb` of a file.
fn set_reflectance(desc: &mut SceneDesc, index: u32, value: NewValue) {
    if let (Some(albedo), NewValue::Rgb(rgb)) = (desc.bsdfs[index as usize].parts_mut().albedo, value) {
        *albedo = Spectrum::reflectance_rgb(rgb.map(|v| v as f32)).into();
    }
}

fn int_ior(desc: &SceneDesc, index: u32) -> Option<NewValue> {
    let int_ior = desc.bsdfs.get(index as usize)?.parts().int_ior?;
    Some(NewValue::Number(f64::from(int_ior.eval(Vec4::splat(SODIUM_D)).x)))
}

fn set_int_ior(desc: &mut SceneDesc, index: u32, value: NewValue) {
    if let (Some(int_ior), NewValue::Number(n)) = (desc.bsdfs[index as usize].parts_mut().int_ior, value) {
        *int_ior = Ior::Constant(n as f32);
    }
}
