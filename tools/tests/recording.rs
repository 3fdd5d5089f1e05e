//! Recordings: every shape of CSV is read rightly or refused with its place.

use std::path::PathBuf;

use gmhm_tools::recording::{
    ColumnMap, Needs, Reading, Recording, RecordingError, Samples, TorqueUnit, copy_with_columns, read,
};
use proptest::prelude::*;

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Folder(tempfile::tempdir().unwrap())
    }

    fn file(&self, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join("rec.csv");
        std::fs::write(&path, bytes).unwrap();
        path
    }
}

fn read_bytes(bytes: &[u8], map: &str) -> Result<Recording, RecordingError> {
    let folder = Folder::new();
    let map = if map.is_empty() { ColumnMap::default() } else { map.parse().unwrap() };
    read(&folder.file(bytes), &map, &Needs::FIT, &|_| {})
}

fn good(text: &str) -> Recording {
    read_bytes(text.as_bytes(), "").unwrap_or_else(|e| panic!("{text:?}: {e}"))
}

#[test]
fn every_dialect_reads_the_same() {
    let plain = "time_s,deflection_rad,torque_nm\n0,1e-3,1\n0.1,-2.5e-3,2\n0.25,0.5,-3.5\n";
    let millis = plain.replace("torque_nm", "torque_Nmm").replace(",1\n", ",1000\n").replace(",2\n", ",2e3\n");
    let dialects = [
        plain.to_owned(),
        plain.trim_end().to_owned(),
        plain.replace('\n', "\r\n"),
        format!("\u{feff}{plain}"),
        plain.replace(',', ";"),
        plain.replace(',', "\t"),
        plain.replace(',', ";").replace('.', ",").replace('\n', "\r\n"),
        format!("sep=;\n{}", plain.replace(',', ";")),
        plain.replace('\n', ",\n"),
        format!("# bench 3\n\n{plain}\n# end\n,,\n"),
        plain.replace("time_s", "\" time_s \"").replace("1e-3", "\"1e-3\""),
        plain.replace(",1\n", " , +1 \n"),
        plain.replace("time_s", "note,time_s").replace("\n0", "\nup, 0"),
        millis.replace("-3.5\n", "-3500\n"),
        plain.replace("time_s,deflection_rad,torque_nm", "Time [s],Deflection (rad),TORQUE_NM"),
        plain.replace("time_s,deflection_rad,torque_nm", "Time,Deflection,Torque\n[s],[rad],[N·m]"),
        plain.replace("time_s,deflection_rad,torque_nm", "log.time_s,log.deflection_rad,log.torque_nm"),
        plain.replace(',', "  ").replace("\n0", "\n   0").replace('\n', " \r\n"),
        format!("# NumPy\n# {}", plain.replace(',', " ")),
        format!("# {plain}"),
        plain.replace("time_s,deflection_rad,torque_nm", "Time [s]  Deflection (rad) Torque [Nm]").replace(',', "  "),
    ];
    for text in dialects {
        let rec = good(&text);
        assert_eq!(rec.time_s, [0.0, 0.1, 0.25], "{text:?}");
        assert_eq!(rec.deflection_rad.unwrap(), [1e-3, -2.5e-3, 0.5], "{text:?}");
        assert_eq!(rec.torque.unwrap(), [1.0, 2.0, -3.5], "{text:?}");
        assert_eq!(rec.sha256.len(), 64);
    }
}

#[test]
fn maps_rename_scale_and_flip() {
    let text = b"t,x,tau (Nm),note\n0,1,1000,-\n1,2,2000,-\n";
    let rec = read_bytes(text, "time_s=t,deflection_mrad=-x,torque_nm=tau (Nm)*0.001+0.5").unwrap();
    assert_eq!(rec.deflection_rad.unwrap(), [-0.001, -0.002]);
    assert_eq!(rec.torque.unwrap(), [1.5, 2.5]);
}

#[test]
fn current_stands_in_and_torque_wins() {
    let rec = good("time_s,deflection_rad,current_ma\n0,0,1500\n1,0,2\n");
    assert_eq!((rec.torque_unit, rec.torque.unwrap()[0]), (TorqueUnit::Ampere, 1.5));
    let both = "time_s,deflection_rad,current_a,torque_nm\n0,0,1,10\n1,0,2,20\n";
    assert_eq!(good(both).torque.unwrap(), [10.0, 20.0]);
    let rec = read_bytes(both.as_bytes(), "current_a=current_a").unwrap();
    assert_eq!((rec.torque_unit, rec.torque.unwrap()), (TorqueUnit::Ampere, vec![1.0, 2.0].into()));
}

