//! Counts allocations per thread in builds with `--features count-allocations`, for measurements only.

/// Whether this build counts allocations.
pub const COUNTED: bool = cfg!(feature = "count-allocations");

/// Number of allocations by thread id, since the start of the thread.
#[cfg(not(feature = "count-allocations"))]
pub fn by_thread() -> std::collections::BTreeMap<i32, u64> {
    std::collections::BTreeMap::new()
}

#[cfg(feature = "count-allocations")]
pub use counting::by_thread;

#[cfg(feature = "count-allocations")]
#[allow(unsafe_code, reason = "required for an allocator; this one forwards everything to that of the system")]
mod counting {
    use std::alloc::{GlobalAlloc, Layout, System};
    use std::cell::Cell;
    use std::collections::BTreeMap;
    use std::sync::atomic::{AtomicI32, AtomicU64, AtomicUsize, Ordering};

    /// Threads counted separately; later ones share the last slot.
    const THREADS: usize = 1024;

    static IDS: [AtomicI32; THREADS] = [const { AtomicI32::new(0) }; THREADS];
    static COUNTS: [AtomicU64; THREADS] = [const { AtomicU64::new(0) }; THREADS];
    static NEXT: AtomicUsize = AtomicUsize::new(0);

    thread_local! {
        static SLOT: Cell<usize> = const { Cell::new(usize::MAX) };
    }

    struct Counting;

    #[global_allocator]
    static ALLOCATOR: Counting = Counting;

    fn count() {
        let slot = SLOT.with(|slot| {
            if slot.get() == usize::MAX {
                slot.set(NEXT.fetch_add(1, Ordering::Relaxed).min(THREADS - 1));
                IDS[slot.get()].store(nix::unistd::gettid().as_raw(), Ordering::Relaxed);
            }
            slot.get()
        });
        COUNTS[slot].fetch_add(1, Ordering::Relaxed);
    }

    // SAFETY: every call is forwarded unchanged to the system's allocator.
    unsafe impl GlobalAlloc for Counting {
        unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
            count();
            unsafe { System.alloc(layout) }
        }

        unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
            count();
            unsafe { System.alloc_zeroed(layout) }
        }

        unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
            count();
            unsafe { System.realloc(memory, layout, size) }
        }

        unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
            unsafe { System.dealloc(memory, layout) }
        }
    }

    /// Number of allocations by thread id, since the start of the thread.
    pub fn by_thread() -> BTreeMap<i32, u64> {
        let n = NEXT.load(Ordering::Relaxed).min(THREADS);
        let mut counts = BTreeMap::new();
        for (id, count) in IDS[..n].iter().zip(&COUNTS[..n]) {
            *counts.entry(id.load(Ordering::Relaxed)).or_default() += count.load(Ordering::Relaxed);
        }
        counts
    }
}
