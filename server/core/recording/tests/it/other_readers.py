"""Reads an MCAP file with the packages of MCAP and Foxglove and prints its content as JSON."""

import json
import struct
import sys

from foxglove_schemas_protobuf import PointCloud_pb2, RawImage_pb2
from google.protobuf import descriptor_pb2
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap_protobuf.decoder import DecoderFactory

PUBLISHED = {"RawImage": RawImage_pb2, "PointCloud": PointCloud_pb2}


def published_files(module):
    """Every file of a published message, by its name."""
    files, left = {}, [module.DESCRIPTOR]
    while left:
        file = left.pop()
        proto = descriptor_pb2.FileDescriptorProto()
        file.CopyToProto(proto)
        for field in ("options",):
            proto.ClearField(field)
        files[file.name] = proto
        left.extend(file.dependencies)
    return files


def is_published(schema, module):
    """Whether a file contains exactly the published descriptors."""
    found = descriptor_pb2.FileDescriptorSet()
    found.ParseFromString(schema.data)
    published = published_files(module)
    for file in found.file:
        for message in list(file.message_type) + list(published[file.name].message_type):
            for field in message.field:
                # Added by the compiler; derived from the name.
                field.ClearField("json_name")
    return {file.name: file for file in found.file} == published


def points_of(cloud):
    formats = {7: "<f", 2: "<b"}
    at = lambda start: [
        struct.unpack_from(formats[field.type], cloud.data, start + field.offset)[0] for field in cloud.fields
    ]
    assert [field.name for field in cloud.fields] == ["x", "y", "z", "sigma", "order"]
    return [at(start) for start in range(0, len(cloud.data), cloud.point_stride)]


def main(path):
    with open(path, "rb") as file:
        kinds = [type(record).__name__ for record in StreamReader(file, emit_chunks=True).records]
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        counts = summary.statistics.channel_message_counts
        topics = {
            channel.topic: {
                "schema": summary.schemas[channel.schema_id].name,
                "encoding": summary.schemas[channel.schema_id].encoding,
                "n_messages": counts.get(channel.id, 0),
            }
            for channel in summary.channels.values()
        }
        for channel in summary.channels.values():
            schema = summary.schemas[channel.schema_id]
            if schema.encoding == "jsonschema":
                assert json.loads(schema.data)["type"] == "object", schema.name
        images, points = [], []
        for schema, _, message, decoded in reader.iter_decoded_messages(["/camera/image", "/profile"]):
            if schema.name == "foxglove.RawImage":
                time = decoded.timestamp
                images.append({
                    "hex": decoded.data.hex(),
                    "encoding": decoded.encoding,
                    "width": decoded.width,
                    "log_time_ns": message.log_time,
                    "timestamp_ns": time.seconds * 10**9 + time.nanos,
                })
            else:
                points += points_of(decoded)
        for schema, _, message in reader.iter_messages(["/camera/frame"]):
            assert json.loads(message.data)["exposure_us"] == 812.5
        schemas = {schema.name: schema for schema in summary.schemas.values()}
        print(json.dumps({
            "topics": topics,
            "first_records": kinds[:3],
            "attachments": {one.name: one.data.decode() for one in reader.iter_attachments()},
            "metadata": {one.name: one.metadata for one in reader.iter_metadata()},
            "images": images,
            "points": points,
            "same_as_published": {
                name: is_published(schemas[f"foxglove.{name}"], module) for name, module in PUBLISHED.items()
            },
        }))


main(sys.argv[1])
