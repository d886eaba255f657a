//! The protobuf messages match their descriptors.

use prost::Message as _;
use prost_types::FileDescriptorSet;
use recording::foxglove::{RawImage, Timestamp, point_cloud_descriptors, raw_image_descriptors};

#[test]
fn every_file_of_a_set_follows_its_dependencies() {
    for set in [raw_image_descriptors(), point_cloud_descriptors()] {
        let set = FileDescriptorSet::decode(&*set).unwrap();
        for (idx, file) in set.file.iter().enumerate() {
            for dependency in &file.dependency {
                let is_before = set.file[..idx].iter().any(|before| before.name() == dependency);
                assert!(is_before, "{} needs {dependency} before it", file.name());
            }
        }
    }
}

#[test]
fn an_image_is_encoded_with_the_published_field_numbers() {
    // Field numbers by hand: timestamp 1, frame_id 7, width 2, height 3, encoding 4, step 5, data 6.
    let image = RawImage {
        timestamp: Some(Timestamp { seconds: 1, nanos: 2 }),
        frame_id: "c".into(),
        width: 2,
        height: 1,
        encoding: "mono8".into(),
        step: 2,
        data: vec![9, 8].into(),
    };
    let expected: Vec<u8> = [
        &[0x0a, 4, 0x08, 1, 0x10, 2][..],
        &[0x15, 2, 0, 0, 0],
        &[0x1d, 1, 0, 0, 0],
        &[0x22, 5, b'm', b'o', b'n', b'o', b'8'],
        &[0x2d, 2, 0, 0, 0],
        &[0x32, 2, 9, 8],
        &[0x3a, 1, b'c'],
    ]
    .concat();
    assert_eq!(image.encode_to_vec(), expected);
}
