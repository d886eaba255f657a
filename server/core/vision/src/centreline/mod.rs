//! Sub-pixel centrelines of the laser lines in an image.
//!
//! Noise map → typical line width → candidates (a box brighter than both flanks) → traces linked column by column → one
//! crossing per column by Gaussian derivatives → scatter of the crossings → local parabolas along the line. Positions
//! are measured per column and averaged along the line afterwards, so that changes of intensity along the line (the
//! squares of a board) do not move it.

mod centroid;
mod fast;
mod levels;
mod lines;
mod small;
mod spread;
mod view;

pub use fast::AveragingBias;

use crate::{GreyImage, Pixels};
use view::{Level, View};

/// Direction of the laser lines in the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LineDirection {
    /// Lines run along rows: one crossing per column and line.
    #[default]
    Rows,
    /// Lines run along columns: one crossing per row and line.
    Columns,
}

/// Method of locating the centre of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CentrelineMethod {
    /// Gaussian derivatives, Hessian, offset along the normal (Steger 1998).
    #[default]
    Steger,
    /// Grey-level centroid, one scan column at a time (the classic method).
    CentreOfGravity,
}

/// Settings of the extraction; the defaults suit any station.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CentrelineParams {
    /// Method of locating the centre of a line.
    pub method: CentrelineMethod,
    /// Direction of the lines.
    pub line_direction: LineDirection,
}

/// One sub-pixel point on a laser line, in raw (distorted) sensor pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CentrelinePoint {
    /// Column.
    pub u_px: f64,
    /// Row.
    pub v_px: f64,
    /// Unit normal of the line in the image, (u, v).
    pub normal: [f64; 2],
    /// Predicted standard deviation of the position along `normal`.
    pub sigma_px: f64,
    /// Grey levels of the ridge above the local background.
    pub intensity: f32,
    /// Full width of the line at half its height, across the line.
    pub width_px: f32,
    /// Whether pixels of the line's cross-section were at full scale.
    pub saturated: bool,
}

impl CentrelinePoint {
    /// Placeholder for a point not written yet.
    pub const UNWRITTEN: Self = Self {
        u_px: 0.0,
        v_px: 0.0,
        normal: [0.0; 2],
        sigma_px: 0.0,
        intensity: 0.0,
        width_px: 0.0,
        saturated: false,
    };

    /// Position (along, across) relative to lines of this direction, px.
    pub fn along_across(&self, direction: LineDirection) -> (f64, f64) {
        match direction {
            LineDirection::Rows => (self.u_px, self.v_px),
            LineDirection::Columns => (self.v_px, self.u_px),
        }
    }

    /// Component of the normal across lines of this direction: the cosine of their angle to it, with a sign.
    pub fn normal_across(&self, direction: LineDirection) -> f64 {
        match direction {
            LineDirection::Rows => self.normal[1],
            LineDirection::Columns => self.normal[0],
        }
    }

    /// The direction that the line is closer to at this point.
    pub fn direction(&self) -> LineDirection {
        let [across_columns, across_rows] = self.normal.map(f64::abs);
        if across_rows >= across_columns { LineDirection::Rows } else { LineDirection::Columns }
    }
}

/// A connected piece of one line: points ordered along the line (by column for [`LineDirection::Rows`],
/// by row for [`LineDirection::Columns`]), at most one per column (row), without gaps.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Segment {
    /// The points, in order.
    pub points: Vec<CentrelinePoint>,
}

/// All the line pieces of one image.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Centrelines {
    /// Connected pieces, ordered by their first point along the line, then across.
    pub segments: Vec<Segment>,
    /// Which way the lines run.
    pub direction: LineDirection,
    /// Distance along the line, in scan columns (rows), over which neighbouring points share their noise:
    /// the mean of `n` neighbouring points has variance sigma² · min(1, correlation_px / n).
    pub correlation_px: f64,
    /// Number of the only line that was on, if the lines are switched on one by one. Not set by the extraction.
    pub lit_line: Option<i8>,
}

