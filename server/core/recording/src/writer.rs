//! Writing a recording: the header first, then messages in the order in which they arrive.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Write;

use bytes::Bytes;
use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use prost::Message as _;
use vision::GreyImage;

use crate::error::RecordingError;
use crate::foxglove::{
    NumericType, PackedElementField, PointCloud, Pose, Quaternion, Vector3, point_cloud_descriptors,
    raw_image_descriptors,
};
use crate::frames::{self, CAMERA_FRAME};
use crate::header::{RecordingEnd, RecordingHeader};
use crate::messages::{
    EventNote, FrameNote, JsonMessage, PeaksNote, ProfilePoint, RowNote, SettingsNote, StageNote,
};
use crate::params::{CALIBRATION_NAME, CHUNK_BYTES, COMPRESSION_LEVEL, COMPRESSION_THREADS, FORMAT};
use crate::topics::Topic;

/// Bytes of a point of a profile: three coordinates, σ and the order.
const POINT_STRIDE: u32 = 17;

/// Writes a recording to `W` without seeking: flushed data is never changed.
pub struct RecordingWriter<W: Write> {
    file: mcap::Writer<NoSeek<W>>,
    channels: BTreeMap<Topic, u16>,
    /// Messages of each topic so far: MCAP requires sequence numbers.
    counts: BTreeMap<Topic, u32>,
    message: Vec<u8>,
}

/// Options of the MCAP files of this crate: chunks are built in memory, so that an interrupted file ends with a
/// complete chunk.
pub(crate) fn options() -> mcap::WriteOptions {
    mcap::WriteOptions::new()
        .profile("")
        .library(concat!("sheaf ", env!("CARGO_PKG_VERSION")))
        .compression(Some(mcap::Compression::Zstd))
        .compression_level(COMPRESSION_LEVEL)
        .compression_threads(COMPRESSION_THREADS)
        .chunk_size(Some(CHUNK_BYTES))
        .disable_seeking(true)
}

impl<W: Write> RecordingWriter<W> {
    /// Writes the header, the calibration document if there is one, and the schemas of the messages.
    ///
    /// # Errors
    /// [`RecordingError::Mcap`] if `out` cannot be written.
    pub fn create(out: W, header: &RecordingHeader, calibration: Option<&[u8]>) -> Result<Self, RecordingError> {
        let mut file = options().create(NoSeek::new(out))?;
        file.write_metadata(&header.to_metadata())?;
        if let Some(document) = calibration {
            let at_ns = (header.started_at_ms.max(0) as u64).saturating_mul(1_000_000);
            file.attach(&mcap::Attachment {
                log_time: at_ns,
                create_time: at_ns,
                name: CALIBRATION_NAME.to_owned(),
                media_type: "application/json".to_owned(),
                data: Cow::Borrowed(document),
            })?;
        }
        let mut writer = Self { file, channels: BTreeMap::new(), counts: BTreeMap::new(), message: Vec::new() };
        writer.channel(Topic::Image, "foxglove.RawImage", "protobuf", &raw_image_descriptors())?;
        writer.channel(Topic::Profile, "foxglove.PointCloud", "protobuf", &point_cloud_descriptors())?;
        writer.json_channel::<FrameNote>()?;
        writer.json_channel::<PeaksNote>()?;
        writer.json_channel::<StageNote>()?;
        writer.json_channel::<RowNote>()?;
        writer.json_channel::<SettingsNote>()?;
        writer.json_channel::<EventNote>()?;
        writer.flush()?;
        Ok(writer)
    }

    /// Adds a frame: its image, exactly as given, and its metadata. `at_ns` is the middle of its exposure, Unix
    /// time in nanoseconds.
    ///
    /// # Errors
    /// [`RecordingError::Mcap`] if it cannot be written.
    pub fn frame(&mut self, at_ns: u64, note: &FrameNote, image: &GreyImage) -> Result<(), RecordingError> {
        // Before its image, for readers in one pass.
        self.note(at_ns, note)?;
        frames::encode(image, at_ns, &mut self.message);
        self.put(Topic::Image, at_ns)
    }

