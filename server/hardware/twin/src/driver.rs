//! The driver: camera, stage and laser of one simulated world.
//!
//! Each [`TwinDriver`] has one [`TwinStation`], created when it is first needed and shared by all devices that it
//! opens: its stage moves the part, its laser lights it and its camera images it. A stage or laser of another driver
//! combined with the simulated camera acts on the same world, which follows the reported states
//! ([`TwinDriver::followed`]).

use std::fmt;
use std::sync::{Arc, OnceLock};

use capture::{PlanesProjector, Projector};
use devices::{Camera, CameraRequest, DeviceSet, Driver, Laser, OpenError, Opened, Stage};
use optics::StageKind;
use remedy::{Remedy, with_causes};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::live::{Timing, TwinControl, TwinOptions, TwinStation};
use crate::model::shape::{ProjectorShape, StationShape};
use crate::model::station::StationModel;
use crate::params::{GAUGE_HEIGHT_MM, SPHERE_RADIUS_MM};
use crate::part::mesh::Solid;
use crate::part::scene::SceneKind;
use crate::part::stl::read_stl;

/// `[station.twin]`: the simulated world.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TwinSettings {
    /// seed of all random numbers
    #[schemars(range(max = i64::MAX))]
    pub seed: u64,
    /// scene on the stage: plate, gauge, sphere, freeform, or an STL file
    pub scene: String,
    /// height of the gauge
    #[schemars(range(min = 0.1, max = 100.0))]
    pub gauge_height_mm: f64,
    /// radius of the ball
    #[schemars(range(min = 0.1, max = 100.0))]
    pub sphere_radius_mm: f64,
    /// the stage is a turntable
    pub rotary: bool,
    /// grey levels (of 255) that ambient light adds to white while the laser is on
    #[schemars(range(max = 255.0))]
    pub ambient_levels: f64,
    /// simulate the duration of ramps, settling and homing
    pub realistic_timing: bool,
    /// frames per second of the live view
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub frame_rate_hz: f64,
    /// Independent lasers instead of laser and grating: the station's projector, no setting of its own.
    #[serde(skip)]
    pub lasers: Option<PlanesProjector>,
}

impl Default for TwinSettings {
    /// A ball on the stage of the station with seed 7, without delays.
    fn default() -> Self {
        Self {
            seed: 7,
            scene: "sphere".to_owned(),
            gauge_height_mm: GAUGE_HEIGHT_MM,
            sphere_radius_mm: SPHERE_RADIUS_MM,
            rotary: false,
            ambient_levels: 0.0,
            realistic_timing: false,
            frame_rate_hz: 30.0,
            lasers: None,
        }
    }
}

/// Opens the devices of one simulated world, see the module.
pub struct TwinDriver {
    settings: TwinSettings,
    /// The simulated world, or why it cannot be created from the settings.
    world: OnceLock<Result<TwinStation, WorldError>>,
}

impl TwinDriver {
    /// The driver of a world with these settings.
    pub fn new(settings: TwinSettings) -> Self {
        Self { settings, world: OnceLock::new() }
    }

    /// The driver of a given world.
    pub fn over(world: TwinStation) -> Self {
        Self { settings: TwinSettings::default(), world: Ok(world).into() }
    }

    /// Settings of the world.
    pub fn settings(&self) -> &TwinSettings {
        &self.settings
    }

    /// Control of the simulation; `None` if no world can be created from the settings.
    pub fn control(&self) -> Option<TwinControl> {
        self.world().ok().map(TwinStation::control)
    }

    /// Combines this driver's camera with devices of another driver, which the world follows from now on.
    ///
    /// # Errors
    /// [`OpenError::Settings`] if no world can be created from the settings.
    pub fn followed(&self, opened: Opened) -> Result<Opened, OpenError> {
        let world = self.world()?;
        Ok(Opened {
            camera: opened.camera,
            stage: opened.stage.map(|stage| world.followed_stage(stage)),
            laser: opened.laser.map(|laser| world.followed_laser(laser)),
        })
    }

