//! Camera checks with the laser off: rate, losses, time stamps, noise.

use std::time::Instant;

use station::{LiveRequest, Manual, SharedFrame, StationRefusal};

use super::check::{Check, Outcome};
use super::examination::Examination;
use super::figures;
use super::limits::{
    AMBIENT_PERCENT, DARK_FRAMES, DARK_NOISE_PERCENT, FEWEST_FRAMES, FRAME_WAIT, FREE_RUN_FRAMES, FREE_RUN_TIME,
    JITTER_US, MAX_HOT_FRACTION, MIN_RATE_RATIO, PATTERN_PERCENT,
};

/// Result of a free run.
struct FreeRun {
    times_s: Vec<f64>,
    dark: Vec<SharedFrame>,
    dropped: Vec<(&'static str, u64)>,
    set_rate_hz: f64,
}

impl Examination<'_> {
    /// Runs the camera with the laser off.
    pub fn free_run(&self) -> Result<Vec<Check>, StationRefusal> {
        self.runtime.block_on(self.station.manual(Manual::Configure(self.camera_request())))?;
        let before = self.station.status().frames_dropped.clone();
        self.runtime.block_on(self.station.live(LiveRequest { running: true, laser_power: 0.0 }))?;
        let (times_s, dark) = self.watch_frames()?;
        // Fails if a fault has ended the live view already.
        let _ = self.runtime.block_on(self.station.live(LiveRequest { running: false, laser_power: 0.0 }));
        let status = self.station.status();
        let earlier =
            |reason: &str| before.iter().find(|(name, _)| *name == reason).map_or(0, |(_, count)| *count);
        let dropped = status.frames_dropped.iter().map(|(reason, count)| (*reason, count - earlier(reason)));
        let run = FreeRun {
            times_s,
            dark,
            dropped: dropped.filter(|(_, count)| *count > 0).collect(),
            set_rate_hz: status.camera_settings.frame_rate_hz,
        };
        if run.times_s.len() < FEWEST_FRAMES
            && let Some(fault) = status.faults.first()
        {
            return Err(StationRefusal::InError { detail: fault.detail.clone(), remedy: fault.remedy.clone() });
        }
        Ok([rate_and_jitter(&run), vec![drops(&run)], darkness(&run)].concat())
    }

    /// Times of the arriving frames, s, and the first of them as dark frames.
    fn watch_frames(&self) -> Result<(Vec<f64>, Vec<SharedFrame>), StationRefusal> {
        let mut newest = self.station.watch_frames();
        newest.mark_unchanged();
        let (began, mut times_s, mut dark) = (Instant::now(), Vec::new(), Vec::new());
        while times_s.len() < FREE_RUN_FRAMES && began.elapsed() < FREE_RUN_TIME {
            if self.cancel.is_cancelled() {
                return Err(StationRefusal::Cancelled);
            }
            self.station.note_viewer(Instant::now());
            let came = self.runtime.block_on(async { tokio::time::timeout(FRAME_WAIT, newest.changed()).await });
            if came.is_err() {
                if !self.station.status().faults.is_empty() {
                    break;
                }
                continue;
            }
            let Some(frame) = newest.borrow_and_update().clone() else { continue };
            times_s.push(frame.captured_at_ns as f64 * 1e-9);
            if dark.len() < DARK_FRAMES {
                dark.push(frame);
            }
        }
        Ok((times_s, dark))
    }
}

fn rate_and_jitter(run: &FreeRun) -> Vec<Check> {
    let found = figures::rate(&run.times_s).filter(|_| run.times_s.len() >= FEWEST_FRAMES);
    let Some(found) = found else {
        let figure = format!("{} frames in {} s", run.times_s.len(), FREE_RUN_TIME.as_secs());
        let came = run.times_s.len() as f64;
        return vec![
            Check::measured("frame rate", false, (came / FREE_RUN_TIME.as_secs_f64(), "Hz"), figure)
                .remedy("check cable, trigger and exposure of the camera"),
        ];
    };
    // A camera without a settable rate reports 0, so that there is no limit.
    let least_hz = MIN_RATE_RATIO * run.set_rate_hz;
    let rate = Check::measured(
        "frame rate",
        found.rate_hz >= least_hz,
        (found.rate_hz, "Hz"),
        format!("{:.2} Hz of {:.2} Hz set", found.rate_hz, run.set_rate_hz),
    )
    .limit(format!("≥ {least_hz:.2} Hz"))
    .remedy("shorten the exposure, set a smaller region or a lower rate, or use a faster link");
    let jitter = Check::measured(
        "timestamp jitter",
        found.jitter_us <= JITTER_US,
        (found.jitter_us, "µs"),
        format!("σ {:.0} µs", found.jitter_us),
    )
    .limit(format!("≤ {JITTER_US:.0} µs"))
    .remedy("use a camera with time stamps or a hardware trigger, or a lower speed");
    vec![rate, jitter]
}

fn drops(run: &FreeRun) -> Check {
    let lost: u64 = run.dropped.iter().map(|(_, count)| count).sum();
    let reasons: Vec<String> = run.dropped.iter().map(|(reason, count)| format!("{reason} {count}")).collect();
    let by_reason = if reasons.is_empty() { String::new() } else { format!(" ({})", reasons.join(", ")) };
    let figure = format!("{lost} of {}{by_reason}", run.times_s.len() as u64 + lost);
    Check::measured("frames lost", lost == 0, (lost as f64, "frames"), figure).limit("0").remedy(
        "check the link: jumbo frames, a dedicated port, a lower rate; a scan that loses frames is invalid",
    )
}

/// Hot pixels and fixed-pattern noise, from a dark frame.
fn defects(dark: Option<&figures::Dark>) -> Check {
    const NAME: &str = "sensor defects";
    let Some(dark) = dark else {
        return Check::stated(NAME, Outcome::NotRun, "the image is not dark with the laser off")
            .remedy("cover the lens to check for defects");
    };
    let figure =
        format!("{} hot pixels, fixed pattern σ {:.2} % of full scale", dark.n_hot_pixels, dark.pattern_percent);
    let few = dark.hot_fraction <= MAX_HOT_FRACTION && dark.pattern_percent <= PATTERN_PERCENT;
    Check::measured(NAME, few, (dark.n_hot_pixels as f64, "pixels"), figure)
        .limit(format!("≤ {} % hot, pattern ≤ {PATTERN_PERCENT} %", 100.0 * MAX_HOT_FRACTION))
        .remedy("capture a dark frame with the lens covered; it is then subtracted from every frame")
}

fn darkness(run: &FreeRun) -> Vec<Check> {
    let images: Vec<&vision::GreyImage> = run.dark.iter().map(|frame| &frame.image).collect();
    let Some((level, noise)) = figures::dark(&images) else { return Vec::new() };
    let dark = figures::dark_frame(&images);
    // The noise is that of pixels that are not hot.
    let noise = dark.as_ref().map_or(noise, |dark| dark.noise_percent);
    vec![
        Check::measured(
            "dark noise",
            noise <= DARK_NOISE_PERCENT,
            (noise, "% of full scale"),
            format!("σ {noise:.2} % of full scale"),
        )
        .limit(format!("≤ {DARK_NOISE_PERCENT} %"))
        .remedy("lower the gain, or cool the camera"),
        Check::measured(
            "ambient light",
            level <= AMBIENT_PERCENT,
            (level, "% of full scale"),
            format!("{level:.1} % of full scale with the laser off"),
        )
        .limit(format!("≤ {AMBIENT_PERCENT} %"))
        .remedy("shield the station from ambient light, or shorten the exposure"),
        defects(dark.as_ref()),
    ]
}
