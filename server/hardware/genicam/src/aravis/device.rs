//! An open camera: its features by name, and its acquisition.

use std::ffi::{c_char, c_int};
use std::ptr::NonNull;

use aravis_sys as arv;
use gobject_sys::{g_object_unref, g_type_check_instance_is_a};

use super::error::{AravisError, checked, terminated, text};
use super::system;

/// Value and range of a numeric feature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Number {
    /// Value read from the camera.
    pub value: f64,
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
    /// Increment between possible values; 0 if there is none.
    pub increment: f64,
}

/// An open camera; closed when dropped, which takes seconds if it does not answer.
pub struct Device {
    camera: NonNull<arv::ArvCamera>,
    device: NonNull<arv::ArvDevice>,
}

// SAFETY: the library ties a device to no thread; the lock around it ensures that one thread at a time uses it.
unsafe impl Send for Device {}

impl Device {
    /// Opens a camera by its id in the library's list, or by its address.
    pub fn open(id: &str) -> Result<Self, AravisError> {
        let _list_lock = system::lock();
        let name = terminated(id);
        // SAFETY: the name is terminated; the reference returned is the caller's.
        let camera = checked(|error| unsafe { arv::arv_camera_new(name.as_ptr(), error) })?;
        let camera = NonNull::new(camera).ok_or_else(|| AravisError(format!("`{id}` does not respond")))?;
        // SAFETY: the camera is valid; its device belongs to it and lives as long.
        let device = unsafe { arv::arv_camera_get_device(camera.as_ptr()) };
        let Some(device) = NonNull::new(device) else {
            // SAFETY: the reference is ours and given back once.
            unsafe { g_object_unref(camera.as_ptr().cast()) };
            return Err(AravisError(format!("`{id}` has no device")));
        };
        Ok(Self { camera, device })
    }

    pub(super) fn camera(&self) -> *mut arv::ArvCamera {
        self.camera.as_ptr()
    }

    pub(super) fn device(&self) -> *mut arv::ArvDevice {
        self.device.as_ptr()
    }

    /// Whether it is a GigE Vision camera.
    pub fn is_gige(&self) -> bool {
        // SAFETY: the device is a valid object.
        unsafe { g_type_check_instance_is_a(self.device().cast(), arv::arv_gv_device_get_type()) != 0 }
    }

    /// Whether this program controls it, as opposed to another one. Only GigE Vision cameras can be opened without
    /// control.
    pub fn is_controlled(&self) -> bool {
        // SAFETY: asked of a GigE Vision device only, whose type was checked.
        !self.is_gige() || unsafe { arv::arv_gv_device_is_controller(self.device().cast()) != 0 }
    }

    /// Whether it responds to a memory read.
    pub fn answers(&self) -> bool {
        let mut word = [0_u8; 4];
        // SAFETY: the device is valid and the memory as long as is said.
        checked(|error| unsafe {
            arv::arv_device_read_memory(self.device(), 0, 4, word.as_mut_ptr().cast(), error)
        })
        .is_ok_and(|read| read != 0)
    }

    /// Whether a feature exists and is currently available.
    pub fn has(&self, feature: &str) -> bool {
        let name = terminated(feature);
        // SAFETY: the device is valid, the name terminated.
        checked(|error| unsafe { arv::arv_device_is_feature_available(self.device(), name.as_ptr(), error) })
            .is_ok_and(|there| there != 0)
    }

