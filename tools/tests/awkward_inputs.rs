//! Inputs that go wrong at a user's desk: each is refused by name with a fix, or remarked on.

use crate::common::{PUBLISHED, WorkDir};

/// A loop of the published gear, as text: time, deflection, torque.
fn bench() -> WorkDir {
    let dir = WorkDir::new();
    dir.write("gear.toml", PUBLISHED);
    dir.succeed("simulate gear.toml --experiment cycle --cycles 1 --duration 40 --sample-rate 10 -o rec.csv");
    dir
}

/// The recording with another column in place of one.
fn with_column(dir: &WorkDir, name: &str, change: impl Fn(usize, f64) -> f64) -> String {
    let text = dir.read("rec.csv");
    let at = text.lines().next().expect("a header").split(',').position(|head| head == name).expect("the column");
    let lines = text.lines().enumerate().map(|(row, line)| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        if row > 0 {
            fields[at] = format!("{:e}", change(row - 1, fields[at].parse().expect("a number")));
        }
        fields.join(",") + "\n"
    });
    lines.collect()
}

#[test]
fn damaged_streams_and_empty_files_are_named_as_what_they_are() {
    let dir = bench();
    dir.write("cut.csv.gz", b"\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\x03\x4b");
    dir.refuse("columns cut.csv.gz", &["cut.csv.gz: cannot be read as gzip", "help: export it again"]);
    dir.write("cut.csv.zst", b"\x28\xb5\x2f\xfd\x24");
    dir.refuse("columns cut.csv.zst", &["cannot be read as Zstandard", "help: "]);
    let mut header = b"MATLAB 5.0 MAT-file".to_vec();
    header.resize(124, b' ');
    header.extend_from_slice(b"\x00\x01IM");
    dir.write("empty.mat", header);
    dir.refuse("columns empty.mat", &["cannot be read as MAT 5: it holds no column of numbers"]);
    dir.refuse("fit nowhere.csv -o fit.toml", &["nowhere.csv: cannot be read", "help: check the path"]);
    dir.succeed("pack gear.toml -o params.bin");
    dir.refuse("columns params.bin", &["is a parameter block", "gmhm inspect"]);
}

#[test]
fn files_in_the_wrong_place_are_named_with_the_right_one() {
    let dir = bench();
    dir.refuse("fit gear.toml -o fit.toml", &["gear.toml: is a model file", "--model"]);
    dir.refuse(
        "predict rec.csv gear.toml -o out.csv",
        &["rec.csv, line 1: is not TOML", "name it before the recordings"],
    );
    dir.refuse(
        "diagnose rec.csv -o out.toml",
        &["rec.csv: there is nothing to compare it with", "gmhm diagnose M.toml"],
    );
    dir.misuse("diagnose gear.toml -o out.toml", &["no recording was given"]);
    dir.refuse("columns --files-from rec.csv", &["rec.csv: names no file that exists", "one path a line"]);
    dir.write("list.txt", "# recordings of today\n\nrec.csv\n");
    assert!(dir.succeed("columns --files-from list.txt").stdout.contains("rec.csv"));
    dir.write("none.txt", "\n# no more\n");
    dir.refuse("columns --files-from none.txt", &["none.txt: names no recording"]);
    dir.misuse("fit rec.csv -o fit.toml --report fit.pdf", &["must end in .html"]);
    dir.refuse("demo --out rec.csv", &["rec.csv: is a file, and a folder is needed", "help: "]);
    dir.refuse("prove --cases 1 --export rec.csv", &["rec.csv: is a file"]);
    dir.refuse("prove --cases 1 --answers nowhere", &["nowhere: there is no such folder"]);
    std::fs::create_dir(dir.path("answers")).expect("a folder");
    dir.refuse("prove --cases 1 --answers answers", &["answers: holds no answer", "case_0007.json"]);
}

