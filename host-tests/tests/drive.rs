//! The control tick on the host: encoder frames and duty cycles against a mock of the hardware, counts against exact fractions.

use core::cell::RefCell;
use core::convert::Infallible;

use embedded_hal_mock::eh1::pwm::{Mock as Pwm, Transaction as Duty};
use embedded_hal_mock::eh1::spi::{Mock as Spi, Transaction as Frame};
use gmhm::drive::as5047p::As5047pError;
use gmhm::drive::{
    As5047p, Cascade, CascadeState, CentredPwm, Encoder, EncoderPair, Fault, FromCounts, Gains, Joint, Mounting, Setup,
    SetupError, TorqueSink,
};
use gmhm::scalar::Fixed;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

const TAU: f64 = core::f64::consts::TAU;
const RATED_RAD: f64 = 1.168e-3;

fn frames(exchanges: &[(u16, u16)]) -> Vec<Frame<u8>> {
    let frame = |&(sent, answered): &(u16, u16)| {
        let [sent, answered] = [sent, answered].map(|word| word.to_be_bytes().to_vec());
        [Frame::transaction_start(), Frame::transfer_in_place(sent, answered), Frame::transaction_end()]
    };
    exchanges.iter().flat_map(frame).collect()
}

/// An answer with its parity.
fn answer(word: u16) -> u16 {
    word | if word.count_ones().is_multiple_of(2) { 0 } else { 1 << 15 }
}

/// Command words of the data sheet: the read of ANGLECOM is 0xFFFF, of NOP 0xC000, of ERRFL 0x4001.
#[test]
fn an_as5047p_is_read_in_two_frames() {
    for counts in [0, 1, 2, 0x1555, 0x2aaa, 0x3fff] {
        let mut bus = Spi::new(&frames(&[(0xffff, 0), (0xc000, answer(counts))]));
        let mut encoder = As5047p::new(bus.clone());
        assert_eq!(encoder.counts(), Ok(u32::from(counts)));
        bus.done();
    }
}

#[test]
fn a_lost_bit_is_a_parity_error() {
    for bit in 0..16 {
        let mut bus = Spi::new(&frames(&[(0xffff, 0), (0xc000, answer(0x1234) ^ (1 << bit))]));
        assert_eq!(As5047p::new(bus.clone()).counts(), Err(As5047pError::Parity));
        bus.done();
    }
}

#[test]
fn flags_of_an_as5047p_are_read_and_cleared() {
    for (flags, parity, invalid_command, framing) in
        [(0b100, true, false, false), (0b010, false, true, false), (0b001, false, false, true)]
    {
        let flagged = answer(1 << 14 | 77);
        let exchanges = [(0xffff, 0), (0xc000, flagged), (0x4001, 0), (0xc000, answer(flags))];
        let mut bus = Spi::new(&frames(&exchanges));
        let expected = As5047pError::Flagged { parity, invalid_command, framing };
        assert_eq!(As5047p::new(bus.clone()).counts(), Err(expected));
        bus.done();
    }
}

#[test]
fn half_the_period_is_no_torque() {
    let most = 1001;
    let expected = [
        (0.0, 500),
        (30.0, 1000),
        (-30.0, 0),
        (15.0, 750),
        (0.05, 501), // 0.83 counts
        (1e30, 1000),
        (f32::NEG_INFINITY, 0),
        (f32::NAN, 500),
    ];
    let duties = expected.iter().map(|&(_, duty)| Duty::set_duty_cycle(duty));
    let mut channel = Pwm::new(
        &[Duty::max_duty_cycle(most)].into_iter().chain(duties).chain([Duty::set_duty_cycle(500)]).collect::<Vec<_>>(),
    );
    let mut sink = CentredPwm::<_, f32>::new(channel.clone(), 30.0);
    for (torque, _) in expected {
        sink.set_torque(torque).unwrap();
    }
    sink.release().unwrap();
    channel.done();
}

fn setup(motor: u32, output: u32, ratio: (u32, u32)) -> Setup {
    let mounting = |counts_per_turn| Mounting { counts_per_turn, reversed: false };
    Setup {
        motor: mounting(motor),
        output: mounting(output),
        ratio,
        deflection_zero_rad: 0.0,
        rated_deflection_rad: RATED_RAD,
    }
}

/// 2π·(n_m/(N·C_m) − n_o/C_o), the numerator in integers of 128 bits.
fn deflection(setup: &Setup, motor: i64, output: i64) -> f64 {
    let (p, q) = (i128::from(setup.ratio.0), i128::from(setup.ratio.1));
    let (c_m, c_o) = (i128::from(setup.motor.counts_per_turn), i128::from(setup.output.counts_per_turn));
    let numerator = i128::from(motor) * q * c_o - i128::from(output) * c_m * p;
    TAU * numerator as f64 / (c_m * p * c_o) as f64
}

