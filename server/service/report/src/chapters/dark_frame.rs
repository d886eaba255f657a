//! The chapter on the dark frame: which images were corrected for what the sensor shows without light.

use maud::{Markup, html};

use crate::drawing::page::table;

/// How the images of a calibration were corrected.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageCorrection {
    /// Number of images.
    pub n_images: usize,
    /// The dark frames; none if no image was corrected.
    pub dark_frames: Vec<UsedDarkFrame>,
}

/// A dark frame and the images corrected with it.
#[derive(Debug, Clone, PartialEq)]
pub struct UsedDarkFrame {
    /// When it was taken, as text.
    pub taken_at: String,
    /// Its exposure time.
    pub exposure_us: f64,
    /// Its hot pixels, which are replaced.
    pub n_hot_pixels: usize,
    /// Whether its fixed pattern is subtracted, too.
    pub subtracts_pattern: bool,
    /// Number of images corrected with it.
    pub n_images: usize,
}

/// A sentence, and a table of the dark frames.
pub fn content(correction: &ImageCorrection) -> Markup {
    let row = |dark: &UsedDarkFrame| {
        vec![
            dark.taken_at.clone(),
            format!("{:.1}", dark.exposure_us * 1e-3),
            dark.n_hot_pixels.to_string(),
            if dark.subtracts_pattern { "subtracted" } else { "not subtracted: other gain" }.to_owned(),
            dark.n_images.to_string(),
        ]
    };
    let rows: Vec<Vec<String>> = correction.dark_frames.iter().map(row).collect();
    let head = ["taken", "exposure time, ms", "hot pixels replaced", "fixed pattern", "images corrected"];
    html! {
        p.verdict.note { (sentence(correction)) }
        @if !rows.is_empty() { (table(&head, &rows, |_| false)) }
    }
}

fn sentence(correction: &ImageCorrection) -> String {
    let n_images = correction.n_images;
    match correction.dark_frames.iter().map(|dark| dark.n_images).sum::<usize>() {
        0 => format!(
            "No dark frame was used: the sensor's hot pixels and fixed pattern are in all {n_images} images."
        ),
        n if n == n_images => format!("All {n_images} images were corrected."),
        n => format!(
            "{n} of {n_images} images were corrected; the sensor's hot pixels and fixed pattern are in the others."
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sentence_states_how_many_images_were_corrected() {
        let dark = |n_images| UsedDarkFrame {
            taken_at: "2026-11-27T01:00:00Z".to_owned(),
            exposure_us: 20e3,
            n_hot_pixels: 132,
            subtracts_pattern: n_images > 1,
            n_images,
        };
        for (dark_frames, words) in [
            (vec![], &["No dark frame was used", "in all 29 images"][..]),
            (vec![dark(29)], &["All 29 images were corrected", "20.0", "132", "subtracted"]),
            (vec![dark(20), dark(1)], &["21 of 29 images were corrected", "not subtracted: other gain"]),
        ] {
            let html = content(&ImageCorrection { n_images: 29, dark_frames }).into_string();
            assert!(words.iter().all(|word| html.contains(word)), "{words:?} in {html}");
        }
    }
}
