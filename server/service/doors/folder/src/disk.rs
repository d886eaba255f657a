//! Files that appear whole: the operations, and what their failures mean to a user. Tests inject failures here.

use std::fmt::Write as _;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Beginning and end of the names of files in progress. Names of results and orders never begin with a dot.
const IN_PROGRESS: (&str, &str) = (".", ".sheaf.tmp");

/// The operations that make a file durable. The default methods use the real disk; a test overrides those that should
/// fail.
pub trait Disk: Send + Sync + 'static {
    /// Adds bytes to a file.
    fn write(&self, file: &mut File, bytes: &[u8]) -> io::Result<()> {
        file.write_all(bytes)
    }

    /// Makes the bytes of a file durable.
    fn sync_file(&self, file: &File) -> io::Result<()> {
        file.sync_all()
    }

    /// Renames a file unless the new name exists.
    fn rename_new(&self, from: &Path, to: &Path) -> io::Result<()> {
        rename_new(from, to)
    }

    /// Makes the entries of a folder durable.
    fn sync_folder(&self, folder: &Path) -> io::Result<()> {
        match File::open(folder)?.sync_all() {
            // SMB clients cannot sync a folder: the server does so when it closes a file.
            Err(error) if matches!(error.kind(), ErrorKind::InvalidInput | ErrorKind::Unsupported) => Ok(()),
            synced => synced,
        }
    }
}

/// The disk of this machine, and what is mounted on it.
#[derive(Debug, Clone, Copy, Default)]
pub struct LocalDisk;

impl Disk for LocalDisk {}

/// A failed operation; displayed with everything a user needs.
#[derive(Debug, thiserror::Error)]
#[error("{}", self.sentence())]
pub struct DiskError {
    /// The folder.
    folder: PathBuf,
    /// What was attempted.
    doing: String,
    /// Whether the folder itself is gone.
    is_missing: bool,
    /// Why it failed. Part of the sentence, since users see no chain of causes.
    pub cause: io::Error,
}

impl DiskError {
    /// An error of an operation in this folder.
    pub fn at(folder: &Path, doing: impl Into<String>) -> impl FnOnce(io::Error) -> Self {
        let (folder, doing) = (folder.to_owned(), doing.into());
        move |cause: io::Error| {
            let is_missing = cause.kind() == ErrorKind::NotFound && !folder.is_dir();
            Self { folder, doing, is_missing, cause }
        }
    }

    /// Whether the file system cannot hold a file of this name, however often it is tried.
    pub fn is_about_the_name(&self) -> bool {
        self.cause.kind() == ErrorKind::InvalidFilename
    }

    fn sentence(&self) -> String {
        let Self { folder, doing, cause, .. } = self;
        let folder = folder.display();
        match cause.kind() {
            _ if self.is_missing => {
                format!("the folder {folder} does not exist: is the share mounted? It is never created")
            }
            ErrorKind::NotADirectory => format!("{folder} is not a folder"),
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
                format!("cannot {doing}: the disk or the quota of the folder {folder} is full")
            }
            ErrorKind::ReadOnlyFilesystem => format!("cannot {doing}: the folder {folder} is read-only"),
            ErrorKind::PermissionDenied => {
                format!("cannot {doing}: the server has no permission in the folder {folder}")
            }
            _ => format!("cannot {doing} in the folder {folder}: {cause}"),
        }
    }
}

/// Whether a name is that of a file in progress.
pub fn is_in_progress(name: &str) -> bool {
    name.starts_with(IN_PROGRESS.0) && name.ends_with(IN_PROGRESS.1)
}

/// The folder must exist: a missing mount point is not created.
///
/// # Errors
/// It does not exist, or is not a folder.
pub fn check_folder(folder: &Path) -> Result<(), DiskError> {
    let is_folder = match fs::metadata(folder) {
        Ok(metadata) if metadata.is_dir() => Ok(()),
        Ok(_) => Err(ErrorKind::NotADirectory.into()),
        Err(cause) => Err(cause),
    };
    is_folder.map_err(DiskError::at(folder, "read"))
}

/// Writes a file durably under a temporary name and returns its path. A file of that name is one that was abandoned.
///
/// # Errors
/// If it cannot be written; then nothing is left.
pub fn write_beside(disk: &dyn Disk, folder: &Path, name: &str, bytes: &[u8]) -> Result<PathBuf, DiskError> {
    let beside = folder.join(format!("{}{name}{}", IN_PROGRESS.0, IN_PROGRESS.1));
    let written = || {
        remove_if_there(&beside)?;
        // A new file: a link of that name is not followed.
        let mut file = OpenOptions::new().write(true).create_new(true).open(&beside)?;
        disk.write(&mut file, bytes)?;
        disk.sync_file(&file)
    };
    if let Err(cause) = written() {
        // Best effort: the next start removes it.
        let _ = fs::remove_file(&beside);
        return Err(DiskError::at(folder, format!("write {name}"))(cause));
    }
    Ok(beside)
}

