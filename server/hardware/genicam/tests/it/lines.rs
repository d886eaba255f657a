//! Output lines, trigger delay and temperature, which aravis' camera process lacks. Its feature description is read,
//! features over unused memory are added, and it is restarted with the result. The tests show what the driver writes
//! and reads. Not covered: that a camera acts on it.

use std::net::UdpSocket;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use devices::contract::{self, LaserProfile};
use devices::{
    CameraRequest, DeviceIdentity, DeviceSet, Driver, Laser, LaserCapabilities, LaserError, LaserState, OpenError,
    StopHandle, Trigger,
};
use genicam::aravis::Device;
use genicam::fake_camera::{FakeCamera, FakeOptions};
use genicam::{GenicamDriver, GenicamSettings};
use tempfile::TempDir;

use crate::rig::{SERIAL, blank, fake, settings, until};

/// Address on which the camera process listens.
const ADDRESS: &str = "127.0.0.1";

/// Memory that the camera process does not use.
const LINE_SELECTOR: u32 = 0x8000;
const LINE_MODE: u32 = 0x8004;
const LINE_SOURCE: u32 = 0x8008;
const LINE_INVERTER: u32 = 0x800c;
const USER_OUTPUT_VALUE: u32 = 0x8014;
const TRIGGER_DELAY: u32 = 0x802c;
const TEMPERATURE: u32 = 0x8030;

/// An unsigned register at the address.
fn register(name: &str, address: u32) -> String {
    format!(
        "<IntReg Name=\"{name}Reg\"><Address>{address:#x}</Address><Length>4</Length><AccessMode>RW</AccessMode>\
         <pPort>Device</pPort><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>"
    )
}

/// An enumeration feature over a register.
fn choice(name: &str, address: u32, entries: &[&str]) -> String {
    let entry =
        |(value, entry): (usize, &&str)| format!("<EnumEntry Name=\"{entry}\"><Value>{value}</Value></EnumEntry>");
    let entries: String = entries.iter().enumerate().map(entry).collect();
    format!(
        "<Enumeration Name=\"{name}\">{entries}<pValue>{name}Reg</pValue></Enumeration>{}",
        register(name, address)
    )
}

/// An integer feature over a register.
fn number(name: &str, address: u32) -> String {
    format!("<Integer Name=\"{name}\"><pValue>{name}Reg</pValue></Integer>{}", register(name, address))
}

/// A boolean feature over a register.
fn flag(name: &str, address: u32) -> String {
    format!(
        "<Boolean Name=\"{name}\"><pValue>{name}Reg</pValue><OnValue>1</OnValue><OffValue>0</OffValue></Boolean>{}",
        register(name, address)
    )
}

/// Value of a register of the camera process, read by a GigE Vision READREG datagram, which does not take control.
fn register_value(address: u32) -> u32 {
    let socket = UdpSocket::bind((ADDRESS, 0)).unwrap();
    socket.connect((ADDRESS, 3956)).unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
    let mut request = vec![0x42, 0x01, 0x00, 0x80, 0x00, 0x04, 0x12, 0x34];
    request.extend(address.to_be_bytes());
    let mut answer = [0; 16];
    for _ in 0..20 {
        socket.send(&request).unwrap();
        if socket.recv(&mut answer).is_ok_and(|n_bytes| n_bytes == 12) {
            return u32::from_be_bytes(answer[8..12].try_into().unwrap());
        }
    }
    panic!("it does not respond")
}

/// Starts a camera process with these additional features; `None`, with a note, if it is not installed.
fn with_features(more: &[String]) -> Option<(FakeCamera, TempDir)> {
    let plain = fake(0)?;
    let description = Device::open(ADDRESS).expect("it responds").description();
    drop(plain);
    let end = description.rfind("</RegisterDescription>").expect("a description ends");
    let folder = TempDir::new().unwrap();
    let file: PathBuf = folder.path().join("camera.xml");
    std::fs::write(&file, format!("{}{}{}", &description[..end], more.concat(), &description[end..])).unwrap();
    let options = FakeOptions { serial: SERIAL.to_owned(), description: Some(file), ..FakeOptions::default() };
    Some((FakeCamera::start(options).expect("the camera process starts"), folder))
}

fn lines() -> Vec<String> {
    vec![
        choice("LineSelector", LINE_SELECTOR, &["Line1", "Line2"]),
        choice("LineMode", LINE_MODE, &["Input", "Output"]),
        choice("LineSource", LINE_SOURCE, &["Off", "ExposureActive", "UserOutput1"]),
        flag("LineInverter", LINE_INVERTER),
        choice("UserOutputSelector", 0x8010, &["UserOutput1"]),
        flag("UserOutputValue", USER_OUTPUT_VALUE),
    ]
}

fn with_laser(source: &str) -> GenicamSettings {
    let (laser_line, laser_source) = ("Line2".to_owned(), source.to_owned());
    GenicamSettings { laser_line, laser_source, laser_inverted: true, ..settings(SERIAL) }
}

fn open_both(settings: &GenicamSettings) -> (Box<dyn devices::Camera>, Box<dyn Laser>) {
    let wanted = DeviceSet { camera: true, stage: false, laser: true };
    let opened = GenicamDriver(settings.clone()).open(wanted).unwrap_or_else(|error| panic!("{error}"));
    (opened.camera.unwrap(), opened.laser.unwrap())
}

