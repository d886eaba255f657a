//! Extraction of corners and centrelines from the images of a capture, on all cores, with progress.

use std::borrow::Cow;
use std::path::Path;

use calibration::{CalibrationInput, NominalGrating, NominalProjector, PoseInput, StageViewInput};
use capture::{Capture, LaserImage, NominalPosition, Projector};
use optics::StagePosition;
use rayon::prelude::*;
use vision::{BoardCorners, CentrelineExtractor, Centrelines};

use crate::failure::Failure;
use crate::images::board::{board_geometry, board_remedy, find_board};
use crate::images::findings::{Finding, Findings, findings_of, pair_findings};
use crate::images::lines::mark_saturated;
use crate::images::projected::{lines_in, without_lines};
use crate::images::search::{Directions, LineSearch};
use crate::progress::{Reporter, Task};

/// The features for a calibration, and the images left out.
#[derive(Debug)]
pub struct Features {
    /// The input of the calibration.
    pub input: CalibrationInput,
    /// Images without a readable board or laser line, each with the reason.
    pub left_out: Vec<String>,
}

/// An image of the capture.
struct NamedImage<'a> {
    entry: String,
    path: &'a Path,
}

/// The result for an image, or why it cannot be used.
type Extracted<T> = Result<T, Failure>;

/// Reads every board image and laser image of the calibration part of `capture`.
///
/// An image without a whole board, or without a laser line, is left out and reported, provided that at least
/// `MIN_READABLE_FRACTION` of its kind can be read; otherwise the cause probably affects all images, and the
/// calibration is refused. With `leave_out_unreadable` it continues with any number of images. A damaged file is
/// always an error.
pub fn calibration_features(
    capture: &Capture,
    leave_out_unreadable: bool,
    reporter: &dyn Reporter,
) -> Result<Features, Failure> {
    let boards = board_images(capture);
    let laser_images = laser_images_of(capture, "poses[");
    let task = reporter.count("reading boards and laser lines", "images", boards.len() + laser_images.len());
    let (boards, lasers) = rayon::join(
        || for_all_images(&boards, reporter, &*task, |image| corners_of(capture, image)),
        || for_all_images(&laser_images, reporter, &*task, |image| lines_of_image(capture, image)),
    );
    drop(task);
    reporter.check_cancelled()?;
    let mut left_out = Vec::new();
    let boards = readable(boards, leave_out_unreadable, &mut left_out)?;
    let lasers: Vec<Option<LaserLines>> = readable(lasers, leave_out_unreadable, &mut left_out)?;
    let mut findings = Findings::default();
    let mut keep = |(image, found): (&LaserImage, Option<LaserLines>)| {
        found.map(|found| {
            findings.add(image, found.findings);
            found.lines
        })
    };
    let lasers: Vec<Option<Vec<Centrelines>>> = laser_images.iter().zip(lasers).map(&mut keep).collect();
    findings.warn("calibration", laser_images.len(), reporter);
    let manifest = &capture.manifest;
    let (mut boards, mut lasers) = (boards.into_iter(), lasers.into_iter());
    let mut poses = Vec::new();
    for pose in &manifest.poses {
        let corners = boards.next().flatten();
        let n_images = usize::from(pose.laser.is_some()) + pose.lasers.len();
        let lines: Vec<Centrelines> = lasers.by_ref().take(n_images).flatten().flatten().collect();
        let (single_line_images, together): (Vec<Centrelines>, Vec<Centrelines>) =
            lines.into_iter().partition(|lines| lines.lit_line.is_some());
        let centrelines = together.into_iter().next();
        if let Some(corners) = corners {
            poses.push(PoseInput {
                name: pose.board.display().to_string(),
                corners,
                centrelines,
                single_line_images,
            });
        }
    }
    let mut stage_views = Vec::new();
    for view in &manifest.stage_views {
        if let Some(corners) = boards.next().flatten() {
            let name = view.board.display().to_string();
            stage_views.push(StageViewInput { name, corners, position: stage_position(view.position()) });
        }
    }
    Ok(Features { input: input(capture, poses, stage_views), left_out })
}

/// The lines of an image, in the frames that its projector expects, and what else was found in it.
struct LaserLines {
    lines: Vec<Centrelines>,
    findings: Vec<Finding>,
}

