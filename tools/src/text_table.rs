//! Tables of text: columns that line up, without rules.

use comfy_table::{CellAlignment, Table, presets};

/// The head of a column.
#[derive(Debug, Clone, Copy)]
pub enum Head<'a> {
    /// Of words, on the left.
    Words(&'a str),
    /// Of numbers, on the right.
    Numbers(&'a str),
}

impl Head<'_> {
    fn name(&self) -> &str {
        match self {
            Head::Words(name) | Head::Numbers(name) => name,
        }
    }
}

/// Rows under their heads, indented, a line each with a line break behind; no line of heads where none has a name.
pub fn text_table<const N: usize>(heads: [Head<'_>; N], rows: impl IntoIterator<Item = [String; N]>) -> String {
    const INDENT: &str = "  ";
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    if heads.iter().any(|head| !head.name().is_empty()) {
        table.set_header(heads.iter().map(Head::name));
    }
    table.add_rows(rows);
    for (column, head) in table.column_iter_mut().zip(&heads) {
        column.set_padding((0, 2));
        column.set_cell_alignment(match head {
            Head::Words(_) => CellAlignment::Left,
            Head::Numbers(_) => CellAlignment::Right,
        });
    }
    table.lines().map(|line| format!("{INDENT}{}", line.trim_end()) + "\n").collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_stand_on_the_left_and_numbers_on_the_right() {
        let rows = [["c₁", "24 890 ± 57", "N·m/rad"], ["e", "−3·10⁻⁴", ""]].map(|row| row.map(str::to_owned));
        let shown = text_table([Head::Words(""), Head::Numbers("value"), Head::Words("unit")], rows.clone());
        assert_eq!(shown, "            value  unit\n  c₁  24 890 ± 57  N·m/rad\n  e       −3·10⁻⁴\n");
        let bare = text_table([Head::Words(""), Head::Numbers(""), Head::Words("")], rows);
        assert_eq!(bare, "  c₁  24 890 ± 57  N·m/rad\n  e       −3·10⁻⁴\n");
    }
}
