//! A page for people: one self-contained HTML file. Its script, `templates/page.js`, makes the figures zoom and show values; nothing comes from elsewhere.
//!
//! Verdict first, then sections of text, figures, tables and notes, and at the end what made the page. Light and dark by the
//! viewer's preference, light on paper.

use askama::Template;

use super::plot::{self, Drawing};
use crate::fit::verdict::Grade;

/// A page.
#[derive(Debug, Clone)]
pub struct Page {
    /// Title.
    pub title: String,
    /// What it comes to.
    pub verdict: Verdict,
    /// Sections in order.
    pub sections: Vec<Section>,
    /// What made it.
    pub provenance: Provenance,
}

/// One sentence, and the reasons.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// The grade, by which it is coloured.
    pub grade: Grade,
    /// The sentence.
    pub sentence: String,
    /// Why, a sentence each.
    pub reasons: Vec<String>,
}

/// A section.
#[derive(Debug, Clone)]
pub struct Section {
    /// Heading.
    pub heading: String,
    /// What it holds, in order.
    pub blocks: Vec<Block>,
}

impl Section {
    /// A section without anything in it.
    pub fn new(heading: impl Into<String>) -> Self {
        Self { heading: heading.into(), blocks: Vec::new() }
    }

    /// With a paragraph more.
    #[must_use]
    pub fn text(mut self, text: impl Into<String>) -> Self {
        self.blocks.push(Block::Text(text.into()));
        self
    }

    /// With a figure more, and what to see in it.
    #[must_use]
    pub fn figure(mut self, drawing: Drawing, caption: impl Into<String>) -> Self {
        self.blocks.push(Block::Figures(vec![Captioned { drawing, caption: caption.into() }]));
        self
    }

    /// With figures side by side more, each with its caption.
    #[must_use]
    pub fn figures(mut self, figures: impl IntoIterator<Item = (Drawing, String)>) -> Self {
        let figures = figures.into_iter().map(|(drawing, caption)| Captioned { drawing, caption }).collect();
        self.blocks.push(Block::Figures(figures));
        self
    }

    /// With a table more.
    #[must_use]
    pub fn table(mut self, table: Table) -> Self {
        self.blocks.push(Block::Table(table));
        self
    }

    /// With a list of remarks more; none where there are none.
    #[must_use]
    pub fn notes(mut self, notes: impl IntoIterator<Item = String>) -> Self {
        let notes: Vec<String> = notes.into_iter().collect();
        if !notes.is_empty() {
            self.blocks.push(Block::Notes(notes));
        }
        self
    }
}

/// A part of a section.
#[derive(Debug, Clone)]
pub enum Block {
    /// A paragraph.
    Text(String),
    /// One figure, or several side by side where there is room.
    Figures(Vec<Captioned>),
    /// A table.
    Table(Table),
    /// A list of remarks.
    Notes(Vec<String>),
}

/// A figure and what to see in it.
#[derive(Debug, Clone)]
pub struct Captioned {
    /// The figure.
    pub drawing: Drawing,
    /// The caption.
    pub caption: String,
}

/// A table.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// Heads of the columns, with units.
    pub head: Vec<String>,
    /// Rows.
    pub rows: Vec<TableRow>,
}

/// A row of a table.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TableRow {
    /// Cells; numbers are set to the right.
    pub cells: Vec<String>,
    /// Whether it stands out: the chosen one.
    pub chosen: bool,
    /// Whether it needs a look: flagged.
    pub flagged: bool,
}

impl TableRow {
    /// A row of cells.
    pub fn new(cells: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self { cells: cells.into_iter().map(Into::into).collect(), ..Self::default() }
    }

    /// One that stands out, or not.
    #[must_use]
    pub fn chosen(mut self, chosen: bool) -> Self {
        self.chosen = chosen;
        self
    }

    /// One that needs a look, or not.
    #[must_use]
    pub fn flagged(mut self, flagged: bool) -> Self {
        self.flagged = flagged;
        self
    }
}

