//! The lines of one picture, as its projector makes them.

use std::collections::HashMap;

use capture::Projector;
use vision::{CentrelineExtractor, CentrelineParams, CentrelinePoint, Centrelines, GreyImage, LineDirection};

use crate::pictures::search::{keep_points, runs_along};

/// How near to the other line of a cross a point is left out, in widths of that line: its light reaches 1.5 of them, and
/// the light on both flanks of a point is no longer even there.
const CROSSING_WIDTHS: f64 = 1.5;

/// The lines of a picture. Of a cross they are found along both directions, each labelled by the one along which it runs;
/// where they cross neither has a point. `line`: which was lit alone.
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
        let places = [&*one, &*other].map(Places::of);
        keep_points(one, |point| !places[1].are_near(point));
        keep_points(other, |point| !places[0].are_near(point));
    }
    found
}

/// What [`lines_in`] finds in a picture without lines.
pub(crate) fn without_lines(projector: &Projector, line: Option<i8>) -> Vec<Centrelines> {
    let of = |lit_line, direction| Centrelines { lit_line, direction, ..Centrelines::default() };
    match projector.crossing_lines() {
        Some(lines) => lines.map(|(line, direction)| of(Some(line), direction)).to_vec(),
        None => vec![of(line, projector.direction_of(line.unwrap_or(0)))],
    }
}

/// Where lines pass, by scan column (row).
struct Places {
    direction: LineDirection,
    /// Place across and width of every point of a column (row), px.
    of_columns: HashMap<i64, Vec<(f64, f64)>>,
}

impl Places {
    fn of(lines: &Centrelines) -> Self {
        let mut of_columns: HashMap<i64, Vec<(f64, f64)>> = HashMap::new();
        for point in lines.segments.iter().flat_map(|segment| &segment.points) {
            let (along, across) = point.along_across(lines.direction);
            of_columns.entry(along.round() as i64).or_default().push((across, f64::from(point.width_px)));
        }
        Self { direction: lines.direction, of_columns }
    }

    /// Whether one of them passes near a point.
    fn are_near(&self, point: &CentrelinePoint) -> bool {
        let (along, across) = point.along_across(self.direction);
        let near = |(place, width): &(f64, f64)| (place - across).abs() < CROSSING_WIDTHS * width;
        self.of_columns.get(&(along.round() as i64)).is_some_and(|places| places.iter().any(near))
    }
}
