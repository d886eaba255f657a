//! `sheaf devices`: lists the devices attached to this computer.

use std::fmt::Write as _;

use devices::Found;
use serde_json::{Value, json};

use crate::commands::Answer;
use crate::drivers::found;

/// Lists the attached devices. No device is opened: nothing moves, and no laser is turned on.
pub fn run() -> Answer {
    let found = found();
    let (mut text, mut rows) = (String::new(), Vec::new());
    for (kind, makes, devices) in &found {
        let makes: Vec<&str> = makes.names().collect();
        for device in devices {
            let _ = writeln!(text, "{}", line(kind, &makes, device));
            rows.push(to_json(kind, &makes, device));
        }
    }
    if rows.is_empty() {
        text.push_str("no devices found; check cables, power and the permissions of this user\n");
    }
    Answer::done(text, json!({ "devices": rows }))
}

fn line(kind: &str, makes: &[&str], device: &Found) -> String {
    let product = format!("{} {}", device.vendor, device.model);
    let at = if device.address.is_empty() { String::new() } else { format!("  at {}", device.address) };
    let in_use = device.in_use_by.as_ref().map_or_else(String::new, |holder| format!("  in use by {holder}"));
    let what =
        format!("{kind:<8}  {:<14}  station.{kind}.{} = {:?}", makes.join(", "), device.setting, device.value);
    format!("{what}  {}{at}{in_use}", product.trim()).trim_end().to_owned()
}

fn to_json(kind: &str, makes: &[&str], device: &Found) -> Value {
    json!({
        "kind": kind,
        "makes": makes,
        "setting": format!("station.{kind}.{}", device.setting),
        "value": device.value,
        "vendor": device.vendor,
        "model": device.model,
        "address": device.address,
        "in_use_by": device.in_use_by,
    })
}
