//! asyncua browses, logs in, starts jobs and receives results; see `tests/client.py`.

use serde_json::{Value, json};

use crate::tests::plant::{FAULT, FAULTY, PASSWORD, POLICY, Plant, answer};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_finds_the_vision_system_of_the_standard() {
    let mut plant = Plant::new();
    let anonymous = crate::Settings { users: Vec::new(), commands: false, anonymous: true, ..plant.settings() };
    plant.start(anonymous).await;
    let Some(output) = plant.client("none", "-", "-", &["browse"]).await else { return };
    let seen = answer(&output);
    assert_eq!(seen["type"], json!([1003, true]));
    assert_eq!((&seen["state"], &seen["number"]), (&json!(["Operational", "Ready"]), &json!(4)), "{seen:#}");
    let machine = &seen["children"]["VisionStateMachine"];
    for name in ["Halt", "Reset", "CurrentState", "AutomaticModeStateMachine"] {
        assert!(machine[name].is_object(), "{name}: {machine:#}");
    }
    let start = &machine["AutomaticModeStateMachine"]["StartSingleJob"];
    assert_eq!(start, &json!({ "InputArguments": {}, "OutputArguments": {} }));
    let results = &seen["children"]["ResultManagement"];
    for name in ["GetResultById", "GetResultComponentsById", "GetResultListFiltered", "Results"] {
        assert!(results[name].is_object(), "{name}: {results:#}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_starts_a_job_and_receives_its_result_four_times_alike() {
    let mut plant = Plant::new();
    plant.start(plant.settings()).await;
    let Some(()) = plant.introduce().await else { return };
    let Some(seen) = plant.user(&["inspect", "bracket", "S-1"]).await else { return };
    assert_eq!((&seen["error"], &seen["by_id_error"]), (&json!(0), &json!(0)), "{seen:#}");
    let expected = json!({
        "id": "inspection-1", "serial": "S-1", "recipe": "bracket", "version": "7", "job_id": "job-1",
        "meas_id": "M-1", "simulated": true, "verdict": "invalid", "ids": ["h", "w"], "values": [8.912, null],
        "expanded_uncertainties": [0.01, null], "verdicts": ["ok", "invalid"],
        "lower_limits": [8.85, 8.85], "upper_limits": [null, null],
    });
    for way in ["event", "by_id", "latest", "components"] {
        assert_eq!(seen[way], expected, "{way}");
    }
    // The second one asked for a result that does not exist.
    assert_eq!(seen["components_errors"], json!([0, 13]));
    assert_eq!(seen["message"], "part S-1: invalid");
    // The station went from Initialized to Ready, which the standard has between execution and Initialized, too.
    assert_eq!(seen["states"], json!(["SingleExecution", "Ready", "Initialized", "Ready"]));
    assert_eq!(seen["started"], json!(["job-1"]));
    assert_eq!(*plant.line.calls.lock(), ["mes start S-1 Some(\"bracket\")"]);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_second_client_of_another_author_browses_starts_and_receives() {
    let mut plant = Plant::new();
    plant.start(plant.settings()).await;
    let Some(refused) = plant.second_client(&["connect"]).await else { return };
    assert!(!refused.status.success(), "an unknown client was let in");
    assert_eq!(plant.trust_rejected(), 1, "{}", String::from_utf8_lossy(&refused.stderr));
    let Some(output) = plant.second_client(&["inspect", "bracket", "S-1"]).await else { return };
    let seen = answer(&output);
    let has = |of: &str, name: &str| seen["browsed"][of].as_array().unwrap().contains(&json!(name));
    for name in ["VisionStateMachine", "RecipeManagement", "ResultManagement"] {
        assert!(has("system", name), "{name}: {seen:#}");
    }
    assert!(has("automatic", "StartSingleJob"), "{seen:#}");
    assert_eq!(seen["started"], json!({ "status": "Good", "job_id": "job-1", "error": 0 }));
    let expected = json!({
        "id": "inspection-1", "serial": "S-1", "recipe": "bracket", "version": "7", "job_id": "job-1",
        "verdict": "invalid", "ids": ["h", "w"], "units": ["mm", "mm"], "values": [8.912, null],
        "expanded_uncertainties": [0.01, null], "verdicts": ["ok", "invalid"],
        "lower_limits": [8.85, 8.85], "upper_limits": [null, null],
    });
    for way in ["event", "latest"] {
        assert_eq!(seen[way], expected, "{way}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_fault_is_reported_with_its_remedy_and_so_is_its_end() {
    let mut plant = Plant::new();
    plant.start(plant.settings()).await;
    let Some(()) = plant.introduce().await else { return };
    let Some(seen) = plant.user(&["fail", "bracket", FAULTY]).await else { return };
    let error = json!([{
        "message": FAULT, "severity": 800, "source": "VisionStateMachine", "from": "SingleExecution", "to": "Error"
    }]);
    assert_eq!(seen["error"], error);
    let resolved = json!([{
        "message": "the error is resolved", "severity": 100, "source": "VisionStateMachine", "from": "Error",
        "to": "Preoperational",
    }]);
    assert_eq!(seen["resolved"], resolved);
    // Failed, without content.
    let unfinished = json!({ "is_of_job": true, "state": 4, "recipe": "bracket", "content": null,
        "message": format!("part {FAULTY} has no result: failed") });
    assert_eq!(seen["unfinished"], unfinished);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn commands_reach_the_station_and_refusals_have_numbers() {
    let mut plant = Plant::new();
    plant.start(plant.settings()).await;
    let Some(()) = plant.introduce().await else { return };
    let Some(outcomes) = plant.user(&["commands"]).await else { return };
    let expected = json!({
        "PrepareRecipe": 0, "StartSingleJob": 0, "UnprepareRecipe": 0, "NoRecipe": 3, "NoSerial": 0, "Abort": 0,
        "Stop": 0, "Halt": 0, "Halted": ["Halted", null], "Reset": 0, "AfterReset": ["Preoperational", null],
    });
    assert_eq!(outcomes, expected);
    let calls = plant.line.calls.lock().clone();
    // Without a part's id, the measurement's is the serial number; the prepared recipe is used without another one.
    let expected = [
        "mes start S-prepared Some(\"bracket\")",
        "mes start S-1 Some(\"unknown\")",
        "mes start M-1 Some(\"bracket\")",
        "mes abort job-2",
        "mes abort job-2",
        "mes halt",
        "mes reset",
    ];
    assert_eq!(calls, expected);
    let Some(recipes) = plant.user(&["recipes"]).await else { return };
    assert_eq!(recipes, json!([["bracket", "7", "00ff"]]));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn only_known_clients_with_the_right_password_get_in_whatever_the_policy() {
    let mut plant = Plant::new();
    plant.start(plant.settings()).await;
    let Some(()) = plant.introduce().await else { return };
    for policy in ["Basic256Sha256", "Aes128Sha256RsaOaep", "Aes256Sha256RsaPss"] {
        let Some(output) = plant.client(policy, "mes", PASSWORD, &["connect"]).await else { return };
        assert_eq!(answer(&output), json!({ "state": ["Operational", "Ready"] }), "{policy}");
    }
    for (policy, user, password) in
        [(POLICY, "mes", "wrong"), (POLICY, "other", PASSWORD), (POLICY, "-", "-"), ("none", "-", "-")]
    {
        let Some(output) = plant.client(policy, user, password, &["connect"]).await else { return };
        assert!(!output.status.success(), "{policy} {user} {password}");
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        let private = std::fs::metadata(plant.pki().join("private")).unwrap();
        assert_eq!(private.permissions().mode() & 0o777, 0o700, "the private key can be read by others");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_command_is_refused_unless_commands_are_on() {
    let mut plant = Plant::new();
    let reading = crate::Settings { commands: false, anonymous: true, ..plant.settings() };
    plant.start(reading).await;
    let Some(()) = plant.introduce().await else { return };
    let Some(as_user) = plant.user(&["commands"]).await else { return };
    let Some(output) = plant.client("none", "-", "-", &["commands"]).await else { return };
    for outcomes in [as_user, answer(&output)] {
        for (name, outcome) in outcomes.as_object().unwrap() {
            let expected = if name.starts_with('H') && name != "Halt" || name == "AfterReset" {
                json!(["Operational", "Ready"])
            } else {
                json!("BadUserAccessDenied")
            };
            assert_eq!(*outcome, expected, "{name}");
        }
    }
    assert_eq!(plant.line.calls.lock().len(), 0);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_that_was_away_lists_what_it_missed_also_after_a_crash() {
    let mut plant = Plant::new();
    plant.start(plant.settings()).await;
    let Some(()) = plant.introduce().await else { return };
    for serial in ["S-1", "S-2", "S-3"] {
        plant.line.inspect(serial, None);
    }
    plant.kill().await;
    plant.start(plant.settings()).await;
    let serials = |listed: &Value| -> Vec<Value> {
        listed["results"].as_array().unwrap().iter().map(|result| result["serial"].clone()).collect()
    };
    let Some(all) = plant.user(&["list", "", "0", "0"]).await else { return };
    assert_eq!((serials(&all), &all["complete"]), (vec![json!("S-3"), json!("S-2"), json!("S-1")], &json!(true)));
    let Some(page) = plant.user(&["list", "", "1", "1"]).await else { return };
    assert_eq!(
        (serials(&page), &page["complete"], &page["count"]),
        (vec![json!("S-2")], &json!(false), &json!(1))
    );
    let Some(one) = plant.user(&["list", "S-1", "0", "0"]).await else { return };
    assert_eq!(serials(&one), [json!("S-1")]);
}
