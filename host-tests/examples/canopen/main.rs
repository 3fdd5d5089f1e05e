//! A simulated drive behind CAN frames: eight bytes of SDO in on standard input, eight bytes out. `check.py` beside it is the master.
//!
//! `cargo xtask canopen` runs both over a virtual bus.

use std::io::{ErrorKind, Read, Write};
use std::time::Instant;

use gmhm::link::{SdoServer, Server};
use gmhm::store::{RamFlash, Store};
use gmhm_tools::device::virtual_drive::machine::Machine;

const SLOT: u32 = 1024;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut memory = [0xFF; 2 * SLOT as usize];
    let store = Store::new(RamFlash::<4, 1024>::new(&mut memory), 0..SLOT, SLOT..2 * SLOT)?;
    let mut server = Server::<_, 1024>::new(store, 1);
    let (mut sdo, mut machine) = (SdoServer::new(), Machine::default());
    server.boot(&mut machine);
    let (mut input, mut output) = (std::io::stdin().lock(), std::io::stdout().lock());
    let mut last = Instant::now();
    let mut frame = [0; 8];
    loop {
        match input.read_exact(&mut frame) {
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Ok(()),
            read => read?,
        }
        let passed = last.elapsed();
        last = Instant::now();
        machine.advance(passed.as_secs_f64());
        server.elapse(passed.as_millis() as u32, &mut machine);
        if let Some(answer) = sdo.answer(&frame, &mut server, &mut machine) {
            output.write_all(&answer)?;
            output.flush()?;
        }
    }
}
