//! Selection of the channel from photographs taken by others.

use capture::{LaserChannel, read_photograph};
use vision::{CameraImage, CentrelineParams, Channel, LineDirection};

const SETS: [[&str; 2]; 3] = [
    ["laser_on_object/laser.png", "laser_on_object/laser_background.png"],
    ["laser_on_pattern/laser-0-255-255-8.png", "laser_on_pattern/laser-background-0-255-255-8.png"],
    ["laser_on_pattern/laser-0-255-255-8-x.png", "laser_on_pattern/laser-background-0-255-255-8-x.png"],
];

#[test]
fn a_red_laser_in_a_room_is_red() {
    let Some(data) = reference::data("real/ciclop") else { return };
    let read = |name: &str| read_photograph(&data.join(name)).unwrap().picture;
    let line_direction = LineDirection::Columns;
    let params = [CentrelineParams { line_direction, ..CentrelineParams::default() }];
    for [on, off] in SETS {
        let (on_picture, off_picture) = (read(on), read(off));
        let decided = |picture: &CameraImage| LaserChannel::decided(1, |_| Some(picture.clone()), &params);
        let alone = decided(&on_picture);
        assert!(matches!(alone.channel, Channel::Red | Channel::RedMinusOthers), "{on}: {alone:?}");
        let without_room = decided(&on_picture.minus(&off_picture).unwrap());
        assert!(matches!(without_room.channel, Channel::Red | Channel::RedMinusOthers), "{on}: {without_room:?}");
        println!("{on}: {alone}; with a background {without_room}");
    }
    let together = LaserChannel::decided(3, |idx| Some(read(SETS[idx][0])), &params);
    assert!(matches!(together.channel, Channel::Red | Channel::RedMinusOthers), "{together:?}");
}
