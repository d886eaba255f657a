//! The settings there are: key, kind, default, meaning. One row each; documentation, file, environment and flags
//! follow from it.

use std::net::SocketAddr;

use app::config::AppConfig;
use capture::{ChessboardTarget, GratingProjector};
use devices::grbl::GrblSettings;
use devices::replay::ReplaySettings;
use http::HttpConfig;
use station::StationDevices;
use twin::{StationShape, TwinSettings};

use crate::config::value::{Kind, Value};

use crate::config::Config;
use crate::drivers::StationSettings;

/// A setting.
pub struct Setting {
    /// Its key, as in the file; tables are separated by dots.
    pub key: &'static str,
    /// What it may be.
    pub kind: Kind,
    /// What it is if nobody says otherwise.
    pub default: fn() -> Value,
    /// What it means.
    pub about: &'static str,
}

/// All settings in the order they are printed.
pub const SETTINGS: &[Setting] = &[
    row("listen", Kind::Address, || text("127.0.0.1:8080"), "address and port of the service"),
    row("data", Kind::Text, || text("sheaf-data"), "folder of everything that is kept"),
    row("station.camera.kind", Kind::Text, || text("twin"), "who makes the camera: twin or replay"),
    row("station.stage.kind", Kind::Text, || text("twin"), "who makes the stage: twin, replay or grbl"),
    row("station.laser.kind", Kind::Text, || text("twin"), "who makes the laser: twin, replay or grbl"),
    row("station.twin.seed", Kind::Whole(0, i64::MAX), || Value::Whole(7), "seed of the simulated station"),
    row("station.twin.scene", Kind::Text, || text("sphere"), "plate, gauge, sphere, freeform, or an STL file"),
    row("station.twin.gauge_height_mm", Kind::Number(0.1, 100.0), || number(8.9), "height of the gauge"),
    row("station.twin.sphere_radius_mm", Kind::Number(0.1, 100.0), || number(18.9), "radius of the ball"),
    row("station.twin.realistic_timing", Kind::Switch, || Value::Switch(false), "motion takes its time"),
    row("station.twin.frame_rate_hz", Kind::Number(0.1, 1000.0), || number(30.0), "frames per second of the view"),
    row("station.replay.folder", Kind::Text, || text(""), "the capture folder that is played"),
    row("station.replay.scan", Kind::Text, || text(""), "which of its scans; empty: the first"),
    row("station.replay.frame_rate_hz", Kind::Number(0.1, 10_000.0), || number(30.0), "frames per second"),
    row("station.replay.preload", Kind::Switch, || Value::Switch(true), "play from memory"),
    row("station.replay.repeat", Kind::Switch, || Value::Switch(true), "start again at the end"),
    row("station.grbl.port", Kind::Text, || text(""), "serial port of the controller"),
    row("station.grbl.baud", Kind::Whole(1200, 10_000_000), || Value::Whole(115_200), "its speed"),
    row("station.grbl.steps_per_mm", Kind::Number(0.001, 1e6), || number(80.0), "what its $100 must say"),
    row("station.grbl.identity", Kind::Text, || text(""), "text that its $I must contain; empty: any"),
    row("station.grbl.travel_from_mm", Kind::Number(-1e4, 1e4), || number(-40.0), "lowest position of the stage"),
    row("station.grbl.travel_to_mm", Kind::Number(-1e4, 1e4), || number(40.0), "highest position of the stage"),
    row(
        "station.grbl.zero_at_machine_mm",
        Kind::Number(-1e4, 1e4),
        || number(-50.0),
        "machine position of the stage's zero",
    ),
    row("target.inner_columns", Kind::Whole(2, 200), || Value::Whole(board().0), "inner corners along a row"),
    row("target.inner_rows", Kind::Whole(2, 200), || Value::Whole(board().1), "inner corners along a column"),
    row("target.square_mm", Kind::Number(0.01, 1000.0), || number(SQUARE_MM), "side of a square"),
    row(
        "projector.wavelength_nm",
        Kind::Number(100.0, 20_000.0),
        || number(shape().wavelength_nm),
        "of the laser",
    ),
    row(
        "projector.grating_lines_per_mm",
        Kind::Number(0.1, 10_000.0),
        || number(shape().lines_per_mm),
        "grooves of the grating",
    ),
    row("projector.orders", Kind::Wholes(-100, 100), orders, "diffraction orders from the top of the image"),
    row("projector.line_direction", Kind::Word(&["rows", "columns"]), || text("rows"), "which way the lines run"),
    row("http.allowed_hosts", Kind::Texts, || Value::Texts(Vec::new()), "further names of this server"),
    row("http.allowed_origins", Kind::Texts, || Value::Texts(Vec::new()), "further pages that may use it"),
    row(
        "http.trusted_proxy",
        Kind::Switch,
        || Value::Switch(false),
        "a proxy that sees to users and TLS is before it",
    ),
];

