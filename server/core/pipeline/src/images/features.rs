//! Pictures of a capture to corners and centrelines, on all cores, with progress.

use std::path::Path;

use calibration::{CalibrationInput, NominalGrating, NominalProjector, PoseInput, StageViewInput};
use capture::{Capture, LaserImage, Projector, StagePlace};
use optics::StagePosition;
use rayon::prelude::*;
use vision::{BoardCorners, CentrelineExtractor, Centrelines, GreyImage};

use crate::failure::Failure;
use crate::pictures::board::{board_geometry, board_remedy, find_board};
use crate::pictures::findings::{Finding, room_finding};
use crate::pictures::projected::{lines_in, without_lines};
use crate::progress::{Reporter, Task};

/// The features for a calibration, and the pictures left out.
#[derive(Debug)]
pub struct Features {
    /// The input of the calibration.
    pub input: CalibrationInput,
    /// Pictures without a readable board or laser line, each with the reason.
    pub left_out: Vec<String>,
}

/// One picture of the capture.
struct Picture<'a> {
    entry: String,
    path: &'a Path,
}

/// The result for a picture, or why it cannot be used.
type Found<T> = Result<T, Failure>;

/// Reads every board and laser picture of the calibration part of `capture`.
///
/// A picture without a whole board, or without a laser line, is left out and reported, as long as at least
/// `MIN_READABLE_SHARE` of its kind can be read: otherwise the cause probably affects all pictures, and the calibration
/// is refused. With `leave_out_unreadable` it continues with however few there are. A damaged file is always an error.
pub fn calibration_features(
    capture: &Capture,
    leave_out_unreadable: bool,
    reporter: &dyn Reporter,
) -> Result<Features, Failure> {
    let boards = board_pictures(capture);
    let lasers = pictures_of(capture, "poses[");
    let task = reporter.count("reading boards and laser lines", "pictures", boards.len() + lasers.len());
    let (boards, lasers) = rayon::join(
        || all(&boards, reporter, &*task, |picture| corners_of(capture, picture)),
        || all(&lasers, reporter, &*task, |picture| lines_of_picture(capture, picture)),
    );
    drop(task);
    reporter.check_cancelled()?;
    let mut left_out = Vec::new();
    let boards = readable(boards, leave_out_unreadable, &mut left_out)?;
    let lasers = readable(lasers, leave_out_unreadable, &mut left_out)?;
    let manifest = &capture.manifest;
    let (mut boards, mut lasers) = (boards.into_iter(), lasers.into_iter());
    let mut poses = Vec::new();
    for pose in &manifest.poses {
        let corners = boards.next().flatten();
        let n_pictures = usize::from(pose.laser.is_some()) + pose.lasers.len();
        let lines: Vec<Centrelines> = lasers.by_ref().take(n_pictures).flatten().flatten().collect();
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
            stage_views.push(StageViewInput { name, corners, position: stage_position(view.place()) });
        }
    }
    Ok(Features { input: input(capture, poses, stage_views), left_out })
}

/// Takes the centrelines of every frame of a scan with the number of its picture, in the order of the frames; few frames
/// are in memory at a time. A picture of a cross is two frames, one for each line.
pub fn scan_centrelines(
    capture: &Capture,
    name: &str,
    reporter: &dyn Reporter,
    mut take: impl FnMut(usize, Centrelines) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let scan = capture.scan(name)?;
    let scan_idx = capture.manifest.scans.iter().position(|other| std::ptr::eq(other, scan)).unwrap_or(0);
    let pictures = pictures_of(capture, &format!("scans[{scan_idx}]."));
    let task = reporter.count(&format!("reading scan {name}"), "frames", pictures.len());
    let pictures: Vec<(usize, LaserImage)> = pictures.into_iter().enumerate().collect();
    for some in pictures.chunks(PICTURES_AT_ONCE) {
        let found: Result<Vec<(usize, Vec<Centrelines>)>, Failure> = some
            .par_iter()
            .map_init(CentrelineExtractor::default, |extractor, (idx, picture)| {
                reporter.check_cancelled()?;
                let projector = &capture.manifest.projector;
                let lines = match laser_light(capture, picture)? {
                    LaserLight::Image(image) => lines_in(&image, projector, picture.line, extractor),
                    // Its edges would be taken for lines: such a frame shows nothing, and is named.
                    LaserLight::Unknown(finding) => {
                        reporter.warn(&format!(
                            "{} ({}): {finding}; left out",
                            picture.path.display(),
                            picture.entry
                        ));
                        without_lines(projector, picture.line)
                    }
                };
                task.step();
                Ok((*idx, lines))
            })
            .collect();
        let frames = found?.into_iter().flat_map(|(idx, lines)| lines.into_iter().map(move |lines| (idx, lines)));
        frames.into_iter().try_for_each(|(idx, lines)| take(idx, lines))?;
    }
    Ok(())
}

/// Pictures of a scan read at a time: enough for many cores.
const PICTURES_AT_ONCE: usize = 64;

