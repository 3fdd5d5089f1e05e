//! `docs/block.md` and `docs/model-file.md` say what the library does: their tables are the registry's, the example is a golden block.
//!
//! `GMHM_WRITE_DOCS=1 cargo test -p gmhm-host-tests --test all pages` writes them into the pages.

use std::fmt::Write as _;
use std::path::PathBuf;

use gmhm::block::{Coding, FIRST_TERM, HEADER_BYTES, RECORDS, ScalarKind, TermRecord, sdo_abort, verify};
use gmhm::registry::SECTIONS;
use gmhm::terms::{Form, KINDS, KeyInfo, Range, Side, Value, tag_of_kind};

fn page(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs")).join(name)
}

/// Holds the part of the page between two marks against what it should be.
fn check(name: &str, mark: &str, expected: &str) {
    let text = std::fs::read_to_string(page(name)).expect("the page");
    let (begin, end) = (format!("<!-- {mark}: written from "), format!("<!-- end of {mark} -->"));
    let at = text.find(&begin).and_then(|at| Some(at + text[at..].find("-->\n")? + 4)).expect("the first mark");
    let till = text.find(&end).expect("the last mark");
    if std::env::var_os("GMHM_WRITE_DOCS").is_some() {
        let written = format!("{}\n{expected}\n{}", &text[..at], &text[till..]);
        std::fs::write(page(name), written).expect("the page");
        return;
    }
    let found = text[at..till].trim_matches('\n');
    assert!(
        found == expected.trim_matches('\n'),
        "docs/{name}, {mark}: the page is not what the library does; write it anew"
    );
}

fn range(key: &KeyInfo) -> String {
    match key.form {
        Form::Choice(words) => {
            words.iter().enumerate().map(|(k, word)| format!("{k}: {word}")).collect::<Vec<_>>().join(", ")
        }
        _ if key.range == Range::Any => "any".to_owned(),
        _ => key.range.words().to_owned(),
    }
}

fn unit(key: &KeyInfo) -> &str {
    if key.unit == "1" { "" } else { key.unit }
}

fn coding(coding: Coding) -> &'static str {
    match coding {
        Coding::Scalar => "scalar",
        Coding::Gain => "gain",
        Coding::Double => "double",
        Coding::Choice => "choice",
    }
}

fn records() -> String {
    let mut text = String::new();
    for info in RECORDS {
        let head = format!("### `{}`, tag {:#06x}", info.name, info.tag);
        writeln!(text, "{head}\n\n{}{}.", info.words[..1].to_uppercase(), &info.words[1..]).expect("a string");
        if info.fields.is_empty() {
            writeln!(text).expect("a string");
            continue;
        }
        text += "\n| word | field | coding | unit | values | |\n|---:|---|---|---|---|---|\n";
        let mut at = 0;
        for field in info.fields {
            let (key, words) = (&field.key, field.coding.words());
            let (name, coding, unit) = (key.name, coding(field.coding), unit(key));
            let place = if words == 1 { at.to_string() } else { format!("{at}, {}", at + 1) };
            writeln!(text, "| {place} | `{name}` | {coding} | {unit} | {} | {} |", range(key), key.words)
                .expect("a string");
            at += words;
        }
        writeln!(text).expect("a string");
    }
    text
}

/// One row a key of every kind, its tag in blocks first where it is asked for.
fn terms(with_tags: bool) -> String {
    let (head, rule) = if with_tags { ("| tag ", "|---") } else { ("", "") };
    let mut text =
        format!("{head}| kind | side | key | holds | unit | values | |\n{rule}|---|---|---|---|---|---|---|\n");
    for info in KINDS {
        let tag = FIRST_TERM + tag_of_kind(info.name).expect("a kind of the registry");
        let side = if info.side == Side::Plant { "plant" } else { "instrument" };
        for (k, key) in info.keys.iter().enumerate() {
            let tag = match (with_tags, k) {
                (true, 0) => format!("| {tag:#06x} "),
                (true, _) => "| ".to_owned(),
                (false, _) => String::new(),
            };
            let kind = if k == 0 { format!("`{}` | {side}", info.name) } else { " | ".to_owned() };
            let shapes = match key.shapes {
                [] => String::new(),
                shapes => format!("; {} only", shapes.join(", ")),
            };
            let (name, holds, unit, range, words) = (key.name, holds(key), unit(key), range(key), key.words);
            writeln!(text, "{tag}| {kind} | `{name}` | {holds} | {unit} | {range} | {words}{shapes} |")
                .expect("a string");
        }
    }
    text
}

fn holds(key: &KeyInfo) -> String {
    let form = match key.form {
        Form::Number => "a number".to_owned(),
        Form::List { most } => format!("a list of 1 to {most}"),
        Form::Choice(_) => "a choice".to_owned(),
    };
    if key.optional { form + ", optional" } else { form }
}