/// Thousands of turns of the output: the deflection stays exact, where `f32` angles would be a whole rated deflection off.
#[test]
fn deflection_keeps_its_digits_over_many_turns() {
    for setup in [
        setup(1 << 14, 1 << 14, (100, 1)),
        setup(1 << 20, 1 << 24, (100, 1)),
        setup(4096, 1 << 17, (101, 1)),
        setup(4000, 10_000, (201, 2)),
    ] {
        let pair32 = EncoderPair::<f32>::new(&setup).unwrap();
        let pair64 = EncoderPair::<f64>::new(&setup).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let turns = [setup.motor, setup.output].map(|m| i64::from(m.counts_per_turn));
        let ratio = f64::from(setup.ratio.0) / f64::from(setup.ratio.1);
        for _ in 0..2000 {
            let angle = rng.random_range(-1e5..1e5);
            let theta = rng.random_range(-3.0..3.0) * RATED_RAD;
            let motor = ((angle + theta) * ratio / TAU * turns[0] as f64).round() as i64;
            let output = (angle / TAU * turns[1] as f64).round() as i64;
            let exact = deflection(&setup, motor, output);
            let error64 = (pair64.deflection(motor, output) - exact).abs();
            assert!(error64 <= 4.0 * f64::EPSILON * exact.abs(), "{setup:?}: {error64}");
            let error32 = (f64::from(pair32.deflection(motor, output)) - exact).abs();
            assert!(error32 <= 2.0 * f64::from(f32::EPSILON) * exact.abs(), "{setup:?}: {error32}");
        }
    }
}

/// A shaft that turns for long, either way and mounted either way, from whatever turn the motor was in at the start.
#[test]
fn turns_are_followed_and_found() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for reversed in [[false, false], [true, false], [false, true], [true, true]] {
        let mut setup = setup(1 << 14, 1 << 17, (100, 1));
        [setup.motor.reversed, setup.output.reversed] = reversed;
        setup.deflection_zero_rad = 2.3e-4;
        let pair = EncoderPair::<f64>::new(&setup).unwrap();
        let raw = |counts: i64, mounting: Mounting| {
            let counts = if mounting.reversed { -counts } else { counts };
            counts.rem_euclid(i64::from(mounting.counts_per_turn)) as u32
        };
        let mut output: i64 = rng.random_range(-1_000_000..1_000_000);
        let mut velocity = 0;
        let mut last = None;
        for _ in 0..20_000 {
            velocity = (velocity + rng.random_range(-20..=20_i64)).clamp(-600, 600);
            output += velocity;
            let theta = rng.random_range(-1.0..1.0) * RATED_RAD;
            let angle = TAU * output as f64 / f64::from(1 << 17);
            let motor = ((angle + theta) * 100.0 / TAU * f64::from(1 << 14)).round() as i64;
            let raws = (raw(motor, setup.motor), raw(output, setup.output));
            let reading = match &last {
                Some(last) => pair.follow(last, raws.0, raws.1),
                None => pair.start(raws.0, raws.1),
            };
            let exact = deflection(&setup, motor, output) - setup.deflection_zero_rad;
            // The zero is rounded to 2e-8 of the rated deflection.
            assert!(
                (reading.deflection - exact).abs() < 2e-8 * RATED_RAD,
                "{reversed:?}: {} for {exact}",
                reading.deflection
            );
            let velocity_error =
                pair.output_velocity(&reading, 2000.0) - velocity as f64 * TAU / f64::from(1 << 17) * 2000.0;
            assert!(last.is_none() || velocity_error.abs() < 1e-9);
            let turn = pair.motor_angle(&reading) / TAU - motor as f64 / f64::from(1 << 14);
            assert!((turn - turn.round()).abs() < 1e-9);
            last = Some(reading);
        }
    }
}

/// Counts that were misread may seem to lead into another turn of the motor: the next good ones lead back.
#[test]
fn after_torn_counts_the_next_reading_is_right() {
    fn check<S: FromCounts>(unit: f64) {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let setup = setup(1 << 14, 1 << 17, (100, 1));
        let pair = EncoderPair::<S>::new(&setup).unwrap();
        let mut last = pair.start(0, 0);
        for k in 0..20_000 {
            let (angle, theta) = (1e-3 * f64::from(k), rng.random_range(-3.0..3.0) * RATED_RAD);
            let motor = ((angle + theta) * 100.0 / TAU * f64::from(1 << 14)).round() as i64;
            let output = (angle / TAU * f64::from(1 << 17)).round() as i64;
            let mut raws = [motor.rem_euclid(1 << 14) as u32, output.rem_euclid(1 << 17) as u32];
            let torn = rng.random_range(0..8);
            if torn < 2 {
                raws[torn] = rng.random();
            }
            last = pair.follow(&last, raws[0], raws[1]);
            if torn >= 2 {
                let error = last.deflection.to_f64() * unit - deflection(&setup, motor, output);
                assert!(error.abs() < 1e-6 * RATED_RAD, "{k}: {error}");
            }
        }
    }
    check::<f32>(1.0);
    check::<f64>(1.0);
    check::<Fixed>(RATED_RAD);
}

