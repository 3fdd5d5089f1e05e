//! The table of a proof: counts and Wilson intervals, block by block, and the aims beside what was measured.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};

use serde::{Deserialize, Serialize};

use super::mix::BLOCKS;
use super::score::{CaseScore, KindRow, confusion};
use crate::text_table::Head::{Numbers, Words};
use crate::text_table::text_table;

/// A share with its 95 % Wilson interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Rate {
    /// How many of them.
    pub hits: usize,
    /// Of how many.
    pub of: usize,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Rate {
    /// `hits` of `of`; 0 to 1 where there are none.
    pub fn new(hits: usize, of: usize) -> Self {
        if of == 0 {
            return Self { hits, of, low: 0.0, high: 1.0 };
        }
        let (n, z) = (of as f64, 1.959_963_984_540_054_f64);
        let p = hits as f64 / n;
        let middle = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
        let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        Self { hits, of, low: (middle - half).max(0.0), high: (middle + half).min(1.0) }
    }

    /// The share itself; NaN of none.
    pub fn share(&self) -> f64 {
        self.hits as f64 / self.of as f64
    }
}

impl Display for Rate {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        if self.of == 0 {
            return f.pad("-");
        }
        let text = format!("{:.3} [{:.3} {:.3}] {}/{}", self.share(), self.low, self.high, self.hits, self.of);
        f.pad(&text)
    }
}

/// One block of the table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BlockRow {
    /// The block.
    pub block: String,
    /// Its cases.
    pub cases: usize,
    /// Cases without anything hidden in which a mismatch was seen.
    pub false_alarms: Rate,
    /// Cases with something visible in which a mismatch was seen.
    pub found: Rate,
    /// Cases named exactly.
    pub exact: Rate,
    /// Visible effects of the library whose kind is in a class found.
    pub class_hits: Rate,
    /// Plants other than the base model whose plant model was named.
    pub plant_named: Rate,
    /// Kinds in those classes over kinds in the theoretical ones.
    pub class_size_ratio: Option<f64>,
    /// Names that stand for nothing hidden.
    pub wrong_names: usize,
    /// Cases with such a name.
    pub misnamed: Rate,
    /// Visible effects located.
    pub located: Rate,
    /// 2·hits/(2·hits + wrong names + misses) over effects of the library.
    pub f1: Option<f64>,
    /// Share of the effects' power on unseen recordings explained, all cases pooled.
    pub explained: Option<f64>,
    /// Its median over cases.
    pub explained_median: Option<f64>,
    /// Error on unseen recordings over what the refitted base leaves there, median.
    pub error_ratio: Option<f64>,
    /// Cases that explain 90 % or more.
    pub explained_well: Rate,
    /// Error on unseen recordings, median, N·m.
    pub unseen_error_nm: Option<f64>,
    /// Parameters within two standard deviations.
    pub coverage: Rate,
    /// Half width of that interval over the true value, median.
    pub interval_width: Option<f64>,
    /// Effects that nobody could see: counted nowhere else.
    pub invisible: usize,
    /// Cases in which the detector or its prediction refused.
    pub failed: usize,
    /// Time of the detector, median, s.
    pub seconds: Option<f64>,
}

