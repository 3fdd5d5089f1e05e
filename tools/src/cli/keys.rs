//! Keys that are pressed while a program runs: one by one on a terminal, by lines from a pipe.

use std::io::{BufRead, IsTerminal, stdin, stdout};
use std::time::Duration;

use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};
use ratatui::crossterm::terminal;

/// Between two looks for a key, or for the foreground.
const EVERY: Duration = Duration::from_millis(200);

/// Where keys come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// A terminal with the program in its foreground.
    Terminal,
    /// A terminal whose foreground is another program's: reading from it would stop this one.
    Background,
    /// A pipe or a file: the first letter of each line.
    Lines,
}

impl Source {
    /// That of this process.
    pub fn now() -> Self {
        match (stdin().is_terminal(), in_foreground()) {
            (false, _) => Self::Lines,
            (true, true) => Self::Terminal,
            (true, false) => Self::Background,
        }
    }
}

#[cfg(unix)]
fn in_foreground() -> bool {
    // A terminal that says nothing of groups has no background.
    rustix::termios::tcgetpgrp(stdin()).map_or(true, |group| group == rustix::process::getpgrp())
}

#[cfg(not(unix))]
fn in_foreground() -> bool {
    true
}

/// Gives the terminal back as it was when this is dropped.
pub struct Restore;

impl Drop for Restore {
    fn drop(&mut self) {
        let _ = terminal::disable_raw_mode();
    }
}

/// Text as the terminal takes it: while keys come one by one, a line break needs a carriage return.
pub fn lines(text: String) -> String {
    match is_raw() && stdout().is_terminal() {
        true => text.replace('\n', "\r\n"),
        false => text,
    }
}

fn is_raw() -> bool {
    terminal::is_raw_mode_enabled().unwrap_or(false)
}

/// Hands keys on until `press` wants no more or the input ends; Ctrl-C is `None`. A program in the background waits for the foreground.
pub fn read(mut press: impl FnMut(Option<char>) -> bool) {
    if Source::now() == Source::Lines {
        for line in stdin().lock().lines().map_while(Result::ok) {
            if line.trim().chars().next().is_some_and(|key| !press(Some(key))) {
                return;
            }
        }
        return;
    }
    while !in_foreground() {
        std::thread::sleep(EVERY);
    }
    if terminal::enable_raw_mode().is_err() {
        return;
    }
    loop {
        match event::poll(EVERY) {
            Ok(false) => continue,
            Ok(true) => {}
            Err(_) => return,
        }
        let Ok(Event::Key(key)) = event::read() else { continue };
        let is_control = key.modifiers.contains(KeyModifiers::CONTROL);
        let goes_on = match key.code {
            _ if key.kind == KeyEventKind::Release => true,
            KeyCode::Char('c') if is_control => press(None),
            KeyCode::Char(key) if !is_control => press(Some(key)),
            _ => true,
        };
        if !goes_on {
            return;
        }
    }
}
