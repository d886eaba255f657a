//! The driver's row.

use devices::driver::{DeviceSet, Driver, Found, MissingSetting, OpenError, Opened};

use crate::settings::GenicamSettings;

/// Makes the camera that the settings name.
#[derive(Debug, Clone)]
pub struct GenicamDriver(pub GenicamSettings);

impl Driver for GenicamDriver {
    fn kind(&self) -> &'static str {
        "genicam"
    }

    fn makes(&self) -> DeviceSet {
        DeviceSet { camera: true, ..DeviceSet::default() }
    }

    fn missing(&self) -> Option<MissingSetting> {
        let expected = "the serial number of the camera";
        self.0.serial.is_empty().then_some(MissingSetting { name: "serial", expected })
    }

    #[cfg(feature = "aravis")]
    fn open(&self, wanted: DeviceSet) -> Result<Opened, OpenError> {
        let open = || crate::GenicamCamera::open(&self.0);
        let camera = wanted.camera.then(open).transpose()?;
        let camera =
            camera.map(|camera| Box::new(devices::ThreadedCamera::over(camera)) as Box<dyn devices::Camera>);
        Ok(Opened { camera, ..Opened::default() })
    }

    #[cfg(not(feature = "aravis"))]
    fn open(&self, _wanted: DeviceSet) -> Result<Opened, OpenError> {
        Err(OpenError::Settings {
            what: "this program was built without GenICam cameras".to_owned(),
            remedy: "use one built with the feature genicam, as the container image is".to_owned(),
        })
    }

    /// Cameras that answer, with who has them.
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
