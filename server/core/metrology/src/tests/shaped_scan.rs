//! A simulated station that scans heights over a datum frame: noise, a sampled calibration, rims that fade over a blur.

use nalgebra::{Matrix3, Rotation3, Vector2, Vector3};
use optics::stage::{Straightness, Tilt};
use optics::{Calibration, LightSurfaces, PartFrame, Rigid, Stage, StagePosition};
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use scanning::{Cloud, CloudPoint, StagePositions};

use super::station::station;
use crate::evaluation::alignment::DatumFrame;

/// Image noise across the line, px.
const NOISE_PX: f64 = 0.05;

/// Thickness of the sheets (one σ, mm): frames 0.4 mm apart share no speckle.
const SHEET_SIGMA_MM: f64 = 0.1;

/// Blur of a line's end (one σ, mm), and the fraction of its intensity below which the extraction ends a line.
pub(super) const BLUR_MM: f64 = 0.15;
const CUT_FRACTION: f64 = 0.3;

/// Quantile of the standard normal distribution at [`CUT_FRACTION`].
const CUT_QUANTILE: f64 = 0.524_4;

/// Largest height of a part above its datum plane, mm.
const CEILING_MM: f64 = 14.0;

/// A scanned surface in its datum frame: z up, towards the camera.
pub(super) trait Surface: Sync {
    /// The height at a point, and the distance of the point inside the rim of its face (infinite without a rim); faces
    /// extend `grown_mm` beyond their rims.
    fn top(&self, x: f64, y: f64, grown_mm: f64) -> (f64, f64);
}

/// How the scan is made.
#[derive(Clone, Copy)]
pub(super) struct ShapedScan {
    pub(super) n_frames: usize,
    pub(super) step_mm: f64,
    pub(super) pitch_mm: f64,
    pub(super) half_width_mm: f64,
    /// Whether the calibration is sampled from its covariance or exact.
    pub(super) is_sampled: bool,
    /// Image noise across the line, px.
    pub(super) noise_px: f64,
}

impl ShapedScan {
    pub(super) const FINE: Self = Self {
        n_frames: 80,
        step_mm: 0.4,
        pitch_mm: 0.15,
        half_width_mm: 28.0,
        is_sampled: true,
        noise_px: NOISE_PX,
    };
}

/// The datum frame lies under the camera, its y along the lines, its x along the travel, turned by up to two degrees.
pub(super) fn part_from_datum(seed: u64) -> Rigid<PartFrame, DatumFrame> {
    let mut rng = Pcg64Mcg::seed_from_u64(seed.wrapping_mul(7919));
    let mut draw = |size: f64| size * rng.random_range(-1.0..1.0);
    let turn = Rotation3::new(Vector3::new(draw(0.03), draw(0.03), draw(0.03)));
    let laid = Rotation3::from_matrix_unchecked(Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0));
    Rigid::new(turn * laid, Vector3::new(draw(1.0), draw(1.0), 400.0 + draw(2.0)))
}

/// The true station, whose stage is known to be straight within 2 µm and level within 50 µrad.
pub(super) fn straight_station() -> Calibration {
    let mut station = station();
    if let Some(Stage::Linear(axis)) = &mut station.stage {
        let ends_mm = (-25.0, 25.0);
        axis.straightness = Straightness::new(0.002, ends_mm.0, ends_mm.1, 4);
        let sigmas_rad = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| axis * 5e-5);
        axis.tilt = Tilt::new(sigmas_rad, Vector3::new(0.0, 0.0, 400.0), ends_mm, 4);
    }
    station
}

