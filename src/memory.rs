//! Memory as the operating system gives it: huge pages for what is accessed at random, and giving back what is no longer in use.

#[cfg(all(target_os = "linux", target_env = "gnu"))]
use std::ffi::c_int;
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

/// Sets how the allocator of the GNU C library keeps free memory: in 4 arenas at most, 16 MiB at the end of each, and blocks of 1 MiB and more go
/// back to the operating system when they are freed. Call it before other threads are started, which would have arenas of their own.
///
/// By default there may be eight arenas for each processor, and a freed block of up to 32 MiB raises the size from which on blocks are mapped by
/// themselves. Films, mips and filters, which are made anew with every size of picture, then lie among small blocks, and
/// what is free between these stays with the program. Without the 16 MiB, memory would be returned and cleared again with every pass of
/// lavapipe, which allocates a pass's scene in pieces of 64 KiB: half of the processor time of drawing sprites into a small film.
pub(crate) fn limit_free_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        // Names and numbers are those of <malloc.h>.
        const M_TRIM_THRESHOLD: c_int = -1;
        const M_MMAP_THRESHOLD: c_int = -3;
        const M_ARENA_MAX: c_int = -8;
        unsafe extern "C" {
            fn mallopt(parameter: c_int, value: c_int) -> c_int;
        }
        for (parameter, value) in
            [(M_ARENA_MAX, 4), (M_MMAP_THRESHOLD, 1 << 20), (M_TRIM_THRESHOLD, 16 << 20)]
        {
            // SAFETY: the function takes the allocator's lock, and changes nothing where it refuses a value.
            let _ = unsafe { mallopt(parameter, value) };
        }
    }
}

/// Gives memory that is no longer in use back to the operating system: reading and building a large scene takes two to three times
/// what it holds in the end, and the allocator would keep much of that.
pub(crate) fn return_free_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        unsafe extern "C" {
            fn malloc_trim(pad: usize) -> c_int;
        }
        // SAFETY: the function has no precondition, and touches free memory only.
        let _ = unsafe { malloc_trim(0) };
    }
}
