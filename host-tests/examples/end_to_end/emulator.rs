//! A board in QEMU: its serial port on TCP, its monitor, its flash in a file.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::ops::Range;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use gmhm::block::ScalarKind;
use gmhm_tools::device::{Client, Target, line};

use crate::Failure;

/// How long an emulator may take to listen.
const STARTING: Duration = Duration::from_secs(20);

/// Bytes of a slot.
pub const SLOT: usize = 0x400;

/// A board that the image `node` runs on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Board {
    /// Cortex-M4F.
    Mps2An386,
    /// Cortex-M0 with a flash controller.
    Microbit,
}

impl Board {
    /// The board of a name.
    pub fn named(name: &str) -> Result<Self, Failure> {
        [Self::Mps2An386, Self::Microbit]
            .into_iter()
            .find(|board| board.name() == name)
            .ok_or_else(|| format!("no board `{name}`").into())
    }

    /// The emulator's name of it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mps2An386 => "mps2-an386",
            Self::Microbit => "microbit",
        }
    }

    /// What its image computes in.
    pub fn scalar(self) -> ScalarKind {
        match self {
            Self::Mps2An386 => ScalarKind::F32,
            Self::Microbit => ScalarKind::Fixed,
        }
    }

    /// Where the two slots of its store lie: in memory beside the image's, or in the last pages of the flash.
    pub fn store(self) -> Range<u32> {
        let start = match self {
            Self::Mps2An386 => 0x2010_0000,
            Self::Microbit => 0x3_F800,
        };
        start..start + 2 * SLOT as u32
    }
}

/// A running emulator, killed with its owner.
pub struct Emulator {
    child: Child,
    serial: u16,
    monitor: u16,
}

impl Emulator {
    /// Starts an image, with what a store is to hold in its place; `slowly` runs about a million instructions a second.
    pub fn start(board: Board, image: &Path, store: Option<&Path>, slowly: bool) -> Result<Self, Failure> {
        let [serial, monitor] = free_ports()?;
        let mut command = Command::new("qemu-system-arm");
        command.args(["-machine", board.name(), "-display", "none", "-semihosting-config", "enable=on,target=native"]);
        for (device, port) in [("-serial", serial), ("-monitor", monitor)] {
            command.args([device, &format!("tcp:127.0.0.1:{port},server=on,wait=off")]);
        }
        command.arg("-kernel").arg(image);
        if let Some(store) = store {
            let at = board.store().start;
            command.arg("-device").arg(format!("loader,file={},addr={at:#x},force-raw=on", store.display()));
        }
        if slowly {
            command.args(["-icount", "shift=10,align=on"]);
        }
        let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn()?;
        let emulator = Self { child, serial, monitor };
        // Whoever connects to the serial port next is listened to.
        emulator.monitor()?;
        Ok(emulator)
    }

    /// Its serial port, as `gmhm flash` names it.
    pub fn target(&self) -> Target {
        Target::Tcp(format!("127.0.0.1:{}", self.serial))
    }

    /// The drive behind its serial port.
    pub fn client(&self) -> Result<Client, Failure> {
        let began = Instant::now();
        loop {
            let mut refused = match line::open(&self.target(), 0) {
                Ok(line) => {
                    let mut client = Client::new(line);
                    match client.identify() {
                        Ok(_) => return Ok(client),
                        Err(error) => error,
                    }
                }
                Err(error) => error,
            };
            if began.elapsed() > STARTING {
                return Err(core::mem::replace(&mut refused, gmhm_tools::device::DeviceError::Closed).into());
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Presses the reset button.
    pub fn reset(&self) -> Result<(), Failure> {
        self.monitor()?.command("system_reset")
    }

    /// Its monitor.
    pub fn monitor(&self) -> Result<Monitor, Failure> {
        let began = Instant::now();
        loop {
            match TcpStream::connect(("127.0.0.1", self.monitor)) {
                Ok(stream) => {
                    stream.set_read_timeout(Some(STARTING))?;
                    stream.set_nodelay(true)?;
                    let mut monitor = Monitor { stream };
                    monitor.prompt()?;
                    return Ok(monitor);
                }
                Err(error) if began.elapsed() > STARTING => return Err(error.into()),
                Err(_) => std::thread::sleep(Duration::from_millis(50)),
            }
        }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // Both fail only where it has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The emulator's own command line.
pub struct Monitor {
    stream: TcpStream,
}

impl Monitor {
    /// Has a command done.
    pub fn command(&mut self, words: &str) -> Result<(), Failure> {
        writeln!(self.stream, "{words}")?;
        self.prompt()
    }

    /// Writes a range of memory, as the core sees it, into a file.
    pub fn save(&mut self, place: &Range<u32>, file: &Path) -> Result<(), Failure> {
        let length = place.end - place.start;
        self.command(&format!("memsave {:#x} {length} \"{}\"", place.start, file.display()))
    }

    /// Ends the emulator, whatever its image is doing.
    pub fn kill(&mut self) {
        // It does not answer any more.
        let _ = self.command("quit");
    }

    fn prompt(&mut self) -> Result<(), Failure> {
        let mut heard = Vec::new();
        let mut buffer = [0; 512];
        while !heard.ends_with(b"(qemu) ") {
            match self.stream.read(&mut buffer)? {
                0 => return Err("the emulator hung up".into()),
                count => heard.extend_from_slice(&buffer[..count]),
            }
        }
        Ok(())
    }
}

/// Two ports that were free a moment ago.
fn free_ports() -> Result<[u16; 2], Failure> {
    let [a, b] = [TcpListener::bind("127.0.0.1:0")?, TcpListener::bind("127.0.0.1:0")?];
    Ok([a.local_addr()?.port(), b.local_addr()?.port()])
}
