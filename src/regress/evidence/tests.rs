use super::*;
use crate::math::random::Random;
use crate::regress::statistics::areas::mean_and_variance;
use crate::regress::statistics::synthetic::{
    SyntheticScene, evidence, gamma, log_normal, rendering, sixteen_samples,
};

/// A folder that is removed at the end.
fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a folder")
}

/// Writes a picture as any program does, with these further channels.
fn written(path: &Path, pixels: &Grid<[f32; 3]>, more: &[(&str, f32)]) -> Picture {
    let mut layers = Layers { width: pixels.width(), height: pixels.height(), ..Layers::default() };
    for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
        layers.push(name, pixels.pixels().iter().map(|rgb| rgb[c]));
    }
    for (name, value) in more {
        layers.push(name, pixels.pixels().iter().map(|_| *value));
    }
    exr::write(path, &layers).expect("written");
    Picture::read(path, None).expect("read")
}

#[test]
fn renderings_are_summed_up() {
    let folder = folder();
    let grid = |value: f32, width: usize| Grid::try_filled(width, 10, [value, 2.0, 3.0]).expect("memory");
    let mut broken = grid(5.0, 12);
    broken.row_mut(9)[11] = [f32::NAN; 3];
    let path = |i: usize| folder.path().join(format!("{i}.exr"));
    let pictures = [grid(1.0, 12), grid(3.0, 12), broken].map(|pixels| written(&path(0), &pixels, &[]));
    let all = Evidence::of_pictures(&pictures).expect("one size");
    assert_eq!((all.renderings, all.mean.at(0, 0)), (3, [3.0, 2.0, 3.0]));
    // Variance of 1, 3, 5 is 4.
    assert!((all.variance.at(0, 0)[0] - 4.0 / 3.0).abs() < 1e-6 && all.variance.at(0, 0)[1] == 0.0);
    assert!(all.mean.at(11, 9)[0].is_nan() && all.mean.at(11, 8)[0] == 3.0);
    assert_eq!(all.areas, [1.0, 3.0, 5.0].map(|v| vec![[v, 2.0, 3.0]; 4]));
    assert!(all.hashes[0] != all.hashes[1] && all.hashes.iter().all(|hash| hash.len() == 32));
    let again = Evidence::of_pictures(&[pictures[0].clone(), pictures[0].clone()]).expect("one size");
    assert_eq!(again.hashes, [all.hashes[0].clone(), all.hashes[0].clone()]);
    let other = written(&path(1), &grid(1.0, 13), &[]);
    let refused = Evidence::of_pictures(&[pictures[0].clone(), other]);
    assert!(matches!(refused, Err(ImageError::Size { a: (12, 10), b: (13, 10) })));
    assert!(Evidence::of_pictures(&[]).is_err());
}

#[test]
fn single_pictures_have_the_variances_that_are_given_or_estimated() {
    let folder = folder();
    let path = folder.path().join("single.exr");
    let mut random = Random(3);
    let pixels = rendering(&SyntheticScene::new(32).expected(), gamma, &mut random);
    let of = |more: &[(&str, f32)]| {
        let picture = written(&path, &pixels, more);
        let single = Evidence::of_single(&path).expect("read");
        assert_eq!((single.renderings, single.areas.len(), &single.mean), (1, 0, &picture.rgb));
        single
    };
    let given = of(&[("variance.R", 0.1), ("variance.G", 0.2), ("variance.B", 0.3), ("variance.Y", 9.0)]);
    assert_eq!(given.variance.at(7, 7), [0.1, 0.2, 0.3]);
    let luminance = of(&[("variance.Y", 0.25)]).variance;
    assert!(luminance.pixels().iter().flatten().all(|v| *v >= 0.25 - 1e-6));
    // A red pixel of the disc is .7 / .3 as bright in red as in luminance.
    let red = luminance.at(19, 16)[0];
    assert!(red > 0.25 * 4.0, "{red}");
    let estimated = of(&[]).variance;
    let noise = estimated.at(19, 16)[0].sqrt();
    assert!((0.02..2.0).contains(&noise), "{noise}");
}

