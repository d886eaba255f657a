//! Images of a station: values that depend only on the station are computed once, so that frames are cheap.

use nalgebra::{Vector2, Vector3};
use optics::LightSurfaces;
use vision::{GreyImage, Pixels};

use crate::model::fan::{Fan, FanAngles};
use crate::model::psf::{PSF_TAPS, blur_across, blur_along, psf_taps};
use crate::model::random::{derived_seed, normal_quantiles, scrambled};
use crate::model::speckle::Speckle;
use crate::model::station::StationModel;
use crate::params::BOARD_WHITE_LEVEL;
use crate::part::scene::Scene;
use crate::render::exposure::{AmbientLightImage, Exposure, ExposureBuffers, LaserLightImage};
use crate::render::light::sheet_map::{PixelMap, SheetMap, ray_map};
use crate::render::sensor::{Level, Noise, Sensor};
use crate::render::view::board_image::ambient_light;
use crate::render::view::laser_image::{MovedScene, laser_light};
use crate::render::view::pixel_hits::MeshMemory;

/// Random stream of the speckle pattern, derived from a station's seed.
const SPECKLE_STREAM: u64 = 2;

/// Random stream of images: the sensor noise of each frame is independent.
const IMAGE_STREAM: u64 = 3;

/// Renders images of the simulated camera.
#[derive(Debug, Clone)]
pub struct Renderer {
    pub(crate) model: StationModel,
    pub(crate) rays: PixelMap<2>,
    pub(crate) sheets: Vec<SheetMap>,
    pub(crate) fan_angles: FanAngles,
    pub(crate) fans: Vec<Fan>,
    /// Distance from the source to the middle of the working volume.
    pub(crate) reference_distance_mm: f64,
    /// Direction in the image in which ambient light increases.
    pub(crate) brighter_side: Vector2<f64>,
    speckle: Speckle,
    sensor: Sensor,
    taps: [f32; PSF_TAPS],
}

impl Renderer {
    /// A renderer of the station's images, with all noise.
    pub fn new(model: &StationModel) -> Self {
        Self::with_noise(model, Noise::On)
    }

    /// A renderer without speckle, shot and read noise: the mean of infinitely many images.
    pub fn without_noise(model: &StationModel) -> Self {
        Self::with_noise(model, Noise::Off)
    }

