//! The map in print: as a table for PLC tools, and for documentation.

use crate::codes::{AckCode, Command, StatusBit};
use crate::registers::map::{Access, CHARACTERISTIC_WORDS, Kind, Register, Table, register_map};

/// Beginning of the document.
const HEAD: &str = "# Modbus register map\n\n\
    Addresses are those on the wire, from 0; manuals of some PLCs count from 1, 30001 or 40001. Values of more than 16 \
    bits have the high word first. The handshake is described in [doors](../server/docs/service/doors.md#modbus-tcp); \
    [modbus.csv](modbus.csv) is the same map for PLC tools. This page is generated from the program by `cargo xtask \
    openapi`.\n";

/// The map as CSV (RFC 4180, UTF-8), one row per register.
pub fn csv() -> String {
    let mut lines = vec!["table,address,words,type,access,name,meaning".to_owned()];
    lines.extend(register_map().iter().map(|one| {
        let meaning = one.meaning.replace('"', "\"\"");
        let [table, address, kind, access] = columns(one);
        format!("{table},{address},{},{kind},{access},{},\"{meaning}\"", one.kind.words(), one.name)
    }));
    lines.join("\r\n") + "\r\n"
}

/// The map as Markdown: a table of registers, and lists of commands, codes and bits.
pub fn markdown() -> String {
    let mut lines = vec![HEAD.to_owned()];
    for (table, title) in [
        (Table::Holding, "Holding registers, written by the PLC (functions 6, 16; read with 3)"),
        (Table::Input, "Input registers, read by the PLC (function 4, or 3 at 1000 more)"),
    ] {
        lines.push(format!("## {title}\n\n| address | type | access | name | meaning |\n|---|---|---|---|---|"));
        lines.extend(register_map().iter().filter(|one| one.table == table).map(|one| {
            let [_, address, kind, access] = columns(one);
            format!("| {address} | {kind} | {access} | `{}` | {} |", one.name, one.meaning)
        }));
        lines.push(String::new());
    }
    let commands = Command::ALL.map(|one| (one.number(), one.meaning()));
    let codes = AckCode::ALL.map(|one| (one.number(), one.meaning()));
    let bits = StatusBit::ALL.map(|one| (one.number(), one.meaning()));
    lines.extend([list("command", &commands), list("ack_code", &codes), list("bit of status", &bits)]);
    lines.join("\n")
}

fn list(what: &str, rows: &[(u16, &'static str)]) -> String {
    let rows: Vec<String> = rows.iter().map(|(number, meaning)| format!("| {number} | {meaning} |\n")).collect();
    format!("| {what} | meaning |\n|---|---|\n{}", rows.concat())
}

/// Table, address, type and access.
fn columns(one: &Register) -> [String; 4] {
    let table = match one.table {
        Table::Input => "input",
        Table::Holding => "holding",
    };
    let repeated = if one.repeated { format!(" + {CHARACTERISTIC_WORDS} i") } else { String::new() };
    let kind = match one.kind {
        Kind::U16 => "u16".to_owned(),
        Kind::U32 => "u32".to_owned(),
        Kind::I32 => "i32".to_owned(),
        Kind::F32 => "f32".to_owned(),
        Kind::U64 => "u64".to_owned(),
        Kind::Text(words) => format!("text {}", 2 * words),
    };
    let access = match one.access() {
        Access::Read => "r",
        Access::Write => "rw",
    };
    [table.to_owned(), format!("{}{repeated}", one.address), kind, access.to_owned()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_register_command_code_and_bit_is_in_print() {
        let (csv, markdown) = (csv(), markdown());
        assert_eq!(csv.lines().count(), register_map().len() + 1);
        assert!(csv.contains("input,40 + 6 i,2,i32,r,value,\"The value in 0.0001"), "{csv}");
        assert!(markdown.contains("| 6 | text 32 | rw | `serial` | Serial number of the part for trigger. |"));
        assert!(register_map().iter().all(|one| markdown.contains(one.name) && markdown.contains(one.meaning)));
        assert!(AckCode::ALL.iter().all(|one| markdown.contains(one.meaning())));
        assert!(!register_map().iter().any(|one| one.meaning.contains('|')), "it would break the table");
    }
}
