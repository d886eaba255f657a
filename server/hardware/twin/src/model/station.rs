//! A simulated station: the true camera, grating, stage and light, known only to the truth files.

use std::borrow::Cow;

use capture::params::LINES_MAX;
use nalgebra::{Rotation3, Vector3};
use optics::{Camera, Grating, Motion, RotaryAxis, Stage, StageAxis, StageKind};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use remedy::Remedy;
use vision::LineDirection;

use crate::model::random::derived_seed;
use crate::model::shape::{ProjectorShape, StationShape};
use crate::params::{FAN_MARGIN, LASER_FIELD_FRACTION, LOOK_DOWN_RAD, TABLE_BELOW_FRACTION};

/// Random stream of the station's own numbers, derived from its seed.
const STATION_STREAM: u64 = 1;

/// Random stream of a turntable's axis.
const AXIS_STREAM: u64 = 6;

/// Random stream of independent lasers.
const LASER_STREAM: u64 = 7;

/// Why a station cannot be built as requested.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StationError {
    /// A property out of range.
    #[error("a station with {name} = {value} cannot be built")]
    OutOfRange {
        /// The property of the shape.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The permitted values.
        expected: &'static str,
    },
    /// No order, or the same order twice.
    #[error("orders {orders:?} are empty or contain the same order twice")]
    Orders {
        /// As requested.
        orders: Vec<i8>,
    },
    /// Lines that the camera could not see on a plate at the standoff.
    #[error("orders {orders:?} fall outside the image at {standoff_mm} mm")]
    OutOfView {
        /// These orders.
        orders: Vec<i8>,
        /// The standoff.
        standoff_mm: f64,
    },
}

impl Remedy for StationError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(match self {
            Self::OutOfRange { expected, .. } => (*expected).into(),
            Self::Orders { .. } => "list each order once".into(),
            Self::OutOfView { .. } => "widen the field, use fewer orders or a coarser grating".into(),
        })
    }
}

/// Ground truth of a simulated station.
#[derive(Debug, Clone, PartialEq)]
pub struct StationModel {
    /// Seed of all randomness of this station and its images.
    pub seed: u64,
    /// The requested properties of the station.
    pub shape: StationShape,
    /// The true camera.
    pub camera: Camera,
    /// The true grating; without meaning if there are lasers.
    pub grating: Grating,
    /// The true independent lasers, one per line: each a source whose light passes undiffracted, as order 0. Empty for
    /// a grating.
    pub lasers: Vec<Grating>,
    /// The true stage.
    pub stage: Stage,
    /// Orders, or numbers of independent lines, from the top (left) of the image downwards (rightwards).
    pub orders: Vec<i8>,
    /// Power of each line relative to the brightest, in the sequence of `orders`.
    pub order_powers: Vec<f64>,
    /// Half of the laser's fan angle.
    pub fan_half_angle_rad: f64,
    /// Standard deviation of the light sheets' thickness at the standoff.
    pub sheet_sigma_mm: f64,
}

