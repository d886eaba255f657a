//! A capture folder: opened and validated as a whole, its images read one by one.

use std::io::Read;
use std::path::{Path, PathBuf};

use vision::GreyImage;

use crate::checks::check_values;
use crate::contained_path::{links_outside, reason_outside};
use crate::error::CaptureError;
use crate::image_file::{read_capture_header, read_capture_image};
use crate::json_text::{entry_at, entry_ended_at, first_not_finite};
use crate::known_keys::unknown_keys;
use crate::manifest::{Manifest, Scan};
use crate::params::{MANIFEST_FILE, MANIFEST_LIMIT_BYTES};
use crate::projector::MISSING;

/// A validated capture folder.
#[derive(Debug, Clone, PartialEq)]
pub struct Capture {
    /// The folder.
    pub folder: PathBuf,
    /// Its manifest, validated.
    pub manifest: Manifest,
    /// Unknown keys and other oddities that were ignored, in words for the operator.
    pub warnings: Vec<String>,
}

/// An image the manifest names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedFile {
    /// Path of keys, as `poses[4].laser`.
    pub entry: String,
    /// Relative to the folder, as written.
    pub path: PathBuf,
    /// What would have to leave the manifest with it: `pose`, `laser image`, `stage view`, `frame`.
    removable: &'static str,
}

impl Capture {
    /// Reads and validates `folder/capture.json` and the header of every image it names.
    ///
    /// Images are not decoded: a truncated one shows in [`Capture::image`].
    ///
    /// # Errors
    /// [`CaptureError`] names the file, the entry and the remedy of the first thing that is wrong.
    pub fn open(folder: &Path) -> Result<Self, CaptureError> {
        let file = folder.join(MANIFEST_FILE);
        let text = read_text(&file)?;
        let manifest = parse(&file, &text)?;
        check_values(&file, &manifest)?;
        let warnings = warnings(&file, &text)?;
        let capture = Self { folder: folder.to_owned(), manifest, warnings };
        capture.check_files()?;
        Ok(capture)
    }

    /// The manifest's own path.
    pub fn manifest_path(&self) -> PathBuf {
        self.folder.join(MANIFEST_FILE)
    }

    /// Reads the image `path` (relative, as written in the manifest) that `entry` names.
    ///
    /// # Errors
    /// [`CaptureError::ImageMissing`], [`CaptureError::PathOutside`], [`CaptureError::ImageUnusable`] (not PNG or
    /// TIFF, colour, truncated) or [`CaptureError::ImageSize`].
    pub fn image(&self, entry: &str, path: &Path) -> Result<GreyImage, CaptureError> {
        let named = NamedFile { entry: entry.to_owned(), path: path.to_owned(), removable: "entry" };
        self.check_place(&named)?;
        let image = read_capture_image(&self.folder.join(path)).map_err(|cause| named.unusable(cause))?;
        self.check_size(&named, image.width(), image.height())?;
        Ok(image)
    }

    /// The scan of that name.
    ///
    /// # Errors
    /// [`CaptureError::UnknownScan`] lists the names there are.
    pub fn scan(&self, name: &str) -> Result<&Scan, CaptureError> {
        self.manifest.scans.iter().find(|scan| scan.name == name).ok_or_else(|| CaptureError::UnknownScan {
            file: self.manifest_path(),
            name: name.to_owned(),
            available: self.manifest.scans.iter().map(|scan| scan.name.clone()).collect(),
        })
    }

    /// Every image the manifest names, in its order.
    pub fn files(&self) -> Vec<NamedFile> {
        let mut files = Vec::new();
        for (idx, pose) in self.manifest.poses.iter().enumerate() {
            files.push(NamedFile::new(format!("poses[{idx}].board"), &pose.board, "pose"));
            if let Some(laser) = &pose.laser {
                files.push(NamedFile::new(format!("poses[{idx}].laser"), laser, "pose"));
            }
        }
        for (idx, view) in self.manifest.stage_views.iter().enumerate() {
            files.push(NamedFile::new(format!("stage_views[{idx}].board"), &view.board, "stage view"));
        }
        for (scan_idx, scan) in self.manifest.scans.iter().enumerate() {
            for (idx, frame) in scan.frames.iter().enumerate() {
                let entry = format!("scans[{scan_idx}].frames[{idx}].image");
                files.push(NamedFile::new(entry, &frame.image, "frame"));
            }
        }
        files
    }

    fn check_files(&self) -> Result<(), CaptureError> {
        let files = self.files();
        for named in &files {
            self.check_place(named)?;
        }
        let mut first: Option<(&NamedFile, u32)> = None;
        for named in &files {
            let header =
                read_capture_header(&self.folder.join(&named.path)).map_err(|cause| named.unusable(cause))?;
            self.check_size(named, header.width_px, header.height_px)?;
            let (first, first_bits) = *first.get_or_insert((named, header.bits));
            if header.bits != first_bits {
                return Err(CaptureError::MixedBitDepth {
                    entry: named.entry.clone(),
                    path: named.path.clone(),
                    bits: header.bits,
                    first_entry: first.entry.clone(),
                    first_bits,
                });
            }
        }
        Ok(())
    }

