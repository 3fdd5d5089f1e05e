//! The guide is a test: every command that it shows is run, and what it prints is compared with what the guide shows.
//!
//! `GMHM_BOOK=overwrite cargo test -p gmhm-tools --test all book` writes what the commands print into the guide.
//!
//! A block of ```` ```console ```` holds commands after `$ ` and their output; `&` at the end of a command leaves it running until the end of the page. Lines
//! that stand in for any others are `...`. Where `<!-- numbers vary -->` stands before a block, its numbers are not compared.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use crate::common::WorkDir;

/// The port that the guide shows; the test takes a free one.
const SHOWN_PORT: &str = "5555";
const VARIES: &str = "<!-- numbers vary -->";

fn top() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace").to_owned()
}

/// A command line and what the page shows after it.
struct Shown {
    line: String,
    output: Vec<String>,
    varies: bool,
}

/// The commands of a page, and the page around them: a piece of text, a block, a piece of text, …
fn parse(page: &str) -> (Vec<String>, Vec<Vec<Shown>>) {
    let (mut texts, mut blocks) = (vec![String::new()], Vec::new());
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        let text = texts.last_mut().expect("a text");
        text.push_str(line);
        text.push('\n');
        if line != "```console" {
            continue;
        }
        let varies = text.trim_end().trim_end_matches("```console").trim_end().ends_with(VARIES);
        let mut block: Vec<Shown> = Vec::new();
        for line in lines.by_ref().take_while(|line| *line != "```") {
            match (line.strip_prefix("$ "), block.last_mut()) {
                (Some(command), _) => {
                    block.push(Shown { line: command.to_owned(), output: Vec::new(), varies });
                }
                (None, Some(shown)) => shown.output.push(line.to_owned()),
                (None, None) => panic!("output before a command: {line}"),
            }
        }
        blocks.push(block);
        texts.push("```\n".to_owned());
    }
    (texts, blocks)
}

/// Runs commands in a folder of their own with the examples in it.
struct Shell {
    dir: WorkDir,
    port: String,
    running: Vec<Child>,
}

impl Shell {
    fn new() -> Self {
        let dir = WorkDir::new();
        let bench = dir.path("examples/bench");
        std::fs::create_dir_all(&bench).expect("a folder");
        for file in std::fs::read_dir(top().join("examples/bench")).expect("the examples") {
            let file = file.expect("a file");
            std::fs::copy(file.path(), bench.join(file.file_name())).expect("a copy");
        }
        let free = std::net::TcpListener::bind("localhost:0").expect("a port").local_addr().expect("an address");
        Self { dir, port: free.port().to_string(), running: Vec::new() }
    }

    /// What a command prints, both streams.
    fn run(&mut self, line: &str) -> Vec<String> {
        let asked = line.replace(SHOWN_PORT, &self.port);
        let (asked, stays) = asked.strip_suffix(" &").map_or((&asked[..], false), |asked| (asked, true));
        let mut words = asked.split_whitespace();
        assert_eq!(words.next(), Some("gmhm"), "only gmhm is run: {line}");
        let mut command = Command::new(env!("CARGO_BIN_EXE_gmhm"));
        command.args(words).current_dir(self.dir.path("."));
        let text = if stays {
            let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("gmhm");
            let mut output = BufReader::new(child.stdout.take().expect("its output"));
            let mut text = String::new();
            for _ in 0..2 {
                output.read_line(&mut text).expect("a line");
            }
            self.running.push(child);
            // What it says later is read and dropped.
            std::thread::spawn(move || output.lines().for_each(drop));
            text
        } else {
            let output = command.output().expect("gmhm");
            let text = String::from_utf8(output.stdout).expect("text") + &String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{line}\n{text}");
            text
        };
        let text = text.replace(&self.port, SHOWN_PORT);
        text.lines().map(|line| line.trim_end().to_owned()).collect()
    }
}

