//! The status of a station without devices.

use devices::{
    CameraCapabilities, CameraSettings, DeviceIdentity, Homing, LaserCapabilities, PixelFormat, Roi,
    StageCapabilities, Trigger,
};

use station::{DeviceStatus, LaserLight, MachineState, StateHistory, StationStatus};

/// The initial status.
pub fn first_status() -> StationStatus {
    let camera = CameraCapabilities {
        sensor_px: (64, 32),
        exposure_us: None,
        gain_db: None,
        frame_rate_hz: None,
        triggers: Vec::new(),
        pixel_formats: Vec::new(),
        roi: false,
    };
    let stage = StageCapabilities {
        kind: devices::StageKind::Linear,
        travel_mm: (0.0, 1.0),
        max_speed_mm_s: 1.0,
        acceleration_mm_s2: None,
        homing: Homing::Absent,
        resolution_mm: 0.0,
        follows_frames: false,
        frame_pitch_mm: None,
    };
    StationStatus {
        state: MachineState::Preoperational,
        state_history: StateHistory::default(),
        activity: String::new(),
        simulated: Some("twin"),
        camera: absent(camera),
        camera_settings: CameraSettings {
            exposure_us: 0.0,
            gain_db: 0.0,
            frame_rate_hz: 0.0,
            trigger: Trigger::Free,
            pixel_format: PixelFormat::Mono8,
            roi: Roi { left_px: 0, top_px: 0, width_px: 64, height_px: 32 },
        },
        dark_frame_use: station::DarkFrameUse::NoDarkFrame,
        frame_rate_hz: 0.0,
        stage: absent(stage),
        position_mm: None,
        moving: false,
        homed: false,
        laser: absent(LaserCapabilities { switched: true, power: None, interlock: false }),
        laser_lost_host: None,
        laser_light: LaserLight::Off,
        laser_power: 0.0,
        interlock_closed: None,
        job_id: None,
        faults: Vec::new(),
        frames_arrived: 0,
        frames_dropped: Vec::new(),
    }
}

fn absent<C>(capabilities: C) -> DeviceStatus<C> {
    let none = String::new;
    let identity =
        DeviceIdentity { driver: "none", vendor: none(), model: none(), serial: none(), firmware: none() };
    DeviceStatus { connected: false, identity, capabilities }
}
