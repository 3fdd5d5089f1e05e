//! The structures of `gmhm.h`, field by field.

use gmhm::diagnostics::Diagnostics;
use gmhm::feedforward::{Contribution, Controls, Demand, Limits, Source};
use gmhm::terms::Sample;
use gmhm::{Output, Status};

/// `gmhm_sample`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct SampleC {
    /// q_m/N − q_o, encoder zeros subtracted.
    pub deflection_rad: f32,
    /// q_m.
    pub motor_angle_rad: f32,
    /// q_o.
    pub output_angle_rad: f32,
    /// θ̇.
    pub deflection_rate_rad_per_s: f32,
    /// v.
    pub velocity_rad_per_s: f32,
    /// v̇.
    pub acceleration_rad_per_s2: f32,
    /// Θ.
    pub temperature_c: f32,
    /// t.
    pub time_s: f32,
    /// q̇_m.
    pub motor_velocity_rad_per_s: f32,
    /// q̇_o.
    pub output_velocity_rad_per_s: f32,
}

impl SampleC {
    /// The core's sample, `period_s` after the last.
    pub(crate) fn after(&self, period_s: f32) -> Sample<f32> {
        Sample {
            time: self.time_s,
            period: period_s,
            motor_angle: self.motor_angle_rad,
            output_angle: self.output_angle_rad,
            deflection: self.deflection_rad,
            deflection_rate: self.deflection_rate_rad_per_s,
            velocity: self.velocity_rad_per_s,
            acceleration: self.acceleration_rad_per_s2,
            temperature: self.temperature_c,
            motor_velocity: self.motor_velocity_rad_per_s,
            output_velocity: self.output_velocity_rad_per_s,
            ..Sample::default()
        }
    }
}

/// `gmhm_output`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct OutputC {
    /// T with all terms.
    pub torque_nm: f32,
    /// f(θ).
    pub elastic_nm: f32,
    /// z.
    pub hysteresis_nm: f32,
    /// What the terms add.
    pub terms_nm: f32,
    /// θ as the base model saw it.
    pub deflection_rad: f32,
    /// [`flag`]s.
    pub flags: u32,
}

/// `gmhm_solution`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct SolutionC {
    /// θ*.
    pub deflection_rad: f32,
    /// [`flag`]s.
    pub flags: u32,
}

/// `gmhm_status`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct StatusC {
    /// Of the block.
    pub sequence: u32,
    /// Of the block.
    pub crc32: u32,
    /// Control period; 0 where none was stated.
    pub period_s: f32,
    /// A.
    pub rated_deflection_rad: f32,
    /// Edge of the invertible range; 0 without inverse.
    pub range_rad: f32,
    /// How far z may be off because the past before the start is unknown.
    pub start_uncertainty_nm: f32,
    /// Pairs of turning points given up.
    pub merged_pairs: u32,
    /// [`need`]s.
    pub needs: u32,
    /// [`flag`]s of the last step.
    pub flags: u32,
    /// Identity of the gear, ended by a zero.
    pub gear: [u8; 20],
    /// N; 0 where the block states none.
    pub ratio: f32,
    /// What the encoders show at θ = 0.
    pub deflection_zero_rad: f32,
    /// 1 where the torque is taken on the motor side.
    pub torque_on_motor_side: u32,
    /// 1 where torques are counted in amperes.
    pub torque_in_amperes: u32,
}

/// `gmhm_block`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct BlockC {
    /// All its bytes.
    pub length: u32,
    /// Its sequence number.
    pub sequence: u32,
    /// Its CRC-32.
    pub crc32: u32,
    /// Control period; 0 where none was stated.
    pub period_s: f32,
    /// A; 0 without a gear.
    pub rated_deflection_rad: f32,
    /// T_A; 0 without a gear.
    pub torque_scale_nm: f32,
    /// Identity of the gear, ended by a zero.
    pub gear: [u8; 20],
    /// N; 0 where the block states none.
    pub ratio: f32,
    /// What the encoders show at θ = 0.
    pub deflection_zero_rad: f32,
    /// 1 where the torque is taken on the motor side.
    pub torque_on_motor_side: u32,
    /// 1 where torques are counted in amperes.
    pub torque_in_amperes: u32,
    /// Terms that a drive computes.
    pub terms: u32,
}

