//! What may be asked of the bench.

use std::fmt;

use clap::{Args, ValueEnum};

use super::hide::Hide;
use super::joint::{Compensation, Plant};
use super::noise::Noise;

/// What the bench does with the gear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, ValueEnum)]
pub enum Experiment {
    /// Input locked, slow loading and unloading over several cycles, the first loading from rest included
    Cycle,
    /// Input locked, cycles of growing, then of shrinking amplitude
    Amplitudes,
    /// Input locked, the same cycle at several rates
    Rates,
    /// The motor runs many turns both ways at several speeds while the load varies
    Running,
    /// Input locked, a random load within a band of frequencies
    Dynamic,
    /// Input locked, a random deflection while the gear warms: stiffness falls by 10 %, hysteresis grows by 20 %, a little friction halves
    Drift,
    /// The gear in a flexible joint under a drive, the link tracking an angle
    Joint,
}

impl Experiment {
    /// Whether the motor stands still.
    pub const fn input_locked(self) -> bool {
        !matches!(self, Self::Running | Self::Joint)
    }
}

/// Its name on the command line and in keys.
impl fmt::Display for Experiment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&value_name(self))
    }
}

/// The name of a choice on the command line.
pub(super) fn value_name(choice: &impl ValueEnum) -> String {
    choice.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

/// How a stroke goes from one turning point to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Waveform {
    /// The deflection follows half a cosine
    #[default]
    Sine,
    /// The deflection changes at a constant rate
    Triangle,
    /// The load changes in steps of a fifteenth of the rated torque (2 N·m of 30) and rests after each
    Steps,
}

/// The options of an experiment. What is not given takes the experiment's default (`joint`: 24 s at 500 Hz, plant `model`, compensation `off`):
///
/// | | `cycle` | `amplitudes` | `rates` | `running` | `dynamic` | `drift` |
/// |---|---|---|---|---|---|---|
/// | amplitude | 1 | 0.25, 0.5, 0.75, 1, 0.75, 0.5, 0.25 | 1 | 1 | 1 | 1 |
/// | rate, Hz | 0.025 | 0.05 | 0.02, 0.1, 0.5, 2 | up to 0.5 | up to 5 | up to 1 |
/// | cycles of each | 3 | 1 | 2 | | | |
/// | duration, s | 130 | 145 | 112.75 | 60 | 40 | 600 |
/// | sample rate, Hz | 50 | 50 | 200 | 400 | 500 | 500 |
/// | speed, rad/s | 0 | 0 | 0 | 1 | 0 | 0 |
#[derive(Debug, Clone, PartialEq, Default, Args)]
pub struct Options {
    /// Length of the recording, s; with the input locked it sets the rate instead of --rate
    ///
    /// Defaults: cycle 130, amplitudes 145, rates 112.75, running 60, dynamic 40, drift 600. Joint always takes 24.
    #[arg(long = "duration", value_name = "S")]
    pub duration_s: Option<f64>,
    /// Samples a second
    ///
    /// Defaults: cycle and amplitudes 50, rates 200, running 400, dynamic, drift and joint 500.
    #[arg(long = "sample-rate", value_name = "HZ")]
    pub sample_rate_hz: Option<f64>,
    /// Amplitudes in turn, each a share of the rated deflection (running, dynamic: of the rated torque), above 0 to 1
    ///
    /// Default: 1; for amplitudes 0.25,0.5,0.75,1,0.75,0.5,0.25.
    #[arg(long = "amplitude", value_name = "SHARE,...", value_delimiter = ',')]
    pub amplitudes: Vec<f64>,
    /// Cycles a second, several in turn for rates; running, dynamic, drift: upper end of the band
    ///
    /// Defaults: cycle 0.025, amplitudes 0.05, rates 0.02,0.1,0.5,2, running 0.5, dynamic 5, drift 1.
    #[arg(long = "rate", value_name = "HZ,...", value_delimiter = ',')]
    pub rates_hz: Vec<f64>,
    /// Cycles of each amplitude and rate [default: cycle 3, amplitudes 1, rates 2]
    #[arg(long, value_name = "N")]
    pub cycles: Option<u32>,
    /// How a stroke goes from one turning point to the next
    #[arg(long, value_enum)]
    pub waveform: Option<Waveform>,
    /// Fastest output speed, rad/s (running) [default: 1]
    #[arg(long = "speed", value_name = "RAD_PER_S")]
    pub speed_rad_per_s: Option<f64>,
    /// Gear in the joint, or gear that warms (joint, drift) [default: the model's]
    #[arg(long, value_enum)]
    pub plant: Option<Plant>,
    /// How the drive compensates the gear's deflection (joint) [default: off]
    #[arg(long, value_enum)]
    pub compensation: Option<Compensation>,
    /// How much warmer the gear is at the end, K
    #[arg(long = "warm-up", value_name = "K", default_value_t = Options::WARM_UP_K)]
    pub warm_up_k: f64,
    /// Physics to hide in the gear, KIND=SIZE or KIND:SHAPE=SIZE; may be given several times
    ///
    /// SIZE is the rms in N·m that the effect leaves after the base model is refitted. Example: --hide kinematic_error=0.15 --hide wear:step=0.1. The values that
    /// the seed determines are written to the key.
    #[arg(long, value_name = "KIND=SIZE", value_delimiter = ',')]
    pub hide: Vec<Hide>,
    /// Noise of the sensors: none, or KEY=VALUE,... (see below) [default: that of a good bench]
    ///
    /// torque=RMS_NM, ar=A (noise of one sample carries over to the next by A, 0 to below 1), torque_step=NM (converter), encoder_bits=BITS
    /// (2^BITS counts a turn, both encoders; the deflection follows from them), outliers=RATE:SIZE_NM, velocity=RMS_RAD_PER_S, temperature=RMS_K.
    /// Keys that are not given add no noise. Example: torque=0.1,ar=0.95,encoder_bits=20,outliers=0.001:5. The default is
    /// torque=0.1 % and torque_step=1/16384 of the rated torque, ar=0.9, encoder_bits=26, temperature=0.02; for drift, torque=1 % of the rated torque and nothing else.
    #[arg(long, value_name = "NOISE")]
    pub noise: Option<Noise>,
}

impl Options {
    /// Default of [`warm_up_k`](Self::warm_up_k).
    pub const WARM_UP_K: f64 = 5.0;

    /// All defaults.
    pub fn new() -> Self {
        Self { warm_up_k: Self::WARM_UP_K, ..Self::default() }
    }
}
