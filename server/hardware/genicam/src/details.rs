//! The camera's own features by name, for engineers.

use std::sync::Arc;

use devices::features::{CameraDetails, CameraLink, Feature, FeatureError};

use crate::opened::OpenedCamera;
use crate::shared::Shared;

/// Features and link of a camera, independent of its owner.
pub struct Details(pub Arc<Shared>);

impl Details {
    fn with_opened<T>(&self, call: impl FnOnce(&OpenedCamera) -> T) -> Result<T, FeatureError> {
        let opened = self.0.opened.lock();
        opened.as_ref().map(call).ok_or_else(|| FeatureError::Disconnected {
            reason: "it is not connected; check its cable and power, then reset".to_owned(),
        })
    }
}

impl CameraDetails for Details {
    /// The camera is locked for one feature at a time, so that the reader of its frames is not blocked for longer.
    fn features(&self) -> Result<Vec<Feature>, FeatureError> {
        let names = self.with_opened(|opened| opened.device.feature_names())?;
        let mut features = Vec::with_capacity(names.len());
        for name in names {
            features.extend(self.with_opened(|opened| opened.device.feature(&name))?);
        }
        Ok(features)
    }

    fn set_feature(&self, name: &str, value: &str) -> Result<Feature, FeatureError> {
        let feature = self.with_opened(|opened| {
            let unknown = || FeatureError::Unknown { name: name.to_owned() };
            opened.device.feature(name).ok_or_else(unknown)?;
            opened.device.set_feature(name, value).map_err(|error| FeatureError::Refused {
                name: name.to_owned(),
                value: value.to_owned(),
                reason: error.to_string(),
            })?;
            opened.device.feature(name).ok_or_else(unknown)
        })??;
        let mut set_by_name = self.0.set_by_name.lock();
        set_by_name.retain(|(set, _)| set != name);
        if feature.kind != devices::features::FeatureKind::Command {
            set_by_name.push((name.to_owned(), value.to_owned()));
        }
        Ok(feature)
    }

    fn link(&self) -> CameraLink {
        self.0.link.lock().clone()
    }
}
