//! The settings of the door. Doc comments are the descriptions that users read.

use std::path::{Component, Path, PathBuf};

use app::doors::BadSetting;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A door that writes a file for every inspection, and starts inspections from files.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// name of the door, unique
    pub name: String,
    /// folder for the results, an absolute path; it is never created. Give a folder below the mount point of a share: it
    /// does not exist while the share is not mounted, so that nothing is written to the local disk instead
    pub path: PathBuf,
    /// formats of the results: json, csv, dfq (Q-DAS), pdf (the report)
    #[serde(default = "default_formats")]
    #[schemars(length(min = 1))]
    pub formats: Vec<Format>,
    /// name of the files without extension; placeholders: {serial}, {seq}, {recipe}, {version}, {verdict}, {order}, {date},
    /// {time}
    #[serde(default = "default_file_name")]
    pub file_name: String,
    /// recipes whose results are written; all if empty
    #[serde(default)]
    pub recipes: Vec<String>,
    /// folder watched for orders, *.json and *.csv, an absolute path; accepted files are moved to accepted/ in it, others
    /// to refused/; without it no orders are read
    #[serde(default)]
    pub orders: Option<PathBuf>,
}

/// A format of the results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Format {
    /// the message that all doors send
    Json,
    /// a table with one row per characteristic
    Csv,
    /// Q-DAS ASCII transfer format
    Dfq,
    /// the report, with pictures of the cloud
    Pdf,
}

fn default_formats() -> Vec<Format> {
    vec![Format::Json, Format::Csv]
}

fn default_file_name() -> String {
    "{serial}_{seq}".to_owned()
}

impl Settings {
    /// Checks what the schema cannot; the template is checked where it is parsed.
    pub(crate) fn check(&self) -> Result<(), BadSetting> {
        let bad = |setting, why: &str| Err(BadSetting { setting, why: why.to_owned() });
        if self.name.trim().is_empty() {
            return bad("name", "give the door a name");
        }
        if self.formats.is_empty() {
            return bad("formats", "give at least one of json, csv, dfq, pdf");
        }
        if (1..self.formats.len()).any(|idx| self.formats[..idx].contains(&self.formats[idx])) {
            return bad("formats", "give each format once");
        }
        is_plain(&self.path).or_else(|why| bad("path", why))?;
        let Some(orders) = &self.orders else { return Ok(()) };
        is_plain(orders).or_else(|why| bad("orders", why))?;
        if same_folder(orders, &self.path) {
            return bad("orders", "orders and results need different folders: results would be read as orders");
        }
        Ok(())
    }
}

/// The same folder whatever the working directory is.
fn is_plain(path: &Path) -> Result<(), &'static str> {
    if !path.is_absolute() {
        return Err("give an absolute path, such as /mnt/mes/results");
    }
    match path.components().any(|part| part == Component::ParentDir) {
        true => Err("give a path without .."),
        false => Ok(()),
    }
}

/// Whether two absolute paths name the same folder, also by a link if both exist.
fn same_folder(one: &Path, other: &Path) -> bool {
    let real = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    one.components().eq(other.components()) || real(one) == real(other)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn settings(path: &str, orders: Option<&str>) -> Settings {
        serde_json::from_value(json!({ "name": "mes", "path": path, "orders": orders })).unwrap()
    }

    #[test]
    fn only_name_and_path_are_needed() {
        let settings: Settings = serde_json::from_value(json!({ "name": "mes", "path": "/mnt/mes" })).unwrap();
        assert_eq!(settings.formats, [Format::Json, Format::Csv]);
        assert_eq!((settings.file_name.as_str(), &settings.orders), ("{serial}_{seq}", &None));
        settings.check().unwrap();
        let misspelt = json!({ "name": "mes", "path": "/mnt/mes", "format": ["csv"] });
        assert!(serde_json::from_value::<Settings>(misspelt).unwrap_err().to_string().contains("format"));
    }

    #[test]
    fn what_cannot_work_is_refused_by_name() {
        let check = |settings: Settings| settings.check().map_err(|bad| bad.setting).unwrap_err();
        assert_eq!(check(settings("mnt/mes", None)), "path");
        assert_eq!(check(settings("/mnt/../mes", None)), "path");
        assert_eq!(check(settings("/mnt/mes", Some("orders"))), "orders");
        assert_eq!(check(settings("/mnt/mes", Some("/mnt/mes"))), "orders");
        assert_eq!(check(settings("/mnt/mes", Some("/mnt/./mes/"))), "orders");
        assert_eq!(check(Settings { formats: vec![], ..settings("/mnt/mes", None) }), "formats");
        let doubled = vec![Format::Csv, Format::Csv];
        assert_eq!(check(Settings { formats: doubled, ..settings("/mnt/mes", None) }), "formats");
        settings("/mnt/mes", Some("/mnt/mes/orders")).check().unwrap();
    }

    #[test]
    fn a_link_to_the_folder_of_results_is_no_folder_for_orders() {
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real"), folder.path().join("link"));
        std::fs::create_dir(&real).unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        let bad = settings(real.to_str().unwrap(), link.to_str()).check().unwrap_err();
        assert_eq!(bad.setting, "orders");
    }
}
