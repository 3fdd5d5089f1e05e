//! Concealed cases from a generator that shares nothing with the detector.

mod arm;
mod families;
mod kinds;
mod linear;
mod motion;
mod noise;
mod odd;
mod omitted;
mod physics;
mod plant_model;
mod rng;
mod simulated;
mod truth;

use kinds::coordinate_names;
pub use kinds::{FRICTION, KINDS, OUTSIDE, coordinates, fits_a_joint, parts};
pub use noise::{Colour, real_residuals};
pub use omitted::kinds as omitted_kinds;
pub use rng::{Rng, case_seed};

pub use plant_model::PlantKind;
pub(crate) use plant_model::{Gear, Hysteresis, PlantModel, stop};

use kinds::Hidden;
use motion::{MotionKind, Plan};
use noise::{Noise, quantise, rms};
use physics::{Piece, Sign};
use plant_model::Joint;
use truth::{Experiment, Scaled, Truth};

use super::key::{HiddenEffect, INDISTINGUISHABLE, Key, Role};
use crate::model::{Model, TorqueSide};
use crate::recording::Recording;

/// What a case is to hold; everything else is drawn from its seed.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseSpec {
    /// The block of the proof.
    pub block: String,
    /// The plant model.
    pub plant_model: PlantKind,
    /// Kinds to hide (of [`KINDS`] or [`OUTSIDE`]) and the rms each leaves, N·m; on an arm, kinds of [`omitted_kinds`] and
    /// each one's rms beside the others'. Empty for a null.
    pub effects: Vec<(String, f64)>,
    /// The colours that the noise may have.
    pub colour: Colour,
    /// Kinds taken out of the detector's library.
    pub removed: Vec<String>,
    /// Residual of a real recording, unit variance, to be used as noise.
    pub real: Option<Vec<f64>>,
    /// Effects 30 to 100 times the noise, of shapes that are some percent off every textbook, at 0.1 to 5 kHz.
    pub loud: bool,
}

/// A recording that the detector never sees, free of noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Unseen {
    /// The measured channels, without the torque.
    pub recording: Recording,
    /// The true torque, N·m.
    pub torque_nm: Vec<f64>,
    /// Rms that the base model, fitted to the case's noise-free recordings, leaves here, N·m.
    pub base_leaves_nm: f64,
}

/// One concealed case.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// What the detector sees.
    pub recordings: Vec<Recording>,
    /// The base model it is handed.
    pub base: Model,
    /// Kinds that it may not use.
    pub removed: Vec<String>,
    /// The same recordings without noise, to check the key by; nobody sees them.
    pub noise_free: Vec<Recording>,
    /// What it never sees.
    pub unseen: Vec<Unseen>,
    /// The key.
    pub key: Key,
}

/// How often a motion and its effects are drawn anew until the effects can be seen and have a sane size.
const ATTEMPTS: u64 = 12;
/// Least and largest rms of the noise beside loud effects, N·m.
const LOUD_NOISE_NM: [f64; 2] = [0.01, 0.1];
/// Rows of a loud case, at least and at most, and the time that it should last, s.
const LOUD_ROWS: [f64; 2] = [3000.0, 20_000.0];
const LOUD_SECONDS: f64 = 15.0;

struct Draft {
    experiment: Experiment,
    hidden: Vec<Hidden>,
    scales: Vec<f64>,
    before: Vec<f64>,
}