/// `gmhm_limits`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct LimitsC {
    /// Δ.
    pub period_s: f32,
    /// From nothing to the whole.
    pub ramp_s: f32,
    /// Of the offset.
    pub offset_slew_rad_per_s: f32,
    /// Of the hysteresis torque.
    pub torque_slew_nm_per_s: f32,
    /// Of the deflection.
    pub largest_rate_rad_per_s: f32,
}

impl LimitsC {
    pub(crate) fn limits(&self) -> Limits<f32> {
        let Self { period_s, ramp_s, offset_slew_rad_per_s, torque_slew_nm_per_s, largest_rate_rad_per_s } = *self;
        Limits { period_s, ramp_s, offset_slew_rad_per_s, torque_slew_nm_per_s, largest_rate_rad_per_s }
    }
}

/// `gmhm_demand`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct DemandC {
    /// T*.
    pub torque_nm: f32,
    /// θ as measured.
    pub deflection_rad: f32,
    /// 0 to 1.
    pub gain_ratio: f32,
    /// Whether it is on.
    pub on: u32,
    /// Whether the memory follows the measured deflection.
    pub along_measurement: u32,
}

impl DemandC {
    pub(crate) fn controls(&self) -> Controls<f32> {
        let source = if self.along_measurement == 0 { Source::Reference } else { Source::Measurement };
        Controls { on: self.on != 0, source, ratio: self.gain_ratio }
    }

    pub(crate) fn demand(&self) -> Demand<f32> {
        Demand { torque: self.torque_nm, deflection: self.deflection_rad }
    }
}

/// `gmhm_contribution`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct ContributionC {
    /// The share of θ*.
    pub offset_rad: f32,
    /// How much more than a period before.
    pub change_rad: f32,
    /// The share of z.
    pub hysteresis_nm: f32,
    /// The gain in force.
    pub gain: f32,
    /// w.
    pub certainty: f32,
    /// T at the state.
    pub model_torque_nm: f32,
    /// z at the state.
    pub model_hysteresis_nm: f32,
    /// The share of the terms of the gear.
    pub gear_terms_nm: f32,
    /// The share of the terms of the joint.
    pub joint_terms_nm: f32,
}

impl ContributionC {
    /// That of the base model, no terms beside it.
    pub(crate) fn of(now: &Contribution<f32>, output: &Output<f32>) -> Self {
        Self {
            offset_rad: now.offset,
            change_rad: now.change,
            hysteresis_nm: now.hysteresis,
            gain: now.gain,
            certainty: now.certainty,
            model_torque_nm: output.torque,
            model_hysteresis_nm: output.hysteresis,
            ..Self::default()
        }
    }
}

/// `gmhm_live`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct LiveC {
    /// θ.
    pub deflection_rad: f32,
    /// T.
    pub torque_nm: f32,
    /// z.
    pub hysteresis_nm: f32,
    /// What the compensation adds to the command.
    pub contribution_nm: f32,
    /// [`flag`]s of the last step.
    pub flags: u32,
    /// Control periods so far.
    pub ticks: u32,
    /// What the last one took, in counts of the drive's own clock.
    pub loop_cost: u32,
}

/// `gmhm_encoders`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(C)]
pub struct EncodersC {
    /// Of the motor.
    pub motor_counts_per_turn: u32,
    /// Of the output.
    pub output_counts_per_turn: u32,
    /// Whether the motor's counts down where q_m grows.
    pub motor_reversed: u32,
    /// Whether the output's counts down where q_o grows.
    pub output_reversed: u32,
}

