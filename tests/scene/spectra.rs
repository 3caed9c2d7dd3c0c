//! Spectra as files write them; the values are those of Mitsuba 3.9.1 (`scalar_spectral`).

use pointillist::scene::{SceneError, load_str};
use pointillist::spectrum::Spectrum;

fn try_radiance(text: &str) -> Result<Spectrum, SceneError> {
    let scene = format!(
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"/>\
         <shape type=\"disk\"><emitter type=\"area\">{text}</emitter></shape></scene>"
    );
    let loaded = load_str("t.xml", &scene, &[])?;
    assert!(loaded.warnings.is_empty(), "{text}: {:?}", loaded.warnings);
    Ok(loaded.desc.shapes[0].emission.clone().unwrap())
}

fn radiance(inner: &str) -> Spectrum {
    try_radiance(inner).unwrap_or_else(|e| panic!("{inner}: {e:?}"))
}

fn assert_values(spectrum: &Spectrum, values: &[(f32, f32)], tolerance: f32) {
    for &(nm, wanted) in values {
        let found = spectrum.eval(glam::Vec4::splat(nm)).x;
        assert!((found - wanted).abs() <= tolerance * wanted, "{nm} nm: {found}, wanted {wanted}");
    }
}

#[test]
fn black_bodies() {
    let body =
        |inner: &str| radiance(&format!("<spectrum name=\"radiance\" type=\"blackbody\">{inner}</spectrum>"));
    let of = |kelvin: &str| body(&format!("<float name=\"temperature\" value=\"{kelvin}\"/>"));
    assert_values(
        &of("3000"),
        &[(360.0, 32.265_568), (450.0, 151.821_72), (550.0, 386.542_33), (829.0, 937.592_53)],
        1e-4,
    );
    assert_values(&of("6500"), &[(360.0, 42_172.73), (450.0, 47_511.676), (700.0, 31_327.096)], 1e-4);
    assert_values(&of("1000"), &[(360.0, 8.657_388e-11), (700.0, 8.393_093_4e-4)], 2e-3);
    // As a texture, and in a part of the spectrum.
    let red = "<float name=\"temperature\" value=\"5000\"/><float name=\"wavelength_min\" value=\"500\"/>";
    let values = [(400.0, 0.0), (499.0, 0.0), (550.0, 12_712.999), (829.0, 9_758.471)];
    assert_values(&body(red), &values, 1e-4);
    let texture = format!("<texture name=\"radiance\" type=\"blackbody\">{red}</texture>");
    assert_values(&radiance(&texture), &values, 1e-4);
    for kelvin in ["0", "-1", "2e9", "nan", "1e-300"] {
        let read = try_radiance(&format!(
            "<spectrum name=\"radiance\" type=\"blackbody\"><float name=\"temperature\" value=\"{kelvin}\"/></spectrum>"
        ));
        // The coldest is black, and no fault.
        assert!(read.is_err() || read.is_ok_and(|s| kelvin == "1e-300" && s.is_black()), "{kelvin}");
    }
    for wrong in [
        "<spectrum name=\"radiance\" type=\"blackbody\"/>",
        "<spectrum name=\"radiance\" type=\"blackbody\"><float name=\"temperature\" value=\"9\"/><float name=\"wavelength_min\" value=\"900\"/></spectrum>",
        "<blackbody name=\"radiance\" temperature=\"K\"/>",
        "<blackbody name=\"radiance\" temperature=\"0\"/>",
        "<blackbody name=\"radiance\" temperature=\"5000\" scale=\"-1\"/>",
        "<blackbody name=\"radiance\"/>",
    ] {
        assert!(try_radiance(wrong).is_err(), "{wrong}");
    }
}

#[test]
fn colours_of_spectrum_plugins() {
    let color = "<rgb name=\"color\" value=\"1 .5 .2\"/>";
    let lamp = radiance(&format!(
        "<spectrum name=\"radiance\" type=\"d65\">{color}<float name=\"scale\" value=\"2\"/></spectrum>"
    ));
    let values = [(400.0, 0.260_592), (450.0, 0.545_216), (550.0, 1.120_744_7), (700.0, 1.896_712_4)];
    assert_values(&lamp, &values, 0.02);
    let srgb = radiance(&format!("<spectrum name=\"radiance\" type=\"srgb\">{color}</spectrum>"));
    assert_eq!(srgb, Spectrum::reflectance_rgb([1.0, 0.5, 0.2]));
    assert_eq!(
        radiance(
            "<spectrum name=\"radiance\" type=\"rawconstant\"><float name=\"value\" value=\"2\"/></spectrum>"
        ),
        Spectrum::Constant(2.0)
    );
    assert!(try_radiance("<spectrum name=\"radiance\" type=\"srgb\"/>").is_err());
    assert!(
        try_radiance(
            "<spectrum name=\"radiance\" type=\"d65\"><rgb name=\"color\" value=\"-1 0 0\"/></spectrum>"
        )
        .is_err()
    );
}

/// Equal steps and free steps, zero outside.
#[test]
fn tables() {
    let regular = "<spectrum name=\"radiance\" type=\"regular\"><float name=\"wavelength_min\" value=\"400\"/>\
                   <float name=\"wavelength_max\" value=\"600\"/><string name=\"values\" value=\"1 2 4\"/></spectrum>";
    let irregular = "<spectrum name=\"radiance\" type=\"irregular\"><string name=\"wavelengths\" value=\"400, 500\"/>\
                     <string name=\"values\" value=\"1, 2\"/></spectrum>";
    assert_values(
        &radiance(regular),
        &[(360.0, 0.0), (400.0, 1.0), (450.0, 1.5), (550.0, 3.0), (700.0, 0.0)],
        1e-6,
    );
    assert_values(&radiance(irregular), &[(360.0, 0.0), (400.0, 1.0), (450.0, 1.5), (550.0, 0.0)], 1e-6);
    assert_eq!(radiance("<spectrum name=\"radiance\" value=\"400:1 500:2\"/>"), radiance(irregular));
}

/// An `.spd` file: two columns, comments; a fault in it is told with its line.
#[test]
fn files() {
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("spectra.spd");
    let named = format!("<spectrum name=\"radiance\" filename=\"{}\"/>", path.display());
    std::fs::write(&path, "# nm value\n400 1.0\n\n500\t2.0 # peak\n").unwrap();
    assert_eq!(radiance(&named), Spectrum::table(&[(400.0, 1.0), (500.0, 2.0)]).unwrap());
    for (text, line) in [("400 1\n500 2 3\n", 2), ("400 1\n500 x\n", 2), ("400 nan\n", 1)] {
        std::fs::write(&path, text).unwrap();
        let error = try_radiance(&named).expect_err(text);
        assert!(error.location().0.ends_with("spectra.spd") && error.location().1 == line, "{error:?}");
    }
    for text in ["", "400 1\n", "500 1\n400 1\n", "400 -1\n500 1\n"] {
        std::fs::write(&path, text).unwrap();
        assert!(try_radiance(&named).is_err(), "{text}");
    }
}