#[test]
fn numbers_that_no_gear_has_are_refused_with_the_column() {
    let dir = bench();
    dir.write("huge.csv", with_column(&dir, "torque_nm", |_, torque| torque * 1e30));
    dir.refuse("fit huge.csv -o fit.toml", &["huge.csv: the torque varies by", "torque_nm=COLUMN*1e-3"]);
    dir.refuse("invert gear.toml huge.csv -o out.csv", &["huge.csv, row ", "beyond anything", "torque_nm=COLUMN"]);
    dir.write("still.csv", with_column(&dir, "torque_nm", |_, _| 5.0));
    dir.refuse("adapt gear.toml still.csv -o out.toml", &["still.csv: the torque is the same in every row"]);
    dir.write("kilo.csv", with_column(&dir, "torque_nm", |_, torque| 1e3 * torque));
    dir.refuse("adapt gear.toml kilo.csv -o out.toml", &["another unit", "--map torque_nm=COLUMN*0.001"]);
    dir.write("degrees.csv", with_column(&dir, "deflection_rad", |_, theta| theta.to_degrees()));
    dir.refuse("diagnose gear.toml degrees.csv -o out.toml", &["degrees", "--map deflection_deg=COLUMN,"]);
    let hide = "simulate gear.toml --experiment cycle --hide wear=1e9 -o worn.csv";
    dir.refuse(hide, &["hide wear: at most", "choose a smaller size"]);
    dir.misuse("simulate gear.toml --experiment cycle --amplitude 2 -o two.csv", &["--amplitude 2: must be"]);
}

#[test]
fn lines_of_an_instrument_above_the_header_are_skipped() {
    let dir = bench();
    let text = dir.read("rec.csv");
    dir.write("logged.csv", format!("Logger: ACME 9000\r\nSerial,1234\r\n\r\n{text}"));
    let said = dir.succeed("columns logged.csv").stdout;
    assert!(said.starts_with("logged.csv: CSV, header in line 4, 401 rows"), "{said}");
    dir.succeed("predict gear.toml rec.csv -o plain.csv");
    dir.succeed("predict gear.toml logged.csv -o out.csv");
    assert_eq!(dir.read("out.csv"), dir.read("plain.csv"));
    dir.write("bad.csv", dir.read("logged.csv").replacen("\n0.3,", "\n0.3x,", 1));
    dir.refuse("predict gear.toml bad.csv -o out.csv", &["bad.csv, line 8, column 1 `time_s`: `0.3x` is not a number"]);
}

#[test]
fn a_quote_that_is_not_closed_is_refused_where_it_opens() {
    let dir = bench();
    let rows = |remark: &dyn Fn(usize) -> &'static str| {
        let line = |(at, line): (usize, &str)| format!("{line},{}\n", if at == 0 { "remark" } else { remark(at) });
        dir.read("rec.csv").lines().enumerate().map(line).collect::<String>()
    };
    let refused = ["line 21: a quote is opened and not closed on the line", "help: close the quote"];
    dir.write("open.csv", rows(&|at| if at == 20 { "\"start" } else { "" }));
    dir.refuse("fit open.csv -o fit.toml", &refused);
    // Another quote, far below, would close it.
    dir.write(
        "closed.csv",
        rows(&|at| [("\"start", 20), ("end\"", 300)].iter().find(|q| q.1 == at).map_or("", |q| q.0)),
    );
    dir.refuse("fit closed.csv -o fit.toml", &refused);
    dir.write("header.csv", dir.read("rec.csv").replacen("torque_nm", "\"torque_nm", 1));
    dir.refuse("fit header.csv -o fit.toml", &["header.csv, line 1: a quote is opened"]);
    dir.write("tall.csv", dir.read("rec.csv").replacen("torque_nm", "\"Torque\n(Nm)\"", 1));
    dir.succeed("fit tall.csv -o fit.toml");
}

