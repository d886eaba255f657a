//! Auto-exposure: finds an exposure at which the laser lines are bright but not saturated, from live view frames.

use std::time::{Duration, Instant};

use devices::CameraRequest;
use tokio::sync::watch;
use tokio::time::timeout;
use vision::{CentrelineParams, Centrelines, GreyImage, Pixels, find_centrelines};

use crate::App;
use crate::error::{AppError, ErrorKind};
use station::{Manual, SharedFrame, StationRefusal};

/// Target line brightness, fraction of full scale: leaves headroom for brighter areas of the part.
const BRIGHT: f64 = 0.6;

/// Below this fraction of full scale a line is needlessly noisy.
const DIM_BELOW: f64 = 0.3;

/// Quantile of the line brightness that is controlled: the brightest tenth, since dimmer points cannot saturate.
const BRIGHT_FRACTION: f64 = 0.1;

/// Saturated line points (or pixels, without lines) tolerated as a highlight; from here on lines count as saturated.
const SATURATED_POINTS: f64 = 0.02;
const SATURATED_PIXELS: f64 = 2e-4;

/// Largest factor towards longer exposures: noise is no measure of brightness.
const LONGEST_STEP: f64 = 4.0;

/// Maximum number of steps: halving from the longest to the shortest exposure takes about as many.
const STEPS: usize = 14;

/// Maximum wait for a frame with the new exposure, in addition to a few exposures.
const FRAME_WITHIN: Duration = Duration::from_secs(3);

/// The camera rounds the requested value.
const SAME_EXPOSURE: f64 = 0.02;

/// Assessment of the exposure of a frame from its lines.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Light {
    /// Lines are saturated.
    Over,
    /// Lines are too dark; their brightness as a fraction of full scale.
    Under(f64),
    Good,
}

/// Adjusts the exposure step by step while the live view runs with the laser on; `may_go_on` is checked before each step.
///
/// # Errors
/// A problem: no live view with the laser on, no frame with the new exposure, a refusal of the camera or of `may_go_on`.
pub async fn auto_exposure<E: From<AppError> + From<StationRefusal>>(
    app: &App,
    may_go_on: impl Fn() -> Result<(), E>,
) -> Result<(), E> {
    let params =
        CentrelineParams { line_direction: app.config.projector.direction_of(0), ..CentrelineParams::default() };
    let mut frames = app.station.watch_frames();
    let mut shortened = false;
    for _ in 0..STEPS {
        // The caller is a viewer: the laser stays on.
        app.station.note_viewer(Instant::now());
        let status = app.station.status();
        let exposure_us = status.camera_settings.exposure_us;
        let frame = frame_with(&mut frames, exposure_us).await?;
        let Some(factor) = factor(light_of(frame, params.clone()).await?, shortened) else { return Ok(()) };
        let Some(limits) = status.camera.capabilities.exposure_us else {
            return Err(AppError::new(ErrorKind::Impossible, "this camera's exposure cannot be set").into());
        };
        let next_us = (factor * exposure_us).round().clamp(limits.min, limits.max);
        if (next_us - exposure_us).abs() <= SAME_EXPOSURE * exposure_us {
            return Ok(());
        }
        shortened |= factor < 1.0;
        may_go_on()?;
        let wanted = CameraRequest { exposure_us: Some(next_us), ..CameraRequest::default() };
        app.station.manual(Manual::Configure(wanted)).await?;
    }
    Ok(())
}

/// Factor for the exposure; `None` if it is right. `shortened`: it was too long before.
fn factor(light: Light, shortened: bool) -> Option<f64> {
    match light {
        Light::Over => Some(0.5),
        // Too long before and too short now: there are highlights that no exposure suits; the lines count.
        Light::Under(bright) if !shortened => Some((BRIGHT / bright.max(0.01)).min(LONGEST_STEP)),
        Light::Under(_) | Light::Good => None,
    }
}

/// A laser-on frame with the given exposure.
async fn frame_with(
    frames: &mut watch::Receiver<Option<SharedFrame>>,
    exposure_us: f64,
) -> Result<SharedFrame, AppError> {
    let fits = |frame: &SharedFrame| {
        // A recording does not state its exposure; a frame between two pulses of light does not show it.
        let is_new = (frame.exposure_us - exposure_us).abs() <= SAME_EXPOSURE * exposure_us;
        frame.laser_on && (is_new || frame.exposure_us == 0.0)
    };
    frames.mark_unchanged();
    let found = async {
        loop {
            frames.changed().await.ok()?;
            if let Some(frame) = frames.borrow_and_update().clone().filter(fits) {
                return Some(frame);
            }
        }
    };
    let within = FRAME_WITHIN + Duration::from_secs_f64(4e-6 * exposure_us);
    timeout(within, found).await.ok().flatten().ok_or_else(|| {
        AppError::new(ErrorKind::Conflict, "no laser-on frame with the new exposure arrived")
            .remedy("start the live view with the laser, then try again")
    })
}

