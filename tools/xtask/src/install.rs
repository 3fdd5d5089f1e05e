//! The program, installed as docs/install.md says, used in an environment that has nothing else.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use xshell::{Shell, cmd};

/// Where each shell finds its completions, below the home folder.
const COMPLETIONS: [(&str, &str); 3] = [
    ("bash", ".local/share/bash-completion/completions/gmhm"),
    ("zsh", ".zfunc/_gmhm"),
    ("fish", ".config/fish/completions/gmhm.fish"),
];

/// Folders of the system, without what people add to them.
const SYSTEM: &str = "/usr/bin:/bin";

/// Installs the program into a temporary folder and uses it from a home of its own, with no other program of ours in reach.
pub fn run(shell: &Shell) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let (root, home) = (folder.path().join("root"), folder.path().join("home"));
    let examples = shell.current_dir().join("examples/bench");
    cmd!(shell, "cargo install --quiet --locked --no-track --path tools --root {root}")
        .run()
        .context("`cargo install --path tools` fails")?;
    shell.create_dir(&home)?;
    let _folder = shell.push_dir(&home);
    let program = Program { shell, home: &home, path: format!("{}:{SYSTEM}", root.join("bin").display()) };

    let version = program.run("gmhm --version")?;
    ensure!(version.contains("commit ") && version.contains("features: none"), "gmhm --version says {version:?}");
    let demo = program.run("gmhm")?;
    ensure!(demo.contains("gmhm help") && home.join("gmhm-demo/model.toml").exists(), "gmhm alone makes no demo");
    let recording = examples.join("cycle.csv").display().to_string();
    program.run(&format!("gmhm -q fit '{recording}' -o gear.toml --report fit.html"))?;
    ensure!(home.join("fit.html").exists(), "gmhm fit writes no report");

    for (name, path) in COMPLETIONS {
        shell.create_dir(Path::new(path).parent().unwrap_or(Path::new(".")))?;
        program.run(&format!("gmhm completions {name} > {path}"))?;
        ensure!(shell.read_file(path)?.contains("diagnose"), "the completions for {name} lack a command");
    }
    let bash = COMPLETIONS[0].1;
    let ask = format!(". {bash}; COMP_WORDS=(gmhm di); COMP_CWORD=1; _gmhm gmhm di gmhm; echo \"${{COMPREPLY[@]}}\"");
    let offered = program.run(&ask)?;
    ensure!(offered.trim() == "diagnose", "bash offers {offered:?} after `gmhm di`");

    program.run("gmhm man .local/share/man/man1")?;
    let pages = shell.read_dir(".local/share/man/man1")?.len();
    if cmd!(shell, "man --version").quiet().ignore_stdout().ignore_stderr().run().is_ok() {
        for page in ["gmhm", "gmhm-fit"] {
            let found = program.run(&format!("man --path --manpath=.local/share/man {page}"))?;
            ensure!(found.contains(&format!("{page}.1")), "man does not find {page}");
        }
    }
    println!("install: the program runs from an empty environment; bash completes its commands; {pages} manual pages");
    Ok(())
}

/// The installed program.
struct Program<'s> {
    shell: &'s Shell,
    home: &'s Path,
    path: String,
}

impl Program<'_> {
    /// What a line of bash prints, with nothing set but the home and the path.
    fn run(&self, line: &str) -> Result<String> {
        let (shell, home, path) = (self.shell, self.home, &self.path);
        cmd!(shell, "env -i HOME={home} PATH={path} LANG=C.UTF-8 bash --noprofile --norc -c {line}")
            .quiet()
            .read()
            .with_context(|| format!("`{line}` fails where the program was installed"))
    }
}
