//! The server, asked by the client of tokio-modbus, and by bytes.

use std::net::{Ipv4Addr, TcpListener};
use std::time::Duration;

use app::doors::{Delivery, Door as _, Undelivered};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;
use tokio_modbus::ExceptionCode;
use tokio_modbus::client::{Context, Reader as _, Writer as _, tcp};

use crate::registers::result_block::ResultBlock;
use crate::settings::Settings;
use crate::tests::plant::Plant;
use crate::tests::{delivery, inspection};

const PATIENCE: Duration = Duration::from_secs(30);

/// A PLC with everything that its programmer should do.
struct Plc {
    client: Context,
    heartbeat: u16,
    command_seq: u16,
    ack: u16,
}

impl Plc {
    /// Connects; the first number of a command is not executed.
    async fn connect(plant: &Plant) -> Self {
        let mut plc = Self { client: client(plant).await, heartbeat: 0, command_seq: 500, ack: 0 };
        assert_eq!(plc.command(0, 0, "").await, 10);
        plc
    }

    async fn inputs(&mut self) -> Vec<u16> {
        self.client.read_input_registers(0, 60).await.unwrap().unwrap()
    }

    async fn until(&mut self, what: impl Fn(&[u16]) -> bool) -> Vec<u16> {
        let waiting = async {
            loop {
                let inputs = self.inputs().await;
                if what(&inputs) {
                    return inputs;
                }
            }
        };
        tokio::time::timeout(PATIENCE, waiting).await.unwrap()
    }

    /// Writes the whole block; returns the code.
    async fn command(&mut self, command: u16, recipe: u16, serial: &str) -> u16 {
        self.heartbeat = self.heartbeat.wrapping_add(1);
        self.command_seq = self.command_seq.wrapping_add(1);
        let mut block = vec![self.heartbeat, command, self.command_seq, self.ack, 0, recipe];
        let mut bytes = serial.as_bytes().to_vec();
        bytes.resize(32, 0);
        block.extend(bytes.chunks(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])));
        self.client.write_multiple_registers(0, &block).await.unwrap().unwrap();
        let seq = self.command_seq;
        self.until(|inputs| inputs[4] == seq).await[5]
    }

    async fn acknowledge(&mut self, result_seq: u16) {
        self.ack = result_seq;
        self.client.write_single_register(3, result_seq).await.unwrap().unwrap();
    }
}

async fn client(plant: &Plant) -> Context {
    let connecting = async {
        loop {
            match tcp::connect(plant.address).await {
                Ok(client) => return client,
                Err(_) => tokio::time::sleep(Duration::from_millis(5)).await,
            }
        }
    };
    tokio::time::timeout(PATIENCE, connecting).await.unwrap()
}

