//! The image `node` as a host sees it: the block in force, and torques to compare with the host's own.

use gmhm::link::message::MOST_BYTES;
use gmhm::{Gear, Params};
use gmhm_tools::device::Client;
use gmhm_tools::model::Model;

use crate::journey::Journey;
use crate::{Failure, check};

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
}

/// How far the drive was followed.
pub struct Followed {
    /// Samples that were compared.
    pub samples: usize,
    /// Control periods that led to the last.
    pub ticks: u32,
}

impl Twin {
    /// The twin of the drive that has this model.
    pub fn of(model: &Model) -> Result<Self, Failure> {
        let rated = model.gear.rated_deflection_rad.ok_or("the model has no rated deflection")?;
        let params = model.params(rated).ok_or("the model has no gear")??;
        Ok(Self { params })
    }

    /// Compares samples of the running drive with the host's: deflection, torque, hysteresis torque, to the bit.
    pub fn follow(&self, drive: &mut Client, samples: usize) -> Result<Followed, Failure> {
        let gear = Gear::<f32>::new(&self.params);
        let mut state = gear.start::<16>(0.0);
        let mut path = Journey::new(self.params.rated_deflection_rad() as f32);
        let mut output = gear.output(&state);
        let (mut ticks, mut moving) = (0, 0);
        for _ in 0..samples {
            let live = drive.live()?;
            check(live.ticks >= ticks, "the drive began anew")?;
            while ticks < live.ticks {
                output = gear.step(&mut state, path.next_deflection());
                ticks += 1;
            }
            let found = [live.deflection_rad, live.torque_nm, live.hysteresis_nm].map(f32::to_bits);
            let expected = [state.theta(), output.torque, output.hysteresis].map(f32::to_bits);
            let status = state.status();
            let same = found == expected
                && live.words == [expected[1], expected[2]]
                && (live.out_of_range, live.refused) == (status.out_of_range, status.refused);
            check(
                same,
                &format!("after {ticks} control periods the drive has {live:?}, the host {state:?} {output:?}"),
            )?;
            moving += usize::from(output.hysteresis != 0.0);
        }
        check(ticks as usize >= samples, "the drive stands still")?;
        check(2 * moving > samples, "the drive computes no hysteresis")?;
        Ok(Followed { samples, ticks })
    }
}
