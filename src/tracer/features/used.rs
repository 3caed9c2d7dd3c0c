//! The materials and lights that take part in a scene, and what kind each is.

use std::collections::BTreeSet;

use crate::scene::desc::{BsdfDesc, LightDesc, Name, Place, SceneDesc, ShapeKind};
use crate::spectrum::dispersion::Ior;
use crate::spectrum::{Spectrum, White};

/// A description with the materials that its shapes show.
pub(super) struct Used<'a> {
    pub(super) desc: &'a SceneDesc,
    /// Indices of one-sided materials, each once, in the order of the file.
    bsdfs: Vec<usize>,
}

/// An object of the file that calls for a feature.
pub(super) struct Object {
    /// As the file calls it.
    pub(super) name: String,
    pub(super) place: Option<Place>,
    /// So many others call for it too.
    pub(super) others: usize,
}

impl<'a> Used<'a> {
    pub(super) fn of(desc: &'a SceneDesc) -> Self {
        let mut seen = BTreeSet::new();
        let mut open: Vec<usize> = desc.shapes.iter().map(|s| s.bsdf.0 as usize).collect();
        while let Some(i) = open.pop() {
            // Also ends where materials form a circle, which preparing refuses.
            if seen.insert(i)
                && let Some(BsdfDesc::TwoSided { front, back }) = desc.bsdfs.get(i)
            {
                open.extend([front.0 as usize, back.0 as usize]);
            }
        }
        let one_sided = |i: &usize| !matches!(desc.bsdfs.get(*i), None | Some(BsdfDesc::TwoSided { .. }));
        Self { desc, bsdfs: seen.into_iter().filter(one_sided).collect() }
    }

    /// The first material of which `is` holds.
    pub(super) fn material(&self, is: fn(&BsdfDesc) -> bool) -> Option<Object> {
        let mut all = self.bsdfs.iter().filter(|i| is(&self.desc.bsdfs[**i]));
        let first = *all.next()?;
        let plugin = self.desc.bsdfs[first].plugin();
        let (id, place) = match self.desc.names.bsdfs.get(first) {
            Some(Name { id, place }) => (id.as_deref(), known(*place)),
            None => (None, None),
        };
        // A shape that names no material has one all the same.
        let shape =
            || self.desc.shapes.iter().find(|s| s.bsdf.0 as usize == first).and_then(|s| known(s.place));
        let place = place.or_else(shape);
        let name = id.map_or(plugin.to_string(), |id| format!("{plugin} \"{id}\""));
        Some(Object { name, place, others: all.count() })
    }

    /// White and place of everything that emits: shapes, then other lights.
    pub(super) fn emitters(&self) -> impl Iterator<Item = (Option<White>, Option<Place>)> {
        let of_shape = |spectrum: &Spectrum| (!spectrum.is_black()).then(|| White::of(spectrum));
        let shapes = self.desc.shapes.iter().filter_map(|s| Some((s.emission.as_ref()?, s.place)));
        let shapes = shapes.filter_map(move |(s, place)| Some((of_shape(s)?, known(place))));
        let lights = self.desc.lights.iter().filter(|l| !l.spectrum().is_black());
        shapes.chain(lights.map(|l| (white(l), known(l.place()))))
    }

    /// Faces of the shapes that emit: each is a light.
    pub(super) fn faces(&self) -> usize {
        let count = |kind: &ShapeKind| match kind {
            ShapeKind::Mesh(id) => self.desc.meshes.get(id.0 as usize).map_or(0, |mesh| mesh.triangles.len()),
            ShapeKind::Cube => 6,
            _ => 1,
        };
        self.desc.shapes.iter().filter(|s| s.emission.is_some()).map(|s| count(&s.kind)).sum()
    }

    /// The environment.
    pub(super) fn environment(&self) -> Option<&'a LightDesc> {
        self.desc.lights.iter().find(|l| l.is_environment())
    }
}

/// The white of a light that is not a shape, if it has one.
fn white(light: &LightDesc) -> Option<White> {
    match light {
        LightDesc::Map { map, scale, .. } => (map.is_grey() && scale.is_constant()).then_some(White::D65),
        _ => White::of(light.spectrum()),
    }
}

/// A place that exists: line 0 stands nowhere.
pub(super) fn known(place: Place) -> Option<Place> {
    (place.line > 0).then_some(place)
}

pub(super) fn transmits(bsdf: &BsdfDesc) -> bool {
    match bsdf {
        BsdfDesc::Dielectric { specular_transmittance, .. }
        | BsdfDesc::RoughDielectric { specular_transmittance, .. } => !specular_transmittance.is_black(),
        _ => false,
    }
}

pub(super) fn disperses(bsdf: &BsdfDesc) -> bool {
    transmits(bsdf) && indices(bsdf).iter().flatten().any(|ior| ior.is_dispersive())
}

pub(super) fn is_delta(bsdf: &BsdfDesc) -> bool {
    matches!(bsdf, BsdfDesc::Dielectric { .. } | BsdfDesc::Conductor { .. } | BsdfDesc::Plastic { .. })
}

pub(super) fn is_glossy(bsdf: &BsdfDesc) -> bool {
    matches!(
        bsdf,
        BsdfDesc::RoughConductor { .. } | BsdfDesc::RoughDielectric { .. } | BsdfDesc::RoughPlastic { .. }
    )
}

/// True for what may make a caustic.
pub(super) fn focuses(bsdf: &BsdfDesc) -> bool {
    is_delta(bsdf) || is_glossy(bsdf)
}

/// True for what has a diffuse part.
pub(super) fn spreads(bsdf: &BsdfDesc) -> bool {
    matches!(bsdf, BsdfDesc::Diffuse { .. } | BsdfDesc::Plastic { .. } | BsdfDesc::RoughPlastic { .. })
}

/// True for what depends on the wavelength in any way.
pub(super) fn is_colored(bsdf: &BsdfDesc) -> bool {
    let spectra: [Option<&Spectrum>; 3] = match bsdf {
        BsdfDesc::Diffuse { reflectance } => [Some(reflectance), None, None],
        BsdfDesc::Dielectric { specular_reflectance: r, specular_transmittance: t, .. }
        | BsdfDesc::RoughDielectric { specular_reflectance: r, specular_transmittance: t, .. } => {
            [Some(r), Some(t), None]
        }
        BsdfDesc::Conductor { eta, k, specular_reflectance: r }
        | BsdfDesc::RoughConductor { eta, k, specular_reflectance: r, .. } => [Some(eta), Some(k), Some(r)],
        BsdfDesc::Plastic { diffuse_reflectance: d, specular_reflectance: r, .. }
        | BsdfDesc::RoughPlastic { diffuse_reflectance: d, specular_reflectance: r, .. } => {
            [Some(d), Some(r), None]
        }
        BsdfDesc::TwoSided { .. } => [None; 3],
    };
    let colored = spectra.iter().flatten().any(|s| !s.is_constant());
    colored || indices(bsdf).iter().flatten().any(|ior| ior.is_dispersive())
}

/// The indices of refraction that count at all wavelengths. Of a rough coat one number is taken.
fn indices(bsdf: &BsdfDesc) -> [Option<&Ior>; 2] {
    match bsdf {
        BsdfDesc::Dielectric { int_ior, ext_ior, .. }
        | BsdfDesc::RoughDielectric { int_ior, ext_ior, .. }
        | BsdfDesc::Plastic { int_ior, ext_ior, .. } => [Some(int_ior), Some(ext_ior)],
        _ => [None, None],
    }
}