/// Whether files can be created in a folder and removed from it.
///
/// # Errors
/// They cannot.
pub fn probe(disk: &dyn Disk, folder: &Path) -> Result<(), DiskError> {
    check_folder(folder)?;
    let probe = write_beside(disk, folder, "test", b"test\n")?;
    fs::remove_file(probe).map_err(DiskError::at(folder, "remove a test file"))
}

/// Removes files in progress that a crash left behind. Another server that writes one just now to the same folder
/// repeats it.
///
/// # Errors
/// The folder cannot be read, or a file not be removed.
pub fn remove_abandoned(folder: &Path) -> Result<(), DiskError> {
    let removed = || {
        for entry in fs::read_dir(folder)? {
            let entry = entry?;
            if entry.file_name().to_str().is_some_and(is_in_progress) {
                remove_if_there(&entry.path())?;
            }
        }
        Ok(())
    };
    removed().map_err(DiskError::at(folder, "remove abandoned files"))
}

fn remove_if_there(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        removed => removed,
    }
}

/// The name of the `n`-th file of this name: `S1.csv`, `S1-2.csv`, …
pub fn numbered(stem: &str, extension: &str, n: usize) -> String {
    let mut name = stem.to_owned();
    if n > 1 {
        // Writing to a string cannot fail.
        let _ = write!(name, "-{n}");
    }
    if !extension.is_empty() {
        let _ = write!(name, ".{extension}");
    }
    name
}

#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn rename_new(from: &Path, to: &Path) -> io::Result<()> {
    use nix::errno::Errno;
    use nix::fcntl::{AT_FDCWD, RenameFlags, renameat2};

    match renameat2(AT_FDCWD, from, AT_FDCWD, to, RenameFlags::RENAME_NOREPLACE) {
        // NFS and older file systems.
        Err(Errno::EINVAL | Errno::ENOSYS | Errno::ENOTSUP) => rename_checked(from, to),
        renamed => Ok(renamed?),
    }
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn rename_new(from: &Path, to: &Path) -> io::Result<()> {
    rename_checked(from, to)
}

/// Where the file system cannot refuse an existing name itself. Another writer of the same name could come in between;
/// ours carry the number of the inspection.
fn rename_checked(from: &Path, to: &Path) -> io::Result<()> {
    match fs::symlink_metadata(to) {
        Ok(_) => Err(ErrorKind::AlreadyExists.into()),
        Err(error) if error.kind() == ErrorKind::NotFound => fs::rename(from, to),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neither_way_of_renaming_replaces_a_file() {
        for rename in [rename_new, rename_checked] {
            let folder = tempfile::tempdir().unwrap();
            let [from, to] = ["from", "to"].map(|name| folder.path().join(name));
            fs::write(&from, "new").unwrap();
            fs::write(&to, "old").unwrap();
            assert_eq!(rename(&from, &to).unwrap_err().kind(), ErrorKind::AlreadyExists);
            assert_eq!(fs::read_to_string(&to).unwrap(), "old");
            fs::remove_file(&to).unwrap();
            rename(&from, &to).unwrap();
            assert_eq!(fs::read_to_string(&to).unwrap(), "new");
        }
    }

    #[test]
    fn a_link_with_a_temporary_name_is_replaced_and_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let outside = folder.path().join("outside");
        fs::write(&outside, "precious").unwrap();
        let share = folder.path().join("share");
        fs::create_dir(&share).unwrap();
        std::os::unix::fs::symlink(&outside, share.join(".a.csv.sheaf.tmp")).unwrap();
        write_beside(&LocalDisk, &share, "a.csv", b"new").unwrap();
        assert_eq!(fs::read_to_string(&outside).unwrap(), "precious");
    }

    #[test]
    fn every_failure_says_what_the_user_can_do() {
        let said = |errno: nix::errno::Errno| {
            let error = DiskError::at(Path::new("/"), "write S1.csv")(errno.into());
            error.to_string()
        };
        assert!(said(nix::errno::Errno::ENOSPC).contains("full"));
        assert!(said(nix::errno::Errno::EDQUOT).contains("full"));
        assert!(said(nix::errno::Errno::EROFS).contains("read-only"));
        assert!(said(nix::errno::Errno::EACCES).contains("permission"));
        assert!(said(nix::errno::Errno::EHOSTDOWN).contains("write S1.csv in the folder /"));
        let missing = check_folder(Path::new("/nowhere/at/all")).unwrap_err().to_string();
        assert!(missing.contains("is the share mounted?"), "{missing}");
    }
}
