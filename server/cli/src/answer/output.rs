//! Files and folders that commands write.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use pipeline::Failure;

/// Creates a folder with its parents.
pub fn create_folder(folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder).map_err(|error| Failure::unwritable(folder, &error))
}

/// Writes a file atomically.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let mut part = path.as_os_str().to_owned();
    part.push(".part");
    let part = PathBuf::from(part);
    std::fs::write(&part, bytes)
        .and_then(|()| std::fs::rename(&part, path))
        .map_err(|error| Failure::unwritable(path, &error))
}

/// One file name per image, from its stem; where stems collide, the name of the parent folder is prefixed.
pub fn file_names_after(images: &[PathBuf], extension: &str) -> Vec<String> {
    let stems: Vec<String> = images.iter().map(|image| part(image.file_stem())).collect();
    let with_parents: Vec<String> = images
        .iter()
        .zip(&stems)
        .map(|(image, stem)| match image.parent().map(|parent| part(parent.file_name())) {
            Some(parent) if !parent.is_empty() && occurrences(&stems, stem) > 1 => format!("{parent}-{stem}"),
            _ => stem.clone(),
        })
        .collect();
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    with_parents
        .iter()
        .map(|name| {
            let count = seen.entry(name).and_modify(|count| *count += 1).or_insert(1);
            if *count == 1 { format!("{name}.{extension}") } else { format!("{name}-{count}.{extension}") }
        })
        .collect()
}

fn part(name: Option<&std::ffi::OsStr>) -> String {
    name.map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

fn occurrences(names: &[String], wanted: &str) -> usize {
    names.iter().filter(|name| *name == wanted).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_named_after_their_images_and_never_collide() {
        let images = ["a/0.png", "b/0.png", "b/1.png", "b/1.tif", "2.png"].map(PathBuf::from);
        let names = file_names_after(&images, "csv");
        assert_eq!(names, ["a-0.csv", "b-0.csv", "b-1.csv", "b-1-2.csv", "2.csv"]);
    }
}