    /// The first available of some names, which differ between versions of the standard.
    pub fn first<'n>(&self, names: &[&'n str]) -> Option<&'n str> {
        names.iter().copied().find(|name| self.has(name))
    }

    /// A string, or the current entry of an enumeration.
    pub fn text(&self, feature: &str) -> Result<String, AravisError> {
        let name = terminated(feature);
        // SAFETY: the device is valid, the name terminated; the text is the library's and copied at once.
        checked(|error| unsafe {
            text(arv::arv_device_get_string_feature_value(self.device(), name.as_ptr(), error))
        })
    }

    /// Sets a string, or selects an entry.
    pub fn set_text(&self, feature: &str, value: &str) -> Result<(), AravisError> {
        let (name, value) = (terminated(feature), terminated(value));
        // SAFETY: the device is valid, both texts terminated and not kept.
        checked(|error| unsafe {
            arv::arv_device_set_string_feature_value(self.device(), name.as_ptr(), value.as_ptr(), error);
        })
    }

    /// The value of a number without its range: one round trip to the camera.
    pub fn value(&self, feature: &str) -> Result<f64, AravisError> {
        let name = terminated(feature);
        // SAFETY: the device is valid, the name terminated.
        unsafe {
            if self.is_integer(feature) {
                let get = arv::arv_device_get_integer_feature_value;
                return checked(|error| get(self.device(), name.as_ptr(), error)).map(|value| value as f64);
            }
            checked(|error| arv::arv_device_get_float_feature_value(self.device(), name.as_ptr(), error))
        }
    }

    /// An integer or floating-point feature.
    pub fn number(&self, feature: &str) -> Result<Number, AravisError> {
        if self.is_integer(feature) { self.integer_number(feature) } else { self.float_number(feature) }
    }

    /// Sets a number, clamped to its range and rounded to its increment.
    pub fn set_number(&self, feature: &str, value: f64) -> Result<(), AravisError> {
        let now = self.number(feature)?;
        let within = if now.min <= now.max { value.clamp(now.min, now.max) } else { value };
        let name = terminated(feature);
        if self.is_integer(feature) {
            let step = now.increment.max(1.0);
            let wanted = now.min + ((within - now.min) / step).floor() * step;
            // SAFETY: the device is valid, the name terminated.
            checked(|error| unsafe {
                arv::arv_device_set_integer_feature_value(self.device(), name.as_ptr(), wanted as i64, error);
            })?;
        } else {
            // SAFETY: as above.
            checked(|error| unsafe {
                arv::arv_device_set_float_feature_value(self.device(), name.as_ptr(), within, error);
            })?;
        }
        Ok(())
    }

    /// Sets a boolean.
    pub fn set_flag(&self, feature: &str, value: bool) -> Result<(), AravisError> {
        let name = terminated(feature);
        // SAFETY: the device is valid, the name terminated.
        checked(|error| unsafe {
            arv::arv_device_set_boolean_feature_value(self.device(), name.as_ptr(), value.into(), error);
        })
    }

    /// Executes a command.
    pub fn execute(&self, feature: &str) -> Result<(), AravisError> {
        let name = terminated(feature);
        // SAFETY: the device is valid, the name terminated.
        checked(|error| unsafe { arv::arv_device_execute_command(self.device(), name.as_ptr(), error) })
    }

    /// The currently available entries of an enumeration.
    pub fn entries(&self, feature: &str) -> Vec<String> {
        let (name, mut n_entries) = (terminated(feature), 0);
        // SAFETY: the device is valid, the name terminated; the array returned holds that many texts of the library,
        // and it alone is the caller's to free.
        unsafe {
            let Ok(entries) = checked(|error| {
                arv::arv_device_dup_available_enumeration_feature_values_as_strings(
                    self.device(),
                    name.as_ptr(),
                    &mut n_entries,
                    error,
                )
            }) else {
                return Vec::new();
            };
            if entries.is_null() {
                return Vec::new();
            }
            let texts = (0..n_entries as usize).map(|idx| text(*entries.add(idx))).collect();
            glib_sys::g_free(entries.cast());
            texts
        }
    }

    /// Code of the current pixel format in the Pixel Format Naming Convention.
    pub fn pixel_format(&self) -> Result<u32, AravisError> {
        // SAFETY: the camera is valid.
        checked(|error| unsafe { arv::arv_camera_get_pixel_format(self.camera(), error) })
    }

    /// Size of one frame with the current settings.
    pub fn payload_bytes(&self) -> Result<usize, AravisError> {
        // SAFETY: the camera is valid.
        checked(|error| unsafe { arv::arv_camera_get_payload(self.camera(), error) }).map(|bytes| bytes as usize)
    }

    /// Starts acquisition.
    pub fn start(&self) -> Result<(), AravisError> {
        // SAFETY: the camera is valid.
        checked(|error| unsafe { arv::arv_camera_start_acquisition(self.camera(), error) })
    }

    /// Stops acquisition.
    pub fn stop(&self) -> Result<(), AravisError> {
        // SAFETY: the camera is valid.
        checked(|error| unsafe { arv::arv_camera_stop_acquisition(self.camera(), error) })
    }

    /// Turns every trigger off.
    pub fn clear_triggers(&self) -> Result<(), AravisError> {
        // SAFETY: the camera is valid.
        checked(|error| unsafe { arv::arv_camera_clear_triggers(self.camera(), error) })
    }

    /// Negotiates the packet size with a GigE Vision camera: the largest that arrives, or the requested one. Also sets
    /// whether a stream reads packets bypassing the system's network stack.
    pub fn negotiate_packet_size(
        &self,
        wanted_bytes: Option<u32>,
        packet_socket: bool,
    ) -> Result<u32, AravisError> {
        if !self.is_gige() {
            return Ok(0);
        }
        let options = match packet_socket {
            true => arv::ARV_GV_STREAM_OPTION_NONE,
            false => arv::ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED,
        };
        // SAFETY: the camera is valid and a GigE Vision one, as these functions ask.
        unsafe {
            arv::arv_camera_gv_set_stream_options(self.camera(), options);
            arv::arv_camera_gv_set_packet_size_adjustment(self.camera(), arv::ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
            match wanted_bytes {
                Some(bytes) => {
                    let bytes = c_int::try_from(bytes).unwrap_or(c_int::MAX);
                    checked(|error| arv::arv_camera_gv_set_packet_size(self.camera(), bytes, error))?;
                }
                None => {
                    checked(|error| arv::arv_camera_gv_auto_packet_size(self.camera(), error))?;
                }
            }
            checked(|error| arv::arv_camera_gv_get_packet_size(self.camera(), error))
        }
    }

    /// Serial number as stated by the camera; empty if unavailable.
    pub fn serial(&self) -> String {
        // SAFETY: the camera is valid; the text is the library's and copied at once.
        checked(|error| unsafe { text(arv::arv_camera_get_device_serial_number(self.camera(), error)) })
            .unwrap_or_default()
    }

    /// The camera's XML description of its features; empty if unavailable.
    pub fn description(&self) -> String {
        let mut n_bytes = 0;
        // SAFETY: the device is valid; the bytes are the library's, as many as it says, and copied at once.
        unsafe {
            let xml = arv::arv_device_get_genicam_xml(self.device(), &mut n_bytes);
            if xml.is_null() {
                return String::new();
            }
            String::from_utf8_lossy(std::slice::from_raw_parts(xml.cast(), n_bytes)).into_owned()
        }
    }

    fn is_integer(&self, feature: &str) -> bool {
        let name = terminated(feature);
        // SAFETY: the device is valid, the name terminated; a node that is returned is a valid object of the device's.
        unsafe {
            let node = arv::arv_device_get_feature(self.device(), name.as_ptr());
            !node.is_null() && g_type_check_instance_is_a(node.cast(), arv::arv_gc_float_get_type()) == 0
        }
    }

    fn integer_number(&self, feature: &str) -> Result<Number, AravisError> {
        let name = terminated(feature);
        let name: *const c_char = name.as_ptr();
        let (mut min, mut max) = (0_i64, 0_i64);
        // SAFETY: the device is valid, the name terminated, the out-pointers are to initialised integers.
        let (value, increment) = unsafe {
            let value = checked(|error| arv::arv_device_get_integer_feature_value(self.device(), name, error))?;
            checked(|error| {
                arv::arv_device_get_integer_feature_bounds(self.device(), name, &mut min, &mut max, error);
            })?;
            // A feature without an increment returns an error.
            let step = checked(|error| arv::arv_device_get_integer_feature_increment(self.device(), name, error));
            (value, step.unwrap_or(1))
        };
        Ok(Number { value: value as f64, min: min as f64, max: max as f64, increment: increment as f64 })
    }

    fn float_number(&self, feature: &str) -> Result<Number, AravisError> {
        let name = terminated(feature);
        let name: *const c_char = name.as_ptr();
        let (mut min, mut max) = (0.0, 0.0);
        // SAFETY: the device is valid, the name terminated, the out-pointers are to initialised numbers.
        let value = unsafe {
            let value = checked(|error| arv::arv_device_get_float_feature_value(self.device(), name, error))?;
            checked(|error| {
                arv::arv_device_get_float_feature_bounds(self.device(), name, &mut min, &mut max, error);
            })?;
            value
        };
        Ok(Number { value, min, max, increment: 0.0 })
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: the reference is ours and given back once; the device goes with its camera.
        unsafe { g_object_unref(self.camera.as_ptr().cast()) };
    }
}
