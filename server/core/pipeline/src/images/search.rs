//! Settings of the line search, and which lines are kept.

use statistics::median;
use vision::{
    CentrelineMethod, CentrelineParams, CentrelinePoint, Centrelines, Channel, GreyImage, LineDirection, Segment,
    WhiteLevel, find_centrelines,
};

/// Lines fainter than this, relative to full scale, are dropped from files with lossy compression unless a
/// contrast was requested: JPEG blocks cause ripples of one to three levels of 255 in dark areas.
const LOSSY_MIN_CONTRAST: f32 = 4.0 / 255.0;

/// Longest piece, in its own widths, that may be a glint: a spot of light is about as long as it is wide, even out
/// of focus.
const MAX_GLINT_WIDTHS: f32 = 6.0;
/// Shortest piece, in its own widths, that is certainly a line.
const MIN_LINE_WIDTHS: f32 = 15.0;
/// Smallest ratio of a glint's height to that of the lines: specular reflections of the lamp or the laser are brighter
/// than scattered light.
const MIN_GLINT_OVER_LINES: f32 = 1.5;

/// Pixels along a line that are averaged where noise hides it: the contrast over noise doubles, and the lateral
/// resolution stays finer than that of most lines.
pub(crate) const SMOOTHED_PX: usize = 5;

/// Directions in which lines may run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Directions {
    /// One direction.
    One(LineDirection),
    /// Both directions, even within one line: each piece is taken from the search along its own direction.
    Both,
}

impl Directions {
    /// The directions to search.
    pub fn each(self) -> &'static [LineDirection] {
        match self {
            Self::One(LineDirection::Rows) => &[LineDirection::Rows],
            Self::One(LineDirection::Columns) => &[LineDirection::Columns],
            Self::Both => &[LineDirection::Rows, LineDirection::Columns],
        }
    }
}

/// A rectangle of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    /// First column.
    pub u: usize,
    /// First row.
    pub v: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Region {
    fn contains(&self, point: &CentrelinePoint) -> bool {
        let inside = |at: f64, from: usize, size: usize| at >= from as f64 && at <= (from + size - 1) as f64;
        inside(point.u_px, self.u, self.width) && inside(point.v_px, self.v, self.height)
    }
}

/// Settings of the line search.
#[derive(Debug, Clone, PartialEq)]
pub struct LineSearch {
    /// The channel used for colour images.
    pub channel: Channel,
    /// The white level of images of 16 bits.
    pub white_level: WhiteLevel,
    /// Method for the centre of a line.
    pub method: CentrelineMethod,
    /// Directions in which lines may run.
    pub directions: Directions,
    /// Region of the points kept; the whole image if `None`.
    pub region: Option<Region>,
    /// Fewest points of a piece of line.
    pub min_points: usize,
    /// Smallest median height of a piece above its surroundings, in grey levels; by default it depends on the file's
    /// format.
    pub min_contrast: Option<f32>,
}

impl LineSearch {
    /// Every line of a channel along these directions.
    pub fn of(channel: Channel, directions: Directions) -> Self {
        let (method, white_level) = (CentrelineMethod::default(), WhiteLevel::FULL);
        Self { channel, white_level, method, directions, region: None, min_points: 1, min_contrast: None }
    }

    /// The parameters of the extraction along one direction.
    pub fn params(&self, line_direction: LineDirection) -> CentrelineParams {
        CentrelineParams { method: self.method, line_direction }
    }

    /// Every line of an image.
    pub(crate) fn all_lines(&self, image: &GreyImage) -> Centrelines {
        self.lines_by(|direction| find_centrelines(image, &self.params(direction)))
    }

    /// Every line of an image in which [`SMOOTHED_PX`] pixels along the lines are averaged.
    pub(crate) fn smoothed_lines(&self, image: &GreyImage) -> Centrelines {
        let smoothed = |direction| match direction {
            LineDirection::Rows => image.smoothed_along_rows(SMOOTHED_PX),
            LineDirection::Columns => image.transposed().smoothed_along_rows(SMOOTHED_PX).transposed(),
        };
        self.lines_by(|direction| find_centrelines(&smoothed(direction), &self.params(direction)))
    }

