//! Pictures of a station: everything that depends on the station alone is computed once, then frames are cheap.

use nalgebra::{Vector2, Vector3};
use optics::LightSurfaces;
use rayon::prelude::*;
use vision::{GreyImage, Pixels};

use crate::board_image::ordinary_light;
use crate::laser_image::{LaserLight, Placed, laser_light};
use crate::lit_pixels::LitPixels;
use crate::params::BOARD_WHITE_LEVEL;
use crate::psf::{PSF_TAPS, blur_across, blur_along, psf_taps};
use crate::random::{derived_seed, normal_quantiles, scrambled};
use crate::scene::Scene;
use crate::sensor::{Level, Noise, Sensor, image_of};
use crate::sheet_map::{PixelMap, SheetMap, ray_map};
use crate::speckle::{Speckle, SpeckleView};
use crate::station::StationModel;

/// Stream of the speckle pattern among those derived from a station's seed.
const SPECKLE_STREAM: u64 = 2;

/// Stream of pictures: what one frame sees is independent of every other frame.
const PICTURE_STREAM: u64 = 3;

/// Takes pictures with the simulated camera.
#[derive(Debug, Clone)]
pub struct Renderer {
    pub(crate) model: StationModel,
    pub(crate) rays: PixelMap<2>,
    pub(crate) sheets: Vec<SheetMap>,
    /// Distance from the source to the middle of the working volume.
    pub(crate) reference_distance_mm: f64,
    /// Towards which side of the picture ordinary light grows.
    pub(crate) brighter_side: Vector2<f64>,
    speckle: Speckle,
    sensor: Sensor,
    taps: [f32; PSF_TAPS],
}

impl Renderer {
    /// A renderer of the station's pictures, with all noise.
    pub fn new(model: &StationModel) -> Self {
        Self::with_noise(model, Noise::On)
    }

    /// A renderer without speckle, shot and read noise: the mean of infinitely many pictures.
    pub fn without_noise(model: &StationModel) -> Self {
        Self::with_noise(model, Noise::Off)
    }

    fn with_noise(model: &StationModel, noise: Noise) -> Self {
        let light = LightSurfaces::Grating(model.grating);
        let quantiles = normal_quantiles();
        let contrast = if noise == Noise::On { model.shape.speckle_contrast } else { 0.0 };
        let side = scrambled(model.seed) as f64 / u64::MAX as f64 * std::f64::consts::TAU;
        let middle = Vector3::new(0.0, 0.0, model.shape.standoff_mm);
        Self {
            rays: ray_map(&model.camera),
            sheets: model.orders.iter().map(|&order| SheetMap::new(&model.camera, &light, order)).collect(),
            reference_distance_mm: (middle - model.grating.source_mm).norm(),
            brighter_side: Vector2::new(side.cos(), side.sin()),
            speckle: Speckle::new(
                derived_seed(model.seed, SPECKLE_STREAM),
                contrast,
                model.shape.speckle_grain_px,
                &quantiles,
            ),
            sensor: Sensor::new(&quantiles, noise),
            taps: psf_taps(),
            model: model.clone(),
        }
    }

    /// The same camera with the grating and light of another model of the station, in a fraction of the time.
    pub(crate) fn with_light_of(&self, model: &StationModel) -> Self {
        let light = LightSurfaces::Grating(model.grating);
        let sheets = model.orders.iter().map(|&order| SheetMap::new(&model.camera, &light, order)).collect();
        Self { sheets, model: model.clone(), ..self.clone() }
    }

    /// The station.
    pub fn model(&self) -> &StationModel {
        &self.model
    }

    /// A picture at normal exposure with the laser off; `picture` numbers the frame and so its noise.
    pub fn board_image(&self, scene: &Scene, position_mm: f64, picture: u64) -> GreyImage {
        let light = ordinary_light(self, self.placed(scene, position_mm), BOARD_WHITE_LEVEL);
        let mut lit = LitPixels::none(self.model.camera.width_px, self.model.camera.height_px);
        lit.fill();
        self.picture(&LaserLight { levels: light, lit }, None, None, picture)
    }

