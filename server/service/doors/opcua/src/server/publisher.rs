//! Publishes states, events, results and the health of the station to clients.

use std::sync::Arc;

use app::doors::{MachineState, OperationalState};
use opcua::nodes::Event;
use opcua::server::{ServerHandle, SubscriptionCache};
use opcua::types::{DataValue, LocalizedText, NodeId, ObjectId, QualifiedName, StatusCode, Variant};
use parking_lot::Mutex;

use crate::information_model::ids::structures::{JOB_ID, RECIPE_ID_INTERNAL};
use crate::information_model::ids::{events, instances};
use crate::line::{Condition, Finished, Unfinished};
use crate::machine::{OPERATIONAL_NODE, Transition, name, node, path};
use crate::result::{fields, fields_of_unfinished, structure};
use crate::server::event::StationEvent;
use crate::server::health::ShownHealth;
use crate::server::nodes::{Manager, Nodes};

/// Severity of events that report a completed action.
const INFORMATION: u16 = 100;

/// Severity of a fault.
const FAULT: u16 = 800;

/// Publishes to all clients of one server.
pub struct Publisher {
    handle: ServerHandle,
    manager: Arc<Manager>,
    /// Number of the last change that was published, and the state since.
    entered: Mutex<Option<(u64, MachineState)>>,
    health: Mutex<ShownHealth>,
}

impl Publisher {
    /// For this server.
    pub fn new(handle: ServerHandle, manager: Arc<Manager>) -> Self {
        Self { handle, manager, entered: Mutex::new(None), health: Mutex::default() }
    }

    /// Tells the server to end.
    pub fn end(&self) {
        self.handle.cancel();
    }

    /// Publishes the changes of the station since the last condition.
    pub fn follow(&self, condition: &Condition) {
        for (path, value) in self.health.lock().changes(condition) {
            self.set(&path, value);
        }
        self.nodes().running_job.lock().clone_from(&condition.job_id);
        let mut entered = self.entered.lock();
        for &(number, next) in &condition.changes {
            match *entered {
                Some((seen, _)) if number <= seen => continue,
                Some((_, before)) => {
                    for transition in path(before, next) {
                        self.pass(transition, condition);
                    }
                }
                None => {}
            }
            self.show_state(next);
            *entered = Some((number, next));
            self.nodes().shown_change.send_replace(number);
        }
    }

    /// Publishes a result: first the variables, so that the event is never ahead of them.
    pub fn publish_result(&self, finished: &Finished) {
        self.show_result(finished);
        let inspection = &finished.inspection;
        let message = format!("part {}: {}", inspection.serial, inspection.verdict);
        let mut event = self.event(events::RESULT_READY, instances::SYSTEM, INFORMATION, &message);
        for (name, value) in fields(&self.nodes().structures, finished) {
            event = event.with(&[self.name(name)], value);
        }
        self.notify(&event);
    }

    /// Publishes that an inspection ended without a result; the variables keep the latest result.
    pub fn publish_unfinished(&self, unfinished: &Unfinished) {
        let Unfinished { serial, reason, .. } = unfinished;
        let message = format!("part {serial} has no result: {reason}");
        let mut event = self.event(events::RESULT_READY, instances::SYSTEM, FAULT, &message);
        for (name, value) in fields_of_unfinished(&self.nodes().structures, unfinished) {
            event = event.with(&[self.name(name)], value);
        }
        self.notify(&event);
    }

    /// Shows a result in the variables alone.
    pub fn show_result(&self, finished: &Finished) {
        let structures = &self.nodes().structures;
        let parts = fields(structures, finished).into_iter().map(|(name, value)| {
            let path = format!("{}.{name}", instances::LATEST_RESULT);
            (path, value)
        });
        let whole = (instances::LATEST_RESULT.to_owned(), structure(structures, finished));
        for (path, value) in parts.chain([whole]) {
            let id = self.nodes().id(&path);
            // Not every field has a variable.
            let exists = self.manager.address_space().read().node_exists(&id);
            if exists {
                self.set(&path, DataValue::new_now(value));
            }
        }
    }

    /// Publishes that a recipe was prepared.
    pub fn publish_prepared(&self, recipe: &str) {
        let internal = self.nodes().structures.binary_id(RECIPE_ID_INTERNAL, recipe, None, None);
        let message = format!("recipe {recipe} is prepared");
        let event = self.event(events::RECIPE_PREPARED, instances::RECIPES, INFORMATION, &message);
        self.notify(&event.with(&[self.name("InternalId")], internal));
    }

