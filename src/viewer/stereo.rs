//! What the window does not do for two eyes, each with the reason that the user is told.

use crate::client::{ColorOutput, OptionNames, Settings};
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

/// Switches off what two eyes are not shown with; returns a line about it if it was on.
pub fn refused_settings(settings: &mut Settings) -> Option<String> {
    let is_refused = settings.output != ColorOutput::Sdr && settings.stereo.mixes_light();
    is_refused.then(|| {
        let (output, layout) = (settings.output.label(), settings.stereo.label());
        settings.output = ColorOutput::Sdr;
        format!(
            "stereo: the window has 8 bits instead of {output}: the layout “{layout}” mixes the light of several pixels, which it does with 8-bit \
             values only"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::stereo::StereoLayout;

    #[test]
    fn wide_range_outputs_are_refused_where_light_is_mixed() {
        for layout in StereoLayout::ALL {
            let mut settings = Settings { stereo: layout, ..Settings::default() };
            let before = settings.clone();
            assert_eq!((refused_settings(&mut settings), &settings), (None, &before));
            settings.output = ColorOutput::Hdr10;
            let told = refused_settings(&mut settings);
            let is_mixed = matches!(layout.name(), "side-by-side-half" | "over-under-half")
                || layout.name().starts_with("anaglyph");
            assert_eq!(told.is_some(), is_mixed, "{}", layout.name());
            assert_eq!(settings.output == ColorOutput::Sdr, is_mixed);
            assert!(told.is_none_or(|told| told.contains(layout.label())));
        }
    }

    #[test]
    fn what_shows_one_eye_is_refused() {
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
