//! The node manager: holds the nodes, and passes calls of methods on.

use std::sync::Arc;

use async_trait::async_trait;
use opcua::server::address_space::AddressSpace;
use opcua::server::diagnostics::NamespaceMetadata;
use opcua::server::node_manager::memory::{InMemoryNodeManager, InMemoryNodeManagerImpl};
use opcua::server::node_manager::{MethodCall, RequestContext, ServerContext};
use opcua::sync::RwLock;
use opcua::types::{Identifier, NodeId, StatusCode};
use parking_lot::Mutex;
use tokio::sync::{mpsc, watch};

use crate::information_model::ids::{DEVICE_INTEGRATION, INSTANCES, MACHINE_VISION};
use crate::information_model::instance::Instances;
use crate::information_model::nodeset::{DEVICES, VISION, import};
use crate::information_model::structures::Structures;
use crate::line::Line;
use crate::server::methods::{Outcome, call};

/// The nodes with their server's node manager.
pub type Manager = InMemoryNodeManager<Nodes>;

/// What methods need.
pub struct Nodes {
    /// Values of structures.
    pub structures: Structures,
    /// Index of the namespace of OPC 40100-1.
    pub types: u16,
    /// Index of the namespace of OPC 10000-100.
    devices: u16,
    /// Index of the namespace of the instances.
    pub namespace: u16,
    /// What methods act on.
    pub line: Arc<dyn Line>,
    /// The recipe for jobs without one.
    pub prepared: Mutex<Option<String>>,
    /// The job started last.
    pub started_job: Mutex<Option<String>>,
    /// The job that uses the station.
    pub running_job: Mutex<Option<String>>,
    /// Events of methods, published by the door.
    pub prepared_events: mpsc::UnboundedSender<String>,
    /// Number of the newest change of the station's state that the variables show.
    pub shown_change: watch::Sender<u64>,
}

impl Nodes {
    /// Fills the address space.
    ///
    /// # Errors
    /// A nodeset cannot be read.
    pub fn build(
        context: &ServerContext,
        space: &mut AddressSpace,
        line: Arc<dyn Line>,
        prepared_events: mpsc::UnboundedSender<String>,
    ) -> Result<Self, String> {
        let (types, devices, namespace) = {
            let mut tree = context.type_tree.write();
            let types = import(&VISION, space, &mut tree)?;
            let devices = import(&DEVICES, space, &mut tree)?;
            (types, devices, tree.namespaces_mut().add_namespace(INSTANCES))
        };
        space.add_namespace(INSTANCES, namespace);
        Instances { space, types, devices, namespace }.add_vision_system();
        let structures = Structures::new(space, types)?;
        context.info.type_loaders.write().add(Arc::new(structures.loader()));
        Ok(Self {
            structures,
            types,
            devices,
            namespace,
            line,
            prepared: Mutex::default(),
            started_job: Mutex::default(),
            running_job: Mutex::default(),
            prepared_events,
            shown_change: watch::Sender::default(),
        })
    }

    /// The instance with this path.
    pub fn id(&self, path: &str) -> NodeId {
        NodeId::new(self.namespace, path)
    }
}

/// The path of an instance; empty for other nodes.
pub fn path(id: &NodeId) -> &str {
    match &id.identifier {
        Identifier::String(path) => path.as_ref(),
        _ => "",
    }
}

#[async_trait]
impl InMemoryNodeManagerImpl for Nodes {
    async fn init(&self, _space: &mut AddressSpace, _context: ServerContext) {}

    fn name(&self) -> &str {
        "station"
    }

    fn namespaces(&self) -> Vec<NamespaceMetadata> {
        let namespace = |uri: &str, index| NamespaceMetadata {
            namespace_uri: uri.to_owned(),
            namespace_index: index,
            ..NamespaceMetadata::default()
        };
        vec![
            namespace(MACHINE_VISION, self.types),
            namespace(DEVICE_INTEGRATION, self.devices),
            namespace(INSTANCES, self.namespace),
        ]
    }

    async fn call(
        &self,
        context: &RequestContext,
        _space: &RwLock<AddressSpace>,
        calls: &mut [&mut &mut MethodCall],
    ) -> Result<(), StatusCode> {
        for one in calls {
            match call(self, &context.token.0, path(one.method_id()), one.arguments()).await {
                Outcome::Done(outputs) => {
                    one.set_outputs(outputs);
                    one.set_status(StatusCode::Good);
                }
                Outcome::BadArguments => one.set_status(StatusCode::BadInvalidArgument),
                Outcome::Unsupported => one.set_status(StatusCode::BadNotSupported),
            }
        }
        Ok(())
    }
}
