//! Preferences kept across sessions: width of the dock, text size, recent scenes.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::client::window::panel::{PanelLayout, WIDTH};
use crate::image::write::atomically;
use crate::render::predictions;

/// Most recent scenes.
const MOST_RECENT: usize = 12;

/// Range of the text size, relative to the default.
const FONT_SCALES: (f32, f32) = (0.6, 3.0);

/// Factor on the text size per step.
const FONT_STEP: f32 = 1.1;

/// Stored preferences. Field names are JSON keys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Preferences {
    /// Width of the dock, points.
    dock_width: f32,
    /// Text size relative to the default.
    font_scale: f32,
    /// Recent scenes, newest first.
    pub recent: Vec<PathBuf>,
}

impl Default for Preferences {
    fn default() -> Self {
        Self { dock_width: WIDTH, font_scale: 1.0, recent: Vec::new() }
    }
}

impl Preferences {
    /// Reads the stored preferences; the defaults if there are none, or none that can be parsed.
    pub fn read() -> Self {
        let text = file().and_then(|file| std::fs::read_to_string(file).ok());
        let mut read: Self = text.and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default();
        let sound = |value: f32, (low, high): (f32, f32), default: f32| {
            if (low..=high).contains(&value) { value } else { default }
        };
        read.dock_width = sound(read.dock_width, (100.0, 4000.0), WIDTH);
        read.font_scale = sound(read.font_scale, FONT_SCALES, 1.0);
        read
    }

    /// Applies dock width and text size.
    pub fn arrange(&self, layout: &mut PanelLayout) {
        (layout.width, layout.font_scale) = (self.dock_width, self.font_scale);
    }

    /// Records an opened scene.
    pub fn opened(&mut self, scene: &Path, layout: &PanelLayout) {
        let Ok(scene) = scene.canonicalize() else { return };
        self.recent.retain(|known| *known != scene);
        self.recent.insert(0, scene);
        self.recent.truncate(MOST_RECENT);
        self.write(layout);
    }

    /// Stores the layout of the dock. Failures are only logged: nothing depends on it.
    pub fn write(&mut self, layout: &PanelLayout) {
        (self.dock_width, self.font_scale) = (layout.width, layout.font_scale);
        let Some(file) = file() else { return };
        let written = file.parent().map_or(Ok(()), std::fs::create_dir_all);
        let text = serde_json::to_string_pretty(self).unwrap_or_default();
        let written = written.map_err(|e| e.to_string());
        if let Err(error) =
            written.and_then(|()| atomically(&file, text.as_bytes()).map_err(|e| e.to_string()))
        {
            tracing::info!("the window's preferences are not kept: {error}");
        }
    }
}

/// Text size after a number of steps.
pub fn scaled(font_scale: f32, steps: i8) -> f32 {
    let scale = font_scale * FONT_STEP.powi(i32::from(steps));
    let scale = if (scale - 1.0).abs() < 0.04 { 1.0 } else { scale };
    scale.clamp(FONT_SCALES.0, FONT_SCALES.1)
}

fn file() -> Option<PathBuf> {
    Some(predictions::folder()?.join("window.json"))
}
