//! `gmhm drive`: watch, try, keep, take back.

use crate::common::two_blocks;
use crate::served::{Joint, ON, blank, faulty, serve};
use gmhm::link::CompensationSetting;

#[test]
fn parameters_are_tried_kept_and_taken_back() {
    let dir = two_blocks();
    let served = serve(Joint::default(), blank(), 17, None);
    let to = format!("tcp:{}", served.address);
    let drive = |words: &str| dir.succeed(&format!("drive --to {to} {words}")).stdout;
    assert!(drive("status").contains("in force      nothing\n"));
    assert!(dir.succeed(&format!("drive status --to {to}")).stdout.contains("in force      nothing\n"));
    dir.succeed(&format!("flash params.bin --to {to}"));

    let tried = drive("try softer.bin");
    assert!(tried.contains("on trial, read back") && tried.contains("stores it as sequence 2"), "{tried}");
    assert!(drive("status").contains("on trial, in RAM: sequence 2"));
    drive("revert");
    let status = drive("status --json status.json");
    assert!(status.contains("as stored: sequence 1") && status.contains("newest stored sequence 1"), "{status}");

    // A second trial makes way for a third, which is kept.
    drive("try softer.bin");
    drive("try softer.bin");
    assert!(drive("commit").contains("sequence 2"));
    drive("read -o back.bin");
    assert!(drive("rollback").contains("in force again: sequence 1"));
    assert!(drive("status").contains("as stored: sequence 1"));
    assert!(drive("erase-unreadable").contains("all slots can be read"));
    assert!(drive("status").contains("as stored: sequence 1"));
    assert!(drive("on").contains("compensation on"));
    assert!(drive("gain 0.25").contains("compensation on, gain ratio 0.25"));
    let (joint, _) = served.end();
    assert_eq!(joint.parameters.map(|parameters| parameters.header.sequence), Some(1));
    assert!(joint.compensation == CompensationSetting { on: true, gain_ratio: 0.25 });

    let status: serde_json::Value = serde_json::from_str(&dir.read("status.json")).expect("JSON");
    assert_eq!((&status["origin"], &status["stored_sequence"]), (&"stored".into(), &1.into()));
    let c1 = |file: &str| {
        let shown = dir.succeed(&format!("inspect {file}")).stdout;
        shown.lines().find(|line| line.contains("c1_nm")).expect("c1").to_owned()
    };
    assert_eq!(c1("back.bin"), c1("softer.bin"));
    assert_ne!(c1("back.bin"), c1("params.bin"));
}

#[test]
fn what_a_drive_measures_is_read() {
    let dir = two_blocks();
    let served = serve(Joint::default(), blank(), 1, None);
    let told = dir
        .succeed(&format!("drive --to tcp:{} live --seconds 0.2 --every 0.05 --json live.json", served.address))
        .stdout;
    served.end();
    let lines: Vec<&str> = told.lines().collect();
    assert_eq!(lines.len(), 5, "{told}");
    assert!(lines[0].contains("deflection_rad  torque_model_nm  hysteresis_nm"));
    assert!(lines[4].contains("2.5") && lines[4].contains("-1.50000") && lines[4].ends_with("out of range"), "{told}");
    let live: serde_json::Value = serde_json::from_str(&dir.read("live.json")).expect("JSON");
    let moments = live.as_array().expect("a list");
    assert_eq!(moments.len(), 4);
    assert!(moments.iter().all(|moment| moment["ticks"] == 77 && moment["torque_model_nm"] == -1.5));
    assert!(moments[3]["time_s"].as_f64().is_some_and(|time| time >= 0.15));
}

#[test]
fn faults_are_counted_until_they_are_cleared() {
    let dir = two_blocks();
    let served = serve(Joint { diagnostics: faulty(), ..Joint::default() }, blank(), 4, None);
    let to = format!("drive --to tcp:{}", served.address);
    let json = |file: &str| -> serde_json::Value { serde_json::from_str(&dir.read(file)).expect("JSON") };

    let told = dir.succeed(&format!("{to} live --seconds 0.1 --json live.json")).stdout;
    let counted = "refused 3, out of range 4, quarantined 5, restarted 6, saturated 7, merged 8; last saturated";
    assert!(told.trim_end().ends_with(counted), "{told}");
    let joint = serde_json::json!({
        "samples_refused": 3, "samples_out_of_range": 4, "samples_quarantined": 5, "new_starts": 6,
        "torques_saturated": 7, "turning_points_merged": 8, "last_fault": "saturated", "self_test": "passed"
    });
    assert_eq!(json("live.json")[0]["diagnostics"], joint);

    let told = dir.succeed(&format!("{to} diagnostics --clear --json before.json")).stdout;
    for line in ["samples quarantined     5", "torques saturated       7", "last fault              saturated"] {
        assert!(told.contains(line), "{told}");
    }
    let before = json("before.json");
    for (name, value) in joint.as_object().expect("an object") {
        assert_eq!(&before[name], value, "{name}");
    }
    assert!(before["frames"].as_u64() > Some(1) && before["bound_while_enabled"].as_f64().is_some(), "{before}");

    dir.succeed(&format!("{to} diagnostics --json after.json"));
    let after = json("after.json");
    assert_eq!((&after["torques_saturated"], &after["last_fault"]), (&0.into(), &"none".into()));
    // The end of the session that cleared them, and the question.
    assert_eq!((&after["frames"], &after["self_test"]), (&2.into(), &"passed".into()));
    let told = dir.succeed(&format!("{to} live --seconds 0.1")).stdout;
    assert!(told.trim_end().ends_with("out of range"), "{told}");
    served.end();
}

#[test]
fn quiet_a_drive_tells_nothing_but_errors_and_files() {
    let dir = two_blocks();
    let commands = ["status", "diagnostics", "live --seconds 0.1 --json live.json", "off", "bound inf"];
    let served = serve(Joint::default(), blank(), commands.len(), None);
    for words in commands {
        let done = dir.succeed(&format!("drive --to tcp:{} {words} -q", served.address));
        assert!(done.stdout.is_empty() && done.stderr.is_empty(), "{words}: {}{}", done.stdout, done.stderr);
    }
    served.end();
    assert!(dir.read("live.json").contains("ticks"));
}

#[test]
fn refusals_name_the_mend() {
    let dir = two_blocks();
    let joint = Joint { enabled: true, compensation: ON, ..Joint::default() };
    let served = serve(joint, blank(), 5, None);
    let to = format!("drive --to tcp:{}", served.address);
    let refuse = |words: &str, told: &str| dir.refuse(&format!("{to} {words}"), &[told, "help: "]);
    refuse("try params.bin", "the compensation is on");
    refuse("revert", "no parameters are on trial");
    refuse("read -o none.bin", "no parameters are in force");
    dir.refuse(&format!("{to} commit"), &["the drive is enabled"]);
    dir.refuse(&format!("{to} rollback"), &["the drive is enabled"]);
    let (joint, memory) = served.end();
    assert!(joint.parameters.is_none() && memory == blank());

    dir.refuse("drive --to probe live", &["cannot communicate with the firmware", "help: "]);
    assert_eq!(dir.gmhm("drive --to tcp:localhost:1 gain 1.5").status, Some(2));
    assert_eq!(dir.gmhm("drive --to tcp:localhost:1").status, Some(2));
    assert_eq!(dir.gmhm("drive status").status, Some(2));
}
