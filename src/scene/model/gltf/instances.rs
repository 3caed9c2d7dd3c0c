//! `EXT_mesh_gpu_instancing`: a mesh at many places below its node.

use glam::{DAffine3, DQuat, DVec3};
use serde_json::Value;

use super::buffers::Buffers;
use super::json::{extension, index};

/// Bytes of the text of an instance.
const WRITTEN: usize = 400;

/// The places of the mesh of a node, from its space; none if the node has no instances of its own.
pub(super) fn read(node: &Value, buffers: &mut Buffers<'_>) -> Result<Option<Vec<DAffine3>>, String> {
    let attributes = &extension(node, "EXT_mesh_gpu_instancing")["attributes"];
    if attributes.is_null() {
        return Ok(None);
    }
    let translations = column::<3>(attributes, "TRANSLATION", buffers)?;
    let rotations = column::<4>(attributes, "ROTATION", buffers)?;
    let scales = column::<3>(attributes, "SCALE", buffers)?;
    let counts = [
        translations.as_ref().map(Vec::len),
        rotations.as_ref().map(Vec::len),
        scales.as_ref().map(Vec::len),
    ];
    let count = counts.into_iter().flatten().max().unwrap_or(0);
    if counts.into_iter().flatten().any(|n| n != count) {
        return Err(
            "the attributes of an `EXT_mesh_gpu_instancing` have different numbers of elements".to_owned()
        );
    }
    buffers.spend(count.saturating_mul(WRITTEN))?;
    let vector = |all: &Option<Vec<[f32; 3]>>, i: usize, default: DVec3| {
        all.as_ref().map_or(default, |all| DVec3::from(all[i].map(f64::from)))
    };
    let place = |i: usize| {
        let turn = rotations.as_ref().map(|all| DQuat::from_array(all[i].map(f64::from)));
        let turn = turn.filter(|turn| turn.length_squared() > 0.0).map_or(DQuat::IDENTITY, DQuat::normalize);
        DAffine3::from_scale_rotation_translation(
            vector(&scales, i, DVec3::ONE),
            turn,
            vector(&translations, i, DVec3::ZERO),
        )
    };
    Ok(Some((0..count).map(place).collect()))
}

/// The elements of an attribute of instances, if there is one.
fn column<const N: usize>(
    attributes: &Value,
    name: &str,
    buffers: &mut Buffers<'_>,
) -> Result<Option<Vec<[f32; N]>>, String> {
    let Some(index) = index(attributes, name) else { return Ok(None) };
    let accessor = buffers.accessor(index)?;
    buffers.floats(&accessor).map(Some)
}
