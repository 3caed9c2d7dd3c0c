//! Changes by names, as a program makes them that has no panel: the id of an object and the name of a value, `ball.reflectance`.
//!
//! Ids and names of values are those of `<edit>` (`saved.rs`). `sensor.to_world` is the pose of the camera.

use super::Edits;
use super::objects::address;
use super::parameters::parameters;
use super::target::{EditError, NewValue, ObjectKind, Target, ValueKind};
use crate::scene::desc::{CameraDesc, SceneDesc};
use crate::scene::suggest;

/// Name of the pose of the camera.
const CAMERA: &str = "sensor.to_world";

/// The reason why a value cannot be changed by its name.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NamedEditError {
    /// No object of this id has a value of this name.
    #[error("this scene has no value `{name}` to change: {hint}")]
    Unknown {
        /// The given name.
        name: String,
        /// The nearest known name, or all names that there are for few.
        hint: String,
    },
    /// Too few or too many numbers.
    #[error("`{name}` cannot have {count} numbers: {wanted}")]
    Numbers {
        /// The given name.
        name: String,
        /// How many numbers were given.
        count: usize,
        /// The accepted values.
        wanted: &'static str,
    },
    /// The object does not take this value.
    #[error("`{name}`: {error}")]
    Refused {
        /// The given name.
        name: String,
        /// Why.
        error: EditError,
    },
}

/// A value that can be changed by its name.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedValue {
    /// Id of its object and its own name, joined by a dot.
    pub name: String,
    /// Its numbers: one, three of a colour or a point, or the sixteen of a matrix, row by row. A factor is 1.
    pub numbers: Vec<f64>,
}

/// All values that can be changed by name: those of objects with an id, and the pose of the camera.
pub fn named_values(desc: &SceneDesc) -> Vec<NamedValue> {
    let mut all: Vec<NamedValue> = targets(desc)
        .filter_map(|(name, target)| Some(NamedValue { name, numbers: target.get(desc).ok()?.numbers() }))
        .collect();
    let numbers = NewValue::Transform(desc.camera.to_world).numbers();
    all.push(NamedValue { name: CAMERA.to_owned(), numbers });
    all
}

/// The values of all objects with an id, with their names; some of them an object may lack.
fn targets(desc: &SceneDesc) -> impl Iterator<Item = (String, Target)> + '_ {
    ObjectKind::ALL.into_iter().flat_map(move |object| {
        let objects = (0u32..).map_while(move |index| Some((index, address(desc, object, index)?.id)));
        objects.filter_map(|(index, id)| Some((index, id?))).flat_map(move |(index, id)| {
            let of_kind = parameters().filter(move |parameter| parameter.object == object);
            of_kind.map(move |parameter| (format!("{id}.{}", parameter.name), (parameter.target)(index)))
        })
    })
}

impl Edits {
    /// Sets a value of the scene `desc` by its name, one of [`named_values`], in the place of an earlier one.
    ///
    /// # Errors
    ///
    /// [`NamedEditError`] when there is no such value, or it cannot be this; nothing is changed then.
    pub fn set_named(&mut self, desc: &SceneDesc, name: &str, numbers: &[f64]) -> Result<(), NamedEditError> {
        let read = |range: ValueKind| {
            let wrong = || NamedEditError::Numbers {
                name: name.to_owned(),
                count: numbers.len(),
                wanted: range.wanted(),
            };
            range.value(numbers).ok_or_else(wrong)
        };
        let refused = |error| NamedEditError::Refused { name: name.to_owned(), error };
        let found = targets(desc).find(|(known, target)| known == name && target.get(desc).is_ok());
        if let Some((_, target)) = found {
            let value = read(target.parameter().0.range)?;
            return self.set(target, value).map_err(refused);
        }
        if name != CAMERA {
            return Err(unknown(desc, name));
        }
        let value = read(ValueKind::Transform)?;
        // The rules of any transform.
        Target::ToWorld(0).check(value).map_err(refused)?;
        if let NewValue::Transform(to_world) = value {
            self.camera = Some(CameraDesc { to_world, ..desc.camera.clone() });
        }
        Ok(())
    }
}

fn unknown(desc: &SceneDesc, name: &str) -> NamedEditError {
    let values = named_values(desc);
    let names: Vec<&str> = values.iter().map(|value| value.name.as_str()).collect();
    let rest = "the values are those of objects that have an id";
    NamedEditError::Unknown { name: name.to_owned(), hint: suggest::nearest_or(name, names, rest) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::load_str;

    const SCENE: &str = r#"<scene version="3.0.0">
        <sensor type="perspective"/>
        <bsdf type="diffuse" id="paint"><rgb name="reflectance" value="0.5, 0.5, 0.5"/></bsdf>
        <shape type="sphere" id="ball"><ref id="paint"/></shape>
        <emitter type="point" id="lamp"><rgb name="intensity" value="1, 1, 1"/></emitter>
    </scene>"#;

    #[test]
    fn values_are_found_by_id_and_name() {
        let desc = load_str("t.xml", SCENE, &[]).expect("valid").desc;
        let mut edits = Edits::default();
        edits.set_named(&desc, "paint.reflectance", &[0.1, 0.2, 0.3]).expect("a colour");
        edits.set_named(&desc, "lamp.position", &[1.0, 2.0, 3.0]).expect("a point");
        let mut pose = NewValue::Transform(desc.camera.to_world).numbers();
        pose[3] = 7.0;
        edits.set_named(&desc, "sensor.to_world", &pose).expect("a matrix");
        let edited = edits.apply(&desc).expect("they are there");
        let values = named_values(&edited);
        let of = |name: &str| values.iter().find(|v| v.name == name).map(|v| v.numbers.clone());
        assert_eq!(of("lamp.position"), Some(vec![1.0, 2.0, 3.0]));
        assert_eq!(of("sensor.to_world"), Some(pose));
        let color = of("paint.reflectance").expect("a colour");
        assert!(color.iter().zip([0.1, 0.2, 0.3]).all(|(a, b)| (a - b).abs() < 5e-3), "{color:?}");
    }

    #[test]
    fn wrong_names_and_values_are_told() {
        let desc = load_str("t.xml", SCENE, &[]).expect("valid").desc;
        let mut edits = Edits::default();
        let told = |edits: &mut Edits, name: &str, numbers: &[f64]| {
            edits.set_named(&desc, name, numbers).expect_err("refused").to_string()
        };
        let nearest = told(&mut edits, "paint.reflectence", &[0.1; 3]);
        assert!(nearest.contains("paint.reflectance"), "{nearest}");
        assert!(told(&mut edits, "paint.reflectance", &[0.1; 2]).contains("2 numbers"));
        assert!(told(&mut edits, "paint.reflectance", &[2.0; 3]).contains("from 0 to 1"));
        assert!(told(&mut edits, "sensor.to_world", &[0.0; 16]).contains("numbers"));
        assert!(edits.is_empty());
    }
}
