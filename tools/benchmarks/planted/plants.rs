//! The changes that are planted, made in copies of the descriptions of scenes.

use pointillist::scene::desc::texture::SpectrumTexture;
use pointillist::scene::desc::{
    BsdfDesc, BsdfId, DiffuseDesc, LightDesc, ProjectionDesc, SceneDesc, ShapeDesc,
};
use pointillist::spectrum::Spectrum;

/// Factor on an albedo.
const ALBEDO: f32 = 1.005;

/// Factor on a light.
const LIGHT: f32 = 1.002;

/// Shift of the camera in pixels.
const SHIFT: f64 = 0.1;

/// A planted change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
pub enum Plant {
    /// Other seeds: no change
    Seed,
    /// One albedo that a single surface has, times 1.005
    Albedo,
    /// One light times 1.002
    Light,
    /// One picture on a surface, shifted by a texel along u
    Texel,
    /// The picture shifted by .1 pixel along x
    Camera,
    /// Red and blue of the picture swapped
    Channel,
    /// A constant of the shader that splats samples, on llvmpipe
    Device,
}

impl Plant {
    /// A scene with the change, whose picture is that wide; `None` where there is nothing to change. Seeds, channels and devices change no scene.
    pub fn scene(self, desc: &SceneDesc, width: u32) -> Option<SceneDesc> {
        let mut desc = desc.clone();
        match self {
            Self::Seed | Self::Channel | Self::Device => {}
            Self::Albedo => {
                let id = (0..desc.bsdfs.len()).find(|&i| uniform(&desc, i).is_some_and(can_grow))?;
                if let BsdfDesc::Diffuse(DiffuseDesc { reflectance: SpectrumTexture::Uniform(albedo) }) =
                    &mut desc.bsdfs[id]
                {
                    *albedo = albedo.scaled(ALBEDO);
                }
            }
            Self::Light => {
                let light = light(&mut desc)?;
                *light = light.scaled(LIGHT);
            }
            Self::Texel => {
                let picture = desc.bsdfs.iter_mut().find_map(|bsdf| match bsdf {
                    BsdfDesc::Diffuse(DiffuseDesc { reflectance: SpectrumTexture::Bitmap(picture) }) => {
                        Some(picture)
                    }
                    _ => None,
                })?;
                picture.to_uv.translation.x += 1.0 / picture.bitmap.width() as f32;
            }
            Self::Camera => {
                if !matches!(desc.camera.projection, ProjectionDesc::Perspective(_)) {
                    return None;
                }
                desc.camera.principal_point_offset.x += SHIFT / f64::from(width);
            }
        }
        Some(desc)
    }
}

/// The albedo of a diffuse material that a single surface has.
fn uniform(desc: &SceneDesc, bsdf: usize) -> Option<&Spectrum> {
    let id = BsdfId(bsdf as u32);
    let has = |shape: &&ShapeDesc| match desc.bsdfs.get(shape.bsdf.0 as usize) {
        Some(BsdfDesc::TwoSided(sides)) => sides.front == id || sides.back == id,
        _ => shape.bsdf == id,
    };
    match &desc.bsdfs[bsdf] {
        BsdfDesc::Diffuse(DiffuseDesc { reflectance: SpectrumTexture::Uniform(albedo) }) => {
            (desc.surfaces().filter(has).count() == 1).then_some(albedo)
        }
        _ => None,
    }
}

/// Whether an albedo is neither black nor beyond 1 after the change.
fn can_grow(albedo: &Spectrum) -> bool {
    !albedo.is_black() && albedo.max() * ALBEDO <= 1.0
}

/// The first light: that of a shape, if one shines.
fn light(desc: &mut SceneDesc) -> Option<&mut Spectrum> {
    if let Some(radiance) = desc.shapes.iter_mut().find_map(|shape| shape.emission.as_mut()) {
        return Some(radiance);
    }
    Some(match desc.lights.first_mut()? {
        LightDesc::Constant { radiance, .. } => radiance,
        LightDesc::Map { scale, .. } => scale,
        LightDesc::SunSky(sky) => &mut sky.scale,
        LightDesc::Directional { irradiance, .. } => irradiance,
        LightDesc::Spot(spot) => &mut spot.intensity,
        LightDesc::Projector(projector) => &mut projector.irradiance,
        LightDesc::Point { intensity, .. } => intensity,
    })
}
