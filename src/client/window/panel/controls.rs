//! What the user changes in the panel.

use crate::client::settings::{Settings, SplatFilter};
use crate::client::window::panel::layout::PanelLayout;
use crate::client::window::panel::palette::CommandPalette;
use crate::color::Profile;

/// Controls that the user changes in the panel.
#[derive(Clone, Debug)]
pub struct PanelControls {
    /// Display settings; a change of them never restarts the server.
    pub settings: Settings,
    /// Auto-exposure, until the user sets an exposure.
    pub auto_exposure: bool,
    /// Splat filter; a change refills the film from the retained samples.
    pub filter: SplatFilter,
    /// Profile read from a file, kept so that it can be selected again.
    pub own_profile: Option<Profile>,
    /// The dock: whether it is open, how wide, which tabs.
    pub layout: PanelLayout,
    /// Whether the list of keys is shown.
    pub help: bool,
    /// The palette of commands.
    pub palette: CommandPalette,
    /// Whether the panel takes the keyboard focus with the next run.
    pub enters: bool,
}
