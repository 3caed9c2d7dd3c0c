//! Materials: one list of those without sides, and what each description shows to either side.

use glam::Vec3;

use crate::scene::SceneDesc;
use crate::scene::desc::{
    BlendDesc, BsdfDesc, BsdfId, BumpDesc, CoatDesc, MOST_PARTS, MaskDesc, ShapeKind, TwoSidedDesc,
};
use crate::spectrum::Spectrum;
use crate::tracer::bsdf::{
    BumpMaterial, CoatingMaterial, Material, MaterialPart, Mirrors, MixtureMaterial, PartCoat, Sides,
    SurfaceShare,
};
use crate::tracer::effects::at_sodium;
use crate::tracer::opacity::Opacity;

use super::error::PrepareError;

/// The materials of a scene, and which of them each surface has.
pub(super) struct SceneMaterials {
    /// One-sided materials.
    pub(super) materials: Vec<Material>,
    /// Which of them each shape shows, those in groups after the others.
    pub(super) surfaces: Vec<Sides>,
    /// How much of each surface is there; `None` where all of every surface is.
    pub(super) opacities: Option<Box<[Opacity]>>,
}

/// The materials of a scene. What takes long to make is taken over from those of the scene before.
pub(super) fn of(desc: &SceneDesc, before: &[Material]) -> Result<SceneMaterials, PrepareError> {
    let (materials, looks) = prepare(&desc.bsdfs, before)?;
    let nothing = Look { sides: Sides::Single(0), opacity: Opacity::FULL };
    let look_of = |id: BsdfId| looks.get(id.0 as usize).ok_or(PrepareError::UnknownMaterial { id });
    let of_groups = desc.groups.iter().flat_map(|group| &group.shapes);
    let shown = desc.shapes.iter().chain(of_groups).map(|shape| match shape.kind {
        // Never asked for: what is met has the surface of a shape in the group.
        ShapeKind::Instance(_) => Ok(&nothing),
        _ => look_of(shape.bsdf),
    });
    let shown = shown.collect::<Result<Vec<_>, _>>()?;
    let has_holes = shown.iter().any(|look| look.opacity.has_holes());
    let opacities = has_holes.then(|| shown.iter().map(|look| look.opacity.clone()).collect());
    Ok(SceneMaterials { materials, surfaces: shown.iter().map(|look| look.sides).collect(), opacities })
}

/// The material of a description; `None` for one that is made of others. The tables of a rough coat are those of a material before that has
/// the same coat.
fn material(desc: &BsdfDesc, before: &[Material]) -> Option<Material> {
    let same_coat = |known: &Material| match (desc, known) {
        (BsdfDesc::RoughPlastic(desc), Material::RoughPlastic(known)) => known.with_same_coat(desc),
        _ => None,
    };
    let parts = before.iter().flat_map(|known| match known {
        Material::Mixture(mixture) => mixture.parts.as_slice(),
        _ => &[],
    });
    let known = before.iter().chain(parts.map(|part| &part.material)).find_map(same_coat);
    known.map(Material::RoughPlastic).or_else(|| Material::new(desc))
}

/// The materials of both sides of a description, and its opacity.
struct Look {
    sides: Sides,
    opacity: Opacity,
}