    /// The lines that `find` finds in every direction to search.
    fn lines_by(&self, find: impl Fn(LineDirection) -> Centrelines) -> Centrelines {
        let mut all = Centrelines::default();
        for &direction in self.directions.each() {
            let mut found = find(direction);
            if self.directions == Directions::Both {
                keep_points(&mut found, |point| runs_along(point, direction));
            }
            (all.direction, all.correlation_px) = (direction, found.correlation_px);
            all.segments.append(&mut found.segments);
        }
        all
    }

    /// Removes glints from the lines of an image: short clipped pieces that are brighter than its long lines. Without a
    /// long line nothing is removed. Returns their number.
    pub(crate) fn drop_glints(&self, lines: &mut Centrelines) -> usize {
        let lengths = |segment: &Segment| segment.points.len() as f32 / median_width(segment).max(1.0);
        let long = lines.segments.iter().filter(|segment| lengths(segment) >= MIN_LINE_WIDTHS);
        let mut heights: Vec<f32> =
            long.flat_map(|segment| &segment.points).map(|point| point.intensity).collect();
        let Some(of_lines) = median(&mut heights) else { return 0 };
        let n_before = lines.segments.len();
        lines.segments.retain(|segment| {
            let n_clipped = segment.points.iter().filter(|point| point.saturated).count();
            let is_clipped = 3 * n_clipped >= segment.points.len();
            !(lengths(segment) <= MAX_GLINT_WIDTHS
                && is_clipped
                && median_contrast(segment) >= MIN_GLINT_OVER_LINES * of_lines)
        });
        n_before - lines.segments.len()
    }

    /// Keeps the requested lines of an image; `is_lossy`: see [`capture::Photograph`].
    pub(crate) fn keep_wanted(&self, lines: &mut Centrelines, full_scale: f32, is_lossy: bool) {
        let lossy = if is_lossy { LOSSY_MIN_CONTRAST * full_scale } else { 0.0 };
        let min_contrast = self.min_contrast.unwrap_or(lossy);
        if let Some(region) = self.region {
            keep_points(lines, |point| region.contains(point));
        }
        lines
            .segments
            .retain(|segment| segment.points.len() >= self.min_points && median_contrast(segment) >= min_contrast);
    }
}

/// Whether a line runs along rows (columns) rather than across them at the point.
pub(crate) fn runs_along(point: &CentrelinePoint, direction: LineDirection) -> bool {
    point.direction() == direction
}

/// Keeps some points; a piece of a line ends where a point is dropped.
pub(crate) fn keep_points(lines: &mut Centrelines, keep: impl Fn(&CentrelinePoint) -> bool) {
    let kept = lines
        .segments
        .iter()
        .flat_map(|segment| segment.points.chunk_by(|a, b| keep(a) == keep(b)).filter(|piece| keep(&piece[0])));
    lines.segments = kept.map(|points| Segment { points: points.to_vec() }).collect();
}

fn median_width(segment: &Segment) -> f32 {
    let mut widths: Vec<f32> = segment.points.iter().map(|point| point.width_px).collect();
    median(&mut widths).unwrap_or(0.0)
}

