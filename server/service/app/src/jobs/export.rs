//! Export of a scan's cloud or mesh to another format, once: a repeated request returns the stored file.

use crate::events::{Event, ScanExported, event};
use std::collections::HashSet;
use std::fs::File;
use std::io::{BufReader, BufWriter, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use scanning::files::{ContentError, convert_cloud, read_cloud_from, write_mesh_to};
use scanning::{CloudFormat, Mesh, MeshFormat, MeshParams, mesh_from_cloud};
use store::{ArtifactBytes, ArtifactId, Artifacts, FinishedFile, ResultRef, ScanRecord, StoreError};

use crate::error::disk_problem;
use crate::error::{AppError, ErrorKind};
use crate::jobs::progress::Phase;
use crate::jobs::{ComputeContext, Done, ExportInput, JobEnd};
use crate::resources::stored_scan::{stored_cloud_bytes, without_cloud};

/// Folder of the workbench with the index of exports; may be deleted at any time. No record refers to these artifacts:
/// each sweep asks [`remembered_of`].
const CACHE: &str = "cache/exports";

/// One export is computed at a time: a mesh holds a whole cloud in memory.
static TURN: tokio::sync::Mutex<()> = tokio::sync::Mutex::const_new(());

/// The result kind of exports: `<scan id>/<what>.<format>`.
const EXPORT: &str = "export";

/// What to write.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExportFormat {
    /// The points.
    Cloud(CloudFormat),
    /// The mesh.
    Mesh(MeshFormat),
}

impl ExportFormat {
    /// `what` is `cloud` or `mesh`, `format` one of its file formats.
    ///
    /// # Errors
    /// A problem that lists the allowed values.
    pub fn parse(what: &str, format: &str) -> Result<Self, AppError> {
        let unknown = |field: &str, given: &str, known: String| {
            AppError::new(ErrorKind::Impossible, format!("unknown {field} \"{given}\""))
                .at(format!("/{field}"))
                .remedy(format!("use one of {known}"))
        };
        match what {
            "cloud" => {
                CloudFormat::ALL.into_iter().find(|known| known.extension() == format).map(Self::Cloud).ok_or_else(
                    || unknown("format", format, CloudFormat::ALL.map(CloudFormat::extension).join(", ")),
                )
            }
            "mesh" => {
                MeshFormat::ALL.into_iter().find(|known| known.extension() == format).map(Self::Mesh).ok_or_else(
                    || unknown("format", format, MeshFormat::ALL.map(MeshFormat::extension).join(", ")),
                )
            }
            _ => Err(unknown("what", what, "cloud, mesh".to_owned())),
        }
    }

    /// The file name extension, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Cloud(format) => format.extension(),
            Self::Mesh(format) => format.extension(),
        }
    }

    /// `cloud` or `mesh`.
    pub fn what(self) -> &'static str {
        match self {
            Self::Cloud(_) => "cloud",
            Self::Mesh(_) => "mesh",
        }
    }

    /// The media type of the bytes.
    pub fn media_type(self) -> &'static str {
        match self {
            Self::Cloud(CloudFormat::Csv) => "text/csv; charset=utf-8",
            Self::Cloud(CloudFormat::E57) => "model/e57",
            Self::Mesh(MeshFormat::Stl) => "model/stl",
            Self::Mesh(MeshFormat::Glb) => "model/gltf-binary",
            Self::Cloud(CloudFormat::Ply | CloudFormat::Pcd) | Self::Mesh(MeshFormat::Ply) => {
                "application/octet-stream"
            }
        }
    }
}

/// Exports.
pub fn run(input: ExportInput, ctx: &ComputeContext) -> Result<Done, JobEnd> {
    let format = ExportFormat::parse(&input.what, &input.format)?;
    let scan = ctx.wait(ctx.catalogue.read().scan(&input.scan_id))?;
    let words = format!("writing the {} as {}", format.what(), format.extension());
    ctx.report(0.0, Phase::Exporting, &words);
    ctx.wait(bytes_to_artifact(&ctx.artifacts, &scan, format))?;
    ctx.check_cancelled()?;
    let body = ScanExported {
        scan_id: scan.id.clone(),
        what: format.what().to_owned(),
        format: format.extension().to_owned(),
    };
    Ok(Done {
        result: ResultRef { kind: EXPORT.to_owned(), id: format!("{}/{}", scan.id, file_name(format)) },
        message: format!("{} of {} as {}", format.what(), scan.name, format.extension()),
        changes: vec![event(&scan.id, Event::ScanExported(body))],
        finished_work: None,
    })
}

fn file_name(format: ExportFormat) -> String {
    format!("{}.{}", format.what(), format.extension())
}

