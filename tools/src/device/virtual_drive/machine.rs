//! The joint of a simulated drive: input held, output loaded to and fro, slowly and by different amounts.

use std::f64::consts::TAU;
use std::time::Instant;

use gmhm::adapt::{Adaptation, AdaptationState, Change, Settings};
use gmhm::block::{Block, BlockError, Parameters, ScalarKind, Scales};
use gmhm::diagnostics::Diagnostics;
use gmhm::link::{Adapted, CompensationSetting, Drive, Live};
use gmhm::terms::compensated::CompensatedState;
use gmhm::terms::{Compensated, Sample};
use gmhm::{Gear, Output, Params};

/// Turning points that it has room for.
const DEPTH: usize = 16;
/// Control period, s.
const PERIOD_S: f64 = 1e-3;
/// Control periods in one [`Machine::advance`], at most.
const MOST_PERIODS: u32 = 1000;
/// The load, s a cycle, and how its amplitude swells.
const CYCLE_S: f64 = 4.0;
const SWELL_S: f64 = 30.0;
const AMPLITUDES: [f64; 2] = [0.7, 0.25];

/// What stiffness and hysteresis of a warm gear are, of those of the block.
const WARM: [f32; 2] = [0.9, 1.2];
/// Noise of the measured torque, of the torque scale, peak to peak.
const NOISE: f32 = 0.02;

/// The joint and what its drive computes.
#[derive(Default)]
pub struct Machine {
    in_force: Option<Parameters>,
    running: Option<Running>,
    /// Whether the power stage is on.
    pub enabled: bool,
    /// The gear warms within so many seconds from the start of its parameters on; otherwise it stays cold.
    pub warms_s: Option<f32>,
    compensation: CompensationSetting,
    diagnostics: Diagnostics,
    ticks: u32,
    loop_cost: u32,
    waiting_s: f64,
}

struct Running {
    gear: Compensated<f32>,
    state: CompensatedState<f32, DEPTH>,
    scales: Scales,
    adapting: Option<Adapting>,
}

/// The adaptation of a gear of law `masing`.
struct Adapting {
    block: Params,
    of_block: Gear<f32>,
    adaptation: Adaptation<f32>,
    state: AdaptationState<f32>,
    noise: u32,
}

impl Adapting {
    fn of(parameters: &Parameters) -> Option<Self> {
        let (block, of_block) = (parameters.params()?, parameters.gear?);
        let settings = Settings { period_s: PERIOD_S, ..Settings::default() };
        let adaptation = Adaptation::new(&block, &settings).ok()?;
        Some(Self { block, of_block, state: adaptation.start(), adaptation, noise: 1 })
    }

    /// What a sensor measures where the gear has warmed by a share, terms taken off.
    fn measured(&mut self, Output { torque, hysteresis, .. }: Output<f32>, share: f32) -> f32 {
        self.noise = self.noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = NOISE * ((self.noise >> 8) as f32 / 16_777_216.0 - 0.5);
        let [stiffness, loss] = WARM.map(|warm| 1.0 + (warm - 1.0) * share);
        stiffness * (torque - hysteresis) + loss * hysteresis + noise * self.block.torque_scale_nm() as f32
    }

    /// A control period; the gear to be put in force, if another is.
    fn period(&mut self, running: &CompensatedState<f32, DEPTH>, share: f32) -> Option<Gear<f32>> {
        let torque = self.measured(self.of_block.output(running.gear()), share);
        match self.adaptation.period(&mut self.state, running.gear(), torque) {
            Change::None => None,
            Change::GivenBack => Some(self.of_block),
            Change::TakenOver => {
                let params = self.adaptation.params(&self.state, &self.block).ok();
                if params.is_none() {
                    self.state.give_back();
                }
                params.map(|params| Gear::new(&params))
            }
        }
    }
}

/// The sample of a control period.
fn sample(tick: u32, rated_deflection_rad: f64) -> Sample<f32> {
    let time = f64::from(tick) * PERIOD_S;
    let at = |time: f64| {
        let amplitude = AMPLITUDES[0] + AMPLITUDES[1] * (TAU * time / SWELL_S).sin();
        amplitude * rated_deflection_rad * (TAU * time / CYCLE_S).sin()
    };
    let (theta, rate) = (at(time), (at(time) - at(time - PERIOD_S)) / PERIOD_S);
    Sample {
        time: time as f32,
        period: PERIOD_S as f32,
        output_angle: -theta as f32,
        deflection: theta as f32,
        deflection_rate: rate as f32,
        velocity: -rate as f32,
        output_velocity: -rate as f32,
        ..Sample::default()
    }
}

