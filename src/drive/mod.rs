//! The drive's side of the model: from encoder counts to a torque command, once a control period.
//!
//! | file | what |
//! |---|---|
//! | [`pair`] | counts of two encoders to deflection, in integers until the difference is taken |
//! | [`joint`] | the control tick: read both encoders, ask a control law, hand its torque to the power stage |
//! | [`cascade`] | position P over velocity PI, the usual servo |
//! | [`servo`] | encoders, feed-forward of the gear and cascade together |
//! | [`compensated`] | the same with friction, ripple and the other plant terms |
//! | [`lockstep`] | a servo whose joint a host plays, over a line of bytes |
//! | [`as5047p`] | an absolute magnetic encoder on SPI, over `embedded_hal::spi::SpiDevice` |
//! | [`pwm`] | a torque command as a PWM duty cycle, over `embedded_hal::pwm::SetDutyCycle` |
//!
//! ```
//! use gmhm::drive::{Encoder, EncoderPair, Joint, Mounting, Setup, TorqueSink};
//!
//! struct Still(u32);
//! impl Encoder for Still {
//!     type Error = core::convert::Infallible;
//!     fn counts(&mut self) -> Result<u32, Self::Error> { Ok(self.0) }
//! }
//! struct Motor(f32);
//! impl TorqueSink<f32> for Motor {
//!     type Error = core::convert::Infallible;
//!     fn set_torque(&mut self, torque: f32) -> Result<(), Self::Error> { self.0 = torque; Ok(()) }
//!     fn release(&mut self) -> Result<(), Self::Error> { self.0 = 0.0; Ok(()) }
//! }
//!
//! let encoder = Mounting { counts_per_turn: 1 << 14, reversed: false };
//! let setup = Setup { motor: encoder, output: encoder, ratio: (100, 1), deflection_zero_rad: 0.0, rated_deflection_rad: 1.168e-3 };
//! let pair = EncoderPair::<f32>::new(&setup)?;
//! // 300 counts of the motor are 3 of the output.
//! let mut joint = Joint::new(Still(300), Still(3), Motor(0.0), pair);
//! let reading = joint.tick(|reading| 2.0e4 * reading.deflection).expect("no fault");
//! assert_eq!(reading.deflection, 0.0);
//! # Ok::<(), gmhm::drive::SetupError>(())
//! ```
//!
#![cfg_attr(not(feature = "terms"), doc = "[`compensated`]: crate#features")]
#![cfg_attr(not(feature = "link"), doc = "[`lockstep`]: crate#features")]
#![cfg_attr(not(feature = "drive"), doc = "[`as5047p`]: crate#features\n[`pwm`]: crate#features")]

#[cfg(feature = "drive")]
pub mod as5047p;
pub mod cascade;
#[cfg(feature = "terms")]
pub mod compensated;
pub mod joint;
#[cfg(feature = "link")]
pub mod lockstep;
pub mod pair;
mod position_loop;
#[cfg(feature = "drive")]
pub mod pwm;
pub mod servo;

#[cfg(feature = "drive")]
pub use as5047p::As5047p;
pub use cascade::{Cascade, CascadeState, Gains, GainsError};
#[cfg(feature = "terms")]
pub use compensated::{CompensatedServo, CompensatedServoState, TorqueShaft};
pub use joint::{Fault, Joint};
pub use pair::{EncoderPair, FromCounts, Mounting, Reading, Setup, SetupError};
#[cfg(feature = "drive")]
pub use pwm::CentredPwm;
pub use servo::{Reference, Servo, ServoError, ServoSetup, ServoState};

/// An absolute encoder of one turn.
pub trait Encoder {
    /// What can go wrong.
    type Error;

    /// The angle, in counts from 0 to one below a whole turn.
    ///
    /// # Errors
    /// No angle could be read, or not one to be trusted.
    fn counts(&mut self) -> Result<u32, Self::Error>;
}

/// Where the torque command goes: a current loop, a servo amplifier.
pub trait TorqueSink<S> {
    /// What can go wrong.
    type Error;

    /// Asks for a torque, N·m for floats, as a fraction of the rated torque for fixed point. Beyond what it can give it gives what it can.
    ///
    /// # Errors
    /// The command did not arrive.
    fn set_torque(&mut self, torque: S) -> Result<(), Self::Error>;

    /// Lets go: no torque.
    ///
    /// # Errors
    /// The command did not arrive.
    fn release(&mut self) -> Result<(), Self::Error>;
}
