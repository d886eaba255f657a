//! Memory that was taken for one large computation is given back when it ends.

/// From here on a request for this much is a mapping of its own, which goes back to the system at once when it is freed:
/// half a picture of one megapixel, so that clouds and meshes are meant and frames, which are used again, cost nothing.
#[cfg(target_env = "gnu")]
const LARGE_BYTES: std::ffi::c_int = 512 * 1024;

/// Keeps the C library from raising that limit automatically: after one mesh it would keep 100 MiB for the next.
#[cfg(target_env = "gnu")]
#[allow(unsafe_code, reason = "a function of the C library")]
pub fn give_large_blocks_back() {
    // SAFETY: called before there are other threads; a value that is not accepted changes nothing.
    let accepted = unsafe { libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE_BYTES) };
    debug_assert_eq!(accepted, 1, "the C library refuses a threshold of {LARGE_BYTES} bytes");
}

/// Other C libraries give back by themselves.
#[cfg(not(target_env = "gnu"))]
pub fn give_large_blocks_back() {}