#[test]
fn units_below_the_names_stay_with_the_rows() {
    let dir = bench();
    let text = dir.read("rec.csv");
    dir.write(
        "units.csv",
        text.replacen("time_s", "Time", 1).replacen("torque_nm", "Torque", 1).replacen('\n', "\ns,-,-,-,-,-,Nm\n", 1),
    );
    let said = dir.succeed("columns units.csv").stdout;
    assert!(!said.contains("To fit a gear"), "{said}");
    dir.succeed("predict gear.toml units.csv -o out.csv");
    let header = dir.read("out.csv").lines().next().expect("a header").to_owned();
    assert!(header.starts_with("Time [s],") && header.contains(",Torque [Nm],torque_model_nm"), "{header}");
    dir.succeed("fit out.csv -o again.toml");
}

#[test]
fn a_header_in_latin_1_is_read() {
    let dir = bench();
    let text = dir.read("rec.csv").replacen("deflection_rad", "Deflection [\u{b5}rad]", 1);
    dir.write("latin.csv", text.chars().map(|c| c as u8).collect::<Vec<u8>>());
    let said = dir.succeed("columns latin.csv").stdout;
    assert!(said.contains("Deflection [µrad]") && !said.contains("To fit a gear"), "{said}");
}

#[test]
fn a_model_of_no_gear_is_named_as_one() {
    let dir = bench();
    let change = |name: &str, to: &str| dir.write(name, PUBLISHED.replace("c1_nm_per_rad = 2.4737e4", to));
    change("negative.toml", "c1_nm_per_rad = -2.5e4");
    change("huge.toml", "c1_nm_per_rad = 1e300");
    let told = dir.succeed("predict negative.toml rec.csv -o out.csv").stderr;
    assert!(
        told.contains("note: no gear has the parameters of this model: c1_nm_per_rad = −25\u{202f}000 must not be"),
        "{told}"
    );
    let no_gear =
        ["c1_nm_per_rad (times rated_deflection_rad, N·m) = 1.168·10²⁹⁷ is outside", "help: correct the model"];
    dir.refuse("simulate huge.toml --experiment cycle -o cycle.csv", &no_gear);
    dir.refuse("pack huge.toml -o params.bin", &no_gear);
    dir.refuse("export huge.toml --to c -o source", &no_gear);
    dir.write("latin.toml", [PUBLISHED.as_bytes(), b"# \xb5\n"].concat());
    dir.refuse("predict latin.toml rec.csv -o out.csv", &["latin.toml: is not text in UTF-8", "help: save it again"]);
    dir.write("degrees.csv", with_column(&dir, "deflection_rad", |_, theta| theta.to_degrees()));
    let told = dir.succeed("predict gear.toml degrees.csv -o out.csv").stderr;
    assert!(told.contains("lie beyond three times the rated deflection") && told.contains("check the unit"), "{told}");
    dir.write("kilo.csv", with_column(&dir, "torque_nm", |_, torque| 1e3 * torque));
    let told = dir.succeed("invert gear.toml kilo.csv -o out.csv").stderr;
    assert!(told.contains("check the unit of the torque"), "{told}");
    dir.refuse("health rec.csv degrees.csv", &["degrees.csv: ", "degrees seem to be taken for radians"]);
}

#[test]
fn what_a_recording_holds_beside_what_is_meant_is_said() {
    let dir = bench();
    dir.write("current.csv", dir.read("rec.csv").replacen("torque_nm", "current_a", 1));
    let unit = ["current.csv holds a current, and the model is per newton-metre", "help: "];
    dir.refuse("diagnose gear.toml current.csv -o out.toml", &unit);
    dir.refuse("adapt gear.toml current.csv -o out.toml", &unit);
    dir.write(
        "spikes.csv",
        with_column(&dir, "torque_nm", |row, torque| if row % 200 == 50 { 9999.0 } else { torque }),
    );
    let told = dir.succeed("fit spikes.csv -o fit.toml").stderr;
    assert!(told.contains("2 rows hold a torque far beyond all others, the first 9999 N·m at 5 s"), "{told}");
    assert!(!dir.succeed("fit rec.csv -o fit.toml").stderr.contains("beyond all others"));
    dir.write("measured.lvm", "LabVIEW Measurement\t\nWriter_Version\t2\n");
    dir.refuse("columns measured.lvm", &["is a measurement file of LabVIEW", "help: "]);
    dir.refuse("plot rec.csv nowhere.toml -o out.html", &["nowhere.toml: cannot be read", "help: check the path"]);
}

