//! Packs capture folders reproducibly: the same folder gives the same bytes.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use capture::Capture;
use capture::params::MANIFEST_FILE;
use tar::{Builder, Header};

use crate::error::AppError;
use crate::resources::captures::unpack::unwritable;

/// Permissions of packed files.
const MODE: u32 = 0o644;

/// Writes manifest and images of `capture` as the tar archive `target`.
pub(super) fn pack(capture: &Capture, target: &Path) -> Result<(), AppError> {
    let write = || -> std::io::Result<()> {
        let mut builder = Builder::new(BufWriter::new(File::create_new(target)?));
        let mut paths: Vec<_> = capture.files().into_iter().map(|file| file.path).collect();
        paths.push(MANIFEST_FILE.into());
        paths.sort();
        paths.dedup();
        for path in paths {
            append(&mut builder, &capture.folder, &path)?;
        }
        builder.into_inner()?.flush()
    };
    write().map_err(|cause| unwritable(&cause))
}

fn append(builder: &mut Builder<impl Write>, folder: &Path, path: &Path) -> std::io::Result<()> {
    let file = File::open(folder.join(path))?;
    let mut header = Header::new_ustar();
    header.set_size(file.metadata()?.len());
    header.set_mode(MODE);
    header.set_mtime(0);
    builder.append_data(&mut header, path, file)
}
