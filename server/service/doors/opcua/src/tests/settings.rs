//! Settings that cannot be used.

use crate::door::OpcUaDoor;
use crate::settings::{Settings, User};
use crate::tests::plant::Plant;

fn refused(change: impl FnOnce(&mut Settings)) -> (&'static str, String) {
    let mut settings = Plant::new().settings();
    // The plant's folder is gone.
    settings.users.clear();
    settings.anonymous = true;
    settings.commands = false;
    change(&mut settings);
    let bad = OpcUaDoor::new(settings).err().unwrap();
    (bad.setting, bad.why)
}

#[test]
fn a_setting_that_cannot_be_used_is_named() {
    assert_eq!(refused(|settings| settings.name = " ".to_owned()).0, "name");
    assert_eq!(refused(|settings| settings.certificates = "pki".into()).0, "certificates");
    assert_eq!(refused(|settings| settings.anonymous = false).0, "users");
    assert_eq!(refused(|settings| settings.commands = true).0, "commands");
    let user = |name: &str| User { name: name.to_owned(), password_file: "/nowhere/password".into() };
    assert_eq!(refused(|settings| settings.users = vec![user("ANONYMOUS")]).0, "users");
    let (setting, why) = refused(|settings| settings.users = vec![user("mes")]);
    assert_eq!(setting, "password_file");
    assert!(why.starts_with("/nowhere/password cannot be read"), "{why}");
}

#[test]
fn an_empty_password_or_a_second_user_of_the_same_name_is_refused() {
    let plant = Plant::new();
    let settings = plant.settings();
    std::fs::write(plant.folder.path().join("empty"), "\n").unwrap();
    let empty = User { name: "plc".to_owned(), password_file: plant.folder.path().join("empty") };
    let twice = settings.users[0].clone();
    for (user, setting) in [(empty, "password_file"), (twice, "users")] {
        let users = vec![settings.users[0].clone(), user];
        let bad = OpcUaDoor::new(Settings { users, ..settings.clone() }).err().unwrap();
        assert_eq!(bad.setting, setting);
    }
}
