//! Names of features: those of the Standard Features Naming Convention, and their older names.

/// Exposure time, µs.
pub const EXPOSURE: [&str; 2] = ["ExposureTime", "ExposureTimeAbs"];
/// Gain: in dB, or in the camera's own units if it has no other.
pub const GAIN: [&str; 2] = ["Gain", "GainRaw"];
/// Frame rate, Hz.
pub const FRAME_RATE: [&str; 2] = ["AcquisitionFrameRate", "AcquisitionFrameRateAbs"];
/// Whether the frame rate limits the camera.
pub const FRAME_RATE_ON: [&str; 2] = ["AcquisitionFrameRateEnable", "AcquisitionFrameRateEnabled"];
/// Columns of the whole sensor after binning.
pub const SENSOR_WIDTH: [&str; 2] = ["WidthMax", "SensorWidth"];
/// Rows of it.
pub const SENSOR_HEIGHT: [&str; 2] = ["HeightMax", "SensorHeight"];
/// Delay from the hardware trigger to the exposure, µs.
pub const TRIGGER_DELAY: [&str; 2] = ["TriggerDelay", "TriggerDelayAbs"];
/// Temperature, °C.
pub const TEMPERATURE: [&str; 2] = ["DeviceTemperature", "TemperatureAbs"];
/// Version of the camera's firmware.
pub const FIRMWARE: [&str; 2] = ["DeviceFirmwareVersion", "DeviceVersion"];
/// Automatic functions, all turned off, so that images change only on request.
pub const AUTOMATIC_FUNCTIONS: [&str; 4] = ["ExposureAuto", "GainAuto", "BlackLevelAuto", "BalanceWhiteAuto"];
