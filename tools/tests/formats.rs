//! Recordings in every format, written by other tools (`tests/recordings/make.py`), read to the last bit; damaged ones are refused.

use std::path::PathBuf;

use gmhm_tools::recording::{Needs, Reading, Recording, RecordingError, Samples, read};

fn fixture(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/recordings").join(name)
}

fn try_mapped(name: &str, map: &str) -> Result<Recording, RecordingError> {
    let map = if map.is_empty() { Default::default() } else { map.parse().unwrap() };
    read(&fixture(name), &map, &Needs::FIT, &|_| {})
}

fn mapped(name: &str, map: &str) -> Recording {
    try_mapped(name, map).unwrap_or_else(|e| panic!("{e}\n{:?}", e.fix()))
}

fn expected() -> Recording {
    mapped("expected.csv", "")
}

fn bits(column: &[f64]) -> Vec<u64> {
    column.iter().map(|x| x.to_bits()).collect()
}

fn assert_same(name: &str, found: &Recording) {
    let expected = expected();
    assert_eq!(bits(&found.time_s), bits(&expected.time_s), "{name}: time");
    for (found, expected) in [
        (&found.torque, &expected.torque),
        (&found.deflection_rad, &expected.deflection_rad),
        (&found.temperature_c, &expected.temperature_c),
    ] {
        if let Some(found) = found {
            assert_eq!(bits(found), bits(expected.as_ref().unwrap()), "{name}");
        }
    }
    assert!(found.torque.is_some() && found.deflection_rad.is_some(), "{name}");
    assert_eq!(found.sha256.len(), 64);
}

#[test]
fn named_columns_are_read_to_the_bit() {
    let with_temperature = [
        "gzip.csv.gz",
        "zstd.csv.zst",
        "numpy.txt",
        "pandas.parquet",
        "pyarrow_none.parquet",
        "pyarrow_gzip.parquet",
        "pyarrow_zstd.parquet",
        "pyarrow_lz4.parquet",
        "stamps.parquet",
        "pyarrow_bare.parquet",
        "scipy.mat",
        "scipy_packed.mat",
        "asammdf_plain.mf4",
        "asammdf_deflated.mf4",
        "asammdf_transposed.mf4",
    ];
    for name in with_temperature {
        let found = mapped(name, "");
        assert_same(name, &found);
        assert!(found.temperature_c.is_some(), "{name}");
    }
    assert_same("json.mcap", &mapped("json.mcap", ""));
}

#[test]
fn every_kind_of_number_of_parquet_is_read() {
    let whole = expected();
    let temperature = whole.temperature_c.as_deref().unwrap();
    for column in ["i8", "i16", "i32", "i64", "u8", "u16", "u32", "u64", "dictionary"] {
        let found = mapped("pyarrow_types.parquet", &format!("temperature_c={column}"));
        assert_same(column, &found);
        assert_eq!(found.temperature_c.as_deref(), Some(temperature), "{column}");
    }
    let flags: Samples = temperature.iter().map(|kelvin| f64::from(u8::from(*kelvin > 22.0))).collect();
    assert_eq!(mapped("pyarrow_types.parquet", "temperature_c=flag").temperature_c, Some(flags));
    let single: Samples = whole.torque.unwrap().iter().map(|torque| f64::from(*torque as f32)).collect();
    assert_eq!(mapped("pyarrow_types.parquet", "torque_nm=f32").torque, Some(single));
    let error = try_mapped("pyarrow_types.parquet", "torque_nm=label").unwrap_err().to_string();
    assert!(error.contains("has no column for `--map torque_nm=label`"), "{error}");
}

#[test]
fn nested_names_are_mapped() {
    let map = "time_s=log.t,deflection_rad=log.motion.twist,torque_nm=log.torque[1],temperature_c=log.torque[0]";
    assert_same("scipy_struct.mat", &mapped("scipy_struct.mat", map));
    for name in ["joint_states_plain.mcap", "joint_states_zstd.mcap", "joint_states_lz4.mcap"] {
        let map = "deflection_rad=/joint_states.position[1],torque_nm=/joint_states.effort[2]";
        assert_same(name, &mapped(name, map));
    }
    let error = try_mapped("joint_states_plain.mcap", "").unwrap_err();
    assert!(error.fix().unwrap().contains("/joint_states.effort[0]"), "{error} {:?}", error.fix());
    let error = try_mapped("asammdf_plain.mf4", "time_s=group1.time").unwrap_err();
    assert!(error.to_string().contains("torque_nm"), "{error}");
    let error = try_mapped("asammdf_plain.mf4", "temperature_c=State,torque_nm=Torque").unwrap_err();
    assert!(error.to_string().contains("rows of its own"), "{error}");
}

