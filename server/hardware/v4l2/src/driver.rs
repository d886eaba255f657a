//! The driver's row in the driver table.

use devices::driver::{DeviceSet, Driver, Found, MissingSetting, OpenError, Opened};

use crate::settings::V4l2Settings;

/// Opens the camera named in the settings.
#[derive(Debug, Clone)]
pub struct V4l2Driver(pub V4l2Settings);

impl Driver for V4l2Driver {
    fn kind(&self) -> &'static str {
        "v4l2"
    }

    fn makes(&self) -> DeviceSet {
        DeviceSet { camera: true, ..DeviceSet::default() }
    }

    fn missing(&self) -> Option<MissingSetting> {
        let expected = "the device file of the camera";
        self.0.device.is_empty().then_some(MissingSetting { name: "device", expected })
    }

    #[cfg(feature = "kernel")]
    fn open(&self, wanted: DeviceSet) -> Result<Opened, OpenError> {
        let path = self.0.device.clone();
        let open = move || {
            crate::kernel::KernelDevice::open(path.as_ref())
                .map(|device| Box::new(device) as Box<dyn crate::VideoDevice>)
        };
        let camera = wanted.camera.then(|| crate::V4l2Camera::open(&self.0, Box::new(open))).transpose()?;
        let camera =
            camera.map(|camera| Box::new(devices::ThreadedCamera::over(camera)) as Box<dyn devices::Camera>);
        Ok(Opened { camera, ..Opened::default() })
    }

    #[cfg(not(feature = "kernel"))]
    fn open(&self, _wanted: DeviceSet) -> Result<Opened, OpenError> {
        Err(OpenError::Settings {
            what: "this program was built without Video4Linux2 cameras".to_owned(),
            remedy: "use one built with the feature v4l2, which is on by default".to_owned(),
        })
    }

    /// Cameras in the kernel's list, which does not show whether one is in use.
    fn discover(&self) -> Vec<Found> {
        crate::discovery::cameras("/".as_ref())
    }
}
