//! Tests of `client::stereo`.

use pointillist::client::{ColorOutput, DisplayImage, Settings, stereo};
use pointillist::image::stereo::{StereoError, StereoLayout};

#[test]
fn displayed_pictures_are_composed_in_the_encoding_of_the_settings() {
    let eye = |value| DisplayImage { width: 2, height: 1, rgb: vec![[value; 3], [0; 3]] };
    let settings = Settings { gamma: 1.0, ..Settings::default() };
    let both = || [eye(100), eye(200)];
    let half = stereo::compose(both(), StereoLayout::SideBySideHalf, &settings).unwrap();
    assert_eq!(half, DisplayImage { width: 2, height: 1, rgb: vec![[50; 3], [100; 3]] });
    for output in [ColorOutput::ScRgb, ColorOutput::Hdr10] {
        let settings = Settings { output, ..settings.clone() };
        let error = stereo::compose(both(), StereoLayout::SideBySide, &settings).unwrap_err();
        let named = ["scRGB", "HDR10"].into_iter().any(|name| error.to_string().ends_with(name));
        assert!(matches!(error, StereoError::Encoding(_)) && named, "{error}");
    }
}
