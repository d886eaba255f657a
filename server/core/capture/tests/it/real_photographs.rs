//! Selection of the channel from published photographs.

use capture::{LaserChannel, read_photograph};
use vision::{CameraImage, CentrelineParams, Channel, LineDirection};

const SETS: [[&str; 2]; 3] = [
    ["laser_on_object/laser.png", "laser_on_object/laser_background.png"],
    ["laser_on_pattern/laser-0-255-255-8.png", "laser_on_pattern/laser-background-0-255-255-8.png"],
    ["laser_on_pattern/laser-0-255-255-8-x.png", "laser_on_pattern/laser-background-0-255-255-8-x.png"],
];

#[test]
fn a_red_laser_in_ambient_light_is_found_in_a_red_channel() {
    let Some(data) = reference::data("real/ciclop") else { return };
    let read = |name: &str| read_photograph(&data.join(name)).unwrap().image;
    let line_direction = LineDirection::Columns;
    let params = [CentrelineParams { line_direction, ..CentrelineParams::default() }];
    for [on, off] in SETS {
        let (on_image, off_image) = (read(on), read(off));
        let decided = |image: &CameraImage| LaserChannel::decided(1, |_| Some(image.clone()), &params);
        let alone = decided(&on_image);
        assert!(matches!(alone.channel, Channel::Red | Channel::RedMinusOthers), "{on}: {alone:?}");
        let minus_background = decided(&on_image.minus(&off_image).unwrap());
        assert!(
            matches!(minus_background.channel, Channel::Red | Channel::RedMinusOthers),
            "{on}: {minus_background:?}"
        );
        println!("{on}: {alone}; with a background {minus_background}");
    }
    let together = LaserChannel::decided(3, |idx| Some(read(SETS[idx][0])), &params);
    assert!(matches!(together.channel, Channel::Red | Channel::RedMinusOthers), "{together:?}");
}
