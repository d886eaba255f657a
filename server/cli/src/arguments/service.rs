//! The service: its settings and its document.

use std::path::PathBuf;

use clap::Args;

/// `sheaf openapi`.
#[derive(Debug, Args)]
pub struct OpenapiArgs {
    /// The catalogue of events instead, as Markdown.
    #[arg(long)]
    pub events: bool,
}

/// `sheaf serve`.
#[derive(Debug, Args)]
pub struct ServeArgs {
    /// How it is set up.
    #[command(flatten)]
    pub settings: SettingsArgs,
}

/// `sheaf doctor`.
#[derive(Debug, Args)]
pub struct DoctorArgs {
    /// Move and turn the laser on without asking: the area is clear, and eyes are safe.
    #[arg(long)]
    pub yes: bool,
    /// Exposure, µs; as the camera is set if not given.
    #[arg(long, value_name = "US")]
    pub exposure_us: Option<f64>,
    /// Gain, dB; as the camera is set if not given.
    #[arg(long, value_name = "DB")]
    pub gain_db: Option<f64>,
    /// Frames per second; as the camera is set if not given.
    #[arg(long, value_name = "HZ")]
    pub frame_rate_hz: Option<f64>,
    /// Share of full laser power, above 0 to 1.
    #[arg(long, value_name = "SHARE", default_value_t = 1.0, value_parser = power)]
    pub power: f64,
    /// How the station is set up; the board under `[target]` is that of the stage's scale.
    #[command(flatten)]
    pub settings: SettingsArgs,
}

fn power(text: &str) -> Result<f64, &'static str> {
    let share = text.parse().ok().filter(|share: &f64| *share > 0.0 && *share <= 1.0);
    share.ok_or("write a share of full power above 0 and up to 1")
}

/// What the command line says about the configuration; it wins over environment (SHEAF_…) and file.
#[derive(Debug, Clone, Default, Args)]
pub struct SettingsArgs {
    /// Address and port; port 0 takes a free one.
    #[arg(long, value_name = "ADDRESS:PORT")]
    pub listen: Option<String>,
    /// Folder of everything that is kept.
    #[arg(long, value_name = "DIR")]
    pub data: Option<PathBuf>,
    /// Configuration file; by default DIR/sheaf.toml, if it is there.
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Any other setting, such as station.twin.scene=gauge; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}
