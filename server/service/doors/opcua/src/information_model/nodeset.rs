//! The types of OPC 40100-1, read from the nodeset of the OPC Foundation.

use opcua::nodes::{
    DataType, DefaultTypeTree, NodeSet2Import, NodeSetImport as _, NodeSetNamespaceMapper, NodeType,
};
use opcua::server::address_space::AddressSpace;
use opcua::types::{
    BrowseDirection, DataTypeDefinition, DataTypeId, NodeId, ReferenceTypeId, StructureDefinition,
};

use crate::information_model::ids::MACHINE_VISION;

/// The nodeset as published, with its licence in its first lines.
const NODESET: &str = include_str!("../../nodeset/Opc.Ua.MachineVision.NodeSet2.xml");

/// First and last number of a data type.
pub const DATA_TYPES: std::ops::RangeInclusive<u32> = 3002..=3024;

/// `BinaryIdBaseDataType`, whose fields the nodeset does not repeat in its subtypes.
const BINARY_ID_BASE: u32 = 3019;

/// Its subtypes.
const BINARY_IDS: [u32; 3] = [3002, 3008, 3013];

/// Adds the types to the address space; returns the index of their namespace.
///
/// # Errors
/// The nodeset cannot be read.
pub fn import(space: &mut AddressSpace, types: &mut DefaultTypeTree) -> Result<u16, String> {
    let import = NodeSet2Import::new_str("en", NODESET, Vec::new()).map_err(|error| error.to_string())?;
    let mut namespaces = NodeSetNamespaceMapper::new(types.namespaces_mut());
    // The library's own registration prints to stdout.
    namespaces.add_namespace(MACHINE_VISION, 1);
    let index = namespaces.namespaces().get_index(MACHINE_VISION).unwrap_or_default();
    space.add_namespace(MACHINE_VISION, index);
    for item in import.load(&namespaces) {
        space.import_node(item);
    }
    complete_definitions(space, index);
    Ok(index)
}

/// Clients decode a structure by the definition of its type alone: inherited fields are repeated, and the id of the
/// binary encoding is added, which the library finds only if the namespace has the same index as in the nodeset.
///
/// The definitions of the binary ids name `Structure` as their base, although the type tree has `BinaryIdBaseDataType` in
/// between. node-opcua takes the fields of the base for its own a second time if it reads a structure that contains an id
/// before the base, and writes them twice into requests. In which order it reads them is left to chance: the library lists
/// references in the order of a hash table.
fn complete_definitions(space: &mut AddressSpace, index: u16) {
    let definition_of = |space: &AddressSpace, number| match data_type(space, &NodeId::new(index, number))
        .and_then(DataType::data_type_definition)
    {
        Some(DataTypeDefinition::Structure(definition)) => Some(definition.clone()),
        _ => None,
    };
    let base = definition_of(space, BINARY_ID_BASE);
    for number in DATA_TYPES {
        let own = definition_of(space, number);
        let Some(definition) = own.or_else(|| base.clone().filter(|_| BINARY_IDS.contains(&number))) else {
            continue;
        };
        let id = NodeId::new(index, number);
        let encoding = binary_encoding(space, &id).unwrap_or_default();
        let base_data_type = match BINARY_IDS.contains(&number) {
            true => DataTypeId::Structure.into(),
            false => definition.base_data_type.clone(),
        };
        let definition = StructureDefinition { default_encoding_id: encoding, base_data_type, ..definition };
        if let Some(NodeType::DataType(node)) = space.find_mut(&id) {
            node.set_data_type_definition(Some(DataTypeDefinition::Structure(definition)));
        }
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
