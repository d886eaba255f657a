//! The handshake without network and clock.

use std::net::{IpAddr, Ipv4Addr};
use std::time::{Duration, Instant};

use app::doors::{MachineState, OperationalState};
use proptest::prelude::*;

use crate::codes::{AckCode, Exception};
use crate::handshake::order::{Order, Task};
use crate::handshake::results::Offer;
use crate::handshake::{Circumstances, Handshake};
use crate::line::{JobEnd, Station, TriggeredPart};
use crate::registers::map::Table;
use crate::registers::result_block::ResultBlock;
use crate::tests::inspection;

const PLC: IpAddr = IpAddr::V4(Ipv4Addr::new(10, 0, 0, 2));
const PANEL: IpAddr = IpAddr::V4(Ipv4Addr::new(10, 0, 0, 3));

/// A handshake with the time and the station that a test sets.
struct Bench {
    handshake: Handshake,
    at: Circumstances,
    seq: u16,
}

impl Bench {
    fn new() -> Self {
        let now = Instant::now();
        let station = Station {
            state: MachineState::Operational(OperationalState::Ready),
            stopped: false,
            simulated: false,
        };
        let at = Circumstances { from: PLC, station, now };
        let mut bench = Self { handshake: Handshake::new(true, now), at, seq: 7 };
        bench.write(2, &[7]);
        bench.beat();
        bench
    }

    fn later(&mut self, seconds: f64) {
        self.at.now += Duration::from_secs_f64(seconds);
    }

    fn write(&mut self, address: u16, words: &[u16]) -> Option<Order> {
        self.handshake.write(address, words, self.at).unwrap()
    }

    fn beat(&mut self) {
        let before = self.handshake.read(Table::Holding, 0, 1, self.at).unwrap()[0];
        self.write(0, &[before ^ 1]);
    }

    /// A command in a request of its own.
    fn command(&mut self, command: u16) -> Option<Order> {
        self.seq = self.seq.wrapping_add(1);
        self.write(1, &[command, self.seq])
    }

    fn part(&mut self, recipe: u16, serial: &str) {
        let mut bytes = serial.as_bytes().to_vec();
        bytes.resize(32, 0);
        let mut words = vec![0, recipe];
        words.extend(bytes.chunks(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])));
        self.write(4, &words);
    }

    fn input(&mut self, address: u16) -> u16 {
        self.handshake.read(Table::Input, address, 1, self.at).unwrap()[0]
    }

    fn ack(&mut self) -> (u16, u16) {
        (self.input(4), self.input(5))
    }

    fn bit(&mut self, bit: u16) -> bool {
        self.input(3) & 1 << bit != 0
    }

    /// A part that is triggered and whose job has begun.
    fn triggered(&mut self) -> Order {
        self.part(12, "S1");
        let order = self.command(1).unwrap();
        assert_eq!(self.handshake.finish(&order, &Ok(Some("job-1".to_owned()))), None);
        order
    }

    fn offer(&mut self, seq: i64) -> Offer {
        let block = ResultBlock::of(&inspection(seq, "S"));
        self.handshake.results.offer(seq, &block, self.at.now)
    }
}

/// The trigger of part S1.
fn part(recipe: Option<u32>, order: Option<&str>) -> Task {
    Task::Trigger(TriggeredPart { recipe, serial: "S1".to_owned(), order: order.map(str::to_owned) })
}

#[test]
fn a_command_is_executed_when_its_number_changes_and_only_then() {
    let mut bench = Bench::new();
    assert_eq!(bench.ack(), (7, AckCode::Restarted.number()), "the first number after a start");
    bench.part(12, "S1");
    assert_eq!(bench.write(1, &[1]), None, "the command alone");
    let order = bench.write(2, &[8]).unwrap();
    assert_eq!(order, Order { seq: 8, task: part(Some(12), None) });
    assert_eq!(bench.write(0, &[5, 1, 8, 0]), None, "the same number in the next cycle");
    assert_eq!(bench.ack().0, 7, "not before the outcome");
    bench.handshake.finish(&order, &Ok(Some("job-1".to_owned())));
    assert_eq!(bench.ack(), (8, 0));
    assert!(bench.bit(1) && !bench.bit(0), "busy, not ready");
    bench.handshake.ended("job-1", JobEnd::Finished);
    assert!(!bench.bit(1) && bench.bit(0));
    assert_eq!(bench.input(6), 0);
}

