//! The image `node` as a host sees it: the block in force, and torques to compare with the host's own.

use gmhm::block::{ScalarKind, Scales, Word};
use gmhm::link::message::MOST_BYTES;
use gmhm::memory::MemoryLaw;
use gmhm::memory::masing::Masing;
use gmhm::scalar::Fixed;
use gmhm::{Gear, Params};
use gmhm_tools::device::Client;
use gmhm_tools::model::Model;

use crate::arithmetic::Measures;
use crate::{Failure, arithmetic, check};

/// The block in force, read from the drive.
pub fn block_in_force(drive: &mut Client) -> Result<Vec<u8>, Failure> {
    let length = drive.status()?.length as usize;
    let mut bytes = Vec::new();
    while bytes.len() < length {
        let part = (length - bytes.len()).min(MOST_BYTES) as u8;
        bytes.extend(drive.read(bytes.len() as u32, part)?);
    }
    Ok(bytes)
}

/// What the host makes of a model file: the drive's gear, on the drive's path.
pub struct Twin {
    params: Params,
    scalar: ScalarKind,
}

/// How far the drive was followed.
pub struct Followed {
    /// Samples that were compared.
    pub samples: usize,
    /// Control periods that led to the last.
    pub ticks: u32,
}

impl Twin {
    /// The twin of the drive that has this model and computes in this arithmetic.
    pub fn of(model: &Model, scalar: ScalarKind) -> Result<Self, Failure> {
        let rated = model.gear.rated_deflection_rad.ok_or("the model has no rated deflection")?;
        let params = model.params(rated).ok_or("the model has no gear")??;
        Ok(Self { params, scalar })
    }

    /// Compares samples of the running drive with the host's: deflection, torque, hysteresis torque, to the bit.
    pub fn follow(&self, drive: &mut Client, samples: usize) -> Result<Followed, Failure> {
        match self.scalar {
            ScalarKind::F32 => self.follow_in(Gear::<f32>::new(&self.params), drive, samples),
            ScalarKind::Fixed => {
                let gear = Gear::with_law(&self.params, Masing::<Fixed>::new(&self.params));
                self.follow_in(gear, drive, samples)
            }
        }
    }

    fn follow_in<S: Word, L: MemoryLaw<S>>(
        &self,
        gear: Gear<S, L>,
        drive: &mut Client,
        samples: usize,
    ) -> Result<Followed, Failure> {
        let Scales { rated_deflection_rad, torque_scale_nm } = Scales::of(&self.params);
        let measures = Measures { rated_rad: rated_deflection_rad as f32, torque_nm: torque_scale_nm as f32 };
        let mut state = gear.start::<16>(S::ZERO);
        let mut path = arithmetic::path();
        let mut output = gear.output(&state);
        let (mut ticks, mut moving) = (0, 0);
        for _ in 0..samples {
            let live = drive.live()?;
            check(live.ticks >= ticks, "the drive began anew")?;
            while ticks < live.ticks {
                output = gear.step(&mut state, arithmetic::next_deflection(&mut path, &measures));
                ticks += 1;
            }
            let found = [live.deflection_rad, live.torque_nm, live.hysteresis_nm].map(f32::to_bits);
            let torques = [output.torque, output.hysteresis];
            let [torque, hysteresis] = torques.map(|torque| arithmetic::torque_nm(torque, &measures));
            let expected = [arithmetic::deflection_rad(state.theta(), &measures), torque, hysteresis].map(f32::to_bits);
            let same = live.words == torques.map(S::word)
                && found == expected
                && (live.out_of_range, live.refused) == arithmetic::flags(state.status());
            check(same, &format!("after {ticks} control periods the drive has {live:?}, the host {output:?}"))?;
            moving += usize::from(output.hysteresis != S::ZERO);
        }
        check(ticks as usize >= samples, "the drive stands still")?;
        check(2 * moving > samples, "the drive computes no hysteresis")?;
        Ok(Followed { samples, ticks })
    }
}
