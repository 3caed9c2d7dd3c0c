//! The table of values that can be changed: how each is read from a description, and set.

use glam::DVec3;

use crate::scene::desc::texture::SpectrumTexture;
use crate::scene::desc::{BsdfDesc, BsdfId, BsdfParts, LightDesc, ProjectorDesc, SceneDesc, SpotDesc};
use crate::spectrum::Spectrum;
use crate::spectrum::dispersion::Ior;

use super::medium::MEDIUM_PARAMETERS;
use super::target::{EditableParameter, NewValue, NumberRange, ObjectKind, Target, ValueKind};

/// Makes [`BsdfNumber`] and its lines of the table: variant, name in Mitsuba, label, range.
macro_rules! bsdf_numbers {
    ($($variant:ident $name:literal $label:literal $range:ident $doc:literal,)*) => {
        /// A number of a material.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
        pub enum BsdfNumber {
            $(#[doc = $doc] $variant,)*
        }

        /// The numbers of materials.
        static BSDF_NUMBERS: [EditableParameter; [$(BsdfNumber::$variant),*].len()] = [$(EditableParameter {
            name: $name,
            label: $label,
            object: ObjectKind::Bsdf,
            range: ValueKind::Number(NumberRange::$range),
            target: |i| Target::Number(BsdfId(i), BsdfNumber::$variant),
            get: |desc, i| {
                let value = desc.bsdfs.get(i as usize)?.number($name)?;
                Some(NewValue::Number(f64::from(value)))
            },
            set: |desc, i, v| {
                if let NewValue::Number(v) = v {
                    desc.bsdfs[i as usize].set_number($name, v as f32);
                }
            },
        },)*];
    };
}

bsdf_numbers! {
    Alpha "alpha" "roughness" ALPHA "Roughness of microfacets.",
    AlphaU "alpha_u" "roughness along u" ALPHA "Their roughness along ∂p/∂u.",
    AlphaV "alpha_v" "roughness along v" ALPHA "Their roughness along ∂p/∂v.",
    Roughness "roughness" "roughness" SHARE "Square root of α of a principled material.",
    Anisotropic "anisotropic" "anisotropy" SHARE "Share of α that differs between the tangents.",
    Metallic "metallic" "metallic" SHARE "Share of metal.",
    Eta "eta" "index of refraction" RELATIVE_IOR "Index behind a principled surface over that in front of it.",
    SpecTrans "spec_trans" "specular transmission" SOME_SHARE "Share of glass in what is not metal.",
    DiffTrans "diff_trans" "diffuse transmission" DOUBLE_SHARE "Twice the share of diffuse light that is let through.",
    SpecTint "spec_tint" "specular tint" SHARE "Share of the base colour in the reflection.",
    Sheen "sheen" "sheen" SHARE "Brightness at grazing angles.",
    SheenTint "sheen_tint" "sheen tint" SHARE "Share of the base colour in it.",
    Flatness "flatness" "flatness" SHARE "Share of an approximation of subsurface scattering.",
    Clearcoat "clearcoat" "clear coat" SHARE "Strength of a second reflection.",
    ClearcoatGloss "clearcoat_gloss" "clear coat gloss" SHARE "Its smoothness.",
    ThinFilmWeight "thin_film_weight" "thin film" SHARE "Share of the facets under a film in which light interferes.",
    ThinFilmThickness "thin_film_thickness" "thickness of the film" NANOMETERS "Its thickness in nm.",
    ThinFilmEta "thin_film_eta" "index of the film" FILM_ETA "Its index over that in front of it.",
    Weight "weight" "weight of the second part" SHARE "Share of the second material of a blend.",
    Weight1 "weight_1" "weight of the first part" SHARE "Weight of the first material of a mixture; weights count in proportion.",
    Weight2 "weight_2" "weight of the second part" SHARE "Weight of the second material of a mixture.",
    Weight3 "weight_3" "weight of the third part" SHARE "Weight of the third material of a mixture.",
    Weight4 "weight_4" "weight of the fourth part" SHARE "Weight of the fourth material of a mixture.",
    Thickness "thickness" "thickness" THICKNESS "Thickness of a coat.",
    Exponent "exponent" "exponent" EXPONENT "Sharpness of the lobe of a Phong material.",
    Opacity "opacity" "opacity" SHARE "Share of a surface that is there.",
}

/// Everything that can be changed.
pub(crate) fn parameters() -> impl Iterator<Item = &'static EditableParameter> {
    PARAMETERS.iter().chain(&BSDF_NUMBERS).chain(MEDIUM_PARAMETERS)
}

