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

#[test]
fn a_reduced_grid_joins_every_pixel_once() {
    // Sides of 7 and 5 in squares of 3: those at the border are cut.
    let ones = Grid::try_filled(7, 5, 1).expect("35 pixels");
    let counts = ones.reduced(3, |square| square.iter().sum());
    assert_eq!((counts.width(), counts.height()), (3, 2));
    assert_eq!(counts.pixels(), [9, 9, 3, 6, 6, 2]);
    assert_eq!(ones.reduced(7, |square| square[0]), ones);
    let places = Grid::from_rows(4, 1, vec![0, 1, 2, 3]).expect("4 pixels");
    assert_eq!(places.reduced(2, |square| square[0]).pixels(), [0, 2]);
    assert_eq!(Grid::<u8>::default().reduced(0, |square| square[0]), Grid::default());
}