#[test]
fn deflection_comes_from_angles_unless_recorded() {
    let mut rec = good("time_s,theta_in_rad,theta_out_deg,torque_nm\n0,-100,0,0\n1,50,90,0\n");
    assert!(rec.clone().derive_deflection(None).unwrap_err().to_string().contains("no ratio"));
    rec.derive_deflection(Some(-100.0)).unwrap();
    assert_eq!(rec.deflection_rad.unwrap(), [1.0, -0.5 - std::f64::consts::FRAC_PI_2]);
    let mut rec = good("time_s,deflection_rad,theta_in_rad,theta_out_rad,torque_nm\n0,7,1,1,0\n1,8,1,1,0\n");
    rec.derive_deflection(Some(100.0)).unwrap();
    assert_eq!(rec.deflection_rad.unwrap(), [7.0, 8.0]);
}

#[test]
fn each_malformed_file_is_refused_at_its_place() {
    let header = "time_s,deflection_rad,torque_nm\n";
    let with = |rows: &str| format!("{header}{rows}").into_bytes();
    let semicolons = |rows: &str| format!("{}{rows}", header.replace(',', ";")).into_bytes();
    let cases: Vec<(Vec<u8>, &str)> = vec![
        (b"".to_vec(), "is empty"),
        (b"\n# only a comment\n\n".to_vec(), "is empty"),
        (with(""), "no row"),
        (with("0,0,0\n"), "a single row"),
        (b"0,0,0\n1,0,0\n".to_vec(), "line 1: starts with numbers"),
        (b"time_s,torque_nm\n0,0\n1,1\n".to_vec(), "line 1: has no column `deflection_rad`"),
        (b"zeit,kraft\n0,0\n1,1\n".to_vec(), "no column `time_s`, `torque_nm` (or `current_a`), `deflection_rad`"),
        (b"time_s,deflection_rad,torque_nm\nms,rad,Nm\n0,0,0\n1,0,0\n".to_vec(), "says s, the unit beside it ms"),
        (b"t_s,deflection_rad,torque_nm\n0,0,0\n".to_vec(), "has no column `time_s`; its columns are `t_s`"),
        (b"time_s,deflection_rad\n0,0\n1,0\n".to_vec(), "has no column `torque_nm`"),
        (b"time_s,deflection_mm,torque_nm\n0,0,0\n".to_vec(), "line 1, column 2 `deflection_mm`: `_mm` is no unit"),
        (b"time,deflection_rad,torque_nm\n0,0,0\n".to_vec(), "column 1 `time`: the name says no unit"),
        (b"time_s,deflection_rad,torque_nm,torque_nm\n".to_vec(), "column 4 `torque_nm`: is twice in the header"),
        (b"time_s,deflection_rad,deflection_mrad,torque_nm\n".to_vec(), "both give the deflection"),
        (with("0,0,0\n1,abc,0\n"), "line 3, column 2 `deflection_rad`: `abc` is not a number"),
        (with("0,0,0\n1,0,\n"), "line 3, column 3 `torque_nm`: the field is empty"),
        (with("0,0,NaN\n1,0,0\n"), "line 2, column 3 `torque_nm`: `NaN`"),
        (with("0,0,0\n1,-inf,0\n"), "line 3, column 2 `deflection_rad`: `-inf`"),
        (with("0,0,1e999\n1,0,0\n"), "not a finite number"),
        (with("0,0,0\n\n# x\n1,0,0\n0.5,0,0\n"), "line 6, column 1 `time_s`: time decreases: 0.5 s after 1 s"),
        (with("0,0,0\r\n0,0,0\r\n"), "line 3, column 1 `time_s`: time does not increase"),
        (with("0,0,0\n1,0,0\n2,0"), "line 4: the last row is cut off"),
        (with("0,0,0\n1,0\n2,0,0\n"), "line 3: the row has 2 of 3"),
        (with("0,0,0\n1,0,0,9\n"), "line 3: the row has 4 fields"),
        (with("0,0,\"1,5\"\n1,0,0\n"), "holds a comma"),
        (semicolons("0;0,5;1.5\n"), "another decimal mark"),
        (semicolons("0;0;1.234,5\n"), "thousands"),
        (b"\xff\xfet\0i\0".to_vec(), "UTF-16"),
        (b"PK\x03\x04zip".to_vec(), "Excel"),
        (b"TDSm\0".to_vec(), "a TDMS file of LabVIEW, which is not read"),
        (b"\x89HDF\r\n\x1a\n\0".to_vec(), "HDF5 file without MATLAB's header"),
        (b"#ROSBAG V2.0\n".to_vec(), "ROS 1"),
        (b"time_s\0".to_vec(), "binary"),
        (b"time_s,torque_nm\r0,0\r1,0\r".to_vec(), "carriage return alone"),
    ];
    for (bytes, part) in cases {
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let error = read_bytes(&bytes, "").expect_err(&text);
        assert!(error.to_string().contains(part), "{text:?}\n{error}\nshould say {part:?}");
        assert!(error.fix().is_some(), "{error} lacks a fix");
    }
}

