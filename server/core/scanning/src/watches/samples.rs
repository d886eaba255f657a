//! Lines reduced to one position, depth and power per bin of columns, so that the same point can be found in the
//! samples of other orders.

use nalgebra::Vector3;
use optics::{Calibration, Motion, Stage, StagePosition};

use crate::params::watches::{BIN_COLUMNS, MAX_SLOPE};
use crate::points::profile::{Profile, ProfilePoint};

/// Reduces the frames of a scan to samples, in the order of travel.
#[derive(Debug, Clone)]
pub struct FrameReducer {
    pub(super) sampler: LineSampler,
    pub(super) stage: Stage,
    pub(super) n_frames: usize,
}

impl FrameReducer {
    /// The samples of the next frame, at its stated stage position; `None` if that is no position of the stage.
    pub fn reduce(&mut self, profile: &Profile, position_mm: f64) -> Option<FrameSamples> {
        let motion = self.stage.motion(StagePosition::LinearMm(position_mm))?;
        let samples = self.sampler.samples(&profile.points, &motion, position_mm, self.n_frames);
        self.n_frames += 1;
        Some(samples)
    }
}

/// A line in one bin, at the middle of the bin. Part frame, in the axes of [`LineSampler`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Frame index, in the order in which frames were given.
    pub frame: usize,
    /// Stated stage position.
    pub position_mm: f64,
    /// Position along the travel.
    pub along_mm: f64,
    /// Depth.
    pub depth_mm: f64,
    /// Derivatives of position and depth along the line, per mm across the travel.
    pub by_across: [f64; 2],
    /// Pixel of the sample.
    pub pixel: [f64; 2],
    /// Mean of the logarithm of the line's power, grey levels times pixels; `None` if part of it was saturated.
    pub log_power: Option<f64>,
}

/// Reduces lines to samples.
#[derive(Debug, Clone)]
pub struct LineSampler {
    /// Orders evaluated.
    pub orders: Vec<i8>,
    /// Unit vectors of the camera frame: along the travel, across it, and the depth.
    pub axes: [Vector3<f64>; 3],
    /// Width of a bin across the travel.
    pub bin_mm: f64,
    /// Bins across the field.
    pub n_bins: usize,
}

/// The samples of one frame: per order, in the sequence of the calibration, by bin.
pub type FrameSamples = Vec<Vec<(usize, Sample)>>;

impl LineSampler {
    /// `None` for a station without a linear stage, or with one that moves along the view.
    pub fn new(calibration: &Calibration) -> Option<Self> {
        let Some(Stage::Linear(stage)) = calibration.stage else { return None };
        let along = stage.direction.try_normalize(f64::MIN_POSITIVE)?;
        let depth = (Vector3::z() - along * along.z).try_normalize(1e-3)?;
        let column_mm = calibration.depth_range_mm.middle_mm() / calibration.camera.fx_px;
        let width_mm = column_mm * calibration.camera.width_px.max(calibration.camera.height_px) as f64;
        let bin_mm = column_mm * BIN_COLUMNS as f64;
        // The field of view is wider at the far end of the range than in its middle.
        let n_bins = (2.0 * width_mm / bin_mm).ceil() as usize;
        Some(Self {
            orders: calibration.orders.clone(),
            axes: [along, depth.cross(&along), depth],
            bin_mm,
            n_bins,
        })
    }

    /// One frame's lines, reduced to samples in the bins that they fill. `points`: by order, then along the line.
    pub fn samples(
        &self,
        points: &[ProfilePoint],
        motion: &Motion,
        position_mm: f64,
        frame: usize,
    ) -> FrameSamples {
        let of_order = |order: &i8| {
            let first = points.partition_point(|point| point.order < *order);
            let n = points[first..].partition_point(|point| point.order == *order);
            self.of_line(&points[first..first + n], motion, position_mm, frame)
        };
        self.orders.iter().map(of_order).collect()
    }

    fn of_line(
        &self,
        line: &[ProfilePoint],
        motion: &Motion,
        position_mm: f64,
        frame: usize,
    ) -> Vec<(usize, Sample)> {
        let [along, across, depth] = &self.axes;
        let half = (self.n_bins / 2) as f64;
        let mut samples = Vec::new();
        let mut points: Vec<[f64; 5]> = Vec::with_capacity(2 * BIN_COLUMNS);
        let mut powers: Vec<Option<f64>> = Vec::with_capacity(2 * BIN_COLUMNS);
        let mut current: Option<usize> = None;
        let mut finish = |bin: usize, points: &[[f64; 5]], powers: &[Option<f64>]| {
            let sample_of_bin = sample_of_bin(points, powers, self.bin_mm);
            samples.extend(sample_of_bin.map(|sample| (bin, Sample { frame, position_mm, ..sample })));
        };
        for point in line {
            let in_part = motion.part_from_camera(&point.hit_in_camera).xyz;
            let place = (in_part.dot(across) / self.bin_mm).floor() + half;
            if !(place >= 0.0 && place < self.n_bins as f64) {
                continue;
            }
            let bin = place as usize;
            if let Some(last) = current.replace(bin).filter(|last| *last != bin) {
                finish(last, &points, &powers);
                points.clear();
                powers.clear();
            }
            let from_middle_mm = in_part.dot(across) - (place - half + 0.5) * self.bin_mm;
            let centreline = &point.centreline;
            points.push([
                from_middle_mm,
                in_part.dot(along),
                in_part.dot(depth),
                centreline.u_px,
                centreline.v_px,
            ]);
            let power = f64::from(centreline.intensity) * f64::from(centreline.width_px);
            powers.push((!centreline.saturated && power > 0.0).then(|| power.ln()));
        }
        if let Some(last) = current {
            finish(last, &points, &powers);
        }
        samples
    }
}

