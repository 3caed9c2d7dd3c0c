//! Tests of `image::data_uri`.

use pointillist::image::data_uri::*;

#[test]
fn jpeg_takes_what_it_can() {
    let grey = [[127; 3]; 6];
    assert!(jpeg(3, 2, &grey).is_some_and(|uri| uri.starts_with("data:image/jpeg;base64,/9j/")));
    assert_eq!(jpeg(3, 3, &grey), None);
    assert_eq!(jpeg(0, 0, &[]), None);
    assert_eq!(jpeg(70_000, 0, &[]), None);
}