#[test]
fn a_near_name_is_offered_as_a_map() {
    let error = read_bytes(b"t_s,disp_m,force_kN\n0,0,0\n1,1,1\n", "").unwrap_err();
    assert!(error.fix().unwrap().contains("--map time_s=t_s,torque_nm=force_kN,deflection_rad=disp_m"), "{error:?}");
    let error = read_bytes(b"Time,Motor torque [mNm],Twist [arcmin]\n0,0,0\n1,1,1\n", "").unwrap_err();
    let map = "--map 'time_s=Time,torque_mnm=Motor torque [mNm],deflection_arcmin=Twist [arcmin]'";
    assert!(error.fix().unwrap().contains(map), "{:?}", error.fix());
    let error = read_bytes(b"time,deflection_rad,torque_nm\n0,0,0\n", "").unwrap_err();
    assert_eq!(error.fix().unwrap(), "if it is in s, add --map time_s=time");
    let error = read_bytes(b"t_s,disp_m,force_kN\n0,0,0\n1,1,1\n", "time_s=t,torque_nm=force_kN").unwrap_err();
    assert!(error.to_string().contains("no column for `--map time_s=t`"), "{error}");
}

#[test]
fn predict_never_looks_at_the_torque() {
    let folder = Folder::new();
    let path = folder.file(b"time_s,deflection_rad,torque_nm\n0,0,\n1,0,NaN\n");
    let rec = read(&path, &ColumnMap::default(), &Needs::PREDICT, &|_| {}).unwrap();
    assert_eq!(rec.torque, None);
}

#[test]
fn copied_rows_keep_their_text_and_their_decimal_mark() {
    let folder = Folder::new();
    let rows = "\"a;b\";0,10;1,5E-3;\r\n# c\r\nv1.5;0,20;-0;\r\n";
    let path = folder.file(format!("\u{feff}note;time_s;deflection_rad;\r\n{rows}").as_bytes());
    let added: [(&str, &[f64]); 1] = [("torque_model_nm", &[0.1, -1e-300])];
    let mut out = Vec::new();
    copy_with_columns(
        &path.as_path().into(),
        &Reading::new(ColumnMap::default(), Needs::PREDICT),
        &added,
        &mut out,
        &(),
    )
    .unwrap();
    let expected = "note;time_s;deflection_rad;torque_model_nm\n\"a;b\";0,10;1,5E-3;0,1\nv1.5;0,20;-0;-1e-300\n";
    assert_eq!(String::from_utf8(out).unwrap(), expected);
}

#[test]
fn written_recordings_read_back_exactly() {
    let awkward = vec![0.1 + 0.2, -0.0, f64::MIN_POSITIVE, 1e300, std::f64::consts::PI];
    let rec = Recording {
        time_s: vec![-1.0, 0.0, 1e-9, 1.0 / 3.0, 1.7e9].into(),
        torque: Some(awkward.clone().into()),
        deflection_rad: Some(awkward.clone().into()),
        temperature_c: Some(awkward.into()),
        ..Recording::default()
    };
    let mut bytes = Vec::new();
    rec.write(&mut bytes).unwrap();
    let back = read_bytes(&bytes, "").unwrap();
    let bits = |values: &Option<Samples>| values.as_ref().unwrap().iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&back.torque), bits(&rec.torque));
    assert_eq!(bits(&back.temperature_c), bits(&rec.temperature_c));
    assert_eq!(back.time_s, rec.time_s);
}

/// Bytes that look like a recording in places.
fn almost_csv() -> impl Strategy<Value = Vec<u8>> {
    let token = prop_oneof![
        prop::sample::select(vec![
            "time_s",
            "deflection_rad",
            "torque_nm",
            "theta_in_deg",
            ",",
            ";",
            "\t",
            "\n",
            "\r\n",
            "\"",
            "#",
            "0",
            "1",
            "2",
            "1e3",
            "-0.5",
            "1,5",
            "nan",
            " ",
            "\u{feff}",
            "sep=;\n",
        ])
        .prop_map(|text| text.as_bytes().to_vec()),
        prop::collection::vec(any::<u8>(), 0..4),
    ];
    prop::collection::vec(token, 0..40).prop_map(|tokens| tokens.concat())
}

proptest! {
    #[test]
    fn no_bytes_make_the_reader_panic(bytes in almost_csv()) {
        if let Ok(rec) = read_bytes(&bytes, "") {
            prop_assert!(rec.len() >= 2);
            prop_assert!(rec.time_s.windows(2).all(|w| w[0] < w[1]));
            prop_assert_eq!(rec.torque.map(|t| t.len()), Some(rec.time_s.len()));
        }
    }
}