/// Makes the case of `seed`.
pub fn case(seed: u64, spec: &CaseSpec) -> Case {
    if matches!(spec.plant_model, PlantKind::Arm | PlantKind::ArmTerms) {
        return simulated::case(seed, spec);
    }
    let rng = Rng::new(seed);
    let mut noise = Noise::draw(&mut rng.stream(1), spec.colour);
    if spec.loud && spec.plant_model == PlantKind::Gmhm && !spec.effects.is_empty() {
        let all_nm = spec.effects.iter().map(|e| e.1 * e.1).sum::<f64>().sqrt();
        noise.rms_nm = (all_nm / rng.stream(5).log_uniform(30.0, 100.0)).clamp(LOUD_NOISE_NM[0], LOUD_NOISE_NM[1]);
        noise.torque_step_nm = noise.torque_step_nm.min(noise.rms_nm);
    }
    if let Some(real) = &spec.real {
        noise = Noise { name: "real".to_owned(), real: Some(real.clone()), torque_step_nm: 0.0, ..noise };
    }
    let mut made = None;
    for attempt in 0..ATTEMPTS {
        let Some(draft) = draft(&rng, attempt, spec) else { continue };
        let case = record(seed, &rng, spec, &noise, &draft);
        let done = case.key.hidden().all(|e| e.visible);
        made = Some(case);
        if done {
            break;
        }
    }
    // A combination that no motion shows at a sane size becomes what it looks like: a null, and its key says so.
    made.unwrap_or_else(|| case(seed, &CaseSpec { effects: Vec::new(), ..spec.clone() }))
}

fn draft(rng: &Rng, attempt: u64, spec: &CaseSpec) -> Option<Draft> {
    let mut choose = rng.stream(100 + attempt);
    let names: Vec<&str> = spec.effects.iter().map(|e| e.0.as_str()).collect();
    let kind = motion_for(&mut choose, spec.plant_model, &names);
    let plant_model = match spec.plant_model {
        PlantKind::Joint => PlantModel::Joint(Joint::draw(&mut choose)),
        other => PlantModel::Bench(Gear::draw(&mut choose, other, spec.loud)),
    };
    let rated = if let PlantModel::Bench(gear) = &plant_model { gear.rated } else { 1.0 };
    let slow = names.iter().any(|k| kinds::slow(k));
    let mut plan = Plan::draw(&mut choose, kind, rated, slow);
    names.iter().for_each(|k| kinds::prepare(k, &mut choose, &mut plan));
    if spec.loud && !slow {
        plan.period_s = choose.pick(&[0.01, 0.004, 0.002, 0.001, 0.001, 0.0005, 0.0002]);
    }
    let side = match kind {
        MotionKind::Joint => TorqueSide::Motor,
        k if k.turns() && choose.chance(0.3) => TorqueSide::Motor,
        _ => TorqueSide::Output,
    };
    let bare = names.iter().any(|k| matches!(*k, "coulomb_friction" | "viscous_friction"));
    let wanted = names.contains(&"thermal_friction") || (kind.turns() && choose.chance(0.3));
    let extra = (kind != MotionKind::Joint && wanted && !bare).then(|| {
        [choose.uniform(0.5, 3.0), plan.speed * choose.uniform(0.02, 0.05), choose.uniform(0.1, 0.5) / plan.speed]
    });
    let rows = match spec.loud {
        true if !slow => (LOUD_SECONDS / plan.period_s).clamp(LOUD_ROWS[0], LOUD_ROWS[1]) as usize,
        _ if slow => 5000,
        _ => choose.pick(&[3000, 4000, 5000]),
    };
    let recordings = if choose.chance(0.15) { 2 } else { 1 };
    let motions = (0..recordings).map(|i| plan.motion(&mut rng.stream(200 + 8 * attempt + i), rows, false)).collect();
    let experiment = Experiment { plant_model, plan, side, extra, motions };
    let world = experiment.truth(&[]).swap_remove(0).world;
    let mut hidden: Vec<Hidden> = names.iter().map(|k| kinds::draw(k, &mut choose, &world)).collect();
    if spec.loud {
        hidden.iter_mut().for_each(|h| odd::bend(h, &mut choose, &world));
    }
    let (mut scales, mut before) = (Vec::new(), Vec::new());
    for (hidden, (_, size_nm)) in hidden.iter().zip(&spec.effects) {
        let (scale, rms_nm) = experiment.scale(hidden, *size_nm)?;
        // An effect larger than a sixth of the rated torque would be no secret, unless it is meant to be loud.
        let rated_nm = rms(&world.base);
        if rms_nm > if spec.loud { 0.6 } else { 0.17 } * rated_nm.max(5.0) {
            return None;
        }
        scales.push(scale);
        before.push(rms_nm);
    }
    Some(Draft { experiment, hidden, scales, before })
}

