//! The effects that materials and meshes call for.

use std::sync::Arc;

use glam::Vec4;

use crate::color::srgb;
use crate::math::random::Random;
use crate::scene::desc::texture::{BitmapTexture, SpectrumTexture};
use crate::scene::desc::{
    BsdfDesc, BsdfId, BumpDesc, CoatDesc, DielectricDesc, DiffuseDesc, Facets, LightDesc, MaskDesc, Mesh,
    Name, NormalMapDesc, PlasticDesc, ProjectorDesc, RoughPlasticDesc, Roughness, SceneDesc, ShapeDesc,
    ShapeKind, SpotDesc, SpotTextureDesc,
};
use crate::spectrum::dispersion::{Ior, SODIUM_D};
use crate::spectrum::{LAMBDA_MAX, LAMBDA_MIN, Spectrum, White};
use crate::tracer::wavelength_mis;

use super::entry::{Entry, Reason, never};
use super::media;
use super::used::{Object, Used, by, known, shown};

/// Without it all that is seen has one white, and every path carries its wavelengths.
pub(super) const WAVELENGTHS: Entry = Entry {
    name: "wavelengths",
    at_run_time: "whether the prepared scene has a white, once per path (RenderContext::wavelengths)",
    find: |used, _| match colors(used) {
        Ok(found) => Ok(found),
        Err(_) if used.desc.integrator.spectral => Ok(("forced on: nothing has a colour".to_string(), None)),
        Err(Some(_)) => Err("every surface is grey, and all lights have one white"),
        Err(None) => Err("nothing emits"),
    },
    refusal: never,
    without: grey,
    with: |desc| {
        desc.integrator.spectral = true;
        true
    },
};

pub(super) const DISPERSION: Entry = Entry {
    name: "dispersion",
    at_run_time: "the indices at a path's wavelengths, where it meets glass (Bsdf::is_dispersive)",
    find: |used, _| {
        by(
            used.material(disperses),
            "has an index that depends on the wavelength",
            "no transparent material has an index that depends on the wavelength",
        )
    },
    refusal: never,
    without: |desc| {
        for bsdf in desc.bsdfs.iter_mut().filter(|bsdf| disperses(bsdf)) {
            let parts = bsdf.parts_mut();
            [parts.int_ior, parts.ext_ior].into_iter().flatten().for_each(at_sodium);
        }
    },
    with: |desc| {
        let inside = shown(desc, BsdfDesc::transmits).and_then(|bsdf| bsdf.parts_mut().int_ior);
        inside.map(|index| *index = crown(index)).is_some()
    },
};

pub(super) const TRANSMISSION: Entry = Entry {
    name: "transmission",
    at_run_time: "the material that is met, one match per vertex (Bsdf::sample)",
    find: |used, _| {
        by(used.material(BsdfDesc::transmits), "lets light through", "nothing lets light through")
    },
    refusal: never,
    // Glass that reflects and lets nothing through.
    without: |desc| {
        let factors = desc.bsdfs.iter_mut().filter_map(|bsdf| bsdf.parts_mut().transmission);
        factors.for_each(|factor| *factor = Spectrum::Constant(0.0).into());
    },
    // Clear glass in place of something that mirrors.
    with: |desc| {
        let glass = DielectricDesc {
            int_ior: Ior::Constant(1.5),
            ext_ior: Ior::Constant(1.0),
            specular_reflectance: Spectrum::Constant(1.0).into(),
            specular_transmittance: Spectrum::Constant(1.0).into(),
        };
        shown(desc, BsdfDesc::is_specular).map(|bsdf| *bsdf = glass.into()).is_some()
    },
};

pub(super) const DELTAS: Entry = Entry {
    name: "deltas",
    at_run_time: "the material that is met, one match per vertex (Bsdf::sample)",
    find: |used, _| {
        by(
            used.material(BsdfDesc::is_delta),
            "has a single direction of reflection or refraction",
            "every surface spreads light",
        )
    },
    refusal: never,
    // Black mirrors and clear glass; smooth coats without shine.
    without: |desc| strip(desc, BsdfDesc::is_delta),
    with: |desc| add_coat(desc, None),
};

