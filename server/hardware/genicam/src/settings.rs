//! `[station.genicam]`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[station.genicam]`: a GigE Vision or USB3 Vision camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GenicamSettings {
    /// serial number of the camera, as `sheaf devices` lists it
    pub serial: String,
    /// pixel format for 8 bits, by its GenICam name; empty: the best it has
    pub format_8: String,
    /// pixel format for more bits, by its GenICam name; empty: the best it has
    pub format_16: String,
    /// colour used of a colour (Bayer) sensor, that of the laser
    #[schemars(with = "String", extend("enum" = ["green", "red", "blue"]))]
    pub sensor_colour: SensorColour,
    /// pixels of the sensor that are read as one, in both directions; 1: none
    #[schemars(range(min = 1, max = 16))]
    pub binning: u32,
    /// input of the hardware trigger, by its GenICam name; empty: the first
    pub trigger_line: String,
    /// edge of the hardware trigger
    #[schemars(with = "String", extend("enum" = ["rising", "falling", "any"]))]
    pub trigger_edge: TriggerEdge,
    /// time from the hardware trigger to the exposure, µs
    #[schemars(range(min = 0.0, max = 1e6))]
    pub trigger_delay_us: f64,
    /// output line that switches the laser, by its GenICam name, for station.laser.kind = "genicam"
    pub laser_line: String,
    /// source of that line while the laser is on: ExposureActive, or a user output such as UserOutput1
    pub laser_source: String,
    /// whether the laser is on while the line is low
    pub laser_inverted: bool,
    /// event marked by the camera's time stamps
    #[schemars(with = "String", extend("enum" = ["exposure_start", "exposure_end"]))]
    pub timestamp: Timestamp,
    /// size of GigE packets, bytes; 0: the largest that arrives
    #[schemars(range(min = 0, max = 16_000))]
    pub packet_size_bytes: u32,
    /// request a resend of missing packets
    pub packet_resend: bool,
    /// number of frame buffers
    #[schemars(range(min = 4, max = 256))]
    pub buffers: usize,
}

/// Which pixels of a Bayer sensor are used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SensorColour {
    /// Every second one.
    #[default]
    Green,
    /// Every fourth one.
    Red,
    /// Every fourth one.
    Blue,
}

impl SensorColour {
    /// Its word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Green => "green",
            Self::Red => "red",
            Self::Blue => "blue",
        }
    }
}

/// Which edge triggers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TriggerEdge {
    /// The voltage rises.
    #[default]
    Rising,
    /// The voltage falls.
    Falling,
    /// Either.
    Any,
}

impl TriggerEdge {
    /// Its GenICam name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rising => "RisingEdge",
            Self::Falling => "FallingEdge",
            Self::Any => "AnyEdge",
        }
    }
}

/// The event marked by a camera's time stamp, according to its manual.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Timestamp {
    /// The exposure begins.
    #[default]
    ExposureStart,
    /// The exposure ends, or the image is read out.
    ExposureEnd,
}

impl Default for GenicamSettings {
    /// Format and packet size are negotiated with the camera; its serial number must be configured.
    fn default() -> Self {
        Self {
            serial: String::new(),
            format_8: String::new(),
            format_16: String::new(),
            sensor_colour: SensorColour::default(),
            binning: 1,
            trigger_line: String::new(),
            trigger_edge: TriggerEdge::default(),
            trigger_delay_us: 0.0,
            laser_line: String::new(),
            laser_source: "ExposureActive".to_owned(),
            laser_inverted: false,
            timestamp: Timestamp::default(),
            packet_size_bytes: 0,
            packet_resend: true,
            buffers: 16,
        }
    }
}
