//! Stops a device while a call to it is blocked.

/// Ends motion or light of one device from any thread, bypassing any call its driver is in.
///
/// A station stops its devices by [`crate::Stage::stop`] and [`crate::Laser::switch_off`]. If its thread is blocked in
/// a driver's call, of this device or of another, another thread stops them by these handles.
pub trait StopHandle: Send + Sync {
    /// Stops motion and turns the laser off, as far as this device has them. Returns within [`crate::CALL_LIMIT`], also
    /// while another call to the device blocks; may be called any number of times, in every state.
    fn stop_now(&self);
}
