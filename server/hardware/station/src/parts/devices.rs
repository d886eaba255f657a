//! The devices a station is made of, opened from its configuration.

use std::sync::Arc;

use devices::grbl::{self, GrblConfig};
use devices::replay::{self, Pace, Pictures, ReplayConfig};
use devices::{Camera, CameraRequest, Laser, Stage};
use twin::{
    SceneKind, Solid, StationModel, StationShape, Timing, TwinControl, TwinOptions, TwinStation, read_stl,
};

use crate::config::{GrblStationConfig, ReplayStationConfig, StationConfig, TwinConfig};
use crate::params::OPEN_LIMIT;
use crate::parts::faults::{fault, fault_of};
use crate::parts::mirror::{Mirror, MirroredLaser, MirroredStage};
use crate::shared::status::Fault;

/// Which devices are to be opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wanted {
    /// The camera.
    pub camera: bool,
    /// The stage.
    pub stage: bool,
    /// The laser.
    pub laser: bool,
}

/// What could be opened, and why the rest could not.
#[derive(Default)]
pub struct Opened {
    /// The camera, if it was wanted and found.
    pub camera: Option<Box<dyn Camera>>,
    /// The stage.
    pub stage: Option<Box<dyn Stage>>,
    /// The laser.
    pub laser: Option<Box<dyn Laser>>,
    /// Why devices that were wanted are not there.
    pub faults: Vec<Fault>,
}

/// Opens devices; may take seconds, so the station thread lets another thread do it.
pub type Opener = Arc<dyn Fn(Wanted) -> Opened + Send + Sync>;

/// What a station is made of.
pub struct Parts {
    /// Opens its devices.
    pub opener: Opener,
    /// `twin`, `replay`, or `None` for a real camera.
    pub simulated: Option<&'static str>,
    /// The virtual operator, where the camera is simulated.
    pub simulation: Option<TwinControl>,
}

/// The parts that the configuration names.
pub fn parts(config: &StationConfig) -> Parts {
    match config {
        StationConfig::Twin(twin) => match simulated(twin) {
            Ok(station) => twinned(station, twin.frame_rate_hz),
            Err(fault) => absent("twin", fault),
        },
        StationConfig::Replay(replay) => replayed(replay.clone()),
        StationConfig::Grbl(grbl) => match simulated(&grbl.camera) {
            Ok(station) => driven(grbl.clone(), station),
            Err(fault) => absent("twin", fault),
        },
    }
}

/// A station that never comes to be.
fn absent(simulated: &'static str, why: Fault) -> Parts {
    let opener = move |_: Wanted| Opened { faults: vec![why.clone()], ..Opened::default() };
    Parts { opener: Arc::new(opener), simulated: Some(simulated), simulation: None }
}

fn simulated(config: &TwinConfig) -> Result<TwinStation, Fault> {
    let refused = |message: String| fault("camera", "wrong_device", &message);
    let model = StationModel::seeded(config.seed, &StationShape::default())
        .map_err(|error| refused(with_causes(&error)))?;
    let timing = if config.realistic_timing { Timing::Realistic } else { Timing::Instant };
    let (kind, solid) = match scene(config).map_err(refused)? {
        OnStage::Part(kind) => (kind, None),
        OnStage::Solid(solid) => (SceneKind::Plate, Some(solid)),
    };
    let station = TwinStation::new(model, TwinOptions { timing, scene: kind, ..TwinOptions::default() });
    if let Some(solid) = solid {
        station.control().place_solid(solid);
    }
    Ok(station)
}

/// What lies on the simulated stage at the start.
enum OnStage {
    /// A part that the twin knows by name.
    Part(SceneKind),
    /// A part from a file.
    Solid(Arc<Solid>),
}

fn scene(config: &TwinConfig) -> Result<OnStage, String> {
    Ok(OnStage::Part(match config.scene.as_str() {
        "plate" => SceneKind::Plate,
        "gauge" => SceneKind::Gauge { height_mm: config.gauge_height_mm },
        "sphere" => SceneKind::Sphere { radius_mm: config.sphere_radius_mm },
        "freeform" => SceneKind::Freeform,
        file if file.to_ascii_lowercase().ends_with(".stl") => return solid(file).map(OnStage::Solid),
        other => {
            return Err(format!(
                "there is no scene `{other}`; set station.twin.scene to plate, gauge, sphere, freeform or an STL file"
            ));
        }
    }))
}

fn solid(file: &str) -> Result<Arc<Solid>, String> {
    let remedy = "set station.twin.scene to an STL file in mm";
    let bytes = std::fs::read(file).map_err(|error| format!("cannot read {file}: {error}; {remedy}"))?;
    let solid = read_stl(&bytes).map_err(|error| format!("{file}: {}", with_causes(&error)))?;
    Ok(Arc::new(solid))
}

