//! The values of media that can be changed.

use crate::scene::desc::texture::SpectrumTexture;
use crate::scene::desc::{MediumDesc, MediumId, PhaseDesc, SceneDesc};
use crate::spectrum::Spectrum;

use super::parameters::{color, scale, set_color};
use super::target::{EditableParameter, NewValue, NumberRange, ObjectKind, Target, ValueKind};

/// Everything of a medium that can be changed.
pub(super) const MEDIUM_PARAMETERS: &[EditableParameter] = &[
    EditableParameter {
        name: "density_scale",
        label: "density",
        object: ObjectKind::Medium,
        range: ValueKind::Scale,
        target: |i| Target::Density(MediumId(i)),
        get: |desc, i| medium(desc, i).map(|_| NewValue::Scale(1.0)),
        set: |desc, i, v| {
            if let NewValue::Scale(factor) = v {
                let scale = &mut desc.media[i as usize].scale;
                *scale = (*scale * factor).min(MediumDesc::LARGEST);
            }
        },
    },
    EditableParameter {
        name: "extinction_color",
        label: "extinction colour",
        object: ObjectKind::Medium,
        range: ValueKind::Reflectance,
        target: |i| Target::ExtinctionColor(MediumId(i)),
        get: |desc, i| {
            let rgb = medium(desc, i)?.sigma_t.uniform()?.reflected_rgb();
            let most = largest(rgb);
            (most > 0.0).then(|| NewValue::Rgb(rgb.map(|v| f64::from(v / most).clamp(0.0, 1.0))))
        },
        set: |desc, i, v| {
            if let NewValue::Rgb(rgb) = v {
                tint(&mut desc.media[i as usize].sigma_t, rgb.map(|v| v as f32));
            }
        },
    },
    EditableParameter {
        name: "albedo",
        label: "albedo",
        object: ObjectKind::Medium,
        range: ValueKind::Reflectance,
        target: |i| Target::Albedo(MediumId(i)),
        get: |desc, i| color(Some(&medium(desc, i)?.albedo)),
        set: |desc, i, v| set_color(Some(&mut desc.media[i as usize].albedo), v),
    },
    EditableParameter {
        name: "g",
        label: "mean cosine of scattering",
        object: ObjectKind::Medium,
        range: ValueKind::Number(NumberRange::ASYMMETRY),
        target: |i| Target::Asymmetry(MediumId(i)),
        get: |desc, i| match medium(desc, i)?.phase {
            PhaseDesc::HenyeyGreenstein { g } => Some(NewValue::Number(g)),
            _ => None,
        },
        set: |desc, i, v| {
            if let (PhaseDesc::HenyeyGreenstein { g }, NewValue::Number(v)) =
                (&mut desc.media[i as usize].phase, v)
            {
                *g = v;
            }
        },
    },
    EditableParameter {
        name: "emission_scale",
        label: "emission",
        object: ObjectKind::Medium,
        range: ValueKind::Scale,
        target: |i| Target::MediumEmission(MediumId(i)),
        get: |desc, i| medium(desc, i)?.emission.as_ref().map(|_| NewValue::Scale(1.0)),
        set: |desc, i, v| {
            desc.media[i as usize].emission.iter_mut().for_each(|light| scale(&mut light.radiance, v));
        },
    },
];

fn medium(desc: &SceneDesc, index: u32) -> Option<&MediumDesc> {
    desc.media.get(index as usize)
}

fn largest(rgb: [f32; 3]) -> f32 {
    rgb.into_iter().fold(0.0, f32::max)
}

/// Another colour whose largest component is that of the present one, through the same smooth spectra as an `rgb` of a file. Black has no
/// colour.
fn tint(sigma_t: &mut SpectrumTexture, rgb: [f32; 3]) {
    let Some(present) = sigma_t.uniform() else { return };
    let (most, wanted) = (largest(present.reflected_rgb()), largest(rgb));
    if wanted > 0.0 {
        *sigma_t = Spectrum::extinction_rgb(rgb.map(|v| v / wanted * most)).into();
    }
}
