//! Values of options.

use std::path::Path;
use std::time::Duration;

use crate::client::ReconstructionKernel;
use crate::color::{Profile, icc};
use crate::image::stereo::StereoLayout;
use crate::scene;
use crate::scene::desc::aov::{AovDesc, AovKind, AovList};
use crate::scene::light_groups::NamedGroup;

/// Value of `--max-depth`; `None` is unlimited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaxDepth(pub Option<u32>);

/// Value of `--aov`.
#[derive(Clone, Debug)]
pub struct AovArg(pub Vec<AovDesc>);

pub(super) fn aov(list: &str) -> Result<AovArg, String> {
    let AovList { layers, left_out } = scene::desc::aov::parse(list)?;
    match left_out.is_empty() {
        true => Ok(AovArg(layers)),
        false => Err(format!(
            "not supported: {}; the types are {}",
            left_out.join(", "),
            AovKind::names().join(", ")
        )),
    }
}

/// Value of `--light-groups`; no group stands for one for each emitter.
#[derive(Clone, Debug)]
pub struct LightGroupsArg(pub Vec<NamedGroup>);

pub(super) fn light_groups(text: &str) -> Result<LightGroupsArg, String> {
    match text {
        EACH_EMITTER => Ok(LightGroupsArg(Vec::new())),
        _ => scene::light_groups::parse(text).map(LightGroupsArg),
    }
}

/// Value of `--stereo`; `None` for a pair of files.
#[derive(Clone, Copy, Debug)]
pub struct StereoLayoutArg(pub Option<StereoLayout>);

pub(super) fn stereo_layout(text: &str) -> Result<StereoLayoutArg, String> {
    match composed_layout(text) {
        _ if text == "pair" => Ok(StereoLayoutArg(None)),
        Ok(layout) => Ok(StereoLayoutArg(Some(layout))),
        Err(names) => Err(format!("{names} and pair")),
    }
}

pub(super) fn composed_layout(text: &str) -> Result<StereoLayout, String> {
    let names = || StereoLayout::ALL.map(StereoLayout::name).join(", ");
    StereoLayout::named(text).ok_or_else(|| match text == StereoLayout::Swapchain.name() {
        true => format!(
            "only the window of `pointillist view` has layers; the layouts of a picture are {}",
            names()
        ),
        false => format!("the layouts are {}", names()),
    })
}

/// Value of `--stereo` of a window, which may have layers.
pub(super) fn window_layout(text: &str) -> Result<StereoLayout, String> {
    let layers = StereoLayout::Swapchain;
    match text == layers.name() {
        true => Ok(layers),
        false => composed_layout(text).map_err(|names| format!("{names} and {}", layers.name())),
    }
}

pub(super) fn positive_length(text: &str) -> Result<f64, &'static str> {
    match text.parse::<f64>() {
        Ok(length) if length.is_finite() && length > 0.0 => Ok(length),
        _ => Err("expected a finite number above 0"),
    }
}

/// The value that `--light-groups` has if none is given.
pub(super) const EACH_EMITTER: &str = "";

pub(super) fn define(text: &str) -> Result<(String, String), &'static str> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.to_string(), value.to_string())),
        _ => Err("expected NAME=VALUE"),
    }
}

pub(super) fn size(text: &str) -> Result<(u32, u32), &'static str> {
    let parse = || {
        let (w, h) = text.split_once(['x', 'X', '×'])?;
        Some((w.trim().parse::<u32>().ok()?, h.trim().parse::<u32>().ok()?))
    };
    match parse() {
        Some((w, h)) if (1..=16384).contains(&w) && (1..=16384).contains(&h) => Ok((w, h)),
        Some(_) => Err("each side must be 1 to 16384 pixels"),
        None => Err("expected WIDTHxHEIGHT, such as 640x480"),
    }
}

/// The address of a program that listens.
pub(super) fn host_port(text: &str) -> Result<String, &'static str> {
    match text.rsplit_once(':') {
        Some((host, port)) if !host.is_empty() && port.parse::<u16>().is_ok() => Ok(text.to_string()),
        _ => Err("expected HOST:PORT, such as 127.0.0.1:14158"),
    }
}

