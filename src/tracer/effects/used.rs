//! The materials and lights that take part in a scene, and what kind each is.

use std::collections::BTreeSet;

use crate::scene::desc::{
    BsdfDesc, EmissionGrid, LightDesc, MediumDesc, Name, Place, ProjectorDesc, SceneDesc, ShapeDesc,
    SpotDesc, SunSkyDesc,
};
use crate::spectrum::{Spectrum, White};

use super::entry::Found;

/// A description with the materials that its shapes show.
pub(super) struct Used<'a> {
    pub(super) desc: &'a SceneDesc,
    /// Indices of one-sided materials, each once, in the order of the file.
    bsdfs: Vec<usize>,
}

/// An object of the file that calls for an effect.
pub(super) struct Object {
    /// As the file calls it.
    pub(super) name: String,
    pub(super) place: Option<Place>,
    /// So many others call for it too.
    pub(super) others: usize,
}

/// Says that `object` calls for an effect and why, or why nothing does.
pub(super) fn by(object: Option<Object>, why: &str, why_not: &'static str) -> Found {
    let Object { name, place, others } = object.ok_or(why_not)?;
    let more = if others > 0 { format!(" ({others} more like it)") } else { String::new() };
    Ok((format!("{name} {why}{more}"), place))
}

impl<'a> Used<'a> {
    pub(super) fn of(desc: &'a SceneDesc) -> Self {
        let mut seen = BTreeSet::new();
        let mut open: Vec<usize> = desc.surfaces().map(|s| s.bsdf.0 as usize).collect();
        while let Some(i) = open.pop() {
            // Also ends where materials form a circle, which preparing refuses.
            if seen.insert(i) {
                open.extend(desc.bsdfs.get(i).iter().flat_map(|bsdf| bsdf.nested()).map(|id| id.0 as usize));
            }
        }
        let one_sided = |i: &usize| !matches!(desc.bsdfs.get(*i), None | Some(BsdfDesc::TwoSided(_)));
        Self { desc, bsdfs: seen.into_iter().filter(one_sided).collect() }
    }

    /// True where a surface shows several materials at once, or one in a frame of its own.
    pub(super) fn mixes(&self) -> bool {
        let mixed = |i: &usize| {
            let bsdf = &self.desc.bsdfs[*i];
            matches!(bsdf, BsdfDesc::Blend(_) | BsdfDesc::Mixture(_))
                || bsdf.bump().is_some()
                || bsdf.coat().is_some()
        };
        self.bsdfs.iter().any(mixed)
    }

    /// True where a surface is diffuse, but not as Lambert's reflector.
    pub(super) fn other_diffuse(&self) -> bool {
        self.bsdfs.iter().any(|i| self.desc.bsdfs[*i].is_other_diffuse())
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
        let shape = || self.desc.surfaces().find(|s| s.bsdf.0 as usize == first).and_then(|s| known(s.place));
        let place = place.or_else(shape);
        let name = id.map_or(plugin.to_string(), |id| format!("{plugin} \"{id}\""));
        Some(Object { name, place, others: all.count() })
    }

    /// Indices of the media that surfaces and the camera name, each once; none where the method knows surfaces only.
    pub(super) fn media(&self) -> impl Iterator<Item = usize> + use<> {
        let taken = !self.desc.integrator.surfaces_only;
        self.desc.used_media().into_iter().filter(move |_| taken)
    }

    /// The first medium of which `is` holds.
    pub(super) fn medium(&self, is: fn(&MediumDesc) -> bool) -> Option<Object> {
        let mut all = self.media().filter(|i| self.desc.media.get(*i).is_some_and(is));
        let first = all.next()?;
        let named = self.desc.names.media.get(first);
        let id = named.and_then(|name| name.id.as_ref());
        let name = id.map_or("a medium".to_string(), |id| format!("medium \"{id}\""));
        Some(Object { name, place: named.and_then(|name| known(name.place)), others: all.count() })
    }

