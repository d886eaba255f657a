//! Commands from clients of the broker: each is executed once and answered.
//!
//! A command must not outlive its moment. The broker drops it when its expiry has passed, also while this program is
//! away, and one without an expiry is refused. Inspections start in the order of their commands; Stop does not wait for
//! them.

mod command;
mod line;

#[cfg(test)]
pub use command::Inspect;
pub use command::{Command, Request};
pub use line::{AppLine, Line, Started};

use std::sync::Arc;

use app::error::{AppError, ErrorKind};
use serde_json::{Value, json};
use tokio::sync::mpsc;

use crate::connection::link::Link;
use crate::connection::message::Message;
use crate::connection::subscription::Received;
use crate::params::{ANSWER_EXPIRY_S, COMMANDS_WAITING};
use crate::station::topics::Topics;

/// Where an answer goes.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Address {
    topic: String,
    correlation: Option<Vec<u8>>,
}

/// Executes and answers commands as long as it is polled.
pub async fn serve(link: &Link, topics: &Topics, line: Arc<dyn Line>) {
    let (answers, mut to_send) = mpsc::channel(COMMANDS_WAITING);
    let (in_order, mut waiting) = mpsc::channel::<(Request, Option<Address>)>(COMMANDS_WAITING);
    let topic = topics.commands();
    let receive = async {
        loop {
            let received = link.received(&topic).await;
            let address = address(&received, topics);
            let request = Request::of(&received);
            match request {
                Ok(request) if request.command == Command::Stop => {
                    let (line, answers) = (line.clone(), answers.clone());
                    tokio::spawn(async move {
                        let outcome = execute(&*line, &request).await;
                        answer(&answers, address, &request.id, outcome);
                    });
                }
                Ok(request) => {
                    let id = request.id.clone();
                    if in_order.try_send((request, address.clone())).is_err() {
                        answer(&answers, address, &id, Err(too_many()));
                    }
                }
                Err(refused) => answer(&answers, address, &refused.id, Err(*refused.error)),
            }
        }
    };
    let execute_in_order = async {
        while let Some((request, address)) = waiting.recv().await {
            let outcome = execute(&*line, &request).await;
            answer(&answers, address, &request.id, outcome);
        }
    };
    let send = async {
        while let Some(message) = to_send.recv().await {
            let message: Message = message;
            if let Err(why) = link.publish(&message).await {
                tracing::warn!(topic = message.topic, reason = %why, "an answer was not delivered");
            }
        }
    };
    // None of them ends.
    tokio::select! {
        () = receive => {}
        () = execute_in_order => {}
        () = send => {}
    }
}

async fn execute(line: &dyn Line, Request { id, command }: &Request) -> Result<Value, AppError> {
    match command {
        Command::Inspect(inspect) => {
            let Started { job_id, is_repeated } = line.inspect(id, inspect).await?;
            Ok(json!({ "job_id": job_id, "repeated": is_repeated }))
        }
        Command::Abort { command_id } => line.abort(id, command_id).await.map(|()| json!({})),
        Command::Stop => line.stop(id).await.map(|()| json!({})),
    }
}

fn too_many() -> AppError {
    AppError::new(ErrorKind::TooMany, format!("{COMMANDS_WAITING} commands wait already"))
        .remedy("wait for the answers, then repeat")
}

/// The address of the answer; `None` if none is wanted, or if it cannot be sent there.
fn address(received: &Received, topics: &Topics) -> Option<Address> {
    let topic = received.response_topic.clone()?;
    if topic.is_empty() || topic.contains(['+', '#']) || topic.starts_with('$') || topics.contain(&topic) {
        tracing::warn!(topic, "a command is not answered: its response topic cannot be used");
        return None;
    }
    Some(Address { topic, correlation: received.correlation.clone() })
}

/// Logs the outcome, and hands the answer over to be sent.
fn answer(answers: &mpsc::Sender<Message>, to: Option<Address>, id: &str, outcome: Result<Value, AppError>) {
    let mut body = json!({ "schema": "sheaf-answer/1", "id": id, "accepted": outcome.is_ok() });
    let more = match outcome {
        Ok(more) => more,
        Err(error) => {
            tracing::info!(command = id, error = error.detail, cause = error.cause, "a command was refused");
            let AppError { kind, detail, remedy, pointer, .. } = error;
            json!({ "reason": kind, "detail": detail, "remedy": remedy, "pointer": pointer })
        }
    };
    if let (Some(body), Value::Object(more)) = (body.as_object_mut(), more) {
        body.extend(more);
    }
    let Some(Address { topic, correlation }) = to else { return };
    let message = Message { correlation, ..Message::json(topic, &body, Some(ANSWER_EXPIRY_S)) };
    if answers.try_send(message).is_err() {
        tracing::warn!(command = id, "an answer was not sent: too many wait");
    }
}