impl BlockRow {
    /// Sums up `scores` under a name.
    pub fn new<'a>(block: &str, scores: impl Iterator<Item = &'a CaseScore>) -> Self {
        let scores: Vec<&CaseScore> = scores.collect();
        let count = |test: &dyn Fn(&CaseScore) -> bool| scores.iter().filter(|s| test(s)).count();
        let sum = |value: &dyn Fn(&CaseScore) -> usize| scores.iter().map(|s| value(s)).sum::<usize>();
        let seen = count(&|s| !s.hidden.is_empty());
        let null = |s: &CaseScore| s.hidden.is_empty() && s.invisible.is_empty() && s.plant_named.is_none();
        let named = |s: &CaseScore| s.listed && !s.hidden.is_empty();
        let effects = sum(&|s| s.to_name);
        let hits = sum(&|s| s.class_hits);
        let wrong = sum(&|s| s.wrong_names.len());
        let sizes = |k: usize| sum(&|s| s.class_sizes.iter().map(|c| c[k]).sum());
        let explained: Vec<f64> = scores.iter().filter_map(|s| s.explained()).collect();
        let power = |value: &dyn Fn(&CaseScore) -> f64| -> f64 {
            scores.iter().filter(|s| s.explained().is_some()).map(|s| value(s).powi(2)).sum()
        };
        let parameters: Vec<_> = scores.iter().flat_map(|s| &s.parameters).collect();
        Self {
            block: block.to_owned(),
            cases: scores.len(),
            false_alarms: Rate::new(count(&|s| s.false_alarm), count(&null)),
            found: Rate::new(count(&|s| !s.hidden.is_empty() && s.mismatch), seen),
            exact: Rate::new(count(&|s| named(s) && s.exact), count(&named)),
            class_hits: Rate::new(hits, effects),
            plant_named: Rate::new(count(&|s| s.plant_named == Some(true)), count(&|s| s.plant_named.is_some())),
            class_size_ratio: (sizes(1) > 0).then(|| sizes(0) as f64 / sizes(1) as f64),
            wrong_names: wrong,
            misnamed: Rate::new(count(&|s| !s.wrong_names.is_empty()), scores.len()),
            located: Rate::new(sum(&|s| s.location_hits), sum(&|s| s.hidden.len())),
            f1: (effects > 0).then(|| 2.0 * hits as f64 / (hits + wrong + effects) as f64),
            explained: (!explained.is_empty()).then(|| {
                1.0 - power(&|s| s.unseen_error_nm.unwrap_or(s.base_leaves_nm)) / power(&|s| s.base_leaves_nm)
            }),
            explained_well: Rate::new(explained.iter().filter(|x| **x >= 0.9).count(), explained.len()),
            error_ratio: median(explained.iter().map(|x| (1.0 - x).max(0.0).sqrt()).collect()),
            explained_median: median(explained),
            unseen_error_nm: median(scores.iter().filter_map(|s| s.unseen_error_nm).collect()),
            coverage: Rate::new(parameters.iter().filter(|p| p.covered()).count(), parameters.len()),
            interval_width: median(parameters.iter().map(|p| p.relative_width()).collect()),
            invisible: sum(&|s| s.invisible.len()),
            failed: count(&|s| s.failed.is_some()),
            seconds: median(scores.iter().map(|s| s.seconds).collect()),
        }
    }
}

/// One aim beside what was measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Aim {
    /// What is aimed at, such as `false alarms <= 0.02`.
    pub aim: String,
    /// What was measured; nothing where no case speaks of it.
    pub measured: Option<f64>,
    /// How often, of how many, and of what: `1 of 200 nulls`; or only how many.
    pub counts: String,
    /// Met or not; nothing where no case speaks of it, or too few do.
    pub met: Option<bool>,
}

/// Fewer of them than this say nothing of a share.
pub const ENOUGH: usize = 20;

/// The verdict on a share of `things`, with its counts: `met, 1 of 200 nulls`, or `0 of 2 nulls: too few to tell`.
pub fn judged(things: &str, rate: Rate, bound: f64, at_least: bool) -> String {
    let aim = Aim::share("", things, Some(rate), bound, at_least);
    aim.verdict()
}

impl Aim {
    /// An aim at a share of `things`.
    fn share(aim: &str, things: &str, rate: Option<Rate>, bound: f64, at_least: bool) -> Self {
        let rate = rate.filter(|r| r.of > 0);
        let counts = rate.map_or(String::new(), |r| format!("{} of {} {things}", r.hits, r.of));
        Self::new(aim, rate.map(|r| r.share()), counts, rate.map_or(0, |r| r.of), bound, at_least)
    }

    /// An aim at a number that `of` things tell.
    fn number(aim: &str, things: &str, measured: Option<f64>, of: usize, bound: f64, at_least: bool) -> Self {
        Self::new(aim, measured, format!("{of} {things}"), of, bound, at_least)
    }

    fn new(aim: &str, measured: Option<f64>, counts: String, of: usize, bound: f64, at_least: bool) -> Self {
        let met = |m: f64| if at_least { m >= bound } else { m <= bound };
        Self {
            aim: format!("{aim} {} {bound}", if at_least { ">=" } else { "<=" }),
            counts,
            met: measured.filter(|_| of >= ENOUGH).map(met),
            measured,
        }
    }

    /// The verdict in words, with its counts.
    pub fn verdict(&self) -> String {
        match (self.met, self.measured) {
            (Some(true), _) => format!("met, {}", self.counts),
            (Some(false), _) => format!("NOT met, {}", self.counts),
            (None, Some(_)) => format!("{}: too few to tell", self.counts),
            (None, None) => "no case".to_owned(),
        }
    }
}

/// The whole proof.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ProveReport {
    /// The seed that repeats it.
    pub seed: u64,
    /// SHA-256 of the hashes of all keys, fixed before the first diagnosis.
    pub keys_sha256: String,
    /// What was left out, and why.
    pub notes: Vec<String>,
    /// The table.
    pub blocks: Vec<BlockRow>,
    /// The aims.
    pub aims: Vec<Aim>,
    /// What was said of each kind hidden alone.
    pub confusion: BTreeMap<String, KindRow>,
    /// Every case.
    pub cases: Vec<CaseScore>,
}

