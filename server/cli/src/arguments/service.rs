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
