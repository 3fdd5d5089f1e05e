//! A folder of its own for each test of a command.

pub mod skips;

use std::path::PathBuf;

use assert_cmd::Command;

/// The published gear, MODEL.md section 1.
pub const PUBLISHED: &str = r#"format = 1
name = "published"
[gear]
ratio = 100.0
rated_deflection_rad = 1.168e-3
[elastic]
c1_nm_per_rad = 2.4737e4
c2_nm_per_rad3 = 1.0e9
c3_nm_per_rad5 = -1.1774e14
[memory]
alpha = 2.6532e6
beta_per_s = 422.68
omega_per_s = 226.31
"#;

/// A folder that is removed with the value.
pub struct WorkDir(tempfile::TempDir);

/// What a command did.
pub struct Done {
    pub status: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl WorkDir {
    pub fn new() -> Self {
        WorkDir(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> &Self {
        std::fs::write(self.path(name), bytes).unwrap();
        self
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    pub fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// Runs `gmhm` with these words in the folder.
    pub fn gmhm(&self, words: &str) -> Done {
        let mut command = Command::cargo_bin("gmhm").unwrap();
        let output = command.current_dir(self.0.path()).args(words.split_whitespace()).output().unwrap();
        Done {
            status: output.status.code(),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }

    /// Runs what must succeed.
    pub fn succeed(&self, words: &str) -> Done {
        let done = self.gmhm(words);
        assert_eq!(done.status, Some(0), "gmhm {words}\n{}", done.stderr);
        done
    }

    /// Runs what must be refused with status 1, one plain message that holds `parts`, and no file more than before.
    pub fn refuse(&self, words: &str, parts: &[&str]) {
        self.end(1, words, parts);
    }

    /// Runs what must be refused as wrong usage, with status 2.
    pub fn misuse(&self, words: &str, parts: &[&str]) {
        self.end(2, words, parts);
    }

    fn end(&self, status: i32, words: &str, parts: &[&str]) {
        let before = self.files();
        let done = self.gmhm(words);
        assert_eq!(done.status, Some(status), "gmhm {words}\n{}", done.stderr);
        assert!(done.stderr.starts_with("error: "), "{}", done.stderr);
        assert!(!done.stderr.contains("panicked") && !done.stderr.contains('\u{1b}'), "{}", done.stderr);
        for part in parts {
            assert!(done.stderr.contains(part), "gmhm {words}\n{}\nshould say {part:?}", done.stderr);
        }
        assert_eq!(self.files(), before, "gmhm {words}");
    }

    /// One column of a CSV file, as numbers.
    pub fn column(&self, file: &str, name: &str) -> Vec<f64> {
        let text = self.read(file);
        let mut lines = text.lines();
        let header = lines.next().unwrap();
        let index = header.split(',').position(|n| n == name).unwrap_or_else(|| panic!("{name} in {header}"));
        lines.map(|line| line.split(',').nth(index).unwrap().parse().unwrap()).collect()
    }
}

/// A folder with the parameter blocks of the published gear and of a softer one.
pub fn two_blocks() -> WorkDir {
    let dir = WorkDir::new();
    dir.write("gear.toml", PUBLISHED);
    dir.write("softer.toml", PUBLISHED.replace("2.4737e4", "2.2e4"));
    dir.succeed("pack gear.toml -o params.bin");
    dir.succeed("pack softer.toml -o softer.bin");
    dir
}
