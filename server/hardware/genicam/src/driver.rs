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
    fn open(&self, requested: DeviceSet) -> Result<Opened, OpenError> {
        let settings =
            |what: &str, remedy: &str| OpenError::Settings { what: what.to_owned(), remedy: remedy.to_owned() };
        if !requested.camera {
            let what = "the laser is an output line of a camera that the station does not have";
            return Err(settings(what, "set station.camera.kind to genicam, too"));
        }
        if requested.laser && self.0.laser_line.is_empty() {
            let what = "no output line is configured for the laser";
            return Err(settings(what, "set station.genicam.laser_line, such as Line2"));
        }
        let camera = crate::GenicamCamera::open(&self.0)?;
        let laser = requested.laser.then(|| Box::new(camera.laser()) as Box<dyn devices::Laser>);
        let camera = Some(Box::new(devices::ThreadedCamera::over(camera)) as Box<dyn devices::Camera>);
        Ok(Opened { camera, laser, ..Opened::default() })
    }

    #[cfg(not(feature = "aravis"))]
    fn open(&self, _requested: DeviceSet) -> Result<Opened, OpenError> {
        Err(OpenError::Settings {
            what: "this program was built without GenICam cameras".to_owned(),
            remedy: "use one built with the feature genicam, as the container image is".to_owned(),
        })
    }

    /// Cameras that respond, with the programs that control them.
    #[cfg(feature = "aravis")]
    fn discover(&self) -> Vec<Found> {
        use crate::gvcp::{Control, PROTOCOL, control};
        let found = crate::aravis::list().into_iter().map(|camera| {
            let control_state = (camera.protocol == PROTOCOL).then(|| control(&camera.address)).flatten();
            let in_use_by = match control_state {
                Some(Control::Held(Some(controller))) => Some(controller.to_string()),
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
