//! A capture folder: opened and validated as a whole, its images read one by one.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use vision::{CameraImage, CentrelineParams, GreyImage, WhiteLevel, scene_change};

use crate::channel::{ChannelBasis, LaserChannel};
use crate::checks::check_values;
use crate::contained_path::{links_outside, reason_outside};
use crate::error::CaptureError;
use crate::image_file::{Photograph, read_header, read_photograph, white_level_of};
use crate::json_text::{entry_at, entry_ended_at, first_not_finite};
use crate::known_keys::unknown_keys;
use crate::manifest::{Manifest, Scan};
use crate::params::{MANIFEST_FILE, MANIFEST_LIMIT_BYTES};
use crate::projector::MISSING;

/// Effect of JPEG compression, measured on drawn lines.
const LOSS: &str = "compression moves lines by 0.05 to 0.4 px, which sigma_px states only in \
    part; record PNG, TIFF or BMP to measure";

/// A validated capture folder.
#[derive(Debug, Clone, PartialEq)]
pub struct Capture {
    /// The folder.
    pub folder: PathBuf,
    /// Its manifest, validated.
    pub manifest: Manifest,
    /// Unknown keys and other ignored irregularities, formatted for the operator.
    pub warnings: Vec<String>,
    /// Whether any file has colour.
    has_colour: bool,
    /// Bits per sample of the files, 8 or 16.
    bits: u32,
    /// Selected on first use.
    channel: OnceLock<LaserChannel>,
    /// Determined on first use.
    white_level: OnceLock<WhiteLevel>,
}

/// An image the manifest names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedFile {
    /// Path of keys, as `poses[4].laser`.
    pub entry: String,
    /// Relative to the folder, as written.
    pub path: PathBuf,
    /// The part of the manifest that depends on it: `pose`, `laser image`, `stage view`, `frame`.
    removable: &'static str,
}

/// An image with the laser on, and its background (laser off).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LaserImage {
    /// Path of keys, as `poses[4].laser`.
    pub entry: String,
    /// Relative to the folder, as written.
    pub path: PathBuf,
    /// Entry and path of the background: its own, or the one of the whole capture.
    pub background: Option<(String, PathBuf)>,
    /// The line that was switched on alone.
    pub line: Option<i8>,
}

/// Properties of a capture's images, from their headers.
struct FileSummary {
    has_colour: bool,
    /// Bits per sample of each; 8 without any file.
    bits: u32,
    /// Of every JPEG.
    jpeg_qualities: Vec<u8>,
}

/// The warning about JPEG images of these qualities; `None` without any.
pub fn lossy_warning(qualities: &[u8]) -> Option<String> {
    let (worst, best) = (qualities.iter().min()?, qualities.iter().max()?);
    let quality = if worst == best { worst.to_string() } else { format!("{worst} to {best}") };
    let images = match qualities.len() {
        1 => "1 image is a JPEG".to_owned(),
        n => format!("{n} images are JPEG"),
    };
    Some(format!("{images} of quality {quality}: {LOSS}"))
}

impl Capture {
    /// Reads and validates `folder/capture.json` and the header of every image it names.
    ///
    /// Images are not decoded: truncation is detected by [`Capture::image`].
    ///
    /// # Errors
    /// [`CaptureError`] names the file, the entry and the remedy of the first problem.
    pub fn open(folder: &Path) -> Result<Self, CaptureError> {
        let file = folder.join(MANIFEST_FILE);
        let text = read_text(&file)?;
        let manifest = parse(&file, &text)?;
        check_values(&file, &manifest)?;
        let warnings = warnings(&file, &text)?;
        let (has_colour, bits, channel, white_level) = (false, 8, OnceLock::new(), OnceLock::new());
        let folder = folder.to_owned();
        let mut capture = Self { folder, manifest, warnings, has_colour, bits, channel, white_level };
        let FileSummary { has_colour, bits, jpeg_qualities } = capture.check_files()?;
        (capture.has_colour, capture.bits) = (has_colour, bits);
        let warning = lossy_warning(&jpeg_qualities).map(|warning| format!("{}: {warning}", file.display()));
        capture.warnings.extend(warning);
        Ok(capture)
    }

    /// The manifest's own path.
    pub fn manifest_path(&self) -> PathBuf {
        self.folder.join(MANIFEST_FILE)
    }

    /// Reads the image `path` (relative, as written in the manifest) named by `entry`: the grey levels of one channel,
    /// that of the laser ([`Capture::laser_channel`]) or, for a board, the corresponding one ([`Channel::for_boards`]).
    ///
    /// [`Channel::for_boards`]: vision::Channel::for_boards
    ///
    /// # Errors
    /// [`CaptureError::ImageMissing`], [`CaptureError::PathOutside`], [`CaptureError::ImageUnusable`] (of unknown
    /// format, truncated) or [`CaptureError::ImageSize`].
    pub fn image(&self, entry: &str, path: &Path) -> Result<GreyImage, CaptureError> {
        match self.photograph(entry, path)?.image {
            CameraImage::Grey(image) => Ok(image),
            CameraImage::Colour(image) => {
                let laser = self.laser_channel().channel;
                Ok(image.channel(if self.is_board(path) { laser.for_boards() } else { laser }))
            }
        }
    }