/// Letters of a cell that is not broken.
const SHORT: usize = 24;
/// Rows of a table that a page shows at most.
const MOST_ROWS: usize = 200;

impl Table {
    /// A table of rows below their heads; the caption may be empty.
    pub fn of(
        caption: impl Into<String>,
        head: impl IntoIterator<Item = impl Into<String>>,
        rows: impl IntoIterator<Item = TableRow>,
    ) -> Self {
        let head = head.into_iter().map(Into::into).collect();
        Self { caption: caption.into(), head, rows: rows.into_iter().collect() }
    }

    fn shown(&self) -> &[TableRow] {
        &self.rows[..self.rows.len().min(MOST_ROWS)]
    }

    /// Numbers are set to the right, names and units to the left.
    fn class(&self, column: &usize, cell: &str) -> &'static str {
        let named = *column == 0 || self.head.get(*column).is_some_and(|head| head.ends_with("unit"));
        match cell.chars().count() {
            _ if !named && is_number(cell) => "number",
            // A word or two stay on a line.
            ..=SHORT => "short",
            _ => "",
        }
    }

    /// A head stands over its numbers.
    fn head_class(&self, column: &usize) -> &'static str {
        let cells = || self.shown().iter().filter_map(|row| row.cells.get(*column)).filter(|cell| !cell.is_empty());
        let numbers = cells().next().is_some() && cells().all(|cell| self.class(column, cell) == "number");
        if numbers { "number" } else { "" }
    }

    fn left_out(&self) -> usize {
        self.rows.len() - self.shown().len()
    }
}

impl TableRow {
    fn class(&self) -> &'static str {
        match (self.chosen, self.flagged) {
            (_, true) => "flagged",
            (true, false) => "chosen",
            _ => "",
        }
    }
}

/// What made a page.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Provenance {
    /// The command line.
    pub command: String,
    /// What it read.
    pub inputs: Vec<Input>,
    /// The seed of every random choice.
    pub seed: Option<u64>,
}

/// A file that was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// Its name.
    pub name: String,
    /// SHA-256 of its bytes in hexadecimal.
    pub sha256: String,
    /// Rows, where it is a recording.
    pub rows: Option<usize>,
}

impl From<&crate::recording::Recording> for Input {
    fn from(recording: &crate::recording::Recording) -> Self {
        Self { name: recording.name.clone(), sha256: recording.sha256.clone(), rows: Some(recording.len()) }
    }
}

impl Input {
    /// A file that is no recording.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn of_file(path: &std::path::Path) -> std::io::Result<Self> {
        use sha2::Digest;
        let sha256 = hex::encode(sha2::Sha256::digest(std::fs::read(path)?));
        Ok(Self { name: path.display().to_string(), sha256, rows: None })
    }
}

impl Page {
    /// The page as HTML: at most 1 MB for up to a dozen figures, whatever the length of the recordings.
    pub fn to_html(&self) -> String {
        let whole = Whole {
            page: self,
            figure_style: plot::style(),
            script: include_str!("../../templates/page.js"),
            version: env!("CARGO_PKG_VERSION"),
        };
        // Writing to a string does not fail.
        whole.render().unwrap_or_default()
    }
}

#[derive(Template)]
#[template(path = "page.html")]
struct Whole<'p> {
    page: &'p Page,
    figure_style: String,
    script: &'static str,
    version: &'static str,
}

impl Whole<'_> {
    /// Class and mark of the verdict.
    fn grade(&self) -> (&'static str, &'static str) {
        match self.page.verdict.grade {
            Grade::Good => ("good", "✓"),
            Grade::Caution => ("caution", "!"),
            Grade::Bad => ("bad", "✕"),
        }
    }
}

/// Whether a cell holds numbers and no words.
fn is_number(cell: &str) -> bool {
    cell == "–"
        || cell.contains(|c: char| c.is_ascii_digit()) && !cell.contains(|c: char| c.is_alphabetic() || c == '/')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_set_to_the_right() {
        assert!(is_number("−1.2") && is_number("± 3") && !is_number("c1") && !is_number("1/s"));
    }
}
