//! `gmhm pack` and `gmhm inspect`.

use crate::common::{PUBLISHED, WorkDir};
use serde_json::Value;

const TERMS: &str = r#"
[[term]]
kind = "kinematic_error"
orders = [2, 4]
cos_rad = [5.8e-6, 1.1e-6]
sin_rad = [0.0, -4.0e-7]
[[term]]
kind = "soft_windup"
shape = "rational"
stiffness_drop_nm_per_rad = 900.0
width_rad = 1e-4
[[term]]
kind = "sensor_drift"
nm_per_s = 0.001
"#;

fn published_with(memory: &str) -> String {
    format!("{PUBLISHED}{memory}")
}

fn json(dir: &WorkDir, name: &str) -> Value {
    serde_json::from_str(&dir.read(name)).unwrap()
}

fn bytes(dir: &WorkDir, name: &str) -> Vec<u8> {
    std::fs::read(dir.path(name)).unwrap()
}

fn near(value: &Value, expected: f64) {
    let value = value.as_f64().unwrap();
    assert!((value - expected).abs() <= 1e-7 * expected.abs(), "{value} for {expected}");
}

#[test]
fn what_is_packed_is_inspected_in_si() {
    let dir = WorkDir::new();
    dir.write("m.toml", published_with(TERMS));
    let done = dir.succeed("pack m.toml -o params.bin");
    assert!(done.stdout.contains("gear \"published\"") && done.stdout.contains("to params.bin"), "{}", done.stdout);
    assert!(done.stderr.contains("`sensor_drift` is a measurement fault"), "{}", done.stderr);
    let shown = dir.succeed("inspect params.bin --json params.json").stdout;
    for part in ["[gear]", "[masing]", "[inverse]", "[joint]", "[term kinematic_error]", "0.001168 rad", "rational"] {
        assert!(shown.contains(part), "{shown}\nshould say {part}");
    }
    let held = json(&dir, "params.json");
    assert_eq!(held["block"]["gear"], "published");
    assert_eq!(held["block"]["length"].as_u64(), Some(bytes(&dir, "params.bin").len() as u64));
    assert_eq!((&held["block"]["sequence"], &held["block"]["scalar"]), (&0.into(), &"f32".into()));
    assert_eq!(held["gear"]["rated_deflection_rad"], 1.168e-3);
    near(&held["gear"]["c1_nm_per_rad"], 2.4737e4);
    near(&held["gear"]["c2_nm_per_rad3"], 1.0e9);
    near(&held["gear"]["c3_nm_per_rad5"], -1.1774e14);
    let squares = 422.68_f64.powi(2) + 226.31_f64.powi(2);
    near(&held["masing"]["e_nm_per_rad"], 2.6532e6 * 422.68 / squares);
    near(&held["masing"]["h_nm_per_rad"], 2.6532e6 * 226.31 / squares);
    assert_eq!(held["inverse"]["range_rad"], 1.168e-3);
    assert_eq!(held["joint"]["ratio"], 100.0);
    assert_eq!(held["name"]["name"], "published");
    let terms = held["terms"].as_array().unwrap();
    assert_eq!(terms.len(), 3);
    assert_eq!(terms[0]["orders"], serde_json::json!([2.0, 4.0]));
    near(&terms[0]["cos_rad"][1], 1.1e-6);
    assert_eq!((&terms[1]["kind"], &terms[1]["shape"]), (&"soft_windup".into(), &"rational".into()));
    near(&terms[1]["width_rad"], 1e-4);
}

#[test]
fn the_three_forms_hold_the_same_bytes() {
    let dir = WorkDir::new();
    dir.write("m.toml", PUBLISHED);
    dir.succeed("pack m.toml -o params.bin");
    // Across a border of 64 KiB, where Intel HEX needs another upper address.
    dir.succeed("pack m.toml -o params.hex --address 0x3ffc8");
    dir.succeed("pack m.toml -o Params-1.h");
    dir.succeed("pack m.toml -o again.bin");
    let block = bytes(&dir, "params.bin");
    assert_eq!(block, bytes(&dir, "again.bin"));

    let hex = dir.read("params.hex");
    assert!(hex.starts_with(":020000040003F7\n:10FFC800") && hex.ends_with(":00000001FF\n"), "{hex}");
    let (from_hex, from_bin) = (dir.succeed("inspect params.hex").stdout, dir.succeed("inspect params.bin").stdout);
    assert_eq!(from_hex, from_bin);

    let header = dir.read("Params-1.h");
    assert!(header.contains(&format!("static const uint8_t gmhm_params_1[{}] = {{", block.len())), "{header}");
    let listed = header.split("0x").skip(2).map(|byte| u8::from_str_radix(&byte[..2], 16).unwrap());
    assert_eq!(listed.collect::<Vec<_>>(), block);
}