/// `gmhm_diagnostics`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(C)]
pub struct DiagnosticsC {
    /// Samples refused.
    pub refused: u32,
    /// Samples beyond the rated deflection.
    pub out_of_range: u32,
    /// Samples quarantined.
    pub quarantined: u32,
    /// New starts where quarantined samples agreed.
    pub restarted: u32,
    /// Torques asked for beyond the invertible range.
    pub saturated: u32,
    /// Pairs of turning points given up.
    pub merged_pairs: u32,
    /// [`Fault`](gmhm::diagnostics::Fault), by its number.
    pub last_fault: u32,
    /// [`SelfTest`](gmhm::diagnostics::SelfTest), by its number.
    pub self_test: u32,
}

impl DiagnosticsC {
    pub(crate) fn of(seen: &Diagnostics) -> Self {
        let Diagnostics { refused, out_of_range, quarantined, restarted, saturated, merged_pairs, last, self_test } =
            *seen;
        let last_fault = u32::from(last.number());
        let self_test = u32::from(self_test.number());
        Self { refused, out_of_range, quarantined, restarted, saturated, merged_pairs, last_fault, self_test }
    }
}

/// What a call answers; its flags say what is wrong.
pub(crate) trait Answer: Default {
    /// [`flag`]s.
    fn flags(&mut self) -> &mut u32;

    /// That of a joint without parameters.
    fn not_loaded() -> Self {
        let mut answer = Self::default();
        *answer.flags() = flag::NOT_LOADED;
        answer
    }
}

impl Answer for OutputC {
    fn flags(&mut self) -> &mut u32 {
        &mut self.flags
    }
}

impl Answer for SolutionC {
    fn flags(&mut self) -> &mut u32 {
        &mut self.flags
    }
}

impl Answer for StatusC {
    fn flags(&mut self) -> &mut u32 {
        &mut self.flags
    }
}

/// Bits of the flags of outputs, solutions and status.
pub mod flag {
    /// No parameters are in force.
    pub const NOT_LOADED: u32 = 0x01;
    /// The input was NaN, infinite or absurd.
    pub const REFUSED: u32 = 0x02;
    /// Beyond the rated deflection.
    pub const OUT_OF_RANGE: u32 = 0x04;
    /// Beyond the invertible range.
    pub const SATURATED: u32 = 0x08;
    /// The search ended at its bound.
    pub const NOT_CONVERGED: u32 = 0x10;
    /// The parameters have no inverse.
    pub const NO_INVERSE: u32 = 0x20;
    /// Further from the last sample than the gear can have come.
    pub const QUARANTINED: u32 = 0x40;
    /// Quarantined samples agreed: started anew there.
    pub const RESTARTED: u32 = 0x80;
    /// No encoders are set, or they do not go with the block.
    pub const NO_ENCODERS: u32 = 0x100;
}

/// The [`flag`]s that are set.
pub(crate) fn sum(flags: &[(bool, u32)]) -> u32 {
    flags.iter().filter(|(set, _)| *set).fold(0, |sum, (_, flag)| sum | flag)
}

/// The [`flag`]s of a gear's last sample.
pub(crate) fn status_flags(refused: bool, status: &Status) -> u32 {
    sum(&[
        (refused, flag::REFUSED),
        (status.out_of_range, flag::OUT_OF_RANGE),
        (status.quarantined, flag::QUARANTINED),
        (status.restarted, flag::RESTARTED),
    ])
}

/// Bits of the signals that terms need, in the order of this list.
pub mod need {
    use gmhm::terms::{Need, StackView};

    /// The bits of what terms need.
    pub(crate) fn bits(stack: &StackView<'_, f32>) -> u32 {
        let needs = ALL.iter().enumerate().filter(|(_, need)| stack.needs(**need));
        needs.fold(0, |bits, (bit, _)| bits | 1 << bit)
    }

    /// Bit k stands for the k-th.
    pub const ALL: [Need; 8] = [
        Need::MotorAngle,
        Need::OutputAngle,
        Need::Velocity,
        Need::Acceleration,
        Need::DeflectionRate,
        Need::Temperature,
        Need::MotorVelocity,
        Need::OutputVelocity,
    ];
}