    /// Reads the image `path` named by `entry`, with all its colours; white is full scale ([`Capture::white_level`]).
    ///
    /// # Errors
    /// As [`Capture::image`].
    pub fn photograph(&self, entry: &str, path: &Path) -> Result<Photograph, CaptureError> {
        let named = NamedFile { entry: entry.to_owned(), path: path.to_owned(), removable: "entry" };
        self.check_path(&named)?;
        let photograph = read_photograph(&self.folder.join(path)).map_err(|cause| named.unusable(cause))?;
        self.check_size(&named, photograph.image.width(), photograph.image.height())?;
        Ok(photograph.scaled(self.white_level()))
    }

    /// The white level of the images: from the manifest, or that of a sensor with the bits that all images use,
    /// determined on first use.
    pub fn white_level(&self) -> WhiteLevel {
        *self.white_level.get_or_init(|| match (self.bits, self.manifest.camera.white_level) {
            (8, _) => WhiteLevel::FULL,
            (_, Some(level)) => WhiteLevel::new(level.get()),
            (_, None) => {
                let files: Vec<PathBuf> = self.files().iter().map(|file| self.folder.join(&file.path)).collect();
                white_level_of(&files)
            }
        })
    }

    /// The channel in which the images show the laser: from the manifest, or selected from some of the images on
    /// first use. Images that cannot be read are ignored.
    pub fn laser_channel(&self) -> &LaserChannel {
        self.channel.get_or_init(|| {
            if !self.has_colour {
                return LaserChannel::of_grey();
            }
            if let Some(channel) = self.manifest.camera.channel.fixed() {
                return LaserChannel { channel, basis: ChannelBasis::Given };
            }
            let lit = self.laser_images();
            let read = |idx: usize| {
                let LaserImage { entry, path, background, .. } = &lit[idx];
                let on = self.photograph(entry, path).ok()?.image;
                match background {
                    Some((entry, path)) => on.minus(&self.photograph(entry, path).ok()?.image),
                    None => Some(on),
                }
            };
            let along = |line_direction| CentrelineParams { line_direction, ..CentrelineParams::default() };
            let params: Vec<CentrelineParams> =
                self.manifest.projector.directions().into_iter().map(along).collect();
            LaserChannel::decided(lit.len(), read, &params)
        })
    }

    /// Every image with the laser on, poses first, with its background.
    pub fn laser_images(&self) -> Vec<LaserImage> {
        let manifest = &self.manifest;
        let poses = manifest.poses.iter().enumerate().flat_map(|(idx, pose)| {
            let (of, own) = (format!("poses[{idx}]"), pose.background.as_deref());
            let one = pose.laser.iter().map(|path| self.laser_image_of(&of, "laser", path, own, None));
            let several = (0..).zip(&pose.lasers).map(|(line, path): (i8, &PathBuf)| {
                self.laser_image_of(&of, &format!("lasers[{line}]"), path, own, Some(line))
            });
            one.chain(several).collect::<Vec<LaserImage>>()
        });
        let frames = manifest.scans.iter().enumerate().flat_map(|(scan_idx, scan)| {
            scan.frames.iter().enumerate().map(move |(idx, frame)| {
                let of = format!("scans[{scan_idx}].frames[{idx}]");
                self.laser_image_of(&of, "image", &frame.image, frame.background.as_deref(), frame.line)
            })
        });
        poses.chain(frames).collect()
    }

    fn laser_image_of(
        &self,
        of: &str,
        key: &str,
        path: &Path,
        background: Option<&Path>,
        line: Option<i8>,
    ) -> LaserImage {
        let own = background.map(|path| (format!("{of}.background"), path.to_owned()));
        let of_all = || self.manifest.background.clone().map(|path| ("background".to_owned(), path));
        let background = own.or_else(of_all);
        LaserImage { entry: format!("{of}.{key}"), path: path.to_owned(), background, line }
    }

    /// Reads the laser's channel of an image with the laser on, minus its background.
    ///
    /// # Errors
    /// As [`Capture::image`], for either image; [`CaptureError::BackgroundMismatch`] if they show different
    /// scenes.
    pub fn laser_image(&self, laser: &LaserImage) -> Result<GreyImage, CaptureError> {
        let Some((entry, path)) = &laser.background else { return self.image(&laser.entry, &laser.path) };
        let on = self.photograph(&laser.entry, &laser.path)?.image;
        let off = self.photograph(entry, path)?.image;
        match scene_change(&on, &off) {
            None => Ok(self.laser_light(&on, &off)),
            Some(change) => Err(CaptureError::BackgroundMismatch {
                entry: entry.clone(),
                path: path.clone(),
                of: laser.entry.clone(),
                change,
            }),
        }
    }