fn is_valid(inputs: &[u16]) -> bool {
    inputs[3] & 4 != 0
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_part_is_triggered_measured_and_acknowledged() {
    let mut plant = Plant::new(40);
    plant.start();
    let mut plc = Plc::connect(&plant).await;
    let before = plc.inputs().await;
    assert_eq!((before[0], before[2], before[3], &before[8..11]), (1, 6, 0b1100_0001, &[0x449A, 0x5000, 0][..]));
    assert_eq!(plc.command(1, 12, "S1").await, 0);
    let result = plc.until(is_valid).await;
    assert_eq!(result[10..17], [41, 2, 3, 7, 0, 12, 0x5331]);
    assert_eq!(result[40..44], [0, 41, 1, 100]);
    // An acknowledgement of another number changes nothing.
    plc.acknowledge(40).await;
    assert!(is_valid(&plc.inputs().await));
    plc.acknowledge(41).await;
    plc.until(|inputs| !is_valid(inputs)).await;
    plant.stored(1).await;
    // Nor does a second one of the same.
    plc.acknowledge(41).await;
    assert!(!is_valid(&plc.inputs().await));
    assert_eq!(*plant.line.calls.lock(), ["127.0.0.1 trigger Some(12) S1"]);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn results_wait_in_order_and_a_double_acknowledgement_skips_none() {
    let mut plant = Plant::new(65_533);
    plant.start();
    let mut plc = Plc::connect(&plant).await;
    for serial in ["S1", "S2", "S3", "S4"] {
        assert_eq!(plc.command(1, 12, serial).await, 0);
        plc.until(|inputs| inputs[3] & 2 == 0).await;
    }
    plc.until(|inputs| inputs[7] == 3).await;
    // Over the end of the numbers.
    for (expected, behind) in [(65_534, 3), (65_535, 2), (1, 1), (2, 0)] {
        let result = plc.until(is_valid).await;
        assert_eq!((result[10], result[7]), (expected, behind));
        plc.acknowledge(expected).await;
        plc.acknowledge(expected).await;
        assert!(!is_valid(&plc.inputs().await), "valid is 0 between two results");
    }
    plant.stored(4).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn after_a_crash_the_same_result_comes_again_and_no_command_is_repeated() {
    let mut plant = Plant::new(0);
    plant.start();
    let mut plc = Plc::connect(&plant).await;
    assert_eq!(plc.command(1, 12, "S1").await, 0);
    plc.until(is_valid).await;
    plant.kill().await;
    plant.start();
    let (command_seq, heartbeat) = (plc.command_seq, plc.heartbeat);
    plc.client = client(&plant).await;
    // What a PLC that writes in every cycle has in its block: the executed trigger.
    plc.client.write_multiple_registers(0, &[heartbeat, 1, command_seq, 0]).await.unwrap().unwrap();
    let again = plc.until(is_valid).await;
    assert_eq!((again[10], again[4], again[5]), (1, command_seq, 10));
    plc.acknowledge(1).await;
    plant.stored(1).await;
    assert_eq!(plc.command(1, 12, "S2").await, 0);
    assert_eq!(plc.until(is_valid).await[10], 2);
    assert_eq!(plant.line.calls.lock().len(), 2);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn stop_abort_and_prepare_reach_the_station_and_refusals_have_their_codes() {
    let mut plant = Plant::new(0);
    plant.start();
    let mut plc = Plc::connect(&plant).await;
    plant.line.ends.send_replace(false);
    assert_eq!(plc.command(4, 13, "").await, 3);
    assert_eq!(plc.command(4, 12, "").await, 0);
    assert_eq!(plc.inputs().await[36..38], [0, 12]);
    assert_eq!(plc.command(1, 0, "S1").await, 0);
    assert_eq!(plc.inputs().await[3] & 0b11, 0b10, "busy, not ready");
    assert_eq!(plc.command(1, 0, "S2").await, 2);
    assert_eq!(plc.command(2, 0, "").await, 0);
    let aborted = plc.until(|inputs| inputs[3] & 2 == 0).await;
    assert_eq!((aborted[6], is_valid(&aborted)), (2, false));
    *plant.line.refuses.lock() = Some(crate::codes::AckCode::NotInControl);
    assert_eq!(plc.command(1, 0, "S3").await, 6);
    assert_eq!(plc.command(9, 0, "").await, 1);
    assert_eq!(plc.command(3, 0, "").await, 0);
    assert_eq!(plc.command(1, 0, "S4").await, 4);
    assert_eq!(plc.inputs().await[2..4], [2, 0b1101_0000]);
    let calls = ["trigger Some(12) S1", "abort S1", "trigger Some(12) S3", "stop"];
    assert_eq!(*plant.line.calls.lock(), calls.map(|call| format!("127.0.0.1 {call}")));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn without_writes_every_write_is_exception_1_and_the_newest_result_is_shown() {
    let mut plant = Plant::new(0);
    plant.start_with(Settings { writes: false, ..plant.settings() });
    let mut client = client(&plant).await;
    let refused = Err(ExceptionCode::IllegalFunction);
    assert_eq!(client.write_single_register(0, 1).await.unwrap(), refused);
    assert_eq!(client.write_multiple_registers(1, &[3, 1]).await.unwrap(), refused);
    for seq in 1..=3 {
        plant.door().deliver(&delivery(seq, inspection(seq, "S"))).await.unwrap();
        let shown = client.read_input_registers(0, 20).await.unwrap().unwrap();
        assert_eq!((shown[10], is_valid(&shown)), (seq as u16, true));
    }
    assert!(plant.line.calls.lock().is_empty());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn addresses_and_functions_that_do_not_exist_are_refused() {
    let mut plant = Plant::new(0);
    plant.start();
    let mut client = client(&plant).await;
    let no_address = Err(ExceptionCode::IllegalDataAddress);
    for (address, count) in [(990, 11), (1000, 1), (65_535, 1), (65_535, 125)] {
        assert_eq!(client.read_input_registers(address, count).await.unwrap(), no_address, "{address} {count}");
    }
    for (address, count) in [(38, 1), (36, 3), (999, 2), (1999, 2), (2000, 1), (65_535, 125)] {
        assert_eq!(client.read_holding_registers(address, count).await.unwrap(), no_address, "{address} {count}");
    }
    assert_eq!(client.write_single_register(38, 0).await.unwrap(), Err(ExceptionCode::IllegalDataAddress));
    assert_eq!(
        client.write_multiple_registers(37, &[0, 0]).await.unwrap(),
        Err(ExceptionCode::IllegalDataAddress)
    );
    assert_eq!(client.write_single_register(1000, 0).await.unwrap(), Err(ExceptionCode::IllegalDataAddress));
    assert_eq!(client.read_input_registers(0, 126).await.unwrap(), Err(ExceptionCode::IllegalDataValue));
    assert_eq!(client.read_input_registers(0, 0).await.unwrap(), Err(ExceptionCode::IllegalDataValue));
    assert_eq!(client.read_coils(0, 1).await.unwrap(), Err(ExceptionCode::IllegalFunction));
    let both = client.read_write_multiple_registers(0, 1, 0, &[1]).await.unwrap();
    assert_eq!(both, Err(ExceptionCode::IllegalFunction));
    // Inputs are mirrored, and what was written can be read back.
    client.write_single_register(5, 12).await.unwrap().unwrap();
    assert_eq!(client.read_holding_registers(4, 2).await.unwrap().unwrap(), [0, 12]);
    assert_eq!(client.read_holding_registers(1008, 2).await.unwrap().unwrap(), [0x449A, 0x5000]);
    assert_eq!(client.read_holding_registers(1875, 125).await.unwrap().unwrap().len(), 125);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn garbage_ends_its_connection_and_no_other() {
    let mut plant = Plant::new(0);
    plant.start();
    let mut polling = client(&plant).await;
    for garbage in [&b"GET / HTTP/1.1\r\n\r\n"[..], &[0xFF; 300], &[0, 1, 0, 0, 0, 0, 1, 3]] {
        let mut stream = TcpStream::connect(plant.address).await.unwrap();
        stream.write_all(garbage).await.unwrap();
        let mut answer = Vec::new();
        // Closed or reset, in any case without an answer.
        let _ = tokio::time::timeout(PATIENCE, stream.read_to_end(&mut answer)).await.unwrap();
        assert!(answer.is_empty());
        polling.read_input_registers(0, 10).await.unwrap().unwrap();
    }
    // A request may come in pieces, and several at once.
    let mut stream = TcpStream::connect(plant.address).await.unwrap();
    stream.write_all(&[0, 1, 0, 0, 0]).await.unwrap();
    tokio::time::sleep(Duration::from_millis(20)).await;
    stream.write_all(&[6, 9, 4, 0, 8, 0, 2, 0, 2, 0, 0, 0, 2, 9, 7]).await.unwrap();
    let mut answers = [0; 13 + 9];
    stream.read_exact(&mut answers).await.unwrap();
    assert_eq!(answers[..13], [0, 1, 0, 0, 0, 7, 9, 4, 4, 0x44, 0x9A, 0x50, 0]);
    assert_eq!(answers[13..], [0, 2, 0, 0, 0, 3, 9, 0x87, 1]);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_full_server_replaces_the_silent_connection_and_keeps_the_one_that_polls() {
    let mut plant = Plant::new(0);
    plant.start_with(Settings { max_connections: 2, ..plant.settings() });
    let mut polling = client(&plant).await;
    polling.read_input_registers(0, 1).await.unwrap().unwrap();
    let mut silent = TcpStream::connect(plant.address).await.unwrap();
    let begun = std::time::Instant::now();
    while begun.elapsed() < Duration::from_millis(1100) {
        polling.read_input_registers(0, 1).await.unwrap().unwrap();
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let mut third = client(&plant).await;
    third.read_input_registers(0, 1).await.unwrap().unwrap();
    assert_eq!(silent.read(&mut [0]).await.unwrap_or(0), 0);
    polling.read_input_registers(0, 1).await.unwrap().unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn no_read_mixes_two_results() {
    let mut plant = Plant::new(0);
    plant.start();
    let shared = plant.door().shared.clone();
    let changing = tokio::spawn(async move {
        for seq in 1.. {
            let block = ResultBlock::of(&inspection(seq, &seq.to_string()));
            shared.handshake.lock().results.replace(seq, &block);
            tokio::task::yield_now().await;
        }
    });
    let mut client = client(&plant).await;
    let mut seen = std::collections::BTreeSet::new();
    while seen.len() < 500 {
        let inputs = client.read_input_registers(0, 58).await.unwrap().unwrap();
        let seq = inputs[10];
        let values = [inputs[41], inputs[47], inputs[53]];
        assert!(seq == 0 || values == [seq; 3], "{seq} {values:?}");
        let serial: String = inputs[16..32].iter().flat_map(|word| word.to_be_bytes()).map(char::from).collect();
        assert!(seq == 0 || serial.trim_end_matches('\0') == seq.to_string(), "{seq} {serial}");
        seen.insert(seq);
    }
    changing.abort();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_port_in_use_is_named_with_its_remedy_until_it_is_free() {
    let mut plant = Plant::new(0);
    let occupied = TcpListener::bind(plant.address).unwrap();
    plant.start();
    let result = delivery(1000, inspection(1, "S1"));
    let reason = async {
        loop {
            match plant.door().deliver(&result).await {
                Err(Undelivered::Unreachable { reason, .. }) if reason.contains("listen on") => return reason,
                _ => tokio::time::sleep(Duration::from_millis(5)).await,
            }
        }
    };
    let reason = tokio::time::timeout(PATIENCE, reason).await.unwrap();
    assert!(reason.contains("end the other program that uses the port"), "{reason}");
    drop(occupied);
    // The result that could not be delivered is already shown.
    let mut client = client(&plant).await;
    assert_eq!(client.read_input_registers(10, 1).await.unwrap().unwrap(), [1]);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_silent_connection_is_closed_and_its_result_waits_for_the_next_one() {
    let mut plant = Plant::new(0);
    plant.patience = Duration::from_millis(200);
    plant.start();
    drop(client(&plant).await);
    let mut silent = TcpStream::connect(plant.address).await.unwrap();
    let result = delivery(1000, inspection(1, "S1"));
    let undelivered = plant.door().deliver(&result).await.unwrap_err();
    assert!(undelivered.to_string().contains("no PLC has sent a request"), "{undelivered}");
    let closed = tokio::time::timeout(PATIENCE, silent.read(&mut [0])).await.unwrap();
    assert_eq!(closed.unwrap(), 0);
    let mut plc = client(&plant).await;
    assert!(is_valid(&plc.read_input_registers(0, 11).await.unwrap().unwrap()));
    plc.write_single_register(3, 1).await.unwrap().unwrap();
    plant.door().deliver(&result).await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_test_message_needs_a_plc_and_shows_nothing() {
    let mut plant = Plant::new(0);
    plant.start();
    let test = Delivery::test("plc");
    let mut connection = client(&plant).await;
    plant.door().deliver(&test).await.unwrap_err();
    connection.read_input_registers(0, 1).await.unwrap().unwrap();
    plant.door().deliver(&test).await.unwrap();
    assert_eq!(connection.read_input_registers(10, 1).await.unwrap().unwrap(), [0]);
}

#[test]
fn only_new_inspections_of_the_chosen_recipes_are_wanted() {
    let settings = Settings { recipes: vec!["bracket".to_owned()], ..Plant::new(0).settings() };
    let door = crate::open(settings.clone()).unwrap();
    let mut event = delivery(1, inspection(1, "S1")).event;
    assert!(door.wants(&event));
    event.body["re_evaluated_from"] = "inspection-0".into();
    assert!(!door.wants(&event), "the part has left long ago");
    event.body = serde_json::json!({ "recipe": "cover@1" });
    assert!(!door.wants(&event));
    event.kind = "scan.created".to_owned();
    assert!(!crate::open(Settings { recipes: Vec::new(), ..settings }).unwrap().wants(&event));
}

#[test]
fn settings_that_cannot_be_used_are_refused() {
    let settings = Plant::new(0).settings();
    let bad = |settings: Settings| crate::open(settings).map(drop).unwrap_err().setting;
    assert_eq!(bad(Settings { name: " ".to_owned(), ..settings.clone() }), "name");
    assert_eq!(bad(Settings { max_connections: 0, ..settings.clone() }), "max_connections");
    assert_eq!(bad(Settings { max_connections: 65, ..settings }), "max_connections");
    let address = (Ipv4Addr::UNSPECIFIED, 502).into();
    let read: Settings = serde_json::from_str(r#"{"name":"plc","listen":"0.0.0.0:502"}"#).unwrap();
    let defaults = Settings {
        name: "plc".to_owned(),
        listen: address,
        writes: false,
        recipes: Vec::new(),
        max_connections: 8,
    };
    assert_eq!(read, defaults);
    serde_json::from_str::<Settings>(r#"{"name":"plc","listen":"0.0.0.0:502","write":true}"#).unwrap_err();
}
