//! `gmhm columns`.

use clap::Args;

use super::Session;
use super::common::{ReadingArgs, RecordingArgs};
use super::failure::Failure;
use super::progress::Progress;
use crate::number::number;
use crate::recording::{Needs, Survey, SurveyedColumn};
use crate::text_table::{Head, text_table};

/// Show what is in recordings: format, columns, units, rows, rate, ranges, gaps
///
/// Shows how each column is recognised, and suggests a --map for missing columns that a fit requires. Ranges are in SI units.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  gmhm columns bench.mf4 run.mcap log.mat")]
pub struct ColumnsArgs {
    #[command(flatten)]
    files: RecordingArgs,
    #[command(flatten)]
    reading: ReadingArgs,
}

impl ColumnsArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        for (at, file) in self.files.files()?.iter().enumerate() {
            let bytes = file.path.metadata().map_or(0, |m| m.len());
            let progress = Progress::new(&format!("Reading {}", file.name), bytes, session.quiet);
            let survey = Survey::of(file, &self.reading.reading(&Needs::FIT), &|done| progress.at(done))?;
            drop(progress);
            let gap = if at > 0 { "\n" } else { "" };
            session.say(format_args!("{gap}{}", text(&survey)))?;
        }
        Ok(())
    }
}

fn text(survey: &Survey) -> String {
    let mut lines = vec![format!("{}: {}", survey.file, survey.format.name())];
    if let Some(line) = survey.header_line.filter(|line| *line > 1) {
        lines[0] += &format!(", header in line {line}");
    }
    if let Some(rows) = survey.rows {
        lines[0] += &format!(", {rows} rows");
    }
    if let Some(timing) = &survey.timing {
        let [first, last, rate] = [timing.first_s, timing.last_s, timing.rate_hz].map(|x| number(x, 6));
        lines[0] += &format!(", {first} to {last} s, {rate} Hz");
        if timing.gaps > 0 {
            let (step, at) = timing.longest;
            let [step, at] = [step, at].map(|x| number(x, 4));
            lines.push(match timing.gaps {
                1 => format!("  1 gap in time, {step} s at {at} s"),
                gaps => format!("  {gaps} gaps in time, the longest {step} s at {at} s"),
            });
        }
        if timing.backward > 0 {
            let rows = if timing.backward == 1 { "row" } else { "rows" };
            lines.push(format!("  time does not increase at {} {rows}", timing.backward));
        }
    }
    let heads = ["column", "unit", "recognised as", "range", ""].map(Head::Words);
    lines.push(text_table(heads, survey.columns.iter().map(row)).trim_end().to_owned());
    if let Some(lacks) = &survey.lacks {
        let column = lacks.column.as_ref().map(|column| format!("column {} `{}`: ", column.number, column.name));
        lines.push(format!("To fit a gear: {}{}", column.unwrap_or_default(), lacks.problem));
        lines.extend(lacks.fix().map(|fix| format!("  {fix}")));
    }
    lines.join("\n") + "\n"
}

fn row(column: &SurveyedColumn) -> [String; 5] {
    let range = column.range.map_or(String::new(), |(low, high)| format!("{} to {}", number(low, 5), number(high, 5)));
    let bad = match column.not_finite {
        0 => String::new(),
        1 => "1 row without a number".to_owned(),
        rows => format!("{rows} rows without a number"),
    };
    let (unit, is) = (column.unit.as_deref().unwrap_or("-"), column.quantity.map_or("-".to_owned(), |q| q.si_name()));
    [column.name.clone(), unit.to_owned(), is, range, bad]
}
