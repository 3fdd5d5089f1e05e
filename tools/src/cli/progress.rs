//! Progress on the terminal for what takes longer than a second.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::Session;

/// A bar that shows itself after a second, with the time left; never into a pipe, never with `-q`.
pub struct Progress {
    bar: ProgressBar,
    began: Instant,
    hidden: AtomicBool,
    quiet: bool,
}

impl Progress {
    /// The steps of work that tells its progress as a share.
    pub const WHOLE: u64 = 1000;

    /// A bar for `total` steps of what `doing` says.
    pub fn new(doing: &str, total: u64, quiet: bool) -> Self {
        let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::hidden());
        bar.set_style(with_time_left());
        bar.set_message(doing.to_owned());
        Progress { bar, began: Instant::now(), hidden: AtomicBool::new(true), quiet }
    }

    /// So many steps are done.
    pub fn at(&self, done: u64) {
        let late = !self.quiet && self.began.elapsed() > Duration::from_secs(1);
        if late && self.hidden.swap(false, Ordering::Relaxed) {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        self.bar.set_position(done);
    }
}

impl crate::progress::Progress for Progress {
    fn report(&self, stage: &str, done: f64) {
        self.bar.set_message(stage.to_owned());
        self.at((done * Self::WHOLE as f64) as u64);
    }
}

/// Says after a second what is being done: for how long, until the work reports its share; then as a bar with the time left. Never into a pipe, never with `-q`.
pub struct Working {
    bar: ProgressBar,
    ended: Arc<Mutex<bool>>,
    /// The stage whose share is shown.
    stage: Mutex<Option<String>>,
}

impl Working {
    /// Work that begins now and ends when the value is dropped.
    pub fn new(doing: &str, quiet: bool) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        let style = ProgressStyle::with_template("{msg} {spinner} {elapsed}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
        bar.set_message(doing.to_owned());
        let stage = Mutex::new(None);
        let ended = Arc::new(Mutex::new(false));
        if !quiet {
            let (bar, ended) = (bar.clone(), Arc::clone(&ended));
            std::thread::spawn(move || {
                std::thread::sleep(Duration::from_secs(1));
                let ended = ended.lock().unwrap_or_else(PoisonError::into_inner);
                if !*ended {
                    bar.set_draw_target(ProgressDrawTarget::stderr());
                    bar.enable_steady_tick(Duration::from_millis(200));
                }
            });
        }
        Working { bar, ended, stage }
    }

    /// Prints something while the line of the work is away.
    pub fn aside(&self, print: impl FnOnce()) {
        self.bar.suspend(print);
    }

    /// Prints notes while the line of the work is away.
    pub fn notes(&self, session: &Session) -> impl FnMut(&str) {
        |note| self.aside(|| session.note(note))
    }
}

impl crate::progress::Progress for Working {
    fn report(&self, stage: &str, done: f64) {
        let mut shown = self.stage.lock().unwrap_or_else(PoisonError::into_inner);
        if shown.as_deref() != Some(stage) {
            *shown = Some(stage.to_owned());
            self.bar.set_style(with_time_left());
            self.bar.set_length(Progress::WHOLE);
            self.bar.set_message(stage.to_owned());
            self.bar.set_position(0);
            self.bar.reset_eta();
        }
        self.bar.set_position((done * Progress::WHOLE as f64) as u64);
    }
}

fn with_time_left() -> ProgressStyle {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {percent}% {eta} left");
    style.unwrap_or_else(|_| ProgressStyle::default_bar())
}

impl Drop for Working {
    fn drop(&mut self) {
        *self.ended.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.bar.finish_and_clear();
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
