//! `pointillist devices`: devices that can rasterise pictures.

use std::io::{ErrorKind, Write};

use miette::{IntoDiagnostic, Result};

use crate::client::oidn;
use crate::gpu;
use crate::render::device::CPU;

/// Prints one line per device, with what an unusable one lacks; and whether Open Image Denoise is available.
pub fn list() -> Result<()> {
    let mut text = String::new();
    match gpu::devices_with_memory() {
        Ok(found) => {
            for (device, memory) in &found {
                text += &format!(
                    "{}  {} ({}, Vulkan {}, {}; {memory}): {}\n",
                    device.index,
                    device.name,
                    device.kind,
                    device.api,
                    device.driver,
                    device.suitability()
                );
            }
        }
        Err(error) => text += &format!("(no Vulkan: {error})\n"),
    }
    text += &format!("{CPU}  the same passes in plain Rust, on all cores: always there\n");
    text += &match oidn::library() {
        Ok(library) => {
            format!(
                "oidn  Open Image Denoise {}, for --denoise oidn: {}\n",
                library.version(),
                library.path()
            )
        }
        Err(error) => format!("(no --denoise oidn: {error}; {})\n", oidn::HOW_TO_GET),
    };
    match std::io::stdout().write_all(text.as_bytes()) {
        // A closed pipe is not an error: the reader has seen enough.
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error).into_diagnostic(),
        _ => Ok(()),
    }
}