async fn light_of(frame: SharedFrame, params: CentrelineParams) -> Result<Light, AppError> {
    let judged =
        tokio::task::spawn_blocking(move || judge(&frame.image, &find_centrelines(&frame.image, &params)));
    judged.await.map_err(|cause| {
        AppError::new(ErrorKind::Internal, "the frame could not be evaluated").because(cause.to_string())
    })
}

fn judge(image: &GreyImage, lines: &Centrelines) -> Light {
    let mut levels: Vec<f32> = Vec::new();
    let mut n_saturated = 0;
    for point in lines.segments.iter().flat_map(|segment| &segment.points) {
        levels.push(point.intensity);
        n_saturated += usize::from(point.saturated);
    }
    if levels.is_empty() {
        return if saturated_fraction(image) > SATURATED_PIXELS { Light::Over } else { Light::Under(0.0) };
    }
    if n_saturated as f64 > SATURATED_POINTS * levels.len() as f64 {
        return Light::Over;
    }
    let nth = ((1.0 - BRIGHT_FRACTION) * levels.len() as f64) as usize;
    let level = *levels.select_nth_unstable_by(nth, f32::total_cmp).1;
    let bright = f64::from(level / image.full_scale());
    if bright < DIM_BELOW { Light::Under(bright) } else { Light::Good }
}

fn saturated_fraction(image: &GreyImage) -> f64 {
    let n_saturated = match image.pixels() {
        Pixels::Eight(pixels) => pixels.iter().filter(|level| **level == u8::MAX).count(),
        Pixels::Sixteen(pixels) => pixels.iter().filter(|level| f32::from(**level) >= image.full_scale()).count(),
    };
    n_saturated as f64 / (image.width() * image.height()).max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Five lines of the given height over a background of 8, three pixels wide, clipped at full scale.
    fn lit(height: f64) -> GreyImage {
        let (width, rows) = (200, 120);
        let level = |row: usize| {
            let nearest = (0..5).map(|line| row as f64 - (20 + 20 * line) as f64).map(f64::abs);
            let across = nearest.fold(f64::INFINITY, f64::min) / 1.3;
            (8.0 + height * (-0.5 * across * across).exp()).clamp(0.0, 255.0) as u8
        };
        let pixels = (0..rows).flat_map(|row| std::iter::repeat_n(level(row), width)).collect();
        GreyImage::new(width, rows, Pixels::Eight(pixels)).unwrap()
    }

    fn judged(height: f64) -> Light {
        let image = lit(height);
        judge(&image, &find_centrelines(&image, &CentrelineParams::default()))
    }

    #[test]
    fn lines_are_assessed_and_not_the_image_around_them() {
        assert_eq!(judged(0.0), Light::Under(0.0));
        // The level of a ridge is a mean over a few pixels: a fifth below the peak where lines are 3 px wide.
        assert!(matches!(judged(40.0), Light::Under(bright) if (0.8..=1.0).contains(&(bright * 255.0 / 40.0))));
        assert_eq!(judged(140.0), Light::Good);
        assert_eq!(judged(900.0), Light::Over);
        let white = GreyImage::new(64, 64, Pixels::Eight(vec![255; 64 * 64])).unwrap();
        assert_eq!(judge(&white, &Centrelines::default()), Light::Over);
    }

    #[test]
    fn a_long_exposure_is_halved_and_a_short_one_raised_by_a_factor_of_four_at_most() {
        assert_eq!(factor(Light::Over, false), Some(0.5));
        assert_eq!(factor(Light::Over, true), Some(0.5));
        assert_eq!(factor(Light::Under(0.2), false), Some(BRIGHT / 0.2));
        assert_eq!(factor(Light::Under(0.0), false), Some(LONGEST_STEP));
    }

    #[test]
    fn a_right_exposure_is_kept_and_a_shortened_one_is_not_lengthened_again() {
        assert_eq!(factor(Light::Good, false), None);
        assert_eq!(factor(Light::Under(0.2), true), None);
    }
}
