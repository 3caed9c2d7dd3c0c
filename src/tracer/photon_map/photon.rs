//! One photon: a light path's arrival at a surface or at a point in a medium, stored in 32 bytes.
//!
//! **Wavelengths.** A light path and the camera path that gathers its photon have different wavelengths, and a flux known
//! at four wavelengths says nothing exact about four others. Converting flux to XYZ when it is stored would multiply it by
//! reflectances in the wrong space, and filtering photons by wavelength would reject most of them. So a photon keeps its
//! flux at *its own* wavelengths: the camera path evaluates its throughput and the BSDF at [`Photon::wavelengths`] and
//! adds `wavelengths.to_xyz(throughput · f · flux)`. This is an unbiased estimate of the integral over wavelength for
//! every photon and any material. Only a camera path that lost its secondary wavelengths to dispersion has a throughput at
//! one wavelength alone. It gathers photons near that wavelength, as it gathers photons near its vertex.
//!
//! The random number that selects the wavelengths is rounded to 16 bits *before* the light path is traced
//! ([`wavelengths`]), so two bytes store all four exactly. The 4 · 65 536 wavelengths over 400 nm are denser than any
//! detail of a scene's spectra.

use glam::{Vec2, Vec3, Vec4};

use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::stream::MOST_GROUPS;
use crate::tracer::medium::MediumIndex;

/// Rounds the random number `u` in [0, 1) that selects the wavelengths of a light path, before the path is traced.
#[inline]
pub fn wavelength_number(u: f32) -> u16 {
    (f64::from(u) * 65_536.0) as u16
}

/// The wavelengths that a number from [`wavelength_number`] selects.
#[inline]
pub fn wavelengths(number: u16) -> SampledWavelengths {
    SampledWavelengths::sample((f32::from(number) + 0.5) / 65_536.0)
}

/// Where a light path arrives.
#[derive(Clone, Copy, Debug)]
pub enum ArrivalSite {
    /// A surface, with the unit geometric normal on its lit side.
    Surface(Vec3),
    /// A point in this medium.
    Medium(MediumIndex),
}

/// A light path's arrival, before it is packed into a [`Photon`].
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// Position, world space, m.
    pub position: Vec3,
    /// Unit vector back along the path. It is the `wi` of the density estimate.
    pub direction: Vec3,
    /// What is there.
    pub site: ArrivalSite,
    /// Flux at the wavelengths of the path, W/nm, as if this light path were the only one: not yet divided by the number of
    /// light paths of the snapshot. In a medium it is what is left
    /// after the scattering.
    pub flux: SampledSpectrum,
    /// From [`wavelength_number`].
    pub wavelengths: u16,
    /// True if the path has lost its secondary wavelengths. Only the first lane of `flux` is valid then.
    pub hero_only: bool,
    /// Number of segments of the light path, at most 4095.
    pub depth: u32,
    /// The group of lights that it comes from, if there are groups.
    pub group: u8,
}

/// A photon without its position, packed into 20 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Photon {
    /// Four mantissas of 14 bits and a shared exponent of 8 bits.
    flux: [u32; 2],
    /// Octahedral encoding, 2 · 16 bits.
    direction: u32,
    /// The normal of a surface in octahedral encoding, 2 · 16 bits, or the number of a medium: the layer tells which.
    site: u32,
    wavelengths: u16,
    /// Bit 0: hero wavelength only. Bits 1 to 3: the group of lights. The depth is above them.
    flags: u16,
}

const _: () = assert!(size_of::<Photon>() == 20 && size_of::<Vec3>() == 12);

/// Bits of one mantissa of the flux.
const MANTISSA: u32 = 14;
const HERO_ONLY: u16 = 1;
const GROUP_SHIFT: u32 = 1;
const DEPTH_SHIFT: u32 = 4;
const MAX_DEPTH: u32 = u16::MAX as u32 >> DEPTH_SHIFT;

const _: () = assert!(MOST_GROUPS <= 1 << (DEPTH_SHIFT - GROUP_SHIFT));

impl Photon {
    /// Packs an arrival. `None` if its flux is zero, negative or not finite, or its position or a direction is not valid.
    ///
    /// Directions keep 16 bits per octahedral coordinate (an error below 0.0001 rad). Lanes of the flux keep 14 bits relative
    /// to the largest lane, rounded to nearest.
    pub fn new(arrival: &Arrival) -> Option<Photon> {
        let mut flux = arrival.flux.0;
        if arrival.hero_only {
            flux = Vec4::new(flux.x, 0.0, 0.0, 0.0);
        }
        let sound = flux.is_finite() && flux.min_element() >= 0.0 && flux.max_element() >= f32::MIN_POSITIVE;
        if !sound || !arrival.position.is_finite() {
            return None;
        }
        Some(Photon {
            flux: pack_flux(flux),
            direction: pack_unit(arrival.direction)?,
            site: match arrival.site {
                ArrivalSite::Surface(normal) => pack_unit(normal)?,
                ArrivalSite::Medium(medium) => medium.number(),
            },
            wavelengths: arrival.wavelengths,
            flags: (u16::from(arrival.hero_only) * HERO_ONLY)
                | ((u16::from(arrival.group) % MOST_GROUPS as u16) << GROUP_SHIFT)
                | ((arrival.depth.min(MAX_DEPTH) as u16) << DEPTH_SHIFT),
        })
    }