impl StationModel {
    /// The station of that seed and shape.
    ///
    /// # Errors
    /// [`StationError`] if the shape is impossible or an order would never be in the image.
    pub fn seeded(seed: u64, shape: &StationShape) -> Result<Self, StationError> {
        check(shape)?;
        let mut draw = Draw { rng: Pcg64::seed_from_u64(derived_seed(seed, STATION_STREAM)) };
        let camera = seeded_camera(&mut draw, shape);
        let mut grating = seeded_grating(&mut draw, shape);
        let mut stage =
            Vector3::new(draw.around(0.0, 0.01), 1.0, draw.around(0.0, 0.02)).normalize() * draw.around(1.0, 4e-4);
        let mut lasers = seeded_lasers(seed, shape);
        let mut axis = seeded_axis(seed, shape);
        if shape.line_direction == LineDirection::Columns {
            let quarter_turn = Rotation3::from_axis_angle(&Vector3::z_axis(), -std::f64::consts::FRAC_PI_2);
            grating = turned(&grating, &quarter_turn);
            lasers = lasers.iter().map(|laser| turned(laser, &quarter_turn)).collect();
            stage = quarter_turn * stage;
            axis = RotaryAxis::new(quarter_turn * axis.point_mm, quarter_turn * axis.direction);
        }
        let stage = match shape.stage {
            StageKind::Linear => StageAxis::new(stage).into(),
            StageKind::Rotary => axis.into(),
        };
        let orders = orders_in_image(shape, &camera, &grating, &lasers)?;
        let efficiency = |order: i8| if lasers.is_empty() { 1.0 + 0.12 * f64::from(order).powi(2) } else { 1.0 };
        let powers: Vec<f64> = orders.iter().map(|&m| draw.around(1.0, 0.05) / efficiency(m)).collect();
        let brightest = powers.iter().copied().fold(0.0, f64::max);
        let half_field = shape.field_half_width_mm.max(half_height_mm(shape)) * FAN_MARGIN;
        let mm_per_px = shape.field_half_width_mm * 2.0 / shape.width_px as f64;
        Ok(Self {
            seed,
            shape: shape.clone(),
            camera,
            grating,
            lasers,
            stage,
            order_powers: powers.iter().map(|power| power / brightest).collect(),
            orders,
            fan_half_angle_rad: (half_field / shape.standoff_mm).atan(),
            sheet_sigma_mm: shape.line_sigma_px * mm_per_px * grating.axis.z,
        })
    }
}

impl StationModel {
    /// Motion of the part at `position`, mm of travel or degrees of a turntable.
    pub fn motion(&self, position: f64) -> Motion {
        let position = self.stage.kind().position(position);
        self.stage.motion(position).expect("a position of the stage's own kind")
    }

    /// Path length of a part moved to `position`; for a turntable, that of a surface as far from the axis as the table
    /// top is from the camera's axis.
    pub(crate) fn travel_mm(&self, position: f64) -> f64 {
        match self.stage {
            Stage::Linear(axis) => axis.direction.norm() * position,
            Stage::Rotary(_) => self.table_below_mm() * position.to_radians(),
        }
    }

    /// Distance of a turntable's top below the middle of the working volume.
    pub(crate) fn table_below_mm(&self) -> f64 {
        TABLE_BELOW_FRACTION * self.shape.field_half_width_mm
    }

    /// The source of a line, and the order of its light there: 0, undiffracted, for an independent laser.
    pub fn source_of(&self, line: i8) -> (Grating, i8) {
        source_of(&self.grating, &self.lasers, line)
    }

    /// Thickness of the light sheets at this depth relative to the standoff: √(1 + (Δz/z_R)²) of a Gaussian beam.
    pub fn defocus(&self, depth_mm: f64) -> f64 {
        defocus(depth_mm - self.shape.standoff_mm, 1.0 / self.shape.focus_depth_mm)
    }
}

/// See [`StationModel::defocus`].
#[inline]
pub(crate) fn defocus(from_focus_mm: f64, per_focus_depth_mm: f64) -> f64 {
    let ratio = from_focus_mm * per_focus_depth_mm;
    (1.0 + ratio * ratio).sqrt()
}

/// Uniform random values around a nominal one.
struct Draw {
    rng: Pcg64,
}

impl Draw {
    fn around(&mut self, centre: f64, half_range: f64) -> f64 {
        centre + half_range * (2.0 * self.rng.random::<f64>() - 1.0)
    }
}

fn seeded_camera(draw: &mut Draw, shape: &StationShape) -> Camera {
    let (width, height) = (shape.width_px as f64, shape.height_px as f64);
    let focal_px = width / 2.0 * shape.standoff_mm / shape.field_half_width_mm;
    let fx_px = focal_px * draw.around(1.0, 0.004);
    Camera {
        width_px: shape.width_px,
        height_px: shape.height_px,
        fx_px,
        fy_px: fx_px * draw.around(1.0, 0.0008),
        cx_px: (width - 1.0) / 2.0 + width * draw.around(0.0, 0.01),
        cy_px: (height - 1.0) / 2.0 + height * draw.around(0.0, 0.01),
        k1: draw.around(-0.1, 0.02),
        k2: draw.around(0.11, 0.03),
        p1: draw.around(0.0, 2e-4),
        p2: draw.around(0.0, 2e-4),
        k3: 0.0,
    }
}

