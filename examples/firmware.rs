//! What firmware does with a parameter block, here on the host: load it once, then feed forward in every control tick.
//!
//! `cargo run --package gmhm --features block --example firmware`. On a microcontroller the same lines stand in the timer interrupt; `src/bin/control` is a whole image.

use std::error::Error;

use gmhm::block::Parameters;
use gmhm::feedforward::{Controls, Demand, FeedForward, Settings, Source};
use gmhm::{Elastic, Inverse, Memory, Params};

/// The block, as `gmhm pack gear.toml -o params.bin` writes it and `gmhm flash` stores it; on a drive the store of the core reads it from flash.
static BLOCK: &[u8] = include_bytes!("bench/params.bin");

const PERIOD_S: f64 = 1e-3;

fn main() -> Result<(), Box<dyn Error>> {
    // At boot: everything is checked once, and an error leaves the drive with what it had.
    let parameters = Parameters::<f32>::load(BLOCK, 16)?;
    let inverse: &Inverse<f32> = parameters.inverse.as_ref().ok_or("the block has no inverse")?;
    println!("gear \"{}\", inverse up to {:.3} mrad", parameters.header.identity.label(), 1e3 * inverse.range());

    // A joint whose link is pressed harder and harder: the inverse gives the deflection that the motor has to lead by.
    let mut state = inverse.gear().start::<16>(0.0);
    for tick in 0..=3 {
        let torque_nm = 5.0 * tick as f32;
        let solution = inverse.commit(&mut state, torque_nm).0;
        println!("{torque_nm:>5.1} N·m: motor leads by {:.4} mrad at the output", 1e3 * solution.theta);
    }

    // The same with ramp, gain and an unknown past, from parameters in the source.
    let elastic = Elastic { c1_nm_per_rad: 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
    let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::default() };
    let params = Params::new(1.168e-3, elastic, memory)?;
    // The top speed of the deflection: what the encoders show beyond it is quarantined.
    let settings = Settings { period_s: PERIOD_S, ramp_s: 0.5, largest_rate_rad_per_s: 2.0, ..Settings::default() };
    let feed_forward = FeedForward::<f32>::new(&params, &settings)?;
    let mut joint = feed_forward.start::<16>(0.0);
    let controls = Controls { on: true, source: Source::Reference, ratio: 1.0 };
    for tick in 1..=1000 {
        let demand = Demand { torque: 0.02 * tick as f32, deflection: 0.0 };
        let _ = feed_forward.step(&mut joint, &controls, &demand);
    }
    println!("after 1 s: offset {:.4} mrad, gain {:.2}", 1e3 * joint.contribution().offset, joint.contribution().gain);
    Ok(())
}
