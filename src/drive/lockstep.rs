//! A drive in lock-step with a joint that a host plays: hardware in the loop, over any line of bytes.
//!
//! The host sends a [`Start`], the drive sets up its servo and answers with no torque; then each [`Period`] is answered by the torque of the motor, and time stands still
//! meanwhile. Bodies are little-endian, one in a [frame](crate::link::frame): 1 and the numbers of a start, 2 and those of a period; an answer is a torque, or
//! nothing where a start was refused.

use super::{Gains, Mounting, Reference, Servo, ServoError, ServoSetup, ServoState, Setup};
use crate::elastic::Elastic;
use crate::feedforward::{Controls, Settings, Source};
use crate::link::frame::Body;
use crate::params::{Memory, ParamError, Params};

/// What the drive is to control.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Start {
    /// What the drive knows of the gear, which follows law `masing`.
    pub params: Params,
    /// Its servo.
    pub setup: ServoSetup,
    /// Its feed-forward.
    pub controls: Controls<f32>,
}

/// One control period.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Period {
    /// What is asked for.
    pub reference: Reference<f32>,
    /// Raw counts of the motor.
    pub motor: u32,
    /// Raw counts of the output.
    pub output: u32,
}

/// A drive in lock-step.
#[derive(Default)]
pub struct Drive(Option<(Servo<f32>, Controls<f32>, ServoState<f32>)>);

const START: u8 = 1;
const PERIOD: u8 = 2;

/// f64 words of a start: gear, gains, ramp.
const NUMBERS: usize = 8 + 6 + 1;

impl Start {
    /// Its body.
    #[must_use]
    pub fn encode(&self) -> Body {
        let Self { params, setup, controls } = self;
        let (elastic, memory, gains, encoders) = (params.elastic(), params.memory(), setup.gains, setup.encoders);
        let numbers: [f64; NUMBERS] = [
            params.rated_deflection_rad(),
            elastic.c1_nm_per_rad,
            elastic.c2_nm_per_rad3,
            elastic.c3_nm_per_rad5,
            memory.alpha,
            memory.beta_per_s,
            memory.omega_per_s,
            memory.reversal_play_rad,
            gains.period_s,
            gains.position_per_s,
            gains.velocity_nms_per_rad,
            gains.integral_rad_per_s,
            gains.filter_rad_per_s,
            gains.limit_nm,
            setup.feed_forward.ramp_s,
        ];
        let flags = u8::from(controls.on) + 2 * u8::from(controls.source == Source::Measurement);
        let counts = [
            encoders.motor.counts_per_turn,
            encoders.output.counts_per_turn,
            encoders.ratio.0,
            setup.reference_counts_per_turn,
        ];
        let mut body = Body::new();
        let all = [START, flags].into_iter();
        let all = all.chain(counts.into_iter().flat_map(u32::to_le_bytes));
        // There is room for 138 bytes.
        body.extend(all.chain(numbers.into_iter().flat_map(f64::to_le_bytes)));
        body
    }

    fn decode(mut words: Words<'_>) -> Option<Result<Self, ParamError>> {
        let [flags] = words.take()?;
        let [motor, output, ratio, reference_counts_per_turn] =
            [words.u32()?, words.u32()?, words.u32()?, words.u32()?];
        let mut numbers = [0.0; NUMBERS];
        for number in &mut numbers {
            *number = f64::from_le_bytes(words.take()?);
        }
        let [a, c1, c2, c3, alpha, beta_per_s, omega_per_s, reversal_play_rad, ..] = numbers;
        let [.., period_s, position_per_s, velocity, integral_rad_per_s, filter_rad_per_s, limit_nm, ramp_s] = numbers;
        let elastic = Elastic { c1_nm_per_rad: c1, c2_nm_per_rad3: c2, c3_nm_per_rad5: c3 };
        let memory = Memory { alpha, beta_per_s, omega_per_s, reversal_play_rad, ..Memory::default() };
        let gains = Gains {
            period_s,
            position_per_s,
            velocity_nms_per_rad: velocity,
            integral_rad_per_s,
            filter_rad_per_s,
            limit_nm,
        };
        let mounting = |counts_per_turn| Mounting { counts_per_turn, reversed: false };
        let encoders = Setup {
            motor: mounting(motor),
            output: mounting(output),
            ratio: (ratio, 1),
            deflection_zero_rad: 0.0,
            rated_deflection_rad: a,
        };
        let setup = ServoSetup {
            encoders,
            reference_counts_per_turn,
            gains,
            feed_forward: Settings { period_s, ramp_s, ..Settings::default() },
        };
        let source = if flags & 2 == 0 { Source::Reference } else { Source::Measurement };
        let controls = Controls { on: flags & 1 != 0, source, ratio: 1.0 };
        Some(Params::new(a, elastic, memory).map(|params| Self { params, setup, controls }))
    }

    /// The servo that it asks for.
    ///
    /// # Errors
    /// [`ServoError`].
    pub fn servo(&self) -> Result<Servo<f32>, ServoError> {
        Servo::new(&self.params, &self.setup)
    }
}

impl Period {
    /// Its body.
    #[must_use]
    pub fn encode(&self) -> Body {
        let Reference { counts, torque, feed_forward } = self.reference;
        let words = [torque.to_bits(), feed_forward.to_bits(), self.motor, self.output];
        let mut body = Body::new();
        let all = [PERIOD].into_iter().chain(counts.to_le_bytes());
        body.extend(all.chain(words.into_iter().flat_map(u32::to_le_bytes)));
        body
    }

    fn decode(mut words: Words<'_>) -> Option<Self> {
        let counts = i64::from_le_bytes(words.take()?);
        let [torque, feed_forward] = [f32::from_bits(words.u32()?), f32::from_bits(words.u32()?)];
        let reference = Reference { counts, torque, feed_forward };
        Some(Self { reference, motor: words.u32()?, output: words.u32()? })
    }
}

impl Drive {
    /// The body that answers a request; `None` where there is nothing to answer.
    #[must_use]
    pub fn answer(&mut self, request: &[u8]) -> Option<Body> {
        let mut words = Words(request);
        let [kind] = words.take()?;
        let torque = match kind {
            START => {
                let start = Start::decode(words)?.ok().and_then(|start| Some((start.servo().ok()?, start.controls)));
                self.0 = start.map(|(servo, controls)| {
                    let state = servo.start(0, 0, 0);
                    (servo, controls, state)
                });
                self.0.as_ref().map(|_| 0.0)
            }
            PERIOD => {
                let Period { reference, motor, output } = Period::decode(words)?;
                let (servo, controls, state) = self.0.as_mut()?;
                Some(servo.period(state, controls, &reference, motor, output))
            }
            _ => return None,
        };
        let mut body = Body::new();
        body.extend(torque.into_iter().flat_map(f32::to_le_bytes));
        Some(body)
    }
}

/// The torque of an answer; `None` where the drive refused.
pub fn torque(answer: &[u8]) -> Option<f32> {
    answer.try_into().ok().map(f32::from_le_bytes)
}

/// What is left of a body.
struct Words<'a>(&'a [u8]);

impl Words<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*first)
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }
}