/// Reads a positive count with an optional decimal suffix k, M or G.
pub fn count(text: &str) -> Result<u64, &'static str> {
    let (digits, factor) = match text.trim().char_indices().last() {
        Some((at, 'k' | 'K')) => (&text.trim()[..at], 1e3),
        Some((at, 'M')) => (&text.trim()[..at], 1e6),
        Some((at, 'G')) => (&text.trim()[..at], 1e9),
        _ => (text.trim(), 1.0),
    };
    if factor == 1.0
        && let Ok(n) = digits.parse::<u64>()
    {
        return if n > 0 { Ok(n) } else { Err("must be at least 1") };
    }
    match digits.parse::<f64>() {
        Ok(v) if v.is_finite() && (1.0..1.8e19).contains(&(v * factor)) => Ok((v * factor).round() as u64),
        Ok(_) => Err("must be at least 1 and below 2^64"),
        Err(_) => Err("expected a count such as 500, 64k, 1.5M or 2G"),
    }
}

pub(super) fn seconds(text: &str) -> Result<Duration, &'static str> {
    let duration = text.parse::<f64>().ok().and_then(|t| Duration::try_from_secs_f64(t).ok());
    duration.filter(|t| !t.is_zero()).ok_or("expected a positive number of seconds")
}

pub(super) fn share(text: &str) -> Result<f64, &'static str> {
    let share = text.parse::<f64>().ok().filter(|share| (0.0..=1.0).contains(share));
    share.ok_or("expected a share between 0 and 1, such as 0.01")
}

/// A relative error, `1%` or `0.01`.
pub(super) fn error(text: &str) -> Result<f64, &'static str> {
    let (number, unit) = match text.trim().strip_suffix('%') {
        Some(number) => (number.trim_end(), 0.01),
        None => (text.trim(), 1.0),
    };
    let error = number.parse::<f64>().ok().map(|value| value * unit);
    let error = error.filter(|error| (1e-6..=10.0).contains(error));
    error.ok_or("expected a relative error between 0.0001% and 1000%, such as 1% or 0.01")
}

/// The reconstruction's radius and the exponent of its window, `2.5,8` or `1.5,none`.
pub(super) fn kernel(text: &str) -> Result<ReconstructionKernel, &'static str> {
    let (radius, exponent) = text.split_once(',').unwrap_or((text, "8"));
    let taps = radius.trim().parse::<f32>().ok().map(|radius| 2.0 * radius);
    let taps = taps.filter(|taps| taps.fract() == 0.0 && (2.0..=8.0).contains(taps));
    let exponent = match exponent.trim() {
        "none" => Some(0),
        number => number.parse::<u32>().ok().filter(|exponent| (1..=64).contains(exponent)),
    };
    let kernel =
        taps.zip(exponent).map(|(taps, exponent)| ReconstructionKernel { taps: taps as u32, exponent });
    kernel.ok_or(
        "expected a radius of 1 to 4 texels in halves and an exponent of 1 to 64 or none, such as 2.5,8",
    )
}

pub(super) fn depth(text: &str) -> Result<MaxDepth, &'static str> {
    match text.parse::<i64>() {
        Ok(-1) => Ok(MaxDepth(None)),
        Ok(n @ 0..=0xffff_ffff) => Ok(MaxDepth(Some(n as u32))),
        _ => Err("expected a path length, or -1 for unlimited"),
    }
}

pub(super) fn float(text: &str) -> Result<f32, &'static str> {
    text.parse::<f32>().ok().filter(|v| v.is_finite()).ok_or("expected a number")
}

pub(super) fn positive(text: &str) -> Result<f32, &'static str> {
    float(text).and_then(|v| if v > 0.0 { Ok(v) } else { Err("must be above 0") })
}

pub(super) fn non_negative(text: &str) -> Result<f32, &'static str> {
    float(text).and_then(|v| if v >= 0.0 { Ok(v) } else { Err("must not be negative") })
}

/// An angle that a picture seen in a plane can fill, degrees.
pub(super) fn view_angle(text: &str) -> Result<f32, String> {
    use crate::client::glare::kernel::MAX_VIEW_ANGLE as MAX;
    let inside = |v: &f32| *v > 0.0 && *v <= MAX;
    float(text).ok().filter(inside).ok_or_else(|| format!("must be above 0 and at most {MAX} degrees"))
}

pub(super) fn profile(text: &str) -> Result<Profile, String> {
    if let Some(profile) = Profile::named(text) {
        return Ok(profile);
    }
    let path = Path::new(text);
    if !path.exists() && path.extension().is_none() {
        let names = Profile::names().join(", ");
        return Err(format!("unknown; known are {names}, and files of ICC matrix profiles"));
    }
    read_profile(path)
}

