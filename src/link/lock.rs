//! Access: with a key in the drive, every request that changes something carries a proof that its host knows the key.
//!
//! ```text
//! challenge = first 16 bytes of HMAC-SHA-256(key, "gmhm challenge" ‖ entropy ‖ session)
//! proof     = first 16 bytes of HMAC-SHA-256(key, "gmhm request" ‖ challenge ‖ body)
//! ```
//!
//! `body` is that of the request without the proof: version, command, session, turn, payload. The challenge of a session comes with the answer to `identify`, the turn is
//! counted, so a proof holds once. `docs/link.md` says what this guards against, and what it does not.

use core::fmt;

use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;

pub use super::message::PROOF_BYTES;

/// Bytes of a key.
pub const KEY_BYTES: usize = 32;

/// A key, the same in drive and host. It is a secret: neither logged nor serialised.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Key(pub [u8; KEY_BYTES]);

impl fmt::Debug for Key {
    /// Not the key.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Key(..)")
    }
}

/// What tells the sessions of a drive apart, and a proof of a request.
pub type Proof = [u8; PROOF_BYTES];

impl Key {
    /// The challenge of a session.
    #[must_use]
    pub fn challenge(&self, entropy: &[u8; PROOF_BYTES], session: u32) -> Proof {
        self.first_bytes(&[b"gmhm challenge", entropy, &session.to_le_bytes()])
    }

    /// The proof for the body of a request.
    #[must_use]
    pub fn prove(&self, challenge: &Proof, body: &[u8]) -> Proof {
        self.first_bytes(&[b"gmhm request", challenge, body])
    }

    /// Whether a proof is that of a body, in a time that does not depend on where it differs.
    #[must_use]
    pub fn proves(&self, challenge: &Proof, body: &[u8], proof: &Proof) -> bool {
        self.of_parts(&[b"gmhm request", challenge, body]).is_some_and(|code| code.verify_truncated_left(proof).is_ok())
    }

    fn first_bytes(&self, parts: &[&[u8]]) -> Proof {
        let mut first = [0; PROOF_BYTES];
        if let Some(code) = self.of_parts(parts) {
            first.iter_mut().zip(code.finalize().into_bytes()).for_each(|(to, byte)| *to = byte);
        }
        first
    }

    /// Any length of key is one for HMAC: this is always some.
    fn of_parts(&self, parts: &[&[u8]]) -> Option<Hmac<Sha256>> {
        let mut code = Hmac::<Sha256>::new_from_slice(&self.0).ok()?;
        parts.iter().for_each(|part| code.update(part));
        Some(code)
    }
}

/// The key of a drive, and what makes the challenges of this power-up.
///
/// The server knows HMAC by the functions in here only: a program without a lock links nothing of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lock {
    key: Key,
    entropy: Proof,
    challenge: fn(&Key, &Proof, u32) -> Proof,
    proves: fn(&Key, &Proof, &[u8], &Proof) -> bool,
}

impl Lock {
    pub(super) fn new(key: Key, entropy: Proof) -> Self {
        Self { key, entropy, challenge: Key::challenge, proves: Key::proves }
    }

    /// The challenge of a session.
    pub(super) fn challenge(&self, session: u32) -> Proof {
        (self.challenge)(&self.key, &self.entropy, session)
    }

    /// [`Key::proves`].
    pub(super) fn proves(&self, challenge: &Proof, body: &[u8], proof: &Proof) -> bool {
        (self.proves)(&self.key, challenge, body, proof)
    }
}