/// The artifact with a scan's cloud or mesh in this format; computed if missing.
///
/// # Errors
/// A problem: no cloud, a damaged cloud, a full disk, or a format that cannot represent it.
pub async fn bytes_to_artifact(
    artifacts: &Arc<dyn Artifacts>,
    scan: &ScanRecord,
    format: ExportFormat,
) -> Result<ArtifactId, AppError> {
    let Some(cloud_id) = &scan.cloud else { return Err(without_cloud(scan)) };
    if format == ExportFormat::Cloud(CloudFormat::Ply) {
        return Ok(cloud_id.clone());
    }
    let note = remembered(&**artifacts, cloud_id, format);
    if let Some(id) = known(&**artifacts, &note).await? {
        return Ok(id);
    }
    let _turn = TURN.lock().await;
    // Another request may have computed it while this one waited.
    if let Some(id) = known(&**artifacts, &note).await? {
        return Ok(id);
    }
    let cloud = stored_cloud_bytes(&**artifacts, scan).await?;
    let place = tempfile::tempdir_in(artifacts.workbench().scratch()).map_err(disk_problem)?;
    let file = place.path().join(file_name(format));
    let target = file.clone();
    let written = tokio::task::spawn_blocking(move || write(&cloud, format, &target)).await;
    written.map_err(|error| {
        AppError::new(ErrorKind::Internal, "the export was not completed").because(error.to_string())
    })??;
    let id = artifacts.adopt(FinishedFile::at(&file)).await?;
    match remember(&note, &id) {
        Ok(()) => artifacts.release(&id),
        // The next request computes it again; nothing else depends on the index.
        Err(cause) => tracing::warn!(%cause, "cannot store the record of an export"),
    }
    Ok(id)
}

/// Converts points as a stream; a mesh needs all of them in memory, freed before it is written.
fn write(cloud: &ArtifactBytes, format: ExportFormat, target: &Path) -> Result<(), AppError> {
    let options = File::options().read(true).write(true).create_new(true).open(target);
    let mut out = options.map_err(disk_problem)?;
    match format {
        ExportFormat::Cloud(format) => {
            convert_cloud(|| Ok(from_start(cloud)), format, &mut out).map_err(disk_problem)
        }
        ExportFormat::Mesh(format) => {
            let mesh = mesh_of(cloud).map_err(disk_problem)?;
            let mut out = BufWriter::new(out);
            write_mesh_to(&mut out, format, &mesh).map_err(disk_problem)?;
            out.flush().map_err(disk_problem)
        }
    }
}

fn mesh_of(cloud: &ArtifactBytes) -> Result<Mesh, ContentError> {
    let cloud = read_cloud_from(&mut from_start(cloud), CloudFormat::Ply)?;
    Ok(mesh_from_cloud(&cloud, &MeshParams::default()))
}

fn from_start(cloud: &ArtifactBytes) -> BufReader<ArtifactBytes> {
    BufReader::new(cloud.from_start())
}

/// The artifacts recorded as exports of the clouds in `named`; records of other exports are deleted.
pub fn remembered_of(artifacts: &dyn Artifacts, named: &HashSet<ArtifactId>) -> HashSet<ArtifactId> {
    let Ok(notes) = std::fs::read_dir(folder(artifacts)) else { return HashSet::new() };
    let mut kept = HashSet::new();
    for note in notes.flatten().map(|entry| entry.path()) {
        let name = note.file_name().unwrap_or_default().to_string_lossy();
        let cloud = name.split('-').next().and_then(ArtifactId::parse);
        if cloud.is_some_and(|cloud| named.contains(&cloud)) {
            kept.extend(read_note(&note));
        } else if let Err(cause) = std::fs::remove_file(&note) {
            tracing::warn!(%cause, "cannot delete the record of an export");
        }
    }
    kept
}

/// Index file of the artifact for this export of this cloud.
fn remembered(artifacts: &dyn Artifacts, cloud: &ArtifactId, format: ExportFormat) -> PathBuf {
    folder(artifacts).join(format!("{}-{}", cloud.as_str(), file_name(format)))
}

fn folder(artifacts: &dyn Artifacts) -> PathBuf {
    artifacts.workbench().kept(CACHE)
}

fn read_note(note: &Path) -> Option<ArtifactId> {
    std::fs::read_to_string(note).ok().and_then(|text| ArtifactId::parse(text.trim()))
}

async fn known(artifacts: &dyn Artifacts, note: &Path) -> Result<Option<ArtifactId>, AppError> {
    let Some(id) = read_note(note) else { return Ok(None) };
    match artifacts.open(&id).await {
        Ok(_) => Ok(Some(id)),
        Err(StoreError::NotFound { .. }) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

fn remember(note: &Path, id: &ArtifactId) -> std::io::Result<()> {
    if let Some(folder) = note.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let draft = note.with_extension(format!("{}.part", crate::resources::stored_scan::new_id()));
    std::fs::write(&draft, id.as_str())?;
    std::fs::rename(&draft, note)
}