fn motion_for(rng: &mut Rng, plant_model: PlantKind, names: &[&str]) -> MotionKind {
    if plant_model == PlantKind::Joint {
        return MotionKind::Joint;
    }
    let all = [MotionKind::LockedCycles, MotionKind::Running, MotionKind::BandLimited, MotionKind::RunningBandLimited];
    let common: Vec<MotionKind> =
        all.into_iter().filter(|m| names.iter().all(|k| kinds::motions(k).contains(m))).collect();
    if !common.is_empty() {
        return rng.pick(&if names.is_empty() { all.to_vec() } else { common });
    }
    // Two kinds without a common choice: what needs a turning motor decides.
    if names.iter().any(|k| kinds::motions(k).iter().all(|m| m.turns())) { MotionKind::Running } else { rng.pick(&all) }
}

/// Adds noise, works out the key and packs the case.
fn record(seed: u64, rng: &Rng, spec: &CaseSpec, noise: &Noise, draft: &Draft) -> Case {
    let experiment = &draft.experiment;
    let effects: Vec<Scaled> = draft.hidden.iter().zip(draft.scales.iter().copied()).collect();
    let truths = experiment.truth(&effects);
    let mut measure = rng.stream(2);
    let (mut recordings, mut realised, mut noise_free) = (Vec::new(), Vec::new(), Vec::new());
    for (index, truth) in truths.iter().enumerate() {
        let (recording, left) = measured(&mut measure, experiment, truth, Some(noise), index);
        recordings.push(recording);
        noise_free.push(measured(&mut Rng::new(0), experiment, truth, None, index).0);
        realised.push(left);
    }
    let (base, handed) = handed(&mut rng.stream(3), experiment, &effects, noise, spec.plant_model);
    let mut entries: Vec<HiddenEffect> = (0..effects.len())
        .map(|i| {
            let leaves = experiment.unexplained(&effects, i, &realised, !spec.loud);
            let (hidden, size) = (&draft.hidden[i], spec.effects[i].1);
            let entry = entry(hidden, draft.scales[i], size, draft.before[i], leaves, &spec.removed);
            let share = spec.loud.then(|| size / experiment.leaves(&effects));
            HiddenEffect { share, ..entry }
        })
        .collect();
    entries.extend(nature_entry(experiment, noise));
    entries.extend(draft.hidden.iter().filter_map(shape_entry));
    let unseen = {
        let fitted = experiment.refitted(&effects);
        let rows = experiment.motions[0].time_s.len();
        let motions = vec![experiment.plan.motion(&mut rng.stream(4), rows, true)];
        let elsewhere = Experiment { motions, ..experiment.clone() };
        let truths = elsewhere.truth(&effects);
        let columns = elsewhere.base_columns(&truths, false);
        let parameters = columns.len() - 1;
        truths.iter().map(|truth| pack_unseen(&elsewhere, truth, &columns[..parameters], &fitted)).collect()
    };
    let key = Key {
        block: spec.block.clone(),
        seed,
        plant_model: format!("{:?}", spec.plant_model).to_lowercase(),
        motion: format!("{:?}", experiment.plan.kind),
        remanent: experiment.motions.iter().any(|m| !m.history.is_empty()),
        noise: noise.name.clone(),
        noise_rms_nm: noise.rms_nm,
        handed: handed.to_owned(),
        removed: spec.removed.clone(),
        effects: entries,
    };
    Case { recordings, base, removed: spec.removed.clone(), noise_free, unseen, key }
}

fn pack_unseen(experiment: &Experiment, truth: &Truth, columns: &[Vec<f64>], fitted: &[f64]) -> Unseen {
    let (mut recording, _) = measured(&mut Rng::new(0), experiment, truth, None, 0);
    recording.torque = None;
    let left: Vec<f64> = (0..truth.torque.len())
        .map(|i| truth.torque[i] - columns.iter().zip(fitted).map(|(c, w)| w * c[i]).sum::<f64>())
        .collect();
    Unseen { recording, torque_nm: truth.torque.clone(), base_leaves_nm: deviation(&left) }
}

/// Rms about the mean.
pub fn deviation(x: &[f64]) -> f64 {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    rms(&x.iter().map(|x| x - mean).collect::<Vec<f64>>())
}

