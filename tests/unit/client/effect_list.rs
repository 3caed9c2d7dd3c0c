//! Tests of `client::effect_list`.

use pointillist::client::effect_list::*;
use pointillist::client::settings::{Denoise, DisplayView, Dither, FilmSpec, Glare, Settings, VarianceForm};

fn on(spec: &FilmSpec, settings: &Settings, streams: [bool; 2]) -> Vec<&'static str> {
    effect_list(spec, settings, streams).into_iter().filter(|d| d.on).map(|d| d.name).collect()
}

const PLAIN: FilmSpec = FilmSpec {
    width: 8,
    height: 8,
    filter: pointillist::client::SplatFilter::Gaussian,
    variance: None,
    sums: pointillist::client::Summation::TwoFloat,
};

#[test]
fn what_is_asked_for_is_on() {
    let always = ["fold", "mips", "reconstruction", "tone-curve", "gamut"];
    let found = on(&PLAIN, &Settings::default(), [true, false]);
    assert_eq!(found, [&["camera-stream"][..], &always].concat());
    let mut all = Settings {
        vm: 1.0,
        denoise: Denoise::Wavelet,
        reproject: true,
        steer: true,
        glare: Some(Glare::default()),
        dither: Dither::Ordered,
        ..Settings::default()
    };
    for post in all.post.effects() {
        all.switch(post.name, true);
    }
    let spec = FilmSpec { variance: Some(VarianceForm::Product), ..PLAIN };
    assert_eq!(on(&spec, &all, [true; 2]).len(), effect_list(&spec, &all, [true; 2]).len());
    for (denoise, reason) in [(Denoise::Wavelet, "--denoise wavelet"), (Denoise::Oidn, "--denoise oidn")] {
        let effects = effect_list(&spec, &Settings { denoise, ..all.clone() }, [true; 2]);
        let filter = effects.iter().find(|effect| effect.name == "noise-filter").unwrap();
        assert!(filter.on && filter.reason.starts_with(reason), "{}", filter.reason);
    }
    let error = Settings { view: DisplayView::CameraVariance, ..all };
    assert_eq!(
        on(&spec, &error, [true, false]),
        ["camera-stream", "fold", "variance", "mips", "reconstruction", "dither"]
    );
}

#[test]
fn switches_switch() {
    let filtered = Settings { denoise: Denoise::Wavelet, ..Settings::default() };
    let effects = effect_list(&PLAIN, &filtered, [true; 2]);
    for ClientEffect { name, on: before, .. } in effects.into_iter().filter(|l| l.can_switch) {
        let mut settings = filtered.clone();
        for wanted in [!before, before] {
            settings.switch(name, wanted);
            assert_eq!(on(&PLAIN, &settings, [true; 2]).contains(&name), wanted, "{name}");
        }
    }
}
