//! The light fan of an order: its rays at sub-pixel angular spacing, computed once.

use nalgebra::Vector3;
use optics::LightRay;

use crate::model::station::StationModel;
use crate::params::{EVALUATED_DEPTH_FRACTION, SHEET_REACH_SIGMAS};

/// Distance between neighbouring rays, in pixels at the standoff.
pub(crate) const FINE_STEP_PX: f64 = 0.9;

/// The sampled fan angles, from −last to last steps.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FanAngles {
    pub spacing_mm: f64,
    pub step_rad: f64,
    pub last: i32,
}

/// The rays of one order.
#[derive(Debug, Clone)]
pub(crate) struct Fan {
    pub order: i8,
    pub angles: FanAngles,
    /// Half-width of the evaluated sheet around its centre.
    pub half_width_mm: f64,
    rays: Vec<Option<FanRay>>,
}

/// A ray in the middle of the sheet.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FanRay {
    pub origin_mm: Vector3<f64>,
    pub direction: Vector3<f64>,
    /// From the middle of the sheet to its evaluated edge.
    pub across_mm: Vector3<f64>,
}

impl FanAngles {
    pub(crate) fn new(model: &StationModel, reference_distance_mm: f64) -> Self {
        let spacing_mm = FINE_STEP_PX / model.camera.fx_px.max(model.camera.fy_px) * model.shape.standoff_mm;
        let step_rad = spacing_mm / reference_distance_mm;
        Self { spacing_mm, step_rad, last: (model.fan_half_angle_rad / step_rad).ceil() as i32 }
    }

    pub(crate) fn phi_rad(&self, idx: i32) -> f64 {
        f64::from(idx) * self.step_rad
    }
}

impl Fan {
    pub(crate) fn new(model: &StationModel, angles: FanAngles, order: i8) -> Self {
        let widest = model.defocus(model.shape.standoff_mm * (1.0 - EVALUATED_DEPTH_FRACTION));
        let half_width_mm = SHEET_REACH_SIGMAS * model.sheet_sigma_mm * widest;
        let (source, source_order) = model.source_of(order);
        let ray = |idx: i32| {
            let LightRay { origin_mm, direction } = source.ray(angles.phi_rad(idx), source_order)?;
            let across_mm = direction.cross(&source.fan).normalize() * half_width_mm;
            Some(FanRay { origin_mm, direction, across_mm })
        };
        Self { order, angles, half_width_mm, rays: (-angles.last..=angles.last).map(ray).collect() }
    }

    /// The ray at an angle; `None` where no light passes the grating.
    pub(crate) fn ray(&self, idx: i32) -> Option<&FanRay> {
        self.rays.get(usize::try_from(idx + self.angles.last).ok()?)?.as_ref()
    }
}
