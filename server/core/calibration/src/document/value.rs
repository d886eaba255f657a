//! Conversion between a calibration and its serialised form.

use nalgebra::{DMatrix, Vector3};
use optics::stage::{AngleError, Straightness, Tilt};
use optics::{
    Calibration, Camera, DepthRangeMm, Grating, LightSurfaces, Pencil, Plane, RotaryAxis, Stage, StageAxis,
};

use crate::document::text::{
    AxisText, CalibrationText, CameraText, CovarianceText, DepthRangeText, LightText, PlaneText, RotaryTag,
    StageText, StraightnessText, TiltText, TravelText,
};
use crate::document::{DocumentError, FORMAT};

impl CalibrationText {
    /// The serialised form of a calibration.
    pub fn of(value: &Calibration) -> Self {
        let camera = &value.camera;
        let n = value.covariance.nrows();
        Self {
            format: FORMAT.to_owned(),
            id: value.id.clone(),
            camera: CameraText {
                width_px: camera.width_px,
                height_px: camera.height_px,
                fx_px: camera.fx_px,
                fy_px: camera.fy_px,
                cx_px: camera.cx_px,
                cy_px: camera.cy_px,
                k1: camera.k1,
                k2: camera.k2,
                p1: camera.p1,
                p2: camera.p2,
                k3: camera.k3,
            },
            orders: value.orders.clone(),
            light: LightText::of(&value.light),
            stage: value.stage.as_ref().map(StageText::of),
            depth_range: DepthRangeText {
                near_mm: value.depth_range_mm.near_mm,
                far_mm: value.depth_range_mm.far_mm,
            },
            covariance: CovarianceText {
                parameters: value.parameter_names(),
                matrix: (0..n).map(|i| (0..n).map(|j| value.covariance[(i, j)]).collect()).collect(),
            },
        }
    }

    /// Parses the serialised form, as in a point cloud's header.
    ///
    /// # Errors
    /// [`DocumentError`] names the entry that is wrong.
    pub fn parse(text: &str) -> Result<Self, DocumentError> {
        let calibration: Self = serde_json::from_str(text).map_err(DocumentError::Malformed)?;
        calibration.check()?;
        Ok(calibration)
    }

    /// The calibration; the text must have been checked.
    pub fn value(&self) -> Calibration {
        let camera = &self.camera;
        let matrix = [[camera.fx_px, 0.0, camera.cx_px], [0.0, camera.fy_px, camera.cy_px], [0.0, 0.0, 1.0]];
        let distortion = [camera.k1, camera.k2, camera.p1, camera.p2, camera.k3];
        let rows = &self.covariance.matrix;
        Calibration {
            id: self.id.clone(),
            camera: Camera::from_opencv(camera.width_px, camera.height_px, matrix, &distortion),
            orders: self.orders.clone(),
            light: self.light.value(),
            stage: self.stage.as_ref().map(StageText::value),
            depth_range_mm: DepthRangeMm { near_mm: self.depth_range.near_mm, far_mm: self.depth_range.far_mm },
            covariance: DMatrix::from_fn(rows.len(), rows.len(), |i, j| rows[i][j]),
        }
    }
}

impl StageText {
    pub(super) fn of(stage: &Stage) -> Self {
        match stage {
            Stage::Linear(axis) => Self::Linear(TravelText::of(axis)),
            Stage::Rotary(axis) => Self::Rotary(AxisText {
                kind: RotaryTag::Rotary,
                point_mm: axis.point_mm.into(),
                direction: axis.direction.into(),
                angle_sigma_deg: axis.angle_error.map(|error| error.sigma_rad().to_degrees()),
            }),
        }
    }

    pub(super) fn value(&self) -> Stage {
        match self {
            Self::Linear(travel) => travel.value().into(),
            Self::Rotary(axis) => Stage::Rotary(RotaryAxis {
                point_mm: Vector3::from(axis.point_mm),
                direction: Vector3::from(axis.direction),
                angle_error: axis.angle_sigma_deg.and_then(|sigma_deg| AngleError::new(sigma_deg.to_radians())),
            }),
        }
    }
}

