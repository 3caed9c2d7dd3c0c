//! What the window does not do for two eyes, each with the reason that the user is told.

use crate::client::{ColorOutput, Denoise, DisplayView, Settings};
use crate::image::stereo::StereoLayout;

/// Why a window that is opened like this shows one eye only; `None` where it can show two. `deterministic`: samples are rasterised in index
/// order; `remote`: other machines trace; `tev`: the picture is sent to that viewer.
pub fn refusal(deterministic: bool, remote: bool, tev: bool) -> Option<&'static str> {
    let refused = [
        (deterministic, "samples of two eyes are not rasterised in index order: leave --deterministic away"),
        (remote, "two eyes are traced on this machine only: without --connect it traces the scene itself"),
        (tev, "tev is shown one eye: leave --tev away"),
    ];
    refused.into_iter().find(|(is_so, _)| *is_so).map(|(_, why)| why)
}

/// Why a window whose images have `most` layers at most does not show this layout; `None` where it does.
pub fn refused_layout(layout: StereoLayout, most: u32) -> Option<String> {
    (layers(layout) > most).then(|| {
        format!(
            "the layout {} needs images of 2 layers, and the surface of this window has at most {most} \
             (maxImageArrayLayers), as without quad-buffered stereo: take {} or another layout",
            layout.name(),
            layout.in_one_picture().name()
        )
    })
}

/// Layers of a window's images that this layout needs.
pub fn layers(layout: StereoLayout) -> u32 {
    if layout == StereoLayout::Swapchain { 2 } else { 1 }
}

/// The layouts of a window whose images have `most` layers at most, in the order in which they are listed.
pub fn layouts(most: u32) -> Vec<StereoLayout> {
    let all = StereoLayout::ALL.into_iter().chain([StereoLayout::Swapchain]);
    all.filter(|layout| layers(*layout) <= most).collect()
}

/// Switches off what two eyes are not shown with; returns a line about each that was on.
pub fn refused_settings(settings: &mut Settings) -> Vec<String> {
    let refused = [
        (settings.denoise != Denoise::Off, "the noise filter is off: it does not see the right eye"),
        (
            settings.vm > 0.0,
            "noise masking is off: it needs a variance, which pictures of two eyes do not have",
        ),
        (
            settings.view.is_error(),
            "the error is not shown: pictures of two eyes have no variance of a pixel",
        ),
        (
            settings.output != ColorOutput::Sdr,
            "the window has 8 bits: pictures of two eyes are composed of these",
        ),
    ];
    let told = refused.into_iter().filter(|(is_on, _)| *is_on).map(|(_, why)| format!("stereo: {why}"));
    let told = told.collect();
    (settings.denoise, settings.vm, settings.output) = (Denoise::Off, 0.0, ColorOutput::Sdr);
    if settings.view.is_error() {
        settings.view = DisplayView::Picture;
    }
    told
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_sees_one_eye_is_told_and_off() {
        let mut settings = Settings::default();
        assert!(refused_settings(&mut settings).is_empty());
        assert_eq!(settings, Settings::default());
        let view = DisplayView::CameraVariance;
        let output = ColorOutput::Hdr10;
        settings = Settings { denoise: Denoise::Wavelet, vm: 1.0, view, output, ..settings };
        assert_eq!(refused_settings(&mut settings).len(), 4);
        assert_eq!(settings, Settings::default());
        // Colours of luminance are those of a display.
        settings.view = DisplayView::FalseColor;
        assert!(refused_settings(&mut settings).is_empty() && settings.view == DisplayView::FalseColor);
        assert_eq!(refusal(false, false, false), None);
        assert!(refusal(false, false, true).is_some_and(|why| why.contains("--tev")));
    }

    /// Ordinary surfaces have images of one layer, and then the list ends as it does for files.
    #[test]
    fn layers_are_listed_where_there_are_two() {
        assert_eq!(layouts(1), StereoLayout::ALL);
        assert_eq!(layouts(2).last(), Some(&StereoLayout::Swapchain));
        assert_eq!(refused_layout(StereoLayout::Swapchain, 2), None);
        assert!(StereoLayout::ALL.into_iter().all(|layout| refused_layout(layout, 1).is_none()));
        let why = refused_layout(StereoLayout::Swapchain, 1).expect("a reason");
        assert!(
            ["swapchain", "maxImageArrayLayers", "side-by-side"].iter().all(|part| why.contains(part)),
            "{why}"
        );
        assert!(!why.contains('\n') && !why.contains("  "), "{why}");
    }
}
