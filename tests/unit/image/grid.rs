//! Tests of `image::grid`.

use pointillist::image::grid::*;

#[test]
fn rows_come_from_the_top() {
    let grid = Grid::from_rows(2, 3, vec![0, 1, 2, 3, 4, 5]).expect("6 pixels");
    assert_eq!(grid.row(1), [2, 3]);
    assert_eq!(grid.at(1, 2), 5);
    assert_eq!(Grid::from_rows(2, 2, vec![0; 3]), None);
    assert!(Grid::try_filled(usize::MAX, 2, 0u8).is_none());
    assert!(Grid::try_filled(1 << 30, 1 << 30, 0u8).is_none());
}