/// All editable parameters but those of media and the numbers of materials. A new [`Target`] is one line here, a number of a material one
/// line of [`BsdfNumber`].
const PARAMETERS: &[EditableParameter] = &[
    EditableParameter {
        name: "emission_scale",
        label: "emission",
        object: ObjectKind::Shape,
        range: ValueKind::Scale,
        target: Target::Emission,
        get: |desc, i| desc.shapes.get(i as usize)?.emission.as_ref().map(|_| NewValue::Scale(1.0)),
        set: |desc, i, v| desc.shapes[i as usize].emission.iter_mut().for_each(|s| scale(s, v)),
    },
    EditableParameter {
        name: "emission_color",
        label: "emission colour",
        object: ObjectKind::Shape,
        range: ValueKind::Reflectance,
        target: Target::EmissionColor,
        get: |desc, i| {
            let shape = desc.shapes.get(i as usize)?;
            shape.emission.as_ref().filter(|_| shape.emission_profile.texture.is_none()).map(hue)
        },
        set: |desc, i, v| desc.shapes[i as usize].emission.iter_mut().for_each(|s| tint(s, v)),
    },
    EditableParameter {
        name: "emission_scale",
        label: "emission",
        object: ObjectKind::Light,
        range: ValueKind::Scale,
        target: Target::Light,
        get: |desc, i| desc.lights.get(i as usize).map(|_| NewValue::Scale(1.0)),
        set: |desc, i, v| scale(desc.lights[i as usize].spectrum_mut(), v),
    },
    EditableParameter {
        name: "emission_color",
        label: "emission colour",
        object: ObjectKind::Light,
        range: ValueKind::Reflectance,
        target: Target::LightColor,
        get: |desc, i| match desc.lights.get(i as usize)? {
            LightDesc::Map { .. } | LightDesc::SunSky(_) => None, // its texels have colours of their own
            LightDesc::Projector(ProjectorDesc { picture: Some(_), .. }) => None,
            light => Some(hue(light.spectrum())),
        },
        set: |desc, i, v| tint(desc.lights[i as usize].spectrum_mut(), v),
    },
    EditableParameter {
        name: "reflectance",
        label: "reflectance",
        object: ObjectKind::Bsdf,
        range: ValueKind::Reflectance,
        target: |i| Target::Reflectance(BsdfId(i)),
        get: |desc, i| color(desc.bsdfs.get(i as usize)?.parts().albedo),
        set: |desc, i, v| set_color(desc.bsdfs[i as usize].parts_mut().albedo, v),
    },
    EditableParameter {
        name: "int_ior",
        label: "index of refraction",
        object: ObjectKind::Bsdf,
        range: ValueKind::Number(NumberRange::IOR),
        target: |i| Target::IntIor(BsdfId(i)),
        get: int_ior,
        set: set_int_ior,
    },
    EditableParameter {
        name: "specular_reflectance",
        label: "specular reflectance",
        object: ObjectKind::Bsdf,
        range: ValueKind::Reflectance,
        target: |i| Target::SpecularReflectance(BsdfId(i)),
        get: |desc, i| color(own_parts(desc, i)?.reflection),
        set: |desc, i, v| set_color(desc.bsdfs[i as usize].parts_mut().reflection, v),
    },
    EditableParameter {
        name: "specular_transmittance",
        label: "specular transmittance",
        object: ObjectKind::Bsdf,
        range: ValueKind::Reflectance,
        target: |i| Target::SpecularTransmittance(BsdfId(i)),
        get: |desc, i| color(own_parts(desc, i)?.transmission),
        set: |desc, i, v| set_color(desc.bsdfs[i as usize].parts_mut().transmission, v),
    },
    EditableParameter {
        name: "textures",
        label: "textures",
        object: ObjectKind::Bsdf,
        range: ValueKind::Switch,
        target: |i| Target::Textures(BsdfId(i)),
        get: |desc, i| desc.bsdfs.get(i as usize)?.is_textured().then_some(NewValue::Switch(true)),
        set: |desc, i, v| {
            if v == NewValue::Switch(false) {
                desc.bsdfs[i as usize].flatten();
            }
        },
    },
    EditableParameter {
        name: "position",
        label: "position",
        object: ObjectKind::Light,
        range: ValueKind::Point,
        target: Target::LightPosition,
        get: |desc, i| light_position(desc.lights.get(i as usize)?),
        set: |desc, i, v| set_light_position(&mut desc.lights[i as usize], v),
    },
    EditableParameter {
        name: "direction",
        label: "direction",
        object: ObjectKind::Light,
        range: ValueKind::Direction,
        target: Target::LightDirection,
        get: |desc, i| light_direction(desc.lights.get(i as usize)?),
        set: |desc, i, v| set_light_direction(&mut desc.lights[i as usize], v),
    },
    EditableParameter {
        name: "to_world",
        label: "transform",
        object: ObjectKind::Shape,
        range: ValueKind::Transform,
        target: Target::ToWorld,
        get: |desc, i| Some(NewValue::Transform(desc.shapes.get(i as usize)?.to_world)),
        set: |desc, i, v| {
            if let NewValue::Transform(to_world) = v {
                desc.shapes[i as usize].to_world = to_world;
            }
        },
    },
];

