//! A laser image to its lines, with the background taken away if there is one.

use std::path::Path;

use capture::read_grey_image;
use vision::{CentrelineParams, Centrelines, GreyImage, find_centrelines};

use crate::background::Background;
use crate::failure::Failure;

/// A laser image and its lines.
pub struct FoundLines {
    /// The image as it was read.
    pub photograph: GreyImage,
    /// The same with the background taken away, if there is one: what the lines were found in.
    pub image: GreyImage,
    /// The lines.
    pub lines: Centrelines,
}

/// Reads a laser image and finds its lines.
pub fn lines_of(
    path: &Path,
    background: Option<&Background>,
    params: &CentrelineParams,
) -> Result<FoundLines, Failure> {
    let photograph = read_grey_image(path).map_err(|error| Failure::from(error).in_file(path))?;
    let image = match background {
        Some(background) => background.taken_from(&photograph, path)?,
        None => photograph.clone(),
    };
    let lines = find_centrelines(&image, params);
    Ok(FoundLines { photograph, image, lines })
}