impl LaserLines {
    fn of(capture: &Capture, laser: &LaserImage, extractor: &mut CentrelineExtractor) -> Result<Self, Failure> {
        let projector = &capture.manifest.projector;
        let channel = capture.laser_channel().channel;
        let photograph = capture.photograph(&laser.entry, &laser.path)?.image;
        let off = match &laser.background {
            Some((entry, path)) => Some(capture.photograph(entry, path)?.image),
            None => None,
        };
        let image = match &off {
            Some(off) => capture.laser_light(&photograph, off),
            None => photograph.channel(channel),
        };
        let mut lines = lines_in(&image, projector, laser.line, extractor);
        lines.iter_mut().for_each(|lines| mark_saturated(lines, &photograph, channel, off.is_some()));
        let all = match &lines[..] {
            [only] => Cow::Borrowed(only),
            several => Cow::Owned(Centrelines {
                segments: several.iter().flat_map(|lines| lines.segments.iter().cloned()).collect(),
                ..Centrelines::default()
            }),
        };
        let directions = match &lines[..] {
            [only] => Directions::One(only.direction),
            _ => Directions::Both,
        };
        let search = LineSearch::of(channel, directions);
        let n_points = all.segments.iter().map(|segment| segment.points.len()).sum();
        let pair = off.and_then(|off| pair_findings(&photograph, &off, n_points, &search));
        // Edges in the difference would be detected as lines.
        if let Some(finding) = pair.as_ref().filter(|finding| finding.prevents_subtraction()) {
            return Ok(Self { lines: without_lines(projector, laser.line), findings: vec![finding.clone()] });
        }
        let mut findings = findings_of(&image, &all, &search);
        findings.extend(pair);
        Ok(Self { lines, findings })
    }

    /// What prevents that the background is subtracted.
    fn unusable(&self) -> Option<&Finding> {
        self.findings.iter().find(|finding| finding.prevents_subtraction())
    }
}

/// Passes the centrelines of every frame of a scan to `take` with the index of its image, in the order of the
/// frames; few frames are in memory at a time. An image of a cross gives two frames, one for each line.
pub fn scan_centrelines(
    capture: &Capture,
    name: &str,
    reporter: &dyn Reporter,
    mut take: impl FnMut(usize, Centrelines) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let scan = capture.scan(name)?;
    let scan_idx = capture.manifest.scans.iter().position(|other| std::ptr::eq(other, scan)).unwrap_or(0);
    let images = laser_images_of(capture, &format!("scans[{scan_idx}]."));
    let task = reporter.count(&format!("reading scan {name}"), "frames", images.len());
    let images: Vec<(usize, LaserImage)> = images.into_iter().enumerate().collect();
    let mut findings = Findings::default();
    for batch in images.chunks(IMAGES_PER_BATCH) {
        let found: Result<Vec<(usize, LaserLines)>, Failure> = batch
            .par_iter()
            .map_init(CentrelineExtractor::default, |extractor, (idx, laser)| {
                reporter.check_cancelled()?;
                let lines = LaserLines::of(capture, laser, extractor)?;
                task.step();
                Ok((*idx, lines))
            })
            .collect();
        for ((_, image), (idx, found)) in batch.iter().zip(found?) {
            findings.add(image, found.findings);
            found.lines.into_iter().try_for_each(|lines| take(idx, lines))?;
        }
    }
    findings.warn(&format!("scan {name}"), images.len(), reporter);
    Ok(())
}

/// Images of a scan read at a time: enough for many cores.
const IMAGES_PER_BATCH: usize = 64;

/// Applies `find` to every image on all cores; results in the order of the images.
fn for_all_images<P: Sync, T: Send>(
    images: &[P],
    reporter: &dyn Reporter,
    task: &dyn Task,
    find: impl Fn(&P) -> Extracted<T> + Sync,
) -> Vec<Extracted<T>> {
    images
        .par_iter()
        .map(|image| {
            reporter.check_cancelled()?;
            let found = find(image);
            task.step();
            found
        })
        .collect()
}