/// A projector above the camera whose lines run along image rows.
fn seeded_grating(draw: &mut Draw, shape: &StationShape) -> Grating {
    let standoff = shape.standoff_mm;
    let source_mm = Vector3::new(
        standoff * draw.around(0.0, 0.005),
        standoff * draw.around(-0.435, 0.01),
        standoff * draw.around(0.0275, 0.01),
    );
    let aim = Vector3::new(0.0, standoff * draw.around(0.0, 0.005), standoff);
    let axis = (aim - source_mm).normalize();
    let fan = perpendicular(&Vector3::new(1.0, draw.around(0.0, 0.006), draw.around(0.0, 0.006)), &axis);
    let azimuth = draw.around(0.0, std::f64::consts::PI);
    let lean = fan * azimuth.cos() + axis.cross(&fan) * azimuth.sin();
    let normal = axis * shape.grating_tilt_rad.cos() + lean * shape.grating_tilt_rad.sin();
    let groove = perpendicular(&(fan + axis.cross(&fan) * draw.around(0.0, 0.01)), &normal);
    Grating {
        source_mm,
        axis,
        fan,
        normal,
        groove,
        gap_mm: draw.around(18.0, 2.0),
        wavelength_over_period: shape.wavelength_over_period() * (1.0 + shape.wavelength_over_period_error),
    }
}

/// A turntable whose axis is parallel to the lines, found by the camera from above; lines along image rows.
fn seeded_axis(seed: u64, shape: &StationShape) -> RotaryAxis {
    let mut draw = Draw { rng: Pcg64::seed_from_u64(derived_seed(seed, AXIS_STREAM)) };
    let standoff = shape.standoff_mm;
    let point = Vector3::new(0.0, draw.around(0.0, 0.005), 1.0 + draw.around(0.0, 0.005)) * standoff;
    let (down, flat) = (LOOK_DOWN_RAD + draw.around(0.0, 0.02)).sin_cos();
    RotaryAxis::new(point, Vector3::new(flat, draw.around(0.0, 0.01), -down))
}

/// Lasers beside each other above the camera, each aimed at its share of the field; lines along image rows.
fn seeded_lasers(seed: u64, shape: &StationShape) -> Vec<Grating> {
    let ProjectorShape::Lasers { lines } = shape.projector else { return Vec::new() };
    let mut draw = Draw { rng: Pcg64::seed_from_u64(derived_seed(seed, LASER_STREAM)) };
    let reach_mm = LASER_FIELD_FRACTION * half_height_mm(shape);
    let one = |line: usize| {
        let mut laser = seeded_grating(&mut draw, shape);
        let across_mm = reach_mm * ((2 * line + 1) as f64 / lines as f64 - 1.0);
        let aim = Vector3::new(0.0, across_mm, shape.standoff_mm);
        let tilt = Rotation3::rotation_between(&laser.axis, &(aim - laser.source_mm)).unwrap_or_default();
        laser = turned(&laser, &tilt);
        Grating { normal: laser.axis, groove: laser.fan, ..laser }
    };
    (0..lines).map(one).collect()
}

fn source_of(grating: &Grating, lasers: &[Grating], line: i8) -> (Grating, i8) {
    match usize::try_from(line).ok().and_then(|line| lasers.get(line)) {
        Some(laser) => (*laser, 0),
        None => (*grating, line),
    }
}

/// The unit vector nearest to `vector` that is perpendicular to the unit vector `to`.
fn perpendicular(vector: &Vector3<f64>, to: &Vector3<f64>) -> Vector3<f64> {
    (vector - to * vector.dot(to)).normalize()
}

fn turned(grating: &Grating, turn: &Rotation3<f64>) -> Grating {
    Grating {
        source_mm: turn * grating.source_mm,
        axis: turn * grating.axis,
        fan: turn * grating.fan,
        normal: turn * grating.normal,
        groove: turn * grating.groove,
        ..*grating
    }
}

