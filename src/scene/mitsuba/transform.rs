//! Reads `transform`: its steps apply in the order of the file.

use glam::{DAffine3, DMat3, DMat4, DVec3, DVec4};

use super::document::{Document, Element};
use super::source::Span;
use super::value;

/// A place and a message.
type Fault = (Span, String);

/// Reads one step.
type TransformStep = fn(&Element) -> Result<DAffine3, Fault>;

/// Every step there is.
const STEPS: &[(&str, TransformStep)] =
    &[("translate", translate), ("scale", scale), ("rotate", rotate), ("lookat", lookat), ("matrix", matrix)];

/// Least determinant over the product of the columns' lengths: a flatter matrix has no useful inverse.
const FLATTEST: f64 = 1e-12;

/// The product of the steps of `element`; last step leftmost. Invertible and finite, also in single precision.
pub(crate) fn parse(document: &Document, element: &Element) -> Result<DAffine3, Fault> {
    let mut product = DAffine3::IDENTITY;
    for &child in &element.children {
        let step = document.element(child);
        let reader = STEPS.iter().find(|(name, _)| *name == step.tag.name);
        let (_, read) = reader.ok_or_else(|| {
            let name = step.tag.name;
            let steps = "translate, scale, rotate, lookat, matrix";
            (step.span, format!("<{name}> is not a step of a transform ({steps})"))
        })?;
        product = read(step)? * product;
    }
    check(&product).map_err(|message| (element.span, message))?;
    Ok(product)
}

/// Refuses matrices that flatten space or leave single precision.
fn check(m: &DAffine3) -> Result<(), String> {
    let lengths = m.matrix3.x_axis.length() * m.matrix3.y_axis.length() * m.matrix3.z_axis.length();
    let flatness = m.matrix3.determinant().abs() / lengths;
    if flatness.is_nan() || flatness < FLATTEST {
        return Err("this transform has no inverse: it flattens space to a plane, a line or a point".into());
    }
    // Not a number fails this comparison, as it should.
    let fits = |m: &DAffine3| m.to_cols_array().iter().all(|v| v.abs() <= f64::from(f32::MAX));
    if !fits(m) || !fits(&m.inverse()) {
        return Err("this transform or its inverse does not fit single precision".into());
    }
    Ok(())
}

/// A point, vector or step's `value`, or its `x`, `y`, `z` with `default` for what is not given
/// (an error where there is no default).
pub(crate) fn components(element: &Element, default: Option<f64>) -> Result<DVec3, Fault> {
    if let Some(a) = element.attribute("value") {
        if let Some(extra) = ["x", "y", "z"].iter().find_map(|n| element.attribute(n)) {
            return Err((extra.span, "either `value` or `x`, `y`, `z`, not both".into()));
        }
        return value::triple(&a.value).map_err(|e| (a.span, e));
    }
    let component = |name| match (element.attribute(name), default) {
        (Some(a), _) => value::number(&a.value).map_err(|e| (a.span, e)),
        (None, Some(d)) => Ok(d),
        (None, None) => Err((element.span, format!("`{name}` is not given"))),
    };
    Ok(DVec3::new(component("x")?, component("y")?, component("z")?))
}

fn attribute<T>(element: &Element, name: &str, parse: fn(&str) -> Result<T, String>) -> Result<T, Fault> {
    parse(element.value(name).unwrap_or_default()).map_err(|e| (element.span_of(name), e))
}

fn translate(element: &Element) -> Result<DAffine3, Fault> {
    Ok(DAffine3::from_translation(components(element, Some(0.0))?))
}

fn scale(element: &Element) -> Result<DAffine3, Fault> {
    Ok(DAffine3::from_scale(components(element, Some(1.0))?))
}

/// Degrees, counter-clockwise seen against the axis.
fn rotate(element: &Element) -> Result<DAffine3, Fault> {
    let axis = components(element, Some(0.0))?;
    let angle = attribute(element, "angle", value::number)?;
    let zero = || (element.span, "the axis of a rotation cannot be zero".to_owned());
    Ok(DAffine3::from_axis_angle(axis.try_normalize().ok_or_else(zero)?, angle.to_radians()))
}

/// The first rotation of a transform whose axis has not the length 1, within what five digits of its numbers leave. Mitsuba 0.6
/// normalises such an axis; Mitsuba 3 puts it into Rodrigues' formula as it is, which shears.
pub(crate) fn axis_of_other_length(document: &Document, element: &Element) -> Option<Span> {
    let steps = element.children.iter().map(|&child| document.element(child));
    let is_other =
        |step: &Element| components(step, Some(0.0)).is_ok_and(|axis| (axis.length() - 1.0).abs() > 1e-4);
    steps.filter(|step| step.tag.name == "rotate").find(|step| is_other(step)).map(|step| step.span)
}

/// +z to the target, +y up, +x to the left (right-handed), as Mitsuba.
fn lookat(element: &Element) -> Result<DAffine3, Fault> {
    let origin = attribute(element, "origin", value::triple)?;
    let target = attribute(element, "target", value::triple)?;
    let up = match element.attribute("up") {
        Some(_) => attribute(element, "up", value::triple)?,
        None => DVec3::ZERO,
    };
    let same = || (element.span, "`origin` and `target` are the same point".to_owned());
    let forward = (target - origin).try_normalize().ok_or_else(same)?;
    // Any perpendicular will do when nothing says where up is.
    let up = if up == DVec3::ZERO { forward.any_orthonormal_pair().0 } else { up };
    let parallel = || (element.span_of("up"), "`up` points along the view".to_owned());
    let left = up.normalize().cross(forward);
    let left = if left.length() > 1e-9 { left.normalize() } else { return Err(parallel()) };
    let basis = DMat3::from_cols(left, forward.cross(left), forward);
    Ok(DAffine3 { matrix3: basis, translation: origin })
}

/// Nine or sixteen numbers, row by row.
fn matrix(element: &Element) -> Result<DAffine3, Fault> {
    let values = attribute(element, "value", value::numbers)?;
    let fault = |message: String| (element.span_of("value"), message);
    if let Ok(rows) = <[f64; 9]>::try_from(values.as_slice()) {
        return Ok(DAffine3 { matrix3: DMat3::from_cols_array(&rows).transpose(), translation: DVec3::ZERO });
    }
    let rows = <[f64; 16]>::try_from(values.as_slice())
        .map_err(|_| fault(format!("a matrix has 9 or 16 numbers, not {}", values.len())))?;
    let m = DMat4::from_cols_array(&rows).transpose();
    if m.row(3) != DVec4::W {
        return Err(fault("the last row of a matrix must be 0 0 0 1".into()));
    }
    Ok(DAffine3::from_mat4(m))
}
