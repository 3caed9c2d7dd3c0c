//! Tests of `image::data_uri`.

use pointillist::image::Grid;
use pointillist::image::data_uri::*;

#[test]
fn jpeg_takes_what_it_can() {
    let grey = [[127; 3]; 6];
    assert!(jpeg(3, 2, &grey).is_some_and(|uri| uri.starts_with("data:image/jpeg;base64,/9j/")));
    assert_eq!(jpeg(3, 3, &grey), None);
    assert_eq!(jpeg(0, 0, &[]), None);
    assert_eq!(jpeg(70_000, 0, &[]), None);
}

#[test]
fn pictures_are_reduced_and_maps_coloured() {
    let wide = Grid::try_filled(1000, 3, [f32::NAN, 0.25, 9.0]).expect("3000 pixels");
    assert!(displayed(&wide, 320, 85).is_some_and(|uri| uri.starts_with("data:image/jpeg;base64,/9j/")));
    assert!(displayed(&wide, 8, 85).map(|uri| uri.len()) < displayed(&wide, 1000, 85).map(|uri| uri.len()));
    assert_eq!(displayed(&Grid::default(), 320, 85), None);
    let map = Grid::from_rows(2, 1, vec![0.0, 1.0]).expect("2 pixels");
    let [dark, light] = [0, 255].map(|grey| false_colors(&map, |_| [grey; 3]));
    assert!(dark.as_ref().is_some_and(|uri| uri.starts_with("data:image/png;base64,")) && dark != light);
}
