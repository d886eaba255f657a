//! The driver: camera, stage and laser of one simulated world.
//!
//! However many of the three devices a station takes from here, and however often they are opened: one [`TwinDriver`]
//! has one [`TwinStation`], made when it is first needed, and that is the one world in which its stage moves the part,
//! its laser lights it and its camera sees it. A stage or a laser of another driver beside the simulated camera moves and
//! lights the same world: it follows what they report ([`TwinDriver::followed`]).

use std::fmt;
use std::sync::{Arc, OnceLock};

use devices::{Camera, CameraRequest, DeviceSet, Driver, Laser, OpenError, Opened, Stage};
use optics::StageKind;
use remedy::{Remedy, with_causes};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::live::{Timing, TwinControl, TwinOptions, TwinStation};
use crate::model::shape::StationShape;
use crate::model::station::StationModel;
use crate::params::{GAUGE_HEIGHT_MM, SPHERE_RADIUS_MM};
use crate::part::mesh::Solid;
use crate::part::scene::SceneKind;
use crate::part::stl::read_stl;

/// `[station.twin]`: the simulated world.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TwinSettings {
    /// seed that all its randomness comes from
    #[schemars(range(max = i64::MAX))]
    pub seed: u64,
    /// what is on the stage: plate, gauge, sphere, freeform, or an STL file
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
    /// ramps, settling and homing take their time
    pub realistic_timing: bool,
    /// frames per second of the view
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub frame_rate_hz: f64,
}

impl Default for TwinSettings {
    /// A ball on the stage of the station with seed 7, without waiting.
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
        }
    }
}

/// Makes the devices of one simulated world, see the module.
pub struct TwinDriver {
    settings: TwinSettings,
    /// The one world, or why there is none: settings do not get better by trying again.
    world: OnceLock<Result<TwinStation, NoWorld>>,
}

impl TwinDriver {
    /// The driver of a world with these settings.
    pub fn new(settings: TwinSettings) -> Self {
        Self { settings, world: OnceLock::new() }
    }

    /// The driver of a given world, of any shape.
    pub fn over(world: TwinStation) -> Self {
        Self { settings: TwinSettings::default(), world: Ok(world).into() }
    }

    /// What the world was made with.
    pub fn settings(&self) -> &TwinSettings {
        &self.settings
    }

    /// The control of the simulation; `None` if the settings make no world.
    pub fn control(&self) -> Option<TwinControl> {
        self.world().ok().map(TwinStation::control)
    }

    /// Devices of another driver beside this one's camera: from now on the world follows them.
    ///
    /// # Errors
    /// [`OpenError::Settings`] if the settings make no world.
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
        made.as_ref()
            .map_err(|NoWorld { what, remedy }| OpenError::Settings { what: what.clone(), remedy: remedy.clone() })
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
            // A rate is moved into its range, so that nothing is left to refuse.
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

/// What lies on the stage at the start.
enum OnStage {
    /// A part that is known by name.
    Part(SceneKind),
    /// A part from a file.
    Solid(Arc<Solid>),
}

/// Why settings make no world, and what to do about it.
struct NoWorld {
    what: String,
    remedy: String,
}

impl NoWorld {
    fn new(what: String, remedy: &str) -> Self {
        Self { what, remedy: remedy.to_owned() }
    }
}

fn world(settings: &TwinSettings) -> Result<TwinStation, NoWorld> {
    let stage = if settings.rotary { StageKind::Rotary } else { StageKind::Linear };
    let shape = StationShape { stage, ambient_levels: settings.ambient_levels, ..StationShape::default() };
    let model = StationModel::seeded(settings.seed, &shape)
        .map_err(|error| NoWorld::new(with_causes(&error), "choose another station.twin.seed"))?;
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

fn on_stage(settings: &TwinSettings) -> Result<OnStage, NoWorld> {
    Ok(OnStage::Part(match settings.scene.as_str() {
        "plate" => SceneKind::Plate,
        "gauge" => SceneKind::Gauge { height_mm: settings.gauge_height_mm },
        "sphere" => SceneKind::Sphere { radius_mm: settings.sphere_radius_mm },
        "freeform" => SceneKind::Freeform,
        file if file.to_ascii_lowercase().ends_with(".stl") => return solid(file).map(OnStage::Solid),
        other => {
            return Err(NoWorld::new(
                format!("there is no scene `{other}`"),
                "set station.twin.scene to plate, gauge, sphere, freeform or an STL file",
            ));
        }
    }))
}

fn solid(file: &str) -> Result<Arc<Solid>, NoWorld> {
    let usual = "set station.twin.scene to an STL file in mm";
    let bytes =
        std::fs::read(file).map_err(|error| NoWorld::new(format!("cannot read {file}: {error}"), usual))?;
    let solid = read_stl(&bytes).map_err(|error| {
        NoWorld::new(format!("{file}: {}", with_causes(&error)), &error.remedy().unwrap_or(usual.into()))
    })?;
    Ok(Arc::new(solid))
}
