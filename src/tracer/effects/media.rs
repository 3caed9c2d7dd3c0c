//! The effects that participating media call for.

use crate::scene::desc::texture::SpectrumTexture;
use crate::scene::desc::{
    LightDesc, MediumDesc, MediumEmission, MediumId, MediumInterface, PhaseDesc, SceneDesc,
};
use crate::spectrum::Spectrum;

use super::entry::{Entry, never};
use super::used::{Used, by};

pub(super) const MEDIA: Entry = Entry {
    name: "media",
    at_run_time: "whether the prepared scene has media; then the medium that a path is in, once per piece of a segment (Scene::fly)",
    find: |used, _| {
        if used.desc.integrator.surfaces_only && used.desc.names_media() {
            return Err("the integrator of the file knows surfaces only");
        }
        by(used.medium(|_| true), "absorbs and scatters light", "no surface has a medium on either side")
    },
    refusal: never,
    // All media are removed.
    without: |desc| {
        let of_groups = desc.groups.iter_mut().flat_map(|group| &mut group.shapes);
        for shape in desc.shapes.iter_mut().chain(of_groups) {
            shape.medium_interface = MediumInterface::default();
        }
        desc.camera.medium = None;
    },
    // A thin haze, a tenth of a mean free path per unit of rendering space, in which shapes have sizes around 1. It would swallow an environment.
    with: |desc| {
        if desc.has_media() || desc.lights.iter().any(LightDesc::is_environment) {
            return false;
        }
        desc.media.push(MediumDesc {
            sigma_t: Spectrum::Constant(0.1).into(),
            albedo: Spectrum::Constant(0.5).into(),
            scale: desc.space.scale,
            phase: PhaseDesc::Isotropic,
            emission: None,
        });
        desc.camera.medium = Some(MediumId(desc.media.len() as u32 - 1));
        desc.integrator.surfaces_only = false;
        true
    },
};

pub(super) const GRID_MEDIA: Entry = Entry {
    name: "grid-media",
    at_run_time: "the kind of the medium that a path is in, one match per piece of a segment (Walk::fly_through)",
    find: |used, _| {
        by(
            used.medium(|medium| !medium.is_homogeneous()),
            "varies in space",
            "every medium is the same everywhere",
        )
    },
    refusal: never,
    // Each grid is replaced by its mean.
    without: |desc| {
        for medium in &mut desc.media {
            let (sigma_t, albedo) = (medium.sigma_t.mean(), medium.albedo.mean());
            (medium.sigma_t, medium.albedo) = (sigma_t.into(), albedo.into());
            medium.phase.make_uniform();
            medium.emission.iter_mut().for_each(MediumEmission::make_uniform);
        }
    },
    // A grid cannot be added without a place for it.
    with: |_| false,
};

pub(super) const CHROMATIC_MEDIA: Entry = Entry {
    name: "chromatic-media",
    at_run_time: "the extinction at a path's wavelengths, once per piece of a segment (Walk::weigh)",
    find: |used, _| {
        by(
            used.medium(is_chromatic),
            "has an extinction that depends on the wavelength",
            "no medium has an extinction that depends on the wavelength",
        )
    },
    refusal: never,
    without: |desc| {
        for medium in desc.media.iter_mut().filter(|medium| is_chromatic(medium)) {
            medium.sigma_t = medium.sigma_t.grey();
        }
    },
    // More extinction of blue light than of red.
    with: |desc| {
        let Some(index) = Used::of(desc).media().next() else { return false };
        let Some(medium) = desc.media.get_mut(index) else { return false };
        if !matches!(medium.sigma_t, SpectrumTexture::Uniform(_)) || is_chromatic(medium) {
            return false;
        }
        let mean = medium.sigma_t.mean().max();
        medium.sigma_t = Spectrum::unbounded_rgb([0.8, 1.0, 1.2].map(|share| share * mean)).into();
        true
    },
};

pub(super) const EMISSIVE_MEDIA: Entry = Entry {
    name: "emissive-media",
    at_run_time: "whether the medium that a camera path is in emits, once per piece of a segment (Walk::fly_through)",
    find: |used, kind| {
        let shining = used.medium(MediumDesc::shines);
        if shining.is_some() && !kind.traits().finds_emissive_media {
            return Err("the method does not find light that media emit");
        }
        by(shining, "emits light", "no medium emits light")
    },
    refusal: never,
    without: |desc| desc.media.iter_mut().for_each(|medium| medium.emission = None),
    // A dim glow: how bright it is does not change what it costs.
    with: |desc| {
        let Some(index) = Used::of(desc).media().next() else { return false };
        let Some(medium) = desc.media.get_mut(index) else { return false };
        if medium.shines() {
            return false;
        }
        medium.emission = Some(MediumEmission { radiance: Spectrum::d65(1e-2), grid: None });
        true
    },
};

fn is_chromatic(medium: &MediumDesc) -> bool {
    !medium.sigma_t.is_grey()
}

/// True for a medium that depends on the wavelength in any way.
pub(super) fn is_colored(medium: &MediumDesc) -> bool {
    is_chromatic(medium) || !medium.albedo.is_grey()
}

/// Media as dense and as bright as the colours are under D65.
pub(super) fn grey(desc: &mut SceneDesc) {
    for medium in &mut desc.media {
        (medium.sigma_t, medium.albedo) = (medium.sigma_t.grey(), medium.albedo.grey());
        medium.emission.iter_mut().for_each(MediumEmission::make_grey);
    }
}