    fn pass(&self, transition: &Transition, condition: &Condition) {
        self.show_state(transition.to);
        let message = format!("{} to {}", name(transition.from), name(transition.to));
        let changed = |number, severity, message: &str| {
            let state = |field: &str, state: MachineState| {
                let text = LocalizedText::new("en", name(state)).into();
                let id: Variant = self.type_node(node(state)).into();
                [(vec![field.into()], text), (vec![field.into(), "Id".into()], id)]
            };
            let mut event = self.event(number, instances::MACHINE, severity, message);
            let of = [state("FromState", transition.from), state("ToState", transition.to)];
            for (path, value) in of.into_iter().flatten() {
                let path: Vec<QualifiedName> = path;
                event = event.with(&path, value);
            }
            let name = LocalizedText::new("en", transition.name);
            let id = self.type_node(transition.node);
            event.with(&["Transition".into()], name.into()).with(&["Transition".into(), "Id".into()], id.into())
        };
        self.notify(&changed(events::STATE_CHANGED, INFORMATION, &message));
        let job_id = self.nodes().structures.id(JOB_ID, condition.job_id.as_deref().unwrap_or_default());
        let of_job = |number, message| {
            let event = self.event(number, instances::AUTOMATIC, INFORMATION, message);
            event.with(&[self.name("JobId")], job_id.clone())
        };
        match (transition.from, transition.to) {
            (_, MachineState::Error) => {
                let fault = condition.fault.as_deref().unwrap_or("the station is in error");
                self.notify(&changed(events::ERROR, FAULT, fault));
            }
            (MachineState::Error, _) => {
                self.notify(&changed(events::ERROR_RESOLVED, INFORMATION, "the error is resolved"))
            }
            (_, MachineState::Operational(OperationalState::SingleExecution)) => {
                self.notify(&of_job(events::JOB_STARTED, "a job has started"))
            }
            (_, MachineState::Operational(OperationalState::Ready)) => {
                self.notify(&of_job(events::READY, "ready"))
            }
            _ => {}
        }
    }

    /// Both state machines; the inner one has no state outside of Operational.
    fn show_state(&self, state: MachineState) {
        let own = (name(state), node(state), state.number());
        let is_operational = matches!(state, MachineState::Operational(_));
        let outer = match is_operational {
            true => ("Operational", OPERATIONAL_NODE, MachineState::OPERATIONAL_NUMBER),
            false => own,
        };
        self.show_machine(instances::MACHINE, outer, StatusCode::Good);
        let status = if is_operational { StatusCode::Good } else { StatusCode::BadStateNotActive };
        self.show_machine(instances::AUTOMATIC, own, status);
    }

    fn show_machine(&self, machine: &str, (name, node, number): (&str, u32, u16), status: StatusCode) {
        let values: [(&str, Variant); 3] = [
            ("CurrentState", LocalizedText::new("en", name).into()),
            ("CurrentState.Id", self.type_node(node).into()),
            ("CurrentState.Number", u32::from(number).into()),
        ];
        for (part, value) in values {
            let value = if status.is_good() { value } else { Variant::Empty };
            let value = DataValue { status: Some(status), ..DataValue::new_now(value) };
            self.set(&format!("{machine}.{part}"), value);
        }
    }

    fn set(&self, path: &str, value: DataValue) {
        let id = self.nodes().id(path);
        if let Err(status) = self.manager.set_value(self.subscriptions(), &id, None, value) {
            tracing::error!(path, %status, "a variable cannot be set");
        }
    }

    fn event(&self, number: u32, source: &str, severity: u16, message: &str) -> StationEvent {
        let name = source.rsplit('.').next().unwrap_or(source);
        StationEvent::new(self.type_node(number), (&self.nodes().id(source), name), severity, message)
    }

    /// Clients subscribe to the events of the server, or of the vision system.
    fn notify(&self, event: &StationEvent) {
        let event: &dyn Event = event;
        let (server, system) = (ObjectId::Server.into(), self.nodes().id(instances::SYSTEM));
        self.subscriptions().notify_events([(event, &server), (event, &system)].into_iter());
    }

    fn subscriptions(&self) -> &SubscriptionCache {
        self.handle.subscriptions()
    }

    fn nodes(&self) -> &Nodes {
        self.manager.inner()
    }

    fn type_node(&self, number: u32) -> NodeId {
        NodeId::new(self.nodes().types, number)
    }

    fn name(&self, name: &str) -> QualifiedName {
        QualifiedName::new(self.nodes().types, name)
    }
}