#[test]
fn every_law_is_packed() {
    let dir = WorkDir::new();
    for (law, options) in [
        ("law = \"phase\"\n", ""),
        ("law = \"phase\"\nkernel = \"rate\"\ngate = \"none\"\n", ""),
        ("law = \"time\"\nkernel = \"rate\"\ngate = \"none\"\n", "--period 0.0005"),
    ] {
        dir.write("m.toml", published_with(law));
        dir.succeed(&format!("pack m.toml {options} -o params.bin"));
        dir.succeed("inspect params.bin --json params.json");
        let held = json(&dir, "params.json");
        if options.is_empty() {
            near(&held["phase"]["rho"], 422.68 / 226.31);
        } else {
            near(&held["time"]["alpha"], 2.6532e6);
            near(&held["time"]["beta_per_s"], 422.68);
            near(&held["time"]["forgotten"], -(-422.68_f64 * 0.0005).exp_m1());
            near(&held["block"]["period_s"], 0.0005);
        }
    }
}

#[test]
fn fixed_point_has_words_of_its_own() {
    let dir = WorkDir::new();
    dir.write("m.toml", PUBLISHED.replace("[memory]", "[memory]\nreversal_play_rad = 2e-6"));
    dir.succeed("pack m.toml --scalar fixed -o params.bin");
    dir.succeed("inspect params.bin --json params.json");
    let held = json(&dir, "params.json");
    assert_eq!(held["block"]["scalar"], "fixed");
    near(&held["gear"]["c1_nm_per_rad"], 2.4737e4);
    near(&held["masing"]["h_nm_per_rad"], 2.6532e6 * 226.31 / (422.68_f64.powi(2) + 226.31_f64.powi(2)));
    // Half the play in units of 2^−28 of the rated deflection.
    assert!((held["masing"]["reversal_play_rad"].as_f64().unwrap() - 2e-6).abs() < 1.168e-3 / f64::from(1 << 28));
    dir.write("time.toml", published_with("law = \"time\"\nkernel = \"rate\"\ngate = \"none\"\n"));
    dir.succeed("pack time.toml --scalar fixed --period 1e-4 -o time.bin");
    dir.succeed("inspect time.bin --json time.json");
    let held = json(&dir, "time.json");
    near(&held["time"]["beta_per_s"], 422.68);
    near(&held["time"]["forgotten"], -(-422.68_f64 * 1e-4).exp_m1());
    dir.write("phase.toml", published_with("law = \"phase\"\n")).write("terms.toml", published_with(TERMS));
    dir.refuse(
        "pack phase.toml --scalar fixed -o x.bin",
        &["law phase is not computed in fixed point", "--scalar f32"],
    );
    dir.refuse("pack terms.toml --scalar fixed -o x.bin", &["`kinematic_error` is not computed in fixed point"]);
}

/// The gate on samples is the top speed times the control period, in either arithmetic.
#[test]
fn a_block_holds_the_top_speed_of_its_drive() {
    let dir = WorkDir::new();
    dir.write("m.toml", PUBLISHED);
    for (scalar, error) in [("f32", 1e-7), ("fixed", 1e-4)] {
        dir.succeed(&format!("pack m.toml --scalar {scalar} --period 0.001 --top-speed 0.08 -o params.bin"));
        dir.succeed("inspect params.bin --json params.json");
        let step = json(&dir, "params.json")["largest_step"]["largest_step_rad"].as_f64().unwrap();
        assert!((step / 8e-5 - 1.0).abs() < error, "{step}");
    }
    dir.refuse(
        "pack m.toml --top-speed 0.08 -o x.bin",
        &["the top speed needs the control period", "--period SECONDS"],
    );
    let done = dir.succeed("pack m.toml --period 0.001 --top-speed 0.08 -o params.bin");
    assert!(!done.stderr.contains("gate"), "{}", done.stderr);
    let done = dir.succeed("pack m.toml --period 0.001 -o params.bin");
    assert!(done.stderr.contains("the block sets no gate on samples"), "{}", done.stderr);
    assert!(!dir.succeed("inspect params.bin").stdout.contains("largest_step"));
}