#[test]
fn one_request_carries_block_and_command() {
    let mut bench = Bench::new();
    let mut block = vec![1, 1, 8, 0, 0, 0, 0x5331];
    block.resize(22, 0);
    let order = bench.write(0, &block).unwrap();
    assert_eq!(order.task, part(None, None));
}

#[test]
fn a_part_belongs_to_the_order_in_the_registers() {
    let mut bench = Bench::new();
    bench.part(12, "S1");
    bench.write(22, &[0x3437, 0x3131, 0x2D41]);
    let order = bench.command(1).unwrap();
    assert_eq!(order.task, part(Some(12), Some("4711-A")));
    bench.handshake.finish(&order, &Err(AckCode::Unavailable));
    bench.write(22, &[0]);
    assert_eq!(bench.command(1).unwrap().task, part(Some(12), None));
}

#[test]
fn a_trigger_is_refused_with_the_reason() {
    let with = |change: &dyn Fn(&mut Bench)| {
        let mut bench = Bench::new();
        bench.part(12, "S1");
        change(&mut bench);
        assert_eq!(bench.command(1), None);
        assert_eq!(bench.ack().0, bench.seq);
        assert_ne!(bench.ack().1, 0);
        bench.ack().1
    };
    let in_state = |state| with(&|bench| bench.at.station.state = state);
    assert_eq!(in_state(MachineState::Preoperational), AckCode::NotReady.number());
    assert_eq!(in_state(MachineState::Operational(OperationalState::Initialized)), AckCode::NotReady.number());
    assert_eq!(in_state(MachineState::Halted), AckCode::Stopped.number());
    assert_eq!(in_state(MachineState::Error), AckCode::Fault.number());
    assert_eq!(in_state(MachineState::Operational(OperationalState::SingleExecution)), AckCode::Busy.number());
    assert_eq!(with(&|bench| bench.at.station.stopped = true), AckCode::Stopped.number());
    assert_eq!(with(&|bench| bench.later(2.01)), AckCode::PlcSilent.number());
    assert_eq!(with(&|bench| bench.part(12, "")), AckCode::BadSerial.number());
    assert_eq!(with(&|bench| bench.part(12, "   ")), AckCode::BadSerial.number());
    assert_eq!(with(&|bench| drop(bench.write(6, &[0xFFFF]))), AckCode::BadSerial.number());
    assert_eq!(with(&|bench| drop(bench.write(22, &[0xFFFF]))), AckCode::BadSerial.number());
    assert_eq!(with(&|bench| drop(bench.triggered())), AckCode::Busy.number());
    let fill = |bench: &mut Bench| (1..=33).for_each(|seq| bench.handshake.results.note(seq));
    assert_eq!(with(&fill), AckCode::QueueFull.number());
}

#[test]
fn a_silent_plc_can_still_stop_and_a_stop_needs_no_state() {
    for state in [
        MachineState::Preoperational,
        MachineState::Error,
        MachineState::Operational(OperationalState::SingleExecution),
        MachineState::Halted,
    ] {
        let mut bench = Bench::new();
        bench.later(100.0);
        bench.at.station.state = state;
        assert_eq!(bench.command(3), Some(Order { seq: 8, task: Task::Stop }));
    }
}

#[test]
fn of_the_first_commands_after_a_start_only_stop_is_executed() {
    for command in 0..7 {
        let mut bench = Bench::new();
        bench.handshake = Handshake::new(true, bench.at.now);
        bench.part(12, "S1");
        let order = bench.write(0, &[1, command, 8]);
        match command {
            3 => assert_eq!(order, Some(Order { seq: 8, task: Task::Stop })),
            _ => assert_eq!((order, bench.ack()), (None, (8, AckCode::Restarted.number()))),
        }
    }
}

#[test]
fn the_heartbeat_counts_by_its_changes() {
    let mut bench = Bench::new();
    assert!(bench.bit(0) && bench.bit(7));
    bench.later(1.9);
    bench.beat();
    bench.later(1.9);
    assert!(bench.bit(7));
    let same = bench.handshake.read(Table::Holding, 0, 1, bench.at).unwrap();
    bench.write(0, &same);
    bench.later(0.2);
    assert!(!bench.bit(7) && !bench.bit(0), "the same value again is silence");
    let before = bench.input(1);
    bench.later(1.0);
    assert_eq!(bench.input(1), before + 10);
    bench.later(6553.6 - 1.0);
    assert_eq!(bench.input(1), before, "after 65536 steps");
}

