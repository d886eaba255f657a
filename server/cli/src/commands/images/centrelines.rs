//! `sheaf centrelines`: extracts the laser lines of images, as one CSV per image and overlay images.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use capture::{Capture, ChannelBasis, LaserChannel, lossy_warning, white_level_of};
use rayon::prelude::*;
use serde_json::{Value, json};
use vision::{Centrelines, ChannelScore, WhiteLevel};

use crate::answer::exit::Exit;
use crate::answer::output::{create_folder, file_names_after, write_file};
use crate::arguments::CentrelinesArgs;
use crate::commands::{Answer, failed_entry, with_failures};
use pipeline::{
    Background, Directions, Failure, Finding, FoundLines, LineSearch, Reporter, also_in, channel_of, lines_of,
};
use report::raster::{encode_png, overlay_by_segment};

/// Suffix of overlay images beside the CSV files; it prevents overwriting an input image.
const OVERLAY_SUFFIX: &str = "-lines.png";

/// Extracts the lines of every image; findings about an image are reported as warnings.
pub fn run(args: &CentrelinesArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    let Job { images, backgrounds, white_level } = Job::new(args)?;
    let csv_folder = args.csv.as_ref().or(args.output.as_ref());
    let overlay_folder = args.overlay.as_ref().or(args.output.as_ref());
    for folder in [csv_folder, overlay_folder].into_iter().flatten() {
        create_folder(folder)?;
    }
    let csv_paths = csv_folder.map(|folder| paths_in(folder, &images, ".csv"));
    let ending = if args.overlay.is_some() { ".png" } else { OVERLAY_SUFFIX };
    let overlay_paths = overlay_folder.map(|folder| paths_in(folder, &images, ending));
    let directions = args.direction.unwrap_or_default().into();
    let possible = args.direction.map_or(Directions::Both, Directions::from);
    let laser = channel_of(args.channel, &images, white_level, |idx| backgrounds.of(idx), possible);
    let search = LineSearch {
        channel: laser.channel,
        white_level,
        method: args.method.into(),
        directions,
        region: args.roi.map(Into::into),
        min_points: args.min_length,
        min_contrast: args.min_contrast,
    };
    let task = reporter.count("finding laser lines", "images", images.len());
    let found: Vec<Result<ImageResult, Failure>> = (0..images.len())
        .into_par_iter()
        .map(|idx| {
            let background = backgrounds.of(idx)?;
            let found = lines_of(&images[idx], background.as_deref(), &search)?;
            let csv = csv_paths.as_ref().map(|paths| paths[idx].as_path());
            let overlay = overlay_paths.as_ref().map(|paths| paths[idx].as_path());
            write(&found, csv, overlay)?;
            task.step();
            Ok(ImageResult::of(&found))
        })
        .collect();
    drop(task);
    let path_of = |paths: &Option<Vec<PathBuf>>, idx: usize| paths.as_ref().map(|paths| paths[idx].clone());
    let mut text = format!("{laser}\n{}", white_level_text(white_level));
    let mut entries: Vec<Value> = Vec::new();
    let (mut failures, mut n_points, mut has_light, mut qualities) = (Vec::new(), 0, false, Vec::new());
    let (mut short, mut smoothed, mut clipped) = (Vec::new(), Vec::new(), Vec::new());
    for (idx, (image, result)) in images.iter().zip(found).enumerate() {
        match result {
            Ok(result) => {
                let (csv, overlay) = (path_of(&csv_paths, idx), path_of(&overlay_paths, idx));
                let to =
                    csv.as_ref().or(overlay.as_ref()).map(|path| path.display().to_string()).unwrap_or_default();
                let _ = writeln!(
                    text,
                    "{}: {} points in {} segments → {to}",
                    image.display(),
                    result.n_points,
                    result.n_segments
                );
                for finding in &result.findings {
                    match finding {
                        Finding::NoLongLine { .. } => short.push(format!("{}: {finding}", image.display())),
                        Finding::Clipped { .. } => clipped.push(format!("{}: {finding}", image.display())),
                        Finding::Smoothed => smoothed.push(format!("{}: {finding}", image.display())),
                        _ => reporter.warn(&format!("{}: {finding}", image.display())),
                    }
                    has_light |= matches!(finding, Finding::LightWithoutLine(_));
                }
                qualities.extend(result.jpeg_quality);
                n_points += result.n_points;
                entries.push(result.json(image, csv, overlay));
            }
            Err(failure) => {
                entries.push(failed_entry(image, &failure));
                failures.push(failure);
            }
        }
    }
    [short, smoothed, clipped].iter().for_each(|alike| warn_once(alike, reporter));
    if let Some(warning) = lossy_warning(&qualities) {
        reporter.warn(&format!("{warning}; segments of low contrast are ignored (--min-contrast)"));
    }
    let mut answer = with_failures(
        text,
        json!({ "channel": channel_json(&laser), "white_level": white_level_json(white_level) }),
        entries,
        &failures,
    );
    if answer.exit == Exit::Done && n_points == 0 && has_light {
        answer.exit = Exit::Unobservable;
    }
    Ok(answer)
}

