//! The stage position of every frame of a scan, which relates the part frame to the camera frame.

use nalgebra::Vector3;
use optics::{CameraFrame, Motion, PartFrame, PointMm, RotaryAxis, Stage, StageAxis, StageKind, StagePosition};

/// Key of the line of a cloud's header with the direction of a linear stage.
const DIRECTION_KEY: &str = "stage_direction ";

/// Key of the line with a turntable's axis: a point, mm, and its direction.
const AXIS_KEY: &str = "stage_axis ";

/// Key of the lines with the positions: `frame_positions_mm <first frame>/<frames> <position> …`.
const POSITIONS_KEY: &str = "frame_positions_mm ";

/// The same for the angles of a turntable.
const ANGLES_KEY: &str = "frame_angles_deg ";

/// Positions per line: lines stay below a thousand characters.
const POSITIONS_PER_LINE: usize = 40;

/// The stage, and its position in every frame.
#[derive(Debug, Clone, PartialEq)]
pub struct StagePositions {
    /// The motion of the part in the camera frame; a linear stage with direction zero if the scan has no stage.
    pub stage: Stage,
    /// The position in every frame, all of the stage's own kind.
    pub positions: Vec<StagePosition>,
}

impl StagePositions {
    /// For a linear stage.
    pub fn linear(axis: StageAxis, positions_mm: impl IntoIterator<Item = f64>) -> Self {
        Self { stage: axis.into(), positions: positions_mm.into_iter().map(StagePosition::LinearMm).collect() }
    }

    /// A camera-frame point in the part frame of `frame`; `None` for a frame that does not belong to this scan.
    pub fn part_from_camera(&self, point: &PointMm<CameraFrame>, frame: u32) -> Option<PointMm<PartFrame>> {
        Some(self.motion(frame)?.part_from_camera(point))
    }

    /// The motion of the part in a frame.
    pub fn motion(&self, frame: u32) -> Option<Motion> {
        self.stage.motion(self.position(frame)?)
    }

    /// The stage position in a frame.
    pub fn position(&self, frame: u32) -> Option<StagePosition> {
        self.positions.get(frame as usize).copied()
    }

    /// The header lines of a cloud that store them, exact to the last bit.
    pub fn comments(&self) -> Vec<String> {
        let n_frames = self.positions.len();
        let words = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        let (first, key) = match &self.stage {
            Stage::Linear(axis) => (format!("{DIRECTION_KEY}{}", words(axis.direction.as_slice())), POSITIONS_KEY),
            Stage::Rotary(axis) => {
                let (point, direction) = (words(axis.point_mm.as_slice()), words(axis.direction.as_slice()));
                (format!("{AXIS_KEY}{point} {direction}"), ANGLES_KEY)
            }
        };
        let mut lines = vec![first];
        lines.extend(self.positions.chunks(POSITIONS_PER_LINE).enumerate().map(|(idx, positions)| {
            let positions: Vec<f64> = positions.iter().map(|position| position.value()).collect();
            format!("{key}{}/{n_frames} {}", idx * POSITIONS_PER_LINE, words(&positions))
        }));
        lines
    }

    /// Parses the header lines of a cloud; `None` if they are missing or incomplete.
    pub fn from_comments(comments: &[String]) -> Option<Self> {
        let with = |key: &'static str| comments.iter().filter_map(move |line| line.trim().strip_prefix(key));
        let (stage, key) = match with(DIRECTION_KEY).next() {
            Some(direction) => {
                let direction: [f64; 3] = numbers(direction)?.try_into().ok()?;
                (Stage::Linear(StageAxis::new(Vector3::from(direction))), POSITIONS_KEY)
            }
            None => {
                let [px, py, pz, dx, dy, dz]: [f64; 6] = numbers(with(AXIS_KEY).next()?)?.try_into().ok()?;
                let direction = Vector3::new(dx, dy, dz);
                let axis = RotaryAxis { point_mm: Vector3::new(px, py, pz), direction, angle_error: None };
                (Stage::Rotary(axis), ANGLES_KEY)
            }
        };
        let positions = positions(with(key), stage.kind())?;
        Some(Self { stage, positions })
    }
}

/// All positions in the lines; `None` if any are missing.
fn positions<'a>(lines: impl Iterator<Item = &'a str>, kind: StageKind) -> Option<Vec<StagePosition>> {
    let mut positions = Vec::new();
    let mut n_frames = 0;
    for line in lines {
        let (place, values) = line.split_once(' ')?;
        let (first, of_all) = place.split_once('/')?;
        if first.parse() != Ok(positions.len()) {
            return None;
        }
        n_frames = of_all.parse().ok()?;
        positions.extend(numbers(values)?.into_iter().map(|value| kind.position(value)));
    }
    (n_frames > 0 && positions.len() == n_frames).then_some(positions)
}

/// Finite numbers separated by blanks.
fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split_whitespace().map(|word| word.parse().ok().filter(|number: &f64| number.is_finite())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn travelling() -> StagePositions {
        let axis = StageAxis::new(Vector3::new(-0.005, 0.1 + 0.2, -1.0 / 3.0));
        StagePositions::linear(axis, (0..97).map(|frame| f64::from(frame) * 0.1 - 150.0))
    }

    fn turning() -> StagePositions {
        let axis = RotaryAxis::new(Vector3::new(-0.3, 1.0 / 3.0, 411.7), Vector3::new(-0.02, -1.0, 0.3));
        let positions = (0..97).map(|frame| StagePosition::RotaryDeg(f64::from(frame) * 3.7 - 450.0)).collect();
        StagePositions { stage: axis.into(), positions }
    }

    #[test]
    fn positions_are_read_back_from_the_header_to_the_last_bit() {
        for positions in [travelling(), turning()] {
            let mut comments = vec!["units mm".to_owned()];
            comments.extend(positions.comments());
            assert_eq!(StagePositions::from_comments(&comments), Some(positions));
            assert!(comments.iter().all(|line| line.len() < 1000 && line.trim() == line));
        }
    }

    #[test]
    fn a_header_with_a_line_missing_or_damaged_is_ignored() {
        for whole in [travelling(), turning()].map(|positions| positions.comments()) {
            for missing in 0..whole.len() {
                let mut comments = whole.clone();
                comments.remove(missing);
                assert_eq!(StagePositions::from_comments(&comments), None, "line {missing}");
                let mut comments = whole.clone();
                comments[missing] = comments[missing].replace(" -", " x");
                assert_eq!(StagePositions::from_comments(&comments), None, "line {missing}");
            }
        }
        assert_eq!(StagePositions::from_comments(&[]), None);
    }

    #[test]
    fn the_camera_moves_opposite_to_the_part() {
        let camera = PointMm::<CameraFrame>::new(Vector3::zeros());
        let in_part = travelling().part_from_camera(&camera, 1).unwrap();
        let direction = travelling().stage.linear().unwrap().direction;
        assert!((in_part.xyz - direction * 149.9).norm() < 1e-12);
        assert_eq!(travelling().part_from_camera(&camera, 97), None);
    }
}
