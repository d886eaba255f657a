//! Returns memory of large computations to the system.

/// Allocations from this size on are mappings of their own, which are returned to the system when freed: clouds and meshes
/// are. The points of one frame, one megabyte for five lines, are not: a scan allocates them several times per frame, and
/// the system clears every page of a new mapping (a scan of a million points took 1.4 times as long with 0.5 MiB).
#[cfg(target_env = "gnu")]
const LARGE_BYTES: std::ffi::c_int = 2 * 1024 * 1024;

/// Free memory that each of the C library's pools may keep: a few such allocations.
#[cfg(target_env = "gnu")]
const KEPT_BYTES: std::ffi::c_int = 8 * 1024 * 1024;

/// Fixes both thresholds; otherwise the C library raises them after a large allocation and would keep 100 MiB after one mesh.
#[cfg(target_env = "gnu")]
#[allow(unsafe_code, reason = "a function of the C library")]
pub fn return_large_blocks() {
    for (threshold, bytes) in [(libc::M_MMAP_THRESHOLD, LARGE_BYTES), (libc::M_TRIM_THRESHOLD, KEPT_BYTES)] {
        // SAFETY: called before other threads are started; a rejected value changes nothing.
        let accepted = unsafe { libc::mallopt(threshold, bytes) };
        debug_assert_eq!(accepted, 1, "the C library rejects a threshold of {bytes} bytes");
    }
}

/// Other C libraries return large blocks anyway.
#[cfg(not(target_env = "gnu"))]
pub fn return_large_blocks() {}
