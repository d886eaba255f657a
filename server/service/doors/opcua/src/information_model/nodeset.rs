//! The types of OPC 40100-1 and of OPC 10000-100, read from the nodesets of the OPC Foundation.

use opcua::nodes::{
    DataType, DefaultTypeTree, NodeSet2Import, NodeSetImport as _, NodeSetNamespaceMapper, NodeType,
};
use opcua::server::address_space::AddressSpace;
use opcua::types::{
    BrowseDirection, DataTypeDefinition, DataTypeId, NodeId, ReferenceTypeId, StructureDefinition,
};

use crate::information_model::ids::{DEVICE_INTEGRATION, MACHINE_VISION};

/// A nodeset as published, with its licence in its first lines.
pub struct Nodeset {
    uri: &'static str,
    xml: &'static str,
    /// First and last number of a structure.
    structures: std::ops::RangeInclusive<u32>,
}

/// OPC 40100-1.
pub const VISION: Nodeset = Nodeset {
    uri: MACHINE_VISION,
    xml: include_str!("../../nodeset/Opc.Ua.MachineVision.NodeSet2.xml"),
    structures: DATA_TYPES,
};

/// OPC 10000-100.
pub const DEVICES: Nodeset = Nodeset {
    uri: DEVICE_INTEGRATION,
    xml: include_str!("../../nodeset/Opc.Ua.Di.NodeSet2.xml"),
    structures: 6522..=15889,
};

/// First and last number of a data type of OPC 40100-1.
pub const DATA_TYPES: std::ops::RangeInclusive<u32> = 3002..=3024;

/// `BinaryIdBaseDataType` of OPC 40100-1, whose fields the nodeset does not repeat in its subtypes.
const BINARY_ID_BASE: u32 = 3019;

/// Its subtypes.
const BINARY_IDS: [u32; 3] = [3002, 3008, 3013];

/// Adds the types to the address space; returns the index of their namespace.
///
/// # Errors
/// The nodeset cannot be read.
pub fn import(nodeset: &Nodeset, space: &mut AddressSpace, types: &mut DefaultTypeTree) -> Result<u16, String> {
    let import = NodeSet2Import::new_str("en", nodeset.xml, Vec::new()).map_err(|error| error.to_string())?;
    let mut namespaces = NodeSetNamespaceMapper::new(types.namespaces_mut());
    // The library's own registration prints to stdout.
    namespaces.add_namespace(nodeset.uri, 1);
    let index = namespaces.namespaces().get_index(nodeset.uri).unwrap_or_default();
    space.add_namespace(nodeset.uri, index);
    for item in import.load(&namespaces) {
        space.import_node(item);
    }
    add_encodings(space, nodeset, index);
    if nodeset.uri == MACHINE_VISION {
        complete_binary_ids(space, index);
    }
    Ok(index)
}

/// Clients decode a structure by the definition of its type alone, which contains the id of the binary encoding. The
/// library finds it only if the namespace has the same index as in the nodeset.
fn add_encodings(space: &mut AddressSpace, nodeset: &Nodeset, index: u16) {
    for number in nodeset.structures.clone() {
        let id = NodeId::new(index, number);
        if let Some(definition) = structure(space, &id) {
            let default_encoding_id = binary_encoding(space, &id).unwrap_or_default();
            define(space, &id, StructureDefinition { default_encoding_id, ..definition });
        }
    }
}

/// Repeats inherited fields, and names `Structure` as the base of these definitions, although the type tree has
/// `BinaryIdBaseDataType` in between. node-opcua takes the fields of the base for its own a second time if it reads a
/// structure that contains an id before the base, and writes them twice into requests. In which order it reads them is
/// left to chance: the library lists references in the order of a hash table.
fn complete_binary_ids(space: &mut AddressSpace, index: u16) {
    let Some(base) = structure(space, &NodeId::new(index, BINARY_ID_BASE)) else { return };
    for number in BINARY_IDS {
        let id = NodeId::new(index, number);
        let definition = StructureDefinition {
            default_encoding_id: binary_encoding(space, &id).unwrap_or_default(),
            base_data_type: DataTypeId::Structure.into(),
            ..base.clone()
        };
        define(space, &id, definition);
    }
}

fn structure(space: &AddressSpace, id: &NodeId) -> Option<StructureDefinition> {
    match data_type(space, id).and_then(DataType::data_type_definition) {
        Some(DataTypeDefinition::Structure(definition)) => Some(definition.clone()),
        _ => None,
    }
}

fn define(space: &mut AddressSpace, id: &NodeId, definition: StructureDefinition) {
    if let Some(NodeType::DataType(node)) = space.find_mut(id) {
        node.set_data_type_definition(Some(DataTypeDefinition::Structure(definition)));
    }
}

fn binary_encoding(space: &AddressSpace, data_type: &NodeId) -> Option<NodeId> {
    let no_subtypes = DefaultTypeTree::new();
    let encodings = Some((ReferenceTypeId::HasEncoding, false));
    let mut found = space.find_references(data_type, encodings, &no_subtypes, BrowseDirection::Forward);
    let is_binary = |id: &NodeId| {
        space.find_node(id).is_some_and(|node| node.as_node().browse_name().name.as_ref() == "Default Binary")
    };
    found.find(|encoding| is_binary(encoding.target_node)).map(|encoding| encoding.target_node.clone())
}

/// A data type in the address space.
pub fn data_type<'a>(space: &'a AddressSpace, id: &NodeId) -> Option<&'a DataType> {
    match space.find_node(id) {
        Some(NodeType::DataType(node)) => Some(node),
        _ => None,
    }
}
