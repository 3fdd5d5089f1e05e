//! Where a simulated drive listens.

use std::fmt;
use std::str::FromStr;

use crate::device::target::Target;

/// Where a simulated drive is to be found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Listen {
    /// `tcp:HOST:PORT`; port 0 takes a free one.
    Tcp(String),
    /// `pty`, a pseudo-terminal that hosts open as a serial port.
    Pty,
}

impl FromStr for Listen {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.parse()) {
            ("pty", _) if cfg!(unix) => Ok(Self::Pty),
            ("pty", _) => Err("this system has no pseudo-terminals: use tcp:HOST:PORT".to_owned()),
            (_, Ok(Target::Tcp(address))) => Ok(Self::Tcp(address)),
            _ => Err("must be tcp:HOST:PORT, with a port from 0 to 65535, or pty".to_owned()),
        }
    }
}

impl fmt::Display for Listen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tcp(address) => write!(f, "tcp:{address}"),
            Self::Pty => write!(f, "pty"),
        }
    }
}
