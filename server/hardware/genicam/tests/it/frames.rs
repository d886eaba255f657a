//! Received frames, lost frames, and their counts.

use devices::{CameraRequest, PixelFormat, Trigger};
use vision::Pixels;

use crate::rig::{SERIAL, blank, fake, frame, open_small, settings, until};

#[test]
fn pixels_are_received_unchanged() {
    let Some(_camera) = fake(0) else { return };
    for (name, format, green) in [
        ("Mono8", PixelFormat::Mono8, false),
        ("Mono16", PixelFormat::Mono16, false),
        ("BayerRG8", PixelFormat::Mono8, true),
    ] {
        let mut wanted = settings(SERIAL);
        if green {
            wanted.format_8 = name.to_owned();
        }
        let mut camera = open_small(&wanted, 30.0);
        camera.configure(&CameraRequest { pixel_format: Some(format), ..CameraRequest::default() }).unwrap();
        camera.start().unwrap();
        let mut image = blank();
        frame(&mut *camera, &mut image);
        let from = camera.details().unwrap().link().pixels_from;
        assert_eq!(from, if green { format!("{name}: green, interpolated") } else { name.to_owned() });
        // The camera draws a ramp that rises by one level per column, row and frame, and wraps around.
        let levels: Vec<i32> = match image.pixels() {
            Pixels::Eight(pixels) => pixels.iter().map(|&pixel| i32::from(pixel)).collect(),
            Pixels::Sixteen(pixels) => pixels.iter().map(|&pixel| i32::from(pixel >> 8)).collect(),
        };
        assert_eq!(levels.len(), 128 * 96);
        if green {
            continue;
        }
        for y in 0..95 {
            for x in 0..127 {
                let step = levels[y * 128 + x + 1] - levels[y * 128 + x];
                assert!(step == 1 || step < -200, "{name}: {step} from column {x} of row {y}");
                assert_eq!(levels[y * 128 + x + 1], levels[(y + 1) * 128 + x], "{name}: column {x}, row {y}");
            }
        }
    }
}

#[test]
fn frames_with_missing_packets_are_counted_and_never_delivered() {
    let Some(_camera) = fake(40) else { return };
    let mut camera = open_small(&settings(SERIAL), 200.0);
    camera.start().unwrap();
    let (mut image, mut shown, mut lost, mut incomplete, mut last_id) = (blank(), 0, 0, 0, 0);
    until(&mut *camera, &mut image, "lost frames", |image, got| {
        if let Some(info) = got.expect("the camera is connected") {
            (shown, lost) = (shown + 1, lost + info.lost_before);
            incomplete += info.lost_incomplete;
            assert!(info.lost_incomplete <= info.lost_before);
            last_id = info.frame_id;
            assert_eq!(shown + lost, info.frame_id + 1, "received and lost frames are all frames");
            let Pixels::Eight(pixels) = image.pixels() else { panic!("8 bits were set") };
            // Bytes of missing packets would come from another frame or be zero.
            let smooth = pixels.windows(2).enumerate().filter(|(at, _)| at % 128 != 127).all(|(_, pair)| {
                let step = i32::from(pair[1]) - i32::from(pair[0]);
                step == 1 || step < -200
            });
            assert!(smooth, "frame {} contains bytes of another frame", info.frame_id);
        }
        (shown >= 100 && incomplete >= 10).then_some(())
    });
    let link = camera.details().unwrap().link();
    assert!(link.frames_complete >= shown && link.frames_incomplete >= incomplete, "{link:?}");
    assert!(link.packets_missing >= incomplete && link.resend_requests > 0, "{link:?}");
}

#[test]
fn every_software_trigger_gives_a_frame_or_a_counted_loss() {
    let Some(_camera) = fake(30) else { return };
    let mut camera = open_small(&settings(SERIAL), 30.0);
    camera.configure(&CameraRequest { trigger: Some(Trigger::Software), ..CameraRequest::default() }).unwrap();
    camera.start().unwrap();
    let (mut image, mut answered, mut lost) = (blank(), 0_u64, 0);
    for sent in 1..=40_u64 {
        camera.trigger().unwrap();
        let triggered_at = std::time::Instant::now();
        // A lost frame is noticed with the next frame or never; the next trigger does not wait for it.
        until(&mut *camera, &mut image, "a frame or the time limit", |_, got| {
            if let Some(info) = got.expect("the camera is connected") {
                (answered, lost) = (answered + 1, lost + info.lost_before);
                assert_eq!(answered + lost, info.frame_id + 1);
                assert!(info.frame_id < sent, "frame {info:?} after {sent} triggers: it was not requested");
                return Some(());
            }
            (triggered_at.elapsed().as_millis() > 800).then_some(())
        });
    }
    assert!(answered > 20 && answered + lost <= 40, "{answered} answered, {lost} lost");
}

#[test]
fn exposure_times_follow_the_camera_clock_within_their_uncertainty() {
    let Some(_camera) = fake(0) else { return };
    let mut camera = open_small(&settings(SERIAL), 50.0);
    camera.configure(&CameraRequest { exposure_us: Some(100.0), ..CameraRequest::default() }).unwrap();
    camera.start().unwrap();
    let (mut image, mut frames) = (blank(), Vec::new());
    while frames.len() < 150 {
        frames.push(frame(&mut *camera, &mut image));
    }
    let stated = camera.details().unwrap().link().clock_uncertainty.expect("a line after 150 frames");
    let settled = &frames[50..];
    let (first, last) = (settled[0], settled[settled.len() - 1]);
    let device_s = |ns: Option<u64>| ns.expect("it stamps frames") as f64 * 1e-9;
    for info in settled {
        let by_host = info.exposed_at.duration_since(first.exposed_at).as_secs_f64();
        let by_device = device_s(info.device_timestamp_ns) - device_s(first.device_timestamp_ns);
        // Two lines, each with its stated uncertainty, and a fifth of a period as the limit of both.
        let allowed = 2.0 * stated.as_secs_f64() + 0.004;
        assert!((by_host - by_device).abs() < allowed, "{by_host} and {by_device} s, stated {stated:?}");
    }
    assert!(last.exposed_at > first.exposed_at && stated.as_secs_f64() < 0.1, "{stated:?}");
}