/// The materials without sides, and for every description (by id) which of them it shows.
///
/// The back of a two-sided material is lit as its front would be, so that a two-sided one nested in another
/// counts with its own front. What is mixed is laid out flat: the shares of everything, from either side. Both sides have the same holes.
fn prepare(descs: &[BsdfDesc], before: &[Material]) -> Result<(Vec<Material>, Vec<Look>), PrepareError> {
    let mut materials = Vec::new();
    let own: Vec<Option<u32>> = descs
        .iter()
        .map(|desc| {
            material(desc, before).map(|material| {
                materials.push(material);
                materials.len() as u32 - 1
            })
        })
        .collect();
    let mut side = |id: u32, behind: bool| {
        let (parts, has_holes, two_sided) = Default::default();
        let mut layout = Layout { descs, before, of_back: behind, parts, has_holes, two_sided };
        layout.add(BsdfId(id), LayoutRole { share: SurfaceShare::ALL, behind, bump: None, coat: None }, 0)?;
        let index = match layout.parts.as_slice() {
            [LayoutPart { id, turned: false, bump: None, coat: None, .. }] => own[id.0 as usize],
            // All of it is passed.
            [] => {
                materials.extend(Material::new(&BsdfDesc::grey(0.0)));
                None
            }
            _ => {
                materials.push(Material::Mixture(layout.mixture()));
                None
            }
        };
        Ok((index.unwrap_or(materials.len() as u32 - 1), layout))
    };
    let looks = (0..descs.len() as u32)
        .map(|id| {
            let (front, layout) = side(id, false)?;
            let sides = match layout.two_sided {
                true => Sides::Two { front, back: side(id, true)?.0 },
                false => Sides::Single(front),
            };
            Ok(Look { sides, opacity: layout.opacity() })
        })
        .collect::<Result<_, _>>()?;
    Ok((materials, looks))
}

/// Collects the materials of one side of a description, with their shares.
struct Layout<'a> {
    descs: &'a [BsdfDesc],
    /// The materials of the scene before.
    before: &'a [Material],
    /// The side is the back.
    of_back: bool,
    parts: Vec<LayoutPart>,
    /// The shares of the parts add up to less than 1.
    has_holes: bool,
    /// The other side shows something else.
    two_sided: bool,
}

/// A material in a layout.
struct LayoutPart {
    id: BsdfId,
    share: SurfaceShare,
    turned: bool,
    bump: Option<LayoutBump>,
    /// The coat over it, and whether the map is over the coat.
    coat: Option<PartCoat<BsdfId>>,
}

/// A map of normals or heights over a material in a layout.
#[derive(Clone, Copy)]
struct LayoutBump {
    id: BsdfId,
    /// It is seen from behind.
    behind: bool,
}

/// The role of a material in a layout.
struct LayoutRole {
    share: SurfaceShare,
    /// It is seen from behind.
    behind: bool,
    /// The map that tilts it.
    bump: Option<LayoutBump>,
    /// The coat over it, and whether the map is over the coat.
    coat: Option<PartCoat<BsdfId>>,
}

