//! Names of features: those of the Standard Features Naming Convention, and what cameras before it called them.

/// Exposure time, µs.
pub const EXPOSURE: [&str; 2] = ["ExposureTime", "ExposureTimeAbs"];
/// Gain: dB, or steps of the camera's own where it knows no others.
pub const GAIN: [&str; 2] = ["Gain", "GainRaw"];
/// Frame rate, Hz.
pub const FRAME_RATE: [&str; 2] = ["AcquisitionFrameRate", "AcquisitionFrameRateAbs"];
/// Whether the frame rate limits the camera.
pub const FRAME_RATE_ON: [&str; 2] = ["AcquisitionFrameRateEnable", "AcquisitionFrameRateEnabled"];
/// Columns of the whole sensor as it is binned.
pub const SENSOR_WIDTH: [&str; 2] = ["WidthMax", "SensorWidth"];
/// Rows of it.
pub const SENSOR_HEIGHT: [&str; 2] = ["HeightMax", "SensorHeight"];
/// From the hardware trigger to the exposure, µs.
pub const TRIGGER_DELAY: [&str; 2] = ["TriggerDelay", "TriggerDelayAbs"];
/// Temperature, °C.
pub const TEMPERATURE: [&str; 2] = ["DeviceTemperature", "TemperatureAbs"];
/// Version of the camera's firmware.
pub const FIRMWARE: [&str; 2] = ["DeviceFirmwareVersion", "DeviceVersion"];
/// What a camera may change by itself, all turned off: nothing but a request changes a picture.
pub const AUTOMATICS: [&str; 4] = ["ExposureAuto", "GainAuto", "BlackLevelAuto", "BalanceWhiteAuto"];
