//! The command line, turned into plain option structs.

use std::path::PathBuf;
use std::time::Duration;

use clap::{ArgGroup, Args, Parser, Subcommand, ValueEnum};

use crate::client::{Reconstruction, Settings, SplatFilter};

/// Interactive global illumination: point samples become the best picture possible, at once.
#[derive(Parser, Debug)]
#[command(name = "pointillist", version, about, max_term_width = 110)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The subcommands.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Render a Mitsuba 3 scene file to EXR and PNG, without a window.
    Render(Box<RenderArgs>),
    /// List the Vulkan devices and say of each whether it can be used.
    Devices,
}

/// Options of `pointillist render`.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("amount").args(["samples", "spp", "time"])))]
pub struct RenderArgs {
    /// The scene, a Mitsuba 3 XML file.
    pub scene: PathBuf,

    /// Output file, .exr or .png; may be given several times [default: the scene's name as .png].
    #[arg(short = 'o', long = "output", value_name = "FILE")]
    pub outputs: Vec<PathBuf>,

    /// Give a value to a $name in the scene; may be given several times.
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = define)]
    pub defines: Vec<(String, String)>,

    /// Picture size in pixels; replaces the film's size and crop.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,

    /// Camera paths in all, over the picture and its overscan; k, M, G are accepted.
    #[arg(long, value_name = "N", value_parser = count)]
    pub samples: Option<u64>,

    /// Samples per pixel [default: what the scene asks for, else 16].
    #[arg(long, value_name = "N", value_parser = count)]
    pub spp: Option<u64>,

    /// Stop after this many seconds of rendering.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub time: Option<Duration>,

    /// First index of the sequence; the picture holds the paths from there on (for replaying one, with --samples 1).
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub first_index: u64,

    /// Longest path in segments; -1 is unlimited [default: what the scene asks for].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = depth)]
    pub max_depth: Option<MaxDepth>,

    /// Tracer threads [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,

    /// Seed of the sample sequence; another seed gives an independent picture.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u32,

    /// Rasterise samples in index order: the same bytes for any number of threads.
    #[arg(long)]
    pub deterministic: bool,

    /// Splat filter [default: what the scene asks for, else gaussian].
    #[arg(long, value_name = "KIND")]
    pub filter: Option<FilterArg>,

    /// Reconstruction of the displayed picture.
    #[arg(long, value_name = "KIND", default_value = "gaussian")]
    pub reconstruct: ReconstructArg,

    /// Noise masking strength Vm, 0 is off.
    #[arg(long, value_name = "X", default_value_t = Settings::default().vm, value_parser = non_negative)]
    pub vm: f32,

    /// Brightness B of the tone curve.
    #[arg(long, value_name = "B", default_value_t = Settings::default().exposure, value_parser = positive)]
    pub exposure: f32,

    /// Contrast C of the tone curve.
    #[arg(long, value_name = "C", default_value_t = Settings::default().contrast, value_parser = positive)]
    pub contrast: f32,

    /// Display gamma G.
    #[arg(long, value_name = "G", default_value_t = Settings::default().gamma, value_parser = positive)]
    pub gamma: f32,

    /// Display profile.
    #[arg(long, value_name = "NAME", default_value = "srgb", value_parser = profile)]
    pub profile: crate::color::Profile,

    /// Vulkan device by index or part of its name, or `cpu` for none [default: the best there is].
    #[arg(long, value_name = "NAME|INDEX|cpu")]
    pub device: Option<String>,

    /// Write figures of the run as JSON; `-` is standard output.
    #[arg(long, value_name = "FILE|-")]
    pub json: Option<PathBuf>,

    /// No progress bar, no summary; warnings and errors only.
    #[arg(long, short)]
    pub quiet: bool,
}

/// `--max-depth`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaxDepth(pub Option<u32>);

/// `--filter`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FilterArg {
    /// Windowed Gaussian, 5×5 texels.
    Gaussian,
    /// Tent of radius 1.
    Tent,
    /// Exactly one texel.
    Box,
}

impl From<FilterArg> for SplatFilter {
    fn from(filter: FilterArg) -> Self {
        match filter {
            FilterArg::Gaussian => SplatFilter::Gaussian,
            FilterArg::Tent => SplatFilter::Tent,
            FilterArg::Box => SplatFilter::Box,
        }
    }
}

