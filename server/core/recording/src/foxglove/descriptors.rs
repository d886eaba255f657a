//! The `FileDescriptorSet` of each message, which MCAP readers use for decoding.

use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto, FileDescriptorProto,
    FileDescriptorSet,
};

const TIMESTAMP: &str = ".google.protobuf.Timestamp";

/// Descriptors of `foxglove.RawImage`.
pub fn raw_image_descriptors() -> Vec<u8> {
    let message = message(
        "RawImage",
        [
            of("timestamp", 1, TIMESTAMP),
            plain("frame_id", 7, Type::String),
            plain("width", 2, Type::Fixed32),
            plain("height", 3, Type::Fixed32),
            plain("encoding", 4, Type::String),
            plain("step", 5, Type::Fixed32),
            plain("data", 6, Type::Bytes),
        ],
    );
    set([timestamp(), foxglove("RawImage", &["google/protobuf/timestamp.proto"], message)])
}

/// Descriptors of `foxglove.PointCloud`.
pub fn point_cloud_descriptors() -> Vec<u8> {
    let cloud = message(
        "PointCloud",
        [
            of("timestamp", 1, TIMESTAMP),
            plain("frame_id", 2, Type::String),
            of("pose", 3, ".foxglove.Pose"),
            plain("point_stride", 4, Type::Fixed32),
            repeated(of("fields", 5, ".foxglove.PackedElementField")),
            plain("data", 6, Type::Bytes),
        ],
    );
    let pose =
        message("Pose", [of("position", 1, ".foxglove.Vector3"), of("orientation", 2, ".foxglove.Quaternion")]);
    let numbers = |names: &[&str]| -> Vec<FieldDescriptorProto> {
        (1..).zip(names).map(|(number, name)| plain(name, number, Type::Double)).collect()
    };
    let needs = ["foxglove/PackedElementField.proto", "foxglove/Pose.proto", "google/protobuf/timestamp.proto"];
    set([
        timestamp(),
        foxglove("Vector3", &[], message("Vector3", numbers(&["x", "y", "z"]))),
        foxglove("Quaternion", &[], message("Quaternion", numbers(&["x", "y", "z", "w"]))),
        foxglove("Pose", &["foxglove/Quaternion.proto", "foxglove/Vector3.proto"], pose),
        foxglove("PackedElementField", &[], packed_element_field()),
        foxglove("PointCloud", &needs, cloud),
    ])
}

fn packed_element_field() -> DescriptorProto {
    let kind = FieldDescriptorProto {
        r#type: Some(Type::Enum as i32),
        ..of("type", 3, ".foxglove.PackedElementField.NumericType")
    };
    let names = ["UNKNOWN", "UINT8", "INT8", "UINT16", "INT16", "UINT32", "INT32", "FLOAT32", "FLOAT64"];
    let value = |(number, name): (i32, &str)| EnumValueDescriptorProto {
        name: Some(name.to_owned()),
        number: Some(number),
        options: None,
    };
    let numeric = EnumDescriptorProto {
        name: Some("NumericType".to_owned()),
        value: (0..).zip(names).map(value).collect(),
        ..EnumDescriptorProto::default()
    };
    DescriptorProto {
        enum_type: vec![numeric],
        ..message("PackedElementField", [plain("name", 1, Type::String), plain("offset", 2, Type::Fixed32), kind])
    }
}

fn timestamp() -> FileDescriptorProto {
    let fields = [plain("seconds", 1, Type::Int64), plain("nanos", 2, Type::Int32)];
    file("google/protobuf/timestamp.proto", "google.protobuf", &[], message("Timestamp", fields))
}

fn foxglove(name: &str, needs: &[&str], message: DescriptorProto) -> FileDescriptorProto {
    file(&format!("foxglove/{name}.proto"), "foxglove", needs, message)
}

fn file(name: &str, package: &str, needs: &[&str], message: DescriptorProto) -> FileDescriptorProto {
    FileDescriptorProto {
        name: Some(name.to_owned()),
        package: Some(package.to_owned()),
        dependency: needs.iter().map(|need| (*need).to_owned()).collect(),
        message_type: vec![message],
        syntax: Some("proto3".to_owned()),
        ..FileDescriptorProto::default()
    }
}

fn message(name: &str, field: impl IntoIterator<Item = FieldDescriptorProto>) -> DescriptorProto {
    DescriptorProto {
        name: Some(name.to_owned()),
        field: field.into_iter().collect(),
        ..DescriptorProto::default()
    }
}

fn plain(name: &str, number: i32, r#type: Type) -> FieldDescriptorProto {
    FieldDescriptorProto {
        name: Some(name.to_owned()),
        number: Some(number),
        label: Some(Label::Optional as i32),
        r#type: Some(r#type as i32),
        ..FieldDescriptorProto::default()
    }
}

fn of(name: &str, number: i32, type_name: &str) -> FieldDescriptorProto {
    FieldDescriptorProto { type_name: Some(type_name.to_owned()), ..plain(name, number, Type::Message) }
}

fn repeated(field: FieldDescriptorProto) -> FieldDescriptorProto {
    FieldDescriptorProto { label: Some(Label::Repeated as i32), ..field }
}

fn set(file: impl IntoIterator<Item = FileDescriptorProto>) -> Vec<u8> {
    FileDescriptorSet { file: file.into_iter().collect() }.encode_to_vec()
}
