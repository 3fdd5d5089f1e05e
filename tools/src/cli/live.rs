//! The screen of `gmhm drive live`: what a drive measures, a running plot, and keys that change what is in force.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use gmhm::diagnostics::Diagnostics;
use gmhm::link::{Identified, Live, Origin, Request, Status};
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyModifiers};
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style, Stylize};
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType, LegendPosition, Paragraph};
use ratatui::{DefaultTerminal, Frame};

use super::drive_state::{Counters, flags};
use super::failure::Failure;
use crate::device::{Client, DeviceError, Target, trial};
use crate::number::number;

/// Between two questions to the drive.
const EVERY: Duration = Duration::from_millis(50);
/// Questions between two of its status and its counters.
const STATUS_EVERY: u32 = 10;
/// What the plot shows, s.
const WINDOW_S: f64 = 20.0;
/// A press of + or − changes the gain by this.
const GAIN_STEP: f32 = 0.1;

const KEYS: &str = "o on/off   + − gain   t try   r revert   c clear counters   q quit";

/// A drive on a screen.
pub(super) struct Screen<'d> {
    drive: &'d mut Client,
    to: &'d Target,
    /// The block that is tried.
    block: Option<Vec<u8>>,
    identified: Identified,
    status: Status,
    live: Live,
    diagnostics: Diagnostics,
    began: Instant,
    /// Time, torque, hysteresis torque and contribution.
    history: VecDeque<(f64, [f64; 3])>,
    message: String,
}

impl<'d> Screen<'d> {
    /// A screen of a drive; `block` is what the key t tries.
    ///
    /// # Errors
    /// [`DeviceError`]: the drive does not answer.
    pub fn new(drive: &'d mut Client, to: &'d Target, block: Option<Vec<u8>>) -> Result<Self, DeviceError> {
        let (identified, status) = (drive.identify()?, drive.status()?);
        let (live, diagnostics) = (drive.live()?, drive.diagnostics()?.joint);
        let (began, history) = (Instant::now(), VecDeque::new());
        Ok(Self { drive, to, block, identified, status, live, diagnostics, began, history, message: String::new() })
    }

    /// Shows the drive until a key ends it.
    ///
    /// # Errors
    /// The terminal, or the line to the drive, fails.
    pub fn run(mut self) -> Result<(), Failure> {
        let mut terminal = ratatui::try_init()?;
        let done = self.work(&mut terminal);
        ratatui::restore();
        done
    }

    fn work(&mut self, terminal: &mut DefaultTerminal) -> Result<(), Failure> {
        for turn in 0_u32.. {
            self.measure(turn)?;
            terminal.draw(|frame| self.draw(frame))?;
            let next = Instant::now() + EVERY;
            while event::poll(next.saturating_duration_since(Instant::now()))? {
                let Event::Key(key) = event::read()? else { continue };
                let control = key.modifiers.contains(KeyModifiers::CONTROL);
                match key.code {
                    KeyCode::Char('q') | KeyCode::Esc => return Ok(()),
                    KeyCode::Char('c') if control => return Ok(()),
                    _ => self.press(key)?,
                }
                terminal.draw(|frame| self.draw(frame))?;
            }
        }
        Ok(())
    }

    fn measure(&mut self, turn: u32) -> Result<(), DeviceError> {
        self.live = self.drive.live()?;
        if turn.is_multiple_of(STATUS_EVERY) {
            self.status = self.drive.status()?;
            self.diagnostics = self.drive.diagnostics()?.joint;
        }
        let time = self.began.elapsed().as_secs_f64();
        let Live { torque_nm, hysteresis_nm, contribution_nm, .. } = self.live;
        self.history.push_back((time, [torque_nm, hysteresis_nm, contribution_nm].map(f64::from)));
        while self.history.front().is_some_and(|(first, _)| *first < time - WINDOW_S) {
            self.history.pop_front();
        }
        Ok(())
    }

    /// What a key does. A refusal of the drive is shown, a line that broke ends the screen.
    fn press(&mut self, key: KeyEvent) -> Result<(), DeviceError> {
        let gain = |step: f32| Request::Gain { ratio: (self.status.gain_ratio + step).clamp(0.0, 1.0) };
        let done = match key.code {
            KeyCode::Char('o') => {
                let on = !self.status.compensating;
                self.drive.tell(&Request::Compensate { on }).map(|()| format!("compensation {}", switch(on)))
            }
            KeyCode::Char('+' | '=') => self.drive.tell(&gain(GAIN_STEP)).map(|()| "gain raised".to_owned()),
            KeyCode::Char('-') => self.drive.tell(&gain(-GAIN_STEP)).map(|()| "gain lowered".to_owned()),
            KeyCode::Char('t') => match &self.block {
                Some(block) => trial::try_out(block, self.drive, |_, _| {}).map(|tried| {
                    format!("on trial: CRC-32 {:#010x}; r reverts, gmhm drive commit stores it", tried.crc)
                }),
                None => Ok("no block to try: start with --block params.bin".to_owned()),
            },
            KeyCode::Char('r') => self.drive.change(&Request::Revert).map(|()| "trial ended".to_owned()),
            KeyCode::Char('c') => self.drive.tell(&Request::ClearDiagnostics).map(|()| "counters cleared".to_owned()),
            _ => return Ok(()),
        };
        self.message = match done {
            Err(error) if error.is_of_the_line() => return Err(error),
            Err(error) => error.fix().map_or(error.to_string(), |fix| format!("{error}: {fix}")),
            Ok(message) => message,
        };
        self.status = self.drive.status()?;
        self.diagnostics = self.drive.diagnostics()?.joint;
        Ok(())
    }