/// The set-up of the drive has a name, whatever the law.
#[test]
fn a_block_names_every_record() {
    let dir = WorkDir::new();
    let of_law = |law: &str| published_with(&format!("law = \"{law}\"\n"));
    for (model, name) in
        [(PUBLISHED.to_owned(), "prepared"), (of_law("phase"), "prepared_gear"), (of_law("time"), "prepared_gear")]
    {
        dir.write("m.toml", model);
        dir.succeed("pack m.toml --period 0.001 --top-speed 0.08 -o params.bin");
        let shown = dir.succeed("inspect params.bin --json params.json").stdout;
        assert!(shown.contains(&format!("[{name}]")) && !shown.contains("not known"), "{shown}");
        assert!(json(&dir, "params.json")[name]["words"].as_u64().unwrap() > 20);
    }
}

#[test]
fn torques_may_be_counted_in_amperes() {
    let dir = WorkDir::new();
    dir.write("m.toml", PUBLISHED.replace("_nm", "_a"));
    dir.succeed("pack m.toml -o params.bin --gear joint-3");
    let shown = dir.succeed("inspect params.bin --json params.json").stdout;
    assert!(shown.contains("c1_a_per_rad") && !shown.contains("_nm"), "{shown}");
    let held = json(&dir, "params.json");
    assert_eq!((&held["block"]["gear"], &held["block"]["torque_unit"]), (&"joint-3".into(), &"A".into()));
    assert_eq!(held["joint"]["torque_side"], "motor");
}

#[test]
fn a_joint_without_gear_is_its_terms() {
    let dir = WorkDir::new();
    dir.write("m.toml", "format = 1\n[[term]]\nkind = \"gravity_load\"\ncos_nm = 1.0\nsin_nm = 2.0\n");
    let done = dir.succeed("pack m.toml -o params.bin");
    assert!(!done.stderr.contains("gate"), "{}", done.stderr);
    let shown = dir.succeed("inspect params.bin").stdout;
    assert!(shown.contains("[term gravity_load]") && !shown.contains("[gear]"), "{shown}");
    dir.refuse(
        "pack m.toml --period 0.001 --top-speed 0.08 -o x.bin",
        &["the top speed bounds the deflection of a gear, and the model has none", "leave --top-speed out"],
    );
}

#[test]
fn a_gear_without_inverse_is_packed_with_a_note() {
    let dir = WorkDir::new();
    dir.write("m.toml", PUBLISHED.replace("alpha = 2.6532e6", "alpha = 2.6532e7"));
    let done = dir.succeed("pack m.toml -o params.bin");
    assert!(done.stderr.contains("can predict but not invert"), "{}", done.stderr);
    assert!(!dir.succeed("inspect params.bin").stdout.contains("[inverse]"));
}

#[test]
fn what_cannot_be_packed_is_refused() {
    let dir = WorkDir::new();
    dir.write("m.toml", PUBLISHED).write("bare.toml", PUBLISHED.replace("rated_deflection_rad = 1.168e-3\n", ""));
    dir.write("time.toml", published_with("law = \"time\"\n"));
    dir.write("empty.toml", "format = 1\n");
    dir.write("tiny.toml", PUBLISHED.replace("1.168e-3", "1e-15"));
    dir.write("many.toml", published_with(&"[[term]]\nkind = \"inertia\"\ninertia_kgm2 = 1.0\n".repeat(9)));
    dir.write("huge.toml", published_with("[[term]]\nkind = \"inertia\"\ninertia_kgm2 = 1e300\n"));
    dir.refuse("pack m.toml -o params.txt", &["params.txt", ".bin, .hex", "end the name in"]);
    dir.refuse("pack m.toml -o no/params.bin", &["the folder no does not exist"]);
    dir.refuse("pack bare.toml -o params.bin", &["no rated_deflection_rad", "--rated-deflection RAD"]);
    dir.refuse("pack time.toml -o params.bin", &["law time needs the control period", "--period SECONDS"]);
    dir.refuse("pack empty.toml -o params.bin", &["nothing to pack"]);
    dir.refuse("pack tiny.toml -o params.bin", &["rated_deflection"]);
    dir.refuse("pack many.toml -o params.bin", &["9 terms", "room for 8"]);
    dir.refuse("pack huge.toml -o params.bin", &["`inertia`", "`inertia_kgm2` must be finite"]);
    dir.refuse("pack m.toml -o params.hex --address 0xfffffff0", &["runs past the end of 32 bits"]);
    dir.succeed("pack bare.toml --rated-deflection 1.168e-3 -o params.bin");
    for usage in ["--stack-depth 5", "--stack-depth 2", "--period -1", "--gear a-label-that-is-too-long", "--address x"]
    {
        assert_eq!(dir.gmhm(&format!("pack m.toml {usage} -o x.bin")).status, Some(2), "{usage}");
    }
}

