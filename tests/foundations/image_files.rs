//! Picture files: what is written is read again, the same picture gives the same bytes, a failed write
//! leaves what was there and says what to do, and damaged files are errors, not panics.

use std::fs;
use std::path::{Path, PathBuf};

use pointillist::client::{FilmCounts, FilmData, SplatFilter, develop};
use pointillist::color::Profile;
use pointillist::image::exr::{self, Layers};
use pointillist::image::png::{self, PngPicture, Transfer};
use pointillist::image::write::{FileFormat, check_target};
use pointillist::image::{Attribute, ImageError};
use pointillist::math::random::Random;

/// A folder of this test's own, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("pointillist-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).expect("temporary folder");
        Self(path)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.0).expect("folder");
        entries.map(|e| e.expect("entry").file_name().to_string_lossy().into_owned()).collect()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn layers() -> Layers {
    let mut layers = Layers { width: 37, height: 21, ..Layers::default() };
    for (k, name) in ["R", "G", "B", "camera.X", "camera.W", "variance.Y"].into_iter().enumerate() {
        layers.push(name, (0..37 * 21).map(|i| (i * (k + 1)) as f32 * 0.37 - 5.0));
    }
    for i in 0..20 {
        layers.attributes.push((format!("option{i}"), Attribute::Text(format!("value {i}"))));
    }
    layers.attributes.push(("seed".into(), Attribute::Number(12_345_678_901.0)));
    layers.attributes.push(("scene".into(), Attribute::Text("Szenen/Küche.xml".into())));
    layers
}

#[test]
fn exr_keeps_every_bit() {
    let folder = Folder::new("exr");
    let (path, mut written) = (folder.file("a.exr"), layers());
    written.channels[0].1[..4].copy_from_slice(&[f32::INFINITY, f32::MIN_POSITIVE / 8.0, -0.0, f32::MAX]);
    exr::write(&path, &written).expect("write");
    let read = exr::read(&path).expect("read");
    assert_eq!((read.width, read.height), (37, 21));
    for (name, values) in &written.channels {
        let back = read.channel(name).expect("channel");
        assert!(values.iter().zip(back).all(|(a, b)| a.to_bits() == b.to_bits()), "{name}");
    }
    assert_eq!(read.channels.len(), written.channels.len());
    for (name, value) in &written.attributes {
        assert_eq!(read.attribute(name), Some(value));
    }
    let green = read.channel("G").expect("main layer");
    assert_eq!(green[2 * 37 + 5], written.channels[1].1[2 * 37 + 5]);
    assert_eq!(folder.names(), ["a.exr"], "the temporary file is gone");
}

/// The library's hash map would order the attributes anew in every process and map.
#[test]
fn exr_bytes_are_the_same_every_time() {
    let folder = Folder::new("bytes");
    let bytes: Vec<Vec<u8>> = (0..5)
        .map(|i| {
            let path = folder.file(&format!("{i}.exr"));
            exr::write(&path, &layers()).expect("write");
            fs::read(path).expect("read")
        })
        .collect();
    assert!(bytes.iter().all(|b| *b == bytes[0]));
    // All 20 options in sorted order, as no hash map would leave them.
    let text = String::from_utf8_lossy(&bytes[0][..2000]).into_owned();
    let mut names: Vec<String> = (0..20).map(|i| format!("option{i}\0")).collect();
    names.sort();
    let places: Vec<usize> = names.iter().map(|n| text.find(n.as_str()).expect("attribute")).collect();
    assert!(places.is_sorted());
}