impl ProveReport {
    /// Sums up `scores`.
    pub fn new(seed: u64, keys_sha256: String, scores: Vec<CaseScore>) -> Self {
        let blocks: Vec<BlockRow> = BLOCKS
            .iter()
            .map(|block| BlockRow::new(block, scores.iter().filter(|s| s.block == *block)))
            .filter(|row| row.cases > 0)
            .collect();
        let all = BlockRow::new("all", scores.iter());
        let aims = aims(&blocks, &all);
        let blocks = blocks.into_iter().chain([all]).collect();
        Self { seed, keys_sha256, notes: Vec::new(), blocks, aims, confusion: confusion(&scores), cases: scores }
    }

    /// Notes that so many cases were left out for want of real noise; nothing where there was none.
    pub fn note_left_out(&mut self, cases: usize) {
        if cases > 0 {
            self.notes.push(format!("{cases} cases of block real noise left out: no real recordings at hand"));
        }
    }
}

fn aims(blocks: &[BlockRow], all: &BlockRow) -> Vec<Aim> {
    let row = |name: &str| blocks.iter().find(|b| b.block == name);
    let (clear, faint, pair, open) = (row("single 0.15"), row("single 0.05"), row("pair"), row("open world"));
    let (left_out, maxwell, simulation, loud) = (row("left out"), row("maxwell slip"), row("simulation"), row("loud"));
    let one_of_two = row("pair left out");
    let share = Aim::share;
    let number =
        |aim: &str, block: Option<&BlockRow>, of: &dyn Fn(&BlockRow) -> Option<f64>, bound: f64, least: bool| {
            Aim::number(aim, "cases", block.and_then(of), block.map_or(0, |b| b.cases), bound, least)
        };
    let wrong = |b: &BlockRow| Some(b.wrong_names as f64 / b.cases as f64);
    let coverage = (all.coverage.of > 0).then(|| all.coverage.share());
    let explained = "power explained on unseen recordings";
    let mut aims = vec![
        share("false alarms on coloured nulls", "nulls", row("null").map(|b| b.false_alarms), 0.02, false),
        share("class hits at 0.15 N·m", "effects", clear.map(|b| b.class_hits), 0.97, true),
        number("class size over theory at 0.15 N·m", clear, &|b| b.class_size_ratio, 1.2, false),
        share("class hits at 0.05 N·m", "effects", faint.map(|b| b.class_hits), 0.95, true),
        number("wrong names a case at 0.15 N·m", clear, &wrong, 0.1, false),
        number("wrong names a case at 0.05 N·m", faint, &wrong, 0.1, false),
        number("F1 of two effects at once", pair, &|b| b.f1, 0.95, true),
        share("misnamed in the open world", "cases", open.map(|b| b.misnamed), 0.05, false),
        share("found in the open world", "cases", open.map(|b| b.found), 0.95, true),
        share("misnamed with the kind left out", "cases", left_out.map(|b| b.misnamed), 0.1, false),
        share("misnamed with one of two kinds left out", "cases", one_of_two.map(|b| b.misnamed), 0.2, false),
        share("the other kind named", "effects", one_of_two.map(|b| b.class_hits), 0.8, true),
        number(&format!("{explained} at 0.15 N·m, median"), clear, &|b| b.explained_median, 0.9, true),
        number(&format!("{explained} at 0.15 N·m, pooled"), clear, &|b| b.explained, 0.9, true),
        share("maxwell slip: effects named at 0.15 N·m", "effects", maxwell.map(|b| b.class_hits), 0.8, true),
        share("maxwell slip: plant model named", "cases", maxwell.map(|b| b.plant_named), 0.9, true),
        number(
            "maxwell slip: error on unseen over the refitted base's, median",
            maxwell,
            &|b| b.error_ratio,
            0.1,
            false,
        ),
        share("simulation: effects of 8 % and more named", "effects", simulation.map(|b| b.class_hits), 0.95, true),
        number("simulation: wrong names a case", simulation, &wrong, 0.05, false),
        number("simulation: explained on another motion, median", simulation, &|b| b.explained_median, 0.985, true),
        share("loud: class hits", "effects", loud.map(|b| b.class_hits), 0.9, true),
        share("loud: plant model named", "cases", loud.map(|b| b.plant_named), 0.9, true),
        share("loud: false alarms on nulls", "nulls", loud.map(|b| b.false_alarms), 0.02, false),
    ];
    aims.push(Aim {
        aim: "2-deviation intervals cover 0.93 to 0.98".to_owned(),
        measured: coverage,
        counts: format!("{} of {} intervals", all.coverage.hits, all.coverage.of),
        met: coverage.filter(|_| all.coverage.of >= ENOUGH).map(|c| (0.93..=0.98).contains(&c)),
    });
    aims
}