#[test]
fn a_bad_block_is_refused() {
    let dir = WorkDir::new();
    dir.write("m.toml", PUBLISHED);
    dir.succeed("pack m.toml -o params.bin");
    dir.succeed("pack m.toml -o params.hex");
    let block = bytes(&dir, "params.bin");
    let mut damaged = block.clone();
    damaged[70] ^= 1;
    dir.write("damaged.bin", damaged).write("short.bin", &block[..100]).write("m.bin", PUBLISHED);
    dir.refuse("inspect damaged.bin", &["damaged.bin", "CRC-32", "pack it again"]);
    dir.refuse("inspect short.bin", &["short.bin", "100 bytes"]);
    dir.refuse("inspect m.bin", &["no parameter block", "gmhm pack"]);
    dir.refuse("inspect none.bin", &["none.bin", "cannot be read"]);
    dir.write("x.hex", dir.read("params.hex").replacen(":10", ":11", 1));
    dir.refuse("inspect x.hex", &["x.hex, line 2"]);
    let lines: Vec<String> = dir.read("params.hex").lines().map(str::to_owned).collect();
    dir.write("gap.hex", [&lines[..3], &lines[4..]].concat().join("\n"));
    dir.refuse("inspect gap.hex", &["gap.hex, line 4", "a gap before the address 0x30"]);
}

/// The data sheet lists every object once, with the type and access of the dictionary.
#[test]
fn the_object_dictionary_is_written_as_a_data_sheet() {
    use gmhm::link::objects::{Access, OBJECTS};
    let dir = WorkDir::new();
    dir.write("m.toml", PUBLISHED);
    dir.succeed("pack m.toml -o params.bin --eds drive.eds");
    let text = dir.read("drive.eds");
    let sections: Vec<(&str, &str)> =
        text.split("\n[").skip(1).map(|section| section.split_once("]\n").expect("a section")).collect();
    for object in OBJECTS {
        let single = OBJECTS.iter().all(|other| other.index != object.index || other.sub == 0);
        let name =
            if single { format!("{:04X}", object.index) } else { format!("{:04X}sub{:X}", object.index, object.sub) };
        let mut found = sections.iter().filter(|(section, _)| *section == name);
        let (_, entries) = found.next().unwrap_or_else(|| panic!("no section {name}"));
        assert!(found.next().is_none(), "{name} stands twice");
        let access = match object.access {
            Access::ReadOnly => "ro",
            Access::WriteOnly => "wo",
            Access::ReadWrite => "rw",
        };
        for line in [
            format!("ParameterName={}", object.name),
            format!("DataType=0x{:04X}", object.data_type.number()),
            format!("AccessType={access}"),
        ] {
            assert!(entries.lines().any(|entry| entry == line), "{name} lacks {line}:\n{entries}");
        }
    }
    let objects = ["MandatoryObjects", "OptionalObjects", "ManufacturerObjects"].map(|list| {
        let (_, entries) = sections.iter().find(|(section, _)| *section == list).expect("a list");
        let count = entries.lines().find_map(|line| line.strip_prefix("SupportedObjects=")).expect("a count");
        assert_eq!(count.parse::<usize>().expect("a number"), entries.trim_end().lines().count() - 1);
        count.parse::<usize>().expect("a number")
    });
    assert_eq!(objects, [3, 2, 8]);
}