fn median_contrast(segment: &Segment) -> f32 {
    let mut heights: Vec<f32> = segment.points.iter().map(|point| point.intensity).collect();
    median(&mut heights).unwrap_or(0.0)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use vision::Pixels;

    /// A line along row 40 from column 20 to 120 and one along column 200, over all rows; a faint one along row 100.
    fn crossing() -> GreyImage {
        let bell = |distance: f64| (-0.5 * (distance / 2.0).powi(2)).exp();
        let level = |idx: usize| {
            let (u, v) = ((idx % 256) as f64, (idx / 256) as f64);
            let along =
                if (20.0..120.0).contains(&u) { 150.0 * bell(v - 40.0) + 20.0 * bell(v - 100.0) } else { 0.0 };
            // A fixed pattern as noise.
            (10.0 + along + 150.0 * bell(u - 200.0) + (idx * 7919 % 5) as f64 * 0.5).round() as u8
        };
        GreyImage::new(256, 160, Pixels::Eight((0..256 * 160).map(level).collect())).unwrap()
    }

    fn search() -> LineSearch {
        LineSearch::of(Channel::Luma, Directions::Both)
    }

    fn wanted(search: &LineSearch, image: &GreyImage) -> Centrelines {
        let mut lines = search.all_lines(image);
        search.keep_wanted(&mut lines, image.full_scale(), false);
        lines
    }

    fn near(lines: &Centrelines, wanted: fn(&CentrelinePoint) -> f64) -> usize {
        lines.segments.iter().flat_map(|segment| &segment.points).filter(|point| wanted(point).abs() < 0.5).count()
    }

    #[test]
    fn both_directions_find_each_line_once() {
        let lines = wanted(&search(), &crossing());
        let (row, column) = (near(&lines, |p| p.v_px - 40.0), near(&lines, |p| p.u_px - 200.0));
        assert!((85..=102).contains(&row) && (140..=160).contains(&column), "{row} {column}");
        let one = LineSearch { directions: Directions::One(LineDirection::Rows), ..search() };
        assert!(near(&wanted(&one, &crossing()), |p| p.u_px - 200.0) < 10);
    }

    #[test]
    fn glints_are_removed_and_counted_and_lines_are_kept() {
        let bell = |distance: f64| (-0.5 * distance * distance).exp();
        let level = |idx: usize| {
            let (u, v) = ((idx % 640) as f64, (idx / 640) as f64);
            let line = 70.0 * bell((v - 120.0 - 0.1 * u) / 2.0);
            // Ten spots above the line, and one on it.
            let spots = (0..11).map(|k| {
                let at = [40.0 + 55.0 * f64::from(k), if k == 5 { 151.5 } else { 70.0 }];
                600.0 * bell((u - at[0]) / 5.0) * bell((v - at[1]) / 2.5)
            });
            (10.0 + line + spots.sum::<f64>() + (idx * 7919 % 5) as f64 * 0.5).min(255.0).round() as u8
        };
        let image = GreyImage::new(640, 320, Pixels::Eight((0..640 * 320).map(level).collect())).unwrap();
        let search = LineSearch::of(Channel::Luma, Directions::One(LineDirection::Rows));
        let mut lines = search.all_lines(&image);
        let n_dropped = search.drop_glints(&mut lines);
        assert_eq!(n_dropped, 10, "{} pieces left", lines.segments.len());
        let of_line = near(&lines, |p| p.v_px - 120.0 - 0.1 * p.u_px);
        let n_points = lines.segments.iter().map(|segment| segment.points.len()).sum::<usize>();
        assert!(of_line > 580 && n_points < of_line + 40, "{of_line} of the line, {n_points} in all");
    }

    #[test]
    fn lines_are_dropped_by_region_length_and_contrast() {
        let image = crossing();
        let region = Some(Region { u: 50, v: 0, width: 40, height: 60 });
        let cut = wanted(&LineSearch { region, ..search() }, &image);
        assert_eq!(near(&cut, |p| p.v_px - 40.0), 40);
        assert_eq!(cut.segments.len(), 1);
        let long = wanted(&LineSearch { min_points: 110, ..search() }, &image);
        // The line along the column has one or two points in row 40.
        assert!(near(&long, |p| p.v_px - 40.0) < 3 && near(&long, |p| p.u_px - 200.0) > 0);
        assert!(near(&wanted(&search(), &image), |p| p.v_px - 100.0) > 70);
        let bright = wanted(&LineSearch { min_contrast: Some(50.0), ..search() }, &image);
        assert!(near(&bright, |p| p.v_px - 100.0) < 3);
    }
}
