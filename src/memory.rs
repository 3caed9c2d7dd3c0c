//! Memory as the operating system gives it: huge pages for what is accessed at random, and giving back what is no longer in use.

use std::mem::MaybeUninit;

/// Asks the operating system for pages of 2 MiB. Call it before the memory is first written. Traversal accesses memory at
/// random, and TLB misses on small pages take 5 to 8 % of its time in a BVH of 8 MB. The system may refuse.
pub(crate) fn advise_huge_pages<T>(memory: &mut [MaybeUninit<T>]) {
    #[cfg(target_os = "linux")]
    {
        // Advice is for whole pages, which are no larger on any system. The system itself finds the aligned 2 MiB among them, also across
        // neighbours that had the same advice.
        const PAGE: usize = 1 << 16;
        let start = memory.as_mut_ptr().cast::<u8>();
        let skipped = start.align_offset(PAGE);
        let Some(len) = size_of_val(memory).checked_sub(skipped).map(|n| n / PAGE * PAGE) else { return };
        if len > 0 {
            // SAFETY: these are whole pages within memory that only we refer to. The advice does not change their content.
            let _ = unsafe {
                rustix::mm::madvise(start.add(skipped).cast(), len, rustix::mm::Advice::LinuxHugepage)
            };
        }
    }
}

/// Collects `items` into huge pages, where the system provides them.
pub(crate) fn collect_in_huge_pages<T>(items: impl ExactSizeIterator<Item = T>) -> Vec<T> {
    let mut large = Vec::with_capacity(items.len());
    advise_huge_pages(large.spare_capacity_mut());
    large.extend(items);
    large
}

/// Gives memory that is no longer in use back to the operating system: reading and building a large scene takes two to three times
/// what it holds in the end, and the allocator would keep much of that.
pub(crate) fn return_free_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        unsafe extern "C" {
            fn malloc_trim(pad: usize) -> std::ffi::c_int;
        }
        // SAFETY: the function has no precondition, and touches free memory only.
        let _ = unsafe { malloc_trim(0) };
    }
}