/// `--reconstruct`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ReconstructArg {
    /// Windowed Gaussian blur on two mip levels.
    Gaussian,
    /// Catmull–Rom spline on two mip levels.
    CatmullRom,
    /// Hardware mip-mapping.
    Mipmap,
    /// The texel as it is.
    None,
}

impl From<ReconstructArg> for Reconstruction {
    fn from(kind: ReconstructArg) -> Self {
        match kind {
            ReconstructArg::Gaussian => Reconstruction::Gaussian,
            ReconstructArg::CatmullRom => Reconstruction::CatmullRom,
            ReconstructArg::Mipmap => Reconstruction::Mipmap,
            ReconstructArg::None => Reconstruction::None,
        }
    }
}

fn define(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.to_string(), value.to_string())),
        _ => Err("expected NAME=VALUE".to_string()),
    }
}

fn size(text: &str) -> Result<(u32, u32), String> {
    let parse = || {
        let (w, h) = text.split_once(['x', 'X', '×'])?;
        Some((w.trim().parse::<u32>().ok()?, h.trim().parse::<u32>().ok()?))
    };
    match parse() {
        Some((w, h)) if (1..=16384).contains(&w) && (1..=16384).contains(&h) => Ok((w, h)),
        Some(_) => Err("each side must be 1 to 16384 pixels".to_string()),
        None => Err("expected WIDTHxHEIGHT, such as 640x480".to_string()),
    }
}

/// Reads a positive count with an optional decimal suffix k, M or G.
pub fn count(text: &str) -> Result<u64, String> {
    let (digits, factor) = match text.trim().char_indices().last() {
        Some((at, 'k' | 'K')) => (&text.trim()[..at], 1e3),
        Some((at, 'M')) => (&text.trim()[..at], 1e6),
        Some((at, 'G')) => (&text.trim()[..at], 1e9),
        _ => (text.trim(), 1.0),
    };
    if factor == 1.0
        && let Ok(n) = digits.parse::<u64>()
    {
        return if n > 0 { Ok(n) } else { Err("must be at least 1".to_string()) };
    }
    match digits.parse::<f64>() {
        Ok(v) if v.is_finite() && (1.0..1.8e19).contains(&(v * factor)) => Ok((v * factor).round() as u64),
        Ok(_) => Err("must be at least 1 and below 2^64".to_string()),
        Err(_) => Err("expected a count such as 500, 64k, 1.5M or 2G".to_string()),
    }
}

fn seconds(text: &str) -> Result<Duration, String> {
    let duration = text.parse::<f64>().ok().and_then(|t| Duration::try_from_secs_f64(t).ok());
    duration.filter(|t| !t.is_zero()).ok_or_else(|| "expected a positive number of seconds".to_string())
}

fn depth(text: &str) -> Result<MaxDepth, String> {
    match text.parse::<i64>() {
        Ok(-1) => Ok(MaxDepth(None)),
        Ok(n @ 0..=0xffff_ffff) => Ok(MaxDepth(Some(n as u32))),
        _ => Err("expected a path length, or -1 for unlimited".to_string()),
    }
}

fn float(text: &str) -> Result<f32, String> {
    text.parse::<f32>().ok().filter(|v| v.is_finite()).ok_or_else(|| "expected a number".to_string())
}

fn positive(text: &str) -> Result<f32, String> {
    float(text).and_then(|v| if v > 0.0 { Ok(v) } else { Err("must be above 0".to_string()) })
}

fn non_negative(text: &str) -> Result<f32, String> {
    float(text).and_then(|v| if v >= 0.0 { Ok(v) } else { Err("must not be negative".to_string()) })
}

fn profile(text: &str) -> Result<crate::color::Profile, String> {
    crate::color::Profile::named(text)
        .ok_or_else(|| format!("unknown; known are {}", crate::color::Profile::names().join(", ")))
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

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
    fn sizes_are_bounded() {
        assert_eq!(size("640x480"), Ok((640, 480)));
        for bad in ["640", "0x4", "4x0", "99999x3", "ax3", "-1x3"] {
            assert!(size(bad).is_err(), "{bad:?} was accepted");
        }
    }

    #[test]
    fn times_are_positive_and_can_be_waited_for() {
        assert_eq!(seconds("1.5"), Ok(Duration::from_millis(1500)));
        for bad in ["0", "-1", "nan", "inf", "1e300", "", "3 s"] {
            assert!(seconds(bad).is_err(), "{bad:?} was accepted");
        }
    }

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