#[test]
fn a_stop_during_a_trigger_is_acknowledged_and_the_trigger_does_not_overwrite_that() {
    let mut bench = Bench::new();
    bench.part(12, "S1");
    let trigger = bench.command(1).unwrap();
    let stop = bench.command(3).unwrap();
    bench.handshake.finish(&stop, &Ok(None));
    assert_eq!(bench.ack(), (9, 0));
    bench.handshake.finish(&trigger, &Err(AckCode::Stopped));
    assert_eq!(bench.ack(), (9, 0));
    assert!(!bench.bit(1), "no longer busy");
}

#[test]
fn an_abort_cancels_the_job_or_the_trigger_that_is_not_accepted_yet() {
    let mut bench = Bench::new();
    assert_eq!((bench.command(2), bench.ack().1), (None, 0), "nothing to abort");
    bench.triggered();
    assert_eq!(bench.command(2).unwrap().task, Task::Abort { job_id: "job-1".to_owned() });
    bench.handshake.ended("another", JobEnd::Failed);
    assert!(bench.bit(1));
    bench.handshake.ended("job-1", JobEnd::Cancelled);
    assert_eq!((bench.bit(1), bench.input(6)), (false, 2));

    let trigger = bench.command(1).unwrap();
    assert_eq!((bench.command(2), bench.ack().1), (None, 0));
    let to_cancel = bench.handshake.finish(&trigger, &Ok(Some("job-2".to_owned())));
    assert_eq!(to_cancel.as_deref(), Some("job-2"));
    assert_eq!(bench.input(6), 0, "a new trigger clears the error");
}

#[test]
fn a_prepared_recipe_is_used_by_triggers_without_one() {
    let mut bench = Bench::new();
    bench.part(12, "S1");
    let prepare = bench.command(4).unwrap();
    assert_eq!(prepare.task, Task::Prepare { recipe: 12 });
    bench.handshake.finish(&prepare, &Ok(None));
    assert_eq!(bench.input(37), 12);
    bench.part(0, "S1");
    let order = bench.command(1).unwrap();
    assert_eq!(order.task, part(Some(12), None));
    bench.handshake.finish(&order, &Err(AckCode::NoRecipe));
    bench.command(5);
    assert_eq!((bench.input(37), bench.ack().1), (0, 0));
    assert_eq!((bench.command(4), bench.ack().1), (None, AckCode::NoRecipe.number()), "recipe 0");
}

#[test]
fn valid_is_0_between_two_results_until_the_plc_has_read_it() {
    let mut bench = Bench::new();
    assert_eq!(bench.offer(41), Offer::Waits);
    assert!(bench.bit(2));
    bench.write(3, &[41]);
    assert_eq!(bench.offer(41), Offer::Acknowledged);
    assert_eq!(bench.offer(41), Offer::Acknowledged, "it may be asked again");
    bench.offer(42);
    assert_eq!(bench.input(10), 41);
    bench.at.from = PANEL;
    assert!(!bench.bit(2));
    bench.offer(42);
    assert_eq!(bench.input(10), 41, "another client has read it, not the PLC");
    bench.at.from = PLC;
    assert!(!bench.bit(2));
    bench.offer(42);
    assert_eq!(bench.input(10), 42);
    assert!(bench.bit(2));
    bench.write(3, &[42]);
    bench.offer(43);
    bench.later(1.0);
    bench.offer(43);
    assert_eq!(bench.input(10), 43, "a PLC that does not look is not waited for");
}

#[test]
fn an_acknowledgement_counts_only_while_its_result_is_shown() {
    let mut bench = Bench::new();
    bench.write(3, &[41]);
    bench.offer(41);
    assert!(bench.bit(2), "written before the result was shown");
    bench.write(3, &[40]);
    bench.write(3, &[0]);
    assert!(bench.bit(2));
    bench.write(0, &[3, 0, 7, 41]);
    assert!(!bench.bit(2));
}

#[test]
fn a_result_given_up_for_another_one_is_shown_again_when_it_is_offered_again() {
    let mut bench = Bench::new();
    bench.offer(1);
    bench.offer(2);
    assert!(!bench.bit(2), "also then, valid is 0 in between");
    bench.offer(2);
    assert_eq!((bench.input(10), bench.bit(2)), (2, true));
    bench.offer(1);
    assert!(!bench.bit(2));
    assert_eq!(bench.offer(1), Offer::Waits);
    assert_eq!((bench.input(10), bench.bit(2)), (1, true));
}