/// Warns of what images of one camera have in common: with the first of them, and the number of others.
fn warn_once(alike: &[String], reporter: &dyn Reporter) {
    if let [first, others @ ..] = alike {
        reporter.warn(&format!("{first}{}", also_in(others.len())));
    }
}

/// The images and their laser-off images.
struct Job {
    images: Vec<PathBuf>,
    backgrounds: Backgrounds,
    white_level: WhiteLevel,
}

enum Backgrounds {
    None,
    /// One for all images.
    One(Arc<Background>),
    /// One per image, read when it is needed, with this white level.
    Each(Vec<PathBuf>, WhiteLevel),
}

impl Backgrounds {
    fn of(&self, idx: usize) -> Result<Option<Arc<Background>>, Failure> {
        match self {
            Self::None => Ok(None),
            Self::One(background) => Ok(Some(background.clone())),
            Self::Each(paths, white) => {
                Background::read(&paths[idx], *white).map(|background| Some(Arc::new(background)))
            }
        }
    }
}

impl Job {
    fn new(args: &CentrelinesArgs) -> Result<Self, Failure> {
        let white_level_of = |images: &[PathBuf], off: &[PathBuf]| match args.white_level {
            Some(level) => WhiteLevel::new(level.get()),
            None => white_level_of(&[images, off].concat()),
        };
        if let Some(list) = &args.pairs {
            let (images, off) = read_pairs(list)?;
            let white_level = white_level_of(&images, &off);
            return Ok(Self { images, backgrounds: Backgrounds::Each(off, white_level), white_level });
        }
        let images = args.images.clone();
        let white_level = white_level_of(&images, &args.background);
        let backgrounds = match &args.background[..] {
            [] => Backgrounds::None,
            [one] => Backgrounds::One(Arc::new(Background::read(one, white_level)?)),
            each if each.len() == images.len() => Backgrounds::Each(each.to_vec(), white_level),
            each => {
                let what = format!("{} images and {} backgrounds", images.len(), each.len());
                return Err(Failure::new(pipeline::FailureKind::BadParameter, what)
                    .remedy("give one background for all images, or one per image in the same order"));
            }
        };
        Ok(Self { images, backgrounds, white_level })
    }
}

/// A list of pairs, one `LASER_ON,LASER_OFF` per line, relative to the folder of the list.
fn read_pairs(list: &Path) -> Result<(Vec<PathBuf>, Vec<PathBuf>), Failure> {
    let text = std::fs::read_to_string(list).map_err(|error| {
        Failure::bad_input(format!("cannot read {}", list.display())).in_file(list).because(&error)
    })?;
    let folder = list.parent().unwrap_or(Path::new(""));
    let rows = text.lines().enumerate().filter(|(_, row)| !row.trim().is_empty() && !row.starts_with('#'));
    let pairs: Result<Vec<(PathBuf, PathBuf)>, Failure> = rows
        .map(|(idx, row)| match row.split(',').map(str::trim).collect::<Vec<_>>()[..] {
            [on, off] if !on.is_empty() && !off.is_empty() => Ok((folder.join(on), folder.join(off))),
            _ => Err(Failure::bad_input(format!("{}, line {}: \"{row}\" is not a pair", list.display(), idx + 1))
                .in_file(list)
                .at_entry(format!("line {}", idx + 1))
                .remedy("write two file names separated by a comma: LASER_ON,LASER_OFF")),
        })
        .collect();
    let pairs = pairs?;
    if pairs.is_empty() {
        return Err(Failure::bad_input(format!("{} contains no pair", list.display()))
            .in_file(list)
            .remedy("write one pair per line: LASER_ON,LASER_OFF"));
    }
    Ok(pairs.into_iter().unzip())
}

