//! All features of a camera, from its own description.

use std::ffi::{CStr, c_char};

use aravis_sys as arv;
use devices::features::{Access, Feature, FeatureKind};
use glib_sys::GType;
use gobject_sys::g_type_check_instance_is_a;

use super::device::Device;
use super::error::{AravisError, checked, terminated, text};

/// Deepest nesting of categories that is followed; descriptions have two or three levels.
const MAX_DEPTH: usize = 16;

impl Device {
    /// Every feature below the description's root, in its order.
    pub fn feature_names(&self) -> Vec<String> {
        let mut names = Vec::new();
        self.collect("Root", MAX_DEPTH, &mut names);
        names
    }

    /// One feature in its current state; `None` if the camera has no feature of that name, or only a category.
    pub fn feature(&self, name: &str) -> Option<Feature> {
        let node = self.node(name)?;
        let kind = kind_of(node)?;
        // SAFETY: the node is a feature of the device's, as its kind shows; the texts are the library's and copied at
        // once.
        let (access, value, description) = unsafe {
            let feature: *mut arv::ArvGcFeatureNode = node.cast();
            let available = checked(|error| arv::arv_gc_feature_node_is_available(feature, error));
            let locked = checked(|error| arv::arv_gc_feature_node_is_locked(feature, error));
            let mode = arv::arv_gc_feature_node_get_actual_access_mode(feature);
            let access = match mode {
                _ if available != Ok(1) => Access::NotAvailable,
                arv::ARV_GC_ACCESS_MODE_RO => Access::ReadOnly,
                _ if locked == Ok(1) => Access::ReadOnly,
                arv::ARV_GC_ACCESS_MODE_WO => Access::WriteOnly,
                _ => Access::ReadWrite,
            };
            let readable = matches!(access, Access::ReadOnly | Access::ReadWrite) && kind != FeatureKind::Command;
            let value = readable
                .then(|| checked(|error| text(arv::arv_gc_feature_node_get_value_as_string(feature, error))).ok())
                .flatten();
            let description = text(arv::arv_gc_feature_node_get_description(feature));
            (access, value, description)
        };
        let readable = value.is_some();
        let number = match kind {
            FeatureKind::Integer | FeatureKind::Float if readable => self.number(name).ok(),
            _ => None,
        };
        let entries = if kind == FeatureKind::Enumeration { self.entries(name) } else { Vec::new() };
        Some(Feature {
            name: name.to_owned(),
            kind,
            access,
            value,
            range: number.map(|number| (number.min, number.max)),
            entries,
            description,
        })
    }

    /// Sets a feature from text: a number, `true` or `false`, the name of an entry; a command is executed for any text.
    pub fn set_feature(&self, name: &str, value: &str) -> Result<(), AravisError> {
        let node = self.node(name).ok_or_else(|| AravisError(format!("there is no feature `{name}`")))?;
        match kind_of(node) {
            Some(FeatureKind::Command) => self.execute(name),
            Some(_) => {
                let value = terminated(value);
                // SAFETY: the node is a feature of the device's; the text is terminated and not kept.
                checked(|error| unsafe {
                    arv::arv_gc_feature_node_set_value_from_string(node.cast(), value.as_ptr(), error);
                })
            }
            None => Err(AravisError(format!("`{name}` is not a feature with a value"))),
        }
    }

    fn node(&self, name: &str) -> Option<*mut arv::ArvGcNode> {
        let name = terminated(name);
        // SAFETY: the device is valid, the name terminated; the node belongs to the device and lives as long.
        let node = unsafe { arv::arv_device_get_feature(self.device(), name.as_ptr()) };
        (!node.is_null()).then_some(node)
    }

    fn collect(&self, category: &str, depth_left: usize, names: &mut Vec<String>) {
        let Some(node) = self.node(category) else { return };
        // SAFETY: the type is checked first; the list of names is the category's and is not changed while it is read.
        let children = unsafe {
            if !is_a(node, arv::arv_gc_category_get_type()) {
                return;
            }
            let mut children = Vec::new();
            let mut next = arv::arv_gc_category_get_features(node.cast());
            while !next.is_null() {
                children.push(CStr::from_ptr((*next).data as *const c_char).to_string_lossy().into_owned());
                next = (*next).next;
            }
            children
        };
        for child in children {
            let Some(node) = self.node(&child) else { continue };
            // SAFETY: asks for a registered type.
            if is_a(node, unsafe { arv::arv_gc_category_get_type() }) {
                if depth_left > 0 {
                    self.collect(&child, depth_left - 1, names);
                }
            } else if !names.contains(&child) {
                names.push(child);
            }
        }
    }
}

fn is_a(node: *mut arv::ArvGcNode, class: GType) -> bool {
    // SAFETY: nodes that the device hands out are valid objects.
    unsafe { g_type_check_instance_is_a(node.cast(), class) != 0 }
}

/// The type of a feature node; `None` for categories and nodes without a value.
fn kind_of(node: *mut arv::ArvGcNode) -> Option<FeatureKind> {
    // SAFETY: asks for registered types.
    let kinds = unsafe {
        [
            (arv::arv_gc_command_get_type(), FeatureKind::Command),
            (arv::arv_gc_enumeration_get_type(), FeatureKind::Enumeration),
            (arv::arv_gc_boolean_get_type(), FeatureKind::Boolean),
            (arv::arv_gc_float_get_type(), FeatureKind::Float),
            (arv::arv_gc_integer_get_type(), FeatureKind::Integer),
            (arv::arv_gc_string_get_type(), FeatureKind::Text),
        ]
    };
    kinds.into_iter().find(|(class, _)| is_a(node, *class)).map(|(_, kind)| kind)
}
