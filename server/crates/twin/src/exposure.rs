//! An exposure: what falls on the sensor and for how long, and the memory that frames are made in.

use crate::laser_image::Placed;
use crate::lit_pixels::LitPixels;
use crate::scene::Scene;
use crate::seen::MeshMemory;

/// What the sensor is exposed to.
#[derive(Debug, Clone, Copy)]
pub struct Exposure<'s> {
    /// What the camera sees.
    pub scene: &'s Scene,
    /// Where the stage has carried it.
    pub position_mm: f64,
    /// Grey level (of 255) of white at the picture's centre by ordinary light at its nominal exposure.
    pub ordinary_level: f64,
    /// Exposure relative to the nominal one of ordinary light.
    pub ordinary_share: f32,
    /// Laser power and exposure, both relative to nominal ones; 0 is dark.
    pub laser_share: f32,
    /// Amplification after the sensor has collected its electrons.
    pub gain: f32,
    /// Bits per pixel: 8 or 16.
    pub bits: u32,
    /// Numbers the frame, and so its speckle and noise.
    pub picture: u64,
}

/// Memory that frames are made in again and again, and the last picture by ordinary light.
#[derive(Debug, Default)]
pub struct Darkroom {
    pub(crate) levels: Vec<f32>,
    pub(crate) along: Vec<f32>,
    pub(crate) row: Vec<f32>,
    pub(crate) lit: Option<[LitPixels; 2]>,
    pub(crate) runs: Vec<Vec<(usize, usize)>>,
    pub(crate) ordinary: OrdinaryPicture,
    pub(crate) mesh: MeshMemory,
}

/// A picture by ordinary light, blurred by the lens, before the sensor: it changes only with what it shows.
#[derive(Debug, Default)]
pub(crate) struct OrdinaryPicture {
    shows: Option<(u64, u64, u64)>,
    pub(crate) levels: Vec<f32>,
}

impl OrdinaryPicture {
    /// Makes it show `scene`; returns whether it must be drawn.
    pub(crate) fn turn_to(&mut self, scene: &Scene, position_mm: f64, level: f64) -> bool {
        let wanted = Some((scene.fingerprint(), position_mm.to_bits(), level.to_bits()));
        std::mem::replace(&mut self.shows, wanted) != wanted
    }
}

impl Darkroom {
    /// Memory for pictures of this size, all dark. Only where the last picture had light is there anything to wipe.
    pub(crate) fn prepare(&mut self, width: usize, height: usize) {
        let n_pixels = width * height;
        let same_size = self.row.len() == width && self.runs.len() == height && self.levels.len() == n_pixels;
        for buffer in [&mut self.levels, &mut self.along] {
            if same_size {
                for (row, runs) in buffer.chunks_exact_mut(width).zip(&self.runs) {
                    runs.iter().for_each(|&(from, to)| row[from..to].fill(0.0));
                }
            } else {
                buffer.clear();
                buffer.resize(n_pixels, 0.0);
            }
        }
        self.row.resize(width, 0.0);
        self.runs.resize_with(height, Vec::new);
        self.runs.iter_mut().for_each(Vec::clear);
        let [lit, of_order] =
            self.lit.get_or_insert_with(|| [LitPixels::none(width, height), LitPixels::none(width, height)]);
        lit.clear();
        of_order.clear();
    }
}

impl<'s> Exposure<'s> {
    pub(crate) fn placed(&self, direction: &nalgebra::Vector3<f64>) -> Placed<'s> {
        Placed { scene: self.scene, moved_mm: direction * self.position_mm }
    }
}