pub(super) const GLOSSY: Entry = Entry {
    name: "glossy",
    at_run_time: "the material that is met, one match per vertex (Bsdf::sample, Bsdf::eval)",
    find: |used, _| {
        by(used.material(BsdfDesc::is_glossy), "is rough", "nothing is between a mirror and matt")
    },
    refusal: never,
    // Black rough metal and glass; rough coats without shine.
    without: |desc| strip(desc, BsdfDesc::is_glossy),
    with: |desc| add_coat(desc, Some(Roughness { facets: Facets::Ggx, alpha: [0.1; 2] })),
};

pub(super) const SMOOTH_NORMALS: Entry = Entry {
    name: "smooth-normals",
    at_run_time: "whether the triangle that is met has normals (Primitives::interaction)",
    find: |used, _| {
        let mut all = used.desc.surfaces().filter(|shape| has_normals(used.desc, shape));
        let first = all.next().map(|shape| {
            let name = shape.id.as_ref().map_or("mesh".to_string(), |id| format!("mesh \"{id}\""));
            Object { name, place: known(shape.place), others: all.count() }
        });
        by(first, "has a normal at every corner", "every surface is as it is: flat, or a quadric")
    },
    refusal: never,
    // Facets.
    without: |desc| {
        for mesh in desc.meshes.iter_mut().filter(|mesh| !mesh.normals.is_empty()) {
            *mesh = Arc::new(Mesh { normals: Vec::new(), ..Mesh::clone(mesh) });
        }
    },
    // Where to put a normal is the mesh's to say.
    with: |_| false,
};

pub(super) const OPACITY: Entry = Entry {
    name: "opacity",
    at_run_time: "whether the prepared scene has opacities, once per ray (Scene::closest); then that of the surface that is met",
    find: |used, _| {
        by(used.material(BsdfDesc::has_holes), "lets rays pass straight", "every surface is all there")
    },
    refusal: never,
    // Masks without holes, and black where there was nothing.
    without: |desc| {
        for bsdf in desc.bsdfs.iter_mut().filter(|bsdf| bsdf.has_holes()) {
            match bsdf {
                BsdfDesc::Mask(mask) => mask.opacity = Spectrum::Constant(1.0).into(),
                other => *other = BsdfDesc::grey(0.0),
            }
        }
    },
    // A tenth of something matt is taken away.
    with: |desc| wrap(desc, |bsdf| MaskDesc { bsdf, opacity: Spectrum::Constant(0.9).into() }.into()),
};

pub(super) const TEXTURES: Entry = Entry {
    name: "textures",
    at_run_time: "whether the scene has texture coordinates (SurfaceVertex::new), and whether the material that is met has a picture (SpectrumTexture::sample)",
    find: |used, _| {
        by(used.material(BsdfDesc::is_textured), "has a texture", "every surface has one colour all over")
    },
    refusal: never,
    // Their mean colours.
    without: |desc| {
        desc.bsdfs.iter_mut().filter(|bsdf| bsdf.is_textured()).for_each(BsdfDesc::flatten);
    },
    // A picture on something matt: noise of half to one and a half times its colour; grey, where nothing has a colour.
    with: |desc| {
        let colored = colors(&Used::of(desc)).is_ok();
        let is_even = |bsdf: &BsdfDesc| matches!(bsdf, BsdfDesc::Diffuse(matt) if !matt.reflectance.varies());
        let Some(BsdfDesc::Diffuse(matt)) = shown(desc, is_even) else { return false };
        let color = matt.reflectance.mean().reflected_rgb();
        let texel = |random: &mut Random| {
            let factors = if colored { [0; 3].map(|_| random.f32()) } else { [random.f32(); 3] };
            std::array::from_fn(|i| srgb::encode_8bit(color[i] * (0.5 + factors[i])))
        };
        matt.reflectance = SpectrumTexture::Bitmap(noise(texel, false));
        true
    },
};

pub(super) const BUMP: Entry = Entry {
    name: "bump",
    at_run_time: "whether the part of the material that is met has a map, one test per part (Mixture::eval, Mixture::sample)",
    find: |used, _| {
        by(
            used.material(|bsdf| bsdf.bump().is_some()),
            "tilts normals",
            "no surface has a map of normals or heights",
        )
    },
    refusal: never,
    // Surfaces as they are.
    without: |desc| {
        for i in 0..desc.bsdfs.len() {
            // The material within may have come from a map itself; a circle of maps stays, and preparing refuses it.
            for _ in 0..desc.bsdfs.len() {
                let Some(bump) = desc.bsdfs[i].bump() else { break };
                let Some(inner) = desc.bsdfs.get(bump.bsdf.0 as usize) else { break };
                desc.bsdfs[i] = inner.clone();
            }
        }
    },
    // Something matt with normals tilted by up to a fifth along each axis.
    with: |desc| {
        let tilted =
            |random: &mut Random| [102 + random.below(52), 102 + random.below(52), 255].map(|v| v as u8);
        let rest = |bsdf| BumpDesc { bsdf, flip_invalid_normals: true, use_shadowing_function: true };
        wrap(desc, |bsdf| NormalMapDesc { normals: noise(tilted, true), bump: rest(bsdf) }.into())
    },
};

