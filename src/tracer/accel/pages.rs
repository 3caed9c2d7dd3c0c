//! Memory that is jumped about in.

use std::mem::MaybeUninit;

/// Asks the system for pages of 2 MiB before memory is first written: a walk jumps about in it, and looking up small pages takes
/// its time (5 to 8 % of a walk in 8 MB, measured). It may refuse.
pub(super) fn ask_for_large_pages<T>(memory: &mut [MaybeUninit<T>]) {
    #[cfg(target_os = "linux")]
    {
        const LARGE: usize = 1 << 21;
        let start = memory.as_mut_ptr().cast::<u8>();
        let skipped = start.align_offset(LARGE);
        let Some(len) = size_of_val(memory).checked_sub(skipped).map(|n| n / LARGE * LARGE) else { return };
        if len > 0 {
            // SAFETY: whole pages within memory that is ours alone and holds nothing yet; the advice changes no content.
            let _ = unsafe {
                rustix::mm::madvise(start.add(skipped).cast(), len, rustix::mm::Advice::LinuxHugepage)
            };
        }
    }
}

/// The items in large pages, where the system has some.
pub(in crate::tracer) fn in_large_pages<T>(items: impl ExactSizeIterator<Item = T>) -> Vec<T> {
    let mut large = Vec::with_capacity(items.len());
    ask_for_large_pages(large.spare_capacity_mut());
    large.extend(items);
    large
}
