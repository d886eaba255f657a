//! A folder contains at most about a dozen entries; beyond, it mixes topics and becomes hard to search.

use std::path::{Path, PathBuf};

/// Greatest number of entries in a folder.
const MAX_ENTRIES: usize = 15;

/// Folders that may contain more, each with its reason.
const EXCEPTIONS: [(&str, &str); 3] = [
    ("server/docs/adr", "a numbered list, read by number and in the order of time"),
    ("web/src/text/de", "one file a page of the program, as in the other language"),
    ("web/src/text/en", "one file a page of the program, as in the other language"),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Every folder below `folder`, including itself, with its number of entries; hidden ones do not count.
fn folders(folder: &Path) -> Vec<(PathBuf, usize)> {
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let entries: Vec<PathBuf> =
        paths.filter(|path| !path.file_name().unwrap().to_string_lossy().starts_with('.')).collect();
    let mut found = vec![(folder.to_owned(), entries.len())];
    found.extend(entries.iter().filter(|path| path.is_dir()).flat_map(|path| folders(path)));
    found
}

/// The folders of sources and documents with more than [`MAX_ENTRIES`] entries, relative to `root`.
fn too_full(root: &Path) -> Vec<(String, usize)> {
    let all = ["server", "web/src"].into_iter().flat_map(|part| folders(&root.join(part)));
    let mut full: Vec<(String, usize)> = all
        .filter(|(_, n_entries)| *n_entries > MAX_ENTRIES)
        .map(|(path, n_entries)| (path.strip_prefix(root).unwrap().to_string_lossy().into_owned(), n_entries))
        .collect();
    full.sort();
    full
}

#[test]
fn no_folder_has_too_many_entries() {
    let mut full = too_full(&root());
    full.retain(|(folder, _)| EXCEPTIONS.iter().all(|(exception, _)| exception != folder));
    assert_eq!(full, [], "group them by topic, or add an exception with its reason");
}

#[test]
fn every_exception_is_still_one() {
    let full = too_full(&root());
    for (exception, _) in EXCEPTIONS {
        assert!(full.iter().any(|(folder, _)| folder == exception), "{exception} no longer needs an exception");
    }
}