/// The parts of a simulated station; its camera opens at that rate, or the nearest it can.
pub fn twinned(twin: TwinStation, frame_rate_hz: f64) -> Parts {
    let simulation = Some(twin.control());
    let opener = move |wanted: Wanted| Opened {
        camera: wanted.camera.then(|| {
            let mut camera = twin.camera();
            // A rate is moved into its range, so that nothing is left to refuse.
            let _ = camera
                .configure(&CameraRequest { frame_rate_hz: Some(frame_rate_hz), ..CameraRequest::default() });
            Box::new(camera) as Box<dyn Camera>
        }),
        stage: wanted.stage.then(|| Box::new(twin.stage()) as Box<dyn Stage>),
        laser: wanted.laser.then(|| Box::new(twin.laser()) as Box<dyn Laser>),
        faults: Vec::new(),
    };
    Parts { opener: Arc::new(opener), simulated: Some("twin"), simulation }
}

/// A real stage and laser under a simulated camera, whose world follows what the controller reports.
pub fn driven(config: GrblStationConfig, twin: TwinStation) -> Parts {
    let control = twin.control();
    let world = Mirror::following(&control);
    let opener = move |wanted: Wanted| {
        let camera = wanted.camera.then(|| Box::new(twin.camera()) as Box<dyn Camera>);
        match grbl::open(&grbl_config(&config)) {
            Ok((stage, laser)) => Opened {
                camera,
                stage: wanted.stage.then(|| Box::new(MirroredStage::new(stage, &world)) as Box<dyn Stage>),
                laser: wanted.laser.then(|| Box::new(MirroredLaser::new(laser, &world)) as Box<dyn Laser>),
                faults: Vec::new(),
            },
            Err(error) => {
                Opened { camera, faults: fault_of(&error.into()).into_iter().collect(), ..Opened::default() }
            }
        }
    };
    Parts { opener: Arc::new(opener), simulated: Some("twin"), simulation: Some(control) }
}

fn grbl_config(config: &GrblStationConfig) -> GrblConfig {
    GrblConfig {
        baud_rate: config.baud,
        expected_name: Some(config.identity.clone()).filter(|name| !name.is_empty()),
        zero_at_machine_mm: config.zero_at_machine_mm,
        open_limit: OPEN_LIMIT,
        ..GrblConfig::new(&config.port, config.steps_per_mm, (config.travel_from_mm, config.travel_to_mm))
    }
}

fn replayed(config: ReplayStationConfig) -> Parts {
    let opener = move |wanted: Wanted| match open_replay(&config) {
        Ok((camera, stage, laser)) => opened(wanted, camera, stage, laser),
        Err(error) => Opened { faults: vec![unplayable(&error)], ..Opened::default() },
    };
    Parts { opener: Arc::new(opener), simulated: Some("replay"), simulation: None }
}

fn unplayable(error: &replay::ReplayError) -> Fault {
    let remedy = "put it in place and reset the station, or correct station.replay.folder and station.replay.scan";
    fault("camera", "gone", &format!("{}; {remedy}", with_causes(error)))
}

fn open_replay(
    config: &ReplayStationConfig,
) -> Result<(replay::ReplayCamera, replay::ReplayStage, replay::ReplayLaser), replay::ReplayError> {
    let scan = match &config.scan {
        Some(scan) => scan.clone(),
        None => first_scan(config)?,
    };
    replay::open(&ReplayConfig {
        folder: config.folder.clone(),
        pictures: Pictures::Scan(scan),
        pace: Pace::Hz(config.frame_rate_hz),
        looped: config.repeat,
        preload: config.preload,
    })
}

fn first_scan(config: &ReplayStationConfig) -> Result<String, replay::ReplayError> {
    let capture = capture::Capture::open(&config.folder)?;
    let first = capture.manifest.scans.first().map(|scan| scan.name.clone());
    first.ok_or_else(|| replay::ReplayError::NoPictures { folder: config.folder.clone(), pictures: "scan" })
}

/// Those devices that were wanted.
fn opened<C: Camera + 'static, S: Stage + 'static, L: Laser + 'static>(
    wanted: Wanted,
    camera: C,
    stage: S,
    laser: L,
) -> Opened {
    Opened {
        camera: wanted.camera.then(|| Box::new(camera) as Box<dyn Camera>),
        stage: wanted.stage.then(|| Box::new(stage) as Box<dyn Stage>),
        laser: wanted.laser.then(|| Box::new(laser) as Box<dyn Laser>),
        faults: Vec::new(),
    }
}

/// An error in one line, with its causes before its remedy.
fn with_causes(error: &dyn std::error::Error) -> String {
    let mut causes = Vec::new();
    let mut next = error.source();
    while let Some(cause) = next {
        causes.push(cause.to_string());
        next = cause.source();
    }
    let words = error.to_string();
    let because = if causes.is_empty() { String::new() } else { format!(": {}", causes.join(": ")) };
    match words.rsplit_once("; ") {
        Some((detail, remedy)) => format!("{detail}{because}; {remedy}"),
        None => format!("{words}{because}"),
    }
}