#[test]
fn endings_that_mislead_are_named() {
    let dir = bench();
    dir.misuse("compare rec.csv --plot errors.png", &["must end in .svg"]);
    dir.misuse("fit rec.csv -o fit.toml --plot fit.png", &["must end in .svg"]);
    let told = dir.succeed("fit rec.csv -o fit.txt").stderr;
    assert!(told.contains("fit.txt: commands recognise a model file by the ending .toml"), "{told}");
}

/// Two encoders on a slow motion, whose slope the twist blurs by a part in a thousand.
#[test]
fn a_ratio_that_is_off_is_seen_through_the_twist() {
    let dir = WorkDir::new();
    let row = |k: u32| {
        let time = 0.02 * f64::from(k);
        let turn = 0.5 * (0.3 * time).sin();
        let twist = 1.2e-3 * time.sin() + 1.6e-3 * turn;
        let torque = 2.5e4 * twist + 2.0 * time.cos();
        format!("{time},{},{},{torque}\n", 100.0 * turn, turn - twist)
    };
    let rows: String = (0..1000).map(row).collect();
    dir.write("two.csv", format!("time_s,theta_in_rad,theta_out_rad,torque_nm\n{rows}"));
    dir.refuse("fit two.csv -o fit.toml", &["add --ratio N; the angles turn 100 to 1"]);
    dir.refuse("fit two.csv --ratio -100 -o fit.toml", &["the ratio given is -100", "wrong sign"]);
    dir.refuse("fit two.csv --ratio 99 -o fit.toml", &["--ratio 100: the ratio is one more or less"]);
    dir.refuse("fit two.csv --ratio 50 -o fit.toml", &["--ratio 100, or check the units"]);
    dir.succeed("fit two.csv --ratio 100 -o fit.toml");
}

#[test]
fn a_gap_in_time_is_remarked_on() {
    let dir = bench();
    dir.write("gap.csv", with_column(&dir, "time_s", |row, time| if row < 200 { time } else { time + 1000.0 }));
    let done = dir.succeed("fit gap.csv -o fit.toml");
    assert!(done.stderr.contains("gap.csv: no rows between 19.9 and 1020 s"), "{}", done.stderr);
    assert!(!dir.succeed("fit rec.csv -o fit.toml").stderr.contains("no rows"));
}

#[test]
fn a_check_ends_with_status_3_where_something_is_found() {
    let dir = bench();
    let status = |words: &str| dir.gmhm(words).status;
    assert_eq!(status("fit rec.csv -o fit.toml --check"), Some(0));
    assert_eq!(status("diagnose gear.toml rec.csv -o out.toml --check"), Some(0));
    dir.write("flipped.csv", with_column(&dir, "torque_nm", |_, torque| -torque));
    assert_eq!(status("fit flipped.csv -o fit.toml"), Some(0));
    assert_eq!(status("fit flipped.csv -o fit.toml --check"), Some(3));
    assert_eq!(status("fit --each rec.csv flipped.csv --ndjson fits.ndjson --check"), Some(3));
    assert_eq!(dir.read("fits.ndjson").lines().count(), 2);
    dir.write("soft.toml", PUBLISHED.replace("1.0e9", "-9.0e9"));
    dir.succeed("simulate soft.toml --experiment running --hide coulomb_friction=0.5 --duration 20 -o rubs.csv");
    assert_eq!(status("diagnose gear.toml rubs.csv -o out.toml"), Some(0));
    assert_eq!(status("diagnose gear.toml rubs.csv -o out.toml --check"), Some(3));
}

#[test]
fn zeros_of_their_own_are_fitted_where_asked_for() {
    let dir = bench();
    dir.write("other.csv", with_column(&dir, "deflection_rad", |_, theta| theta + 1e-7));
    let words = "fit rec.csv other.csv -o fit.toml";
    assert!(!dir.succeed(words).stdout.contains("its own deflection zero"));
    let told = dir.succeed(&format!("{words} --own-zeros")).stdout;
    assert!(told.contains("Each recording has its own deflection zero"), "{told}");
}

