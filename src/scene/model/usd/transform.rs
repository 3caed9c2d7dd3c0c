//! `UsdGeomXformable`: the transform of a prim by its list of operations.

use glam::{DAffine3, DMat4, DQuat, DVec3};

use super::prim::PrimReader;
use super::values;
use crate::scene::diagnostic::shorten;

/// Operations of one prim; more would be a file that was made to be slow.
const OPERATIONS: usize = 1024;

/// The transform of a prim to its parent, and whether that of the parent does not count.
///
/// `xformOpOrder` lists the operations from the outermost: a point is moved by the last one first.
pub(super) fn local(prim: &PrimReader) -> (DAffine3, bool) {
    let order = prim.value("xformOpOrder").and_then(|value| values::words(&value)).unwrap_or_default();
    let (mut to_parent, mut resets) = (DAffine3::IDENTITY, false);
    if order.len() > OPERATIONS {
        prim.fault("a prim has more than 1024 transforms: it is not moved");
        return (to_parent, resets);
    }
    for operation in &order {
        if operation == "!resetXformStack!" {
            (to_parent, resets) = (DAffine3::IDENTITY, true);
            continue;
        }
        let (name, inverse) = match operation.strip_prefix("!invert!") {
            Some(name) => (name, true),
            None => (operation.as_str(), false),
        };
        let Some(matrix) = matrix(prim, name) else { continue };
        to_parent *= if inverse { matrix.inverse() } else { matrix };
    }
    if !to_parent.is_finite() {
        prim.fault("a transform has no inverse, or is no number: the prim is not moved");
        return (DAffine3::IDENTITY, resets);
    }
    (to_parent, resets)
}

/// The matrix of the operation `name`, `xformOp:kind` with an optional suffix.
fn matrix(prim: &PrimReader, name: &str) -> Option<DAffine3> {
    let kind = name.strip_prefix("xformOp:")?.split(':').next()?;
    let vector = || prim.doubles(name, 3).map(|v| DVec3::new(v[0], v[1], v[2]));
    // A row vector stands before its matrix in USD: rows there are columns here.
    Some(match kind {
        "translate" => DAffine3::from_translation(vector()?),
        "scale" => DAffine3::from_scale(vector()?),
        "translateX" => DAffine3::from_translation(DVec3::X * prim.number(name)?),
        "translateY" => DAffine3::from_translation(DVec3::Y * prim.number(name)?),
        "translateZ" => DAffine3::from_translation(DVec3::Z * prim.number(name)?),
        "scaleX" => DAffine3::from_scale(DVec3::new(prim.number(name)?, 1.0, 1.0)),
        "scaleY" => DAffine3::from_scale(DVec3::new(1.0, prim.number(name)?, 1.0)),
        "scaleZ" => DAffine3::from_scale(DVec3::new(1.0, 1.0, prim.number(name)?)),
        "rotateX" => turn('X', prim.number(name)?),
        "rotateY" => turn('Y', prim.number(name)?),
        "rotateZ" => turn('Z', prim.number(name)?),
        "rotateXYZ" | "rotateXZY" | "rotateYXZ" | "rotateYZX" | "rotateZXY" | "rotateZYX" => {
            let angles = vector()?;
            // The axis that is named first turns first.
            kind.chars().skip("rotate".len()).fold(DAffine3::IDENTITY, |turned, axis| {
                let angle = match axis {
                    'X' => angles.x,
                    'Y' => angles.y,
                    _ => angles.z,
                };
                turn(axis, angle) * turned
            })
        }
        "orient" => {
            let q = prim.doubles(name, 4)?;
            let turn = DQuat::from_xyzw(q[1], q[2], q[3], q[0]);
            DAffine3::from_quat(if turn.length_squared() > 0.0 { turn.normalize() } else { DQuat::IDENTITY })
        }
        "transform" => {
            let numbers = prim.doubles(name, 16)?;
            DAffine3::from_mat4(DMat4::from_cols_array(&numbers.try_into().ok()?))
        }
        _ => {
            prim.fault(format!("the transform `{}` is not known", shorten(name)));
            return None;
        }
    })
}

fn turn(axis: char, degrees: f64) -> DAffine3 {
    let angle = degrees.to_radians();
    match axis {
        'X' => DAffine3::from_rotation_x(angle),
        'Y' => DAffine3::from_rotation_y(angle),
        _ => DAffine3::from_rotation_z(angle),
    }
}
