//! Discovery of cameras.

use parking_lot::{Mutex, MutexGuard};

use aravis_sys as arv;

use super::error::text;

/// The library's list of devices is global to the process, and its strings live until the list is renewed.
static LIST: Mutex<()> = Mutex::new(());

/// A camera found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Listed {
    /// Id by which the library opens it.
    pub id: String,
    /// `GigEVision`, `USB3Vision` or `Fake`.
    pub protocol: String,
    /// Vendor.
    pub vendor: String,
    /// Model.
    pub model: String,
    /// Its serial number.
    pub serial: String,
    /// IPv4 address, or location on USB.
    pub address: String,
}

/// Searches all networks and the USB for cameras; takes about a second.
pub fn list() -> Vec<Listed> {
    let _list_lock = lock();
    // SAFETY: no contract but initialised memory; the lock keeps the list unchanged while its texts are copied, and
    // `index` is below the number of devices.
    unsafe {
        arv::arv_update_device_list();
        let listed = |index| Listed {
            id: text(arv::arv_get_device_id(index)),
            protocol: text(arv::arv_get_device_protocol(index)),
            vendor: text(arv::arv_get_device_vendor(index)),
            model: text(arv::arv_get_device_model(index)),
            serial: text(arv::arv_get_device_serial_nbr(index)),
            address: text(arv::arv_get_device_address(index)),
        };
        (0..arv::arv_get_n_devices()).map(listed).collect()
    }
}

/// Adds the library's simulated camera to the list, `Fake_1`; for tests.
pub fn enable_fake() {
    let _list_lock = lock();
    // SAFETY: takes a terminated text and keeps nothing of it.
    unsafe { arv::arv_enable_interface(c"Fake".as_ptr()) };
}

/// The lock, which opening needs as well, because it may renew the list.
pub(super) fn lock() -> MutexGuard<'static, ()> {
    LIST.lock()
}
