//! The public types of the core: plain ones are logged by defmt and written by serde behind features; errors and statuses may grow.

use std::path::Path;

use anyhow::{Result, bail};

/// Public types with public fields that are no plain data: parts with states of their own in them, kinds that are not exported, and a secret.
const NOT_PLAIN: [&str; 15] = [
    "Angle",
    "AnyLaw",
    "AnyMemory",
    "Compensated",
    "CompensatedFeedForward",
    "CompensatedFeedForwardPast",
    "CompensatedInverse",
    "CompensatedPast",
    "Key",
    "Knee",
    "Parameters",
    "Prepared",
    "SoftWindup",
    "StiffnessAsymmetry",
    "View",
];

/// How the name of what may grow ends, and a kind of term whose name does, too.
const MAY_GROW: [&str; 4] = ["Error", "Fault", "Refusal", "Status"];
const NO_ERROR: &str = "KinematicError";

/// Fails where a public type of the core lacks what all others have.
pub(super) fn check(src: &Path) -> Result<()> {
    let mut wanting = Vec::new();
    let mut folders = vec![src.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder)? {
            let path = entry?.path();
            if path.is_dir() && !path.ends_with("bin") {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = std::fs::read_to_string(&path)?;
                wanting.extend(of_file(&text).into_iter().map(|what| format!("{}: {what}", path.display())));
            }
        }
    }
    if !wanting.is_empty() {
        bail!("public types of the core lack attributes that all others have:\n  {}", wanting.join("\n  "));
    }
    Ok(())
}

/// What the public types of a file lack.
fn of_file(text: &str) -> Vec<String> {
    let lines: Vec<&str> = text.lines().collect();
    let mut wanting = Vec::new();
    for (number, line) in lines.iter().enumerate() {
        let Some(declared) = line.strip_prefix("pub struct ").or_else(|| line.strip_prefix("pub enum ")) else {
            continue;
        };
        let name = declared.split(|c: char| !c.is_alphanumeric()).next().unwrap_or_default();
        let is_above = |line: &&&str| line.starts_with("#[") || line.starts_with("///");
        let above: String = lines[..number].iter().rev().take_while(is_above).copied().collect();
        let is_plain = line.starts_with("pub enum") || has_public_fields(line, &lines[number + 1..]);
        if is_plain && !NOT_PLAIN.contains(&name) {
            // An error with a number that has no name is logged by code of its own.
            let logs = above.contains("defmt::Format") || text.contains(&format!("impl defmt::Format for {name} "));
            for (has, attribute) in [(logs, "defmt::Format"), (above.contains("serde::Serialize"), "serde::Serialize")]
            {
                if !has {
                    wanting.push(format!("{name} has no {attribute}"));
                }
            }
        }
        if MAY_GROW.iter().any(|end| name.ends_with(end)) && name != NO_ERROR && !above.contains("#[non_exhaustive]") {
            wanting.push(format!("{name} is not #[non_exhaustive]"));
        }
    }
    wanting
}

/// Whether a struct has fields, all of them public.
fn has_public_fields(declaration: &str, after: &[&str]) -> bool {
    if let Some((_, fields)) = declaration.trim_end_matches(");").split_once('(') {
        return fields.split(", ").all(|field| field.starts_with("pub "));
    }
    // What a line of deeper indentation says belongs to the field above it.
    let is_field = |line: &&&str| line.strip_prefix("    ").is_some_and(|field| !field.starts_with([' ', '/', '#']));
    let mut fields = after.iter().take_while(|line| **line != "}").filter(is_field).peekable();
    fields.peek().is_some() && fields.all(|line| line.starts_with("    pub "))
}

#[cfg(test)]
mod tests {
    use super::of_file;

    #[test]
    fn what_a_type_lacks_is_found() {
        let attributes = "#[cfg_attr(all(feature = \"defmt\", target_os = \"none\"), derive(defmt::Format))]\n\
            #[cfg_attr(feature = \"serde\", derive(serde::Serialize))]\n";
        let plain = "pub struct Plain<S> {\n    /// Words.\n    pub number: S,\n}\n";
        assert_eq!(of_file(plain), ["Plain has no defmt::Format", "Plain has no serde::Serialize"]);
        assert!(of_file(&(attributes.to_owned() + plain)).is_empty());
        assert!(of_file("pub struct State {\n    pub number: u8,\n    past: u8,\n}\n").is_empty());
        assert!(of_file("pub struct State(u8);\npub struct Other(pub u8, u8);\n").is_empty());
        assert_eq!(of_file("pub struct Word(pub u8);\n").len(), 2);
        let fault = attributes.to_owned() + "pub enum LoopFault {\n    Late,\n}\n";
        assert_eq!(of_file(&fault), ["LoopFault is not #[non_exhaustive]"]);
    }
}
