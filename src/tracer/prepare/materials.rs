//! Materials: one list of one-sided ones, and what each description shows to either side.

use crate::scene::SceneDesc;
use crate::scene::desc::{BsdfDesc, BsdfId, ShapeKind, TwoSidedDesc};
use crate::tracer::bsdf::{Material, Sides};

use super::PrepareError;

/// The one-sided materials of a scene, and which of them each of its shapes shows, those in groups after the others.
pub(super) fn of(desc: &SceneDesc) -> Result<(Vec<Material>, Vec<Sides>), PrepareError> {
    let (materials, sides) = prepare(&desc.bsdfs)?;
    let sides_of = |id: BsdfId| sides.get(id.0 as usize).copied().ok_or(PrepareError::UnknownMaterial { id });
    let of_groups = desc.groups.iter().flat_map(|group| &group.shapes);
    let surfaces = desc.shapes.iter().chain(of_groups).map(|shape| match shape.kind {
        // Never asked for: what is met has the surface of a shape in the group.
        ShapeKind::Instance(_) => Ok(Sides::Single(0)),
        _ => sides_of(shape.bsdf),
    });
    let surfaces = surfaces.collect::<Result<_, _>>()?;
    Ok((materials, surfaces))
}

/// The one-sided materials, and for every description (by id) which of them it shows.
///
/// The back of a two-sided material is lit as its front would be, so that a two-sided one nested in another
/// counts with its own front.
fn prepare(descs: &[BsdfDesc]) -> Result<(Vec<Material>, Vec<Sides>), PrepareError> {
    let mut materials = Vec::new();
    let own: Vec<Option<u32>> = descs
        .iter()
        .map(|desc| {
            Material::new(desc).map(|material| {
                materials.push(material);
                materials.len() as u32 - 1
            })
        })
        .collect();
    let front_of = |mut id: BsdfId| {
        for _ in 0..=descs.len() {
            match descs.get(id.0 as usize) {
                None => return Err(PrepareError::UnknownMaterial { id }),
                Some(BsdfDesc::TwoSided(TwoSidedDesc { front, .. })) => id = *front,
                Some(_) => return own[id.0 as usize].ok_or(PrepareError::UnknownMaterial { id }),
            }
        }
        Err(PrepareError::NestedTwoSided { id })
    };
    let sides = descs
        .iter()
        .enumerate()
        .map(|(i, desc)| match desc {
            BsdfDesc::TwoSided(TwoSidedDesc { front, back }) => {
                Ok(Sides::Two { front: front_of(*front)?, back: front_of(*back)? })
            }
            _ => front_of(BsdfId(i as u32)).map(Sides::Single),
        })
        .collect::<Result<_, _>>()?;
    Ok((materials, sides))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two(front: u32, back: u32) -> BsdfDesc {
        BsdfDesc::TwoSided(TwoSidedDesc { front: BsdfId(front), back: BsdfId(back) })
    }

    #[test]
    fn nested_and_circular_pairs() {
        let diffuse = || BsdfDesc::grey(0.5);
        let (materials, sides) = prepare(&[two(2, 1), diffuse(), two(3, 1), diffuse()]).expect("valid");
        assert_eq!(materials.len(), 2);
        assert_eq!(sides[0], Sides::Two { front: 1, back: 0 });
        assert_eq!(sides[1], Sides::Single(0));
        assert!(matches!(prepare(&[two(0, 0)]), Err(PrepareError::NestedTwoSided { .. })));
        assert!(matches!(prepare(&[two(7, 0)]), Err(PrepareError::UnknownMaterial { .. })));
    }
}
