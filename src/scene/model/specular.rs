//! A diffuse colour and the colour of the reflection at normal incidence as a base colour and a share of metal, as in the
//! examples of `KHR_materials_pbrSpecularGlossiness` (KhronosGroup/glTF): the share of metal is what gives both brightnesses
//! with a reflection of .04 of what is not metal.

/// Reflection at normal incidence of what is not metal.
pub(super) const DIELECTRIC: f32 = 0.04;

/// The strongest reflection that an index of refraction stands for: that of 2.4, of diamond.
pub(super) const STRONGEST: f32 = 0.17;

/// Base colour and metallic.
pub(super) fn metallic_roughness(diffuse: [f32; 3], specular: [f32; 3]) -> ([f32; 3], f32) {
    let brightness = |[r, g, b]: [f32; 3]| (0.299 * r * r + 0.587 * g * g + 0.114 * b * b).sqrt();
    let strongest = specular.into_iter().fold(0.0, f32::max);
    let left = (1.0 - strongest) / (1.0 - DIELECTRIC);
    let metallic = share_of_metal(brightness(diffuse) * left, brightness(specular));
    let color = std::array::from_fn(|i| {
        let of_diffuse = diffuse[i] * left / (1.0 - metallic).max(1e-6);
        let of_specular = (specular[i] - DIELECTRIC * (1.0 - metallic)) / metallic.max(1e-6);
        let weight = metallic * metallic;
        (of_diffuse * (1.0 - weight) + of_specular * weight).clamp(0.0, 1.0)
    });
    (color, metallic)
}

/// The metallic m for which a base colour c has the brightness `diffuse` = c (1 − m) and `specular` = .04 (1 − m) + c m.
fn share_of_metal(diffuse: f32, specular: f32) -> f32 {
    if specular < DIELECTRIC {
        return 0.0;
    }
    let (a, b, c) = (DIELECTRIC, diffuse + specular - 2.0 * DIELECTRIC, DIELECTRIC - specular);
    let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
    ((root - b) / (2.0 * a)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A metallic-roughness material gives diffuse and specular colours, and is found again from them.
    #[test]
    fn the_conversion_is_the_inverse_of_the_definition() {
        for metallic in [0.0, 0.25, 0.75, 1.0] {
            let base = [0.8, 0.5, 0.3_f32];
            let specular = base.map(|c| DIELECTRIC * (1.0 - metallic) + c * metallic);
            let left = (1.0 - specular.into_iter().fold(0.0, f32::max)) / (1.0 - DIELECTRIC);
            let diffuse = base.map(|c| c * (1.0 - metallic) / left);
            let (color, found) = metallic_roughness(diffuse, specular);
            assert!((found - metallic).abs() < 0.03, "{metallic}: {found}");
            assert!(color.iter().zip(base).all(|(a, b)| (a - b).abs() < 0.05), "{metallic}: {color:?}");
        }
    }
}
