//! The main loop of the thread; however it ends, light and motion end as well.

use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::parts::faults::fault;
use crate::station_thread::station::Station;

/// Runs the station until it is shut down or all its handles are dropped.
pub fn run(station: Station) {
    let mut station = Guarded(station);
    loop {
        match catch_unwind(AssertUnwindSafe(|| station.0.run_cycle())) {
            Ok(true) => {}
            Ok(false) => break,
            Err(_) => station.after_panic(),
        }
    }
    // The guard's drop ends motion and light.
}

/// A station that ends motion and light when it is dropped, even during a panic.
struct Guarded(Station);

impl Guarded {
    /// After a panic, devices are not used until a person resets the station.
    fn after_panic(&mut self) {
        self.make_safe();
        let recorded = catch_unwind(AssertUnwindSafe(|| {
            self.0.raise(fault(
                "station",
                "panic",
                "an internal error in the station thread ended all work",
                "please report it, with the log of the service",
            ));
            self.0.publish_and_reply();
        }));
        if recorded.is_err() {
            tracing::error!("the station thread could not record its own fault");
        }
    }

    fn make_safe(&mut self) {
        // A panic of one device's driver must not prevent the stop of the others.
        let devices: [fn(&mut Station); 3] = [
            |station| station.stage.iter_mut().for_each(|stage| drop(stage.device().stop())),
            |station| station.laser.iter_mut().for_each(|laser| drop(laser.off())),
            |station| station.camera.iter_mut().for_each(|camera| drop(camera.stop())),
        ];
        for stop_device in devices {
            let _ = catch_unwind(AssertUnwindSafe(|| stop_device(&mut self.0)));
        }
    }
}

impl Drop for Guarded {
    fn drop(&mut self) {
        self.make_safe();
        self.0.refuse_all();
    }
}