/// A scan triangulated with a calibration sampled from its covariance.
pub(super) fn shaped_scan(
    surface: &impl Surface,
    part_from_datum: &Rigid<PartFrame, DatumFrame>,
    seed: u64,
    scan: &ShapedScan,
) -> (Cloud, Calibration) {
    let truth = straight_station();
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let modes = truth.sigma_modes();
    let mut sampled = vec![0.0; modes.first().map_or(0, Vec::len)];
    for mode in &modes {
        let size = if scan.is_sampled { rng.sample::<f64, _>(StandardNormal) } else { 0.0 };
        sampled.iter_mut().zip(mode).for_each(|(sum, step)| *sum += size * step);
    }
    let believed = truth.stepped(&sampled);
    let datum_from_part = part_from_datum.inverse();
    let middle = (scan.n_frames - 1) as f64 / 2.0;
    let positions_mm: Vec<f64> = (0..scan.n_frames).map(|frame| (frame as f64 - middle) * scan.step_mm).collect();
    let half_columns = (scan.half_width_mm / scan.pitch_mm) as i32;
    let mut points = Vec::new();
    for (frame, &position_mm) in (0..).zip(&positions_mm) {
        for order in [-1, 0, 1] {
            for column in -half_columns..=half_columns {
                let x_mm = f64::from(column) * scan.pitch_mm;
                let noise = Vector2::new(0.0, scan.noise_px * rng.sample::<f64, _>(StandardNormal));
                let lit = lit(surface, &truth, &datum_from_part, order, x_mm, position_mm);
                points.extend(lit.and_then(|(pixel, share)| {
                    cloud_point(&believed, order, &(pixel + noise), (frame, position_mm), share)
                }));
            }
        }
    }
    let mut comments = vec!["noise_correlation_px 1".to_owned(), format!("line_sigma_mm {SHEET_SIGMA_MM}")];
    let axis = believed.stage.and_then(|stage| stage.linear()).unwrap();
    comments.extend(StagePositions::linear(axis, positions_mm).comments());
    (Cloud { points, comments }, believed)
}

/// The pixel of the line of `order` at `x_mm`, and the fraction of the full intensity.
fn lit(
    surface: &impl Surface,
    truth: &Calibration,
    datum_from_part: &Rigid<DatumFrame, PartFrame>,
    order: i8,
    x_mm: f64,
    position_mm: f64,
) -> Option<(Vector2<f64>, f64)> {
    let LightSurfaces::Planes(planes) = &truth.light else { return None };
    let sheet = planes.iter().find(|(candidate, _)| *candidate == order)?.1;
    let carried = truth.stage?.linear()?.direction * position_mm;
    let on_sheet = |z: f64| {
        let y = -(sheet.offset_mm + sheet.normal.x * x_mm + sheet.normal.z * z) / sheet.normal.y;
        Vector3::new(x_mm, y, z)
    };
    let over = |z: f64| {
        let datum = datum_from_part.rotation * (on_sheet(z) - carried) + datum_from_part.translation_mm;
        let (height, inside) = surface.top(datum.x, datum.y, CUT_QUANTILE * BLUR_MM);
        (datum.z - height, inside)
    };
    let mut above = 400.0 - CEILING_MM - 5.0;
    while above < 406.0 && over(above + 0.5).0 > 0.0 {
        above += 0.5;
    }
    let mut below = above + 0.5;
    for _ in 0..40 {
        let middle = (above + below) / 2.0;
        if over(middle).0 > 0.0 { above = middle } else { below = middle }
    }
    let (rest, inside) = over(below);
    // A wall: the light passes a face.
    let is_wall = rest.abs() > 1e-6;
    let share = phi(inside / BLUR_MM);
    (!is_wall && below < 406.0 && share >= CUT_FRACTION)
        .then(|| Some((truth.camera.project(&on_sheet(below))?, share)))
        .flatten()
}

/// The standard normal distribution function, by integration: good to 1e-6.
fn phi(x: f64) -> f64 {
    if x > 6.0 {
        return 1.0;
    }
    let n = 60;
    let step = (x + 6.0).max(0.0) / f64::from(n);
    let density = |t: f64| (-t * t / 2.0).exp() / std::f64::consts::TAU.sqrt();
    (0..n).map(|k| density(-6.0 + (f64::from(k) + 0.5) * step) * step).sum()
}

fn cloud_point(
    believed: &Calibration,
    order: i8,
    pixel: &Vector2<f64>,
    (frame, position_mm): (u32, f64),
    share: f64,
) -> Option<CloudPoint> {
    let (u_px, v_px) = (pixel.x as f32, pixel.y as f32);
    let hit = believed.triangulate(order, &Vector2::new(u_px.into(), v_px.into()), None)?;
    let part = believed.stage?.part_from_camera(&hit.hit_in_camera, StagePosition::LinearMm(position_mm))?.xyz;
    let sigma_mm =
        hit.noise_sigma_mm(&[0.0, 1.0], NOISE_PX).hypot(believed.systematic_sigma_mm(order, &hit)?) as f32;
    let [x_mm, y_mm, z_mm] = part.into();
    Some(CloudPoint { x_mm, y_mm, z_mm, order, frame, u_px, v_px, intensity: 100.0 * share as f32, sigma_mm })
}