    fn with_noise(model: &StationModel, noise: Noise) -> Self {
        let quantiles = normal_quantiles();
        let contrast = if noise == Noise::On { model.shape.speckle_contrast } else { 0.0 };
        let side = scrambled(model.seed) as f64 / u64::MAX as f64 * std::f64::consts::TAU;
        let middle = Vector3::new(0.0, 0.0, model.shape.standoff_mm);
        let (first, _) = model.source_of(model.orders.first().copied().unwrap_or(0));
        let reference_distance_mm = (middle - first.source_mm).norm();
        let fan_angles = FanAngles::new(model, reference_distance_mm);
        Self {
            rays: ray_map(&model.camera),
            sheets: sheets(model),
            fan_angles,
            fans: fans(model, fan_angles),
            reference_distance_mm,
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
        Self { sheets: sheets(model), fans: fans(model, self.fan_angles), model: model.clone(), ..self.clone() }
    }

    /// The station.
    pub fn model(&self) -> &StationModel {
        &self.model
    }

    /// An image at normal exposure with the laser off; `image_number` numbers the frame and determines its noise.
    pub fn board_image(&self, scene: &Scene, position: f64, image_number: u64) -> GreyImage {
        self.image(&Exposure {
            scene,
            position,
            ambient_level: BOARD_WHITE_LEVEL,
            ambient_exposure: 1.0,
            laser_exposure: 0.0,
            gain: 1.0,
            bits: self.model.shape.bits,
            image_number,
        })
    }

    /// An image at low exposure with the laser on; `image_number` numbers the frame and determines the sensor's noise:
    /// speckle belongs to the surface and follows its position.
    pub fn laser_image(&self, scene: &Scene, position: f64, image_number: u64) -> GreyImage {
        self.image(&Exposure {
            scene,
            position,
            ambient_level: self.model.shape.ambient_levels,
            ambient_exposure: 1.0,
            laser_exposure: 1.0,
            gain: 1.0,
            bits: self.model.shape.bits,
            image_number,
        })
    }

    fn image(&self, exposure: &Exposure<'_>) -> GreyImage {
        let mut image = GreyImage::new(1, 1, Pixels::Eight(vec![0])).expect("one pixel is an image");
        self.expose(exposure, &mut ExposureBuffers::default(), &mut image);
        image
    }

    /// Renders an image into `image`; its memory and that of `buffers` are reused. Single-threaded.
    pub fn expose(&self, exposure: &Exposure<'_>, buffers: &mut ExposureBuffers, image: &mut GreyImage) {
        const SIDES: &str = "a station's images have at least one row and one column";
        let (width, height) = (self.model.camera.width_px, self.model.camera.height_px);
        if exposure.laser() {
            self.project_laser(exposure, &mut buffers.laser, &mut buffers.mesh);
        }
        if exposure.ordinary() {
            self.project_ambient(exposure, &mut buffers.ordinary, &mut buffers.mesh);
        }
        if exposure.bits == 16 {
            self.read_out(exposure, buffers, image.sixteen_mut(width, height).expect(SIDES));
        } else {
            self.read_out(exposure, buffers, image.eight_mut(width, height).expect(SIDES));
        }
    }

    fn image_seed(&self, image_number: u64) -> u64 {
        derived_seed(derived_seed(self.model.seed, IMAGE_STREAM), image_number)
    }

    /// The image under laser light before speckle and sensor, redrawn only if its content changed.
    fn project_laser(&self, exposure: &Exposure<'_>, target: &mut LaserLightImage, memory: &mut MeshMemory) {
        if !target.select(&self.model, exposure.scene, exposure.position) {
            return;
        }
        let width = self.model.camera.width_px;
        let LaserLightImage { levels, along, runs, lit: Some([lit, of_order]), .. } = target else { return };
        let scene = MovedScene::new(&self.model, exposure.scene, exposure.position);
        laser_light(self, scene.placed(), levels, lit, of_order, memory);
        let mut rows = Vec::new();
        for (v, runs) in runs.iter_mut().enumerate() {
            lit.blurred_runs(v, &mut rows, runs);
            let row = v * width..(v + 1) * width;
            for &(from, to) in runs.iter() {
                blur_along(&levels[row.clone()], from, to, &self.taps, &mut along[row.clone()]);
            }
        }
        for ((v, row), runs) in levels.chunks_exact_mut(width).enumerate().zip(runs) {
            for &mut run in runs {
                blur_across(along, width, v, run, &self.taps, row);
            }
        }
    }

    /// The image under ambient light before the sensor, redrawn only if its content changed.
    fn project_ambient(&self, exposure: &Exposure<'_>, target: &mut AmbientLightImage, memory: &mut MeshMemory) {
        if !target.select(exposure.scene, exposure.position, exposure.ambient_level) {
            return;
        }
        let width = self.model.camera.width_px;
        let scene = MovedScene::new(&self.model, exposure.scene, exposure.position);
        let light = ambient_light(self, scene.placed(), exposure.ambient_level, memory);
        let mut along = vec![0.0; light.len()];
        for (row, target) in light.chunks_exact(width).zip(along.chunks_exact_mut(width)) {
            blur_along(row, 0, width, &self.taps, target);
        }
        target.levels.resize(light.len(), 0.0);
        for (v, row) in target.levels.chunks_exact_mut(width).enumerate() {
            blur_across(&along, width, v, (0, width), &self.taps, row);
        }
    }

    /// The sensor: row by row, from light to grey levels.
    fn read_out<L: Level>(&self, exposure: &Exposure<'_>, buffers: &mut ExposureBuffers, pixels: &mut [L]) {
        const DARK: &Vec<(usize, usize)> = &Vec::new();
        let width = self.model.camera.width_px;
        let seed = self.image_seed(exposure.image_number);
        let surface = derived_seed(derived_seed(self.model.seed, SPECKLE_STREAM), exposure.scene.fingerprint());
        let travel_mm = self.model.travel_mm(exposure.position);
        let speckle = self.speckle.view(surface, travel_mm, self.model.sheet_sigma_mm);
        let whole_rows = exposure.ordinary() || exposure.gain != 1.0;
        let ExposureBuffers { row: light, laser, ordinary, .. } = buffers;
        light.resize(width, 0.0);
        for (v, row) in pixels.chunks_exact_mut(width).enumerate() {
            let pixels = v * width..(v + 1) * width;
            let row_seed = Sensor::row_seed(seed, v);
            if whole_rows {
                light.fill(0.0);
            }
            let mut dark_from = 0;
            for &(from, to) in if exposure.laser() { &laser.runs[v] } else { DARK } {
                let smooth = &laser.levels[pixels.clone()][from..to];
                speckle.grain(v, from, smooth, exposure.laser_exposure, &mut light[from..to]);
                if !whole_rows {
                    self.sensor.expose_dark(row_seed, dark_from, &mut row[dark_from..from]);
                    self.sensor.expose(row_seed, from, &light[from..to], 1.0, &mut row[from..to]);
                    dark_from = to;
                }
            }
            if whole_rows {
                if exposure.ordinary() {
                    let more = &ordinary.levels[pixels];
                    light
                        .iter_mut()
                        .zip(more)
                        .for_each(|(level, more)| *level += more * exposure.ambient_exposure);
                }
                self.sensor.expose(row_seed, 0, light, exposure.gain, row);
            } else {
                self.sensor.expose_dark(row_seed, dark_from, &mut row[dark_from..]);
            }
        }
    }
}

/// The sheet of every order.
fn sheets(model: &StationModel) -> Vec<SheetMap> {
    let sheet = |line: &i8| {
        let (source, order) = model.source_of(*line);
        SheetMap::new(&model.camera, &LightSurfaces::Grating(source), order)
    };
    model.orders.iter().map(sheet).collect()
}

/// The fan of every order.
fn fans(model: &StationModel, angles: FanAngles) -> Vec<Fan> {
    model.orders.iter().map(|&order| Fan::new(model, angles, order)).collect()
}