impl Centrelines {
    /// Marks the points whose pixels, column and row, were saturated in an image of `size_px`, as seen before ambient
    /// light was subtracted from it: the extraction cannot see it any more.
    pub fn mark_saturated(&mut self, size_px: (usize, usize), was_saturated: impl Fn(usize, usize) -> bool) {
        let (last_column, last_row) = (size_px.0 as i64 - 1, size_px.1 as i64 - 1);
        let direction = self.direction;
        let was = |u: i64, v: i64| was_saturated(u.clamp(0, last_column) as usize, v.clamp(0, last_row) as usize);
        for point in self.segments.iter_mut().flat_map(|segment| &mut segment.points) {
            let (u, v) = (point.u_px.round() as i64, point.v_px.round() as i64);
            point.saturated |= (-1..=1).any(|beside| match direction {
                LineDirection::Rows => was(u, v + beside),
                LineDirection::Columns => was(u + beside, v),
            });
        }
    }
}

/// Finds the centrelines of all laser lines in `image`.
///
/// An image without light gives no segments; that is not an error. For many images use a [`CentrelineExtractor`], which
/// gives the same result without allocating each time.
pub fn find_centrelines(image: &GreyImage, params: &CentrelineParams) -> Centrelines {
    let mut found = Centrelines::default();
    CentrelineExtractor::default().find(image, params, &mut found);
    found
}

/// Finds centrelines in one image after the other, reusing its memory. The result depends on the image alone.
#[derive(Default)]
pub struct CentrelineExtractor {
    eight: fast::Memory<u8>,
    sixteen: fast::Memory<u16>,
    levels: levels::Levels,
    /// The transposed image.
    transposed: Option<GreyImage>,
}

impl CentrelineExtractor {
    /// As [`find_centrelines`]; the content of `found` is replaced.
    pub fn find(&mut self, image: &GreyImage, params: &CentrelineParams, found: &mut Centrelines) {
        match params.line_direction {
            LineDirection::Rows => self.along_rows(image, params.method, found),
            LineDirection::Columns => {
                let transposed = match self.transposed.take() {
                    Some(mut transposed) => {
                        image.transpose_into(&mut transposed);
                        transposed
                    }
                    None => image.transposed(),
                };
                self.along_rows(&transposed, params.method, found);
                self.transposed = Some(transposed);
                exchange(found);
            }
        }
    }

    fn along_rows(&mut self, image: &GreyImage, method: CentrelineMethod, found: &mut Centrelines) {
        found.direction = LineDirection::Rows;
        let (width, height, full_scale) = (image.width(), image.height(), image.full_scale());
        let hidden_noise = image.hidden_noise();
        match image.pixels() {
            Pixels::Eight(pixels) => {
                let view = View { pixels, width, height, full_scale, hidden_noise };
                extract(&view, fast::extract_eight, &mut self.eight, &mut self.levels, method, found);
            }
            Pixels::Sixteen(pixels) => {
                let view = View { pixels, width, height, full_scale, hidden_noise };
                extract(&view, fast::extract_sixteen, &mut self.sixteen, &mut self.levels, method, found);
            }
        }
    }
}

/// All lines of an image of one bit depth.
fn extract<T: Level>(
    view: &View<T>,
    by: fn(&View<T>, &mut fast::Memory<T>, &mut Centrelines),
    memory: &mut fast::Memory<T>,
    levels: &mut levels::Levels,
    method: CentrelineMethod,
    found: &mut Centrelines,
) {
    if !fast::fits(view.width, view.height) {
        let enlarged = small::enlarged(view);
        extract(&enlarged.view(), by, memory, levels, method, found);
        small::crop(found, view.width, view.height);
        return;
    }
    by(view, memory, found);
    levels.add_wide_lines(view, memory, found);
    if method == CentrelineMethod::CentreOfGravity {
        centroid::place_at_centroids(view, memory.noise(), found);
    }
}

/// Transposes the points back.
fn exchange(centrelines: &mut Centrelines) {
    centrelines.direction = LineDirection::Columns;
    for point in centrelines.segments.iter_mut().flat_map(|segment| &mut segment.points) {
        (point.u_px, point.v_px) = (point.v_px, point.u_px);
        point.normal.reverse();
    }
}

#[cfg(test)]
mod tests;
