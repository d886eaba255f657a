//! Instances of the types: copies of what a type declares.

use opcua::nodes::{
    AccessLevel, Base, DefaultTypeTree, EventNotifier, HasNodeId as _, Method, Node, NodeType, Object, TypeTree,
    Variable,
};
use opcua::server::address_space::AddressSpace;
use opcua::types::{
    BrowseDirection, DataEncoding, DataValue, LocalizedText, NodeId, NumericRange, ObjectId, QualifiedName,
    ReferenceTypeId, TimestampsToReturn,
};

use crate::information_model::ids::instances::{self, OPTIONAL};
use crate::information_model::ids::types;

/// Builds the vision system below the folder Objects, which belongs to another node manager.
pub struct Instances<'a> {
    /// Nodes.
    pub space: &'a mut AddressSpace,
    /// Index of the namespace of the types of OPC 40100-1.
    pub types: u16,
    /// Index of the namespace of OPC 10000-100.
    pub devices: u16,
    /// Index of the namespace of the instances.
    pub namespace: u16,
}

impl Instances<'_> {
    /// Adds the vision system.
    pub fn add_vision_system(&mut self) {
        let of = NodeId::new(self.types, types::VISION_SYSTEM);
        let system = self.id(instances::SYSTEM);
        let name = QualifiedName::new(self.namespace, instances::SYSTEM);
        let mut object = Object::new(&system, name, instances::SYSTEM, EventNotifier::SUBSCRIBE_TO_EVENTS);
        set_description(&mut object, "the multi-line laser scanner of this station");
        self.space.insert::<_, ReferenceTypeId>(object, None);
        self.space.insert_reference(&ObjectId::ObjectsFolder.into(), &system, ReferenceTypeId::Organizes);
        self.space.insert_reference(&ObjectId::Server.into(), &system, ReferenceTypeId::HasNotifier);
        self.space.insert_reference(&system, &of, ReferenceTypeId::HasTypeDefinition);
        self.copy_children(&of, &system, instances::SYSTEM);
        self.add_state_number(instances::MACHINE);
        self.add_state_number(instances::AUTOMATIC);
        self.add_latest_result();
        self.add_health();
    }

    /// The instance with this path.
    pub fn id(&self, path: &str) -> NodeId {
        NodeId::new(self.namespace, path)
    }

    /// Copies what `declared` has into `instance`: all that is mandatory, and what is listed of the rest.
    fn copy_children(&mut self, declared: &NodeId, instance: &NodeId, path: &str) {
        for (reference, child) in self.children(declared) {
            let Some(node) = self.space.find_node(&child) else { continue };
            let name = node.as_node().browse_name().clone();
            let child_path = format!("{path}.{}", name.name);
            let is_mandatory = self.rule(&child) == Some(ObjectId::ModellingRule_Mandatory.into());
            if !is_mandatory && !OPTIONAL.contains(&child_path.as_str()) {
                continue;
            }
            let id = self.id(&child_path);
            let Some(copy) = copy(node, &id) else { continue };
            let definition = self.targets(&child, ReferenceTypeId::HasTypeDefinition).pop();
            self.space.insert::<_, ReferenceTypeId>(copy, None);
            self.space.insert_reference(instance, &id, reference);
            if let Some(definition) = definition {
                self.space.insert_reference(&id, &definition, ReferenceTypeId::HasTypeDefinition);
            }
            self.copy_children(&child, &id, &child_path);
        }
    }

    fn children(&self, of: &NodeId) -> Vec<(NodeId, NodeId)> {
        [ReferenceTypeId::HasComponent, ReferenceTypeId::HasProperty, ReferenceTypeId::Organizes]
            .into_iter()
            .flat_map(|reference| {
                self.targets(of, reference).into_iter().map(move |child| (reference.into(), child))
            })
            .collect()
    }

    fn rule(&self, of: &NodeId) -> Option<NodeId> {
        self.targets(of, ReferenceTypeId::HasModellingRule).pop()
    }

    fn targets(&self, of: &NodeId, reference: ReferenceTypeId) -> Vec<NodeId> {
        let no_subtypes = DefaultTypeTree::new();
        let no_subtypes: &dyn TypeTree = &no_subtypes;
        let found =
            self.space.find_references(of, Some((reference, false)), no_subtypes, BrowseDirection::Forward);
        found.map(|reference| reference.target_node.clone()).collect()
    }

    /// The number of the state, which a PLC compares more easily than its node.
    fn add_state_number(&mut self, machine: &str) {
        let state = self.id(&format!("{machine}.CurrentState"));
        let number = self.id(&format!("{machine}.CurrentState.Number"));
        let variable = Variable::new(&number, QualifiedName::new(0, "Number"), "Number", 0_u32);
        self.space.insert::<_, ReferenceTypeId>(variable, None);
        self.space.insert_reference(&state, &number, ReferenceTypeId::HasProperty);
        let definition = opcua::types::VariableTypeId::PropertyType.into();
        self.space.insert_reference(&number, &definition, ReferenceTypeId::HasTypeDefinition);
    }

    fn add_latest_result(&mut self) {
        let (folder, id) = (self.id(instances::RESULT_FOLDER), self.id(instances::LATEST_RESULT));
        let of = NodeId::new(self.types, types::RESULT);
        let base = Base::new(
            opcua::types::NodeClass::Variable,
            &id,
            QualifiedName::new(self.namespace, "LatestResult"),
            "LatestResult",
        );
        let data_type = NodeId::new(self.types, super::ids::structures::RESULT);
        let variable = variable(base, data_type, -1, DataValue::null(), None);
        self.space.insert::<_, ReferenceTypeId>(variable, None);
        self.space.insert_reference(&folder, &id, ReferenceTypeId::HasComponent);
        self.space.insert_reference(&id, &of, ReferenceTypeId::HasTypeDefinition);
        self.copy_children(&of, &id, instances::LATEST_RESULT);
    }
}

/// Describes the node in English.
pub fn set_description(node: &mut dyn Node, text: &str) {
    node.set_description(LocalizedText::new("en", text));
}

/// A variable that clients can read.
pub fn variable(
    base: Base,
    data_type: NodeId,
    rank: i32,
    value: DataValue,
    dimensions: Option<Vec<u32>>,
) -> Variable {
    let access = AccessLevel::CURRENT_READ.bits();
    Variable::new_full(base, data_type, false, rank, value, access, access, dimensions, Some(0.0))
}

/// The same node under another id; `None` for classes that instances do not have.
fn copy(node: &NodeType, id: &NodeId) -> Option<NodeType> {
    let of = node.as_node();
    debug_assert_ne!(node.node_id(), id);
    let base = Base::new_full(
        id.clone(),
        of.node_class(),
        of.browse_name().clone(),
        of.display_name().clone(),
        of.description().cloned(),
        None,
        None,
    );
    match node {
        NodeType::Object(_) => Some(Object::new_full(base, EventNotifier::empty()).into()),
        NodeType::Method(_) => Some(Method::new_full(base, true, true).into()),
        NodeType::Variable(of) => {
            let value = of.value(TimestampsToReturn::Both, &NumericRange::None, &DataEncoding::Binary, 0.0);
            Some(variable(base, of.data_type(), of.value_rank(), value, of.array_dimensions()).into())
        }
        _ => None,
    }
}