impl TravelText {
    pub(super) fn of(stage: &StageAxis) -> Self {
        let straightness = stage.straightness.as_ref().map(|straightness| {
            let (first_mm, last_mm) = straightness.ends_mm();
            StraightnessText {
                sigma_mm: straightness.sigma_mm(),
                first_mm,
                last_mm,
                n_nodes: straightness.n_nodes(),
            }
        });
        let tilt = stage.tilt.as_ref().map(|tilt| {
            let (first_mm, last_mm) = tilt.ends_mm();
            TiltText {
                sigmas_rad: tilt.sigmas_rad().map(Into::into),
                centre_mm: (*tilt.centre_mm()).into(),
                first_mm,
                last_mm,
                n_nodes: tilt.n_nodes(),
            }
        });
        Self { direction_mm_per_mm: stage.direction.into(), straightness, tilt }
    }

    pub(super) fn value(&self) -> StageAxis {
        StageAxis {
            direction: Vector3::from(self.direction_mm_per_mm),
            straightness: self.straightness.as_ref().and_then(StraightnessText::value),
            tilt: self.tilt.as_ref().and_then(TiltText::value),
        }
    }
}

impl StraightnessText {
    pub(super) fn value(&self) -> Option<Straightness> {
        Straightness::new(self.sigma_mm, self.first_mm, self.last_mm, self.n_nodes)
    }
}

impl TiltText {
    pub(super) fn value(&self) -> Option<Tilt> {
        let sigmas_rad = self.sigmas_rad.map(Vector3::from);
        Tilt::new(sigmas_rad, self.centre_mm.into(), (self.first_mm, self.last_mm), self.n_nodes)
    }
}

impl LightText {
    pub(super) fn of(light: &LightSurfaces) -> Self {
        match light {
            LightSurfaces::Planes(planes) => Self::Planes {
                planes: planes
                    .iter()
                    .map(|(order, plane)| PlaneText {
                        order: *order,
                        normal: plane.normal.into(),
                        offset_mm: plane.offset_mm,
                    })
                    .collect(),
            },
            LightSurfaces::Pencil(pencil) => Self::Pencil {
                point_mm: pencil.point_mm.into(),
                direction: pencil.direction.into(),
                base_normal: pencil.base_normal.into(),
                wavelength_over_period: pencil.wavelength_over_period,
            },
            LightSurfaces::Grating(grating) => Self::Grating {
                source_mm: grating.source_mm.into(),
                axis: grating.axis.into(),
                fan: grating.fan.into(),
                normal: grating.normal.into(),
                groove: grating.groove.into(),
                gap_mm: grating.gap_mm,
                wavelength_over_period: grating.wavelength_over_period,
            },
        }
    }

    pub(super) fn value(&self) -> LightSurfaces {
        match self {
            Self::Planes { planes } => LightSurfaces::Planes(
                planes
                    .iter()
                    .map(|p| (p.order, Plane { normal: Vector3::from(p.normal), offset_mm: p.offset_mm }))
                    .collect(),
            ),
            Self::Pencil { point_mm, direction, base_normal, wavelength_over_period } => {
                LightSurfaces::Pencil(Pencil {
                    point_mm: Vector3::from(*point_mm),
                    direction: Vector3::from(*direction),
                    base_normal: Vector3::from(*base_normal),
                    wavelength_over_period: *wavelength_over_period,
                })
            }
            Self::Grating { source_mm, axis, fan, normal, groove, gap_mm, wavelength_over_period } => {
                LightSurfaces::Grating(Grating {
                    source_mm: Vector3::from(*source_mm),
                    axis: Vector3::from(*axis),
                    fan: Vector3::from(*fan),
                    normal: Vector3::from(*normal),
                    groove: Vector3::from(*groove),
                    gap_mm: *gap_mm,
                    wavelength_over_period: *wavelength_over_period,
                })
            }
        }
    }

    pub(super) fn parameters(&self) -> usize {
        self.value().parameters()
    }
}
