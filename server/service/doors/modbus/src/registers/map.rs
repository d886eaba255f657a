//! The register map. Addresses are those on the wire, from 0; nothing else in this crate contains an address.

/// Version of the map, which a PLC can check; it changes when the meaning of a register does.
pub const MAP_VERSION: u16 = 1;

/// The value of [`WORD_ORDER`]: 449A 5000 in the right word order.
pub const WORD_ORDER_TEST: f32 = 1234.5;

/// Number of input registers.
pub const INPUT_WORDS: usize = 1000;

/// Number of holding registers that a PLC writes.
pub const HOLDING_WORDS: usize = 38;

/// Holding registers from here on mirror the input registers, for a PLC without function 4.
pub const MIRROR: usize = 1000;

/// Address of the first characteristic.
const CHARACTERISTICS: usize = 40;

/// Registers per characteristic.
pub const CHARACTERISTIC_WORDS: usize = 6;

/// Characteristics that have room in the input registers.
pub const MAX_CHARACTERISTICS: usize = (INPUT_WORDS - CHARACTERISTICS) / CHARACTERISTIC_WORDS;

/// A table of registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Table {
    /// Read with function 4, and with function 3 at 1000 more.
    Input,
    /// Written with functions 6 and 16, read with function 3.
    Holding,
}

/// Who may do what.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Access {
    /// A PLC reads.
    Read,
    /// A PLC reads and writes.
    Write,
}

/// The type of a value, high word first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kind {
    /// 16 bits, unsigned.
    U16,
    /// 32 bits, unsigned.
    U32,
    /// 32 bits, signed.
    I32,
    /// IEEE 754, 32 bits.
    F32,
    /// 64 bits, unsigned.
    U64,
    /// UTF-8 in this number of registers, first byte in the high byte, filled up with 0, without a length.
    Text(usize),
}

impl Kind {
    /// Number of registers.
    pub const fn words(self) -> usize {
        match self {
            Self::U16 => 1,
            Self::U32 | Self::I32 | Self::F32 => 2,
            Self::U64 => 4,
            Self::Text(words) => words,
        }
    }
}

/// A value in the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Register {
    /// Where.
    pub table: Table,
    /// Address of its first register, as on the wire; of the first characteristic if it is repeated.
    pub address: usize,
    /// Its type.
    pub kind: Kind,
    /// Its name.
    pub name: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// Whether each characteristic has one, `CHARACTERISTIC_WORDS` registers apart.
    pub repeated: bool,
}

impl Register {
    /// Who may do what.
    pub fn access(&self) -> Access {
        match self.table {
            Table::Input => Access::Read,
            Table::Holding => Access::Write,
        }
    }
}

const fn holding(address: usize, kind: Kind, name: &'static str, meaning: &'static str) -> Register {
    Register { table: Table::Holding, address, kind, name, meaning, repeated: false }
}

const fn input(address: usize, kind: Kind, name: &'static str, meaning: &'static str) -> Register {
    Register { table: Table::Input, address, kind, name, meaning, repeated: false }
}

const fn of_each(offset: usize, kind: Kind, name: &'static str, meaning: &'static str) -> Register {
    Register { repeated: true, ..input(CHARACTERISTICS + offset, kind, name, meaning) }
}

