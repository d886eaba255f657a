//! What a command says.

use std::collections::BTreeMap;

use app::error::{AppError, ErrorKind};
use app::inspections::InspectedPart;
use app::recipes::RecipeRef;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::connection::subscription::Received;
use crate::params::{COMMAND_EXPIRY_S, COMMAND_ID_CHARS};

/// A command with its id.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// Chosen by the client: the same id again is the same command.
    pub id: String,
    /// What to do.
    pub command: Command,
}

/// What a client can command.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Inspect a part.
    Inspect(Inspect),
    /// Cancel an inspection.
    Abort {
        /// Id of the command that started it.
        command_id: String,
    },
    /// Stop the station.
    Stop,
}

/// An inspection to be started.
#[derive(Debug, Clone, PartialEq)]
pub struct Inspect {
    /// The recipe; without it, it is selected by serial number.
    pub recipe: Option<RecipeRef>,
    /// The part.
    pub part: InspectedPart,
    /// The same inspection again has the same text.
    pub identity: String,
}

/// A message that is no command to be executed.
#[derive(Debug, Clone, PartialEq)]
pub struct Refused {
    /// Its id, if it has one.
    pub id: String,
    /// Why.
    pub error: Box<AppError>,
}

#[derive(Deserialize)]
#[serde(tag = "command", rename_all = "snake_case", deny_unknown_fields)]
enum Body {
    Inspect {
        id: String,
        serial: String,
        #[serde(default)]
        recipe: Option<Value>,
        #[serde(default)]
        order: Option<String>,
        #[serde(default)]
        attributes: BTreeMap<String, String>,
    },
    Abort {
        id: String,
        command_id: String,
    },
    Stop {
        id: String,
    },
}

impl Request {
    /// Reads a message.
    ///
    /// # Errors
    /// It is retained, has no short expiry, or is malformed.
    pub fn of(received: &Received) -> Result<Self, Refused> {
        let body: Value = serde_json::from_slice(&received.payload).unwrap_or_default();
        let id = body["id"].as_str().unwrap_or_default().to_owned();
        match check(received).and_then(|()| parse(body)) {
            Ok(command) => Ok(Self { id, command }),
            Err(error) => Err(Refused { id, error: Box::new(error) }),
        }
    }
}

fn check(received: &Received) -> Result<(), AppError> {
    if received.retained {
        return Err(bad("a retained message is not executed", "publish the command without retain"));
    }
    match received.expiry_s {
        Some(expiry_s) if (1..=COMMAND_EXPIRY_S).contains(&expiry_s) => Ok(()),
        _ => {
            let remedy = format!("publish the command with a message expiry of 1 to {COMMAND_EXPIRY_S} s");
            Err(bad("the command has no expiry, or a long one: it might be executed much later", &remedy))
        }
    }
}

fn parse(body: Value) -> Result<Command, AppError> {
    let remedy = "send an object such as {\"id\": \"c-1\", \"command\": \"inspect\", \"serial\": \"S1\", \
        \"recipe\": \"bracket\"}, or with abort and command_id, or with stop";
    let body: Body = serde_json::from_value(body)
        .map_err(|error| bad("the message is not a command", remedy).because(error.to_string()))?;
    let (Body::Inspect { id, .. } | Body::Abort { id, .. } | Body::Stop { id }) = &body;
    if id.is_empty() || id.chars().count() > COMMAND_ID_CHARS || id.contains(char::is_control) {
        let remedy = format!("send 1 to {COMMAND_ID_CHARS} characters that are new for every command");
        return Err(bad("the id of the command cannot be used", &remedy).at("/id"));
    }
    match body {
        Body::Inspect { serial, recipe, order, attributes, .. } => {
            let part = InspectedPart { serial, order, attributes };
            let identity = json!([recipe, part]).to_string();
            Ok(Command::Inspect(Inspect { recipe: recipe_ref(recipe)?, part, identity }))
        }
        Body::Abort { command_id, .. } => Ok(Command::Abort { command_id }),
        Body::Stop { .. } => Ok(Command::Stop),
    }
}

