//! Returns memory of large computations to the system.

/// Allocations from this size on are mappings of their own, which are returned to the system when freed. It is half an
/// image of one megapixel: clouds and meshes are returned, and frames, which are reused, cost nothing.
#[cfg(target_env = "gnu")]
const LARGE_BYTES: std::ffi::c_int = 512 * 1024;

/// Fixes the threshold; otherwise the C library raises it after a large allocation and would keep 100 MiB after one mesh.
#[cfg(target_env = "gnu")]
#[allow(unsafe_code, reason = "a function of the C library")]
pub fn return_large_blocks() {
    // SAFETY: called before other threads are started; a rejected value changes nothing.
    let accepted = unsafe { libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE_BYTES) };
    debug_assert_eq!(accepted, 1, "the C library rejects a threshold of {LARGE_BYTES} bytes");
}

/// Other C libraries return large blocks anyway.
#[cfg(not(target_env = "gnu"))]
pub fn return_large_blocks() {}
