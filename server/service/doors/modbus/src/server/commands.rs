//! Carries out a command, and follows the job of a trigger.

use std::sync::Arc;

use crate::handshake::order::{Order, Task};
use crate::line::Line;
use crate::server::Shared;

/// Carries it out for the client at `source`, and reports the outcome to the handshake.
pub async fn execute(shared: Arc<Shared>, line: Arc<dyn Line>, source: String, order: Order) {
    let outcome = match &order.task {
        Task::Trigger(part) => line.trigger(&source, part).await.map(Some),
        Task::Abort { job_id } => line.abort(&source, job_id).await.map(|()| None),
        Task::Stop => line.stop(&source).await.map(|()| None),
        Task::Prepare { recipe } => line.prepare(*recipe).await.map(|()| None),
    };
    let aborted = shared.handshake.lock().finish(&order, &outcome);
    if let Some(job_id) = aborted
        && let Err(code) = line.abort(&source, &job_id).await
    {
        tracing::warn!(job = job_id, code = code.number(), "an aborted inspection was not cancelled");
    }
    if let Ok(Some(job_id)) = outcome {
        let end = line.ended(&job_id).await;
        shared.handshake.lock().ended(&job_id, end);
    }
}