fn recipe_ref(recipe: Option<Value>) -> Result<Option<RecipeRef>, AppError> {
    let text = match recipe {
        None | Some(Value::Null) => return Ok(None),
        Some(Value::String(text)) => text,
        Some(other) => other.to_string(),
    };
    let refused = || {
        bad(&format!("\"{text}\" is not a recipe"), "give an id, id@version or the recipe's number").at("/recipe")
    };
    RecipeRef::parse(&text).map(Some).ok_or_else(refused)
}

fn bad(detail: &str, remedy: &str) -> AppError {
    AppError::new(ErrorKind::BadRequest, detail).remedy(remedy)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn received(body: &Value) -> Received {
        Received {
            payload: body.to_string().into_bytes(),
            retained: false,
            expiry_s: Some(COMMAND_EXPIRY_S),
            response_topic: None,
            correlation: None,
        }
    }

    fn refused(received: &Received) -> AppError {
        let refused = Request::of(received).unwrap_err();
        assert!(refused.error.remedy.is_some(), "{refused:?}");
        *refused.error
    }

    #[test]
    fn commands_are_read_with_all_their_fields() {
        let check = |body: Value, command: Command| {
            assert_eq!(Request::of(&received(&body)).unwrap(), Request { id: "c-1".to_owned(), command });
        };
        check(json!({ "id": "c-1", "command": "stop" }), Command::Stop);
        let abort = Command::Abort { command_id: "c-0".to_owned() };
        check(json!({ "id": "c-1", "command": "abort", "command_id": "c-0" }), abort);
        let body = json!({
            "id": "c-1", "command": "inspect", "serial": "S1", "recipe": 12, "order": "A-7", "attributes": { "line": "2" }
        });
        let Command::Inspect(inspect) = Request::of(&received(&body)).unwrap().command else { panic!() };
        assert_eq!(inspect.recipe, Some(RecipeRef::Number(12)));
        let attributes = BTreeMap::from([("line".to_owned(), "2".to_owned())]);
        let part = InspectedPart { serial: "S1".to_owned(), order: Some("A-7".to_owned()), attributes };
        assert_eq!(inspect.part, part);
    }

    #[test]
    fn what_may_be_executed_too_late_is_refused() {
        let stop = received(&json!({ "id": "c-1", "command": "stop" }));
        for expiry_s in [None, Some(0), Some(COMMAND_EXPIRY_S + 1)] {
            let error = refused(&Received { expiry_s, ..stop.clone() });
            assert!(error.detail.contains("expiry"), "{expiry_s:?}: {error:?}");
        }
        assert!(refused(&Received { retained: true, ..stop }).detail.contains("retained"));
    }

    #[test]
    fn what_is_no_command_is_refused_and_keeps_its_id() {
        let inspect = json!({ "id": "c-1", "command": "inspect", "serial": "S1" });
        let with = |name: &str, value: Value| {
            let mut body = inspect.clone();
            body[name] = value;
            body
        };
        for body in [
            json!(null),
            json!("stop"),
            json!({ "command": "stop" }),
            json!({ "id": "", "command": "stop" }),
            json!({ "id": "x".repeat(COMMAND_ID_CHARS + 1), "command": "stop" }),
            json!({ "id": "c\n1", "command": "stop" }),
            json!({ "id": "c-1", "command": "reset" }),
            json!({ "id": "c-1", "command": "stop", "serial": "S1" }),
            json!({ "id": "c-1", "command": "inspect" }),
            with("part", json!("S1")),
            with("recipe", json!("bracket@x")),
        ] {
            let _ = refused(&received(&body));
        }
        let unreadable = Received { payload: b"\xff".to_vec(), ..received(&inspect) };
        let _ = refused(&unreadable);
        assert_eq!(Request::of(&received(&with("part", json!(1)))).unwrap_err().id, "c-1");
    }
}
