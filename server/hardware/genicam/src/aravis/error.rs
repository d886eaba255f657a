//! Errors of the library as values.

use std::ffi::{CStr, CString, c_char};
use std::ptr;

use glib_sys::GError;

/// Message of the library.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct AravisError(pub String);

/// Calls a function that reports errors through a `GError`.
pub fn checked<T>(call: impl FnOnce(*mut *mut GError) -> T) -> Result<T, AravisError> {
    let mut error: *mut GError = ptr::null_mut();
    let value = call(&mut error);
    if error.is_null() {
        return Ok(value);
    }
    // SAFETY: a set error is a valid `GError` with a terminated message, owned by the caller, who frees it once.
    let message = unsafe {
        let message = text((*error).message);
        glib_sys::g_error_free(error);
        message
    };
    Err(AravisError(message))
}

/// Copies a string; null gives the empty one.
///
/// # Safety
/// `text` is null or a terminated string that lives as long as this call.
pub unsafe fn text(text: *const c_char) -> String {
    if text.is_null() {
        return String::new();
    }
    // SAFETY: not null, and terminated as required of the caller.
    unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
}

/// A C string for the library; truncated at a zero byte.
pub fn terminated(text: &str) -> CString {
    let until_zero: Vec<u8> = text.bytes().take_while(|&byte| byte != 0).collect();
    CString::new(until_zero).unwrap_or_default()
}
