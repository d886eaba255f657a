//! Checks of the laser and its lines in the image.

use std::time::Instant;

use devices::CameraRequest;
use station::{LaserLight, SharedFrame, StationLease, StationRefusal};
use statistics::median;
use vision::{CentrelineParams, CentrelinePoint, LineDirection, find_centrelines};

use super::check::{Check, Outcome};
use super::examination::Examination;
use super::figures::{self, Pair};
use super::limits::{
    EXPOSURE_FACTORS, FEWEST_PIXELS, FEWEST_POINTS, LIGHT_LEFT_PERCENT, LINE_WIDTH_PX, LINEARITY_PERCENT,
    OFF_ON_COMMAND, OFF_WITHOUT_FRAMES, RESPONSE_PERCENT, SATURATED_PERCENT,
};

/// Frames discarded after a change of settings: cameras apply it up to two frames later.
const SETTLING_FRAMES: usize = 2;

/// Laser-on and laser-off image of one exposure.
struct Shot {
    exposure_us: f64,
    lit: SharedFrame,
    dark: SharedFrame,
}

impl Shot {
    fn pair(&self) -> Pair<'_> {
        Pair { exposure_us: self.exposure_us, lit: &self.lit.image, dark: &self.dark.image }
    }
}

impl Examination<'_> {
    /// Checks the lines at the set exposure, the linearity of the exposure, and that the laser turns off.
    pub fn light(&self) -> Result<Vec<Check>, StationRefusal> {
        let lease = self.lease()?;
        lease.configure(&self.camera_request())?;
        let exposure_range = self.station.status().camera.capabilities.exposure_us;
        let full = self.shot(&lease, None)?;
        let mut checks = self.lines(&full);
        let pixels = figures::responding(&full.pair(), RESPONSE_PERCENT);
        checks.push(match exposure_range {
            None => Check::stated("exposure linearity", Outcome::NotRun, "the camera's exposure cannot be set"),
            Some(_) if pixels.len() < FEWEST_PIXELS => Check::stated(
                "exposure linearity",
                Outcome::NotRun,
                "too few unsaturated pixels with enough laser light",
            )
            .remedy("place a bright matt object in the light, and choose another exposure"),
            Some(range) => {
                let mut shorter = Vec::new();
                for factor in EXPOSURE_FACTORS {
                    let exposure_us = range.clamp(full.exposure_us * factor);
                    shorter.push(self.shot(&lease, Some(exposure_us))?);
                }
                lease.configure(&CameraRequest {
                    exposure_us: Some(full.exposure_us),
                    ..CameraRequest::default()
                })?;
                linearity(&full, &shorter, &pixels)
            }
        });
        if self.station.status().laser.capabilities.switched {
            checks.extend(self.laser_off_checks(&lease, &full, &pixels)?);
        } else {
            checks.push(
                Check::stated("laser off on command", Outcome::NotRun, "not controlled by the station")
                    .remedy("the station cannot turn this laser off: ensure safety by other means"),
            );
        }
        Ok(checks)
    }

    /// Captures one image with and one without laser, at `exposure_us` if given.
    fn shot(&self, lease: &StationLease, exposure_us: Option<f64>) -> Result<Shot, StationRefusal> {
        let exposure_us = lease.configure(&CameraRequest { exposure_us, ..CameraRequest::default() })?.exposure_us;
        lease.laser_on(self.settings.power)?;
        let lit = self.settled(lease)?;
        lease.laser_off()?;
        Ok(Shot { exposure_us, lit, dark: self.settled(lease)? })
    }

    /// A frame for which all settings have taken effect.
    fn settled(&self, lease: &StationLease) -> Result<SharedFrame, StationRefusal> {
        for _ in 0..SETTLING_FRAMES {
            lease.grab(self.cancel)?;
        }
        lease.grab(self.cancel)
    }

    fn lines(&self, shot: &Shot) -> Vec<Check> {
        let along_rows = self.settings.lines_along_rows;
        let line_direction = if along_rows { LineDirection::Rows } else { LineDirection::Columns };
        let params = CentrelineParams { line_direction, ..CentrelineParams::default() };
        let found = find_centrelines(&shot.lit.image, &params);
        let points: Vec<CentrelinePoint> = found.segments.into_iter().flat_map(|segment| segment.points).collect();
        let enough = points.len() >= FEWEST_POINTS;
        let lines = Check::measured(
            "laser lines",
            enough,
            (points.len() as f64, "points"),
            format!("{} points at {:.0} µs", points.len(), shot.exposure_us),
        )
        .limit(format!("≥ {FEWEST_POINTS}"))
        .remedy(
            "check the laser power and that the laser hits an object in the field of view; increase the exposure",
        );
        if !enough {
            return vec![lines];
        }
        vec![lines, width(&points), saturation(&points, shot.exposure_us)]
    }

    /// Checks that the laser turns off on command, and when no frames are requested.
    fn laser_off_checks(
        &self,
        lease: &StationLease,
        full: &Shot,
        pixels: &[(usize, usize)],
    ) -> Result<Vec<Check>, StationRefusal> {
        lease.laser_on(self.settings.power)?;
        lease.grab(self.cancel)?;
        let asked_at = Instant::now();
        lease.laser_off()?;
        let took = asked_at.elapsed();
        let after = self.settled(lease)?;
        let left = figures::light_left_percent(&full.pair(), &after.image, pixels)
            .filter(|_| pixels.len() >= FEWEST_PIXELS && figures::same_format(&after.image, &full.lit.image));
        let in_image = left.map_or_else(
            || "; no line in the image to check it with".to_owned(),
            |left| format!("; {left:.0} % of the light remains in the image"),
        );
        let took_ms = took.as_secs_f64() * 1e3;
        let on_command = Check::measured(
            "laser off on command",
            took <= OFF_ON_COMMAND && left.is_none_or(|left| left <= LIGHT_LEFT_PERCENT),
            (took_ms, "ms"),
            format!("reported after {took_ms:.0} ms{in_image}"),
        )
        .limit(format!("≤ {} ms, ≤ {LIGHT_LEFT_PERCENT:.0} % left", OFF_ON_COMMAND.as_millis()))
        .remedy("switch off the power supply of the laser, and check the wiring to its controller");
        lease.laser_on(self.settings.power)?;
        let off_after =
            self.wait_until(2 * OFF_WITHOUT_FRAMES, || self.station.status().laser_light != LaserLight::On);
        lease.laser_off()?;
        if self.cancel.is_cancelled() {
            return Err(StationRefusal::Cancelled);
        }
        let limit_ms = OFF_WITHOUT_FRAMES.as_millis();
        let without_frames = match off_after {
            Some(took) => Check::measured(
                "laser off without frames",
                took <= OFF_WITHOUT_FRAMES,
                (took.as_secs_f64() * 1e3, "ms"),
                format!("after {} ms", took.as_millis()),
            ),
            None => Check::stated("laser off without frames", Outcome::NotOk, "still on"),
        }
        .limit(format!("≤ {limit_ms} ms"))
        .remedy("do not leave the station unattended with the laser on, and report this as a bug");
        Ok(vec![on_command, without_frames])
    }
}

