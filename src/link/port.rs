//! The serial port of a drive: frames in, frames out.

use embedded_storage::nor_flash::NorFlash;

use super::drive::Drive;
use super::frame::Receiver;
use super::message::{Answer, Asked, LinkDiagnostics, MOST_BYTES, Request};
use super::server::Server;
use crate::store::{Entry, Store};

/// A [`Server`] at a serial line. Call [`boot`](Self::boot) once, [`receive`](Self::receive) with what comes over the line and [`elapse`](Self::elapse) as time
/// passes, all outside the control interrupt.
#[derive(Debug)]
pub struct Port<F, const ROOM: usize> {
    receiver: Receiver,
    server: Server<F, ROOM>,
}

impl<F: NorFlash, const ROOM: usize> Port<F, ROOM> {
    /// A port where nothing is in force yet. `nonce` should differ from one power-up to the next: it is what tells sessions apart.
    #[must_use]
    pub fn new(store: Store<F>, nonce: u32) -> Self {
        Self { receiver: Receiver::new(), server: Server::new(store, nonce) }
    }

    /// [`Server::with_lock`].
    #[cfg(feature = "lock")]
    #[must_use]
    pub fn with_lock(self, key: super::lock::Key, entropy: [u8; super::lock::PROOF_BYTES]) -> Self {
        Self { server: self.server.with_lock(key, entropy), ..self }
    }

    /// [`Server::set_lock`].
    #[cfg(feature = "lock")]
    pub fn set_lock(&mut self, key: super::lock::Key, entropy: [u8; super::lock::PROOF_BYTES]) {
        self.server.set_lock(key, entropy);
    }

    /// [`Server::boot`].
    pub fn boot(&mut self, drive: &mut impl Drive) -> Option<Entry> {
        self.server.boot(drive)
    }

    /// Takes bytes from the line and hands back the frames that answer them.
    pub fn receive(&mut self, bytes: &[u8], drive: &mut impl Drive, mut send: impl FnMut(&[u8])) {
        for byte in bytes {
            let Some(asked) = self.receiver.feed(*byte).and_then(Asked::of_body) else { continue };
            let (command, tag) = (asked.command, asked.tag);
            let mut bytes = [0; MOST_BYTES];
            let answer = match self.server.answer(&asked, drive, &mut bytes) {
                Answer::Diagnostics(it) => Answer::Diagnostics(LinkDiagnostics { line: self.receiver.counts(), ..it }),
                Answer::Done if matches!(command, CLEAR) => {
                    self.receiver.clear_counts();
                    Answer::Done
                }
                answer => answer,
            };
            send(&answer.encode(command, tag));
        }
    }

    /// [`Server::elapse`].
    pub fn elapse(&mut self, ms: u32, drive: &mut impl Drive) {
        self.server.elapse(ms, drive);
    }

    /// [`Server::boot_error`].
    #[must_use]
    pub fn boot_error(&self) -> u16 {
        self.server.boot_error()
    }

    /// The store again.
    #[must_use]
    pub fn into_store(self) -> Store<F> {
        self.server.into_store()
    }
}

/// The command that clears diagnostics, those of the line included.
const CLEAR: u8 = Request::ClearDiagnostics.command();
