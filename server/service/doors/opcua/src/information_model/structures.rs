//! Values of the structures that OPC 40100-1 defines.

use std::sync::Arc;

use opcua::server::address_space::AddressSpace;
use opcua::types::custom::{DataTypeTree, DynamicStructure, DynamicTypeLoader, EncodingIds, ParentIds, TypeInfo};
use opcua::types::{
    Array, DataTypeDefinition, DataTypeId, ExtensionObject, NodeId, UAString, Variant, VariantScalarTypeId,
};

use crate::information_model::nodeset::{DATA_TYPES, data_type};

/// Data types of the standard that are other names of built-in types.
const ALIASES: [(u32, DataTypeId); 3] =
    [(3009, DataTypeId::Int32), (3017, DataTypeId::String), (3018, DataTypeId::UInt32)];

/// The structures, as defined by the nodeset.
#[derive(Clone)]
pub struct Structures {
    types: Arc<DataTypeTree>,
    namespace: u16,
}

impl Structures {
    /// Those of the imported nodeset.
    ///
    /// # Errors
    /// A definition is incomplete.
    pub fn new(space: &AddressSpace, namespace: u16) -> Result<Self, String> {
        let mut types = DataTypeTree::new(parents(space, namespace));
        for number in DATA_TYPES {
            let id = NodeId::new(namespace, number);
            let Some(node) = data_type(space, &id) else { continue };
            let Some(DataTypeDefinition::Structure(definition)) = node.data_type_definition().cloned() else {
                continue;
            };
            let encodings =
                EncodingIds { binary_id: definition.default_encoding_id.clone(), ..EncodingIds::default() };
            let definition = DataTypeDefinition::Structure(definition);
            let name = number.to_string();
            let info =
                TypeInfo::from_type_definition(definition, name, Some(encodings), false, &id, types.parent_ids())?;
            types.add_type(id, info);
        }
        Ok(Self { types: Arc::new(types), namespace })
    }

    /// Decodes them in requests.
    pub fn loader(&self) -> DynamicTypeLoader {
        DynamicTypeLoader::new(self.types.clone())
    }

    /// A structure of this type with its fields in order; empty for absent optional ones. Null if they do not match.
    pub fn make(&self, number: u32, fields: Vec<Variant>) -> Variant {
        let id = NodeId::new(self.namespace, number);
        let structure = self.types.get_struct_type(&id).and_then(|info| {
            let made = DynamicStructure::new_struct(info.clone(), self.types.clone(), fields);
            made.inspect_err(|error| tracing::error!(%error, number, "a structure cannot be made")).ok()
        });
        Variant::ExtensionObject(structure.map_or_else(ExtensionObject::null, ExtensionObject::new))
    }

    /// A structure that consists of an id.
    pub fn id(&self, number: u32, id: &str) -> Variant {
        self.make(number, vec![id.into()])
    }

    /// A structure that consists of an id and an optional description, which is absent.
    pub fn described_id(&self, number: u32, id: &str) -> Variant {
        self.make(number, vec![id.into(), Variant::Empty])
    }

    /// An id with optional version and SHA-256, hexadecimal.
    pub fn binary_id(&self, number: u32, id: &str, version: Option<i64>, digest: Option<&str>) -> Variant {
        let version = version.map_or(Variant::Empty, |version| version.to_string().into());
        let hash = digest
            .and_then(|digest| hex::decode(digest).ok())
            .map_or(Variant::Empty, |bytes| Variant::ByteString(bytes.into()));
        let algorithm = if hash == Variant::Empty { Variant::Empty } else { "SHA-256".into() };
        self.make(number, vec![id.into(), version, hash, algorithm, Variant::Empty])
    }
}

/// A text field of a structure in a request; empty if it is absent.
pub fn text(structure: &Variant, field: &str) -> String {
    let Variant::ExtensionObject(object) = structure else { return String::new() };
    let value = object.inner_as::<DynamicStructure>().and_then(|structure| structure.get_field_by_name(field));
    match value {
        Some(Variant::String(text)) => text.as_ref().trim().to_owned(),
        _ => String::new(),
    }
}

/// An array of structures.
pub fn array(structures: Vec<Variant>) -> Variant {
    let array = Array::new(VariantScalarTypeId::ExtensionObject, structures);
    array.map_or(Variant::Empty, |array| Variant::Array(Box::new(array)))
}

/// An array of texts.
pub fn texts<'a>(all: impl Iterator<Item = &'a str>) -> Variant {
    Variant::from(all.map(UAString::from).collect::<Vec<_>>())
}

fn parents(space: &AddressSpace, namespace: u16) -> ParentIds {
    let mut parents = ParentIds::new();
    parents.add_type(DataTypeId::UtcTime.into(), DataTypeId::DateTime.into());
    parents.add_type(DataTypeId::Duration.into(), DataTypeId::Double.into());
    for (number, builtin) in ALIASES {
        parents.add_type(NodeId::new(namespace, number), builtin.into());
    }
    for number in DATA_TYPES {
        let id = NodeId::new(namespace, number);
        let parent = match data_type(space, &id).map(|node| node.data_type_definition()) {
            Some(Some(DataTypeDefinition::Structure(_))) => DataTypeId::Structure,
            Some(Some(DataTypeDefinition::Enum(_))) => DataTypeId::Enumeration,
            _ => continue,
        };
        parents.add_type(id, parent.into());
    }
    parents
}