fn linearity(full: &Shot, shorter: &[Shot], pixels: &[(usize, usize)]) -> Check {
    const NAME: &str = "exposure linearity";
    let deviations: Option<Vec<f64>> = shorter
        .iter()
        .map(|shot| {
            let same_format = figures::same_format(&shot.lit.image, &full.lit.image);
            same_format.then(|| figures::nonlinearity_percent(&full.pair(), &shot.pair(), pixels)).flatten()
        })
        .collect();
    let worst = deviations.into_iter().flatten().max_by(|a, b| a.abs().total_cmp(&b.abs()));
    let Some(worst) = worst else { return Check::stated(NAME, Outcome::NotRun, "no light to compare") };
    let shortest_us = shorter.iter().map(|shot| shot.exposure_us).fold(full.exposure_us, f64::min);
    let figure = format!("{worst:+.1} % from {shortest_us:.0} to {:.0} µs", full.exposure_us);
    Check::measured(NAME, worst.abs() <= LINEARITY_PERCENT, (worst, "%"), figure)
        .limit(format!("±{LINEARITY_PERCENT} %"))
        .remedy("turn off gamma, automatic gain and other image processing in the camera")
}

fn width(points: &[CentrelinePoint]) -> Check {
    let mut widths: Vec<f64> = points.iter().map(|point| f64::from(point.width_px)).collect();
    let median = median(&mut widths).unwrap_or(0.0);
    let (least, most) = LINE_WIDTH_PX;
    Check::measured("line width", (least..=most).contains(&median), (median, "px"), format!("{median:.1} px"))
        .limit(format!("{least}–{most} px"))
        .remedy(if median < least { "defocus slightly, or open the aperture" } else { "focus lens and laser" })
}

fn saturation(points: &[CentrelinePoint], exposure_us: f64) -> Check {
    let n_saturated = points.iter().filter(|point| point.saturated).count();
    let percent = 100.0 * n_saturated as f64 / points.len() as f64;
    let figure = format!("{percent:.1} % of the points at {exposure_us:.0} µs");
    Check::measured("line saturation", percent <= SATURATED_PERCENT, (percent, "%"), figure)
        .limit(format!("≤ {SATURATED_PERCENT} %"))
        .remedy("shorten the exposure, or lower the laser's power or the gain")
}
