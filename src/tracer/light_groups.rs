//! Groups of lights: a path credits each contribution to the group of the light that it comes from.
//!
//! Integrators are generic over the set of materials. Compiled for [`CreditedBsdf`](super::bsdf::CreditedBsdf), which is every material, their
//! paths carry [`GroupCredits`]; compiled for any other set they carry `()`, and nothing of this is in their code. What a path adds up
//! without regard to groups is the same sum in the same order either way, so that the picture is the same, bit for bit.
//!
//! Where next-event estimation takes one of several light samples and lets it stand for all, the group of that sample is credited
//! with the whole value: it is chosen in proportion to what it contributes, so that each group has the expected value of its lights.

use std::sync::Arc;

use crate::color::Xyz;
use crate::scene::limits::LIGHT_GROUPS;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::stream::MOST_GROUPS;

use super::light::Lights;
use super::medium::MediumIndex;

const _: () = assert!(LIGHT_GROUPS == MOST_GROUPS);

/// A colour for each group.
pub type GroupColors = [Xyz; MOST_GROUPS];

/// The group of each light and each medium of a scene.
#[derive(Clone, Debug)]
pub struct LightGroups {
    /// Numbers of groups, in the order of the lights.
    of_lights: Arc<[u8]>,
    /// Numbers of groups, in the order of the media.
    of_media: Arc<[u8]>,
    count: usize,
}

impl LightGroups {
    /// `count` groups, at most [`MOST_GROUPS`], and the number of each light's and of each medium's; of media without a number it is 0.
    pub(super) fn new(of_lights: Arc<[u8]>, of_media: Arc<[u8]>, count: usize) -> Self {
        Self { of_lights, of_media, count: count.min(MOST_GROUPS) }
    }

    /// Number of groups.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The group of a light.
    #[inline]
    pub(super) fn of(&self, light: u32) -> Option<u8> {
        self.of_lights.get(light as usize).copied()
    }

    /// The group of a medium.
    #[inline]
    fn of_medium(&self, medium: MediumIndex) -> u8 {
        self.of_media.get(medium.number() as usize).copied().unwrap_or_default()
    }
}

/// The radiance that a path has found, by groups of lights; `()` in a render without groups.
pub trait LightCredits: Copy + Default {
    /// False for `()`.
    const KEPT: bool;

    /// Credits radiance at the wavelengths of the path to the group of `light`.
    fn add(&mut self, lights: &Lights, light: u32, radiance: SampledSpectrum);

    /// Credits radiance at the wavelengths of the path, which `medium` emits, to its group.
    fn add_of_medium(&mut self, lights: &Lights, medium: MediumIndex, radiance: SampledSpectrum);

    /// Credits radiance at the wavelengths of the path to a group.
    fn add_to(&mut self, group: u8, radiance: SampledSpectrum);

    /// Credits a colour to a group.
    fn add_color(&mut self, group: u8, color: Xyz);

    /// Credits a colour to each group.
    fn add_colors(&mut self, colors: &GroupColors);

    /// Adds the credits of a part of the path, whose radiance is to be multiplied by `factor`.
    fn add_all(&mut self, part: &Self, factor: SampledSpectrum);

    /// Makes colours of the radiance so far, which was found at these wavelengths.
    fn settle(&mut self, lambda: &SampledWavelengths);

    /// The colours of the groups, once everything is [settled](Self::settle).
    fn colors(&self) -> GroupColors;
}

impl LightCredits for () {
    const KEPT: bool = false;

    #[inline(always)]
    fn add(&mut self, _: &Lights, _: u32, _: SampledSpectrum) {}

    #[inline(always)]
    fn add_of_medium(&mut self, _: &Lights, _: MediumIndex, _: SampledSpectrum) {}

    #[inline(always)]
    fn add_to(&mut self, _: u8, _: SampledSpectrum) {}

    #[inline(always)]
    fn add_color(&mut self, _: u8, _: Xyz) {}

    #[inline(always)]
    fn add_colors(&mut self, _: &GroupColors) {}

    #[inline(always)]
    fn add_all(&mut self, _: &Self, _: SampledSpectrum) {}

    #[inline(always)]
    fn settle(&mut self, _: &SampledWavelengths) {}

    #[inline(always)]
    fn colors(&self) -> GroupColors {
        GroupColors::default()
    }
}

/// The radiance that a path has found from each group.
#[derive(Clone, Copy, Debug, Default)]
pub struct GroupCredits {
    /// At the wavelengths of the path, since they were last changed.
    radiance: [SampledSpectrum; MOST_GROUPS],
    /// Colours of what was found before, and by photons; in addition to `radiance`.
    colors: GroupColors,
}

impl LightCredits for GroupCredits {
    const KEPT: bool = true;

    fn add(&mut self, lights: &Lights, light: u32, radiance: SampledSpectrum) {
        if let Some(group) = lights.group(light) {
            self.add_to(group, radiance);
        }
    }

    fn add_of_medium(&mut self, lights: &Lights, medium: MediumIndex, radiance: SampledSpectrum) {
        if let Some(groups) = lights.groups() {
            self.add_to(groups.of_medium(medium), radiance);
        }
    }

    fn add_to(&mut self, group: u8, radiance: SampledSpectrum) {
        if let Some(sum) = self.radiance.get_mut(usize::from(group)) {
            *sum += radiance;
        }
    }

    fn add_color(&mut self, group: u8, color: Xyz) {
        if let Some(sum) = self.colors.get_mut(usize::from(group)) {
            *sum += color;
        }
    }

    fn add_colors(&mut self, colors: &GroupColors) {
        self.colors.iter_mut().zip(colors).for_each(|(sum, color)| *sum += *color);
    }

    fn add_all(&mut self, part: &Self, factor: SampledSpectrum) {
        self.radiance.iter_mut().zip(part.radiance).for_each(|(sum, found)| *sum += found * factor);
        self.add_colors(&part.colors);
    }

    fn settle(&mut self, lambda: &SampledWavelengths) {
        for (radiance, color) in self.radiance.iter_mut().zip(&mut self.colors) {
            *color += lambda.to_xyz(std::mem::take(radiance));
        }
    }

    fn colors(&self) -> GroupColors {
        self.colors
    }
}