/// Puts a diffuse material that shapes show into what `around` makes of it; false where there is none.
fn wrap(desc: &mut SceneDesc, around: impl FnOnce(BsdfId) -> BsdfDesc) -> bool {
    let id = BsdfId(desc.bsdfs.len() as u32);
    let Some(bsdf) = shown(desc, |bsdf| matches!(bsdf, BsdfDesc::Diffuse(_))) else { return false };
    let inner = std::mem::replace(bsdf, around(id));
    desc.bsdfs.push(inner);
    desc.names.bsdfs.push(Name::default());
    true
}

/// A picture of independent texels, as large as those of small scenes.
fn noise(texel: impl Fn(&mut Random) -> [u8; 3], raw: bool) -> BitmapTexture {
    const SIDE: usize = 256;
    let mut random = Random(1);
    BitmapTexture::of_eight_bits(SIDE, (0..SIDE * SIDE).map(|_| texel(&mut random)).collect(), raw)
}

fn has_normals(desc: &SceneDesc, shape: &ShapeDesc) -> bool {
    matches!(&shape.kind, ShapeKind::Mesh(id) if desc.meshes.get(id.0 as usize).is_some_and(|m| !m.normals.is_empty()))
}

/// Whatever makes values differ from wavelength to wavelength: a surface, an index, the light. Else the white of all light, if
/// there is any.
pub(super) fn colors(used: &Used) -> Result<Reason, Option<White>> {
    if let Ok(found) = by(used.material(is_colored), "depends on the wavelength", "") {
        return Ok(found);
    }
    if let Ok(found) = by(used.medium(media::is_colored), "depends on the wavelength", "") {
        return Ok(found);
    }
    let mut shining = used.emitters().chain(used.shining_media());
    let Some((first, place)) = shining.next() else { return Err(None) };
    if first.is_none() {
        return Ok(("a light is neither D65 nor equal at all wavelengths".to_string(), place));
    }
    match shining.find(|(white, _)| *white != first) {
        Some((_, place)) => Ok(("lights differ in colour".to_string(), place)),
        None => Err(first),
    }
}

/// Greys as light as the colours are under D65, lights of their luminance, indices at the sodium line.
fn grey(desc: &mut SceneDesc) {
    desc.integrator.spectral = false;
    if colors(&Used::of(desc)).is_err() {
        return;
    }
    for bsdf in &mut desc.bsdfs {
        bsdf.set_number("thin_film_weight", 0.0);
        let parts = bsdf.parts_mut();
        [parts.int_ior, parts.ext_ior].into_iter().flatten().for_each(at_sodium);
        for texture in
            [parts.albedo, parts.reflection, parts.transmission, parts.absorption].into_iter().flatten()
        {
            *texture = texture.grey();
        }
        for index in [parts.eta, parts.k].into_iter().flatten() {
            *index = Spectrum::Constant(index.eval(Vec4::splat(SODIUM_D)).x);
        }
    }
    media::grey(desc);
    for shape in &mut desc.shapes {
        match &mut shape.emission_profile.texture {
            Some(texture) => *texture = Arc::new(texture.grey()),
            None => shape.emission.iter_mut().for_each(emitted),
        }
    }
    for light in &mut desc.lights {
        match light {
            LightDesc::Map { map, .. } => *map = Arc::new(map.grey()),
            LightDesc::SunSky(light) => {
                light.sky = Arc::new(light.sky.grey());
                emitted(&mut light.sun);
            }
            LightDesc::Projector(ProjectorDesc { picture: Some(picture), .. }) => {
                *picture = Arc::new(picture.grey());
            }
            LightDesc::Spot(SpotDesc { texture, intensity, .. }) => {
                if let Some(spot) = texture {
                    let SpotTextureDesc { texture, to_world } = &**spot;
                    *spot = Arc::new(SpotTextureDesc { texture: texture.grey(), to_world: *to_world });
                }
                emitted(intensity);
            }
            _ => emitted(light.spectrum_mut()),
        }
    }
}

