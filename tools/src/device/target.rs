//! Where a drive is.

use std::fmt;
use std::str::FromStr;

/// A drive's address on the command line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Target {
    /// `serial:PORT`, the system's name of a serial port.
    Serial(String),
    /// `tcp:HOST:PORT`, a bridge to a serial port or an emulator.
    Tcp(String),
    /// `probe` or `probe:CHIP`, a debug probe.
    Probe(Option<String>),
}

impl FromStr for Target {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (kind, rest) = text.split_once(':').map_or((text, None), |(kind, rest)| (kind, Some(rest)));
        match (kind, rest) {
            ("serial", Some(port)) if !port.is_empty() => Ok(Self::Serial(port.to_owned())),
            ("tcp", Some(address)) => match address.rsplit_once(':') {
                Some((host, port)) if !host.is_empty() && port.parse::<u16>().is_ok() => {
                    Ok(Self::Tcp(address.to_owned()))
                }
                _ => Err("give a host and a port from 0 to 65535, such as tcp:localhost:5000".to_owned()),
            },
            ("probe", None) => Ok(Self::Probe(None)),
            ("probe", Some(chip)) if !chip.is_empty() => Ok(Self::Probe(Some(chip.to_owned()))),
            _ => Err("must be serial:PORT, tcp:HOST:PORT, probe or probe:CHIP".to_owned()),
        }
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial(port) => write!(f, "serial:{port}"),
            Self::Tcp(address) => write!(f, "tcp:{address}"),
            Self::Probe(None) => write!(f, "probe"),
            Self::Probe(Some(chip)) => write!(f, "probe:{chip}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_read_as_they_are_written() {
        for text in [
            "serial:/dev/ttyUSB0",
            "serial:COM3",
            "tcp:localhost:5000",
            "tcp:[::1]:5000",
            "probe",
            "probe:nRF51822_xxAA",
        ] {
            assert_eq!(text.parse::<Target>().map(|target| target.to_string()).as_deref(), Ok(text));
        }
        for text in ["", "serial", "serial:", "tcp:localhost", "tcp::5000", "tcp:localhost:70000", "usb:1", "probe:"] {
            assert!(text.parse::<Target>().is_err(), "{text}");
        }
    }
}
