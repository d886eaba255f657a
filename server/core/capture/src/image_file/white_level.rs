//! The white level of the images of one camera, from the bits that all of them use.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU16, Ordering};

use rayon::prelude::*;
use vision::WhiteLevel;
use vision::white_level::bits_used;

use super::{read_header, read_photograph};

/// The white level of images of 16 bits by one camera: that of a sensor with the bits they use. Images that cannot be
/// read are ignored.
///
/// Every image counts: one that is exposed shorter uses fewer bits. Only images of sensors with fewer than 16 bits are
/// all read.
pub fn white_level_of(images: &[PathBuf]) -> WhiteLevel {
    let used = AtomicU16::new(0);
    images.par_iter().for_each(|path| {
        let so_far = used.load(Ordering::Relaxed);
        if so_far != 0 && WhiteLevel::of_bits(so_far).is_full() {
            return;
        }
        let is_deep = read_header(path).is_ok_and(|header| header.bits == 16);
        if let Some(photograph) = is_deep.then(|| read_photograph(path).ok()).flatten() {
            used.fetch_or(bits_used(&photograph.image), Ordering::Relaxed);
        }
    });
    WhiteLevel::of_bits(used.into_inner())
}
