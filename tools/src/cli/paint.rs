//! Colour, where a terminal shows it.

use std::io::IsTerminal;

use ratatui::crossterm::style::{Color, Stylize};

/// A text in bold and a colour on a terminal, unless `NO_COLOR` is set; elsewhere as it is.
pub fn on(stream: &impl IsTerminal, text: &str, colour: Color) -> String {
    let plain = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    match stream.is_terminal() && !plain {
        true => text.with(colour).bold().to_string(),
        false => text.to_owned(),
    }
}
