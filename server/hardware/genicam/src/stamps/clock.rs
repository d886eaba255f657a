//! Conversion of the camera's clock to this computer's time.
//!
//! A frame arrives some time after the camera stamped it, never before. A line is fitted below all arrivals of the last
//! frames and close to the earliest of them: its slope is the ratio of the clocks, its offset the clock offset plus the
//! shortest latency, which cannot be measured from here. Late arrivals do not affect the line, so that a busy computer
//! does not shift the exposure times.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Number of frames used for the line. Two seconds at 128 Hz.
const MAX_FRAMES: usize = 256;

/// Number of groups of these frames; the earliest arrival of each group is used.
const N_GROUPS: usize = 8;

/// Number of frames from which the line is trusted.
const MIN_FRAMES: usize = 16;

/// Fastest drift between two quartz clocks that is accepted, as a ratio: five times what data sheets allow.
const MAX_DRIFT: f64 = 5e-4;

/// Arrivals of one acquisition in relation to the camera's clock.
#[derive(Debug, Default)]
pub struct DeviceClock {
    /// Origin of both clocks.
    origin: Option<(u64, Instant)>,
    /// Device time and arrival, seconds from the origin.
    arrivals: VecDeque<(f64, f64)>,
    /// Line of arrival minus device time, seconds; `None` before enough frames have arrived.
    line: Option<Line>,
}

#[derive(Debug, Clone, Copy)]
struct Line {
    at: f64,
    lag: f64,
    drift: f64,
    uncertainty: f64,
}

impl DeviceClock {
    /// Adds a frame stamped at `device_ns` that arrived at `received_at`.
    pub fn observe(&mut self, device_ns: u64, received_at: Instant) {
        let (origin_ns, origin_at) = *self.origin.get_or_insert((device_ns, received_at));
        let device_s = device_ns.wrapping_sub(origin_ns) as i64 as f64 * 1e-9;
        let received_s = match received_at.checked_duration_since(origin_at) {
            Some(since) => since.as_secs_f64(),
            None => -origin_at.duration_since(received_at).as_secs_f64(),
        };
        if self.arrivals.back().is_some_and(|&(last, _)| device_s <= last) {
            // The camera's clock was reset; earlier arrivals no longer apply.
            *self = Self::default();
            return self.observe(device_ns, received_at);
        }
        if self.arrivals.len() == MAX_FRAMES {
            self.arrivals.pop_front();
        }
        self.arrivals.push_back((device_s, received_s));
        self.line = (self.arrivals.len() >= MIN_FRAMES).then(|| self.fit());
    }

    /// Time of the stamp `device_ns` in this computer's time, and its uncertainty: the scatter of the earliest arrivals
    /// about their line. `None` before enough frames have arrived.
    pub fn host_time(&self, device_ns: u64) -> Option<(Instant, Duration)> {
        let ((origin_ns, origin_at), line) = (self.origin?, self.line?);
        let device_s = device_ns.wrapping_sub(origin_ns) as i64 as f64 * 1e-9;
        let host_s = device_s + line.lag + line.drift * (device_s - line.at);
        let at = match host_s >= 0.0 {
            true => origin_at.checked_add(Duration::from_secs_f64(host_s))?,
            false => origin_at.checked_sub(Duration::from_secs_f64(-host_s))?,
        };
        Some((at, Duration::from_secs_f64(line.uncertainty)))
    }

    /// Current uncertainty of the camera's clock.
    pub fn uncertainty(&self) -> Option<Duration> {
        self.line.map(|line| Duration::from_secs_f64(line.uncertainty))
    }