/// The recording of `truth`, and the noise in it as the base model would see it. Without `noise`: the bare channels.
fn measured(
    rng: &mut Rng,
    experiment: &Experiment,
    truth: &Truth,
    noise: Option<&Noise>,
    index: usize,
) -> (Recording, Vec<f64>) {
    let rows = truth.torque.len();
    let world = &truth.world;
    let joint = matches!(experiment.plant_model, PlantModel::Joint(_));
    let offset = if noise.is_some() { rng.uniform(-0.5, 0.5) } else { 0.0 };
    let clean = vec![0.0; rows];
    let torque_noise = noise.map_or(clean, |n| n.torque(rng, rows));
    let (step_nm, theta_rms, theta_step) =
        noise.map_or((0.0, 0.0, 0.0), |n| (n.torque_step_nm, n.deflection_rms_rad, n.deflection_step_rad));
    let torque: Vec<f64> = (0..rows).map(|i| quantise(truth.torque[i] + offset + torque_noise[i], step_nm)).collect();
    let deflection: Vec<f64> =
        truth.measured.iter().map(|x| quantise(x + theta_rms * rng.normal(), theta_step)).collect();
    let left = (0..rows)
        .map(|i| torque[i] - offset - truth.torque[i] - world.c1 * (deflection[i] - truth.measured[i]))
        .collect();
    let mut recording = Recording {
        name: format!("concealed recording {}", index + 1),
        time_s: world.time_s.clone().into(),
        torque: Some(torque.into()),
        temperature_c: world.temperature.as_ref().map(|t| {
            t.iter().map(|t| if noise.is_some() { quantise(t + 0.05 * rng.normal(), 0.01) } else { *t }).collect()
        }),
        ..Recording::default()
    };
    let fastest = world.velocity.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let with_velocity = if joint { rng.chance(0.7) } else { rng.chance(0.3) };
    let output =
        |theta: &[f64]| -> Vec<f64> { (0..rows).map(|i| world.motor[i] / experiment.plan.ratio - theta[i]).collect() };
    if joint {
        let step = if noise.is_some() { 2e-6 * 10.0_f64.powf(rng.uniform(0.0, 1.0)) } else { 0.0 };
        recording.theta_out_rad = Some(output(&truth.measured).iter().map(|q| quantise(*q, step)).collect());
    } else {
        recording.theta_in_rad = Some(world.motor.clone().into());
        recording.theta_out_rad = Some(output(&deflection).into());
        recording.deflection_rad = Some(deflection.into());
    }
    if with_velocity || (noise.is_none() && joint) {
        let spread = if noise.is_some() { 1e-3 * fastest } else { 0.0 };
        let speed = motion::derivative(&world.output, world.period_s);
        recording.velocity_out_rad_per_s = Some(speed.iter().map(|v| v + spread * rng.normal()).collect());
    }
    (recording, left)
}

/// The base model handed to the detector, and how it was made.
fn handed(
    rng: &mut Rng,
    experiment: &Experiment,
    effects: &[Scaled],
    noise: &Noise,
    plant_model: PlantKind,
) -> (Model, &'static str) {
    let refitted = experiment.refitted(effects);
    let how = match rng.uniform(0.0, 1.0) {
        _ if matches!(plant_model, PlantKind::Maxwell | PlantKind::Butterfly) => "refitted",
        x if x < 0.4 => "refitted",
        x if x < 0.8 => "perturbed",
        _ => "true",
    };
    let mut extra = experiment.extra;
    let mut weights: Vec<f64> = match &experiment.plant_model {
        PlantModel::Joint(joint) => joint.weights().to_vec(),
        PlantModel::Bench(Gear { elastic, hysteresis: Hysteresis::Uniform { h, e }, .. }) => {
            [&elastic[..], &[*h, *e]].concat()
        }
        PlantModel::Bench(_) => refitted[..5].to_vec(),
    };
    match how {
        "refitted" => {
            weights.copy_from_slice(&refitted[..5]);
            if let Some([coulomb, _, viscous]) = &mut extra {
                (*coulomb, *viscous) = (refitted[5].max(0.0), refitted[6].max(0.0));
            }
        }
        "perturbed" => weights.iter_mut().for_each(|w| *w *= 1.0 + 0.03 * rng.normal()),
        _ => {}
    }
    (experiment.plant_model.model(&weights, extra, experiment.plan.ratio, experiment.side, noise.play_rad()), how)
}

