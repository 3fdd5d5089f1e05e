//! A drive that controls a joint which this host plays, in lock-step: [`gmhm::drive::lockstep`].

use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use gmhm::link::frame::{self, Body, Receiver};

use super::error::DeviceError;
use super::line::Line;

/// How long an answer is waited for.
const PATIENCE: Duration = Duration::from_secs(10);

/// A drive at the end of a line.
pub struct Lockstep {
    line: Box<dyn Line>,
    receiver: Receiver,
}

impl Lockstep {
    /// A drive on a line that is open.
    pub fn new(line: Box<dyn Line>) -> Self {
        Self { line, receiver: Receiver::new() }
    }

    /// Sends a request and waits for its answer.
    ///
    /// # Errors
    /// The line broke, or no answer came.
    pub fn ask(&mut self, request: &[u8]) -> Result<Body, DeviceError> {
        self.line.write_all(&frame::encode(request))?;
        self.line.flush()?;
        let asked = Instant::now();
        let mut bytes = [0; 64];
        while asked.elapsed() < PATIENCE {
            let count = match self.line.read(&mut bytes) {
                Ok(0) => return Err(DeviceError::Closed),
                Ok(count) => count,
                Err(error)
                    if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted) =>
                {
                    0
                }
                Err(error) => return Err(error.into()),
            };
            // One request, one answer: nothing comes after it.
            for byte in &bytes[..count] {
                if let Some(answer) = self.receiver.feed(*byte) {
                    return Body::from_slice(answer).ok_or(DeviceError::NotUnderstood);
                }
            }
        }
        Err(DeviceError::Silent(PATIENCE.as_secs()))
    }
}