#[test]
fn the_queue_is_counted_and_its_limit_shown() {
    let mut bench = Bench::new();
    bench.offer(1);
    for seq in 1..=33 {
        bench.handshake.results.note(seq);
    }
    assert_eq!((bench.input(7), bench.bit(0), bench.bit(5)), (32, false, false));
    bench.handshake.results.note(34);
    assert!(bench.bit(5), "overflow");
    bench.write(3, &[1]);
    assert!(!bench.bit(2));
    bench.offer(2);
    assert_eq!((bench.input(7), bench.bit(5)), (32, false));
}

#[test]
fn writes_are_refused_when_they_are_off() {
    let bench = Bench::new();
    let mut handshake = Handshake::new(false, bench.at.now);
    assert_eq!(handshake.write(0, &[1], bench.at), Err(Exception::Function));
    assert_eq!(handshake.read(Table::Holding, 0, 38, bench.at), Ok(vec![0; 38]));
}

/// What a PLC or the service does.
#[derive(Debug, Clone)]
enum Step {
    Write(u16, Vec<u16>),
    Read(bool, u16, u16),
    Later(u16),
    Offer,
    Acknowledge,
    Finish(bool),
}

fn step() -> impl Strategy<Value = Step> {
    let words = prop::collection::vec(prop_oneof![0..6_u16, any::<u16>()], 1..23);
    let address = || prop_oneof![0..30_u16, 0..2100_u16, any::<u16>()];
    prop_oneof![
        (address(), words).prop_map(|(address, words)| Step::Write(address, words)),
        (any::<bool>(), address(), 0..126_u16)
            .prop_map(|(input, address, count)| Step::Read(input, address, count)),
        (0..3000_u16).prop_map(Step::Later),
        Just(Step::Offer),
        Just(Step::Acknowledge),
        any::<bool>().prop_map(Step::Finish),
    ]
}

proptest! {
    #[test]
    fn whatever_is_written_results_come_in_order_and_only_a_matching_acknowledgement_takes_one(
        steps in prop::collection::vec(step(), 1..200),
    ) {
        let mut bench = Bench::new();
        let (mut offered, mut orders) = (1, Vec::new());
        for step in steps {
            let shown = (bench.input(10), bench.bit(2));
            match step {
                Step::Write(address, words) => {
                    if let Ok(order) = bench.handshake.write(address, &words, bench.at) {
                        orders.extend(order);
                        let acknowledges = usize::from(address) <= 3
                            && words.get(3 - usize::from(address)) == Some(&shown.0);
                        prop_assert!(bench.bit(2) == (shown.1 && !acknowledges));
                    }
                }
                Step::Read(input, address, count) => {
                    let table = if input { Table::Input } else { Table::Holding };
                    let _ = bench.handshake.read(table, address, count, bench.at);
                    prop_assert_eq!(bench.bit(2), shown.1, "reading acknowledges nothing");
                }
                Step::Later(milliseconds) => bench.later(f64::from(milliseconds) / 1000.0),
                Step::Offer => if bench.offer(offered) == Offer::Acknowledged {
                    prop_assert_eq!(i64::from(shown.0), offered);
                    offered += 1;
                },
                Step::Acknowledge => drop(bench.write(3, &[shown.0])),
                Step::Finish(accepted) => if let Some(order) = orders.pop() {
                    let outcome = if accepted { Ok(Some("job".to_owned())) } else { Err(AckCode::Busy) };
                    bench.handshake.finish(&order, &outcome);
                    bench.handshake.ended("job", JobEnd::Finished);
                },
            }
            let all = bench.handshake.read(Table::Input, 10, 50, bench.at).unwrap();
            let seq = all[0];
            prop_assert!(seq == 0 || all[31] == seq && all[37] == seq && all[43] == seq, "a mixture");
        }
    }

    #[test]
    fn a_command_is_executed_once_per_number_over_the_end_of_the_numbers(first in any::<u16>(), n in 1..200_u16) {
        let mut bench = Bench::new();
        bench.write(1, &[0, first]);
        let mut executed = 0;
        for ahead in 1..=n {
            let block = [3, first.wrapping_add(ahead)];
            executed += (0..3).filter_map(|_| bench.write(1, &block)).count();
        }
        prop_assert_eq!(executed, usize::from(n));
    }
}
