//! Sensor defects: hot pixels and a fixed pattern of its rows.

use vision::{GreyImage, LevelsMut};

use crate::model::random::derived_seed;

/// Random stream of the defects, derived from a station's seed.
const DEFECTS_STREAM: u64 = 7;

/// One pixel of so many is hot.
const PIXELS_PER_HOT: usize = 2000;

/// Every so many rows two neighbouring ones are bright, like a faint laser line.
const ROWS_PER_BRIGHT: usize = 50;

/// Pattern of a bright row, in multiples of that of the others.
const BRIGHT: f64 = 3.0;

/// Adds the sensor defects of the station with this seed to an image of the full sensor. `levels`: size of the row
/// pattern, grey levels of 255.
pub(super) fn add_sensor_defects(image: &mut GreyImage, seed: u64, levels: f64) {
    let (width, height) = (image.width(), image.height());
    let seed = derived_seed(seed, DEFECTS_STREAM);
    let row = |v: usize| {
        let fraction = derived_seed(seed, v as u64) as f64 / u64::MAX as f64;
        levels * if v % ROWS_PER_BRIGHT < 2 { BRIGHT } else { fraction }
    };
    let hot = (0..width * height / PIXELS_PER_HOT).map(|n| {
        let drawn = derived_seed(seed, (1 << 32) + n as u64);
        (drawn as usize % (width * height), 40.0 + (drawn >> 48) as f64 % 180.0)
    });
    let add_rows = |add: &mut dyn FnMut(usize, f64)| {
        (0..height).for_each(|v| (v * width..(v + 1) * width).for_each(|idx| add(idx, row(v))));
    };
    match image.levels_mut() {
        LevelsMut::Eight(pixels) => {
            let mut add = |idx: usize, more: f64| pixels[idx] = pixels[idx].saturating_add(more.round() as u8);
            add_rows(&mut add);
            hot.for_each(|(idx, more)| add(idx, more));
        }
        LevelsMut::Sixteen(pixels) => {
            let mut add =
                |idx: usize, more: f64| pixels[idx] = pixels[idx].saturating_add((257.0 * more).round() as u16);
            add_rows(&mut add);
            hot.for_each(|(idx, more)| add(idx, more));
        }
    }
}