#[test]
fn an_output_is_not_named_as_what_it_is_not() {
    let dir = bench();
    let model = dir.read("gear.toml");
    for words in ["predict gear.toml rec.csv -o gear.toml", "invert gear.toml rec.csv -o gear.toml"] {
        dir.misuse(words, &["must end in .csv: rows are written"]);
    }
    dir.misuse("simulate gear.toml --experiment cycle -o gear.toml", &["must end in .csv: rows are written"]);
    assert_eq!(dir.read("gear.toml"), model);
    let other = dir.read("rec.csv");
    dir.write("other.csv", &other);
    for words in ["fit rec.csv -o other.csv", "adapt gear.toml rec.csv -o other.csv"] {
        dir.misuse(words, &["must end in .toml: a model file is written"]);
    }
    dir.misuse("diagnose gear.toml rec.csv -o other.parquet", &["must end in .toml: a model file is written"]);
    assert_eq!(dir.read("other.csv"), other);
    dir.misuse("export gear.toml --to fmu -o gear.c", &["-o must end in .fmu"]);
    dir.misuse("export gear.toml --to c -o gear.c", &["-o must be a folder"]);
}

#[test]
fn negative_numbers_are_refused_as_numbers() {
    let dir = bench();
    dir.misuse("fit rec.csv -o fit.toml --rated-deflection -1", &["must be a number greater than zero"]);
    dir.misuse("pack gear.toml -o params.bin --period -0.001", &["must be a number greater than zero"]);
    dir.misuse("prove --cases -4", &["must be a whole number greater than zero"]);
}

#[test]
fn encoders_that_start_again_after_each_turn_are_named() {
    let dir = bench();
    dir.succeed("simulate gear.toml --experiment running --duration 10 --sample-rate 50 -o rec.csv");
    let turn = std::f64::consts::TAU;
    let input = dir.column("rec.csv", "theta_in_rad");
    dir.write("wrapped.csv", with_column(&dir, "theta_in_rad", |row, _| input[row].rem_euclid(turn)));
    let angles = |name: &str| {
        let header = dir.read(name).replacen("deflection_rad", "remark", 1);
        dir.write(name, header);
    };
    // With a deflection of its own the angle serves for places on the turn alone.
    dir.succeed("fit wrapped.csv -o fit.toml");
    // A deflection that was computed from it.
    let output = dir.column("rec.csv", "theta_out_rad");
    let wrapped = |row: usize| input[row].rem_euclid(turn) / 100.0 - output[row];
    dir.write("computed.csv", with_column(&dir, "deflection_rad", |row, _| wrapped(row)));
    let said = dir.succeed("fit computed.csv -o fit.toml").stdout;
    assert!(said.starts_with("Not good enough") && !said.contains("counted backwards"), "{said}");
    assert!(said.contains("or whether an encoder starts again after each turn"), "{said}");
    angles("wrapped.csv");
    let refused = ["wrapped.csv: `theta_in_rad` starts again after each turn", "numpy.unwrap"];
    dir.refuse("fit wrapped.csv --ratio 100 -o fit.toml", &refused);
    dir.refuse("predict gear.toml wrapped.csv -o out.csv", &refused);
    dir.refuse("diagnose gear.toml wrapped.csv -o out.toml", &refused);
    dir.refuse("adapt gear.toml wrapped.csv -o out.toml", &refused);
    angles("rec.csv");
    dir.succeed("fit rec.csv --ratio 100 -o fit.toml");
}