    fn draw(&self, frame: &mut Frame<'_>) {
        let rows = [Constraint::Length(1), Constraint::Min(8), Constraint::Length(1), Constraint::Length(1)];
        let [title, middle, message, keys] = Layout::vertical(rows).areas(frame.area());
        let [values, plot] = Layout::horizontal([Constraint::Length(38), Constraint::Min(20)]).areas(middle);
        let label = self.identified.gear.label().to_string();
        let gear = if label.is_empty() { "any gear".to_owned() } else { format!("gear \"{label}\"") };
        frame.render_widget(Paragraph::new(format!("gmhm drive live: {}, {gear}", self.to)).bold(), title);
        frame.render_widget(Paragraph::new(self.lines()).block(Block::bordered().title("Drive")), values);
        self.draw_plot(frame, plot);
        frame.render_widget(Paragraph::new(self.message.as_str()).fg(Color::Yellow), message);
        frame.render_widget(Paragraph::new(KEYS).dim(), keys);
    }

    /// The values, one a line.
    fn lines(&self) -> Vec<Line<'static>> {
        let Self { live, status, diagnostics, .. } = self;
        let in_force = match status.origin {
            Origin::Nowhere => "nothing".to_owned(),
            Origin::Stored => format!("stored, sequence {}", status.sequence),
            Origin::Trial => format!("on trial, sequence {}", status.sequence),
            origin => origin.name().to_owned(),
        };
        let short = |x: f32| number(f64::from(x), 4);
        let flags = match flags(live.out_of_range, live.refused) {
            "" => "none",
            flags => flags,
        };
        let counters = Counters::of(diagnostics);
        let line = |name: &str, value: &str| Line::from(format!(" {name:<13}{value}"));
        let pairs = [
            ("torque", format!("{} N·m", short(live.torque_nm))),
            ("hysteresis", format!("{} N·m", short(live.hysteresis_nm))),
            ("contribution", format!("{} N·m", short(live.contribution_nm))),
            ("deflection", format!("{} mrad", short(1e3 * live.deflection_rad))),
            ("flags", flags.to_owned()),
            ("in force", in_force),
            ("compensation", switch(status.compensating).to_owned()),
            ("gain ratio", short(status.gain_ratio)),
            ("drive", if status.enabled { "enabled" } else { "disabled" }.to_owned()),
            ("ticks", live.ticks.to_string()),
            ("loop cost", live.loop_cost.to_string()),
        ];
        let values = pairs.iter().map(|(name, value)| line(name, value));
        let counted = counters.short().map(|(name, count)| line(name, &count.to_string()));
        values
            .chain([Line::from(" Faults since cleared").dim()])
            .chain(counted)
            .chain([line("last fault", counters.last_fault())])
            .collect()
    }

    fn draw_plot(&self, frame: &mut Frame<'_>, area: Rect) {
        let last = self.history.back().map_or(0.0, |(time, _)| *time);
        let line = |k: usize| -> Vec<(f64, f64)> { self.history.iter().map(|(t, values)| (*t, values[k])).collect() };
        let lines = [0, 1, 2].map(line);
        let largest = lines.iter().flatten().fold(0.0, |most: f64, (_, y)| most.max(y.abs()));
        let most = if largest > 0.0 { 1.1 * largest } else { 1.0 };
        let names = [("torque", Color::Blue), ("hysteresis", Color::LightRed), ("contribution", Color::Green)];
        let datasets = names.iter().zip(&lines).map(|((name, colour), points)| {
            let dataset = Dataset::default().name(*name).marker(Marker::Braille).graph_type(GraphType::Line);
            dataset.style(Style::new().fg(*colour)).data(points)
        });
        let seconds = [last - WINDOW_S, last];
        let chart = Chart::new(datasets.collect())
            .block(Block::bordered().title(format!("N·m over the last {WINDOW_S:.0} s")))
            .legend_position(Some(LegendPosition::TopLeft))
            .x_axis(Axis::default().bounds(seconds))
            .y_axis(Axis::default().bounds([-most, most]).labels([number(-most, 2), "0".to_owned(), number(most, 2)]));
        frame.render_widget(chart, area);
    }
}

fn switch(on: bool) -> &'static str {
    if on { "on" } else { "off" }
}
