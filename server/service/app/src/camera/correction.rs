//! Which dark frame the images of a calibration were corrected with, as stored with a session and in a calibration's summary.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use station::StampedFrame;

/// Key in the summary of a calibration. Absent for a calibration from a capture, whose images do not tell.
pub const CORRECTION: &str = "correction";

/// The dark frame that an image was corrected with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ImageDarkFrame {
    /// What was corrected: `hot_pixels` or `full`.
    pub used: String,
    /// When the dark frame was taken, ms since 1970 (UTC): identifies it, since a station has one at a time.
    pub taken_at_ms: i64,
    /// Exposure time of the dark frame.
    pub exposure_us: f64,
    /// Its hot pixels, which are replaced.
    pub n_hot_pixels: usize,
}

impl ImageDarkFrame {
    /// Of a frame; `None` if it was not corrected.
    pub fn of(frame: &StampedFrame) -> Option<Self> {
        frame.dark_frame.as_ref().map(|applied| Self {
            used: applied.used.name().to_owned(),
            taken_at_ms: applied.dark.taken_at_ms,
            exposure_us: applied.dark.exposure_us,
            n_hot_pixels: applied.dark.frame.hot_pixels().len(),
        })
    }
}

/// Counts the images and those that were corrected, and lists the different dark frames, for the summary.
pub fn correction_json(images: &[Option<ImageDarkFrame>]) -> Value {
    json!({
        "n_images": images.len(),
        "n_corrected": images.iter().flatten().count(),
        "dark_frames": different(images),
    })
}

/// The different dark frames among those of the images.
pub fn different(images: &[Option<ImageDarkFrame>]) -> Vec<&ImageDarkFrame> {
    let mut dark_frames: Vec<&ImageDarkFrame> = Vec::new();
    for dark_frame in images.iter().flatten() {
        if !dark_frames.contains(&dark_frame) {
            dark_frames.push(dark_frame);
        }
    }
    dark_frames
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_counted_and_dark_frames_listed_once() {
        let dark = |taken_at_ms| {
            Some(ImageDarkFrame { used: "full".to_owned(), taken_at_ms, exposure_us: 20e3, n_hot_pixels: 12 })
        };
        let found = correction_json(&[dark(7), None, dark(7), dark(9)]);
        assert_eq!((&found["n_images"], &found["n_corrected"]), (&json!(4), &json!(3)));
        let listed: Vec<_> =
            found["dark_frames"].as_array().unwrap().iter().map(|dark| &dark["taken_at_ms"]).collect();
        assert_eq!(listed, [&json!(7), &json!(9)]);
        assert_eq!(correction_json(&[None])["dark_frames"], json!([]));
    }
}