impl Machine {
    /// Lets the control periods of so many seconds pass, at most those of one second.
    pub fn advance(&mut self, seconds: f64) {
        let periods = ((self.waiting_s + seconds) / PERIOD_S).floor();
        self.waiting_s += seconds - periods * PERIOD_S;
        let Some(running) = &mut self.running else { return };
        for _ in 0..(periods as u32).min(MOST_PERIODS) {
            self.ticks = self.ticks.wrapping_add(1);
            let sample = sample(self.ticks, running.scales.rated_deflection_rad);
            let merged = running.gear.gear.merged_pairs(running.state.gear());
            let began = Instant::now();
            running.gear.step(&mut running.state, &sample);
            let warm = self.warms_s.map_or(0.0, |warms_s| (self.ticks as f32 * PERIOD_S as f32 / warms_s).min(1.0));
            if let Some(gear) = running.adapting.as_mut().and_then(|adapting| adapting.period(&running.state, warm)) {
                let next = Compensated { gear, stack: running.gear.stack.clone() };
                next.take_over(&running.gear.gear, &mut running.state);
                running.gear = next;
            }
            self.diagnostics.see_sample(&running.state.gear().status());
            self.diagnostics.see_merged_pairs(merged, running.gear.gear.merged_pairs(running.state.gear()));
            self.loop_cost = u32::try_from(began.elapsed().as_nanos()).unwrap_or(u32::MAX);
        }
    }

    /// The sequence number of the block in force.
    pub fn sequence(&self) -> Option<u32> {
        self.in_force.as_ref().map(|parameters| parameters.header.sequence)
    }
}

impl Drive for Machine {
    fn arithmetic(&self) -> (ScalarKind, u16) {
        (ScalarKind::F32, DEPTH as u16)
    }

    fn is_enabled(&self) -> bool {
        self.enabled
    }

    fn adopt(&mut self, block: Option<&Block<'_>>) -> Result<(), BlockError> {
        // It moves nothing: torques are shown in the unit of the block.
        let load = |block: &Block<'_>| Parameters::of_any_block(block, DEPTH, block.header().torque_unit);
        let parameters: Option<Parameters> = match block.map(load) {
            None => None,
            Some(loaded) => {
                self.diagnostics.see_load(loaded.as_ref().map(|parameters: &Parameters| parameters.self_test));
                Some(loaded?)
            }
        };
        self.running = parameters.as_ref().and_then(|parameters| {
            let (gear, scales) = (parameters.compensated()?, parameters.scales?);
            let state = gear.start(&sample(0, scales.rated_deflection_rad));
            Some(Running { gear, state, scales, adapting: Adapting::of(parameters) })
        });
        self.in_force = parameters;
        self.ticks = 0;
        Ok(())
    }

    fn compensation(&self) -> CompensationSetting {
        self.compensation
    }

    fn set_compensation(&mut self, compensation: CompensationSetting) {
        self.compensation = compensation;
    }

    fn adaptation(&self) -> Option<Adapted> {
        let adapting = self.running.as_ref()?.adapting.as_ref()?;
        Some(Adapted::of(&adapting.adaptation, &adapting.state))
    }

    fn diagnostics(&self) -> Diagnostics {
        self.diagnostics
    }

    fn clear_diagnostics(&mut self) {
        self.diagnostics.clear();
    }

    fn live(&self) -> Live {
        let Some(Running { state, .. }) = &self.running else { return Live::default() };
        let (total, gear) = (state.last(), state.gear());
        let hysteresis_nm = total.base.hysteresis;
        Live {
            deflection_rad: gear.theta(),
            torque_nm: total.torque,
            hysteresis_nm,
            words: [total.torque.to_bits(), hysteresis_nm.to_bits()],
            contribution_nm: self.compensation.of(hysteresis_nm),
            out_of_range: gear.status().out_of_range,
            refused: total.refused,
            ticks: self.ticks,
            loop_cost: self.loop_cost,
        }
    }
}
