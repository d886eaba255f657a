//! Paths allowed in a manifest: relative, and inside the capture folder even after symbolic links.

use std::path::{Component, Path};

/// Reason why `path`, as written in a manifest, must not be opened; `None` if it may be.
pub(crate) fn reason_outside(path: &Path) -> Option<&'static str> {
    if path.as_os_str().is_empty() {
        return Some("is empty");
    }
    if path.as_os_str().as_encoded_bytes().contains(&b'\\') {
        return Some("has a backslash (write / between folders)");
    }
    path.components().find_map(|component| match component {
        Component::Normal(_) | Component::CurDir => None,
        Component::ParentDir => Some("leaves the folder by \"..\""),
        Component::RootDir | Component::Prefix(_) => Some("is absolute"),
    })
}

/// Whether `path`, after following links, lies outside of `folder`. Both must exist.
pub(crate) fn links_outside(folder: &Path, path: &Path) -> std::io::Result<bool> {
    Ok(!folder.join(path).canonicalize()?.starts_with(folder.canonicalize()?))
}
