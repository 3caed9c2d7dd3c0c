//! Pictures of any size that need no encoder.

/// A square BMP file of this grey, 24 bits per pixel.
pub fn grey_bmp(side: u32, grey: u8) -> Vec<u8> {
    let data = 3 * side * side;
    let mut bytes = b"BM".to_vec();
    for number in [54 + data, 0, 54, 40, side, side, 1 | 24 << 16, 0, data, 2835, 2835, 0, 0] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.resize(54 + data as usize, grey);
    bytes
}
