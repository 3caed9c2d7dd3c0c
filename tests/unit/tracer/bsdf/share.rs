//! Tests of `tracer::bsdf::share`.

use pointillist::scene::desc::texture::{SpectrumTexture, TexturePoint};
use pointillist::spectrum::Spectrum;
use pointillist::tracer::bsdf::SurfaceShare;

/// Parts of parts are products, and what is left of a part completes it.
#[test]
fn shares_are_products() {
    let texture = |v: f32| SpectrumTexture::from(Spectrum::Constant(v));
    let at = TexturePoint::default();
    let half = SurfaceShare::from(0.5);
    for (share, expected) in [
        (half.of(&texture(0.25)), 0.125),
        (half.rest_of(&texture(0.25)), 0.375),
        (SurfaceShare::ALL.of(&texture(0.7)).rest_of(&texture(0.4)), 0.42),
        (half.of(&texture(3.0)), 0.5),
    ] {
        assert!(
            (share.at(&at) - expected).abs() < 1e-6 && !share.is_none(),
            "{} not {expected}",
            share.at(&at)
        );
    }
    assert!(half.of(&texture(0.0)).is_none() && half.rest_of(&texture(1.0)).is_none());
}