/// Applies `find` to every picture on all cores; results in the order of the pictures.
fn all<P: Sync, T: Send>(
    pictures: &[P],
    reporter: &dyn Reporter,
    task: &dyn Task,
    find: impl Fn(&P) -> Found<T> + Sync,
) -> Vec<Found<T>> {
    pictures
        .par_iter()
        .map(|picture| {
            reporter.check_cancelled()?;
            let found = find(picture);
            task.step();
            found
        })
        .collect()
}

/// The features of the pictures of one kind; `None` for one left out, which is added to `left_out` with the reason.
fn readable<T>(
    found: Vec<Found<T>>,
    leave_out_unreadable: bool,
    left_out: &mut Vec<String>,
) -> Result<Vec<Option<T>>, Failure> {
    let n_needed = (MIN_READABLE_SHARE * found.len() as f64).ceil() as usize;
    let n_readable = found.iter().filter(|found| found.is_ok()).count();
    let check_cancelled = leave_out_unreadable || n_readable >= n_needed;
    let keep = |found: Found<T>| match found {
        Ok(found) => Ok(Some(found)),
        Err(failure) if check_cancelled && failure.is_about_content() => {
            left_out.push(failure.what().to_owned());
            Ok(None)
        }
        Err(failure) => Err(failure),
    };
    found.into_iter().map(keep).collect()
}

/// Fraction of the board pictures, and of the laser pictures, that must be readable: single pictures may be bad, but if
/// most are, the content is missing or described wrongly.
const MIN_READABLE_SHARE: f64 = 0.5;

fn board_pictures(capture: &Capture) -> Vec<Picture<'_>> {
    let poses = capture.manifest.poses.iter().enumerate();
    let views = capture.manifest.stage_views.iter().enumerate();
    poses
        .map(|(idx, pose)| Picture { entry: format!("poses[{idx}].board"), path: &pose.board })
        .chain(views.map(|(idx, view)| Picture { entry: format!("stage_views[{idx}].board"), path: &view.board }))
        .collect()
}

/// The pictures with the laser on whose entries have this prefix.
fn pictures_of(capture: &Capture, beginning: &str) -> Vec<LaserImage> {
    capture.laser_images().into_iter().filter(|picture| picture.entry.starts_with(beginning)).collect()
}

/// The light added by the laser in a picture.
enum LaserLight {
    /// The laser's channel, minus the background.
    Image(GreyImage),
    /// Not measurable: the background shows something else, or other light.
    Unknown(Finding),
}

fn laser_light(capture: &Capture, picture: &LaserImage) -> Result<LaserLight, Failure> {
    let Some((entry, path)) = &picture.background else {
        return Ok(LaserLight::Image(capture.image(&picture.entry, &picture.path)?));
    };
    let on = capture.photograph(&picture.entry, &picture.path)?.picture;
    let off = capture.photograph(entry, path)?.picture;
    if let Some(finding) = room_finding(&on, &off) {
        return Ok(LaserLight::Unknown(finding));
    }
    Ok(LaserLight::Image(capture.laser_light(&on, &off)))
}

fn corners_of(capture: &Capture, picture: &Picture) -> Found<BoardCorners> {
    let image = capture.image(&picture.entry, picture.path)?;
    let target = &capture.manifest.target;
    find_board(&image, target)
        .map_err(|error| unreadable(capture, picture, &error.to_string(), &board_remedy(&error, target)))
}

fn lines_of_picture(capture: &Capture, laser: &LaserImage) -> Found<Vec<Centrelines>> {
    let picture = &Picture { entry: laser.entry.clone(), path: &laser.path };
    let image = match laser_light(capture, laser)? {
        LaserLight::Image(image) => image,
        LaserLight::Unknown(finding) => {
            let remedy = "use the picture of the same pose with the laser off as its \"background\", or none";
            return Err(unreadable(capture, picture, &finding.to_string(), remedy));
        }
    };
    let lines = lines_in(&image, &capture.manifest.projector, laser.line, &mut CentrelineExtractor::default());
    // A line that is lit alone need not meet every board.
    if lines.iter().all(|lines| lines.segments.is_empty()) && laser.line.is_none() {
        let remedy = "check that the laser was on and exposed long enough, or remove this \"laser\" from the pose: \
                      it then serves the camera alone";
        return Err(unreadable(capture, picture, "no laser line was found", remedy));
    }
    Ok(lines)
}

fn unreadable(capture: &Capture, picture: &Picture, why: &str, remedy: &str) -> Failure {
    Failure::bad_input(format!("{} ({}): {why}", picture.path.display(), picture.entry))
        .in_file(&capture.manifest_path())
        .at_entry(&picture.entry)
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
pub fn stage_position(place: StagePlace) -> StagePosition {
    match place {
        StagePlace::PositionMm(position_mm) => StagePosition::LinearMm(position_mm),
        StagePlace::AngleDeg(angle_deg) => StagePosition::RotaryDeg(angle_deg),
    }
}
