//! The driver's entry in the table.

use devices::driver::{DeviceSet, Driver, Found, MissingSetting, OpenError, Opened};

use crate::settings::GenicamSettings;

/// Creates the configured camera.
#[derive(Debug, Clone)]
pub struct GenicamDriver(pub GenicamSettings);

impl Driver for GenicamDriver {
    fn kind(&self) -> &'static str {
        "genicam"
    }

    fn makes(&self) -> DeviceSet {
        DeviceSet { camera: true, stage: false, laser: true }
    }

    fn binds_laser_to_camera(&self) -> bool {
        true
    }

    fn missing(&self) -> Option<MissingSetting> {
        let expected = "the serial number of the camera";
        self.0.serial.is_empty().then_some(MissingSetting { name: "serial", expected })
    }

    #[cfg(feature = "aravis")]
    fn open(&self, wanted: DeviceSet) -> Result<Opened, OpenError> {
        let settings =
            |what: &str, remedy: &str| OpenError::Settings { what: what.to_owned(), remedy: remedy.to_owned() };
        if !wanted.camera {
            let what = "a laser on the line of a camera that the station has not";
            return Err(settings(what, "set station.camera.kind to genicam, too"));
        }
        if wanted.laser && self.0.laser_line.is_empty() {
            let what = "the line that switches the laser is not named";
            return Err(settings(what, "set station.genicam.laser_line, such as Line2"));
        }
        let camera = crate::GenicamCamera::open(&self.0)?;
        let laser = wanted.laser.then(|| Box::new(camera.laser()) as Box<dyn devices::Laser>);
        let camera = Some(Box::new(devices::ThreadedCamera::over(camera)) as Box<dyn devices::Camera>);
        Ok(Opened { camera, laser, ..Opened::default() })
    }

    #[cfg(not(feature = "aravis"))]
    fn open(&self, _wanted: DeviceSet) -> Result<Opened, OpenError> {
        Err(OpenError::Settings {
            what: "this program was built without GenICam cameras".to_owned(),
            remedy: "use one built with the feature genicam, as the container image is".to_owned(),
        })
    }

    /// Cameras that answer, with their users.
    #[cfg(feature = "aravis")]
    fn discover(&self) -> Vec<Found> {
        use crate::gvcp::{Control, PROTOCOL, control};
        let found = crate::aravis::list().into_iter().map(|camera| {
            let answer = (camera.protocol == PROTOCOL).then(|| control(&camera.address)).flatten();
            let in_use_by = match answer {
                Some(Control::Held(Some(holder))) => Some(holder.to_string()),
                Some(Control::Held(None)) => Some("another program".to_owned()),
                Some(Control::Free) | None => None,
            };
            Found {
                vendor: camera.vendor,
                model: camera.model,
                address: camera.address,
                in_use_by,
                ..Found::by("serial", camera.serial)
            }
        });
        found.collect()
    }

    #[cfg(not(feature = "aravis"))]
    fn discover(&self) -> Vec<Found> {
        Vec::new()
    }
}
