//! Materials of MTL files.

use glam::Vec2;
use pointillist::scene::desc::BsdfDesc;
use pointillist::scene::desc::texture::{SpectrumTexture, TexturePoint};
use pointillist::scene::{Loaded, load};

use super::obj_models::{CORNERS, FACE, SQUARE, inner, messages, only, square, write};

#[test]
fn glass_is_glass_unless_something_says_otherwise() {
    for (mtl, glass) in [
        ("illum 4\nKd 0.8 0.2 0.1\nTf 1 1 1\nNi 1.00\n", false),
        ("illum 4\nKd 0 0 0\nTf 1 1 1\nmap_Kd a.png\nNi 1.00\n", false),
        ("illum 4\nKd 0 0 0\nKa 0 0 0\nTf 1 1 1\nNi 1.00\n", false),
        ("illum 6\nKd 0.8 0.2 0.1\n", false),
        ("illum 9\nNi 1.45\nKd 1 1 1\nmap_d a.png\n", false),
        ("illum 7\nNi 1.33\n", true),
        ("illum 4\nKd 0 0 0\nd 0.3\nNi 1\n", true),
        ("illum 6\nKd 0.8 0.8 0.8\nTf 0.5 1 0.25\nNi 1.5\n", true),
        ("illum 9\nKd 0.8 0.8 0.8\nd 0.4\nNi 1.5\n", true),
        ("illum 2\nNi 1.5\nTf 0 1 0\n", false),
    ] {
        let Loaded { desc, .. } = square("glass", mtl);
        assert_eq!(matches!(only(&desc), BsdfDesc::Dielectric(_)), glass, "{mtl}: {:?}", only(&desc));
    }
    let Loaded { desc, .. } = square("tinted", "illum 6\nTf 0.5 1 0.25\nNi 1.5\n");
    let BsdfDesc::Dielectric(glass) = only(&desc) else { panic!("{:?}", only(&desc)) };
    let rgb = glass.specular_transmittance.uniform().unwrap().reflected_rgb();
    assert!(rgb.iter().zip([0.5, 1.0, 0.25]).all(|(a, b)| (a - b).abs() < 0.02), "{rgb:?}");
    // Maya's surface has its picture.
    let Loaded { desc, .. } = square("maya", "illum 4\nKd 0 0 0\nTf 1 1 1\nmap_Kd a.png\nNi 1.00\n");
    let BsdfDesc::Diffuse(paint) = only(&desc) else { panic!("{:?}", only(&desc)) };
    assert!(matches!(paint.reflectance, SpectrumTexture::Bitmap(_)));
}

/// A picture of opacity with alpha means its alpha: that of leaves is the picture of their colours.
#[test]
fn opacity_is_the_alpha_of_a_picture_that_has_one() {
    let texels = [[255, 255, 255, 0], [0, 0, 0, 255], [255, 255, 255, 255], [0, 0, 0, 51]];
    let leaf = image::RgbaImage::from_raw(2, 2, texels.concat()).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    leaf.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    let obj = format!("mtllib none.mtl a.mtl\nmtllib none.mtl a.mtl\n{SQUARE}{CORNERS}usemtl a\n{FACE}");
    let path = write(
        "leaf",
        &[
            ("m.obj", obj.as_bytes()),
            ("a.mtl", b"newmtl a\nmap_Kd leaf.png\nmap_d leaf.png\n"),
            ("leaf.png", &bytes.into_inner()),
        ],
    );
    let loaded = load(&path, &[]).unwrap();
    let told = messages(&loaded);
    assert!(told.len() == 1 && told[0].contains("none.mtl"), "{told:?}");
    let BsdfDesc::Mask(mask) = only(&loaded.desc) else { panic!("{:?}", only(&loaded.desc)) };
    let at = |u: f32, v: f32| mask.opacity.scalar(&TexturePoint::from(Vec2::new(u, v)));
    let found = [at(0.25, 0.25), at(0.75, 0.25), at(0.25, 0.75), at(0.75, 0.75)];
    assert_eq!(found.map(|v| (v * 255.0).round()), [0.0, 255.0, 255.0, 51.0], "{found:?}");
}

/// What a material says and another statement takes the place of is told, and what says the same twice is not.
#[test]
fn statements_that_change_nothing_here_are_told() {
    for (mtl, left) in [
        ("Kd 0.25 0.25 0.25\nmap_Kd a.png\n", Some("`Kd`")),
        ("Kd 1 1 1\nmap_Kd a.png\n", None),
        ("Kd 0.8 0.1 0.1\nNi 1.5\nillum 7\n", Some("`Kd`")),
        ("Ks 1 0 0\nNs 50\n", Some("`Ks`")),
        ("Ks 0.5 0.5 0.5\nNs 50\n", None),
        ("d 0.5\nTr 0.5\n", None),
        ("d 0.5\nTr 0.25\n", Some("`Tr`")),
        ("d -halo 0.5\n", Some("`-halo of d`")),
    ] {
        let loaded = square("left", mtl);
        let told = messages(&loaded);
        let expected = left.map(|left| format!("not used: {left}"));
        assert_eq!(told, expected.into_iter().collect::<Vec<_>>(), "{mtl}");
        assert_eq!(
            mtl.contains("d 0.5") || mtl.contains("halo"),
            matches!(only(&loaded.desc), BsdfDesc::Mask(_))
        );
    }
}