/// The requested orders, or the lines of the lasers, in image order, from the top (left).
fn orders_in_image(
    shape: &StationShape,
    camera: &Camera,
    grating: &Grating,
    lasers: &[Grating],
) -> Result<Vec<i8>, StationError> {
    let mut found: Vec<(f64, i8)> = Vec::new();
    let mut missed = Vec::new();
    let limit = match shape.line_direction {
        LineDirection::Rows => shape.height_px as f64 - 1.0,
        LineDirection::Columns => shape.width_px as f64 - 1.0,
    };
    let lines = (0..=i8::MAX).take(lasers.len()).collect::<Vec<i8>>();
    for &line in if lasers.is_empty() { &shape.orders } else { &lines } {
        let (source, order) = source_of(grating, lasers, line);
        let across = source.ray(0.0, order).filter(|ray| ray.direction.z > 0.0).and_then(|ray| {
            let ray_length = (shape.standoff_mm - ray.origin_mm.z) / ray.direction.z;
            let pixel = camera.project(&(ray.origin_mm + ray.direction * ray_length))?;
            Some(if shape.line_direction == LineDirection::Rows { pixel.y } else { pixel.x })
        });
        match across {
            Some(across) if (0.0..=limit).contains(&across) => found.push((across, line)),
            _ => missed.push(line),
        }
    }
    if !missed.is_empty() {
        return Err(StationError::OutOfView { orders: missed, standoff_mm: shape.standoff_mm });
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(found.into_iter().map(|(_, order)| order).collect())
}

fn half_height_mm(shape: &StationShape) -> f64 {
    shape.field_half_width_mm * shape.height_px as f64 / shape.width_px as f64
}

fn check(shape: &StationShape) -> Result<(), StationError> {
    let positive = "give a finite number above 0";
    let within = |name, value: f64, allowed: bool, expected| {
        if allowed && value.is_finite() { Ok(()) } else { Err(StationError::OutOfRange { name, value, expected }) }
    };
    let size = "give 64 to 16384 pixels";
    within("width_px", shape.width_px as f64, (64..=16384).contains(&shape.width_px), size)?;
    within("height_px", shape.height_px as f64, (64..=16384).contains(&shape.height_px), size)?;
    within("bits", f64::from(shape.bits), matches!(shape.bits, 8 | 16), "give 8 or 16")?;
    for (name, value) in [
        ("wavelength_nm", shape.wavelength_nm),
        ("lines_per_mm", shape.lines_per_mm),
        ("standoff_mm", shape.standoff_mm),
        ("field_half_width_mm", shape.field_half_width_mm),
        ("line_sigma_px", shape.line_sigma_px),
        // Infinity is allowed.
        ("focus_depth_mm", shape.focus_depth_mm.min(f64::MAX)),
        ("line_peak", shape.line_peak),
        ("speckle_grain_px", shape.speckle_grain_px),
    ] {
        within(name, value, value > 0.0, positive)?;
    }
    let field = "give at most the standoff";
    within(
        "field_half_width_mm",
        shape.field_half_width_mm,
        shape.field_half_width_mm <= shape.standoff_mm,
        field,
    )?;
    within(
        "speckle_contrast",
        shape.speckle_contrast,
        (0.0..=1.0).contains(&shape.speckle_contrast),
        "give 0 to 1",
    )?;
    let ambient = "give 0 to 255 grey levels";
    within("ambient_levels", shape.ambient_levels, (0.0..=255.0).contains(&shape.ambient_levels), ambient)?;
    let tilt = "give less than 0.5 rad";
    within("grating_tilt_rad", shape.grating_tilt_rad, shape.grating_tilt_rad.abs() < 0.5, tilt)?;
    let error = "give a relative error below 0.1";
    let drift = shape.wavelength_over_period_error;
    within("wavelength_over_period_error", drift, drift.abs() < 0.1, error)?;
    if let ProjectorShape::Lasers { lines } = shape.projector {
        let expected = "give 1 to 41 lasers";
        within("lines", lines as f64, (1..=LINES_MAX).contains(&lines), expected)?;
    }
    let mut orders = shape.orders.clone();
    orders.sort_unstable();
    orders.dedup();
    if orders.is_empty() || orders.len() != shape.orders.len() {
        return Err(StationError::Orders { orders: shape.orders.clone() });
    }
    Ok(())
}