impl Layout<'_> {
    /// Adds a material and all that it is made of.
    fn add(&mut self, id: BsdfId, role: LayoutRole, depth: usize) -> Result<(), PrepareError> {
        let LayoutRole { share, behind, bump, coat } = role;
        let descs = self.descs;
        if depth > descs.len() {
            return Err(PrepareError::NestedTwoSided { id });
        }
        let mut add = |id: BsdfId, role: LayoutRole| self.add(id, role, depth + 1);
        match descs.get(id.0 as usize) {
            None => return Err(PrepareError::UnknownMaterial { id }),
            Some(BsdfDesc::TwoSided(TwoSidedDesc { front, back })) => {
                add(if behind { *back } else { *front }, LayoutRole { share, behind: false, bump, coat })?;
                self.two_sided = true;
            }
            Some(BsdfDesc::Blend(BlendDesc { weight, bsdfs: [first, second] })) => {
                add(*first, LayoutRole { share: share.rest_of(weight), ..role })?;
                add(*second, LayoutRole { share: share.of(weight), ..role })?;
            }
            Some(BsdfDesc::Mixture(mixture)) => {
                for (bsdf, part) in mixture.shares() {
                    let share = share.of(&Spectrum::Constant(part).into());
                    add(bsdf, LayoutRole { share, ..role })?;
                }
            }
            Some(BsdfDesc::Mask(MaskDesc { bsdf, opacity })) => {
                add(*bsdf, LayoutRole { share: share.of(opacity), ..role })?;
                self.has_holes |= descs[id.0 as usize].has_holes() && !share.is_none();
            }
            Some(BsdfDesc::Null(_)) => self.has_holes |= !share.is_none(),
            Some(map) if let Some(BumpDesc { bsdf, .. }) = map.bump() => {
                // Of several maps within each other, which no file has, the innermost counts.
                add(*bsdf, LayoutRole { share, behind, bump: Some(LayoutBump { id, behind }), coat })?;
            }
            // Of several coats over each other, which no file has, the innermost counts.
            Some(over) if let Some(CoatDesc { bsdf, .. }) = over.coat() => {
                let coat = Some(PartCoat { coat: id, tilted: bump.is_some() });
                add(bsdf, LayoutRole { share, behind, bump, coat })?;
            }
            // A material without a share is left out.
            Some(_) if !share.is_none() => {
                self.parts.push(LayoutPart { id, share, turned: behind, bump, coat });
            }
            Some(_) => {}
        }
        if self.parts.len() > MOST_PARTS { Err(PrepareError::TooManyParts { id }) } else { Ok(()) }
    }

    fn opacity(&self) -> Opacity {
        if !self.has_holes {
            return Opacity::FULL;
        }
        Opacity::sum_of(self.parts.iter().map(|part| part.share.clone()).collect())
    }

    fn mixture(&self) -> MixtureMaterial {
        let part = |LayoutPart { id, share, turned, bump, coat }: &LayoutPart| {
            let mut desc = self.descs[id.0 as usize].clone();
            // Each wavelength goes its own way in one glass, but not in several at once.
            if desc.transmits() {
                let parts = desc.parts_mut();
                [parts.int_ior, parts.ext_ior].into_iter().flatten().for_each(at_sodium);
            }
            let (share, turned) = (share.clone(), *turned);
            let bump = bump.and_then(|bump| self.bump(bump, turned));
            let coat = coat.and_then(|coat| self.coat(coat));
            Some(MaterialPart { material: material(&desc, self.before)?, share, turned, bump, coat })
        };
        MixtureMaterial { parts: self.parts.iter().filter_map(part).collect(), has_holes: self.has_holes }
    }

    /// A coat, with the table of a scene before.
    fn coat(&self, PartCoat { coat, tilted }: PartCoat<BsdfId>) -> Option<PartCoat<CoatingMaterial>> {
        let mixtures = self.before.iter().filter_map(|known| match known {
            Material::Mixture(mixture) => Some(mixture),
            _ => None,
        });
        let known =
            mixtures.flat_map(|mixture| &mixture.parts).filter_map(|part| part.coat.as_ref()?.coat.rough());
        let desc = self.descs[coat.0 as usize].coat()?;
        Some(PartCoat { coat: CoatingMaterial::new(&desc, known), tilted })
    }

    /// A map over a material that is seen from behind if `turned`. The frame of a back is that of the front turned by 180° about its s
    /// axis; the map of a back is that of the front, or its mirror image where `twosided` stands around it.
    fn bump(&self, LayoutBump { id, behind }: LayoutBump, turned: bool) -> Option<BumpMaterial> {
        let before = match (self.of_back, behind) {
            (false, _) => Vec3::ONE,
            (true, true) => Vec3::new(1.0, -1.0, -1.0),
            (true, false) => Vec3::new(1.0, -1.0, 1.0),
        };
        let after = if behind && !turned { Vec3::new(1.0, 1.0, -1.0) } else { Vec3::ONE };
        BumpMaterial::new(&self.descs[id.0 as usize], Mirrors { before, after })
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
        let (materials, looks) = prepare(&[two(2, 1), diffuse(), two(3, 1), diffuse()], &[]).expect("valid");
        assert_eq!(materials.len(), 2);
        assert_eq!(looks[0].sides, Sides::Two { front: 1, back: 0 });
        assert_eq!(looks[1].sides, Sides::Single(0));
        assert!(matches!(prepare(&[two(0, 0)], &[]), Err(PrepareError::NestedTwoSided { .. })));
        assert!(matches!(prepare(&[two(7, 0)], &[]), Err(PrepareError::UnknownMaterial { .. })));
    }
}