#[test]
fn a_pair_that_cannot_be_is_refused() {
    let refused = |change: fn(&mut Setup)| {
        let mut setup = setup(1 << 14, 1 << 14, (100, 1));
        change(&mut setup);
        EncoderPair::<f32>::new(&setup).err()
    };
    assert_eq!(refused(|_| ()), None);
    assert_eq!(refused(|s| s.motor.counts_per_turn = 0), Some(SetupError::Counts));
    assert_eq!(refused(|s| s.output.counts_per_turn = u32::MAX), Some(SetupError::Counts));
    assert_eq!(refused(|s| s.ratio = (0, 1)), Some(SetupError::Ratio));
    assert_eq!(refused(|s| s.ratio = (1, 0)), Some(SetupError::Ratio));
    assert_eq!(refused(|s| s.rated_deflection_rad = f64::NAN), Some(SetupError::Deflection));
    assert_eq!(refused(|s| s.rated_deflection_rad = 0.0), Some(SetupError::Deflection));
    assert_eq!(refused(|s| s.deflection_zero_rad = f64::NAN), Some(SetupError::Deflection));
    assert_eq!(refused(|s| s.motor.counts_per_turn = (1 << 30) - 1), Some(SetupError::TooFine));
}

/// An encoder that plays a list.
struct Player<'a>(&'a [Result<u32, &'static str>], usize);

impl Encoder for Player<'_> {
    type Error = &'static str;
    fn counts(&mut self) -> Result<u32, Self::Error> {
        self.1 += 1;
        self.0[self.1 - 1]
    }
}

/// A sink that writes down what it is told.
struct Log<'a>(&'a RefCell<Vec<Option<f32>>>);

impl TorqueSink<f32> for Log<'_> {
    type Error = Infallible;
    fn set_torque(&mut self, torque: f32) -> Result<(), Infallible> {
        self.0.borrow_mut().push(Some(torque));
        Ok(())
    }
    fn release(&mut self) -> Result<(), Infallible> {
        self.0.borrow_mut().push(None);
        Ok(())
    }
}

#[test]
fn a_fault_releases_the_torque_and_the_next_tick_finds_the_turn_anew() {
    let setup = setup(1 << 14, 1 << 14, (100, 1));
    let log = RefCell::default();
    // Half a turn of the output passes, fifty of the motor, while the encoder is away.
    let motor = [Ok(0), Err("gone"), Ok(0), Ok(100)];
    let output = [Ok(0), Ok(1 << 13), Ok((1 << 13) + 1)];
    let mut joint =
        Joint::new(Player(&motor, 0), Player(&output, 0), Log(&log), EncoderPair::<f32>::new(&setup).unwrap());
    let mut tick = || joint.tick(|reading| 1.0 + reading.deflection);
    assert_eq!(tick().unwrap().motor.counts, 0);
    assert!(matches!(tick(), Err(Fault::Motor("gone"))));
    let back = tick().unwrap();
    assert_eq!((back.deflection, back.motor.counts), (0.0, 50 << 14));
    let after = tick().unwrap();
    assert_eq!((after.deflection, after.motor.counts, after.motor.change), (0.0, (50 << 14) + 100, 100));
    assert_eq!(*log.borrow(), [Some(1.0), None, Some(1.0), Some(1.0)]);
}

/// A motor that is a mass and a constant load: the integral part takes the load, and nothing is left of a step.
#[test]
fn a_cascade_settles_and_keeps_its_limit() {
    let (inertia, load, period) = (0.5, 3.0, 5e-4);
    let gains = Gains {
        period_s: period,
        position_per_s: 60.0,
        velocity_nms_per_rad: 400.0 * inertia,
        integral_rad_per_s: 60.0,
        filter_rad_per_s: TAU * 300.0,
        limit_nm: 10.0,
    };
    let cascade = Cascade::<f32>::new(&gains).expect("gains");
    let mut state = CascadeState::default();
    let (mut angle, mut velocity, mut most) = (0.0_f64, 0.0_f64, 0.0_f32);
    for _ in 0..4000 {
        let torque = cascade.step(&mut state, (0.1 - angle) as f32, 0.0);
        most = most.max(torque.abs());
        velocity += period * (f64::from(torque) - load) / inertia;
        angle += period * velocity;
    }
    assert_eq!(most, 10.0);
    assert!((angle - 0.1).abs() < 1e-6, "{angle}");
}

#[test]
fn counts_round_to_the_nearest() {
    for (value, counts) in [(0.4_f32, 0), (0.6, 1), (-0.6, -1), (-0.4, 0), (1e30, i32::MAX), (-1e30, i32::MIN)] {
        assert_eq!(value.to_counts(1.0), counts);
    }
}
