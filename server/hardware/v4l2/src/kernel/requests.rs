//! The requests: number, structure, direction.

use std::os::raw::c_int;

use super::structures::{
    Buffer, Capability, ControlValue, Format, FormatDescription, FrameInterval, FrameSize, QueryControl,
    RequestBuffers, StreamParameters,
};

const V: u8 = b'V';

nix::ioctl_read!(query_capability, V, 0, Capability);
nix::ioctl_readwrite!(enumerate_formats, V, 2, FormatDescription);
nix::ioctl_readwrite!(set_format, V, 5, Format);
nix::ioctl_readwrite!(request_buffers, V, 8, RequestBuffers);
nix::ioctl_readwrite!(query_buffer, V, 9, Buffer);
nix::ioctl_readwrite!(queue_buffer, V, 15, Buffer);
nix::ioctl_readwrite!(dequeue_buffer, V, 17, Buffer);
nix::ioctl_write_ptr!(stream_on, V, 18, c_int);
nix::ioctl_write_ptr!(stream_off, V, 19, c_int);
nix::ioctl_readwrite!(get_parameters, V, 21, StreamParameters);
nix::ioctl_readwrite!(set_parameters, V, 22, StreamParameters);
nix::ioctl_readwrite!(get_control, V, 27, ControlValue);
nix::ioctl_readwrite!(set_control, V, 28, ControlValue);
nix::ioctl_readwrite!(query_control, V, 36, QueryControl);
nix::ioctl_readwrite!(enumerate_frame_sizes, V, 74, FrameSize);
nix::ioctl_readwrite!(enumerate_frame_intervals, V, 75, FrameInterval);

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::fs;
    use std::mem::{offset_of, size_of};
    use std::process::Command;

    use nix::{request_code_read, request_code_readwrite, request_code_write};

    use super::super::structures::*;
    use super::*;

    /// C expressions and their values in Rust.
    fn expected() -> Vec<(&'static str, usize)> {
        let mut rows = vec![
            ("sizeof(struct v4l2_capability)", size_of::<Capability>()),
            ("sizeof(struct v4l2_fmtdesc)", size_of::<FormatDescription>()),
            ("sizeof(struct v4l2_frmsizeenum)", size_of::<FrameSize>()),
            ("sizeof(struct v4l2_frmivalenum)", size_of::<FrameInterval>()),
            ("sizeof(struct v4l2_format)", size_of::<Format>()),
            ("sizeof(struct v4l2_pix_format)", size_of::<PixelFormat>()),
            ("sizeof(struct v4l2_streamparm)", size_of::<StreamParameters>()),
            ("sizeof(struct v4l2_queryctrl)", size_of::<QueryControl>()),
            ("sizeof(struct v4l2_control)", size_of::<ControlValue>()),
            ("sizeof(struct v4l2_requestbuffers)", size_of::<RequestBuffers>()),
            ("sizeof(struct v4l2_buffer)", size_of::<Buffer>()),
            ("offsetof(struct v4l2_capability, device_caps)", offset_of!(Capability, device_caps)),
            ("offsetof(struct v4l2_fmtdesc, pixelformat)", offset_of!(FormatDescription, pixelformat)),
            ("offsetof(struct v4l2_frmsizeenum, stepwise)", offset_of!(FrameSize, sizes)),
            ("offsetof(struct v4l2_frmivalenum, stepwise)", offset_of!(FrameInterval, intervals)),
            ("offsetof(struct v4l2_format, fmt)", offset_of!(Format, fmt)),
            ("offsetof(struct v4l2_pix_format, bytesperline)", offset_of!(PixelFormat, bytesperline)),
            (
                "offsetof(struct v4l2_streamparm, parm.capture.timeperframe)",
                offset_of!(StreamParameters, timeperframe),
            ),
            ("offsetof(struct v4l2_queryctrl, minimum)", offset_of!(QueryControl, minimum)),
            ("offsetof(struct v4l2_queryctrl, flags)", offset_of!(QueryControl, flags)),
            ("offsetof(struct v4l2_buffer, bytesused)", offset_of!(Buffer, bytesused)),
            ("offsetof(struct v4l2_buffer, timestamp)", offset_of!(Buffer, timestamp)),
            ("offsetof(struct v4l2_buffer, sequence)", offset_of!(Buffer, sequence)),
            ("offsetof(struct v4l2_buffer, m)", offset_of!(Buffer, m)),
            ("offsetof(struct v4l2_buffer, length)", offset_of!(Buffer, length)),
        ];
        let mut request = |name, code: u64| rows.push((name, code as usize));
        request("VIDIOC_QUERYCAP", request_code_read!(V, 0, size_of::<Capability>()));
        request("VIDIOC_ENUM_FMT", request_code_readwrite!(V, 2, size_of::<FormatDescription>()));
        request("VIDIOC_S_FMT", request_code_readwrite!(V, 5, size_of::<Format>()));
        request("VIDIOC_REQBUFS", request_code_readwrite!(V, 8, size_of::<RequestBuffers>()));
        request("VIDIOC_QUERYBUF", request_code_readwrite!(V, 9, size_of::<Buffer>()));
        request("VIDIOC_QBUF", request_code_readwrite!(V, 15, size_of::<Buffer>()));
        request("VIDIOC_DQBUF", request_code_readwrite!(V, 17, size_of::<Buffer>()));
        request("VIDIOC_STREAMON", request_code_write!(V, 18, size_of::<c_int>()));
        request("VIDIOC_STREAMOFF", request_code_write!(V, 19, size_of::<c_int>()));
        request("VIDIOC_G_PARM", request_code_readwrite!(V, 21, size_of::<StreamParameters>()));
        request("VIDIOC_S_PARM", request_code_readwrite!(V, 22, size_of::<StreamParameters>()));
        request("VIDIOC_G_CTRL", request_code_readwrite!(V, 27, size_of::<ControlValue>()));
        request("VIDIOC_S_CTRL", request_code_readwrite!(V, 28, size_of::<ControlValue>()));
        request("VIDIOC_QUERYCTRL", request_code_readwrite!(V, 36, size_of::<QueryControl>()));
        request("VIDIOC_ENUM_FRAMESIZES", request_code_readwrite!(V, 74, size_of::<FrameSize>()));
        request("VIDIOC_ENUM_FRAMEINTERVALS", request_code_readwrite!(V, 75, size_of::<FrameInterval>()));
        let controls = crate::controls::ids();
        rows.extend(controls.into_iter().map(|(name, id)| (name, id.0 as usize)));
        rows
    }

    #[test]
    fn structures_and_numbers_are_those_of_the_kernels_header() {
        if !reference::has_program("cc", "gcc") {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let (source, program) = (folder.path().join("layout.c"), folder.path().join("layout"));
        let mut text =
            String::from("#include <linux/videodev2.h>\n#include <stddef.h>\n#include <stdio.h>\nint main() {\n");
        for (expression, _) in expected() {
            writeln!(text, "printf(\"%lu\\n\", (unsigned long) ({expression}));").unwrap();
        }
        text.push_str("return 0; }\n");
        fs::write(&source, text).unwrap();
        let compiled = Command::new("cc").arg(&source).arg("-o").arg(&program).output().unwrap();
        assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
        let said = String::from_utf8(Command::new(&program).output().unwrap().stdout).unwrap();
        let said: Vec<usize> = said.lines().map(|line| line.parse().unwrap()).collect();
        assert_eq!(said.len(), expected().len());
        for ((expression, here), header) in expected().into_iter().zip(said) {
            assert_eq!(here, header, "{expression}");
        }
    }
}