    /// Adds a profile in the camera frame, in metres.
    ///
    /// # Errors
    /// [`RecordingError::Mcap`] if it cannot be written.
    pub fn profile(
        &mut self,
        at_ns: u64,
        points: impl IntoIterator<Item = ProfilePoint>,
    ) -> Result<(), RecordingError> {
        let mut data = Vec::new();
        for point in points {
            let metres = point.position_mm.map(|mm| (mm * 1e-3) as f32);
            let numbers = metres.into_iter().chain([point.sigma_mm * 1e-3]);
            data.extend(numbers.flat_map(f32::to_le_bytes));
            data.push(point.order.cast_unsigned());
        }
        let field = |(name, offset, kind): (&str, u32, NumericType)| PackedElementField {
            name: name.to_owned(),
            offset,
            r#type: kind as i32,
        };
        let fields = [
            ("x", 0, NumericType::Float32),
            ("y", 4, NumericType::Float32),
            ("z", 8, NumericType::Float32),
            ("sigma", 12, NumericType::Float32),
            ("order", 16, NumericType::Int8),
        ];
        let cloud = PointCloud {
            timestamp: Some(frames::timestamp(at_ns)),
            frame_id: CAMERA_FRAME.to_owned(),
            pose: Some(Pose {
                position: Some(Vector3::default()),
                orientation: Some(Quaternion { w: 1.0, ..Quaternion::default() }),
            }),
            point_stride: POINT_STRIDE,
            fields: fields.into_iter().map(field).collect(),
            data: Bytes::from(data),
        };
        self.message.clear();
        cloud.encode(&mut self.message).expect("a vector grows on demand");
        self.put(Topic::Profile, at_ns)
    }

    /// Adds a JSON message.
    ///
    /// # Errors
    /// [`RecordingError::Mcap`] if it cannot be written.
    pub fn note<N: JsonMessage>(&mut self, at_ns: u64, note: &N) -> Result<(), RecordingError> {
        self.message.clear();
        serde_json::to_writer(&mut self.message, note).expect("the messages of this crate are JSON");
        self.put(N::TOPIC, at_ns)
    }

    /// Closes the chunk and flushes it to the operating system: everything added so far survives a crash of this
    /// process.
    ///
    /// # Errors
    /// [`RecordingError::Mcap`] if it cannot be written.
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        Ok(self.file.flush()?)
    }

    /// Writes the end record and the index; returns the output.
    ///
    /// # Errors
    /// [`RecordingError::Mcap`] if it cannot be written; flushed data remain readable.
    pub fn finish(mut self, end: &RecordingEnd) -> Result<W, RecordingError> {
        self.file.write_metadata(&end.to_metadata())?;
        self.file.finish()?;
        let mut out = self.file.into_inner().into_inner();
        out.flush().map_err(mcap::McapError::from)?;
        Ok(out)
    }

    fn json_channel<N: JsonMessage>(&mut self) -> Result<(), RecordingError> {
        let schema = serde_json::to_vec(&schemars::schema_for!(N)).expect("a schema is JSON");
        self.channel(N::TOPIC, N::SCHEMA, "jsonschema", &schema)
    }

    fn channel(&mut self, topic: Topic, name: &str, encoding: &str, schema: &[u8]) -> Result<(), RecordingError> {
        let messages = if encoding == "jsonschema" { "json" } else { encoding };
        let schema = self.file.add_schema(name, encoding, schema)?;
        let channel = self.file.add_channel(
            schema,
            topic.name(),
            messages,
            &BTreeMap::from([("format".to_owned(), FORMAT.to_owned())]),
        )?;
        self.channels.insert(topic, channel);
        Ok(())
    }

    fn put(&mut self, topic: Topic, at_ns: u64) -> Result<(), RecordingError> {
        let count = self.counts.entry(topic).or_default();
        let header = MessageHeader {
            channel_id: self.channels[&topic],
            sequence: *count,
            log_time: at_ns,
            publish_time: at_ns,
        };
        *count = count.wrapping_add(1);
        Ok(self.file.write_to_known_channel(&header, &self.message)?)
    }
}
