//! Counts allocations per thread in builds with `--features count-allocations`, for measurements only.

/// Whether this program counts.
pub const COUNTED: bool = cfg!(feature = "count-allocations");

/// Requests for memory by thread id, since the thread began.
#[cfg(not(feature = "count-allocations"))]
pub fn by_thread() -> std::collections::BTreeMap<i32, u64> {
    std::collections::BTreeMap::new()
}

#[cfg(feature = "count-allocations")]
pub use counting::by_thread;

#[cfg(feature = "count-allocations")]
#[allow(unsafe_code, reason = "an allocator cannot be written without; this one hands everything to the system's")]
mod counting {
    use std::alloc::{GlobalAlloc, Layout, System};
    use std::cell::Cell;
    use std::collections::BTreeMap;
    use std::sync::atomic::{AtomicI32, AtomicU64, AtomicUsize, Ordering};

    /// Threads counted separately; later ones share the last place.
    const THREADS: usize = 1024;

    static IDS: [AtomicI32; THREADS] = [const { AtomicI32::new(0) }; THREADS];
    static COUNTS: [AtomicU64; THREADS] = [const { AtomicU64::new(0) }; THREADS];
    static NEXT: AtomicUsize = AtomicUsize::new(0);

    thread_local! {
        static PLACE: Cell<usize> = const { Cell::new(usize::MAX) };
    }

    struct Counting;

    #[global_allocator]
    static ALLOCATOR: Counting = Counting;

    fn count() {
        let place = PLACE.with(|place| {
            if place.get() == usize::MAX {
                place.set(NEXT.fetch_add(1, Ordering::Relaxed).min(THREADS - 1));
                IDS[place.get()].store(nix::unistd::gettid().as_raw(), Ordering::Relaxed);
            }
            place.get()
        });
        COUNTS[place].fetch_add(1, Ordering::Relaxed);
    }

    // SAFETY: every request goes to the system's allocator as it came.
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

    /// Requests for memory by thread id, since the thread began.
    pub fn by_thread() -> BTreeMap<i32, u64> {
        let n = NEXT.load(Ordering::Relaxed).min(THREADS);
        let mut counts = BTreeMap::new();
        for (id, count) in IDS[..n].iter().zip(&COUNTS[..n]) {
            *counts.entry(id.load(Ordering::Relaxed)).or_default() += count.load(Ordering::Relaxed);
        }
        counts
    }
}
