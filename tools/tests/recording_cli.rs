//! Recordings on the command line: standard input and output, folders, lists, cropping, ratios, `columns`, `plot`.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::{PUBLISHED, WorkDir};

fn bench() -> WorkDir {
    let dir = WorkDir::new();
    dir.write("gear.toml", PUBLISHED);
    dir.succeed("simulate gear.toml --experiment cycle --noise none -o rec.csv");
    dir
}

fn fixture(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/recordings").join(name).display().to_string()
}

fn piped(dir: &WorkDir, words: &str, input: &[u8]) -> (Option<i32>, String, String) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_gmhm"))
        .current_dir(dir.path(""))
        .args(words.split_whitespace())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(input).unwrap();
    let output = child.wait_with_output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn standard_input_and_output() {
    let dir = bench();
    dir.succeed("predict gear.toml rec.csv -o predicted.csv");
    let (status, out, err) = piped(&dir, "predict gear.toml - -o -", dir.read("rec.csv").as_bytes());
    assert_eq!((status, err.as_str()), (Some(0), ""));
    assert_eq!(out, dir.read("predicted.csv"));
    let (status, _, err) = piped(&dir, "predict gear.toml - -o -", b"time_s\n");
    assert_eq!(status, Some(1));
    assert!(err.starts_with("error: standard input, line 1: has no column"), "{err}");
}

#[test]
#[cfg(unix)]
fn a_reader_that_stops_is_no_failure() {
    let dir = bench();
    let gmhm = env!("CARGO_BIN_EXE_gmhm");
    let script = format!("{gmhm} predict gear.toml rec.csv -o - | head -n 1; echo ${{PIPESTATUS[0]}}");
    let output = Command::new("bash").current_dir(dir.path("")).args(["-c", &script]).output().unwrap();
    let out = String::from_utf8(output.stdout).unwrap();
    assert!(out.starts_with("time_s,") && out.ends_with("\n0\n"), "{out}");
    assert_eq!(String::from_utf8(output.stderr).unwrap(), "");
}

#[test]
fn other_formats_are_predicted_too() {
    let dir = bench();
    for name in ["pandas.parquet", "scipy.mat", "asammdf_deflated.mf4"] {
        dir.succeed(&format!("predict gear.toml {} -o out.csv", fixture(name)));
        assert_eq!(dir.column("out.csv", "torque_model_nm").len(), 24, "{name}");
    }
    dir.succeed(&format!("predict gear.toml {} --from 0.1 --to 0.2 -o out.csv", fixture("pandas.parquet")));
    let time = dir.column("out.csv", "time_s");
    assert_eq!((time.len(), time[0]), (6, 7.0 / 64.0));
    dir.succeed(&format!("predict gear.toml {} --from 0.1 --to 0.2 -o text.csv", fixture("expected.csv")));
    assert_eq!(dir.column("text.csv", "torque_model_nm"), dir.column("out.csv", "torque_model_nm"));
}