#[test]
fn units_that_fit_no_gear_are_questioned() {
    let dir = bench();
    let fit = |name: &str| dir.succeed(&format!("fit {name} -o fit.toml")).stdout;
    dir.write("milli.csv", with_column(&dir, "deflection_rad", |_, theta| 1e-3 * theta));
    let said = fit("milli.csv");
    assert!(said.starts_with("Not good enough") && said.contains("--map deflection_rad=COLUMN*1e3"), "{said}");
    dir.write("degrees.csv", with_column(&dir, "deflection_rad", |_, theta| theta.to_degrees()));
    // The first file fits a gear of its own; beside it the second is seen to be in degrees.
    dir.refuse("fit rec.csv degrees.csv -o fit.toml", &["degrees.csv: ", "degrees seem to be taken for radians"]);
    dir.write("milliseconds.csv", with_column(&dir, "time_s", |_, time| 1e3 * time));
    let told = dir.succeed("fit milliseconds.csv -o fit.toml").stderr;
    assert!(told.contains("its rows are 100 s apart") && told.contains("--map time_ms=COLUMN"), "{told}");
    dir.refuse("adapt gear.toml milliseconds.csv -o out.toml", &["period_s = 100", "help: ", "time_ms=COLUMN"]);
}

#[test]
fn noise_is_no_gear() {
    let dir = bench();
    // Some numbers without any order.
    let noise = |row: usize, salt: u64| {
        let mut x = (row as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ salt;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        ((x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb) >> 40) as f64 / (1 << 24) as f64 - 0.5
    };
    dir.write("rec.csv", with_column(&dir, "deflection_rad", |row, _| 6e-3 * noise(row, 3)));
    dir.write("rec.csv", with_column(&dir, "torque_nm", |row, _| 60.0 * noise(row, 1003)));
    let said = dir.succeed("fit rec.csv -o fit.toml").stdout;
    assert!(said.starts_with("Not good enough"), "{said}");
    dir.refuse("health rec.csv", &["rec.csv: no closed cycle of the gear", "help: "]);
}

#[test]
fn headers_in_another_language_are_guessed_by_their_units() {
    let dir = bench();
    let numbers = || dir.read("rec.csv").lines().skip(1).map(|line| line.to_owned() + "\n").collect::<String>();
    let header = dir.read("rec.csv").lines().next().expect("a header").to_owned();
    let german = header.replace("time_s", "Zeit (s)").replace("torque_nm", "Moment [N·m]");
    let german = german
        .replace("deflection_rad", "Verdrillung [rad]")
        .replace("theta_in_rad", "a")
        .replace("theta_out_rad", "b");
    dir.write("german.csv", format!("{german}\n{}", numbers()));
    let refused = ["--map 'time_s=Zeit (s),torque_nm=Moment [N·m],deflection_rad=Verdrillung [rad]'"];
    dir.refuse("fit german.csv -o fit.toml", &refused);
    dir.write("clock.csv", format!("{}\n{}", header.replace("time_s", "Time [hh:mm:ss]"), numbers()));
    dir.refuse("fit clock.csv -o fit.toml", &["is no unit for the time", "write times as seconds"]);
    dir.write("bars.csv", dir.read("rec.csv").replace(',', "|"));
    dir.succeed("fit bars.csv -o bars.toml");
    dir.succeed("fit rec.csv -o rec.toml");
    let figures =
        |name: &str| dir.read(name).lines().filter(|line| !line.starts_with("name")).collect::<Vec<_>>().join("\n");
    assert_eq!(figures("bars.toml"), figures("rec.toml"));
}

#[test]
fn columns_names_the_column_and_all_that_is_missing() {
    let dir = bench();
    let text = dir.read("rec.csv");
    dir.write("twice.csv", text.replacen("temperature_c", "torque_nm", 1));
    let said = dir.succeed("columns twice.csv").stdout;
    assert!(said.contains("To fit a gear: column 7 `torque_nm`: is twice in the header"), "{said}");
    dir.write("bare.csv", "time,angle,torque\n0,0,0\n1,1e-3,20\n2,0,1\n");
    let said = dir.succeed("columns bare.csv").stdout;
    assert!(said.contains("--map time_s=time,torque_nm=torque,deflection_rad=angle"), "{said}");
    dir.write("cr.csv", text.replace('\n', "\r"));
    dir.refuse("fit cr.csv -o fit.toml", &["carriage return alone", "convert its line ends"]);
}
