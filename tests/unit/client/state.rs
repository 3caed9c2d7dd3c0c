//! Tests of `client::state`.

use pointillist::client::settings::{CHUNK_SAMPLES, FilmCounts, FilmSpec};
use pointillist::client::state::*;
use pointillist::color::Xyz;
use pointillist::stream::{PathCounts, Sample};

#[test]
fn batches_and_scale() {
    let spec = FilmSpec {
        width: 8,
        height: 8,
        filter: Default::default(),
        variance: Some(Default::default()),
        sums: Default::default(),
    };
    let mut state = FilmState::new(spec).expect("a film");
    let grey = |y: f32, w: f32| Sample { uv: [0.5; 2], xyz: Xyz::new(y, y, y), w };
    assert!(!state.start_raster() && !state.take(&grey(f32::NAN, 1.0)) && !state.take(&grey(1e32, 1.0)));
    // A black batch, then one of mean 6.
    assert!(state.take(&grey(0.0, 1.0)) && state.start_raster());
    assert_eq!(state.scale(), 1.0);
    assert!(state.take(&grey(4.0, -1.0)) && state.take(&grey(16.0, 2.0)) && state.start_raster());
    assert_eq!((state.scale(), state.samples()), (4.0, [2, 1]));
    for _ in 1..CHUNK_SAMPLES {
        state.take(&grey(1e9, 1.0));
    }
    assert!(!state.is_full() && state.take(&grey(1e9, 1.0)) && state.is_full());
    assert!(state.start_raster() && !state.is_full() && state.scale() == 4.0);
    // Paths of any number, as a stream may claim them.
    for _ in 0..2 {
        state.count_paths(PathCounts { camera: u64::MAX, light: u64::MAX });
    }
    assert_eq!((state.counts().camera_paths, state.counts().light_paths), (u64::MAX, u64::MAX));
    state.clear();
    assert_eq!(
        (state.counts(), state.scale(), state.lods(state.samples())),
        (FilmCounts::default(), 1.0, [None, None])
    );
}
