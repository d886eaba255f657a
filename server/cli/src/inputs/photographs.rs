//! Photographs of a real scanner with the laser lines detected in them: the part of the demo that is not rendered.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use capture::ChannelChoice;
use image::RgbImage;
use vision::{LineDirection, WhiteLevel};

use crate::answer::output::{create_folder, write_file};
use pipeline::{Background, Directions, Failure, LineSearch, channel_of, lines_of};
use report::raster::{encode_jpeg, lines_over};

/// Environment variable with the folder that holds `real/ciclop`.
const DATA_VARIABLE: &str = "SHEAF_DATA";

/// Author and licence of the photographs, which also apply to images made from them.
pub const SOURCE: &str = "Photographs: Jesus89/3DScanScience (notebooks/images), licence CC BY-SA 4.0. \
    Images derived from them, such as these with lines drawn in, are under the same licence.";

/// Laser on, laser off, content; the lines run along columns in all of them.
const SETS: [[&str; 3]; 3] = [
    ["laser_on_object/laser.png", "laser_on_object/laser_background.png", "one line over a white bust"],
    [
        "laser_on_pattern/laser-0-255-255-8.png",
        "laser_on_pattern/laser-background-0-255-255-8.png",
        "two lines on a chessboard",
    ],
    [
        "laser_on_pattern/laser-0-255-255-8-x.png",
        "laser_on_pattern/laser-background-0-255-255-8-x.png",
        "two lines on a chessboard that reflects one of them",
    ],
];

/// A photograph with its lines.
pub struct Photograph {
    /// File name, without folder.
    pub name: String,
    /// Its content and the number of points.
    pub caption: String,
    /// The photograph in grey, with the line segments in alternating colours.
    pub overlay: RgbImage,
}

/// The folder of the photographs, if there is one.
pub fn folder() -> Option<PathBuf> {
    let folder = PathBuf::from(std::env::var_os(DATA_VARIABLE)?).join("real/ciclop");
    folder.is_dir().then_some(folder)
}

/// Detects the lines in every laser photograph, after subtraction of its background.
pub fn with_lines(folder: &Path) -> Result<Vec<Photograph>, Failure> {
    let directions = Directions::One(LineDirection::Columns);
    SETS.iter()
        .map(|[on, off, what]| {
            let path = folder.join(on);
            let background = Arc::new(Background::read(&folder.join(off), WhiteLevel::FULL)?);
            let images = std::slice::from_ref(&path);
            let laser = channel_of(
                ChannelChoice::Auto,
                images,
                WhiteLevel::FULL,
                |_| Ok(Some(background.clone())),
                directions,
            );
            let found = lines_of(&path, Some(&background), &LineSearch::of(laser.channel, directions))?;
            let n_points: usize = found.lines.segments.iter().map(|segment| segment.points.len()).sum();
            let longest = found.lines.segments.iter().map(|segment| segment.points.len()).max().unwrap_or(0);
            let caption = format!(
                "{on}: {what}. {n_points} points in {} segments, the longest of {longest} rows.",
                found.lines.segments.len()
            );
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            Ok(Photograph {
                name: format!("{stem}.jpg"),
                caption,
                overlay: lines_over(&found.photograph, &found.lines),
            })
        })
        .collect()
}

/// Writes the images and, beside them, author and licence.
pub fn write(folder: &Path, photographs: &[Photograph]) -> Result<(), Failure> {
    create_folder(folder)?;
    for photograph in photographs {
        write_file(&folder.join(&photograph.name), &encode_jpeg(&photograph.overlay)?)?;
    }
    write_file(&folder.join("SOURCE.txt"), format!("{SOURCE}\n").as_bytes())
}
