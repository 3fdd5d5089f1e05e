//! A torque command as a duty cycle, for servo amplifiers with a PWM input and for bridges in locked antiphase: half the period is no torque.

use embedded_hal::pwm::SetDutyCycle;

use super::TorqueSink;
use super::pair::FromCounts;
use crate::scalar::Extended;

/// One PWM channel, centred: duty = 1/2 + torque/(2·full scale), limited to what the channel can do.
#[derive(Debug)]
pub struct CentredPwm<C, S: FromCounts> {
    channel: C,
    per_torque: S::Factor,
    centre: u16,
}

impl<C: SetDutyCycle, S: FromCounts> CentredPwm<C, S> {
    /// A channel whose whole swing to either side is `full_scale` > 0: N·m for floats, a fraction of the rated torque for fixed point. A full scale that is no
    /// torque makes every command none.
    #[must_use]
    pub fn new(channel: C, full_scale: f64) -> Self {
        let centre = channel.max_duty_cycle() / 2;
        let scale = Extended::of_double(full_scale).filter(|scale| *scale > Extended::ZERO);
        let per_torque = scale.filter(|_| !full_scale.is_sign_negative());
        let per_torque = per_torque.map(|scale| Extended::of_whole(centre.into()).over(scale));
        let per_torque = per_torque.filter(|factor| factor.single().is_finite()).unwrap_or(Extended::ZERO);
        Self { channel, per_torque: S::factor_of(per_torque), centre }
    }

    /// Gives the channel back.
    #[must_use]
    pub fn free(self) -> C {
        self.channel
    }
}

impl<C: SetDutyCycle, S: FromCounts> TorqueSink<S> for CentredPwm<C, S> {
    type Error = C::Error;

    /// A NaN counts as no torque.
    #[inline]
    fn set_torque(&mut self, torque: S) -> Result<(), C::Error> {
        let centre = i32::from(self.centre);
        let swing = torque.to_counts(self.per_torque).clamp(-centre, centre);
        self.channel.set_duty_cycle((centre + swing) as u16)
    }

    #[inline]
    fn release(&mut self) -> Result<(), C::Error> {
        self.channel.set_duty_cycle(self.centre)
    }
}