    /// Least-squares line through the earliest arrival of each part, shifted down to the earliest of all.
    fn fit(&self) -> Line {
        let part = self.arrivals.len().div_ceil(N_GROUPS);
        let earliest: Vec<(f64, f64)> = (0..self.arrivals.len())
            .step_by(part)
            .filter_map(|first| {
                let lags = self.arrivals.range(first..(first + part).min(self.arrivals.len()));
                lags.map(|&(device, received)| (device, received - device)).min_by(|a, b| a.1.total_cmp(&b.1))
            })
            .collect();
        let n = earliest.len() as f64;
        let at = earliest.iter().map(|point| point.0).sum::<f64>() / n;
        let mean = earliest.iter().map(|point| point.1).sum::<f64>() / n;
        let spread: f64 = earliest.iter().map(|point| (point.0 - at).powi(2)).sum();
        let slope = earliest.iter().map(|point| (point.0 - at) * (point.1 - mean)).sum::<f64>() / spread;
        let drift = if slope.is_finite() { slope.clamp(-MAX_DRIFT, MAX_DRIFT) } else { 0.0 };
        let above = |point: &(f64, f64)| point.1 - mean - drift * (point.0 - at);
        let lowest = earliest.iter().map(above).fold(f64::INFINITY, f64::min);
        let highest = earliest.iter().map(above).fold(f64::NEG_INFINITY, f64::max);
        Line { at, lag: mean + lowest, drift, uncertainty: highest - lowest }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Simulates a camera whose clock runs fast by `drift` and whose frames take at least 2 ms, usually up to 3 ms
    /// more, occasionally 50 ms more. Returns the largest error of the mapped times without the shortest latency, and
    /// the fraction of frames whose error exceeds the stated uncertainty.
    fn errors(drift: f64, seed: u64) -> (f64, f64) {
        let (began, shortest) = (Instant::now(), Duration::from_millis(2));
        let (mut clock, mut noise) = (DeviceClock::default(), seed);
        let (mut worst_us, mut n_beyond, n_frames) = (0.0_f64, 0.0, 2000_u64);
        for n in 0..n_frames {
            noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let jitter = (noise >> 33) as f64 / f64::from(1_u32 << 31);
            let latency = shortest.as_secs_f64() + 0.003 * jitter + if n % 37 == 0 { 0.05 } else { 0.0 };
            let exposed_s = n as f64 * 0.01;
            let device_ns = 77_000_000_000 + (exposed_s * (1.0 + drift) * 1e9) as u64;
            clock.observe(device_ns, began + Duration::from_secs_f64(exposed_s + latency));
            if n > MAX_FRAMES as u64 {
                let (at, uncertainty) = clock.host_time(device_ns).unwrap();
                let error_s = at.duration_since(began).as_secs_f64() - exposed_s - shortest.as_secs_f64();
                worst_us = worst_us.max(error_s.abs() * 1e6);
                n_beyond += f64::from(u8::from(error_s.abs() > uncertainty.as_secs_f64()));
            }
        }
        (worst_us, n_beyond / n_frames as f64)
    }

    #[test]
    fn time_errors_are_within_the_stated_uncertainty_for_any_drift() {
        for drift in [0.0, 1e-4, -1e-4] {
            for seed in [1, 2, 3] {
                let (worst_us, beyond) = errors(drift, seed);
                // The minimum of 32 samples of 3 ms jitter is 0.09 ms on average, and exceeds 0.4 ms in one part of a
                // hundred.
                assert!(worst_us < 500.0, "{drift}: {worst_us:.0} µs");
                assert!(beyond < 0.05, "{drift}: {beyond:.3} of all frames beyond the stated uncertainty");
            }
        }
    }

    #[test]
    fn the_line_is_fitted_anew_after_a_clock_reset() {
        let (began, mut clock) = (Instant::now(), DeviceClock::default());
        for n in 0..100_u64 {
            clock.observe(1_000_000_000 + n * 10_000_000, began + Duration::from_millis(10 * n));
        }
        assert!(clock.host_time(0).is_some());
        clock.observe(5, began + Duration::from_secs(2));
        assert!(clock.host_time(5).is_none(), "a line of the previous clock");
    }
}