#[cfg(feature = "mat73")]
#[test]
fn mat_7_3_is_read_to_the_bit() {
    assert_same("h5py_73.mat", &mapped("h5py_73.mat", ""));
    let map = "time_s=log.t,deflection_rad=log.motion.twist,torque_nm=log.torque[1],temperature_c=log.torque[0]";
    assert_same("hdf5storage_73.mat", &mapped("hdf5storage_73.mat", map));
}

#[cfg(not(feature = "mat73"))]
#[test]
fn mat_7_3_names_the_feature_that_reads_it() {
    let error = try_mapped("h5py_73.mat", "").unwrap_err();
    assert!(error.to_string().contains("MAT 7.3, which this gmhm was built without"), "{error}");
    assert!(error.fix().unwrap().contains("--features mat73"), "{:?}", error.fix());
}

#[test]
fn what_is_missing_is_named_with_its_row() {
    let error = try_mapped("gap.parquet", "").unwrap_err().to_string();
    assert!(error.contains("row 6, column 3 `torque_nm`: `NaN` is not a finite number"), "{error}");
    let error = try_mapped("hole.parquet", "").unwrap_err().to_string();
    assert!(error.contains("row 9, column 3 `torque_nm`: `NaN` is not a finite number"), "{error}");
    let error = try_mapped("plain.h5", "").unwrap_err().to_string();
    assert!(error.contains("HDF5 file without MATLAB's header"), "{error}");
}

#[test]
fn rows_are_cropped_before_they_are_checked() {
    let mut reading = Reading::new(Default::default(), Needs::FIT);
    reading.from_s = Some(6.0 / 64.0);
    reading.to_s = Some(10.0 / 64.0);
    let whole = expected();
    for name in ["gap.parquet", "expected.csv", "scipy.mat"] {
        let found = reading.read(&fixture(name).as_path().into(), &|_| {}).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(found.time_s, whole.time_s[6..=10], "{name}");
        assert_eq!(found.torque.as_deref(), whole.torque.as_ref().map(|torque| &torque[6..=10]), "{name}");
    }
    reading.to_s = Some(6.0 / 64.0);
    let error = reading.read(&fixture("expected.csv").as_path().into(), &|_| {}).unwrap_err().to_string();
    assert!(error.contains("a single row between --from and --to; its time runs from 0 to 0.359375 s"), "{error}");
}

#[test]
fn damaged_files_are_refused_or_read() {
    let folder = tempfile::tempdir().unwrap();
    let maps = ["", "deflection_rad=/joint_states.position[1],torque_nm=/joint_states.effort[2]"];
    let mut refused = 0;
    for entry in std::fs::read_dir(fixture("")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|ending| ending == "py") {
            continue;
        }
        let whole = std::fs::read(&path).unwrap();
        let damaged = folder.path().join(path.file_name().unwrap());
        let mut try_it = |bytes: &[u8]| {
            // A file system may wait for the disk where a file is written over, and does not for a new one.
            let _ = std::fs::remove_file(&damaged);
            std::fs::write(&damaged, bytes).unwrap();
            for map in maps {
                let map = if map.is_empty() { Default::default() } else { map.parse().unwrap() };
                match read(&damaged, &map, &Needs::FIT, &|_| {}) {
                    Ok(found) => assert_eq!(found.torque.unwrap().len(), found.time_s.len()),
                    Err(error) => {
                        assert!(error.fix().is_some() || error.to_string().contains("cannot be read"), "{error}");
                        refused += 1;
                    }
                }
            }
        };
        let step = (whole.len() / 60).max(1);
        for end in (0..whole.len()).step_by(step) {
            try_it(&whole[..end]);
        }
        for at in (0..whole.len()).step_by(step) {
            for flip in [0xff, 0x01, 0x80] {
                let mut bytes = whole.clone();
                bytes[at] ^= flip;
                try_it(&bytes);
            }
        }
    }
    assert!(refused > 1000, "{refused}");
}