#[test]
fn folders_and_lists_stand_for_recordings() {
    let dir = WorkDir::new();
    std::fs::create_dir(dir.path("bench")).unwrap();
    std::fs::copy(fixture("expected.csv"), dir.path("bench/b.csv")).unwrap();
    std::fs::copy(fixture("pandas.parquet"), dir.path("bench/a.parquet")).unwrap();
    dir.write("bench/notes.md", "no recording").write("list", "bench/b.csv\n\nbench/a.parquet\n");
    let order = |text: &str| {
        text.lines().filter(|line| line.starts_with("bench")).map(|line| line[..13].to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(order(&dir.succeed("columns bench").stdout), ["bench/a.parqu", "bench/b.csv: "]);
    assert_eq!(order(&dir.succeed("columns --files-from list").stdout), ["bench/b.csv: ", "bench/a.parqu"]);
    std::fs::create_dir(dir.path("empty")).unwrap();
    dir.refuse("columns empty", &["empty: holds no recording"]);
    assert_eq!(dir.gmhm("columns").status, Some(2));
}

#[test]
fn columns_names_what_is_there_and_what_is_missing() {
    let dir = WorkDir::new();
    let text = dir.succeed(&format!("columns {}", fixture("asammdf_plain.mf4"))).stdout;
    for part in ["MDF 4, 24 rows, 0 to 0.359375 s, 64", "Torque", "N·m", "torque_nm", "State"] {
        assert!(text.contains(part), "{text}\nshould say {part}");
    }
    let text = dir.succeed(&format!("columns {}", fixture("joint_states_zstd.mcap"))).stdout;
    for part in ["MCAP", "/joint_states.effort[2]", "--map '", "torque_nm=/joint_states.effort[0]"] {
        assert!(text.contains(part), "{text}\nshould say {part}");
    }
    dir.write("gap.csv", "Time [s],Torque [Nm],x\n0,1,a\n1,2,b\n2,nan,c\n9,4,d\n9,4,d\n");
    let text = dir.succeed("columns gap.csv").stdout;
    for part in ["1 gap in time, 7.000 s at 2.000 s", "not increase at 1 row", "1 row without a number"] {
        assert!(text.contains(part), "{text}\nshould say {part}");
    }
    assert!(text.contains("To fit a gear: has no column `deflection_rad`"), "{text}");
}

#[test]
fn recordings_and_models_are_drawn() {
    let dir = bench();
    let done = dir.succeed("plot rec.csv gear.toml -o loops.svg");
    assert_eq!(done.stdout, "Picture written to loops.svg\n");
    assert!(dir.read("loops.svg").starts_with("<svg"));
    dir.succeed("plot rec.csv gear.toml -o all.html");
    let page = dir.read("all.html");
    assert!(page.contains("Deflection over time") && page.len() < 1_000_000);
    assert_eq!(dir.gmhm("plot rec.csv -o all.png").status, Some(2));
}

#[test]
fn two_encoders_need_only_the_ratio() {
    let dir = bench();
    let (time, theta) = (dir.column("rec.csv", "time_s"), dir.column("rec.csv", "deflection_rad"));
    let torque = dir.column("rec.csv", "torque_nm");
    let write = |name: &str, sign: f64| {
        let mut text = "time_s,theta_in_rad,theta_out_rad,torque_nm\n".to_owned();
        for ((t, x), y) in time.iter().zip(&theta).zip(&torque) {
            let output = 3.0 * (0.05 * t).sin();
            text += &format!("{t:?},{:?},{:?},{y:?}\n", 100.0 * (x + output), sign * output);
        }
        dir.write(name, text);
    };
    write("two.csv", 1.0);
    write("flipped.csv", -1.0);
    dir.refuse("fit two.csv -o two.toml", &["no ratio is known", "add --ratio N; the angles turn 100"]);
    dir.refuse("fit two.csv --ratio 101 -o two.toml", &["turn 100 to 1, the ratio given is 101", "--ratio 100"]);
    dir.refuse("fit flipped.csv --ratio 100 -o two.toml", &["wrong sign", "theta_out_rad=-COLUMN"]);
    dir.succeed("fit two.csv --ratio 100 --name axis-3 --torque-side output -o two.toml");
    let model = dir.read("two.toml");
    assert!(model.contains("ratio = 100.0") && model.contains("name = \"axis-3\""), "{model}");
    dir.succeed("predict two.toml two.csv -o predicted.csv");
}

#[test]
fn side_files_are_kept_and_quiet_is_quiet() {
    let dir = bench();
    dir.write("gear2.svg", "mine");
    let done = dir.succeed("fit rec.csv -o gear2.toml");
    assert_eq!(dir.read("gear2.svg"), "mine");
    assert!(done.stderr.contains("gear2.svg exists and was kept; --plot gear2.svg replaces it"), "{}", done.stderr);
    let done = dir.succeed("-q fit rec.csv -o gear3.toml");
    assert_eq!((done.stdout.as_str(), done.stderr.as_str()), ("", ""));
    assert!(dir.files().contains(&"gear3.svg".to_owned()));
}

#[test]
fn shells_are_served() {
    let dir = WorkDir::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        assert!(dir.succeed(&format!("completions {shell}")).stdout.contains("diagnose"), "{shell}");
    }
    dir.succeed("man pages/man1");
    let page = dir.read("pages/man1/gmhm-fit.1");
    assert!(page.contains("gmhm\\-fit") && page.contains("\\-\\-ratio"), "{page}");
    let version = dir.succeed("--version").stdout;
    assert!(version.starts_with("gmhm 0.") && version.contains("features: "), "{version}");
}