    /// White and place of the media that emit.
    pub(super) fn shining_media(&self) -> impl Iterator<Item = (Option<White>, Option<Place>)> {
        let shining = self.media().filter_map(|i| Some((i, self.desc.media.get(i)?.emission.as_ref()?)));
        shining.filter(|(_, light)| !light.is_black()).map(|(i, light)| {
            let white = match &light.grid {
                Some(EmissionGrid::Colors(grid)) => of_picture(grid.is_grey(), &light.radiance),
                Some(EmissionGrid::Temperatures(_)) => None,
                None => White::of(&light.radiance),
            };
            (white, self.desc.names.media.get(i).and_then(|name| known(name.place)))
        })
    }

    /// White and place of all lights: shapes, then others.
    pub(super) fn emitters(&self) -> impl Iterator<Item = (Option<White>, Option<Place>)> {
        let white_of = |shape: &ShapeDesc, emission| match &shape.emission_profile.texture {
            Some(texture) => of_picture(texture.is_grey(), emission),
            None => White::of(emission),
        };
        let shapes =
            self.shining().map(move |(shape, emission)| (white_of(shape, emission), known(shape.place)));
        let lights = self.desc.lights.iter().filter(|l| !l.is_black());
        shapes.chain(lights.map(|l| (white(l), known(l.place()))))
    }

    /// The shapes that emit something.
    fn shining(&self) -> impl Iterator<Item = (&'a ShapeDesc, &'a Spectrum)> {
        let emitting = self.desc.shapes.iter().filter_map(|shape| Some((shape, shape.emission.as_ref()?)));
        emitting.filter(|(shape, emission)| !emission.is_black() && !shape.emission_profile.is_black())
    }

    /// Faces of the shapes that emit something: each is a light.
    pub(super) fn faces(&self) -> usize {
        self.shining().map(|(shape, _)| self.desc.faces(shape)).sum()
    }

    /// A shape whose light leaves along its normal only.
    pub(super) fn beam(&self) -> Option<Object> {
        let (shape, _) = self.shining().find(|(shape, _)| shape.emission_profile.along_normal)?;
        let name = shape.id.as_ref().map_or("directionalarea".to_string(), |id| format!("shape \"{id}\""));
        Some(Object { name, place: known(shape.place), others: 0 })
    }

    /// The environment, if it shines. Only the first of a scene counts.
    pub(super) fn environment(&self) -> Option<&'a LightDesc> {
        self.desc.lights.iter().find(|l| l.is_environment()).filter(|l| !l.is_black())
    }
}

/// The white of a light that is not a shape, if it has one.
fn white(light: &LightDesc) -> Option<White> {
    match light {
        LightDesc::Map { map, scale, .. } => of_picture(map.is_grey(), scale),
        LightDesc::Projector(ProjectorDesc { picture: Some(picture), irradiance, .. }) => {
            of_picture(picture.is_grey(), irradiance)
        }
        LightDesc::Spot(SpotDesc { texture: Some(t), .. }) if !t.texture.is_grey() => None,
        LightDesc::SunSky(SunSkyDesc { sky, sun, scale, .. }) => {
            let grey = sky.is_grey()
                && scale.is_constant()
                && (sun.is_black() || White::of(sun) == Some(White::D65));
            grey.then_some(White::D65)
        }
        _ => White::of(light.spectrum()),
    }
}

/// The white of a picture of D65, if it is `grey`, times a factor.
fn of_picture(grey: bool, factor: &Spectrum) -> Option<White> {
    (grey && factor.is_constant()).then_some(White::D65)
}

/// A place that exists: line 0 stands nowhere.
pub(super) fn known(place: Place) -> Option<Place> {
    (place.line > 0).then_some(place)
}

/// The first material that shapes show and of which `is` holds, to change.
pub(super) fn shown(desc: &mut SceneDesc, is: fn(&BsdfDesc) -> bool) -> Option<&mut BsdfDesc> {
    let index = Used::of(desc).bsdfs.into_iter().find(|i| is(&desc.bsdfs[*i]))?;
    desc.bsdfs.get_mut(index)
}
