//! The drivers of a station's devices.

use std::sync::Arc;

use devices::{DeviceSet, Driver, OpenError, Opened};
use twin::{TwinDriver, TwinStation};

use crate::parts::faults::{fault, fault_of};
use crate::shared::status::Fault;

/// The drivers of a station's devices; one driver may open several devices.
#[derive(Debug, Clone)]
pub struct StationDevices {
    /// Driver of the camera.
    pub camera: Arc<dyn Driver>,
    /// Driver of the stage.
    pub stage: Arc<dyn Driver>,
    /// Driver of the laser.
    pub laser: Arc<dyn Driver>,
    /// The simulated world if the camera is simulated: stage and laser act on that world, whichever driver opens them.
    pub twin: Option<Arc<TwinDriver>>,
}

/// One driver and the devices it opens for the station.
#[derive(Clone)]
pub struct DriverDevices {
    pub driver: Arc<dyn Driver>,
    pub devices: DeviceSet,
    /// The simulated world that follows these devices.
    followed_by: Option<Arc<TwinDriver>>,
}

impl StationDevices {
    /// All three devices of one simulated world.
    pub fn twin(twin: TwinDriver) -> Self {
        let twin = Arc::new(twin);
        Self { camera: twin.clone(), stage: twin.clone(), laser: twin.clone(), twin: Some(twin) }
    }

    /// All three devices of any simulated world.
    pub fn over(world: TwinStation) -> Self {
        Self::twin(TwinDriver::over(world))
    }

    /// Source of the images: the kind of the camera's driver, or `None` for real images.
    pub fn simulated(&self) -> Option<&'static str> {
        (!self.camera.is_real()).then(|| self.camera.kind())
    }

    /// Each driver once, with those of the `wanted` devices that it opens.
    pub fn grouped_by_driver(&self, wanted: DeviceSet) -> Vec<DriverDevices> {
        let none = DeviceSet::default();
        let mut groups: Vec<DriverDevices> = Vec::new();
        for (driver, device) in [
            (&self.camera, DeviceSet { camera: true, ..none }),
            (&self.stage, DeviceSet { stage: true, ..none }),
            (&self.laser, DeviceSet { laser: true, ..none }),
        ] {
            if device.and(wanted).is_empty() {
                continue;
            }
            match groups.iter_mut().find(|group| Arc::ptr_eq(&group.driver, driver)) {
                Some(group) => group.devices = group.devices.or(device),
                None => {
                    let kind = driver.kind();
                    let followed_by = self.twin.clone().filter(|twin| twin.kind() != kind);
                    groups.push(DriverDevices { driver: driver.clone(), devices: device, followed_by });
                }
            }
        }
        groups
    }
}

impl DriverDevices {
    /// Opens the devices; may take seconds.
    pub fn open(&self) -> Result<Opened, OpenError> {
        let opened = self.driver.open(self.devices)?;
        match &self.followed_by {
            Some(world) => world.followed(opened),
            None => Ok(opened),
        }
    }

    /// The fault of devices that could not be opened, attributed to the first of them.
    pub fn fault(&self, error: OpenError) -> Option<Fault> {
        let device = self.devices.names().next()?;
        match error {
            OpenError::Stage(error) => fault_of(&error.into()),
            OpenError::Laser(error) => fault_of(&error.into()),
            OpenError::Settings { what, remedy } => Some(fault(device, "wrong_device", what, &remedy)),
            OpenError::Absent { what, remedy } => Some(fault(device, "disconnected", what, &remedy)),
        }
    }
}
