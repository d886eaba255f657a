//! Events.

use std::sync::atomic::{AtomicU64, Ordering};

use opcua::nodes::{BaseEventType, Event, EventField};
use opcua::types::{
    AttributeId, ByteString, DateTime, LocalizedText, NodeId, NumericRange, QualifiedName, Variant,
};

/// Number of the next event.
static NEXT: AtomicU64 = AtomicU64::new(1);

/// An event of the vision system: the fields of `BaseEventType`, and those of its own type.
pub struct StationEvent {
    base: BaseEventType,
    fields: Vec<(Vec<QualifiedName>, Variant)>,
}

impl StationEvent {
    /// Now, from this node. `severity`: 1 to 1000.
    pub fn new(of: NodeId, source: (&NodeId, &str), severity: u16, message: &str) -> Self {
        let now = DateTime::now();
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let id = [now.ticks().to_be_bytes(), number.to_be_bytes()].concat();
        let base = BaseEventType::new(of, ByteString::from(id), LocalizedText::new("en", message), now)
            .set_source_node(source.0.clone())
            .set_source_name(source.1.into())
            .set_severity(severity);
        Self { base, fields: Vec::new() }
    }

    /// With a field of its own type.
    pub fn with(mut self, path: &[QualifiedName], value: Variant) -> Self {
        self.fields.push((path.to_vec(), value));
        self
    }
}

impl EventField for StationEvent {
    fn get_value(&self, attribute: AttributeId, range: &NumericRange, path: &[QualifiedName]) -> Variant {
        if attribute == AttributeId::Value
            && let Some((_, value)) = self.fields.iter().find(|(own, _)| own == path)
        {
            return value.clone();
        }
        self.base.get_value(attribute, range, path)
    }
}

impl Event for StationEvent {
    /// By path alone: clients that subscribe to several types ask for the common fields as those of the first type.
    fn get_field(
        &self,
        _of: &NodeId,
        attribute: AttributeId,
        range: &NumericRange,
        path: &[QualifiedName],
    ) -> Variant {
        self.get_value(attribute, range, path)
    }

    fn time(&self) -> &DateTime {
        &self.base.time
    }

    fn event_type_id(&self) -> &NodeId {
        &self.base.event_type
    }
}