/// `-s` and `-o` as Maya and Blender mean them: u · scale + offset, with v upwards.
#[test]
fn options_move_and_repeat_a_picture() {
    let of = |options: &str| {
        let loaded = square("options", &format!("map_Kd {options} my tex 2.png\n"));
        assert_eq!(messages(&loaded), [""; 0], "{options}");
        let BsdfDesc::Diffuse(paint) = only(&loaded.desc) else { panic!("{:?}", only(&loaded.desc)) };
        let SpectrumTexture::Bitmap(bitmap) = &paint.reflectance else { panic!("{:?}", paint.reflectance) };
        bitmap.clone()
    };
    for (options, scale, offset) in [
        ("-bm 1.0", [1.0, 1.0], [0.0, 0.0]),
        ("-s 2 2 1", [2.0, 2.0], [0.0, 0.0]),
        ("-s 2 3 -o 0.25 0.125", [2.0, 3.0], [0.25, 0.125]),
        ("-o 0.5 -clamp on -blendu off -blendv off", [1.0, 1.0], [0.5, 0.0]),
    ] {
        let bitmap = of(options);
        for at in [Vec2::new(0.0, 0.0), Vec2::new(0.25, 0.75)] {
            let expected = Vec2::new(at.x * scale[0] + offset[0], at.y * scale[1] + offset[1]);
            let found = bitmap.to_uv.transform_point2(Vec2::new(at.x, 1.0 - at.y));
            assert!(
                found.distance(Vec2::new(expected.x, 1.0 - expected.y)) < 1e-6,
                "{options}: {at} {found}"
            );
        }
        assert_eq!(bitmap.nearest, options.contains("blendu"));
    }
}

#[test]
fn maps_and_the_physical_extension_are_used() {
    let Loaded { desc, warnings } = square(
        "physical",
        "Kd 0.5 0.25 1\nPr 0.3\nmap_Pm a.png\nPs 0.2\nPc 0.7\nPcr 0.1\naniso 0.4\nKs 0.5 0.5 0.5\nNs 98\nNi 1.4\nnorm a.png\n",
    );
    assert!(warnings.is_empty(), "{warnings:?}");
    let BsdfDesc::NormalMap(map) = only(&desc) else { panic!("{:?}", only(&desc)) };
    let BsdfDesc::Principled(paint) = inner(&desc, map.bump.bsdf) else { panic!("{:?}", desc.bsdfs) };
    let lobes = paint.lobes;
    assert_eq!(
        [lobes.roughness, lobes.sheen, lobes.clearcoat, lobes.clearcoat_gloss, lobes.anisotropic, lobes.eta],
        [0.3, 0.2, 0.7, 0.9, 0.4, 1.4]
    );
    assert_eq!(paint.textures.len(), 1);

    let Loaded { desc, warnings } = square("shines", "Kd 0 0 0\nmap_Ke a.png\nKe 3 3 3\n");
    assert!(warnings.is_empty(), "{warnings:?}");
    assert!(desc.shapes[0].emission_profile.texture.is_some());
    assert!((desc.shapes[0].emission.as_ref().unwrap().reflected_rgb()[0] - 3.0).abs() < 1e-3);

    let Loaded { desc, warnings } =
        square("coat", "Kd 1 1 1\nNs 98\nmap_Ks a.png\nmap_bump -bm 2 a.png\nTr 0.25\n");
    assert!(warnings.is_empty(), "{warnings:?}");
    let BsdfDesc::Mask(mask) = only(&desc) else { panic!("{:?}", only(&desc)) };
    assert!((mask.opacity.mean_scalar() - 0.75).abs() < 1e-6);
    let BsdfDesc::BumpMap(bump) = inner(&desc, mask.bsdf) else { panic!("{:?}", desc.bsdfs) };
    assert!((bump.scale - 2.0 * 0.01 * 8.0_f32.sqrt()).abs() < 1e-6, "{}", bump.scale);
    let BsdfDesc::RoughPlastic(coat) = inner(&desc, bump.bump.bsdf) else { panic!("{:?}", desc.bsdfs) };
    assert!(coat.specular_reflectance.varies());

    let loaded = square(
        "told",
        "map_Ns a.png\nrefl -type sphere a.png\ndisp a.png\nTf 0 1 0\nmap_Kd -mm 0.5 1 no.png\n",
    );
    let told = messages(&loaded).join("\n");
    for word in ["map_Ns", "refl", "disp", "Tf", "no.png"] {
        assert!(told.contains(word), "{word}: {told}");
    }
    assert_eq!(loaded.warnings.len(), 2, "{told}");
}
