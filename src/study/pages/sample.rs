//! A made-up study for the tests: three methods and another program on a scene with glass.

use crate::study::Interval;
use crate::study::data::*;
use crate::study::measurement::FIGURES;

/// A grey pixel.
pub const PIXEL: &str = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGNoAAAAggCBd81ytgAAAABJRU5ErkJggg==";

fn near(value: f64, spread: f64) -> Interval {
    Interval { value, low: value / (1.0 + spread), high: value * (1.0 + spread) }
}

/// A curve `error · t^slope` at 2, 4 … 32 s, and its prices.
fn method(name: &str, error: f64, slope: f64, per_second: f64) -> MethodResult {
    let point = |i: i32| {
        let seconds = 2f64.powi(i);
        let rms = error * seconds.powf(slope) * (1.0 + 0.03 * f64::from((i * 7) % 3 - 1));
        CurvePoint {
            stated: None,
            budget: seconds,
            seconds: seconds * 1.01,
            trace_seconds: seconds * 14.0,
            splat_seconds: seconds * 0.2,
            display_seconds: 0.012,
            samples_per_pixel: per_second * seconds,
            runs: 8,
            rel_mse: Some(near(rms * rms, 0.15)),
            rel_mse_trimmed: Some(near(0.7 * rms * rms, 0.12)),
            noise: Some(near(rms * rms, 0.2)),
            bias: Some(Interval { value: 0.0, low: -0.05 * rms * rms, high: 0.05 * rms * rms }),
            relative: Some([near(0.5 * rms, 0.05), near(1.2 * rms, 0.08), near(2.0 * rms, 0.15)]),
            smape: Some(near(0.4 * rms, 0.1)),
            flip: Some(near(0.8 * rms, 0.1)),
            flip_filtered: Some(near(0.5 * rms, 0.1)),
            picture: None,
        }
    };
    let price = |e: f64| {
        let seconds = (e / (1.2 * error)).powf(1.0 / slope);
        TimeToError { error: e, seconds: Some(near(seconds, 0.12)), measured: seconds < 32.0 }
    };
    let mut points: Vec<CurvePoint> = (1..=5).map(point).collect();
    for (point, seconds) in points.iter_mut().zip(FIGURES) {
        (point.budget, point.picture) = (seconds, Some(PIXEL.into()));
    }
    MethodResult {
        name: name.into(),
        points,
        slope: Some(Interval { value: slope, low: slope - 0.02, high: slope + 0.02 }),
        slope_samples: Some(Interval { value: slope - 0.01, low: slope - 0.03, high: slope + 0.01 }),
        prices: [0.05, 0.02, 0.01, 0.005].map(price).to_vec(),
        efficiency: Some(near(1.0 / (error * error), 0.2)),
        picture: Some(PIXEL.into()),
        error_map: Some(PIXEL.into()),
        ..MethodResult::default()
    }
}

fn methods() -> Vec<MethodResult> {
    let mut photon = method("photon", 0.035, -0.33, 9.0);
    photon.flags = vec!["slope flatter than −0.4: heavy tail or bias".into()];
    for p in &mut photon.points {
        p.bias = Some(near(0.7 * p.rel_mse.unwrap_or_default().value, 0.3));
        p.noise = Some(near(0.3 * p.rel_mse.unwrap_or_default().value, 0.2));
    }
    if let Some(last) = photon.prices.last_mut() {
        (last.seconds, last.measured) = (None, false);
    }
    let mut mitsuba = method("Mitsuba 3.9.1 path", 0.2, -0.5, 40.0);
    mitsuba.peer = true;
    mitsuba.prices.clear();
    for p in &mut mitsuba.points {
        (p.noise, p.bias, p.relative) = (None, None, None);
    }
    vec![method("path", 0.14, -0.5, 30.0), method("bidirectional", 0.06, -0.5, 18.0), photon, mitsuba]
}

fn effects() -> Vec<EffectPrice> {
    let effect = |name: &str, on, time, variance, loss: Option<f64>| EffectPrice {
        name: name.into(),
        on,
        reason: if on {
            format!("“{name}” is used by an object (scenes/x.xml:40:3)")
        } else {
            "nothing calls for it".into()
        },
        time: Some(near(time, 0.02)),
        variance,
        loss,
        picture: loss.map(|_| PIXEL.into()),
    };
    vec![
        effect("wavelengths", true, 1.227, Some(0.08), Some(0.031)),
        effect("transmission", true, 1.31, Some(0.42), Some(0.12)),
        effect("smooth normals", true, 1.01, Some(-0.01), Some(0.004)),
        effect("dispersion", false, 1.12, None, None),
        effect("lens", false, 1.03, None, None),
    ]
}

