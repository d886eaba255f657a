//! Nodes of the station's health, in the manner of OPC 40100-2: the vision system and each of its devices have a group
//! `Health`, the devices also `Identification`. Names and types are those of OPC 10000-100 where it has them.

use opcua::nodes::{Base, EventNotifier, Object};
use opcua::types::{
    DataTypeId, DataValue, NodeClass, NodeId, ObjectTypeId, QualifiedName, ReferenceTypeId, StatusCode,
    VariableTypeId, Variant,
};

use crate::information_model::ids::{device_integration, instances};
use crate::information_model::instance::{Instances, set_description, variable};

/// The devices.
const DEVICES: [(&str, &str); 3] = [
    (instances::CAMERA, "the camera"),
    (instances::STAGE, "the stage with its controller"),
    (instances::LASER, "the laser with its optics"),
];

/// What a device says about itself.
const IDENTIFICATION: [(&str, DataTypeId); 4] = [
    ("Manufacturer", DataTypeId::LocalizedText),
    ("Model", DataTypeId::LocalizedText),
    ("SerialNumber", DataTypeId::String),
    ("SoftwareRevision", DataTypeId::String),
];

/// The result of a watch.
const WATCH: &str = "this watch on the newest scan, at its time: quiet, blind (it cannot see), warning, invalid";

/// What each `Health` has beyond `DeviceHealth` and `Message`.
const PARTS: [(&str, &str, DataTypeId, &str); 10] = [
    (instances::SYSTEM, "CalibrationId", DataTypeId::String, "the active calibration"),
    (instances::SYSTEM, "CalibratedAt", DataTypeId::UtcTime, "when the active calibration was computed"),
    (instances::CAMERA, "FramesLost", DataTypeId::UInt64, "frames lost since the service started"),
    (instances::STAGE, "Homed", DataTypeId::Boolean, "whether the stage is homed"),
    (instances::STAGE, "LostSteps", DataTypeId::String, WATCH),
    (instances::STAGE, "StageScale", DataTypeId::String, WATCH),
    (
        instances::LASER,
        "Light",
        DataTypeId::String,
        "off, armed, on, unknown (treat it as on), not_controlled (on as long as it has power)",
    ),
    (instances::LASER, "InterlockClosed", DataTypeId::Boolean, "as the laser reports it"),
    (instances::LASER, "Wavelength", DataTypeId::String, WATCH),
    (instances::LASER, "OrderPowers", DataTypeId::String, WATCH),
];

/// Names that OPC 10000-100 defines.
const STANDARD: [&str; 6] =
    ["DeviceHealth", "Identification", "Manufacturer", "Model", "SerialNumber", "SoftwareRevision"];

impl Instances<'_> {
    /// Adds the devices of the vision system, and the health of it and of them.
    pub fn add_health(&mut self) {
        let device_set = NodeId::new(self.devices, device_integration::DEVICE_SET);
        for (device, description) in DEVICES {
            let of = ObjectTypeId::BaseObjectType.into();
            let id = self.add_object(device, of, ReferenceTypeId::HasComponent, description);
            self.space.insert_reference(&device_set, &id, ReferenceTypeId::Organizes);
            let group = self.add_group(device, "Identification", "what the device says about itself");
            for (name, data_type) in IDENTIFICATION {
                self.add_variable(&group, name, data_type.into(), VariableTypeId::PropertyType, "");
            }
        }
        for owner in [instances::SYSTEM, instances::CAMERA, instances::STAGE, instances::LASER] {
            let group = self.add_group(owner, "Health", "its condition");
            let data_type = NodeId::new(self.devices, device_integration::DEVICE_HEALTH);
            let of = VariableTypeId::BaseDataVariableType;
            self.add_variable(&group, "DeviceHealth", data_type, of, "the condition by NAMUR NE 107");
            let message = "the reason, and what to do; empty if the condition is normal";
            self.add_variable(&group, "Message", DataTypeId::LocalizedText.into(), of, message);
            for (_, name, data_type, description) in PARTS.iter().filter(|(of, ..)| *of == owner) {
                self.add_variable(&group, name, (*data_type).into(), of, description);
            }
        }
    }

    /// A group of variables of an object; returns its path.
    fn add_group(&mut self, owner: &str, name: &str, description: &str) -> String {
        let path = format!("{owner}.{name}");
        let of = NodeId::new(self.devices, device_integration::FUNCTIONAL_GROUP);
        self.add_object(&path, of, ReferenceTypeId::HasAddIn, description);
        path
    }

    /// An object below the one whose path it continues.
    fn add_object(&mut self, path: &str, of: NodeId, reference: ReferenceTypeId, description: &str) -> NodeId {
        let (owner, name) = path.rsplit_once('.').unwrap_or(("", path));
        let id = self.id(path);
        let mut object = Object::new(&id, self.named(name), name, EventNotifier::empty());
        set_description(&mut object, description);
        self.space.insert::<_, ReferenceTypeId>(object, None);
        self.space.insert_reference(&self.id(owner), &id, reference);
        self.space.insert_reference(&id, &of, ReferenceTypeId::HasTypeDefinition);
        id
    }

    /// A variable without a value yet.
    fn add_variable(&mut self, group: &str, name: &str, data_type: NodeId, of: VariableTypeId, description: &str) {
        let id = self.id(&format!("{group}.{name}"));
        let base = Base::new(NodeClass::Variable, &id, self.named(name), name);
        let status = Some(StatusCode::BadWaitingForInitialData);
        let value = DataValue { value: Some(Variant::Empty), status, ..DataValue::null() };
        let mut variable = variable(base, data_type, -1, value, None);
        if !description.is_empty() {
            set_description(&mut variable, description);
        }
        let reference = match of {
            VariableTypeId::PropertyType => ReferenceTypeId::HasProperty,
            _ => ReferenceTypeId::HasComponent,
        };
        self.space.insert::<_, ReferenceTypeId>(variable, None);
        self.space.insert_reference(&self.id(group), &id, reference);
        self.space.insert_reference(&id, &of.into(), ReferenceTypeId::HasTypeDefinition);
    }

    fn named(&self, name: &str) -> QualifiedName {
        let namespace = if STANDARD.contains(&name) { self.devices } else { self.namespace };
        QualifiedName::new(namespace, name)
    }
}
