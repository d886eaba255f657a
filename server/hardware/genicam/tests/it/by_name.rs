//! Features accessed by the camera's own names.

use devices::CameraRequest;
use devices::features::{Access, FeatureError, FeatureKind};

use crate::rig::{SERIAL, blank, fake, open, settings, until};

#[test]
fn every_feature_is_listed_with_its_kind_and_access_mode() {
    let Some(_fake) = fake(0) else { return };
    let features = open(&settings(SERIAL)).details().unwrap().features().unwrap();
    let feature = |name: &str| {
        features.iter().find(|feature| feature.name == name).unwrap_or_else(|| panic!("no {name}: {features:#?}"))
    };
    let exposure = feature("ExposureTimeAbs");
    assert_eq!((exposure.kind, exposure.access), (FeatureKind::Float, Access::ReadWrite));
    assert_eq!(exposure.range, Some((10.0, 10_000_000.0)));
    let format = feature("PixelFormat");
    assert_eq!((format.kind, format.value.as_deref()), (FeatureKind::Enumeration, Some("Mono8")));
    assert!(format.entries.iter().any(|entry| entry == "Mono16"), "{:?}", format.entries);
    assert_eq!(feature("DeviceVendorName").access, Access::ReadOnly);
    assert_eq!(feature("TriggerSoftware").kind, FeatureKind::Command);
    assert_eq!(feature("SensorWidth").value.as_deref(), Some("2048"));
}

#[test]
fn a_feature_set_by_name_is_read_back_and_survives_a_restart() {
    let Some(mut fake) = fake(0) else { return };
    let mut camera = open(&settings(SERIAL));
    let details = camera.details().unwrap();
    let set = details.set_feature("ExposureTimeAbs", "4321").unwrap();
    assert!(set.value.as_deref().is_some_and(|value| value.starts_with("4321")), "{set:?}");
    details.set_feature("TestRegister", "77").unwrap();
    assert_eq!(camera.configure(&CameraRequest::default()).unwrap().exposure_us, 4321.0);
    assert!(matches!(details.set_feature("Nonsense", "1"), Err(FeatureError::Unknown { .. })));
    let refused = details.set_feature("PixelFormat", "Purple");
    assert!(matches!(refused, Err(FeatureError::Refused { .. })), "{refused:?}");
    fake.restart().unwrap();
    let mut image = blank();
    until(&mut *camera, &mut image, "the loss is reported", |_, got| got.err());
    camera.reconnect().unwrap();
    until(&mut *camera, &mut image, "it is reconnected", |_, got| got.ok());
    let kept = details.features().unwrap().into_iter().find(|feature| feature.name == "TestRegister").unwrap();
    assert_eq!(kept.value.as_deref(), Some("77"));
    assert_eq!(camera.settings().exposure_us, 4321.0);
}