    /// Inside the folder, and there.
    fn check_place(&self, named: &NamedFile) -> Result<(), CaptureError> {
        let outside = |reason| CaptureError::PathOutside {
            file: self.manifest_path(),
            entry: named.entry.clone(),
            path: named.path.clone(),
            reason,
        };
        if let Some(reason) = reason_outside(&named.path) {
            return Err(outside(reason));
        }
        match links_outside(&self.folder, &named.path) {
            Ok(false) => Ok(()),
            Ok(true) => Err(outside("is a link to a place outside the folder")),
            Err(cause) if cause.kind() == std::io::ErrorKind::NotFound => Err(CaptureError::ImageMissing {
                file: self.manifest_path(),
                entry: named.entry.clone(),
                path: named.path.clone(),
                removable: named.removable,
            }),
            Err(cause) => Err(CaptureError::Inaccessible { file: self.folder.join(&named.path), cause }),
        }
    }

    fn check_size(&self, named: &NamedFile, width_px: usize, height_px: usize) -> Result<(), CaptureError> {
        let camera = self.manifest.camera;
        if (width_px, height_px) == (camera.width_px, camera.height_px) {
            return Ok(());
        }
        Err(CaptureError::ImageSize {
            entry: named.entry.clone(),
            path: named.path.clone(),
            width_px,
            height_px,
            camera_width_px: camera.width_px,
            camera_height_px: camera.height_px,
        })
    }
}

impl NamedFile {
    fn new(entry: String, path: &Path, removable: &'static str) -> Self {
        Self { entry, path: path.to_owned(), removable }
    }

    fn unusable(&self, cause: crate::ImageFileError) -> CaptureError {
        CaptureError::ImageUnusable { entry: self.entry.clone(), path: self.path.clone(), cause: Box::new(cause) }
    }
}

/// Writes `manifest` as `folder/capture.json`, replacing it in one step.
///
/// # Errors
/// [`CaptureError::Inaccessible`]; the values are checked as on reading.
pub fn write_manifest(folder: &Path, manifest: &Manifest) -> Result<(), CaptureError> {
    let file = folder.join(MANIFEST_FILE);
    check_values(&file, manifest)?;
    let mut text = serde_json::to_string_pretty(manifest).map_err(|cause| malformed(&file, "", cause))?;
    text.push('\n');
    let draft = folder.join(format!("{MANIFEST_FILE}.part"));
    std::fs::write(&draft, text)
        .and_then(|()| std::fs::rename(&draft, &file))
        .map_err(|cause| CaptureError::Inaccessible { file, cause })
}

fn read_text(file: &Path) -> Result<String, CaptureError> {
    let inaccessible = |cause: std::io::Error| match cause.kind() {
        std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory => {
            CaptureError::ManifestMissing { file: file.to_owned() }
        }
        _ => CaptureError::Inaccessible { file: file.to_owned(), cause },
    };
    let handle = std::fs::File::open(file).map_err(inaccessible)?;
    let size_bytes = handle.metadata().map_err(inaccessible)?.len();
    if size_bytes > MANIFEST_LIMIT_BYTES {
        let limit_bytes = MANIFEST_LIMIT_BYTES;
        return Err(CaptureError::ManifestTooLarge { file: file.to_owned(), size_bytes, limit_bytes });
    }
    let mut text = String::new();
    handle.take(MANIFEST_LIMIT_BYTES).read_to_string(&mut text).map_err(inaccessible)?;
    Ok(text)
}

fn parse(file: &Path, text: &str) -> Result<Manifest, CaptureError> {
    if let Some(found) = first_not_finite(text) {
        return Err(CaptureError::NotFinite {
            file: file.to_owned(),
            line: found.line,
            entry: found.entry,
            found: found.found,
        });
    }
    serde_json::from_str(text).map_err(|cause| malformed(file, text, cause))
}

fn warnings(file: &Path, text: &str) -> Result<Vec<String>, CaptureError> {
    let value = serde_json::from_str(text).map_err(|cause| malformed(file, text, cause))?;
    let told = |key: String| format!("{}: unknown key {key} is ignored", file.display());
    Ok(unknown_keys(&value).into_iter().map(told).collect())
}

fn malformed(file: &Path, text: &str, cause: serde_json::Error) -> CaptureError {
    let (line, column) = (cause.line(), cause.column());
    match missing_entry(text, &cause) {
        Some(entry) => {
            let remedy = match entry.as_str() {
                "projector.wavelength_nm" | "projector.grating_lines_per_mm" | "projector.orders" => {
                    GRATING_REMEDY
                }
                _ => "add it as described in capture.schema.json",
            };
            CaptureError::EntryMissing { file: file.to_owned(), line, entry, remedy }
        }
        None => {
            let entry = entry_at(text, line, column);
            CaptureError::Malformed { file: file.to_owned(), line, column, entry, cause }
        }
    }
}

/// What to do about a projector whose grating is not described.
const GRATING_REMEDY: &str = "add it from the data sheets of laser and grating or, if the lines come from lasers \
    without a grating, write the kind \"planes\" and how many \"lines\" there are";

/// The path of the key that the parser missed, if that is what it stopped at.
fn missing_entry(text: &str, cause: &serde_json::Error) -> Option<String> {
    let told = cause.to_string();
    if let Some((entry, _)) = told.strip_prefix(MISSING).and_then(|rest| rest.split_once('`')) {
        return Some(entry.to_owned());
    }
    let (key, _) = told.strip_prefix("missing field `")?.split_once('`')?;
    Some(match entry_ended_at(text, cause.line(), cause.column()) {
        Some(object) => format!("{object}.{key}"),
        None => key.to_owned(),
    })
}
