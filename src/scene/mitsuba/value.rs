//! Numbers as the format writes them. Everything returned is finite and fits single precision.

use glam::DVec3;

use crate::scene::diagnostic::shorten;

pub(crate) fn number(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let value: f64 = text.parse().map_err(|_| format!("`{}` is not a number", shorten(text)))?;
    if !value.is_finite() || value.abs() > f64::from(f32::MAX) {
        return Err(format!("`{}` is not a finite number of single precision", shorten(text)));
    }
    Ok(value)
}

/// Numbers between commas and blanks.
pub(crate) fn numbers(text: &str) -> Result<Vec<f64>, String> {
    text.split(|c: char| c == ',' || c.is_whitespace()).filter(|t| !t.is_empty()).map(number).collect()
}

pub(crate) fn integer(text: &str) -> Result<i64, String> {
    text.trim().parse().map_err(|_| format!("`{}` is not an integer", shorten(text)))
}

pub(crate) fn boolean(text: &str) -> Result<bool, String> {
    match text.trim().to_ascii_lowercase().as_str() {
        "true" => Ok(true),
        "false" => Ok(false),
        _ => Err(format!("`{}` is neither true nor false", shorten(text))),
    }
}

/// Three numbers, or one that stands for all three.
pub(crate) fn triple(text: &str) -> Result<DVec3, String> {
    match numbers(text)?.as_slice() {
        [v] => Ok(DVec3::splat(*v)),
        [x, y, z] => Ok(DVec3::new(*x, *y, *z)),
        other => Err(format!("one or three numbers are wanted, these are {}", other.len())),
    }
}

/// A linear colour: one number, three, or `#rrggbb` (sRGB, which is decoded).
pub(crate) fn rgb(text: &str) -> Result<[f64; 3], String> {
    if text.trim_start().starts_with('#') { srgb(text) } else { triple(text).map(|v| v.to_array()) }
}

/// A linear colour, from one number, three, or `#rrggbb` on the sRGB curve (IEC 61966-2-1).
pub(crate) fn srgb(text: &str) -> Result<[f64; 3], String> {
    let encoded = match text.trim().strip_prefix('#') {
        None => triple(text)?.to_array(),
        Some(hex) => {
            let code = (hex.len() == 6).then(|| u32::from_str_radix(hex, 16).ok()).flatten();
            let code = code.ok_or("a colour in hexadecimal has six digits, as #ff8000")?;
            [16, 8, 0].map(|shift| f64::from(code >> shift & 255) / 255.0)
        }
    };
    Ok(encoded.map(|v| if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }))
}

/// A temperature in kelvin, `5000` or `5000K`.
pub(crate) fn kelvin(text: &str) -> Result<f64, String> {
    let text = text.trim();
    number(text.strip_suffix(['K', 'k']).unwrap_or(text))
}

/// `wavelength:value` pairs between commas and blanks, in nm.
pub(crate) fn wavelength_list(text: &str) -> Result<Vec<(f64, f64)>, String> {
    let tokens = text.split(|c: char| c == ',' || c.is_whitespace()).filter(|t| !t.is_empty());
    let pair = |t: &str| {
        let wanted = || format!("`{}` is not wavelength:value", shorten(t));
        let (l, v) = t.split_once(':').ok_or_else(wanted)?;
        Ok((number(l)?, number(v)?))
    };
    tokens.map(pair).collect()
}

/// A table of wavelengths in nm and values, two to a line; `#` starts a comment. The error comes with its line.
pub(crate) fn wavelength_table(text: &str) -> Result<Vec<(f64, f64)>, (usize, String)> {
    let mut points = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default();
        match numbers(line).map_err(|e| (i + 1, e))?.as_slice() {
            [] => {}
            [l, v] => points.push((*l, *v)),
            other => {
                let message = format!("a line has a wavelength and a value, not {} numbers", other.len());
                return Err((i + 1, message));
            }
        }
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_finite_or_refused() {
        assert_eq!(number(" 1.5 "), Ok(1.5));
        for bad in ["nan", "inf", "-inf", "1e39", "1e999", "", "1.5f", "0x10", "1,5", "--1"] {
            assert!(number(bad).is_err(), "{bad}");
        }
        assert_eq!(numbers("1, 2\n3,,4 "), Ok(vec![1.0, 2.0, 3.0, 4.0]));
        assert!(integer("3.0").is_err() && integer("99999999999999999999").is_err());
        assert_eq!(boolean("True"), Ok(true));
        assert!(boolean("1").is_err());
    }

    #[test]
    fn colours() {
        assert_eq!(rgb("0.5"), Ok([0.5; 3]));
        assert_eq!(rgb("0.1, 0.2 0.3"), Ok([0.1, 0.2, 0.3]));
        let grey = rgb("#808080").expect("six digits")[0];
        assert!((grey - 0.215_860_5).abs() < 1e-6, "{grey}"); // sRGB 128/255
        assert_eq!(srgb("#808080"), rgb("#808080"));
        assert!((srgb("0.5").expect("one number")[2] - 0.214_041_1).abs() < 1e-6 && srgb("0.04 0").is_err());
        assert_eq!((kelvin("5000K"), kelvin(" 20.5 ")), (Ok(5000.0), Ok(20.5)));
        assert!(kelvin("K").is_err() && kelvin("50KK").is_err());
        assert!(
            rgb("#fff").is_err() && rgb("#gggggg").is_err() && rgb("#é12345").is_err() && rgb("1 2").is_err()
        );
    }

    #[test]
    fn spectra() {
        assert_eq!(
            wavelength_list("400:1, 500:2.5 600:0"),
            Ok(vec![(400.0, 1.0), (500.0, 2.5), (600.0, 0.0)])
        );
        assert!(wavelength_list("400").is_err() && wavelength_list("400:1:2").is_err());
        assert_eq!(wavelength_table("# nm\n400 1\n\n500 2 # peak\n"), Ok(vec![(400.0, 1.0), (500.0, 2.0)]));
        assert_eq!(wavelength_table("400 1\n500\n").map_err(|e| e.0), Err(2));
    }
}