pub(super) fn scale(spectrum: &mut Spectrum, value: NewValue) {
    if let NewValue::Scale(factor) = value {
        *spectrum = spectrum.scaled(factor as f32);
    }
}

/// The colour of an emission, with 1 for its largest component.
fn hue(spectrum: &Spectrum) -> NewValue {
    let rgb = spectrum.emitted_rgb();
    let most = rgb.into_iter().fold(0.0, f32::max);
    NewValue::Rgb(rgb.map(|v| if most > 0.0 { f64::from((v / most).clamp(0.0, 1.0)) } else { 1.0 }))
}

/// Another colour of the same luminance, through the same smooth spectra as an `rgb` of a file. Black has no colour.
fn tint(spectrum: &mut Spectrum, value: NewValue) {
    let NewValue::Rgb(rgb) = value else { return };
    let tinted = Spectrum::emission_rgb(rgb.map(|v| v as f32));
    let (before, after) = (spectrum.luminance(), tinted.luminance());
    if after > 0.0 {
        *spectrum = tinted.scaled(before / after);
    }
}

/// The parts of a material, where its factors on reflection and transmission are its own.
fn own_parts(desc: &SceneDesc, index: u32) -> Option<BsdfParts<&SpectrumTexture, &Spectrum, &Ior>> {
    match desc.bsdfs.get(index as usize)? {
        BsdfDesc::Principled(_) | BsdfDesc::PrincipledThin(_) => None,
        bsdf => Some(bsdf.parts()),
    }
}

/// The colour of a reflectance or a factor, unless it varies.
pub(super) fn color(texture: Option<&SpectrumTexture>) -> Option<NewValue> {
    let rgb = texture?.uniform()?.reflected_rgb();
    Some(NewValue::Rgb(rgb.map(|v| f64::from(v).clamp(0.0, 1.0))))
}

/// Through the same smooth spectra as an `rgb` of a file.
pub(super) fn set_color(texture: Option<&mut SpectrumTexture>, value: NewValue) {
    if let (Some(texture), NewValue::Rgb(rgb)) = (texture, value) {
        *texture = Spectrum::reflectance_rgb(rgb.map(|v| v as f32)).into();
    }
}

fn light_position(light: &LightDesc) -> Option<NewValue> {
    match light {
        LightDesc::Point { position, .. } | LightDesc::Spot(SpotDesc { position, .. }) => {
            Some(NewValue::Vector(position.to_array()))
        }
        LightDesc::Projector(light) => Some(NewValue::Vector(light.to_world.translation.to_array())),
        _ => None,
    }
}

fn set_light_position(light: &mut LightDesc, value: NewValue) {
    let NewValue::Vector(to) = value else { return };
    match light {
        LightDesc::Point { position, .. } | LightDesc::Spot(SpotDesc { position, .. }) => {
            *position = to.into()
        }
        LightDesc::Projector(light) => light.to_world.translation = to.into(),
        _ => {}
    }
}

/// A spot with a texture and a projector turn about their axis, too: their direction alone does not say how they stand.
fn light_direction(light: &LightDesc) -> Option<NewValue> {
    match light {
        LightDesc::Directional { direction, .. } => Some(NewValue::Vector(direction.to_array())),
        LightDesc::Spot(SpotDesc { axis, texture: None, .. }) => Some(NewValue::Vector(axis.to_array())),
        _ => None,
    }
}

fn set_light_direction(light: &mut LightDesc, value: NewValue) {
    let NewValue::Vector(to) = value else { return };
    let to = DVec3::from(to).normalize();
    match light {
        LightDesc::Directional { direction, .. } => *direction = to,
        LightDesc::Spot(SpotDesc { axis, .. }) => *axis = to,
        _ => {}
    }
}

fn int_ior(desc: &SceneDesc, index: u32) -> Option<NewValue> {
    let int_ior = desc.bsdfs.get(index as usize)?.parts().int_ior?;
    Some(NewValue::Number(f64::from(int_ior.nominal())))
}

fn set_int_ior(desc: &mut SceneDesc, index: u32, value: NewValue) {
    if let (Some(int_ior), NewValue::Number(n)) = (desc.bsdfs[index as usize].parts_mut().int_ior, value) {
        *int_ior = int_ior.with_index(n as f32);
    }
}