/// Side of a square of the simulated station's board; a test compares it with what the twin shows.
const SQUARE_MM: f64 = 12.0;

const fn row(key: &'static str, kind: Kind, default: fn() -> Value, about: &'static str) -> Setting {
    Setting { key, kind, default, about }
}

fn text(text: &str) -> Value {
    Value::Text(text.to_owned())
}

fn number(number: f64) -> Value {
    Value::Number(number)
}

fn shape() -> StationShape {
    StationShape::default()
}

fn board() -> (i64, i64) {
    let (columns, rows) = twin::poses::BOARD_CORNERS;
    (columns as i64, rows as i64)
}

fn orders() -> Value {
    Value::Wholes(shape().orders.iter().map(|&order| i64::from(order)).collect())
}

/// The configuration that the values make; `get` gives the value of a key of [`SETTINGS`], of its kind.
pub fn config(get: &dyn Fn(&str) -> Value, station: StationDevices) -> Config {
    let read = Reader { get };
    let listen: SocketAddr = read.text("listen").parse().expect("the kind admits addresses only");
    Config {
        listen,
        app: AppConfig {
            data: read.text("data").into(),
            station,
            target: ChessboardTarget {
                inner_columns: read.whole("target.inner_columns") as usize,
                inner_rows: read.whole("target.inner_rows") as usize,
                square_mm: read.number("target.square_mm").into(),
            },
            projector: GratingProjector {
                wavelength_nm: read.number("projector.wavelength_nm"),
                grating_lines_per_mm: read.number("projector.grating_lines_per_mm"),
                orders: read.wholes("projector.orders").iter().map(|&order| order as i8).collect(),
                line_direction: Some(read.text("projector.line_direction")).filter(|word| word != "rows"),
            },
        },
        http: HttpConfig {
            listen_ip: Some(listen.ip()),
            allowed_hosts: read.texts("http.allowed_hosts"),
            allowed_origins: read.texts("http.allowed_origins"),
            trusted_proxy: read.switch("http.trusted_proxy"),
        },
    }
}

/// What the station is made of, of the values that `get` gives.
pub fn station(get: &dyn Fn(&str) -> Value) -> StationSettings {
    let read = Reader { get };
    StationSettings {
        camera: read.text("station.camera.kind"),
        stage: read.text("station.stage.kind"),
        laser: read.text("station.laser.kind"),
        twin: TwinSettings {
            seed: read.whole("station.twin.seed") as u64,
            scene: read.text("station.twin.scene"),
            gauge_height_mm: read.number("station.twin.gauge_height_mm"),
            sphere_radius_mm: read.number("station.twin.sphere_radius_mm"),
            realistic_timing: read.switch("station.twin.realistic_timing"),
            frame_rate_hz: read.number("station.twin.frame_rate_hz"),
        },
        replay: ReplaySettings {
            folder: read.text("station.replay.folder").into(),
            scan: read.text("station.replay.scan"),
            frame_rate_hz: read.number("station.replay.frame_rate_hz"),
            preload: read.switch("station.replay.preload"),
            repeat: read.switch("station.replay.repeat"),
        },
        grbl: GrblSettings {
            port: read.text("station.grbl.port"),
            baud: read.whole("station.grbl.baud") as u32,
            steps_per_mm: read.number("station.grbl.steps_per_mm"),
            identity: read.text("station.grbl.identity"),
            travel_from_mm: read.number("station.grbl.travel_from_mm"),
            travel_to_mm: read.number("station.grbl.travel_to_mm"),
            zero_at_machine_mm: read.number("station.grbl.zero_at_machine_mm"),
        },
    }
}

/// Typed access; the layers admit only values of each setting's kind.
struct Reader<'a> {
    get: &'a dyn Fn(&str) -> Value,
}

impl Reader<'_> {
    fn text(&self, key: &str) -> String {
        match (self.get)(key) {
            Value::Text(text) => text,
            other => unreachable!("{key} is a text, not {other:?}"),
        }
    }

    fn number(&self, key: &str) -> f64 {
        match (self.get)(key) {
            Value::Number(number) => number,
            other => unreachable!("{key} is a number, not {other:?}"),
        }
    }

    fn whole(&self, key: &str) -> i64 {
        match (self.get)(key) {
            Value::Whole(number) => number,
            other => unreachable!("{key} is a whole number, not {other:?}"),
        }
    }

    fn switch(&self, key: &str) -> bool {
        match (self.get)(key) {
            Value::Switch(on) => on,
            other => unreachable!("{key} is a switch, not {other:?}"),
        }
    }

    fn texts(&self, key: &str) -> Vec<String> {
        match (self.get)(key) {
            Value::Texts(texts) => texts,
            other => unreachable!("{key} is a list of texts, not {other:?}"),
        }
    }

    fn wholes(&self, key: &str) -> Vec<i64> {
        match (self.get)(key) {
            Value::Wholes(numbers) => numbers,
            other => unreachable!("{key} is a list of whole numbers, not {other:?}"),
        }
    }
}