/// The features of the images of one kind; `None` for an image left out, which is added to `left_out` with the
/// reason.
fn readable<T>(
    found: Vec<Extracted<T>>,
    leave_out_unreadable: bool,
    left_out: &mut Vec<String>,
) -> Result<Vec<Option<T>>, Failure> {
    let n_needed = (MIN_READABLE_FRACTION * found.len() as f64).ceil() as usize;
    let n_readable = found.iter().filter(|found| found.is_ok()).count();
    let may_leave_out = leave_out_unreadable || n_readable >= n_needed;
    let keep = |found: Extracted<T>| match found {
        Ok(found) => Ok(Some(found)),
        Err(failure) if may_leave_out && failure.is_about_content() => {
            left_out.push(failure.what().to_owned());
            Ok(None)
        }
        Err(failure) => Err(failure),
    };
    found.into_iter().map(keep).collect()
}

/// Fraction of the board images, and of the laser images, that must be readable: single images may be bad, but if
/// most are, the content is missing or described wrongly.
const MIN_READABLE_FRACTION: f64 = 0.5;

fn board_images(capture: &Capture) -> Vec<NamedImage<'_>> {
    let poses = capture.manifest.poses.iter().enumerate();
    let views = capture.manifest.stage_views.iter().enumerate();
    poses
        .map(|(idx, pose)| NamedImage { entry: format!("poses[{idx}].board"), path: &pose.board })
        .chain(
            views.map(|(idx, view)| NamedImage { entry: format!("stage_views[{idx}].board"), path: &view.board }),
        )
        .collect()
}

/// The images with the laser on whose entries have this prefix.
fn laser_images_of(capture: &Capture, prefix: &str) -> Vec<LaserImage> {
    capture.laser_images().into_iter().filter(|image| image.entry.starts_with(prefix)).collect()
}

fn corners_of(capture: &Capture, named: &NamedImage) -> Extracted<BoardCorners> {
    let image = capture.image(&named.entry, named.path)?;
    let target = &capture.manifest.target;
    find_board(&image, target)
        .map_err(|error| unreadable(capture, named, &error.to_string(), &board_remedy(&error, target)))
}

fn lines_of_image(capture: &Capture, laser: &LaserImage) -> Extracted<LaserLines> {
    let named = &NamedImage { entry: laser.entry.clone(), path: &laser.path };
    let found = LaserLines::of(capture, laser, &mut CentrelineExtractor::default())?;
    if let Some(finding) = found.unusable() {
        let remedy = "use the image of the same pose with the laser off as its \"background\", or none";
        return Err(unreadable(capture, named, &finding.to_string(), remedy));
    }
    // A line that is lit alone need not meet every board.
    if found.lines.iter().all(|lines| lines.segments.is_empty()) && laser.line.is_none() {
        let remedy = "check that the laser was on and exposed long enough, or remove this \"laser\" from the pose: \
                      the pose is then used for the camera only";
        let suspected = found.findings.iter().map(|finding| format!("; {finding}")).collect::<String>();
        return Err(unreadable(capture, named, &format!("no laser line was found{suspected}"), remedy));
    }
    Ok(found)
}

fn unreadable(capture: &Capture, named: &NamedImage, why: &str, remedy: &str) -> Failure {
    Failure::bad_input(format!("{} ({}): {why}", named.path.display(), named.entry))
        .in_file(&capture.manifest_path())
        .at_entry(&named.entry)
        .remedy(format!("{remedy}; --leave-out-unreadable calibrates from the others, however few"))
        .about_content()
}

fn input(capture: &Capture, poses: Vec<PoseInput>, stage_views: Vec<StageViewInput>) -> CalibrationInput {
    let manifest = &capture.manifest;
    CalibrationInput {
        width_px: manifest.camera.width_px,
        height_px: manifest.camera.height_px,
        board: board_geometry(&manifest.target),
        projector: NominalProjector {
            grating: match &manifest.projector {
                Projector::Grating(grating) => Some(NominalGrating {
                    wavelength_nm: grating.wavelength_nm,
                    lines_per_mm: grating.grating_lines_per_mm,
                }),
                Projector::Planes(_) | Projector::Cross(_) => None,
            },
            orders: manifest.projector.orders(),
        },
        poses,
        stage_views,
        angle_sigma_deg: manifest.stage.angle_sigma_deg,
    }
}

/// The stage position stated by the manifest.
pub fn stage_position(position: NominalPosition) -> StagePosition {
    match position {
        NominalPosition::PositionMm(position_mm) => StagePosition::LinearMm(position_mm),
        NominalPosition::AngleDeg(angle_deg) => StagePosition::RotaryDeg(angle_deg),
    }
}