/// D65 of the same luminance.
fn emitted(spectrum: &mut Spectrum) {
    *spectrum = Spectrum::d65(spectrum.luminance());
}

/// The index at the sodium line, for all wavelengths.
pub(in crate::tracer) fn at_sodium(ior: &mut Ior) {
    *ior = Ior::Constant(ior.eval(Vec4::splat(SODIUM_D)).x);
}

/// As heavy at the sodium line, and dispersive as a crown glass is (b of N-BK7 by Cauchy's law).
fn crown(ior: &Ior) -> Ior {
    let b = 0.0042;
    Ior::Cauchy { a: ior.eval(Vec4::splat(SODIUM_D)).x - b / (SODIUM_D * 1e-3).powi(2), b }
}

/// Replaces every material of which `is` holds by its diffuse part, and a coat by what is under it; one without either becomes black.
fn strip(desc: &mut SceneDesc, is: fn(&BsdfDesc) -> bool) {
    for i in 0..desc.bsdfs.len() {
        // Ends where coats form a circle, which preparing refuses.
        for _ in 0..desc.bsdfs.len() {
            let Some(CoatDesc { bsdf, .. }) = desc.bsdfs[i].coat().filter(|_| is(&desc.bsdfs[i])) else {
                break;
            };
            let Some(inner) = desc.bsdfs.get(bsdf.0 as usize) else { break };
            desc.bsdfs[i] = inner.clone();
        }
    }
    for bsdf in desc.bsdfs.iter_mut().filter(|bsdf| is(bsdf)) {
        let reflectance = bsdf.parts().albedo.cloned().unwrap_or(Spectrum::Constant(0.0).into());
        *bsdf = DiffuseDesc { reflectance }.into();
    }
}

/// Coats the first diffuse material that shapes show, smoothly or with this roughness; false where there is none.
fn add_coat(desc: &mut SceneDesc, roughness: Option<Roughness>) -> bool {
    let Some(bsdf) = shown(desc, |bsdf| matches!(bsdf, BsdfDesc::Diffuse(_))) else { return false };
    let BsdfDesc::Diffuse(DiffuseDesc { reflectance }) = &*bsdf else { return false };
    let (int_ior, ext_ior, nonlinear) = (Ior::Constant(1.5), Ior::Constant(1.0), false);
    let (diffuse_reflectance, specular_reflectance) = (reflectance.clone(), Spectrum::Constant(1.0).into());
    *bsdf = match roughness {
        None => PlasticDesc { int_ior, ext_ior, diffuse_reflectance, specular_reflectance, nonlinear }.into(),
        Some(roughness) => RoughPlasticDesc {
            int_ior,
            ext_ior,
            diffuse_reflectance,
            specular_reflectance,
            nonlinear,
            roughness,
        }
        .into(),
    };
    true
}

/// True for a material that splits light into its colours.
fn disperses(bsdf: &BsdfDesc) -> bool {
    bsdf.transmits() && has_dispersive_index(bsdf)
}

/// True for a material that depends on the wavelength in any way.
fn is_colored(bsdf: &BsdfDesc) -> bool {
    let parts = bsdf.parts();
    let textures = [parts.albedo, parts.reflection, parts.transmission, parts.absorption];
    let colored = textures.into_iter().flatten().any(|texture| !texture.is_grey())
        || [parts.eta, parts.k].into_iter().flatten().any(|spectrum| !spectrum.is_constant());
    !bsdf.is_black() && (colored || has_dispersive_index(bsdf) || bsdf.is_iridescent())
}

/// True where the relative index depends on the wavelength, as paths see it: for any four wavelengths that they may carry.
fn has_dispersive_index(bsdf: &BsdfDesc) -> bool {
    let Some([inside, outside]) = bsdf.spectral_indices() else { return false };
    if !inside.is_dispersive() && !outside.is_dispersive() {
        return false;
    }
    let at = |lambda: f32| inside.eval(Vec4::splat(lambda)).x / outside.eval(Vec4::splat(lambda)).x;
    let first = at(LAMBDA_MIN);
    let mut steps = (1..=64).map(|i| LAMBDA_MIN + (LAMBDA_MAX - LAMBDA_MIN) * i as f32 / 64.0);
    steps.any(|lambda| wavelength_mis::disperses(Vec4::new(first, at(lambda), first, first)))
}
