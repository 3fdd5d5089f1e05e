//! Bytes to a drive and back.

use std::io::{Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use super::error::DeviceError;
use super::target::Target;

/// How long a read waits for the first byte.
const PATIENCE: Duration = Duration::from_millis(20);

/// How long a connection may take.
const CONNECTING: Duration = Duration::from_secs(5);

/// A line to a drive. A read that brings nothing for a while times out.
pub trait Line: Read + Write {}

impl<T: Read + Write> Line for T {}

/// Opens the line to a target; `baud` counts for serial ports.
///
/// # Errors
/// It cannot be opened, or the target is a probe, which has none.
pub fn open(target: &Target, baud: u32) -> Result<Box<dyn Line>, DeviceError> {
    let refused = |error: std::io::Error| DeviceError::Unreachable { target: target.clone(), error };
    match target {
        Target::Serial(port) => {
            let port = serialport::new(port, baud).timeout(PATIENCE).open().map_err(|error| refused(error.into()))?;
            Ok(Box::new(port))
        }
        Target::Tcp(address) => {
            let mut last = None;
            for address in address.to_socket_addrs().map_err(refused)? {
                match TcpStream::connect_timeout(&address, CONNECTING) {
                    Ok(stream) => {
                        stream.set_read_timeout(Some(PATIENCE)).map_err(refused)?;
                        stream.set_nodelay(true).map_err(refused)?;
                        return Ok(Box::new(stream));
                    }
                    Err(error) => last = Some(error),
                }
            }
            Err(refused(last.unwrap_or_else(|| std::io::Error::other("the host has no address"))))
        }
        Target::Probe(_) => Err(DeviceError::NoLine),
    }
}