/// Result of an image, without its points.
struct ImageResult {
    n_points: usize,
    n_segments: usize,
    findings: Vec<Finding>,
    jpeg_quality: Option<u8>,
}

impl ImageResult {
    fn of(found: &FoundLines) -> Self {
        let segments = &found.lines.segments;
        Self {
            n_points: segments.iter().map(|segment| segment.points.len()).sum(),
            n_segments: segments.len(),
            findings: found.findings.clone(),
            jpeg_quality: found.jpeg_quality,
        }
    }

    fn json(&self, image: &Path, csv: Option<PathBuf>, overlay: Option<PathBuf>) -> Value {
        let findings: Vec<Value> = self
            .findings
            .iter()
            .map(|finding| json!({ "kind": finding.kind(), "text": finding.to_string() }))
            .collect();
        json!({ "image": image, "csv": csv, "overlay": overlay, "n_points": self.n_points,
            "n_segments": self.n_segments, "findings": findings, "lossy": self.jpeg_quality.is_some(),
            "jpeg_quality": self.jpeg_quality })
    }
}

/// The channel used for a colour capture, and the white level of a sensor with fewer bits than its images, a line each.
pub fn levels_text(capture: &Capture) -> String {
    let laser = capture.laser_channel();
    let channel = if laser.basis == ChannelBasis::GreyImages { String::new() } else { format!("{laser}\n") };
    channel + &white_level_text(capture.white_level())
}

/// The white level as one line, where it is not that of 16 bits.
fn white_level_text(white: WhiteLevel) -> String {
    if white.is_full() { String::new() } else { format!("white level {}\n", white.level()) }
}

/// The white level of a sensor with fewer bits than its images; null if levels are used as they are.
pub fn white_level_json(white: WhiteLevel) -> Value {
    if white.is_full() { Value::Null } else { json!(white.level()) }
}

/// The channel as JSON, with the basis of its selection.
pub fn channel_json(laser: &LaserChannel) -> Value {
    let (basis, scores) = match &laser.basis {
        ChannelBasis::Given => ("given", None),
        ChannelBasis::GreyImages => ("grey_images", None),
        ChannelBasis::Decided { scores, .. } => ("auto", Some(scores)),
    };
    let scores: Option<Vec<Value>> = scores.map(|scores| {
        let score = |score: &ChannelScore| {
            json!({ "channel": score.channel.name(), "n_laser_points": score.n_laser_points,
                "n_other_points": score.n_other_points })
        };
        scores.iter().map(score).collect()
    });
    json!({ "name": laser.channel.name(), "basis": basis, "scores": scores })
}

fn paths_in(folder: &Path, images: &[PathBuf], ending: &str) -> Vec<PathBuf> {
    let names = file_names_after(images, "");
    names.into_iter().map(|name| folder.join(format!("{}{ending}", name.trim_end_matches('.')))).collect()
}

fn write(found: &FoundLines, csv_path: Option<&Path>, overlay_path: Option<&Path>) -> Result<(), Failure> {
    if let Some(csv_path) = csv_path {
        write_file(csv_path, csv(&found.lines).as_bytes())?;
    }
    if let Some(overlay_path) = overlay_path {
        write_file(overlay_path, &encode_png(&overlay_by_segment(&found.image, &found.lines))?)?;
    }
    Ok(())
}

fn csv(lines: &Centrelines) -> String {
    let mut csv = "u_px,v_px,sigma_px,intensity,width_px\n".to_owned();
    for point in lines.segments.iter().flat_map(|segment| &segment.points) {
        let _ = writeln!(
            csv,
            "{:.5},{:.5},{:.5},{:.2},{:.3}",
            point.u_px, point.v_px, point.sigma_px, point.intensity, point.width_px
        );
    }
    csv
}