    /// Flux of one light path at [`Photon::wavelengths`], W/nm.
    #[inline]
    pub fn flux(&self) -> SampledSpectrum {
        let bits = u64::from(self.flux[0]) | u64::from(self.flux[1]) << 32;
        let scale = power_of_two((bits >> 56) as i32 - 126 - MANTISSA as i32);
        let lane = |i: u32| (((bits >> (i * MANTISSA)) & MAX_MANTISSA) as f64 * scale) as f32;
        SampledSpectrum(Vec4::new(lane(0), lane(1), lane(2), lane(3)))
    }

    /// The wavelengths of the flux.
    #[inline]
    pub fn wavelengths(&self) -> SampledWavelengths {
        let mut all = wavelengths(self.wavelengths);
        if self.flags & HERO_ONLY != 0 {
            all.terminate_companions();
        }
        all
    }

    /// Number of segments of the light path.
    #[inline]
    pub fn depth(&self) -> u32 {
        u32::from(self.flags >> DEPTH_SHIFT)
    }

    /// The group of lights that it comes from, if there are groups.
    #[inline]
    pub fn group(&self) -> u8 {
        (self.flags >> GROUP_SHIFT) as u8 % MOST_GROUPS as u8
    }

    /// Unit vector in the direction from which the photon came.
    #[inline]
    pub fn direction(&self) -> Vec3 {
        unpack_unit(self.direction)
    }

    /// Unit geometric normal on the lit side of the surface of this photon. A query accepts photons whose normal agrees with that of its
    /// vertex, which excludes light on the other side of a thin wall.
    #[inline]
    pub fn normal(&self) -> Vec3 {
        unpack_unit(self.site)
    }

    /// True for a photon of a volume layer that lies in `medium`.
    #[inline]
    pub fn is_in(&self, medium: MediumIndex) -> bool {
        self.site == medium.number()
    }
}

const MAX_MANTISSA: u64 = (1 << MANTISSA) - 1;

/// 2^k, where this is a normal `f64`.
#[inline]
fn power_of_two(k: i32) -> f64 {
    f64::from_bits(((1023 + k) as u64) << 52)
}

/// Packs `flux`, which must be finite and non-negative, with a normal number as its largest lane.
fn pack_flux(flux: Vec4) -> [u32; 2] {
    // The largest lane lies in [2^(e − 127), 2^(e − 126)), so its mantissa fills the 14 bits.
    let e = flux.max_element().to_bits() >> 23;
    let scale = power_of_two(MANTISSA as i32 + 126 - e as i32);
    let mut bits = u64::from(e) << 56;
    for (i, lane) in flux.to_array().into_iter().enumerate() {
        let m = (f64::from(lane) * scale).round() as u64;
        bits |= m.min(MAX_MANTISSA) << (i as u32 * MANTISSA);
    }
    [bits as u32, (bits >> 32) as u32]
}

/// Octahedral map of the sphere (Cigolle et al., *A Survey of Efficient Representations for Independent Unit Vectors*,
/// JCGT 3(2), 2014). `None` for a vector without a direction.
fn pack_unit(v: Vec3) -> Option<u32> {
    let sum = v.abs().element_sum();
    if !(sum.is_finite() && sum > 0.0) {
        return None;
    }
    let mut o = Vec2::new(v.x, v.y) / sum;
    if v.z < 0.0 {
        o = (Vec2::ONE - Vec2::new(o.y, o.x).abs()) * sign(o);
    }
    let q = |x: f32| ((x * 0.5 + 0.5).clamp(0.0, 1.0) * 65_535.0).round() as u32;
    Some(q(o.x) | q(o.y) << 16)
}

fn unpack_unit(bits: u32) -> Vec3 {
    let x = |q: u32| (q as f32 / 65_535.0) * 2.0 - 1.0;
    let o = Vec2::new(x(bits & 0xffff), x(bits >> 16));
    let z = 1.0 - o.x.abs() - o.y.abs();
    let o = if z < 0.0 { (Vec2::ONE - Vec2::new(o.y, o.x).abs()) * sign(o) } else { o };
    Vec3::new(o.x, o.y, z).normalize()
}

fn sign(v: Vec2) -> Vec2 {
    Vec2::ONE.copysign(v)
}