#[test]
fn png_keeps_every_pixel_and_its_attributes() {
    let folder = Folder::new("png");
    let path = folder.file("a.PNG");
    let rgb: Vec<[u8; 3]> = (0..37 * 21).map(|i| [i as u8, (i / 3) as u8, (i / 7) as u8]).collect();
    let attributes = [("Scene".to_owned(), Attribute::Text("Küche".into()))];
    let primaries = Profile::named("rec2020").expect("a known profile").primaries;
    for transfer in [Transfer::Srgb, Transfer::Gamma(2.2)] {
        let picture = PngPicture { width: 37, height: 21, rgb: &rgb, transfer, primaries };
        png::write(&path, picture, &attributes).expect("write");
        let read = image::open(&path).expect("read").into_rgb8();
        assert_eq!((read.width(), read.as_raw().as_slice()), (37, rgb.as_flattened()));
        let bytes = fs::read(&path).expect("file");
        let has = |chunk: &[u8]| bytes.windows(chunk.len()).any(|w| w == chunk);
        assert!(has(b"gAMA") && has("Küche".as_bytes()));
        assert_eq!(has(b"sRGB"), transfer == Transfer::Srgb);
        // x of Rec.2020's red in units of 1e-5.
        assert_eq!(has(&70_800u32.to_be_bytes()), transfer != Transfer::Srgb);
    }
    let short = PngPicture { width: 37, height: 22, rgb: &rgb, transfer: Transfer::Srgb, primaries };
    assert!(matches!(png::write(&path, short, &[]), Err(ImageError::Encode { .. })));
    assert_eq!(image::open(&path).expect("the old picture").height(), 21);
}

/// A link stays a link and its target gets the picture; what is no regular file is not replaced by one.
#[cfg(unix)]
#[test]
fn links_are_followed_and_sockets_are_left_alone() {
    let folder = Folder::new("links");
    fs::write(folder.file("old.exr"), "old").expect("write");
    for (link, target) in [("link.exr", "old.exr"), ("dangling.exr", "new.exr")] {
        std::os::unix::fs::symlink(target, folder.file(link)).expect("link");
        check_target(&folder.file(link)).expect("can be written");
        exr::write(&folder.file(link), &layers()).expect("write");
        assert!(fs::symlink_metadata(folder.file(link)).expect("link").is_symlink());
        assert!(fs::metadata(folder.file(target)).expect("picture").len() > 100);
    }
    std::os::unix::fs::symlink("circle.exr", folder.file("circle.exr")).expect("link");
    assert!(check_target(&folder.file("circle.exr")).is_err());

    // Stands for devices and pipes too: renaming a file over /dev/null breaks a machine.
    let _socket = std::os::unix::net::UnixListener::bind(folder.file("socket.exr")).expect("socket");
    let message = check_target(&folder.file("socket.exr")).expect_err("a socket").to_string();
    assert!(message.contains("no regular file"), "{message}");
    assert!(exr::write(&folder.file("socket.exr"), &layers()).is_err());
    assert!(!fs::symlink_metadata(folder.file("socket.exr")).expect("socket").is_file());
    assert!(folder.names().iter().all(|n| !n.ends_with(".part")), "{:?}", folder.names());
}

#[test]
fn errors_name_the_file_and_what_to_do() {
    let folder = Folder::new("errors");
    let missing = folder.file("nowhere/a.exr");
    let message = exr::write(&missing, &layers()).expect_err("no folder").to_string();
    assert!(message.contains("nowhere") && message.contains("create it"), "{message}");
    assert!(check_target(&missing).is_err());

    let message = check_target(&folder.file("a.tiff")).expect_err("format").to_string();
    assert!(message.contains("a.tiff") && message.contains(".exr or .png"), "{message}");
    assert!(FileFormat::of(Path::new("noextension")).is_err());
    assert_eq!(FileFormat::of(Path::new("b.EXR")).expect("format"), FileFormat::Exr);

    fs::write(folder.file("plain"), "x").expect("write");
    let message = exr::write(&folder.file("plain/a.exr"), &layers()).expect_err("a file").to_string();
    assert!(message.contains("not a folder"), "{message}");

    fs::create_dir(folder.file("b.exr")).expect("folder");
    assert!(check_target(&folder.file("b.exr")).expect_err("a folder").to_string().contains("file name"));
    assert!(exr::write(&folder.file("b.exr"), &layers()).is_err());
    assert!(folder.names().iter().all(|n| !n.ends_with(".part")), "{:?}", folder.names());

    let mut wrong = layers();
    wrong.channels[1].1.pop();
    assert!(matches!(exr::write(&folder.file("c.exr"), &wrong), Err(ImageError::Encode { .. })));
    let mut twice = layers();
    twice.push("R", vec![0.0; 37 * 21]);
    assert!(matches!(exr::write(&folder.file("c.exr"), &twice), Err(ImageError::Encode { .. })));
    assert!(!folder.file("c.exr").exists());
}

