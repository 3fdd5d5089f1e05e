//! What a sample of each model costs on a drive, as `cargo xtask cost` counted it.

/// The table that `cargo xtask cost --overwrite` writes.
const TABLE: &str = include_str!("cost.md");

/// Instructions a sample of a model of the comparison.
pub fn instructions(model: &str) -> Option<u32> {
    let wanted = match model.strip_prefix("GMHM ") {
        // The cheaper of the two that are counted.
        None if model == "closed form of the paper" => format!("{model}, tuned sine, exponential and arcsine"),
        None => model.to_owned(),
        Some(structure) if structure.starts_with("masing") => "law `masing`, away from a reversal".to_owned(),
        Some(structure) if structure.starts_with("phase") => "law `phase`, away from a reversal".to_owned(),
        // The dearer of the two that are counted.
        Some(_) => "law `time`, kernel `deflection`, gate `cycle`".to_owned(),
    };
    TABLE.lines().find_map(|line| {
        let (name, figures) = line.strip_prefix("| ")?.split_once(" | ")?;
        if name == wanted { figures.split(" | ").next()?.parse().ok() } else { None }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_model_of_the_comparison_is_in_the_table() {
        let baselines = crate::baselines::all(1e-3);
        let own = ["masing", "masing+play", "phase/rate/cycle", "time/rate/none"].map(|s| format!("GMHM {s}"));
        for name in baselines.iter().map(|r| &r.name).chain(&own) {
            assert!(instructions(name).is_some_and(|count| count > 0), "{name} is not in docs/cost.md");
        }
        assert_eq!(instructions("another"), None);
    }
}