impl Drop for Shell {
    fn drop(&mut self) {
        for child in &mut self.running {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// Every run of digits as one letter.
fn without_numbers(line: &str) -> String {
    let is_number = |c: char| c.is_ascii_digit() || ".−-·⁰¹²³⁴⁵⁶⁷⁸⁹⁻".contains(c);
    // A gap between groups of digits is no end of a number.
    let line = line.replace('\u{202f}', "");
    let words = line.split_whitespace().map(|word| {
        let bare = word.trim_matches(['(', ')', ',', ';', '%']);
        let digits = bare.chars().any(|c| c.is_ascii_digit()) && bare.chars().all(is_number);
        if digits || bare.starts_with("0x") || bare.parse::<f64>().is_ok() { "#" } else { word }
    });
    words.collect::<Vec<_>>().join(" ")
}

fn agrees(shown: &[String], found: &[String], varies: bool) -> bool {
    let same = |a: &str, b: &str| if varies { without_numbers(a) == without_numbers(b) } else { a == b };
    match shown.split_first() {
        None => found.is_empty(),
        Some((first, rest)) if first == "..." => (0..=found.len()).any(|skip| agrees(rest, &found[skip..], varies)),
        Some((first, rest)) => {
            found.split_first().is_some_and(|(found, others)| same(first, found) && agrees(rest, others, varies))
        }
    }
}

fn check(page: &str) {
    let path = top().join(page);
    let text = std::fs::read_to_string(&path).expect("the page");
    let (texts, blocks) = parse(&text);
    let overwrite = std::env::var_os("GMHM_BOOK").is_some_and(|mode| mode == "overwrite");
    let mut shell = Shell::new();
    let mut written = String::new();
    for (text, block) in texts.iter().zip(blocks.iter().map(Some).chain([None])) {
        written += text;
        for Shown { line, output, varies } in block.into_iter().flatten() {
            let found = shell.run(line);
            let agrees = agrees(output, &found, *varies);
            assert!(
                agrees || overwrite,
                "{page} shows after `{line}`\n{}\nbut it prints\n{}",
                output.join("\n"),
                found.join("\n")
            );
            let kept = if agrees { output } else { &found };
            written += &format!("$ {line}\n");
            kept.iter().for_each(|line| written += &format!("{line}\n"));
        }
    }
    if overwrite {
        std::fs::write(&path, written).expect("the page");
    }
}

#[test]
fn the_guide_shows_what_its_commands_print() {
    check("docs/guide.md");
}

#[test]
fn the_examples_are_what_their_commands_make() {
    let shell = Shell::new();
    let commands = std::fs::read_to_string(top().join("examples/bench/make.sh")).expect("the commands");
    let mut count = 0;
    for line in commands.lines().filter_map(|line| line.strip_prefix("gmhm ")) {
        let (words, file) = line.rsplit_once(" -o ").expect("an output");
        shell.dir.succeed(&format!("{} -o {file}", words.replace("true_gear", "examples/bench/true_gear")));
        let shown = std::fs::read(top().join("examples/bench").join(file)).expect("the example");
        assert!(shown == std::fs::read(shell.dir.path(file)).expect("made"), "{file} is not what `{line}` makes");
        count += 1;
    }
    assert_eq!(count, 4);
}

/// The proofs that the README takes its numbers from run as it shows them, here on one case; docs/proof.md has their tables.
#[test]
fn the_proofs_of_the_readme_run() {
    let [readme, proof] =
        ["README.md", "docs/proof.md"].map(|page| std::fs::read_to_string(top().join(page)).expect("the page"));
    let shell = Shell::new();
    let shown: Vec<&str> = readme.split('`').filter(|span| span.starts_with("gmhm prove -")).collect();
    assert_eq!(shown.len(), 2);
    for line in shown {
        assert!(proof.contains(&format!("`{line}`")), "docs/proof.md has no `{line}`");
        let words: Vec<&str> = line.split_whitespace().skip(1).collect();
        let cases = words.iter().position(|word| *word == "--cases").expect("a number of cases") + 1;
        let few: Vec<&str> = words.iter().enumerate().map(|(at, word)| if at == cases { "1" } else { word }).collect();
        let done = shell.dir.succeed(&few.join(" "));
        assert!(done.stdout.contains(" cases"), "{}", done.stdout);
    }
}
