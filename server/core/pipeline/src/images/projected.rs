//! The lines of one image, as expected from its projector.

use std::collections::HashMap;

use capture::Projector;
use vision::{CentrelineExtractor, CentrelineParams, CentrelinePoint, Centrelines, GreyImage, LineDirection};

use crate::images::search::{keep_points, runs_along};

/// Distance from the other line of a cross below which a point is rejected, in widths of that line: its light
/// extends to 1.5 widths and makes the flanks of a point uneven.
const CROSSING_WIDTHS: f64 = 1.5;

/// The lines of an image. The lines of a cross are searched for along both directions, and each is labelled by its
/// direction; neither has points at the crossing. `line`: the line that was lit alone.
pub(crate) fn lines_in(
    image: &GreyImage,
    projector: &Projector,
    line: Option<i8>,
    extractor: &mut CentrelineExtractor,
) -> Vec<Centrelines> {
    let mut found = without_lines(projector, line);
    for lines in &mut found {
        let (lit_line, line_direction) = (lines.lit_line, lines.direction);
        extractor.find(image, &CentrelineParams { line_direction, ..CentrelineParams::default() }, lines);
        lines.lit_line = lit_line;
    }
    if let [one, other] = &mut found[..] {
        for lines in [&mut *one, &mut *other] {
            let direction = lines.direction;
            keep_points(lines, |point| runs_along(point, direction));
        }
        let positions = [&*one, &*other].map(LinePositions::of);
        keep_points(one, |point| !positions[1].are_near(point));
        keep_points(other, |point| !positions[0].are_near(point));
    }
    found
}

/// The result of [`lines_in`] for an image without lines.
pub(crate) fn without_lines(projector: &Projector, line: Option<i8>) -> Vec<Centrelines> {
    let of = |lit_line, direction| Centrelines { lit_line, direction, ..Centrelines::default() };
    match projector.crossing_lines() {
        Some(lines) => lines.map(|(line, direction)| of(Some(line), direction)).to_vec(),
        None => vec![of(line, projector.direction_of(line.unwrap_or(0)))],
    }
}

/// Positions of lines, by scan column (row).
struct LinePositions {
    direction: LineDirection,
    /// Position across the lines and width of every point of a column (row), px.
    of_columns: HashMap<i64, Vec<(f64, f64)>>,
}

impl LinePositions {
    fn of(lines: &Centrelines) -> Self {
        let mut of_columns: HashMap<i64, Vec<(f64, f64)>> = HashMap::new();
        for point in lines.segments.iter().flat_map(|segment| &segment.points) {
            let (along, across) = point.along_across(lines.direction);
            of_columns.entry(along.round() as i64).or_default().push((across, f64::from(point.width_px)));
        }
        Self { direction: lines.direction, of_columns }
    }

    /// Whether a line passes near a point.
    fn are_near(&self, point: &CentrelinePoint) -> bool {
        let (along, across) = point.along_across(self.direction);
        let near = |(position, width): &(f64, f64)| (position - across).abs() < CROSSING_WIDTHS * width;
        self.of_columns.get(&(along.round() as i64)).is_some_and(|positions| positions.iter().any(near))
    }
}
