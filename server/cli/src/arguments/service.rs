//! Arguments of the service commands.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

/// `sheaf openapi`.
#[derive(Debug, Args)]
pub struct OpenapiArgs {
    /// Print the event catalogue as Markdown instead.
    #[arg(long)]
    pub events: bool,
    /// Print the Modbus register map instead.
    #[arg(long, value_name = "FORMAT", conflicts_with = "events")]
    pub registers: Option<RegisterFormat>,
}

/// Format of the register map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum RegisterFormat {
    /// Markdown tables, for people.
    Markdown,
    /// One CSV table, for import into PLC software.
    Csv,
}

/// `sheaf serve`.
#[derive(Debug, Args)]
pub struct ServeArgs {
    /// Configuration.
    #[command(flatten)]
    pub settings: SettingsArgs,
}

/// `sheaf doctor`.
#[derive(Debug, Args)]
pub struct DoctorArgs {
    /// Move the stage and turn the laser on without asking: the area is clear and eyes are protected.
    #[arg(long)]
    pub yes: bool,
    /// Exposure time, µs; default: the current camera setting.
    #[arg(long, value_name = "US")]
    pub exposure_us: Option<f64>,
    /// Gain, dB; default: the current camera setting.
    #[arg(long, value_name = "DB")]
    pub gain_db: Option<f64>,
    /// Frames per second; default: the current camera setting.
    #[arg(long, value_name = "HZ")]
    pub frame_rate_hz: Option<f64>,
    /// Laser power as a fraction of full power, above 0 to 1.
    #[arg(long, value_name = "FRACTION", default_value_t = 1.0, value_parser = power)]
    pub power: f64,
    /// Configuration; the board under `[target]` is used to check the scale of the stage.
    #[command(flatten)]
    pub settings: SettingsArgs,
}

fn power(text: &str) -> Result<f64, &'static str> {
    let fraction = text.parse().ok().filter(|fraction: &f64| *fraction > 0.0 && *fraction <= 1.0);
    fraction.ok_or("give a fraction of full power above 0 and up to 1")
}

/// Configuration options of the command line; they override environment (SHEAF_…) and file.
#[derive(Debug, Clone, Default, Args)]
pub struct SettingsArgs {
    /// Address and port; port 0 selects a free port.
    #[arg(long, value_name = "ADDRESS:PORT")]
    pub listen: Option<String>,
    /// Data directory.
    #[arg(long, value_name = "DIR")]
    pub data: Option<PathBuf>,
    /// Configuration file; default: DIR/sheaf.toml, if it exists.
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Any other setting, such as station.twin.scene=gauge; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}