fn display() -> Vec<DisplayPrice> {
    let setting = |knob: &str, setting: &str, default, ms, rms: f64, per_sample| DisplayPrice {
        knob: knob.into(),
        setting: setting.into(),
        default,
        milliseconds: Some(near(ms, 0.04)),
        per_sample,
        rel_mse: Some(rms * rms),
        flip: Some(0.6 * rms),
        samples_per_pixel: 4.0,
    };
    let at_four = vec![
        setting("reconstruction", "mips", false, 0.21, 0.14, false),
        setting("reconstruction", "Catmull–Rom", false, 0.48, 0.12, false),
        setting("reconstruction", "windowed Gaussian", true, 0.93, 0.09, false),
        setting("glare", "off", true, 0.93, 0.09, false),
        setting("glare", "photopic", false, 4.1, 0.09, false),
        setting("filter", "1 × 1", true, 3.1, 0.09, true),
        setting("filter", "2 × 2", false, 5.2, 0.08, true),
    ];
    let few = |d: &DisplayPrice| DisplayPrice {
        rel_mse: d.rel_mse.map(|e| 36.0 * e),
        samples_per_pixel: 0.1,
        ..d.clone()
    };
    at_four.iter().map(few).chain(at_four.clone()).collect()
}

/// The study.
pub fn study() -> Study {
    let numeric = |choice: &str, time, error, spread| NumericPrice {
        choice: choice.into(),
        forms: ["f32".into(), "two floats".into()],
        time: near(time, 0.01),
        error: near(error, spread),
        what: "error of the mean after 10⁶ samples per pixel".into(),
    };
    let scheme = |name: &str, used, error, stated| SchemePrice {
        name: name.into(),
        used,
        error: near(error, 0.05),
        stated: near(stated, 0.1),
    };
    let stability = |method: &str, rejected: Vec<(String, u64, String)>| Stability {
        method: method.into(),
        paths: 41_943_040,
        rejected,
        energy: Some(Interval { value: 1.0004, low: 0.9991, high: 1.0017 }),
        alarm: false,
        biased: false,
    };
    let replay = "pointillist render scenes/cornell_spheres.xml --integrator bidirectional --first-index 1234567 --samples 1";
    let winners: Vec<usize> =
        (0..192).map(|i| if (i / 16 > 7 && i % 16 > 9) || i % 29 == 0 { 2 } else { 1 }).collect();
    Study {
        format: 2,
        scene: "scenes/cornell_spheres.xml".into(),
        size: [512, 384],
        machine: Machine {
            cpu: "AMD EPYC 9654 96-Core Processor".into(),
            threads: 16,
            device: "NVIDIA H200".into(),
            driver: "NVIDIA 570.86.15".into(),
            program: "pointillist 0.1.0".into(),
            date: "2026-11-21".into(),
        },
        command: "pointillist study scenes/cornell_spheres.xml --time 600".into(),
        load_seconds: 0.21,
        reference: Some(ReferenceImage {
            relative: [0.0; 3],
            file: "target/references/cornell_spheres.exr".into(),
            made_by: "bidirectional".into(),
            seconds: 1800.0,
            samples_per_pixel: 32768.0,
            luminance: 0.0,
            rel_mse: Some(1.2e-6),
            picture: PIXEL.into(),
        }),
        methods: methods(),
        auto: Some(AutoChoice {
            method: "path".into(),
            reason: "camera paths are fastest".into(),
            seconds: 0.4,
        }),
        dropped: vec![DroppedMethod {
            method: "light".into(),
            reason: "alone cannot show mirrors and glass".into(),
        }],
        trial_size: Some([192, 144]),
        farm: FarmCost { setup: 0.5, merge: 0.05 },
        options: vec![OptionPrice {
            name: "--adaptive".into(),
            method: "bidirectional".into(),
            seconds: 5.0,
            size: [192, 144],
            paths: Some(0.9),
            error: Some(near(0.8, 0.05)),
            flip: Some([0.05, 0.06]),
        }],
        regions: Some(RegionWinners {
            seconds: 32.0,
            grid: [16, 12],
            margin: (0..192).map(|i| 1.0 + f64::from(i % 9) * 0.5).collect(),
            winner: winners,
        }),
        effects: effects(),
        unused_effects: Some(Interval { value: 1.002, low: 0.995, high: 1.009 }),
        display: display(),
        numeric: vec![
            numeric("sums of the film", 1.018, 38.0, 0.2),
            numeric("tone curve", 1.21, 1.003, 0.01),
        ],
        schemes: vec![
            scheme("2 independent randomisations", true, 1.04, 1.01),
            scheme("8 independent randomisations", false, 1.31, 1.0),
        ],
        stated: vec![
            StatedErrors { method: "path".into(), pictures: 12, held: [11, 11, 10], ratio: near(0.99, 0.04) },
            StatedErrors { method: "photon".into(), pictures: 9, held: [5, 8, 7], ratio: near(1.1, 0.1) },
        ],
        predictions: Some(PredictionScore { known: 57, held: 52, open: 3, ratio: 1.04 }),
        stability: vec![
            stability("path", vec![]),
            stability("bidirectional", vec![("not a number in the connection".into(), 2, replay.into())]),
        ],
        missing: vec!["display: variance on and off".into()],
    }
}
