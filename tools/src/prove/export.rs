//! The same cases as files, for detectors written elsewhere.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::generator::{Case, CaseSpec, Unseen, case, case_seed};
use crate::recording::Recording;

/// Writes the cases of a proof ([`mix::suite`](super::mix::suite)) under `folder`, each in a folder of its own:
///
/// - `case_0007/recording_1.csv` …, `model.toml`, `removed.txt` (kinds it may not use): what the detector may see;
/// - `case_0007/unseen_1.csv`: recordings to be predicted, without their torque;
/// - `keys/case_0007.toml` and `keys/case_0007_unseen_1.csv` (`torque_nm`): not to be read before scoring;
/// - `keys.sha256`: the hash of every key, in the format of `sha256sum`.
///
/// # Errors
/// What the file system refuses.
pub fn write(folder: &Path, seed: u64, cases: &[(usize, CaseSpec)], progress: &mut dyn FnMut(usize)) -> io::Result<()> {
    let keys = folder.join("keys");
    fs::create_dir_all(&keys)?;
    let mut hashes = String::new();
    for (done, (index, spec)) in cases.iter().enumerate() {
        let name = format!("case_{index:04}");
        let case = case(case_seed(seed, *index as u64), spec);
        write_case(&folder.join(&name), &case)?;
        fs::write(keys.join(format!("{name}.toml")), case.key.to_toml())?;
        for (k, unseen) in case.unseen.iter().enumerate() {
            write_truth(&keys.join(format!("{name}_unseen_{}.csv", k + 1)), unseen)?;
        }
        hashes += &format!("{}  keys/{name}.toml\n", case.key.sha256());
        progress(done + 1);
    }
    fs::write(folder.join("keys.sha256"), hashes)
}

fn write_case(folder: &Path, case: &Case) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    for (k, recording) in case.recordings.iter().enumerate() {
        write_recording(&folder.join(format!("recording_{}.csv", k + 1)), recording)?;
    }
    for (k, unseen) in case.unseen.iter().enumerate() {
        write_recording(&folder.join(format!("unseen_{}.csv", k + 1)), &unseen.recording)?;
    }
    fs::write(folder.join("model.toml"), case.base.to_toml())?;
    fs::write(folder.join("removed.txt"), case.removed.iter().map(|k| format!("{k}\n")).collect::<String>())
}

fn write_recording(path: &Path, recording: &Recording) -> io::Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    recording.write(&mut out)?;
    out.flush()
}

fn write_truth(path: &Path, unseen: &Unseen) -> io::Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    writeln!(out, "time_s,torque_nm")?;
    for (t, torque) in unseen.recording.time_s.iter().zip(&unseen.torque_nm) {
        writeln!(out, "{t:?},{torque:?}")?;
    }
    out.flush()
}
