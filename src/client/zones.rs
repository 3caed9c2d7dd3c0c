//! Exposure zones: luminance in false colours, a colour for each stop around the middle grey, as lighting artists read a frame.
//!
//! `glsl/include/zones.glsl` has the same figures.

use crate::client::light_meter::MIDDLE_GREY;

/// Number of zones; the middle one holds the middle grey.
pub const ZONES: usize = 13;

/// Display-linear sRGB of each zone, from 6 stops below the middle grey, and darker, to 6 above, and brighter: cold below, grey in the
/// middle, warm above.
pub const ZONE_COLORS: [[f32; 3]; ZONES] = [
    [0.00335, 0.00335, 0.00335],
    [0.01229, 0.00561, 0.06301],
    [0.02956, 0.02029, 0.32314],
    [0.02416, 0.12214, 0.58408],
    [0.02315, 0.34670, 0.46208],
    [0.04971, 0.42327, 0.14996],
    [0.18447, 0.18447, 0.18447],
    [0.39157, 0.55834, 0.05951],
    [0.78354, 0.64448, 0.04231],
    [0.87137, 0.35153, 0.02956],
    [0.80695, 0.12214, 0.02519],
    [0.63760, 0.02315, 0.04519],
    [1.00000, 1.00000, 1.00000],
];

/// Lowest exposed luminance of the second zone: 5.5 stops below −ln(1 − .18), which is displayed as middle grey.
pub const SECOND_ZONE: f32 = 0.004_385_3;

/// The zone of an exposed luminance, 0 for the darkest.
pub fn zone(exposed: f32) -> usize {
    let mut bound = SECOND_ZONE;
    let mut zone = 0;
    for _ in 1..ZONES {
        zone += usize::from(exposed >= bound);
        bound *= 2.0;
    }
    zone
}

/// Stops of a zone relative to middle grey.
pub fn stops(zone: usize) -> i32 {
    zone as i32 - (ZONES / 2) as i32
}

/// The exposed luminance that is displayed as the middle grey by the curve 1 − exp(−Y).
pub fn middle() -> f64 {
    -(1.0 - MIDDLE_GREY).ln()
}

/// Fraction of the brightest colour from which on a colour counts as clipped.
pub const CLIPPED: f32 = 0.995;

/// Display-linear value up to which a colour counts as black.
pub const BLACK: f32 = 1e-5;

/// Marks on clipped and black pixels, display-linear sRGB.
pub const CLIPPED_MARK: [f32; 3] = [1.0, 0.05, 0.02];
/// See [`CLIPPED_MARK`].
pub const BLACK_MARK: [f32; 3] = [0.03, 0.12, 1.0];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_grey_lies_in_the_middle() {
        assert!((f64::from(SECOND_ZONE) / (middle() * 2f64.powf(-5.5)) - 1.0).abs() < 1e-4);
        let grey = middle() as f32;
        for stop in -6..=6 {
            let at = zone(grey * 2f32.powi(stop));
            assert_eq!(stops(at), stop);
        }
        assert_eq!((zone(0.0), zone(f32::INFINITY), zone(f32::NAN)), (0, ZONES - 1, 0));
    }
}