/// The sample of the points of one bin; `None` for a bin that is not filled, or contains an edge and so two
/// surfaces.
fn sample_of_bin(points: &[[f64; 5]], powers: &[Option<f64>], bin_mm: f64) -> Option<Sample> {
    if 4 * points.len() < 3 * BIN_COLUMNS {
        return None;
    }
    let line =
        |which: usize| line_through(&points.iter().map(|point| [point[0], point[which]]).collect::<Vec<_>>());
    let ((along_slope, along_mm, _), (depth_slope, depth_mm, scatter_mm)) = (line(1)?, line(2)?);
    if scatter_mm >= 0.1 * bin_mm {
        return None;
    }
    let (_, u_px, _) = line(3)?;
    let (_, v_px, _) = line(4)?;
    let log_power = powers.iter().copied().sum::<Option<f64>>().map(|sum| sum / powers.len() as f64);
    let by_across = [along_slope, depth_slope];
    Some(Sample { frame: 0, position_mm: 0.0, along_mm, depth_mm, by_across, pixel: [u_px, v_px], log_power })
}

/// Slope, intercept and scatter of the straight line through points; `None` for fewer than three, or coincident ones.
pub fn line_through(points: &[[f64; 2]]) -> Option<(f64, f64, f64)> {
    let n = points.len() as f64;
    if points.len() < 3 {
        return None;
    }
    let (mean_x, mean_y) =
        (points.iter().map(|p| p[0]).sum::<f64>() / n, points.iter().map(|p| p[1]).sum::<f64>() / n);
    let spread: f64 = points.iter().map(|p| (p[0] - mean_x).powi(2)).sum();
    if spread <= f64::EPSILON {
        return None;
    }
    let slope = points.iter().map(|p| (p[0] - mean_x) * (p[1] - mean_y)).sum::<f64>() / spread;
    let constant = mean_y - slope * mean_x;
    let squares: f64 = points.iter().map(|p| (p[1] - constant - slope * p[0]).powi(2)).sum();
    Some((slope, constant, (squares / (n - 2.0)).sqrt()))
}

/// The surface of one order in a bin, at a position along the travel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePlace {
    /// Depth there.
    pub depth_mm: f64,
    /// ∂depth/∂along.
    pub slope: f64,
    /// The last frame used.
    pub last_frame: usize,
    /// Stated stage position when the line crossed the point.
    pub position_mm: f64,
    /// Pixel that observed it.
    pub pixel: [f64; 2],
    /// As in [`Sample::log_power`].
    pub log_power: Option<f64>,
}

/// The surface through samples in the order of travel, at a position along it; `None` where it is not smooth, or was
/// not observed in consecutive frames.
pub fn surface_at(samples: &[Sample], along_mm: f64) -> Option<SurfacePlace> {
    let (first, last) = (samples.first()?, samples.last()?);
    let rising = last.along_mm > first.along_mm;
    let is_before = |sample: &Sample| (sample.along_mm < along_mm) == rising;
    let after = samples.partition_point(is_before);
    let around = samples.get(after.checked_sub(2)?..after + 2)?;
    let [a, b, c, d] = around else { return None };
    if d.frame != a.frame + 3 {
        return None;
    }
    let slope_of = |from: &Sample, to: &Sample| (to.depth_mm - from.depth_mm) / (to.along_mm - from.along_mm);
    let (middle, slope) = (slope_of(b, c), slope_of(a, d));
    let is_smooth = [slope_of(a, b), middle, slope_of(c, d)].iter().all(|one| (one - slope).abs() <= MAX_SLOPE);
    if !(is_smooth && slope.abs() <= MAX_SLOPE) {
        return None;
    }
    let share = (along_mm - b.along_mm) / (c.along_mm - b.along_mm);
    let between = |from: f64, to: f64| from + share * (to - from);
    // The cubic through all four: a straight line would cut off curvature, which looks like a lag of micrometres.
    let cubic = around.iter().map(|at| {
        let others = around.iter().filter(|other| other.frame != at.frame);
        at.depth_mm
            * others.map(|other| (along_mm - other.along_mm) / (at.along_mm - other.along_mm)).product::<f64>()
    });
    Some(SurfacePlace {
        depth_mm: cubic.sum(),
        slope,
        last_frame: d.frame,
        position_mm: between(b.position_mm, c.position_mm),
        pixel: [0, 1].map(|axis| between(b.pixel[axis], c.pixel[axis])),
        log_power: b.log_power.zip(c.log_power).map(|(from, to)| between(from, to)),
    })
}