    fn world(&self) -> Result<&TwinStation, OpenError> {
        let made = self.world.get_or_init(|| world(&self.settings));
        made.as_ref().map_err(|WorldError { what, remedy }| OpenError::Settings {
            what: what.clone(),
            remedy: remedy.clone(),
        })
    }
}

impl fmt::Debug for TwinDriver {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TwinDriver").field("settings", &self.settings).finish_non_exhaustive()
    }
}

impl Driver for TwinDriver {
    fn kind(&self) -> &'static str {
        "twin"
    }

    fn makes(&self) -> DeviceSet {
        DeviceSet::ALL
    }

    fn is_real(&self) -> bool {
        false
    }

    fn open(&self, wanted: DeviceSet) -> Result<Opened, OpenError> {
        let world = self.world()?;
        let camera = || {
            let mut camera = world.camera();
            let frame_rate_hz = Some(self.settings.frame_rate_hz);
            // A rate is clamped to its range, so that nothing can be refused.
            let _ = camera.configure(&CameraRequest { frame_rate_hz, ..CameraRequest::default() });
            Box::new(camera) as Box<dyn Camera>
        };
        Ok(Opened {
            camera: wanted.camera.then(camera),
            stage: wanted.stage.then(|| Box::new(world.stage()) as Box<dyn Stage>),
            laser: wanted.laser.then(|| Box::new(world.laser()) as Box<dyn Laser>),
        })
    }
}

/// The part on the stage at the start.
enum OnStage {
    /// A part selected by name.
    Part(SceneKind),
    /// A part from a file.
    Solid(Arc<Solid>),
}

/// Why no world can be created from the settings, and the remedy.
struct WorldError {
    what: String,
    remedy: String,
}

impl WorldError {
    fn new(what: String, remedy: &str) -> Self {
        Self { what, remedy: remedy.to_owned() }
    }
}

fn world(settings: &TwinSettings) -> Result<TwinStation, WorldError> {
    let stage = if settings.rotary { StageKind::Rotary } else { StageKind::Linear };
    let mut shape = StationShape { stage, ambient_levels: settings.ambient_levels, ..StationShape::default() };
    if let Some(lasers) = &settings.lasers {
        shape.projector = ProjectorShape::Lasers { lines: lasers.lines };
        shape.line_direction = Projector::Planes(lasers.clone()).direction_of(0);
    }
    let model = StationModel::seeded(settings.seed, &shape)
        .map_err(|error| WorldError::new(with_causes(&error), "choose another station.twin.seed"))?;
    let timing = if settings.realistic_timing { Timing::Realistic } else { Timing::Instant };
    let (scene, solid) = match on_stage(settings)? {
        OnStage::Part(kind) => (kind, None),
        OnStage::Solid(solid) => (SceneKind::Plate, Some(solid)),
    };
    let station = TwinStation::new(model, TwinOptions { timing, scene, ..TwinOptions::of(stage) });
    if let Some(solid) = solid {
        station.control().place_solid(solid);
    }
    Ok(station)
}

fn on_stage(settings: &TwinSettings) -> Result<OnStage, WorldError> {
    Ok(OnStage::Part(match settings.scene.as_str() {
        "plate" => SceneKind::Plate,
        "gauge" => SceneKind::Gauge { height_mm: settings.gauge_height_mm },
        "sphere" => SceneKind::Sphere { radius_mm: settings.sphere_radius_mm },
        "freeform" => SceneKind::Freeform,
        file if file.to_ascii_lowercase().ends_with(".stl") => return solid(file).map(OnStage::Solid),
        other => {
            return Err(WorldError::new(
                format!("there is no scene `{other}`"),
                "set station.twin.scene to plate, gauge, sphere, freeform or an STL file",
            ));
        }
    }))
}

fn solid(file: &str) -> Result<Arc<Solid>, WorldError> {
    let usual = "set station.twin.scene to an STL file in mm";
    let bytes =
        std::fs::read(file).map_err(|error| WorldError::new(format!("cannot read {file}: {error}"), usual))?;
    let solid = read_stl(&bytes).map_err(|error| {
        WorldError::new(format!("{file}: {}", with_causes(&error)), &error.remedy().unwrap_or(usual.into()))
    })?;
    Ok(Arc::new(solid))
}