/// A laser together with its open camera.
struct LaserWithCamera(Box<dyn Laser>, #[expect(dead_code, reason = "it is kept open")] Box<dyn devices::Camera>);

impl Laser for LaserWithCamera {
    fn identity(&self) -> DeviceIdentity {
        self.0.identity()
    }

    fn capabilities(&self) -> LaserCapabilities {
        self.0.capabilities()
    }

    fn switch_on(&mut self, power: f64, lease: Duration) -> Result<LaserState, LaserError> {
        self.0.switch_on(power, lease)
    }

    fn renew(&mut self, lease: Duration) -> Result<LaserState, LaserError> {
        self.0.renew(lease)
    }

    fn switch_off(&mut self) -> Result<(), LaserError> {
        self.0.switch_off()
    }

    fn stop_handle(&self) -> Option<Arc<dyn StopHandle>> {
        self.0.stop_handle()
    }

    fn poll(&mut self) -> Result<LaserState, LaserError> {
        self.0.poll()
    }

    fn reconnect(&mut self) -> Result<(), LaserError> {
        self.0.reconnect()
    }
}

#[test]
fn a_laser_on_an_output_line_passes_the_suite() {
    for source in ["ExposureActive", "UserOutput1"] {
        let Some((_camera, _folder)) = with_features(&lines()) else { return };
        // Content of the camera's memory, independent of who controls it.
        let light = move || match register_value(LINE_SOURCE) {
            0 => false,
            1 => source == "ExposureActive",
            _ => source == "UserOutput1" && register_value(USER_OUTPUT_VALUE) == 1,
        };
        let reaction_limit = Duration::from_millis(300);
        let profile = LaserProfile { light: Some(Box::new(light)), reaction_limit, cable: None };
        contract::laser(
            &mut || {
                let (camera, laser) = open_both(&with_laser(source));
                Box::new(LaserWithCamera(laser, camera))
            },
            &profile,
        );
        let are = [LINE_SELECTOR, LINE_MODE, LINE_SOURCE, LINE_INVERTER].map(register_value);
        assert_eq!(are, [1, 1, 0, 1], "Line2, an output, off, inverted");
    }
}

#[test]
fn a_laser_on_an_output_line_is_off_after_its_camera_was_reconnected() {
    let Some((mut process, _folder)) = with_features(&lines()) else { return };
    let (mut camera, mut laser) = open_both(&with_laser("ExposureActive"));
    laser.switch_on(1.0, Duration::from_secs(1)).unwrap();
    process.restart().unwrap();
    // The line of the reconnected camera signals exposures, as it does on some cameras.
    let mut image = blank();
    until(&mut *camera, &mut image, "the loss is reported", |_, got| got.err());
    camera.reconnect().unwrap();
    until(&mut *camera, &mut image, "it is reconnected", |_, got| got.ok());
    laser.reconnect().unwrap();
    let mut is_off = || laser.poll().is_ok_and(|state| !state.emitting);
    until(&mut *camera, &mut image, "laser off", |_, _| is_off().then_some(()));
    assert_eq!(register_value(LINE_SOURCE), 0);
}

#[test]
fn a_line_that_cannot_be_turned_off_or_is_missing_is_refused() {
    let Some((_camera, _folder)) = with_features(&[
        choice("LineSelector", LINE_SELECTOR, &["Line1"]),
        choice("LineSource", LINE_SOURCE, &["ExposureActive"]),
    ]) else {
        return;
    };
    let wanted = DeviceSet { camera: true, stage: false, laser: true };
    for (line, expected) in [("Line1", "cannot be turned off"), ("Line7", "Line7")] {
        let refused =
            GenicamSettings { laser_line: line.to_owned(), laser_inverted: false, ..with_laser("ExposureActive") };
        match GenicamDriver(refused).open(wanted) {
            Err(OpenError::Settings { what, .. }) => assert!(what.contains(expected) || line == "Line7", "{what}"),
            other => panic!("{line}: {:?}", other.map(drop)),
        }
    }
    match GenicamDriver(settings(SERIAL)).open(wanted) {
        Err(OpenError::Settings { remedy, .. }) => assert!(remedy.contains("laser_line"), "{remedy}"),
        other => panic!("{:?}", other.map(drop)),
    }
}

#[test]
fn trigger_line_edge_delay_and_binning_are_set_and_are_set_again_after_a_restart() {
    let Some((mut process, _folder)) =
        with_features(&[number("TriggerDelay", TRIGGER_DELAY), number("DeviceTemperature", TEMPERATURE)])
    else {
        return;
    };
    let trigger_line = "Line0".to_owned();
    let wanted = GenicamSettings { trigger_line, trigger_delay_us: 250.0, binning: 2, ..settings(SERIAL) };
    let mut camera = crate::rig::open(&wanted);
    assert!(camera.capabilities().triggers.contains(&Trigger::Hardware), "{:?}", camera.capabilities().triggers);
    let details = camera.details().unwrap();
    details.set_feature("DeviceTemperature", "41").unwrap();
    camera.configure(&CameraRequest { trigger: Some(Trigger::Hardware), ..CameraRequest::default() }).unwrap();
    let is_set = || {
        assert_eq!(register_value(TRIGGER_DELAY), 250);
        let features = details.features().unwrap();
        let is = |name: &str, value: &str| {
            let feature = features.iter().find(|feature| feature.name == name);
            assert_eq!(feature.and_then(|feature| feature.value.as_deref()), Some(value), "{name}");
        };
        is("TriggerSource", "Line0");
        is("TriggerActivation", "RisingEdge");
        is("TriggerMode", "On");
        is("BinningHorizontal", "2");
        is("BinningVertical", "2");
    };
    is_set();
    let mut image = blank();
    until(&mut *camera, &mut image, "the temperature is read", |_, _| details.link().temperature_c.map(drop));
    assert_eq!(details.link().temperature_c, Some(41.0));
    process.restart().unwrap();
    until(&mut *camera, &mut image, "the loss is reported", |_, got| got.err());
    camera.reconnect().unwrap();
    until(&mut *camera, &mut image, "it is reconnected", |_, got| got.ok());
    is_set();
}
