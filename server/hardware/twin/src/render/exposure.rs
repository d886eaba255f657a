//! An exposure: the light on the sensor and its duration, and the buffers for rendering.

use crate::model::station::StationModel;
use crate::part::scene::Scene;
use crate::render::view::lit_pixels::LitPixels;
use crate::render::view::pixel_hits::MeshMemory;

/// The input of an exposure.
#[derive(Debug, Clone, Copy)]
pub struct Exposure<'s> {
    /// The scene.
    pub scene: &'s Scene,
    /// Stage position: mm of travel, degrees of a turntable.
    pub position: f64,
    /// Grey level (of 255) of white at the image centre under ambient light at its nominal exposure.
    pub ambient_level: f64,
    /// Exposure relative to the nominal one of ambient light.
    pub ambient_exposure: f32,
    /// Product of laser power and exposure, relative to nominal ones; 0 is off.
    pub laser_exposure: f32,
    /// Amplification after the sensor has collected its electrons.
    pub gain: f32,
    /// Bits per pixel: 8 or 16.
    pub bits: u32,
    /// Number of the image; determines its sensor noise.
    pub image_number: u64,
}

/// Reusable buffers of the renderer, and the last images under laser and ambient light.
#[derive(Debug, Default)]
pub struct ExposureBuffers {
    pub(crate) row: Vec<f32>,
    pub(crate) laser: LaserLightImage,
    pub(crate) ordinary: AmbientLightImage,
    pub(crate) mesh: MeshMemory,
}

/// An image under laser light, blurred by the lens, before speckle and sensor: depends only on its content.
#[derive(Debug, Default)]
pub(crate) struct LaserLightImage {
    shows: Option<(StationModel, u64, u64)>,
    /// Light on every pixel, of 255; 0 outside the runs.
    pub(crate) levels: Vec<f32>,
    /// The same, blurred only along the rows.
    pub(crate) along: Vec<f32>,
    /// Runs of pixels (from, to) that light may reach, row by row.
    pub(crate) runs: Vec<Vec<(usize, usize)>>,
    pub(crate) lit: Option<[LitPixels; 2]>,
}

/// An image under ambient light, blurred by the lens, before the sensor: depends only on its content.
#[derive(Debug, Default)]
pub(crate) struct AmbientLightImage {
    shows: Option<(u64, u64, u64)>,
    pub(crate) levels: Vec<f32>,
}

impl AmbientLightImage {
    /// Selects `scene`; returns whether the image must be drawn.
    pub(crate) fn select(&mut self, scene: &Scene, position: f64, level: f64) -> bool {
        let wanted = Some((scene.fingerprint(), position.to_bits(), level.to_bits()));
        std::mem::replace(&mut self.shows, wanted) != wanted
    }
}

impl LaserLightImage {
    /// Selects `scene` under the station's light; returns whether the image must be drawn, and clears it if so.
    pub(crate) fn select(&mut self, model: &StationModel, scene: &Scene, position: f64) -> bool {
        let (scene, position) = (scene.fingerprint(), position.to_bits());
        let shown =
            self.shows.as_ref().is_some_and(|shows| (&shows.0, shows.1, shows.2) == (model, scene, position));
        if !shown {
            self.clear(model.camera.width_px, model.camera.height_px);
            self.shows = Some((model.clone(), scene, position));
        }
        !shown
    }

    /// Clears the image. Only runs with light must be cleared.
    fn clear(&mut self, width: usize, height: usize) {
        let same_size = self
            .shows
            .as_ref()
            .is_some_and(|(model, ..)| (model.camera.width_px, model.camera.height_px) == (width, height));
        for buffer in [&mut self.levels, &mut self.along] {
            if same_size {
                for (row, runs) in buffer.chunks_exact_mut(width).zip(&self.runs) {
                    runs.iter().for_each(|&(from, to)| row[from..to].fill(0.0));
                }
            } else {
                buffer.clear();
                buffer.resize(width * height, 0.0);
            }
        }
        self.runs.resize_with(height, Vec::new);
        self.runs.iter_mut().for_each(Vec::clear);
        match &mut self.lit {
            Some(sets) if same_size => sets.iter_mut().for_each(LitPixels::clear),
            lit => *lit = Some([LitPixels::none(width, height), LitPixels::none(width, height)]),
        }
    }
}

impl Exposure<'_> {
    /// Whether laser light reaches the sensor.
    pub(crate) fn laser(&self) -> bool {
        self.laser_exposure > 0.0
    }

    /// Whether ambient light reaches the sensor.
    pub(crate) fn ordinary(&self) -> bool {
        self.ambient_level > 0.0 && self.ambient_exposure > 0.0
    }
}

#[cfg(test)]
mod tests {
    use vision::{GreyImage, Pixels};

    use super::*;
    use crate::model::shape::StationShape;
    use crate::part::scene::SceneKind;
    use crate::render::renderer::Renderer;

    #[test]
    fn reused_memory_gives_the_images_of_fresh_memory() {
        let shape = StationShape { width_px: 328, height_px: 250, ..StationShape::default() };
        let larger = StationShape { width_px: 400, height_px: 300, ..shape.clone() };
        let model = StationModel::seeded(3, &shape).unwrap();
        let station = Renderer::new(&model);
        let mut drifted = model.clone();
        drifted.grating.wavelength_over_period *= 1.001;
        let (drifted, larger) =
            (station.with_light_of(&drifted), Renderer::new(&StationModel::seeded(3, &larger).unwrap()));
        let scenes = [SceneKind::Sphere { radius_mm: 18.9 }, SceneKind::Plate].map(|kind| kind.placed(&model, 1));
        let mut buffers = ExposureBuffers::default();
        let blank = || GreyImage::new(1, 1, Pixels::Eight(vec![0])).unwrap();
        for (image_number, (renderer, scene_idx, position_mm, laser_exposure)) in [
            (&station, 0, 0.0, 1.0),
            (&station, 0, 0.0, 0.7),
            (&station, 0, 0.0, 0.0),
            (&station, 0, 0.0, 1.0),
            (&station, 0, 2.5, 1.0),
            (&station, 1, 2.5, 1.0),
            (&drifted, 1, 2.5, 1.0),
            (&larger, 1, 2.5, 1.0),
            (&station, 1, 2.5, 1.0),
        ]
        .into_iter()
        .enumerate()
        {
            let exposure = Exposure {
                scene: &scenes[scene_idx],
                position: position_mm,
                ambient_level: 0.0,
                ambient_exposure: 0.0,
                laser_exposure,
                gain: 1.0,
                bits: 8,
                image_number: image_number as u64,
            };
            let (mut again, mut fresh) = (blank(), blank());
            renderer.expose(&exposure, &mut buffers, &mut again);
            renderer.expose(&exposure, &mut ExposureBuffers::default(), &mut fresh);
            assert!(again == fresh, "image {image_number}");
        }
    }
}
