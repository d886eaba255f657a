//! Weak priors from nominal values and from the typical construction of projectors, as additional residuals of the
//! globals.

use optics::{CAMERA_PARAMETERS, GRATING_PARAMETERS, Grating, LightSurfaces};

use crate::params::{
    DISTORTION_PRIOR_SIGMA, FOCAL_PRIOR_RELATIVE, GAP_PRIOR_MM, GRATING_ANGLE_PRIOR_RAD,
    PRINCIPAL_POINT_PRIOR_RELATIVE, SOURCE_ALONG_LINE_PRIOR_RELATIVE, WAVELENGTH_OVER_PERIOD_RELATIVE_SIGMA,
};
use crate::solving::bundle_state::BundleState;
use crate::solving::normal::BlockNormal;

/// A Gaussian prior of one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaussianPrior {
    /// Expected value.
    pub mean: f64,
    /// Standard deviation.
    pub sigma: f64,
}

/// Priors of the globals.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Priors {
    /// One per camera parameter; empty while the camera is fixed.
    pub camera: Vec<GaussianPrior>,
    /// λ/d_g.
    pub wavelength_over_period: Option<GaussianPrior>,
    /// For the grating's geometry.
    pub grating: Option<GratingPrior>,
}

/// Priors of the relative positions of a projector's components.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GratingPrior {
    /// The middle of the lit area, camera frame, mm: the source is opposite.
    pub lit_centre_mm: nalgebra::Vector3<f64>,
    /// σ of the source's position along the line.
    pub source_along_line_mm: f64,
}

/// One prior residual: its value in σ, and its derivatives in units of σ.
struct PriorRow {
    start: usize,
    row: [f64; GRATING_PARAMETERS],
    z: f64,
}

impl Priors {
    /// Priors of a camera around an initial estimate of the focal length.
    pub fn of_camera(width_px: usize, height_px: usize, focal_px: f64) -> Vec<GaussianPrior> {
        let (w, h) = (width_px as f64, height_px as f64);
        let focal = GaussianPrior { mean: focal_px, sigma: focal_px * FOCAL_PRIOR_RELATIVE };
        let centre =
            |side: f64| GaussianPrior { mean: (side - 1.0) / 2.0, sigma: side * PRINCIPAL_POINT_PRIOR_RELATIVE };
        let mut priors = vec![focal, focal, centre(w), centre(h)];
        priors.extend(DISTORTION_PRIOR_SIGMA.map(|sigma| GaussianPrior { mean: 0.0, sigma }));
        priors
    }

    /// Prior of λ/d_g around its nominal value.
    pub fn of_wavelength_over_period(sheet: f64) -> GaussianPrior {
        GaussianPrior { mean: sheet, sigma: sheet * WAVELENGTH_OVER_PERIOD_RELATIVE_SIGMA }
    }

    /// Prior of the source's position for a scene around `lit_centre_mm`.
    pub fn of_grating(lit_centre_mm: nalgebra::Vector3<f64>, source_mm: &nalgebra::Vector3<f64>) -> GratingPrior {
        let distance = (lit_centre_mm - source_mm).norm();
        GratingPrior { lit_centre_mm, source_along_line_mm: distance * SOURCE_ALONG_LINE_PRIOR_RELATIVE }
    }

    /// Adds the priors' rows to the normal equations.
    pub fn add_to(&self, station: &BundleState, sums: &mut BlockNormal) {
        for row in self.rows(station) {
            sums.cost += 0.5 * row.z * row.z;
            let width = GRATING_PARAMETERS.min(station.globals() - row.start);
            sums.add(&[(row.start, &row.row[..width])], &[0.0; 6], row.z, 1.0);
        }
    }

    /// Half the sum of squares of the priors.
    pub fn cost(&self, station: &BundleState) -> f64 {
        self.rows(station).iter().map(|row| 0.5 * row.z * row.z).sum()
    }

    fn rows(&self, station: &BundleState) -> Vec<PriorRow> {
        let mut rows = Vec::new();
        for (idx, (value, gaussian)) in station.camera.parameters().iter().zip(&self.camera).enumerate() {
            rows.push(PriorRow::single(idx, (value - gaussian.mean) / gaussian.sigma, 1.0 / gaussian.sigma));
        }
        match &station.light {
            Some(LightSurfaces::Pencil(pencil)) => {
                if let Some(gaussian) = self.wavelength_over_period {
                    let z = (pencil.wavelength_over_period - gaussian.mean) / gaussian.sigma;
                    rows.push(PriorRow::single(CAMERA_PARAMETERS + 5, z, 1.0 / gaussian.sigma));
                }
            }
            Some(LightSurfaces::Grating(grating)) => {
                if let Some(gaussian) = self.wavelength_over_period {
                    let z = (grating.wavelength_over_period - gaussian.mean) / gaussian.sigma;
                    rows.push(PriorRow::single(CAMERA_PARAMETERS + 9, z, 1.0 / gaussian.sigma));
                }
                if let Some(prior) = &self.grating {
                    rows.extend(grating_rows(grating, prior));
                }
            }
            Some(LightSurfaces::Planes(_)) | None => {}
        }
        rows
    }
}

impl PriorRow {
    fn single(index: usize, z: f64, slope: f64) -> Self {
        let mut row = [0.0; GRATING_PARAMETERS];
        row[0] = slope;
        Self { start: index, row, z }
    }
}

/// Gap, two tilts between normal and axis, groove relative to line, source along the line.
fn grating_rows(grating: &Grating, prior: &GratingPrior) -> Vec<PriorRow> {
    let (axis, fan, normal, groove) = (grating.axis, grating.fan, grating.normal, grating.groove);
    let period = grating.period_direction();
    let across = axis.cross(&fan);
    let start = CAMERA_PARAMETERS;
    let row = |value: f64, sigma: f64, slopes: &[(usize, f64)]| {
        let mut row = [0.0; GRATING_PARAMETERS];
        for (idx, slope) in slopes {
            row[*idx] = slope / sigma;
        }
        PriorRow { start, row, z: value / sigma }
    };
    let lever = grating.source_mm - prior.lit_centre_mm;
    let angle = GRATING_ANGLE_PRIOR_RAD;
    vec![
        row(grating.gap_mm - GAP_PRIOR_MM.0, GAP_PRIOR_MM.1, &[(8, 1.0)]),
        // Within the fan plane: n·f, moved by fan roll and both tilts of the normal.
        row(normal.dot(&fan), angle, &[(3, normal.dot(&across)), (5, groove.dot(&fan)), (6, period.dot(&fan))]),
        // Out of the fan plane: n·(a × f); the fan plane turns by −a under roll and by −f under pitch.
        row(
            normal.dot(&across),
            angle,
            &[(3, -normal.dot(&fan)), (4, normal.dot(&axis)), (5, groove.dot(&across)), (6, period.dot(&across))],
        ),
        row(
            groove.dot(&across),
            angle,
            &[(3, -groove.dot(&fan)), (4, groove.dot(&axis)), (5, -normal.dot(&across)), (7, period.dot(&across))],
        ),
        row(
            lever.dot(&fan),
            prior.source_along_line_mm,
            &[(0, fan.x), (1, fan.y), (2, fan.z), (3, lever.dot(&across))],
        ),
    ]
}
