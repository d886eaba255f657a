//! Requested properties of a station; its small manufacturing and assembly errors derive from the seed.

use optics::StageKind;
use vision::LineDirection;

/// The line projector of a station.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProjectorShape {
    /// A laser behind a grating.
    Grating,
    /// Independent lasers, side by side, without a grating; the lines are numbered from 0, from the top (left).
    Lasers {
        /// How many, 1 to [`LINES_MAX`](capture::params::LINES_MAX).
        lines: usize,
    },
}

/// The requested properties of a station. The default is a 1280 × 1024 station at 400 mm with five red lines.
#[derive(Debug, Clone, PartialEq)]
pub struct StationShape {
    /// Image columns.
    pub width_px: usize,
    /// Image rows.
    pub height_px: usize,
    /// Bits per pixel: 8 or 16.
    pub bits: u32,
    /// What makes the lines.
    pub projector: ProjectorShape,
    /// Nominal wavelength of the laser.
    pub wavelength_nm: f64,
    /// Nominal grooves per millimetre of the grating.
    pub lines_per_mm: f64,
    /// Relative error of the true λ/d_g against the nominal value.
    pub wavelength_over_period_error: f64,
    /// Orders of a grating that carry light, in any sequence.
    pub orders: Vec<i8>,
    /// Direction of the lines in the image; if along columns, the projector is mounted beside the camera.
    pub line_direction: LineDirection,
    /// Whether the stage travels across the lines or turns about an axis along them.
    pub stage: StageKind,
    /// Distance from the camera to the middle of the working volume.
    pub standoff_mm: f64,
    /// Half of the image's width at the standoff, mm; with the width in pixels this sets the focal length.
    pub field_half_width_mm: f64,
    /// Angle between the fan's axis and the grating's normal.
    pub grating_tilt_rad: f64,
    /// Standard deviation of a line's profile at the standoff, before lens blur.
    pub line_sigma_px: f64,
    /// Distance from the standoff at which the lines are √2 times as wide; infinite for unlimited depth of focus.
    pub focus_depth_mm: f64,
    /// Mean grey level of the brightest line's ridge on white, as a fraction of full scale.
    pub line_peak: f64,
    /// Speckle contrast: standard deviation over mean, 0–1.
    pub speckle_contrast: f64,
    /// Speckle grain size: full width at half maximum of the intensity's correlation.
    pub speckle_grain_px: f64,
    /// Grey levels (of 255) that ambient light adds to white in laser images.
    pub ambient_levels: f64,
}

impl Default for StationShape {
    fn default() -> Self {
        Self {
            width_px: 1280,
            height_px: 1024,
            bits: 8,
            projector: ProjectorShape::Grating,
            wavelength_nm: 660.0,
            lines_per_mm: 50.0,
            wavelength_over_period_error: 0.0,
            orders: vec![-2, -1, 0, 1, 2],
            line_direction: LineDirection::Rows,
            stage: StageKind::Linear,
            standoff_mm: 400.0,
            field_half_width_mm: 101.7,
            grating_tilt_rad: 0.025,
            line_sigma_px: 2.0,
            focus_depth_mm: f64::INFINITY,
            line_peak: 0.8,
            speckle_contrast: 0.3,
            speckle_grain_px: 1.5,
            ambient_levels: 0.0,
        }
    }
}

impl StationShape {
    /// Nominal λ/d_g.
    pub fn wavelength_over_period(&self) -> f64 {
        self.wavelength_nm * 1e-6 * self.lines_per_mm
    }

    /// Scale relative to a field of ±100 mm, for boards and travels.
    pub fn field_scale(&self) -> f64 {
        let aspect = self.height_px as f64 / self.width_px as f64;
        self.field_half_width_mm / 101.7 * (aspect / 0.8).min(1.0)
    }
}
