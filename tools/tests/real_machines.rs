//! `gmhm diagnose` on recordings of real machines whose missing terms are known, where the folder `shared/recordings` lies beside the checkout.

use crate::common::WorkDir;
use crate::common::skips::real_recording;
use serde_json::Value;

/// Gravity and inertia on the motor side.
const ARM: &str = "format = 1\nname = \"arm\"\n[gear]\ntorque_side = \"motor\"\n[[term]]\nkind = \"gravity_load\"\ncos_nm = 0.0\nsin_nm = 0.0\n\
                   [[term]]\nkind = \"inertia\"\ninertia_kgm2 = 0.0\n";
/// Inertia on the motor side.
const AXIS: &str =
    "format = 1\nname = \"axis\"\n[gear]\ntorque_side = \"motor\"\n[[term]]\nkind = \"inertia\"\ninertia_kgm2 = 0.0\n";
/// Friction of a motor without a gear.
const MOTOR: &str = "format = 1\nname = \"motor\"\n[gear]\nratio = 1.0\ntorque_side = \"motor\"\n[[term]]\nkind = \"coulomb_friction\"\ntorque_nm = 0.1\n\
                     smoothing_rad_per_s = 0.01\n";

/// A recording without some of its columns in the work folder; none where it is not on this machine.
fn recording(dir: &WorkDir, name: &str, without: &[&str]) -> Option<()> {
    let text = std::fs::read_to_string(real_recording(name)?).unwrap();
    let header: Vec<&str> = text.lines().next()?.split(',').collect();
    let kept = |line: &str| -> String {
        let cells = line.split(',').zip(&header).filter(|(_, column)| !without.contains(column)).map(|(cell, _)| cell);
        cells.collect::<Vec<&str>>().join(",")
    };
    dir.write("rec.csv", text.lines().map(kept).collect::<Vec<String>>().join("\n"));
    Some(())
}

fn diagnosed(dir: &WorkDir, base: &str, rest: &str) -> Value {
    dir.write("base.toml", base);
    dir.succeed(&format!("diagnose base.toml rec.csv -o extended.toml --json found.json {rest}"));
    serde_json::from_str(&dir.read("found.json")).unwrap()
}

/// The effects that are named, with their fidelity checked against their verdict.
fn named(found: &Value) -> Vec<String> {
    let effects = found["effects"].as_array().unwrap();
    for effect in effects {
        match (effect["verdict"].as_str().unwrap(), effect["fidelity"].as_f64()) {
            ("named", Some(fidelity)) => assert!(fidelity >= 0.9, "{effect}"),
            ("approximate", fidelity) => assert!((0.7..0.9).contains(&fidelity.unwrap()), "{effect}"),
            ("unknown", _) => assert_eq!(effect["name"], "unknown", "{effect}"),
            _ => {}
        }
    }
    let known = effects.iter().filter(|e| e["verdict"] != "unknown");
    known.map(|e| e["name"].as_str().unwrap().to_owned()).collect()
}

/// Kinds that are named, perhaps among others.
fn assert_names(found: &Value, kinds: &[&str]) {
    let names = named(found);
    for kind in kinds {
        assert!(names.iter().any(|name| name == kind), "{kind}: {}", found["effects"]);
    }
}

fn held_out(found: &Value, of: &str) -> f64 {
    found["heldout"][of].as_f64().unwrap()
}

#[test]
fn an_industrial_arm_lacks_coulomb_friction() {
    let dir = WorkDir::new();
    if recording(&dir, "tx40_j5.csv", &["theta_in_rad"]).is_none() {
        return;
    }
    let found = diagnosed(&dir, ARM, "");
    assert_names(&found, &["coulomb_friction"]);
    assert!(found["predictable"].as_f64().unwrap() > 0.5, "{found}");
    // Textbook least squares leave 4.7 of 8.3 N·m.
    assert!(held_out(&found, "extended") < 0.65 * held_out(&found, "refitted"), "{}", found["heldout"]);
}

#[test]
fn the_wrong_side_of_the_torque_is_suggested() {
    let dir = WorkDir::new();
    if recording(&dir, "tx40_j5.csv", &["theta_in_rad"]).is_none() {
        return;
    }
    let found = diagnosed(&dir, &ARM.replace("\"motor\"", "\"output\""), "");
    let suggested = found["suggestions"].as_array().unwrap();
    assert!(suggested.iter().any(|s| s.as_str().unwrap().starts_with("torque_side = \"motor\"")), "{suggested:?}");
}

