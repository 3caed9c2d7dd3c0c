//! Steers the first camera paths after a move of the camera to where the last picture shows least
//! ([`denoise::steering`](crate::denoise::steering)). The epoch begins with even ones, so that its first picture waits for nothing.

use crate::viewer::Viewer;

impl Viewer {
    /// Steers the paths that follow, once the noise filter has found where to. Called when the samples that have arrived are on the film: those
    /// that are still on their way are lost.
    pub(super) fn steer(&mut self) {
        let Some(density) = self.picture.filter.take_steering().filter(|_| self.paused.is_none()) else {
            return;
        };
        match self.session.steer(&self.editor, density) {
            Ok(true) => self.picture.note_steering(),
            Ok(false) => {}
            Err(error) => self.fail(error),
        }
    }
}