/// The sections of a model file.
fn sections() -> String {
    let mut text = String::new();
    for info in SECTIONS {
        writeln!(text, "## `[{}]`: {}\n", info.name, info.words).expect("a string");
        text += "| key | holds | unit | values | |\n|---|---|---|---|---|\n";
        for key in info.keys {
            let values = match key.form {
                Form::Choice(words) => words.join(", "),
                _ => range(key),
            };
            let (name, holds, unit, words) = (key.name, holds(key), unit(key), key.words);
            writeln!(text, "| `{name}` | {holds} | {unit} | {values} | {words} |").expect("a string");
        }
        writeln!(text).expect("a string");
    }
    text
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

fn example() -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/golden/block-1-masing.bin");
    let bytes = std::fs::read(path).expect("the golden block");
    let block = verify(&bytes).expect("a good block");
    let mut text = String::from("```\n");
    let mut line = |at: usize, length: usize, words: &str| {
        writeln!(text, "{at:>4}  {:<47}  {words}", hex(&bytes[at..at + length])).expect("a string");
    };
    let header = block.header();
    for (at, length, words) in [
        (0, 4, "magic".to_owned()),
        (4, 2, "format version".to_owned()),
        (6, 2, format!("length of the header: {HEADER_BYTES}")),
        (8, 4, format!("length of the block: {}", header.length)),
        (12, 4, format!("sequence number: {}", header.sequence)),
        (16, 16, format!("identity: {}", header.identity.label())),
        (32, 2, "scalar kind 1, single precision".to_owned()),
        (34, 2, format!("stack depth: {}", header.stack_depth)),
        (36, 4, format!("control period: {:?} s", header.period_s)),
        (40, 2, format!("records: {}", header.records)),
        (42, 2, "torque unit: N·m".to_owned()),
        (44, 4, "reserved".to_owned()),
    ] {
        line(at, length, &words);
    }
    let mut at = HEADER_BYTES;
    for record in block.records() {
        let info = RECORDS.into_iter().find(|info| info.tag == record.tag);
        let name = info.map_or("?", |info| info.name);
        line(at, 4, &format!("record {name}, {} bytes", record.payload.len()));
        at += 4;
        let values = info.and_then(|info| record.values(info, ScalarKind::F32).ok()).unwrap_or_default();
        if values.is_empty() {
            for part in record.payload.chunks(16) {
                line(at, part.len(), String::from_utf8_lossy(part).trim_end_matches('\0'));
                at += part.len();
            }
        }
        for (field, value) in values.iter() {
            let length = 4 * field.coding.words();
            let shown = match (field.coding, field.choices().get(*value as usize)) {
                (Coding::Choice, Some(word)) => format!("{} ({word})", field.key.name),
                _ if length == 4 => format!("{}: {:?}", field.key.name, *value as f32),
                _ => format!("{}: {value:?}", field.key.name),
            };
            line(at, length, format!("{shown} {}", unit(&field.key)).trim_end());
            at += length;
        }
    }
    line(at, 4, &format!("CRC-32: {:#010x}", block.crc()));
    assert_eq!(at + 4, bytes.len());
    text + "```\n"
}

#[test]
fn the_pages_say_what_the_library_does() {
    check("block.md", "records", &records());
    check("block.md", "terms", &terms(true));
    check("block.md", "example", &example());
    check("model-file.md", "sections", &sections());
    check("model-file.md", "kinds", &terms(false));
}

#[test]
fn the_page_lists_every_refusal() {
    let text = std::fs::read_to_string(page("block.md")).expect("the page");
    for code in 0x0101..=0x0111_u16 {
        let (begin, end) = (format!("| 0x{code:04X} | `GMHM_ERROR_"), format!("| 0x{:08X} |", sdo_abort(code)));
        assert!(text.lines().any(|line| line.starts_with(&begin) && line.ends_with(&end)), "code {code:#06x}");
    }
}

/// The page's rule for the words of a term, followed by hand.
#[test]
fn a_term_is_read_by_the_page_alone() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/golden/block-1-shapes.bin");
    let bytes = std::fs::read(path).expect("the golden block");
    let block = verify(&bytes).expect("a good block");
    let mut seen = 0;
    for record in block.records().filter(|record| (FIRST_TERM..0x8000).contains(&record.tag)) {
        let info = KINDS.iter().find(|info| tag_of_kind(info.name) == Some(record.tag - FIRST_TERM)).expect("a kind");
        let term = TermRecord::decode(&record).expect("a term").expect("a good one");
        let words: Vec<u32> = record.words().collect();
        let Form::Choice(shapes) = info.key("shape").expect("a shape").form else { panic!("a choice") };
        let shape = shapes[words[0] as usize];
        let mut expected = vec![f64::from(words[0])];
        let others = info.keys.iter().filter(|key| key.name != "shape" && key.belongs_to(Some(shape)));
        expected.extend(others.zip(&words[1..]).map(|(_, word)| f64::from(f32::from_bits(*word))));
        assert_eq!(expected.len(), words.len());
        let read = term.values().map(|(_, value)| match value {
            Value::Number(x) => f64::from(x),
            Value::Choice(number) => number as f64,
            _ => f64::NAN,
        });
        assert_eq!(read.collect::<Vec<_>>(), expected);
        seen += 1;
    }
    assert_eq!(seen, 8);
}