#[test]
fn a_ball_screw_lacks_coulomb_and_viscous_friction() {
    let dir = WorkDir::new();
    if recording(&dir, "emps_normal.csv", &["torque_sim_nm"]).is_none() {
        return;
    }
    let found = diagnosed(&dir, AXIS, "");
    assert_names(&found, &["coulomb_friction", "viscous_friction"]);
    // Textbook least squares leave 2.55 N.
    assert!(held_out(&found, "extended") < 2.8, "{}", found["heldout"]);
}

#[test]
fn a_ball_screw_with_coulomb_friction_lacks_viscous_friction() {
    let dir = WorkDir::new();
    if recording(&dir, "emps_normal.csv", &["torque_sim_nm"]).is_none() {
        return;
    }
    let coulomb = "[[term]]\nkind = \"coulomb_friction\"\ntorque_nm = 20.0\nsmoothing_rad_per_s = 0.002\n";
    let found = diagnosed(&dir, &format!("{AXIS}{coulomb}"), "");
    assert_eq!(found["effects"][0]["name"], "viscous_friction", "{}", found["effects"]);
    // A long delay of the torque in place of viscous friction would leave 2.0 N. The command leads the motion by half a sample of 1 ms to one: see docs/findings.md.
    let effects = found["effects"].as_array().unwrap();
    for delay in effects.iter().filter(|effect| effect["name"] == "time_skew") {
        let delay_s = delay["parameters"]["delay_s"]["value"].as_f64().unwrap();
        assert!((-1e-3..-0.5e-3).contains(&delay_s), "{delay}");
    }
    assert!(held_out(&found, "extended") < 2.1, "{}", found["heldout"]);
}

#[test]
fn a_motor_lacks_its_cogging() {
    let dir = WorkDir::new();
    if recording(&dir, "cogging_slow_nocomp_1.csv", &[]).is_none() {
        return;
    }
    // The whole recording has less than a turn. In each part of 60 % of it functions of time or velocity can describe the waves.
    for part in ["", "--to 5.5", "--from 3.7", "--from 1.9 --to 7.4"] {
        let found = diagnosed(&dir, MOTOR, &format!("--map theta_out_rad=theta_in_rad {part}"));
        // On the whole recording a delay of 37 ms is named beside the ripple.
        let expected = if part.is_empty() { &["torque_ripple", "time_skew"][..] } else { &["torque_ripple"] };
        assert_eq!(named(&found), expected, "{part}: {}", found["effects"]);
        assert!(held_out(&found, "extended") < 0.3 * held_out(&found, "refitted"), "{part}: {}", found["heldout"]);
    }
}

#[test]
fn an_axis_that_moves_few_strokes_lacks_its_inertia() {
    let friction = "[gear]\ntorque_side = \"motor\"\n[[term]]\nkind = \"coulomb_friction\"\ntorque_nm = 0.0\n\
                    smoothing_rad_per_s = 0.01\n[[term]]\nkind = \"viscous_friction\"\ndamping_nms_per_rad = 0.0\n";
    for (file, part) in [("kuka_kr300_a1_B.csv", "--to 5.996"), ("kuka_kr300_a1_C.csv", "--from 4")] {
        let dir = WorkDir::new();
        if recording(&dir, file, &["torque_sim_nm", "theta_in_rad", "deflection_rad"]).is_none() {
            return;
        }
        let found = diagnosed(&dir, &format!("format = 1\nname = \"axis\"\n{friction}"), part);
        let effects = found["effects"].as_array().unwrap();
        let is_inertia = |effect: &Value| effect["name"] == "inertia" || effect["closest"]["name"] == "inertia";
        assert!(effects.iter().any(is_inertia), "{file}: {effects:?}");
        // Within half a turn, an offset hides a gravity of 40 kN·m, twenty times the torque recorded.
        assert!(!named(&found).contains(&"gravity_load".to_owned()), "{file}: {effects:?}");
        assert!(held_out(&found, "extended") < 0.5 * held_out(&found, "refitted"), "{file}: {}", found["heldout"]);
    }
}

#[test]
fn the_two_encoders_of_an_arm_say_nothing_of_a_spring_that_its_model_has_not() {
    let dir = WorkDir::new();
    if recording(&dir, "kuka_kr300_a1_B.csv", &["torque_sim_nm"]).is_none() {
        return;
    }
    // The encoders are 3 ms apart, so that the deflection follows the velocity.
    let found = diagnosed(&dir, AXIS, "");
    assert_names(&found, &["coulomb_friction", "viscous_friction"]);
    let effects = found["effects"].as_array().unwrap();
    assert!(effects.iter().all(|effect| effect["family"] != "elastic" && effect["name"] != "creep"), "{effects:?}");
}
