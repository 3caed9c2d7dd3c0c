//! Pipelines that nobody owns at the moment, kept for reuse.

use std::collections::VecDeque;

use crate::gpu::device::retire::PipelineHandles;

/// Most pipelines that are kept: those of a film and its pictures, for the next one. The driver of a CPU device takes some hundred
/// kilobytes for each.
const MOST: usize = 32;

/// Pipelines with their descriptions, the longest unowned first.
#[derive(Default)]
pub(in crate::gpu) struct SparePipelines(VecDeque<(String, PipelineHandles)>);

impl SparePipelines {
    /// A pipeline of this description, if there is one.
    pub fn take(&mut self, description: &str) -> Option<PipelineHandles> {
        let at = self.0.iter().rposition(|(spare, _)| spare == description)?;
        self.0.remove(at).map(|(_, handles)| handles)
    }

    /// Keeps a pipeline. Returns the one that has waited longest if there are too many: it has to be destroyed.
    pub fn keep(&mut self, description: String, handles: PipelineHandles) -> Option<PipelineHandles> {
        self.0.push_back((description, handles));
        if self.0.len() > MOST { self.0.pop_front().map(|(_, handles)| handles) } else { None }
    }

    /// All of them.
    pub fn into_handles(self) -> impl Iterator<Item = PipelineHandles> {
        self.0.into_iter().map(|(_, handles)| handles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_are_given_up() {
        let mut spares = SparePipelines::default();
        for i in 0..MOST {
            assert!(spares.keep(format!("{}", i / 2), PipelineHandles::default()).is_none());
        }
        assert!(spares.keep("new".to_owned(), PipelineHandles::default()).is_some());
        // One of the two that were first is gone.
        let mut take = |description| spares.take(description).is_some();
        assert_eq!(
            ["0", "0", "1", "1", "1", "new", "new"].map(&mut take),
            [true, false, true, true, false, true, false]
        );
        assert_eq!(spares.into_handles().count(), MOST - 4);
    }
}