/// Largest profile that is read: those of a matrix have some kilobytes.
const MAX_PROFILE_BYTES: u64 = 16 << 20;

/// The ICC profile in a file; its name is the path.
fn read_profile(path: &Path) -> Result<Profile, String> {
    let cannot = |error: std::io::Error| format!("cannot read {}: {error}", path.display());
    let info = std::fs::metadata(path).map_err(cannot)?;
    let advice =
        "give the ICC profile of a display that works by a matrix and tone curves, or one of the names";
    if !info.is_file() || info.len() > MAX_PROFILE_BYTES {
        return Err(format!("{} is not a file of at most 16 MiB; {advice}", path.display()));
    }
    let bytes = std::fs::read(path).map_err(cannot)?;
    let profile = icc::parse(&bytes)
        .map_err(|error| format!("{} cannot be used: {error}; {advice}", path.display()))?;
    Ok(Profile { name: path.display().to_string(), ..profile })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_take_suffixes() {
        assert_eq!(count("500"), Ok(500));
        assert_eq!(count("64k"), Ok(64_000));
        assert_eq!(count("1.5M"), Ok(1_500_000));
        assert_eq!(count("2G"), Ok(2_000_000_000));
        assert_eq!(count("18446744073709551615"), Ok(u64::MAX));
        for bad in ["", "k", "0", "-3", "1e99", "nan", "0.0001k", "ten", "4 4"] {
            assert!(count(bad).is_err(), "{bad:?} was accepted");
        }
    }

    #[test]
    fn errors_are_shares_or_per_cents() {
        assert_eq!((error("1%"), error("0.5 %"), error("0.02")), (Ok(0.01), Ok(0.005), Ok(0.02)));
        for bad in ["", "%", "0", "-1%", "nan", "inf%", "2000%", "1e-9", "one"] {
            assert!(error(bad).is_err(), "{bad:?} was accepted");
        }
    }

    #[test]
    fn kernels_are_a_radius_and_a_window() {
        assert_eq!(kernel("2.5,8"), Ok(ReconstructionKernel::default()));
        assert_eq!(kernel("1.5, none"), Ok(ReconstructionKernel { taps: 3, exponent: 0 }));
        assert_eq!(kernel("4"), Ok(ReconstructionKernel { taps: 8, exponent: 8 }));
        for bad in ["", ",", "0.5", "2.4", "4.5,8", "nan", "2,0", "2,65", "2,-1", "2,8,8", "1e9,8"] {
            assert!(kernel(bad).is_err(), "{bad:?} was accepted");
        }
    }

    #[test]
    fn layers_are_those_of_a_window() {
        assert_eq!(window_layout("swapchain"), Ok(StereoLayout::Swapchain));
        assert_eq!(window_layout("over-under"), Ok(StereoLayout::OverUnder));
        assert!(window_layout("sideways").is_err_and(|e| e.ends_with("checkerboard and swapchain")));
        let refused = composed_layout("swapchain").expect_err("pictures have no layers");
        assert!(refused.contains("`pointillist view`") && refused.ends_with("checkerboard"), "{refused}");
    }

    #[test]
    fn sizes_are_bounded() {
        assert_eq!(size("640x480"), Ok((640, 480)));
        for bad in ["640", "0x4", "4x0", "99999x3", "ax3", "-1x3"] {
            assert!(size(bad).is_err(), "{bad:?} was accepted");
        }
    }

    #[test]
    fn profiles_are_names_or_files() {
        assert!(profile("display-p3").is_ok());
        assert!(profile("nonsense").is_err_and(|e| e.contains("rec2020")));
        assert!(profile("/nowhere/display.icc").is_err_and(|e| e.contains("/nowhere/display.icc")));
        assert!(profile("Cargo.toml").is_err_and(|e| e.contains("Cargo.toml cannot be used")));
        assert!(profile("src").is_err_and(|e| e.contains("not a file")));
    }

    #[test]
    fn times_are_positive_and_can_be_waited_for() {
        assert_eq!(seconds("1.5"), Ok(Duration::from_millis(1500)));
        for bad in ["0", "-1", "nan", "inf", "1e300", "", "3 s"] {
            assert!(seconds(bad).is_err(), "{bad:?} was accepted");
        }
    }
}