/// A device that is always full: the error says so.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_named() {
    let full = fs::OpenOptions::new().write(true).open("/dev/full");
    let Ok(mut full) = full else { return };
    let error = std::io::Write::write_all(&mut full, b"x").expect_err("full");
    let message = ImageError::write(Path::new("a.exr"), error).to_string();
    assert!(message.contains("a.exr") && message.contains("disk is full"), "{message}");
}

#[test]
fn damaged_files_are_errors() {
    let folder = Folder::new("damaged");
    let path = folder.file("a.exr");
    exr::write(&path, &layers()).expect("write");
    let good = fs::read(&path).expect("read");
    let mut random = Random(3);
    for round in 0..300 {
        let mut bad = good.clone();
        let at = random.below(good.len().min(if round % 2 == 0 { 400 } else { usize::MAX }));
        if round % 3 == 0 {
            bad.truncate(at);
        } else {
            bad[at] ^= random.bits() as u8 | 1;
        }
        fs::write(&path, &bad).expect("write");
        if let Err(e) = exr::read(&path) {
            assert!(e.to_string().contains("a.exr"), "{e}");
        }
    }
    for bytes in [&b""[..], b"\x76\x2f\x31\x01", b"P6 1 1 255"] {
        fs::write(&path, bytes).expect("write");
        assert!(matches!(exr::read(&path), Err(ImageError::Decode { .. })));
    }
    assert!(matches!(exr::read(&folder.file("none.exr")), Err(ImageError::Read { .. })));
}

#[test]
fn a_developed_film_can_be_read_back() {
    let counts = FilmCounts { camera_samples: 64, light_samples: 8, camera_paths: 64, light_paths: 16 };
    let data = FilmData {
        width: 2,
        height: 1,
        camera: vec![[4.0, 8.0, 12.0, 4.0], [0.0; 4]],
        light: vec![[8.0, 8.0, 8.0, 4.0], [0.0; 4]],
        camera_variance: vec![6.0, 0.0],
        light_variance: vec![0.0, 0.0],
        luminance_scale: 2.0,
        counts,
    };
    // 2 pixels over 16 light paths: scale 1/8.
    assert_eq!(develop::linear_xyz(&data), [[2.0, 3.0, 4.0], [0.0; 3]]);
    // Camera 6·2²/(4·(4 − 1)) = 2; light 1·(8²/4)/8² = 0.25.
    let variance = develop::mean_variance(&data, SplatFilter::Box.energy());
    assert_eq!(variance[0], 2.25);
    assert_eq!(variance[1], f32::INFINITY);

    let folder = Folder::new("develop");
    let path = folder.file("a.exr");
    let seed = [("seed".to_owned(), Attribute::Number(5.0))];
    exr::write(&path, &develop::layers(&data, &Profile::srgb(), 1.0, &seed)).expect("write");
    let read = exr::read(&path).expect("read");
    assert_eq!(read.channel("camera.W"), Some(&[4.0, 0.0][..]));
    assert_eq!(read.channel("light.Y"), Some(&[8.0, 0.0][..]));
    assert_eq!(read.attribute("lightPaths"), Some(&Attribute::Number(16.0)));
    assert_eq!(read.attribute("seed"), Some(&Attribute::Number(5.0)));
}