/// A folder of 100 references of 256×256 pixels takes less than 30 MB, also by the default of 32 renderings.
#[test]
fn references_come_back_and_are_small() {
    let folder = folder();
    let path = folder.path().join("reference.exr");
    let expected = SyntheticScene::new(256).expected();
    let attributes = [("reason", "a better sky"), ("owner", "nobody")]
        .map(|(name, value)| (name.to_owned(), value.to_owned()));
    let noisy = rendering(&expected, sixteen_samples, &mut Random(1));
    let pixels = noisy.pixels().iter().zip(expected.pixels()).filter(|(_, expected)| expected[1] > 0.0);
    let (_, relative) =
        mean_and_variance(pixels.map(|(a, b)| f64::from(a[1] / b[1])).collect::<Vec<_>>().into_iter());
    assert!((0.029..0.033).contains(&relative), "relMSE of one rendering: {relative}");
    for renderings in [8, 32] {
        let mut all = evidence(&expected, renderings, sixteen_samples, &mut Random(2));
        all.mean.row_mut(7)[9] = [f32::INFINITY; 3];
        all.variance.row_mut(7)[9] = [f32::NAN; 3];
        all.write(&path, &attributes).expect("written");
        let bytes = std::fs::metadata(&path).expect("a file").len();
        println!("reference of 256×256 pixels from {renderings} renderings: {bytes} bytes");
        assert!(bytes < 300_000, "{bytes} bytes from {renderings} renderings");
        let (read, found) = Evidence::read(&path).expect("a reference");
        assert_eq!(found.len(), 2);
        assert!(attributes.iter().all(|attribute| found.contains(attribute)), "{found:?}");
        assert_eq!((read.renderings, &read.hashes), (all.renderings, &all.hashes));
        assert_eq!(read.mean.at(9, 7), [f32::INFINITY; 3]);
        let [mut after, mut before] = [0.0; 2];
        for i in (0..read.mean.pixels().len()).filter(|i| *i != 7 * 256 + 9) {
            let [a, b] = [&all, &read].map(|e| (e.mean.pixels()[i], e.variance.pixels()[i]));
            for c in 0..3 {
                // The variance that is kept may be 6 % less than that of which the error was rounded to half.
                assert!((a.0[c] - b.0[c]).abs() <= 0.26 * b.1[c].sqrt(), "pixel {i}: {a:?} {b:?}");
                assert!(b.1[c] >= 0.23 * a.1[c], "pixel {i}: {a:?} {b:?}");
                before += f64::from(a.1[c]);
                after += f64::from(b.1[c]);
            }
        }
        // Rounding adds 2.1 % at most, and pixels that stand out are in the means of their blocks, too.
        assert!((0.99..1.04).contains(&(after / before)), "variances add to {} of before", after / before);
        assert_eq!(read.areas.len(), renderings);
        let variance = |e: &Evidence, area: usize| {
            mean_and_variance(e.areas.iter().map(|areas| f64::from(areas[area][1]))).1
        };
        let [mut after, mut before] = [0.0; 2];
        for area in 0..1024 {
            let spread = variance(&all, area).sqrt();
            before += variance(&all, area);
            after += variance(&read, area);
            for (a, b) in all.areas.iter().zip(&read.areas) {
                let difference = f64::from(a[area][1] - b[area][1]).abs();
                assert!(difference <= 0.251 * spread, "area {area}: {difference}");
            }
        }
        let ratio = after / before;
        assert!((0.98..1.03).contains(&ratio), "variances of areas add to {ratio} of before");
    }
}

/// Other programs show `R`, `G`, `B` as half floats, and nothing is lost by it.
#[test]
fn values_without_noise_come_back_exactly() {
    let folder = folder();
    let path = folder.path().join("reference.exr");
    let mut all = evidence(&SyntheticScene::new(40).expected(), 8, gamma, &mut Random(4));
    for y in 8..12 {
        all.mean.row_mut(y)[20..24].fill([0.3, 1e6, 1e-9]);
        all.variance.row_mut(y)[20..24].fill([0.0; 3]);
    }
    all.write(&path, &[]).expect("written");
    let (read, _) = Evidence::read(&path).expect("a reference");
    assert_eq!((read.mean.at(21, 9), read.variance.at(21, 9)), ([0.3, 1e6, 1e-9], [0.0; 3]));
    assert_eq!(Evidence::of_single(&path).expect("a picture").mean, read.mean);
    let layers = exr::read(&path).expect("a file");
    let [red, green] = ["R", "G"].map(|name| layers.channel(name).expect("a channel")[9 * 40 + 21]);
    assert!((red - 0.3).abs() < 1e-4 && red != 0.3 && green == 65504.0, "{red} {green}");
}

#[test]
fn pictures_with_variances_alone_are_references_and_others_are_refused() {
    let folder = folder();
    let path = folder.path().join("plain.exr");
    let pixels = SyntheticScene::new(16).expected();
    written(&path, &pixels, &[("variance.R", 0.25), ("variance.G", 0.5), ("variance.B", 1.0)]);
    let (read, attributes) = Evidence::read(&path).expect("a reference");
    assert_eq!((read.renderings, read.areas.len(), attributes.len()), (1, 0, 0));
    assert_eq!(read.mean.pixels(), pixels.pixels());
    assert!(read.variance.pixels().iter().all(|variance| *variance == [0.25, 0.5, 1.0]));
    written(&path, &pixels, &[("variance.R", 0.0)]);
    let refused = Evidence::read(&path).expect_err("it has no variances");
    assert!(refused.to_string().contains("variance.G"), "{refused}");
    let missing = Evidence::read(&folder.path().join("missing.exr")).expect_err("there is none");
    assert!(matches!(missing, ImageError::Read { .. }), "{missing}");
}

#[test]
fn references_with_cut_areas_and_attributes_without_names_are_refused() {
    let folder = folder();
    let path = folder.path().join("reference.exr");
    let expected = SyntheticScene::new(24).expected();
    let all = evidence(&expected, 12, log_normal, &mut Random(2));
    assert!(all.write(&path, &[(String::new(), "x".to_owned())]).is_err());
    let twice = ("reason".to_owned(), "x".to_owned());
    assert!(all.write(&path, &[twice.clone(), twice]).is_err());
    all.write(&path, &[]).expect("written");
    let mut layers = exr::read(&path).expect("read");
    let area_means = layers.attributes.iter().position(|(name, _)| name == AREA_MEANS).expect("areas");
    for (value, told) in [
        (Some(Attribute::Bytes(vec![1, 2, 3])), "12 renderings"),
        (None, "`pointillist regress update` renders it anew"),
    ] {
        match value {
            Some(value) => layers.attributes[area_means].1 = value,
            None => drop(layers.attributes.remove(area_means)),
        }
        exr::write(&path, &layers).expect("written");
        let refused = Evidence::read(&path).expect_err("the areas are cut, or missing");
        assert!(refused.to_string().contains(told), "{refused}");
    }
}
