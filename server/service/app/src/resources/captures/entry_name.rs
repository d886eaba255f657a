//! Names of archive entries: allowed targets, no two entries with the same one.

use std::collections::HashMap;
use std::path::PathBuf;

use crate::error::{AppError, ErrorKind};
use crate::resources::captures::limits::{DEPTH_LIMIT, NAME_LIMIT_BYTES};

/// The kind of entry at a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    File,
    Folder,
}

/// The paths used so far, in lower case: on some systems `A.png` and `a.png` are the same file.
#[derive(Debug, Default)]
pub(super) struct Places(HashMap<String, (String, Place)>);

impl Places {
    /// The target path of a file, relative to the folder.
    pub fn file(&mut self, name: &str) -> Result<PathBuf, AppError> {
        let parts = safe_parts(name)?;
        let (file, folders) = parts.split_last().ok_or_else(|| refused(name, "is empty"))?;
        self.folders(name, folders)?;
        self.take(name, &[folders, &[*file]].concat().join("/"), Place::File)?;
        Ok(parts.iter().collect())
    }

    /// The target path of a folder.
    pub fn folder(&mut self, name: &str) -> Result<PathBuf, AppError> {
        let parts = safe_parts(name)?;
        self.folders(name, &parts)?;
        Ok(parts.iter().collect())
    }

    fn folders(&mut self, name: &str, folders: &[&str]) -> Result<(), AppError> {
        if folders.len() > DEPTH_LIMIT {
            return Err(refused(name, &format!("lies deeper than {DEPTH_LIMIT} folders")));
        }
        (1..=folders.len()).try_for_each(|depth| self.take(name, &folders[..depth].join("/"), Place::Folder))
    }

    fn take(&mut self, name: &str, path: &str, place: Place) -> Result<(), AppError> {
        match self.0.get(&path.to_lowercase()) {
            None => {
                self.0.insert(path.to_lowercase(), (path.to_owned(), place));
                Ok(())
            }
            Some((taken, Place::Folder)) if taken == path && place == Place::Folder => Ok(()),
            Some((taken, _)) if taken == path => Err(refused(name, "occurs twice")),
            Some((taken, _)) => Err(refused(name, &format!("differs from {taken:?} only in letter case"))),
        }
    }
}

/// The parts of a relative name that stays inside its folder.
fn safe_parts(name: &str) -> Result<Vec<&str>, AppError> {
    if name.len() > NAME_LIMIT_BYTES {
        return Err(refused(name, &format!("is longer than {NAME_LIMIT_BYTES} bytes")));
    }
    if name.starts_with('/') {
        return Err(refused(name, "is absolute"));
    }
    if name.chars().any(|c| c.is_control() || c == '\\' || c == ':') {
        return Err(refused(name, "has a backslash, a colon or a control character"));
    }
    let parts: Vec<&str> = name.split('/').filter(|part| !part.is_empty() && *part != ".").collect();
    if parts.contains(&"..") {
        return Err(refused(name, "leaves the folder by \"..\""));
    }
    Ok(parts)
}

fn refused(name: &str, why: &str) -> AppError {
    let shown: String = name.chars().take(80).flat_map(char::escape_default).collect();
    AppError::new(ErrorKind::Impossible, format!("the archive's entry \"{shown}\" {why}"))
        .remedy("pack the capture folder itself, with plain file names")
        .at(shown)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn names_that_leave_the_folder_or_hide_something_are_refused() {
        let deep = "a/".repeat(DEPTH_LIMIT + 1) + "x.png";
        let long = "a".repeat(NAME_LIMIT_BYTES + 1);
        let names = ["../x.png", "a/../../x.png", "/etc/x", "a\\x.png", "C:x.png", "a\0b", "", ".", &deep, &long];
        for name in names {
            assert!(Places::default().file(name).is_err(), "{name:?}");
        }
        assert_eq!(Places::default().file("./a//b.png").unwrap(), PathBuf::from("a/b.png"));
    }

    #[test]
    fn two_entries_never_share_a_path() {
        for (first, second) in
            [("a.png", "a.png"), ("a.png", "A.PNG"), ("a", "a/b.png"), ("B/c", "b/d"), ("a/b", "a")]
        {
            let mut places = Places::default();
            places.file(first).unwrap();
            assert!(places.file(second).is_err(), "{first:?} {second:?}");
        }
        let mut places = Places::default();
        places.folder("a/").unwrap();
        places.file("a/b").unwrap();
        places.folder("a").unwrap();
        places.file("a/c").unwrap();
    }
}
