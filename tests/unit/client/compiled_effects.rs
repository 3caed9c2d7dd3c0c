//! Tests of `client::compiled_effects`.

use pointillist::client::compiled_effects::*;
use pointillist::client::settings::{DisplayView, Settings};

#[test]
fn coarse_glare_takes_the_picture_along() {
    let plain = Settings::default();
    let glare = Settings { glare: Some(Default::default()), ..plain.clone() };
    for detail in DETAILS {
        assert_eq!(Effects::with_glare_at(&plain, detail, 2), Effects::new(&plain, detail));
    }
    let of = |detail| Effects::with_glare_at(&glare, detail, 2);
    assert_eq!([1, 2, 4].map(|d| (of(d).detail, of(d).glare)), [(2, true), (2, true), (4, false)]);
    assert_eq!([1, 2].map(|d| Effects::new(&glare, d).glare), [true, false]);
    let of = |detail, coarse| Effects::with_glare_at(&glare, detail, coarse);
    assert_eq!([1, 2, 4].map(|d| of(d, 1)), [1, 2, 4].map(|d| Effects::new(&glare, d)));
    assert_eq!([1, 2, 4].map(|d| (of(d, 4).detail, of(d, 4).glare)), [(4, true); 3]);
    let error = Settings { view: DisplayView::CameraVariance, ..glare.clone() };
    assert_eq!(Effects::with_glare_at(&error, 1, 2), Effects::new(&error, 1));
}