/// The median; nothing of nothing.
pub(super) fn median(mut x: Vec<f64>) -> Option<f64> {
    x.sort_by(f64::total_cmp);
    match x.len() {
        0 => None,
        n => Some(0.5 * (x[(n - 1) / 2] + x[n / 2])),
    }
}

impl Display for ProveReport {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        // A diverging prediction is written by its order of magnitude.
        let digits = |x: f64| if x.abs() < 1e4 { format!("{x:.3}") } else { format!("{x:.0e}") };
        let number = |x: Option<f64>| x.map_or("-".to_owned(), digits);
        writeln!(
            f,
            "concealed-physics proof, seed {}: {} cases (synthetic unless named real)",
            self.seed,
            self.cases.len()
        )?;
        writeln!(f, "keys fixed before the first diagnosis, SHA-256 of their hashes {}", self.keys_sha256)?;
        writeln!(
            f,
            "shares with 95 % Wilson intervals; effects that nobody could see in their noise are counted apart\n"
        )?;
        for b in &self.blocks {
            writeln!(f, "{} ({} cases, {} s each)", b.block, b.cases, number(b.seconds))?;
            let wrong = format!("{} ({:.3} a case)", b.wrong_names, b.wrong_names as f64 / b.cases as f64);
            let lines = [
                ("false alarms", b.false_alarms.to_string()),
                ("mismatch seen", b.found.to_string()),
                ("named exactly", b.exact.to_string()),
                ("class hits", b.class_hits.to_string()),
                ("plant model named", b.plant_named.to_string()),
                ("class size over theory", number(b.class_size_ratio)),
                ("wrong names", wrong),
                ("cases misnamed", b.misnamed.to_string()),
                ("located", b.located.to_string()),
                ("F1", number(b.f1)),
                ("power explained, pooled", number(b.explained)),
                ("power explained, median", number(b.explained_median)),
                ("explained 0.9 or more", b.explained_well.to_string()),
                ("error on unseen, N·m", b.unseen_error_nm.map_or("-".to_owned(), |x| format!("{x:.4}"))),
                ("intervals that cover", b.coverage.to_string()),
                ("interval half width", number(b.interval_width)),
                ("invisible to anybody", b.invisible.to_string()),
                ("refused", b.failed.to_string()),
            ];
            let said = lines.into_iter().filter(|(_, value)| value != "-" && value != "0");
            f.write_str(&text_table([Words(""), Words("")], said.map(|(name, value)| [name.to_owned(), value])))?;
        }
        let rows = self.confusion.iter().map(|(kind, row)| {
            let mut names: Vec<_> = row.names.iter().collect();
            names.sort_by_key(|(name, count)| (std::cmp::Reverse(**count), *name));
            let listed: Vec<String> = names
                .iter()
                .map(|(name, count)| format!("{} {count}", if name.is_empty() { "nothing" } else { name }))
                .collect();
            [kind.clone(), row.named.to_string(), row.in_class.to_string(), listed.join(", ")]
        });
        writeln!(f, "\nhidden alone: that name given, in a class found, and every name given")?;
        f.write_str(&text_table([""; 4].map(Words), rows))?;
        let rows = self.aims.iter().map(|aim| [aim.aim.clone(), number(aim.measured), aim.verdict()]);
        writeln!(f, "\naims")?;
        f.write_str(&text_table([Words(""), Numbers(""), Words("")], rows))?;
        self.notes.iter().try_for_each(|note| writeln!(f, "note: {note}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_state_their_counts_and_say_where_they_are_too_few() {
        let verdict = |hits, of| judged("nulls", Rate::new(hits, of), 0.02, false);
        assert_eq!(verdict(0, 2), "0 of 2 nulls: too few to tell");
        assert_eq!(verdict(1, 200), "met, 1 of 200 nulls");
        assert_eq!(verdict(20, 200), "NOT met, 20 of 200 nulls");
        assert_eq!(verdict(0, 0), "no case");
    }

    #[test]
    fn wilson_intervals_are_those_of_the_book() {
        // Newcombe 1998, table I: 81 of 263 and 0 of 20.
        let rate = Rate::new(81, 263);
        assert!((rate.low - 0.2553).abs() < 1e-4 && (rate.high - 0.3662).abs() < 1e-4, "{rate}");
        let rate = Rate::new(0, 20);
        assert!(rate.low == 0.0 && (rate.high - 0.1611).abs() < 1e-4, "{rate}");
    }
}