macro_rules! map {
    ($($constant:ident = $register:expr;)*) => {
        $(#[doc = "See the meaning in the map."] pub const $constant: Register = $register;)*

        /// Every register.
        const ALL: &[Register] = &[$($constant),*];
    };
}

map! {
    PLC_HEARTBEAT = holding(0, Kind::U16, "plc_heartbeat",
        "A PLC changes it at least every 2 s; while it is silent, no trigger is accepted.");
    COMMAND = holding(1, Kind::U16, "command",
        "The command to be executed, see the list of commands.");
    COMMAND_SEQ = holding(2, Kind::U16, "command_seq",
        "A change executes the command, with recipe, serial number and order as they are then. Write it last, or all in one \
         request. The first value after a start of the server executes nothing but stop: ack_code is 10.");
    RESULT_ACK = holding(3, Kind::U16, "result_ack",
        "Written with the value of result_seq: the PLC has taken the result. valid becomes 0, then the next one is shown.");
    TRIGGER_RECIPE = holding(4, Kind::U32, "recipe",
        "Number of the recipe for trigger and prepare; 0: the prepared one, or else by serial number.");
    TRIGGER_SERIAL = holding(6, Kind::Text(16), "serial",
        "Serial number of the part for trigger.");
    TRIGGER_ORDER = holding(22, Kind::Text(16), "order",
        "Number of the order for trigger, passed on with the result; empty: none.");

    VERSION = input(0, Kind::U16, "map_version", "Version of this map: 1.");
    HEARTBEAT = input(1, Kind::U16, "heartbeat", "Increases by 1 every 100 ms, 65535 to 0.");
    STATE = input(2, Kind::U16, "state",
        "State of the station: 1 preoperational, 2 halted, 3 error, 5 initialized, 6 ready, 7 a job runs, 8 live view.");
    STATUS = input(3, Kind::U16, "status", "Bits, see the list of status bits.");
    ACK_SEQ = input(4, Kind::U16, "ack_seq", "The last command_seq that was executed or refused.");
    ACK_CODE = input(5, Kind::U16, "ack_code", "Its outcome, see the list of ack codes.");
    ERROR = input(6, Kind::U16, "error",
        "How the last trigger ended: 0 not yet, or with a result; 1 failed; 2 aborted or stopped. Without a result, none \
         is shown.");
    QUEUED = input(7, Kind::U16, "queued", "Number of results that wait behind the one shown.");
    WORD_ORDER = input(8, Kind::F32, "word_order_test", "Always 1234.5.");

    RESULT_SEQ = input(10, Kind::U16, "result_seq",
        "Number of the result shown: (number of the inspection - 1) modulo 65535 + 1; 0: none yet. A \
         number that is not ahead of the last one taken is a result that comes again: acknowledge it again.");
    VERDICT = input(11, Kind::U16, "verdict",
        "The part: 1 ok, 2 not ok, 3 undecided, 4 invalid. Accept only 1.");
    N_CHARACTERISTICS = input(12, Kind::U16, "n",
        "Number of characteristics; beyond 160 they have no registers, but count for the verdict.");
    RECIPE_VERSION = input(13, Kind::U16, "recipe_version", "Version of the recipe.");
    RECIPE_NUMBER = input(14, Kind::U32, "recipe_number", "Number of the recipe; 0: it has none.");
    SERIAL = input(16, Kind::Text(16), "serial", "Serial number of the part, cut off after 32 bytes.");
    TIME_US = input(32, Kind::U64, "time", "Time of the verdict, µs since 1970, UTC.");
    PREPARED = input(36, Kind::U32, "prepared_recipe", "Number of the prepared recipe; 0: none.");

    VALUE = of_each(0, Kind::I32, "value",
        "The value in 0.0001 of its unit (mm or °); -2147483648 (8000 0000 hex): invalid.");
    VALUE_VERDICT = of_each(2, Kind::U16, "value_verdict",
        "0 no limits, 1 ok, 2 not ok, 3 undecided, 4 invalid.");
    UNCERTAINTY = of_each(3, Kind::U16, "uncertainty",
        "Expanded uncertainty in 0.0001 of the unit, rounded up; 65535: unknown, or 6.5535 and more.");
    VALUE_F32 = of_each(4, Kind::F32, "value_f32", "The value in its unit; NaN: invalid.");
}

/// The map: every register that is not reserved. Reserved input registers are 0.
pub fn register_map() -> &'static [Register] {
    ALL
}

#[cfg(test)]
mod tests {
    use app::doors::MachineState;

    use super::*;

    #[test]
    fn registers_do_not_overlap_and_fit_into_their_table() {
        for (table, size) in [(Table::Input, INPUT_WORDS), (Table::Holding, HOLDING_WORDS)] {
            let mut used = vec![None; size];
            for one in ALL.iter().filter(|one| one.table == table) {
                let n = if one.repeated { MAX_CHARACTERISTICS } else { 1 };
                for first in (0..n).map(|idx| one.address + idx * CHARACTERISTIC_WORDS) {
                    for word in &mut used[first..first + one.kind.words()] {
                        assert_eq!(word.replace(one.name), None, "{} at {first}", one.name);
                    }
                }
            }
        }
        assert_eq!(MAX_CHARACTERISTICS, 160, "as in the meaning of n");
    }

    #[test]
    fn the_state_register_names_every_number_of_the_standard() {
        for state in MachineState::ALL {
            let number = format!(" {} ", state.number());
            assert!(STATE.meaning.contains(&number), "{state:?}: {}", STATE.meaning);
        }
    }

    #[test]
    fn every_register_is_where_plc_programs_expect_it() {
        let at = |table| {
            let of_table = ALL.iter().filter(|one| one.table == table);
            of_table.map(|one| (one.address, one.name)).collect::<Vec<_>>()
        };
        let holding = [
            (0, "plc_heartbeat"),
            (1, "command"),
            (2, "command_seq"),
            (3, "result_ack"),
            (4, "recipe"),
            (6, "serial"),
            (22, "order"),
        ];
        assert_eq!(at(Table::Holding), holding);
        let input = [
            (0, "map_version"),
            (1, "heartbeat"),
            (2, "state"),
            (3, "status"),
            (4, "ack_seq"),
            (5, "ack_code"),
            (6, "error"),
            (7, "queued"),
            (8, "word_order_test"),
            (10, "result_seq"),
            (11, "verdict"),
            (12, "n"),
            (13, "recipe_version"),
            (14, "recipe_number"),
            (16, "serial"),
            (32, "time"),
            (36, "prepared_recipe"),
            (40, "value"),
            (42, "value_verdict"),
            (43, "uncertainty"),
            (44, "value_f32"),
        ];
        assert_eq!(at(Table::Input), input);
    }
}
