//! Where the stage stood in every frame of a scan: what leads from the part back to the camera.

use nalgebra::Vector3;
use optics::{CameraFrame, PartFrame, PointMm, StageAxis};

/// Word that begins the line of a cloud's header with the stage's direction.
const DIRECTION_KEY: &str = "stage_direction ";

/// Word that begins the lines with the positions: `frame_positions_mm <first frame>/<frames> <position> …`.
const POSITIONS_KEY: &str = "frame_positions_mm ";

/// Positions per line: lines stay below a thousand characters.
const POSITIONS_PER_LINE: usize = 40;

/// The stage's direction, and its position in every frame.
#[derive(Debug, Clone, PartialEq)]
pub struct StagePositions {
    /// How the part moves in the camera frame; zero if the scan knows no stage.
    pub axis: StageAxis,
    /// Stage position of every frame, mm.
    pub positions_mm: Vec<f64>,
}

impl StagePositions {
    /// A point that stands still in front of the camera, as the part saw it in `frame`; `None` for a frame that is not of
    /// this scan.
    pub fn part_from_camera(&self, point: &PointMm<CameraFrame>, frame: u32) -> Option<PointMm<PartFrame>> {
        Some(self.axis.part_from_camera(point, self.position_mm(frame)?))
    }

    /// Stage position of a frame, mm.
    pub fn position_mm(&self, frame: u32) -> Option<f64> {
        self.positions_mm.get(frame as usize).copied()
    }

    /// The lines of a cloud's header that carry them, exact to the last bit.
    pub fn comments(&self) -> Vec<String> {
        let n_frames = self.positions_mm.len();
        let [x, y, z] = self.axis.direction.into();
        let mut lines = vec![format!("{DIRECTION_KEY}{x} {y} {z}")];
        lines.extend(self.positions_mm.chunks(POSITIONS_PER_LINE).enumerate().map(|(idx, positions)| {
            let positions: Vec<String> = positions.iter().map(f64::to_string).collect();
            format!("{POSITIONS_KEY}{}/{n_frames} {}", idx * POSITIONS_PER_LINE, positions.join(" "))
        }));
        lines
    }

    /// What the lines of a cloud's header say; `None` if they say nothing, or not all.
    pub fn from_comments(comments: &[String]) -> Option<Self> {
        let with = |key: &'static str| comments.iter().filter_map(move |line| line.trim().strip_prefix(key));
        let direction: [f64; 3] = numbers(with(DIRECTION_KEY).next()?)?.try_into().ok()?;
        let mut positions_mm = Vec::new();
        let mut n_frames = 0;
        for line in with(POSITIONS_KEY) {
            let (place, positions) = line.split_once(' ')?;
            let (first, of_all) = place.split_once('/')?;
            if first.parse() != Ok(positions_mm.len()) {
                return None;
            }
            n_frames = of_all.parse().ok()?;
            positions_mm.extend(numbers(positions)?);
        }
        let whole = n_frames > 0 && positions_mm.len() == n_frames;
        whole.then_some(Self { axis: StageAxis::new(Vector3::from(direction)), positions_mm })
    }
}

/// Finite numbers between blanks.
fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split_whitespace().map(|word| word.parse().ok().filter(|number: &f64| number.is_finite())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn positions() -> StagePositions {
        let axis = StageAxis::new(Vector3::new(-0.005, 0.1 + 0.2, -1.0 / 3.0));
        StagePositions { axis, positions_mm: (0..97).map(|frame| f64::from(frame) * 0.1 - 150.0).collect() }
    }

    #[test]
    fn positions_come_back_from_the_header_to_the_last_bit() {
        let mut comments = vec!["units mm".to_owned()];
        comments.extend(positions().comments());
        assert_eq!(StagePositions::from_comments(&comments), Some(positions()));
        assert!(comments.iter().all(|line| line.len() < 1000 && line.trim() == line));
    }

    #[test]
    fn a_header_with_a_line_missing_or_damaged_says_nothing() {
        let whole = positions().comments();
        for missing in 0..whole.len() {
            let mut comments = whole.clone();
            comments.remove(missing);
            assert_eq!(StagePositions::from_comments(&comments), None, "line {missing}");
            let mut comments = whole.clone();
            comments[missing] = comments[missing].replace(" -", " x");
            assert_eq!(StagePositions::from_comments(&comments), None, "line {missing}");
        }
        assert_eq!(StagePositions::from_comments(&[]), None);
    }

    #[test]
    fn the_camera_stands_where_the_part_came_from() {
        let camera = PointMm::<CameraFrame>::new(Vector3::zeros());
        let in_part = positions().part_from_camera(&camera, 1).unwrap();
        assert!((in_part.xyz - positions().axis.direction * 149.9).norm() < 1e-12);
        assert_eq!(positions().part_from_camera(&camera, 97), None);
    }
}
