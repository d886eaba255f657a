//! A capture of any length from the scan images of another one: a load for the service, not a scan of a real part.

use std::path::Path;

use capture::{Capture, Frame, NominalPosition, Scan, write_manifest};

use pipeline::Failure;

/// Distance between its frames, mm: that of a station at 500 frames/s and 25 mm/s.
pub const STEP_MM: f64 = 0.05;

/// Name of its only scan.
pub const SCAN: &str = "load";

/// Writes a capture of `n_frames` frames into `folder`: all scan images of `capture`, repeatedly forwards and backwards,
/// each at its own position. Returns the number of different images.
pub fn write_load(capture: &Path, n_frames: usize, folder: &Path) -> Result<usize, Failure> {
    let source = Capture::open(capture)?;
    let mut manifest = source.manifest.clone();
    let images: Vec<_> = manifest.scans.iter().flat_map(|scan| &scan.frames).map(|f| f.image.clone()).collect();
    if images.is_empty() {
        return Err(Failure::bad_input("the capture contains no scan")
            .in_file(capture)
            .remedy("use a capture with a scan"));
    }
    for image in &images {
        let to = folder.join(image);
        let parent = to.parent().unwrap_or(folder);
        std::fs::create_dir_all(parent).map_err(|cause| Failure::unwritable(parent, &cause))?;
        std::fs::copy(source.folder.join(image), &to).map_err(|cause| Failure::unwritable(&to, &cause))?;
    }
    let frame = |idx: usize| {
        let image = images[forth_and_back(idx, images.len())].clone();
        Frame::new(image, NominalPosition::PositionMm(idx as f64 * STEP_MM))
    };
    let frames = (0..n_frames).map(frame).collect();
    let scan = Scan { name: SCAN.to_owned(), frames };
    (manifest.scans, manifest.poses, manifest.stage_views) = (vec![scan], Vec::new(), Vec::new());
    write_manifest(folder, &manifest)?;
    Ok(images.len())
}

/// 0, 1, … n − 1, n − 2, … 1, 0, 1, …
fn forth_and_back(idx: usize, n: usize) -> usize {
    let round = (2 * n).saturating_sub(2).max(1);
    let at = idx % round;
    if at < n { at } else { round - at }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_repeat_forwards_and_backwards() {
        let order: Vec<usize> = (0..9).map(|idx| forth_and_back(idx, 4)).collect();
        assert_eq!(order, [0, 1, 2, 3, 2, 1, 0, 1, 2]);
        assert_eq!(forth_and_back(5, 1), 0);
    }
}
