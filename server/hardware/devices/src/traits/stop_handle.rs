//! What stops a device while a call to it has not come back.

/// Ends motion or light of one device from any thread, past whatever call its driver is in.
///
/// A station stops its devices by [`crate::Stage::stop`] and [`crate::Laser::switch_off`]. If its thread is kept in a
/// driver's call, of this device or of another, somebody else stops them by these handles.
pub trait StopHandle: Send + Sync {
    /// Stops motion and turns the light off, as far as this device has them. Comes back within [`crate::CALL_LIMIT`],
    /// also while another call to the device blocks; may be called any number of times, in every state.
    fn stop_now(&self);
}