fn entry(
    hidden: &Hidden,
    scale: f64,
    size_nm: f64,
    before_nm: f64,
    mut leaves: std::collections::BTreeMap<String, f64>,
    removed: &[String],
) -> HiddenEffect {
    let listed = KINDS.contains(&hidden.kind.as_str());
    let evidence = leaves.remove(truth::BASE).unwrap_or(0.0);
    let own = leaves.remove(truth::OWN).unwrap_or(0.0).min(evidence);
    let mut class: Vec<String> = leaves
        .iter()
        .filter(|(kind, left)| **left - own < INDISTINGUISHABLE && !removed.contains(kind))
        .map(|(kind, _)| kind.clone())
        .collect();
    if listed && !class.contains(&hidden.kind) && !removed.contains(&hidden.kind) {
        class.push(hidden.kind.clone());
    }
    let dahl = hidden.pieces.iter().any(|(p, _)| matches!(p, Piece::Friction { sign: Sign::Dahl, .. }));
    HiddenEffect {
        kind: hidden.kind.clone(),
        also: if dahl { vec!["presliding_friction".to_owned()] } else { Vec::new() },
        made_as: None,
        listed: listed && !removed.contains(&hidden.kind),
        role: Role::Hidden,
        shape: hidden.shape.clone(),
        size_nm,
        before_nm,
        share: None,
        evidence,
        visible: evidence >= INDISTINGUISHABLE,
        coordinates: coordinate_names(&hidden.kind),
        class,
        unexplained: leaves,
        parameters: if hidden.library_shape { kinds::parameters(hidden, scale) } else { Default::default() },
        pieces: hidden.pieces.iter().map(|(p, w)| format!("{:e} x {p:?}", w * scale)).collect(),
    }
}

/// Friction of the output that is a part of the shape of viscous friction or damping: Coulomb friction to whoever finds it.
fn shape_entry(hidden: &Hidden) -> Option<HiddenEffect> {
    let is_viscous = matches!(hidden.kind.as_str(), "viscous_friction" | "viscous_damping");
    let is_brake = |(piece, weight): &(Piece, f64)| matches!(piece, Piece::Friction { .. }) && *weight > 0.0;
    let kind = "coulomb_friction";
    (is_viscous && hidden.pieces.iter().any(is_brake)).then(|| HiddenEffect {
        kind: kind.to_owned(),
        listed: true,
        role: Role::Shape,
        shape: format!("part of the shape of {}", hidden.kind),
        coordinates: coordinate_names(kind),
        class: vec![kind.to_owned()],
        ..HiddenEffect::default()
    })
}

/// A Maxwell-slip gear's own departure from the base model.
fn nature_entry(experiment: &Experiment, noise: &Noise) -> Option<HiddenEffect> {
    let PlantModel::Bench(Gear { hysteresis: Hysteresis::MaxwellSlip { radius, load, .. }, .. }) =
        &experiment.plant_model
    else {
        return None;
    };
    let kind = if *load == [0.0; 2] { "nonlocal_memory" } else { "load_dependent_memory" };
    let truths = experiment.truth(&[]);
    let torque: Vec<f64> = truths.iter().flat_map(|t| t.torque.iter().copied()).collect();
    let size_nm = rms(&linear::residual(&experiment.base_columns(&truths, true), &torque));
    Some(HiddenEffect {
        kind: kind.to_owned(),
        listed: true,
        role: Role::PlantModel,
        shape: format!("{} sliders", radius.len()),
        size_nm,
        before_nm: size_nm,
        evidence: torque.len() as f64 * (size_nm / noise.rms_nm).powi(2),
        visible: true,
        coordinates: coordinate_names(kind),
        class: vec![kind.to_owned()],
        ..HiddenEffect::default()
    })
}