    /// The laser's channel of an image of this capture with the laser on, minus `off`.
    pub fn laser_light(&self, on: &CameraImage, off: &CameraImage) -> GreyImage {
        let difference = on.minus(off).expect("the images of a capture have one size and one bit depth");
        difference.channel(self.laser_channel().channel)
    }

    /// Whether it is an image of the board at normal exposure.
    fn is_board(&self, path: &Path) -> bool {
        let manifest = &self.manifest;
        let of_poses = manifest.poses.iter().map(|pose| &pose.board);
        of_poses.chain(manifest.stage_views.iter().map(|view| &view.board)).any(|board| board == path)
    }

    /// The scan with that name.
    ///
    /// # Errors
    /// [`CaptureError::UnknownScan`] lists the available names.
    pub fn scan(&self, name: &str) -> Result<&Scan, CaptureError> {
        self.manifest.scans.iter().find(|scan| scan.name == name).ok_or_else(|| CaptureError::UnknownScan {
            file: self.manifest_path(),
            name: name.to_owned(),
            available: self.manifest.scans.iter().map(|scan| scan.name.clone()).collect(),
        })
    }

    /// Every image named by the manifest, in the order of the manifest.
    pub fn files(&self) -> Vec<NamedFile> {
        let mut files = Vec::new();
        if let Some(background) = &self.manifest.background {
            files.push(NamedFile::new("background".to_owned(), background, "background"));
        }
        for (idx, pose) in self.manifest.poses.iter().enumerate() {
            files.push(NamedFile::new(format!("poses[{idx}].board"), &pose.board, "pose"));
            if let Some(laser) = &pose.laser {
                files.push(NamedFile::new(format!("poses[{idx}].laser"), laser, "pose"));
            }
            for (line, laser) in pose.lasers.iter().enumerate() {
                files.push(NamedFile::new(format!("poses[{idx}].lasers[{line}]"), laser, "pose"));
            }
            if let Some(background) = &pose.background {
                files.push(NamedFile::new(format!("poses[{idx}].background"), background, "background"));
            }
        }
        for (idx, view) in self.manifest.stage_views.iter().enumerate() {
            files.push(NamedFile::new(format!("stage_views[{idx}].board"), &view.board, "stage view"));
        }
        for (scan_idx, scan) in self.manifest.scans.iter().enumerate() {
            for (idx, frame) in scan.frames.iter().enumerate() {
                let entry = format!("scans[{scan_idx}].frames[{idx}].image");
                files.push(NamedFile::new(entry, &frame.image, "frame"));
                if let Some(background) = &frame.background {
                    let entry = format!("scans[{scan_idx}].frames[{idx}].background");
                    files.push(NamedFile::new(entry, background, "background"));
                }
            }
        }
        files
    }

    /// Checks every file's header.
    fn check_files(&self) -> Result<FileSummary, CaptureError> {
        let files = self.files();
        for named in &files {
            self.check_path(named)?;
        }
        let (mut has_colour, mut jpeg_qualities) = (false, Vec::new());
        let mut first: Option<(&NamedFile, u32)> = None;
        for named in &files {
            let header = read_header(&self.folder.join(&named.path)).map_err(|cause| named.unusable(cause))?;
            has_colour |= header.is_colour;
            jpeg_qualities.extend(header.jpeg_quality);
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
        let bits = first.map_or(8, |(_, bits)| bits);
        if bits == 8 && !files.is_empty() && self.manifest.camera.white_level.is_some() {
            return Err(CaptureError::WhiteLevelOfEightBits { file: self.manifest_path() });
        }
        Ok(FileSummary { has_colour, bits, jpeg_qualities })
    }

    /// Checks that the file exists and is inside the folder.
    fn check_path(&self, named: &NamedFile) -> Result<(), CaptureError> {
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
            Ok(true) => Err(outside("is a link to a path outside the folder")),
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

/// Writes `manifest` as `folder/capture.json`, replacing it atomically.
///
/// # Errors
/// [`CaptureError::Inaccessible`]; the values are checked as when reading.
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
    let warning = |key: String| format!("{}: unknown key {key} is ignored", file.display());
    Ok(unknown_keys(&value).into_iter().map(warning).collect())
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

/// Remedy for a projector without a description of its grating.
const GRATING_REMEDY: &str = "add it from the data sheets of laser and grating or, if the lines come from lasers \
    without a grating, write the kind \"planes\" and how many \"lines\" there are, or the kind \"cross\"";

/// The path of the missing key, if the parser stopped at one.
fn missing_entry(text: &str, cause: &serde_json::Error) -> Option<String> {
    let reported = cause.to_string();
    if let Some((entry, _)) = reported.strip_prefix(MISSING).and_then(|rest| rest.split_once('`')) {
        return Some(entry.to_owned());
    }
    let (key, _) = reported.strip_prefix("missing field `")?.split_once('`')?;
    Some(match entry_ended_at(text, cause.line(), cause.column()) {
        Some(object) => format!("{object}.{key}"),
        None => key.to_owned(),
    })
}
