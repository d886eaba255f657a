//! Images with a side too short for the search: their last rows and columns are mirrored back and forth until they are
//! large enough. Mirrored pixels keep the noise of the image and introduce no edge.

use super::Centrelines;
use super::fast::MIN_SIDE_PX;
use super::view::{Level, View};
use crate::params::MIN_SEGMENT_COLUMNS;

/// Number of rows (columns) mirrored: few, so that a line is repeated only where it is too close to the border to be
/// measured.
const MIRRORED_PX: usize = 8;

/// An enlarged copy of an image.
pub struct Enlarged<T> {
    pixels: Vec<T>,
    width: usize,
    height: usize,
    full_scale: f32,
    hidden_noise: f32,
}

impl<T> Enlarged<T> {
    /// The copy as a view.
    pub fn view(&self) -> View<'_, T> {
        let Self { width, height, full_scale, hidden_noise, .. } = *self;
        View { pixels: &self.pixels, width, height, full_scale, hidden_noise }
    }
}

/// The image, mirrored at its end.
pub fn enlarged<T: Level>(view: &View<T>) -> Enlarged<T> {
    let (width, height) = (view.width.max(MIN_SIDE_PX), view.height.max(MIN_SIDE_PX));
    let mirrored = |at: usize, n: usize| {
        let depth = n.min(MIRRORED_PX);
        let beyond = at.saturating_sub(n) % (2 * depth);
        if at < n { at } else { n - 1 - beyond.min(2 * depth - 1 - beyond) }
    };
    let pixel = |at: usize| view.row(mirrored(at / width, view.height))[mirrored(at % width, view.width)];
    let pixels = (0..width * height).map(pixel).collect();
    Enlarged { pixels, width, height, full_scale: view.full_scale, hidden_noise: view.hidden_noise }
}

/// Keeps only the points in the first `width` columns and `height` rows.
pub fn crop(found: &mut Centrelines, width: usize, height: usize) {
    let (last_u, last_v) = ((width - 1) as f64, (height - 1) as f64);
    for segment in &mut found.segments {
        // Lines that continue beyond the lower border are mirror images of those above it.
        let inside = |point: &super::CentrelinePoint| point.u_px <= last_u && point.v_px <= last_v;
        let n_inside = segment.points.iter().take_while(|point| inside(point)).count();
        segment.points.truncate(n_inside);
    }
    found.segments.retain(|segment| segment.points.len() >= MIN_SEGMENT_COLUMNS);
}
