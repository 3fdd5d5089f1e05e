//! The line of a simulated drive: one host at a time, as on a serial port.

use std::io::ErrorKind;
use std::net::{TcpListener, TcpStream};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use gmhm::store::PlaceError;

use super::listen::Listen;
use super::{InForce, VirtualDrive};
use crate::device::error::DeviceError;
use crate::device::line::Line;
use crate::device::target::Target;

/// How long a read waits before time goes on and the keys are asked.
const PATIENCE: Duration = Duration::from_millis(5);

/// What someone at the drive does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Key {
    /// Cuts the power and switches it on again.
    Cut,
    /// Cuts the power in the middle of the next write to the flash.
    CutInWrite,
    /// Switches the power stage on or off.
    Enable,
    /// Ends the drive.
    Quit,
}

/// The drive's end of the line.
pub enum Socket {
    /// A TCP port.
    Tcp(TcpListener),
    /// The master of a pseudo-terminal, and the name of its other end.
    #[cfg(unix)]
    Pty(serialport::TTYPort, String),
}

impl Socket {
    /// Opens it.
    ///
    /// # Errors
    /// The system refuses.
    pub fn open(listen: &Listen) -> Result<Self, DeviceError> {
        let refused = |error| DeviceError::NotListening { listen: listen.clone(), error };
        match listen {
            Listen::Tcp(address) => {
                let listener = TcpListener::bind(address).map_err(refused)?;
                listener.set_nonblocking(true).map_err(refused)?;
                Ok(Self::Tcp(listener))
            }
            #[cfg(unix)]
            Listen::Pty => {
                use serialport::SerialPort;
                let (mut master, slave) = serialport::TTYPort::pair().map_err(|error| refused(error.into()))?;
                master.set_timeout(PATIENCE).map_err(|error| refused(error.into()))?;
                // Closed here, the other end is free for any host to open and to open again.
                Ok(Self::Pty(master, slave.name().unwrap_or_default()))
            }
            #[cfg(not(unix))]
            Listen::Pty => Err(refused(ErrorKind::Unsupported.into())),
        }
    }

    /// Where hosts find it.
    pub fn target(&self, listen: &Listen) -> Target {
        match (self, listen) {
            (Self::Tcp(listener), Listen::Tcp(address)) => {
                let host = address.rsplit_once(':').map_or("localhost", |(host, _)| host);
                let port = listener.local_addr().map_or(0, |address| address.port());
                Target::Tcp(format!("{host}:{port}"))
            }
            (Self::Tcp(_), Listen::Pty) => Target::Tcp(String::new()),
            #[cfg(unix)]
            (Self::Pty(_, port), _) => Target::Serial(port.clone()),
        }
    }

    /// The next host, if there is one.
    fn host(&mut self) -> Option<TcpStream> {
        match self {
            Self::Tcp(listener) => {
                let (stream, _) = listener.accept().ok()?;
                stream.set_nonblocking(false).ok()?;
                stream.set_read_timeout(Some(PATIENCE)).ok()?;
                stream.set_nodelay(true).ok()?;
                Some(stream)
            }
            #[cfg(unix)]
            Self::Pty(..) => None,
        }
    }

    /// Serves hosts until [`Key::Quit`]. `tell` hears what happens.
    ///
    /// # Errors
    /// As [`VirtualDrive::restart`].
    pub fn serve(
        &mut self,
        drive: &mut VirtualDrive,
        keys: &Receiver<Key>,
        mut tell: impl FnMut(&str),
    ) -> Result<(), PlaceError> {
        let mut host: Option<TcpStream> = None;
        let mut buffer = [0; 256];
        let (mut last, mut known, mut restarts) = (Instant::now(), drive.in_force(), drive.restarts());
        loop {
            drive.advance(last.elapsed().as_secs_f64());
            last = Instant::now();
            while let Ok(key) = keys.try_recv() {
                match key {
                    Key::Quit => return Ok(()),
                    Key::Cut => drive.restart()?,
                    Key::CutInWrite => {
                        drive.cut_in_next_write();
                        tell("the power will fail in the middle of the next write to the flash");
                    }
                    Key::Enable => drive.switch_enabled(),
                }
            }
            let is_open = match (&mut *self, &mut host) {
                (_, Some(stream)) => exchange(stream, drive, &mut buffer)?,
                #[cfg(unix)]
                (Self::Pty(master, _), None) => exchange(master, drive, &mut buffer)?,
                (Self::Tcp(_), None) => false,
            };
            if !is_open {
                host = self.host();
                if host.is_none() {
                    std::thread::sleep(PATIENCE);
                }
            }
            let now = drive.in_force();
            if drive.restarts() != restarts {
                restarts = drive.restarts();
                tell(&format!("power cut and restored: what was in RAM is lost; {}", words(&now)));
            } else if now != known {
                tell(&words(&now));
            }
            known = now;
        }
    }
}

/// Reads what has come and answers; whether the line is still open.
fn exchange(line: &mut dyn Line, drive: &mut VirtualDrive, buffer: &mut [u8]) -> Result<bool, PlaceError> {
    match line.read(buffer) {
        Ok(count @ 1..) => {
            let answer = drive.receive(&buffer[..count])?;
            Ok(answer.is_empty() || line.write_all(&answer).and_then(|()| line.flush()).is_ok())
        }
        Ok(_) => Ok(false),
        Err(error) => Ok(matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)),
    }
}

fn words(now: &InForce) -> String {
    let block = now.sequence.map_or("nothing in force".to_owned(), |n| format!("sequence {n} in force"));
    let on = |is_on| if is_on { "on" } else { "off" };
    format!(
        "{block}; drive {}; compensation {}, gain ratio {}",
        if now.enabled { "enabled" } else { "disabled" },
        on(now.compensating),
        now.gain_ratio
    )
}
