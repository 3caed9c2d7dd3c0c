//! Materials: one list of those without sides, and what each description shows to either side.

use crate::scene::SceneDesc;
use crate::scene::desc::{BlendDesc, BsdfDesc, BsdfId, MOST_PARTS, MaskDesc, ShapeKind, TwoSidedDesc};
use crate::tracer::bsdf::{Material, MaterialPart, MixtureMaterial, Sides};
use crate::tracer::effects::at_sodium;

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

/// The materials without sides, and for every description (by id) which of them it shows.
///
/// The back of a two-sided material is lit as its front would be, so that a two-sided one nested in another
/// counts with its own front. What is mixed is laid out flat: the shares of everything, from either side.
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
    let mut side = |id: u32, behind: bool| {
        let mut layout = Layout { descs, parts: Vec::new(), passes: 0.0, two_sided: false };
        layout.add(BsdfId(id), LayoutRole { share: 1.0, behind }, 0)?;
        let index = match layout.parts.as_slice() {
            &[LayoutPart { id, share: 1.0, turned: false }] => own[id.0 as usize],
            _ => {
                materials.push(Material::Mixture(layout.mixture()));
                None
            }
        };
        Ok((index.unwrap_or(materials.len() as u32 - 1), layout.two_sided))
    };
    let sides = (0..descs.len() as u32)
        .map(|id| match side(id, false)? {
            (front, true) => Ok(Sides::Two { front, back: side(id, true)?.0 }),
            (front, false) => Ok(Sides::Single(front)),
        })
        .collect::<Result<_, _>>()?;
    Ok((materials, sides))
}

/// What one side of a material shows.
struct Layout<'a> {
    descs: &'a [BsdfDesc],
    parts: Vec<LayoutPart>,
    passes: f32,
    /// The other side shows something else.
    two_sided: bool,
}

/// A material in a layout.
struct LayoutPart {
    id: BsdfId,
    share: f32,
    turned: bool,
}

/// The role of a material in a layout.
#[derive(Clone, Copy)]
struct LayoutRole {
    share: f32,
    /// It is seen from behind.
    behind: bool,
}

impl Layout<'_> {
    /// Adds a material and all that it is made of.
    fn add(&mut self, id: BsdfId, role: LayoutRole, depth: usize) -> Result<(), PrepareError> {
        let LayoutRole { share, behind } = role;
        let descs = self.descs;
        if depth > descs.len() {
            return Err(PrepareError::NestedTwoSided { id });
        }
        let mut add = |id: BsdfId, role: LayoutRole| self.add(id, role, depth + 1);
        match descs.get(id.0 as usize) {
            None => return Err(PrepareError::UnknownMaterial { id }),
            Some(BsdfDesc::TwoSided(TwoSidedDesc { front, back })) => {
                add(if behind { *back } else { *front }, LayoutRole { share, behind: false })?;
                self.two_sided = true;
            }
            Some(BsdfDesc::Blend(BlendDesc { weight, bsdfs: [first, second] })) => {
                add(*first, LayoutRole { share: share * (1.0 - weight), behind })?;
                add(*second, LayoutRole { share: share * weight, behind })?;
            }
            Some(BsdfDesc::Mask(MaskDesc { bsdf, opacity, transparency })) => {
                add(*bsdf, LayoutRole { share: share * opacity, behind })?;
                self.passes += share * transparency.mean().max();
            }
            // What has no share is not made, but it may have two sides.
            Some(_) if share > 0.0 => self.parts.push(LayoutPart { id, share, turned: behind }),
            Some(_) => {}
        }
        if self.parts.len() > MOST_PARTS { Err(PrepareError::TooManyParts { id }) } else { Ok(()) }
    }

    fn mixture(&self) -> MixtureMaterial {
        let part = |&LayoutPart { id, share, turned }: &LayoutPart| {
            let mut desc = self.descs[id.0 as usize].clone();
            // Each wavelength goes its own way in one glass, but not in several at once.
            if desc.transmits() {
                let parts = desc.parts_mut();
                [parts.int_ior, parts.ext_ior].into_iter().flatten().for_each(at_sodium);
            }
            Some(MaterialPart { material: Material::new(&desc)?, share, turned })
        };
        MixtureMaterial { parts: self.parts.iter().filter_map(part).collect(), passes: self.passes }
    }
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
