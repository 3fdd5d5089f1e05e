//! Two encoders over the ratio and the zero of a block: from raw counts to the deflection and the angles of a sample.

use core::mem::MaybeUninit;

use gmhm::block::{Block, JointRecord, ScalesRecord, TorqueUnit, verify_first};
use gmhm::drive::{EncoderPair, Mounting, Reading};

use crate::facts::label;
use crate::types::{BlockC, EncodersC, SampleC, flag};
use crate::{NULL, OK, VALUE, bytes};

/// 64-bit words of `gmhm_pair`.
pub const PAIR_WORDS: usize = 17;

const _: () = assert!(
    size_of::<PairC>() <= 8 * PAIR_WORDS && align_of::<PairC>() <= align_of::<u64>(),
    "a pair does not fit into GMHM_PAIR_WORDS of gmhm.h"
);

/// The encoders of a joint and what they said last.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair {
    pair: EncoderPair<f32>,
    seen: Option<Reading<f32>>,
}

impl Pair {
    /// `None` where encoders and joint do not go together.
    pub(crate) fn new(joint: &JointRecord, rated_deflection_rad: f32, encoders: &EncodersC) -> Option<Self> {
        let mounting = |counts_per_turn, reversed| Mounting { counts_per_turn, reversed: reversed != 0 };
        let motor = mounting(encoders.motor_counts_per_turn, encoders.motor_reversed);
        let output = mounting(encoders.output_counts_per_turn, encoders.output_reversed);
        let setup = joint.joint().encoders(motor, output, widened(rated_deflection_rad)).ok()?;
        Some(Self { pair: EncoderPair::new(&setup).ok()?, seen: None })
    }

    /// The next counts are the first.
    pub(crate) fn restart(&mut self) {
        self.seen = None;
    }

    /// The sample with deflection and angles of these counts.
    pub(crate) fn sample(&mut self, motor: u32, output: u32, sample: &SampleC) -> SampleC {
        let Self { pair, seen } = self;
        let now = match seen {
            None => pair.start(motor, output),
            Some(last) => pair.follow(last, motor, output),
        };
        *seen = Some(now);
        SampleC {
            deflection_rad: now.deflection,
            motor_angle_rad: pair.motor_angle(&now),
            output_angle_rad: pair.output_angle(&now),
            ..*sample
        }
    }
}

/// A normal single as a double, in integers: `f64::from` links a routine of double precision.
fn widened(x: f32) -> f64 {
    let bits = x.to_bits();
    let (sign, exponent, fraction) = (bits >> 31, bits >> 23 & 0xff, bits & 0x7f_ffff);
    f64::from_bits(u64::from(sign) << 63 | u64::from(exponent + 1023 - 127) << 52 | u64::from(fraction) << 29)
}

/// `gmhm_pair`.
#[derive(Debug)]
pub struct PairC {
    encoders: EncodersC,
    /// CRC-32 of the block that ratio and zero are from.
    crc: u32,
    pair: Option<Pair>,
}

impl PairC {
    /// Over ratio and zero of a block in force, now or since it was loaded.
    pub(crate) fn of_block(&mut self, crc: u32, joint: &JointRecord, rated_deflection_rad: f32) -> Option<&mut Pair> {
        if self.crc != crc {
            self.crc = crc;
            self.pair = Pair::new(joint, rated_deflection_rad, &self.encoders);
        }
        self.pair.as_mut()
    }

    /// The next counts are the first.
    pub(crate) fn restart(&mut self) {
        if let Some(pair) = &mut self.pair {
            pair.restart();
        }
    }
}

/// What a block says of its joint, each number rounded in integers.
fn read(block: &Block<'_>) -> Result<BlockC, u16> {
    let header = block.header();
    let joint = JointRecord::of_block(block).map_err(|error| error.code())?;
    // A joint without motor-side angle has no gear.
    let scales = ScalesRecord::of_block(block).ok();
    Ok(BlockC {
        length: header.length,
        sequence: header.sequence,
        crc32: block.crc(),
        period_s: header.period_s,
        rated_deflection_rad: scales.map_or(0.0, |scales| scales.rated_deflection_rad()),
        torque_scale_nm: scales.map_or(0.0, |scales| scales.torque_scale_nm()),
        gear: label(&header.identity),
        ratio: joint.ratio(),
        deflection_zero_rad: joint.deflection_zero_rad(),
        torque_on_motor_side: u32::from(joint.motor_side()),
        torque_in_amperes: u32::from(header.torque_unit == TorqueUnit::Ampere),
        terms: block.records().filter(|record| record.is_plant_term()).count() as u32,
    })
}

/// See `gmhm.h`.
///
/// # Safety
/// The pointers are null or point to as much as `gmhm.h` says.
// SAFETY: no other symbol of the program has this name; gmhm.h reserves the prefix.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gmhm_read_block(block: *const u8, length: u32, to: Option<&mut MaybeUninit<BlockC>>) -> u16 {
    // SAFETY: the caller's, as above.
    let (Some(block), Some(to)) = (unsafe { bytes(block, length) }, to) else { return NULL };
    let to = to.write(BlockC::default());
    match verify_first(block).map_err(|error| error.code()).and_then(|block| read(&block)) {
        Ok(found) => {
            *to = found;
            OK
        }
        Err(code) => code,
    }
}

/// See `gmhm.h`.
///
/// # Safety
/// The pointers are null or point to as much as `gmhm.h` says.
// SAFETY: as for `gmhm_read_block`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gmhm_pair_init(
    pair: Option<&mut MaybeUninit<PairC>>,
    block: *const u8,
    length: u32,
    encoders: Option<&EncodersC>,
) -> u16 {
    let Some(pair) = pair else { return NULL };
    let pair = pair.write(PairC { encoders: encoders.copied().unwrap_or_default(), crc: 0, pair: None });
    // SAFETY: the caller's, as above.
    let (Some(block), Some(encoders)) = (unsafe { bytes(block, length) }, encoders) else { return NULL };
    let block = match verify_first(block) {
        Ok(block) => block,
        Err(error) => return error.code(),
    };
    let (joint, scales) = match (JointRecord::of_block(&block), ScalesRecord::of_block(&block)) {
        (Ok(joint), Ok(scales)) => (joint, scales),
        (Err(error), _) | (_, Err(error)) => return error.code(),
    };
    (pair.crc, pair.pair) = (block.crc(), Pair::new(&joint, scales.rated_deflection_rad(), encoders));
    if pair.pair.is_some() { OK } else { VALUE }
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_read_block`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_pair_restart(pair: Option<&mut PairC>) -> u16 {
    let Some(pair) = pair else { return NULL };
    pair.restart();
    OK
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_read_block`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_pair_read(
    pair: Option<&mut PairC>,
    motor: u32,
    output: u32,
    sample: Option<&mut SampleC>,
) -> u32 {
    let (Some(PairC { pair: Some(pair), .. }), Some(sample)) = (pair, sample) else { return flag::NO_ENCODERS };
    *sample = pair.sample(motor, output, sample);
    0
}

#[cfg(test)]
mod tests {
    use super::widened;

    #[test]
    fn a_single_is_widened_as_the_compiler_widens_it() {
        for x in [1.168e-3_f32, 1.0, -100.5, f32::MIN_POSITIVE, f32::MAX, 0.1255, 3.0e-5] {
            assert_eq!(widened(x).to_bits(), f64::from(x).to_bits());
        }
    }
}
