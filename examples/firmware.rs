//! What firmware does with a parameter block, here on the host: from the stored bytes and encoder counts to torque, feed-forward and servo.
//!
//! `cargo run --package gmhm --features block --example firmware`. On a microcontroller the same lines stand in the timer interrupt; `src/bin/control` is a whole image.

use std::error::Error;

use gmhm::block::{Prepared, verify};
use gmhm::diagnostics::Diagnostics;
use gmhm::drive::{EncoderPair, Gains, Mounting, Reference, Servo, ServoSetup};
use gmhm::feedforward::{Controls, Demand, Limits, Settings};

/// The block, as `gmhm pack gear.toml -o params.bin` writes it and `gmhm flash` stores it; on a drive the store of the core reads it from flash.
static BLOCK: &[u8] = include_bytes!("bench/params.bin");

const COUNTS_PER_TURN: u32 = 1 << 20;

fn main() -> Result<(), Box<dyn Error>> {
    // At boot: everything is checked once, and an error leaves the drive with what it had. `Parameters` takes the terms of a block as well.
    let block = verify(BLOCK)?;
    let prepared = Prepared::<f32>::of_block(&block, 16)?;
    let gear = prepared.gear();
    // Ratio and zero are those of the block.
    let encoder = Mounting { counts_per_turn: COUNTS_PER_TURN, reversed: false };
    let encoders = prepared.encoders(&block, encoder, encoder)?;
    let pair = EncoderPair::<f32>::new(&encoders)?;
    println!("gear \"{}\", self-test {}", prepared.header.identity.label(), prepared.self_test.name());

    // From raw counts to torque: the motor turns, the output is held. A misread sample is refused and counted, and the torque stays.
    let mut reading = pair.start(0, 0);
    let mut state = gear.start::<16>(reading.deflection);
    let mut diagnostics = Diagnostics::default();
    for motor in (0..=15_000).step_by(1000) {
        reading = pair.follow(&reading, motor, 0);
        let merged = gear.merged_pairs(&state);
        gear.step(&mut state, reading.deflection);
        diagnostics.see_sample(&state.status());
        diagnostics.see_merged_pairs(merged, gear.merged_pairs(&state));
    }
    let out = gear.step(&mut state, f32::NAN);
    diagnostics.see_sample(&state.status());
    println!("{:.4} mrad: {:.2} N·m", 1e3 * reading.deflection, out.torque);
    println!("refused {}, last fault {}", diagnostics.refused, diagnostics.last.name());

    // Feed-forward: what the motor leads by for the torque that the gear shall carry. The top speed of the deflection is the gate on samples.
    let limits = Limits { period_s: 1e-3, ramp_s: 0.5, largest_rate_rad_per_s: 2.0, ..Limits::default() };
    let feed_forward = prepared.feed_forward(&limits)?;
    let mut joint = feed_forward.start::<16>(0.0);
    let controls = Controls { on: true, ..Controls::default() };
    for tick in 1..=2000 {
        let demand = Demand { torque: 0.01 * tick as f32, deflection: 0.0 };
        let contribution = feed_forward.step(&mut joint, &controls, &demand);
        if tick % 500 == 0 {
            println!("{:>4.1} N·m: motor leads by {:.4} mrad at the output", demand.torque, 1e3 * contribution.offset);
        }
    }
    // Other parameters with the loop running: no step of the command.
    let other = Prepared::<f32>::load(BLOCK, 16)?.feed_forward(&limits)?;
    other.take_over(&feed_forward, &mut joint);

    // The servo: raw counts and a reference to the torque of the motor.
    let gains = Gains {
        period_s: 1e-3,
        position_per_s: 40.0,
        velocity_nms_per_rad: 0.05,
        integral_rad_per_s: 30.0,
        filter_rad_per_s: 900.0,
        limit_nm: 2.0,
    };
    let setup = ServoSetup { encoders, reference_counts_per_turn: 1 << 30, gains, feed_forward: Settings::default() };
    let servo = Servo::of_feed_forward(other, &setup)?;
    let mut state = servo.start::<16>(0, 0, 0);
    let reference = Reference { counts: 1_000_000, torque: 5.0, feed_forward: 0.0 };
    let mut torque_nm = 0.0;
    for _ in 0..10 {
        torque_nm = servo.period(&mut state, &controls, &reference, 0, 0);
    }
    println!("servo: {torque_nm:.4} N·m at the motor, which stands still");
    Ok(())
}