    /// A picture at low exposure with the laser on; `picture` numbers the frame and so its speckle and noise.
    pub fn laser_image(&self, scene: &Scene, position_mm: f64, picture: u64) -> GreyImage {
        let placed = self.placed(scene, position_mm);
        let mut light = laser_light(self, placed);
        let speckle = self.speckle.view(derived_seed(self.picture_seed(picture), SPECKLE_STREAM));
        let ambient = self.model.shape.ambient_levels;
        if ambient <= 0.0 {
            return self.picture(&light, Some(&speckle), None, picture);
        }
        light.lit.fill();
        let ambient = ordinary_light(self, placed, ambient);
        self.picture(&light, Some(&speckle), Some(&ambient), picture)
    }

    pub(crate) fn placed<'s>(&self, scene: &'s Scene, position_mm: f64) -> Placed<'s> {
        Placed { scene, moved_mm: self.model.stage.direction * position_mm }
    }

    fn picture_seed(&self, picture: u64) -> u64 {
        derived_seed(derived_seed(self.model.seed, PICTURE_STREAM), picture)
    }

    /// Lens blur, speckle, and the sensor.
    fn picture(
        &self,
        light: &LaserLight,
        speckle: Option<&SpeckleView<'_>>,
        ambient: Option<&[f32]>,
        picture: u64,
    ) -> GreyImage {
        let (width, height) = (self.model.camera.width_px, self.model.camera.height_px);
        let blurred = Blurred {
            light: self.blurred_rows(light),
            ambient: ambient.map(|levels| {
                let mut lit = LitPixels::none(width, height);
                lit.fill();
                self.blurred_rows(&LaserLight { levels: levels.to_vec(), lit })
            }),
            runs: (0..height).map(|v| light.lit.blurred_runs(v)).collect(),
            speckle,
            seed: self.picture_seed(picture),
        };
        if self.model.shape.bits == 16 {
            image_of(width, height, Pixels::Sixteen(self.exposed(&blurred)))
        } else {
            image_of(width, height, Pixels::Eight(self.exposed(&blurred)))
        }
    }

    /// Blurred along rows only.
    fn blurred_rows(&self, light: &LaserLight) -> Vec<f32> {
        let width = self.model.camera.width_px;
        let mut along = vec![0.0; light.levels.len()];
        along.par_chunks_mut(width).zip(light.levels.par_chunks(width)).enumerate().for_each(
            |(v, (target, row))| {
                for (from, to) in light.lit.blurred_runs(v) {
                    blur_along(row, from, to, &self.taps, target);
                }
            },
        );
        along
    }

    fn exposed<L: Level + Default>(&self, blurred: &Blurred<'_, '_>) -> Vec<L> {
        let (width, height) = (self.model.camera.width_px, self.model.camera.height_px);
        let mut pixels = vec![L::default(); width * height];
        pixels.par_chunks_mut(width).enumerate().for_each_init(
            || vec![0.0; width],
            |light, (v, row)| {
                let row_seed = Sensor::row_seed(blurred.seed, v);
                let mut dark_from = 0;
                for &(from, to) in &blurred.runs[v] {
                    self.sensor.expose_dark(row_seed, dark_from, &mut row[dark_from..from]);
                    self.light_run(blurred, v, (from, to), light);
                    self.sensor.expose(row_seed, from, &light[from..to], &mut row[from..to]);
                    dark_from = to;
                }
                self.sensor.expose_dark(row_seed, dark_from, &mut row[dark_from..]);
            },
        );
        pixels
    }

    /// The light on a run of pixels of row `v`: blurred across rows, grained, and ambient light added.
    fn light_run(&self, blurred: &Blurred<'_, '_>, v: usize, (from, to): (usize, usize), light: &mut [f32]) {
        let width = self.model.camera.width_px;
        blur_across(&blurred.light, width, v, (from, to), &self.taps, light);
        if let Some(speckle) = blurred.speckle {
            speckle.apply(v, from, &mut light[from..to]);
        }
        if let Some(ambient) = &blurred.ambient {
            let mut added = vec![0.0; width];
            blur_across(ambient, width, v, (from, to), &self.taps, &mut added);
            for (slot, more) in light[from..to].iter_mut().zip(&added[from..to]) {
                *slot += more;
            }
        }
    }
}

/// A picture's light on its way to the sensor.
struct Blurred<'p, 's> {
    light: Vec<f32>,
    ambient: Option<Vec<f32>>,
    runs: Vec<Vec<(usize, usize)>>,
    speckle: Option<&'p SpeckleView<'s>>,
    seed: u64,
}
