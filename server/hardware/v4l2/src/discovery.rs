//! Cameras in the kernel's list of video devices, read from `/sys` without opening them.

use std::fs;
use std::path::{Path, PathBuf};

use devices::driver::Found;

/// Cameras below `root`, which is `/` except in tests: one entry each, with a stable name if there is one.
///
/// A USB camera has two device files; the second carries no images and is left out.
pub fn cameras(root: &Path) -> Vec<Found> {
    let nodes = entries(&root.join("sys/class/video4linux"));
    let is_first = |entry: &PathBuf| text(&entry.join("index")).is_none_or(|index| index == "0");
    nodes.into_iter().filter(is_first).filter_map(|entry| found(root, &entry)).collect()
}

fn found(root: &Path, entry: &Path) -> Option<Found> {
    let node = Path::new("/dev").join(entry.file_name()?);
    let names = entries(&root.join("dev/v4l/by-id"));
    let leads_here = |name: &&PathBuf| fs::read_link(name).is_ok_and(|to| to.file_name() == node.file_name());
    let by_id = names.iter().find(leads_here).and_then(|name| name.file_name());
    let value = by_id.map_or_else(|| node.clone(), |name| Path::new("/dev/v4l/by-id").join(name));
    // The interface of a USB camera is below its device, which has the manufacturer's name.
    let interface = fs::canonicalize(entry.join("device")).ok();
    let vendor = interface.and_then(|interface| text(&interface.parent()?.join("manufacturer")));
    Some(Found {
        vendor: vendor.unwrap_or_default(),
        model: text(&entry.join("name")).unwrap_or_default(),
        address: if by_id.is_some() { node.display().to_string() } else { String::new() },
        ..Found::by("device", value.display().to_string())
    })
}

/// Entries of a folder, sorted by name; empty if it does not exist.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let mut entries: Vec<PathBuf> =
        fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    entries.sort();
    entries
}

fn text(file: &Path) -> Option<String> {
    fs::read_to_string(file).ok().map(|text| text.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    /// A computer with one USB camera and one built-in camera, as listed by Linux 6.1.
    fn computer() -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        let class = root.path().join("sys/class/video4linux");
        let usb = root.path().join("sys/devices/usb1/1-2");
        fs::create_dir_all(usb.join("1-2:1.0")).unwrap();
        fs::write(usb.join("manufacturer"), "Acme Vision\n").unwrap();
        for (node, name, index) in [
            ("video0", "Line camera: Line camera", "0"),
            ("video1", "Line camera: Line camera", "1"),
            ("video2", "built in", "0"),
        ] {
            fs::create_dir_all(class.join(node)).unwrap();
            fs::write(class.join(node).join("name"), format!("{name}\n")).unwrap();
            fs::write(class.join(node).join("index"), format!("{index}\n")).unwrap();
        }
        for node in ["video0", "video1"] {
            symlink(usb.join("1-2:1.0"), class.join(node).join("device")).unwrap();
        }
        let by_id = root.path().join("dev/v4l/by-id");
        fs::create_dir_all(&by_id).unwrap();
        symlink("../../video0", by_id.join("usb-Acme_Vision_Line_camera_0001-video-index0")).unwrap();
        symlink("../../video1", by_id.join("usb-Acme_Vision_Line_camera_0001-video-index1")).unwrap();
        root
    }

    #[test]
    fn a_usb_camera_is_listed_once_by_its_stable_name() {
        let root = computer();
        let found = cameras(root.path());
        assert_eq!(found.len(), 2, "{found:?}");
        let usb = Found {
            vendor: "Acme Vision".to_owned(),
            model: "Line camera: Line camera".to_owned(),
            address: "/dev/video0".to_owned(),
            ..Found::by("device", "/dev/v4l/by-id/usb-Acme_Vision_Line_camera_0001-video-index0".to_owned())
        };
        assert_eq!(found[0], usb);
        assert_eq!((found[1].value.as_str(), found[1].address.as_str()), ("/dev/video2", ""));
    }

    #[test]
    fn a_computer_without_video_devices_has_no_camera() {
        assert_eq!(cameras(tempfile::tempdir().unwrap().path()), []);
    }
}
