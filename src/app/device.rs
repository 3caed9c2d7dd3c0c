//! Where the picture is rasterised: a Vulkan device, or the CPU references.

use std::io::{ErrorKind, Write};

use miette::{IntoDiagnostic, Result};

use super::pipelines;
use crate::client::cascades::CascadeFilm;
use crate::client::film::VulkanFilm;
use crate::client::oidn;
use crate::client::reference::ReferenceFilm;
use crate::client::{ClientError, Film, FilmSpec};
use crate::gpu::{self, DeviceChoice, DeviceKind, Gpu, GpuError};
use crate::server::Priority;

/// The name of the device that needs no driver.
pub const CPU: &str = "cpu";

/// An opened device.
pub enum Device {
    Vulkan(std::sync::Arc<Gpu>),
    /// Through the references.
    Cpu,
}

impl Device {
    /// Opens the device asked for; without a wish the best Vulkan device, or the CPU where there is none.
    ///
    /// # Errors
    ///
    /// When a device was asked for and is not there or lacks something; the message says what.
    pub fn open(choice: Option<&str>) -> Result<Self> {
        match choice {
            Some(CPU) => Ok(Device::Cpu),
            Some(text) => Self::vulkan(&DeviceChoice::parse(text)).into_diagnostic(),
            None => Ok(Self::vulkan(&DeviceChoice::Best).unwrap_or_else(|error| {
                tracing::warn!("no Vulkan device, rendering with --device cpu: {error}");
                Device::Cpu
            })),
        }
    }

    /// The Vulkan device of this choice, with the pipelines that earlier runs have compiled.
    fn vulkan(choice: &DeviceChoice) -> Result<Self, GpuError> {
        let gpu = Gpu::new(choice)?;
        pipelines::keep(&gpu);
        Ok(Device::Vulkan(gpu))
    }

    /// The device's name.
    pub fn name(&self) -> String {
        match self {
            Device::Vulkan(gpu) => gpu.info().name.clone(),
            Device::Cpu => CPU.to_string(),
        }
    }

    /// The Vulkan device, if it is one.
    pub fn gpu(&self) -> Option<&std::sync::Arc<Gpu>> {
        match self {
            Device::Vulkan(gpu) => Some(gpu),
            Device::Cpu => None,
        }
    }

    /// How tracing threads stand beside it: where its driver draws on the processor it is served first, so that the stream's
    /// lanes never fill up.
    pub fn tracing_priority(&self) -> Priority {
        match self.gpu() {
            Some(gpu) if gpu.info().kind == DeviceKind::Cpu => Priority::Background,
            _ => Priority::Normal,
        }
    }

    /// Makes a film on it, with fireflies reweighted by the threshold `kappa` if there is one; `threads` is for the CPU
    /// references.
    pub fn client(&self, spec: FilmSpec, threads: usize, kappa: Option<f32>) -> Result<Box<dyn Film>> {
        let gpu = self.gpu().cloned();
        let make = move |spec| -> Result<Box<dyn Film>, ClientError> {
            Ok(match &gpu {
                Some(gpu) => Box::new(VulkanFilm::new(gpu.clone(), spec)?),
                None => Box::new(ReferenceFilm::new(spec, threads)?),
            })
        };
        match kappa {
            Some(kappa) => Ok(Box::new(CascadeFilm::new(Box::new(make), spec, kappa).into_diagnostic()?)),
            None => make(spec).into_diagnostic(),
        }
    }
}

/// `pointillist devices`: one line per device, and what is missing where one cannot be used; and whether Open Image Denoise is there.
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
        // Whoever reads has read enough.
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error).into_diagnostic(),
        _ => Ok(()),
    }
}
