//! Cases of joint logs: a rigid-body torque, or terms of gravity and inertia, beside the measured torque, and what they leave out.

use super::arm::{Arm, Path, Style};
use super::kinds::{FRICTION, coordinate_names};
use super::linear;
use super::noise::{Noise, quantise, rms};
use super::omitted::{self, Omitted, Sum};
use super::rng::Rng;
use super::{Case, CaseSpec, PlantKind, Unseen, deviation, parts};
use crate::model::{Base, GearSection, Model, Term, TermValue, TorqueSide};
use crate::prove::key::{HiddenEffect, INDISTINGUISHABLE, Key, LARGE_SHARE};
use crate::recording::Recording;

/// How often a joint is drawn anew until every effect stands on its own.
const ATTEMPTS: u64 = 20;
/// What at least of an effect the other effects cannot stand in for, as a share of its rms.
const OWN_SHARE: f64 = 0.4;
/// Friction gives back at most this part of the energy that it takes: presliding gives back some.
const GIVEN_BACK: f64 = 0.05;
/// Rows that a check of that reads.
const CHECKED_ROWS: usize = 1500;

struct Draft {
    arm: Arm,
    styles: [Style; 2],
    paths: Vec<Path>,
    effects: Vec<Omitted>,
    sums: Vec<Sum>,
    /// What each effect leaves after the others' columns are refitted, as a share of its rms.
    own: Vec<f64>,
}

/// Makes the case of `seed`.
pub fn case(seed: u64, spec: &CaseSpec) -> Case {
    let rng = Rng::new(seed);
    let mut draft = None;
    for attempt in 0..ATTEMPTS {
        let made = drafted(&mut rng.stream(300 + attempt), spec);
        let done = made.own.iter().all(|own| *own >= OWN_SHARE) && !friction_drives(&made);
        draft = Some(made);
        if done {
            break;
        }
    }
    let draft = draft.expect("there is at least one attempt");
    record(seed, &rng, spec, &draft)
}

fn drafted(rng: &mut Rng, spec: &CaseSpec) -> Draft {
    let mut arm = Arm::draw(rng);
    if spec.plant_model == PlantKind::ArmTerms {
        // No channel tells of other joints.
        arm.coupling_nm = 0.0;
    }
    let rate_hz = rng.pick(&[1000.0, 1000.0, 1000.0, 1000.0, 1000.0, 500.0, 250.0, 125.0]);
    let rows = (rng.uniform(15.0, 30.0) * rate_hz) as usize;
    let all = [Style::Sines, Style::Moves, Style::Cruise];
    let styles = [rng.pick(&all), rng.pick(&all)];
    let recordings = if rng.chance(0.15) { 2 } else { 1 };
    let paths: Vec<Path> = (0..recordings).map(|_| arm.path(rng, styles[0], rows, 1.0 / rate_hz)).collect();
    let left_out = rms(&paths[0].rigid_nm) * rng.log_uniform(0.1, 0.6);
    let norm = spec.effects.iter().map(|(_, w)| w * w).sum::<f64>().sqrt();
    let effects: Vec<Omitted> =
        spec.effects.iter().map(|(kind, w)| omitted::draw(kind, rng, &arm, &paths[0], left_out * w / norm)).collect();
    let sums: Vec<Sum> = paths.iter().map(|path| omitted::along(&effects, path)).collect();
    let own = (0..effects.len()).map(|i| own_share(&paths, &sums, i, spec.plant_model)).collect();
    Draft { arm, styles, paths, effects, sums, own }
}

/// Whether friction, all kinds together, gives back more than a little of the energy that it takes: friction brakes at every position.
fn friction_drives(draft: &Draft) -> bool {
    let is_friction = |effect: &Omitted| FRICTION.contains(&effect.kind.as_str());
    let (mut taken, mut given) = (0.0, 0.0);
    for (path, sum) in draft.paths.iter().zip(&draft.sums) {
        for (row, velocity) in path.velocity.iter().enumerate() {
            let own = sum.parts.iter().zip(&draft.effects).filter(|(_, effect)| is_friction(effect));
            let power = velocity * own.map(|(part, _)| part[row]).sum::<f64>();
            if power > 0.0 { taken += power } else { given -= power }
        }
    }
    given > GIVEN_BACK * taken
}

/// What the other effects, a constant and a refitted base leave of effect `index`, as a share of its rms.
fn own_share(paths: &[Path], sums: &[Sum], index: usize, plant: PlantKind) -> f64 {
    let every = (paths[0].time_s.len() / CHECKED_ROWS).max(1);
    let thin = |x: &[f64]| x.iter().copied().step_by(every).collect::<Vec<f64>>();
    let part = thin(&sums[0].parts[index]);
    let mut columns = vec![vec![1.0; part.len()]];
    if plant == PlantKind::ArmTerms {
        let q = thin(&paths[0].angle);
        columns.extend([q.iter().map(|q| q.cos()).collect(), q.iter().map(|q| q.sin()).collect()]);
        columns.push(thin(&paths[0].acceleration));
    }
    let alone = rms(&linear::residual(&columns[..1], &part));
    columns.extend((0..sums[0].parts.len()).filter(|k| *k != index).map(|k| thin(&sums[0].parts[k])));
    rms(&linear::residual(&columns, &part)) / alone.max(1e-12)
}

fn record(seed: u64, rng: &Rng, spec: &CaseSpec, draft: &Draft) -> Case {
    let left_out =
        if draft.effects.is_empty() { 0.2 * rms(&draft.paths[0].rigid_nm) } else { deviation(&draft.sums[0].total) };
    let mut measure = rng.stream(301);
    let drawn = Noise::draw(&mut measure, spec.colour);
    // 1 to 3 % of what is left out, which is 30 to 100 times less.
    let noise = Noise { rms_nm: left_out * measure.log_uniform(0.01, 0.03), torque_step_nm: 0.0, ..drawn };
    let channels = Channels {
        simulated: spec.plant_model == PlantKind::Arm,
        with_velocity: measure.chance(0.6),
        angle_step_rad: 10_f64.powf(measure.uniform(-6.0, -4.7)),
        offset_nm: measure.uniform(-0.3, 0.3) * left_out,
    };
    let ratio_known = measure.chance(0.75);
    let mut recordings = Vec::new();
    let mut noise_free = Vec::new();
    for (index, (path, sum)) in draft.paths.iter().zip(&draft.sums).enumerate() {
        recordings.push(channels.measured(&mut measure, path, sum, Some(&noise), index));
        noise_free.push(channels.measured(&mut measure, path, sum, None, index));
    }
    let base = base(&draft.arm, channels.simulated, ratio_known.then_some(draft.arm.ratio));
    let unseen = {
        let rows = draft.paths[0].time_s.len();
        let path = draft.arm.path(&mut rng.stream(302), draft.styles[1], rows, draft.paths[0].period_s);
        let sum = omitted::along(&draft.effects, &path);
        let mut recording = channels.measured(&mut measure, &path, &sum, None, 0);
        recording.torque = None;
        let base_leaves_nm = deviation(&base_leaves(draft, &path, &sum, channels.simulated));
        let torque_nm = path.rigid_nm.iter().zip(&sum.total).map(|(a, b)| a + b).collect();
        vec![Unseen { recording, torque_nm, base_leaves_nm }]
    };
    let effects = (0..draft.effects.len()).map(|i| entry(draft, i, left_out, &noise)).collect();
    let key = Key {
        block: spec.block.clone(),
        seed,
        plant_model: if channels.simulated { "simulation" } else { "joint" }.to_owned(),
        motion: format!("{:?}, then {:?}", draft.styles[0], draft.styles[1]),
        remanent: false,
        noise: noise.name.clone(),
        noise_rms_nm: noise.rms_nm,
        handed: "true".to_owned(),
        removed: Vec::new(),
        effects,
    };
    Case { recordings, base, removed: Vec::new(), noise_free, unseen, key }
}

/// How this joint is recorded.
struct Channels {
    simulated: bool,
    with_velocity: bool,
    angle_step_rad: f64,
    offset_nm: f64,
}

impl Channels {
    /// The recording of a motion; without `noise`, of the bare channels.
    fn measured(&self, rng: &mut Rng, path: &Path, sum: &Sum, noise: Option<&Noise>, index: usize) -> Recording {
        let rows = path.time_s.len();
        let fastest = path.velocity.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let (disturbance, offset, step, spread) = noise.map_or((vec![0.0; rows], 0.0, 0.0, 0.0), |n| {
            (n.torque(rng, rows), self.offset_nm, self.angle_step_rad, 1e-3 * fastest)
        });
        let torque = (0..rows).map(|i| path.rigid_nm[i] + sum.total[i] + disturbance[i] + offset).collect();
        let velocity = || path.velocity.iter().map(|v| v + spread * rng.normal()).collect();
        Recording {
            name: format!("concealed recording {}", index + 1),
            time_s: path.time_s.clone().into(),
            torque: Some(torque),
            velocity_out_rad_per_s: (self.with_velocity || noise.is_none()).then(velocity),
            theta_out_rad: Some(path.angle.iter().map(|q| quantise(*q, step)).collect()),
            torque_sim_nm: self.simulated.then(|| path.rigid_nm.clone().into()),
            ..Recording::default()
        }
    }
}

/// The model handed over: nothing but the gear where a simulation stands beside the torque, gravity and inertia elsewhere.
fn base(arm: &Arm, simulated: bool, ratio: Option<f64>) -> Model {
    let term = |kind: &str, values: &[(&str, f64)]| Term {
        kind: kind.to_owned(),
        values: values.iter().map(|(k, v)| ((*k).to_owned(), TermValue::Number(*v))).collect(),
    };
    let gravity = term("gravity_load", &[("cos_nm", arm.gravity[0]), ("sin_nm", arm.gravity[1])]);
    let inertia = term("inertia", &[("inertia_kgm2", arm.inertia)]);
    Model {
        name: "concealed case".to_owned(),
        gear: GearSection {
            base: if simulated { Base::Simulation } else { Base::default() },
            ratio,
            torque_side: TorqueSide::Motor,
            ..GearSection::default()
        },
        terms: if simulated { Vec::new() } else { vec![gravity, inertia] },
        ..Model::default()
    }
}

/// What the base leaves along `path`: the simulation as it is, or terms fitted to the noise-free recordings.
fn base_leaves(draft: &Draft, path: &Path, sum: &Sum, simulated: bool) -> Vec<f64> {
    if simulated {
        return sum.total.clone();
    }
    let columns = |paths: &[&Path]| -> Vec<Vec<f64>> {
        let of = |f: &dyn Fn(&Path) -> Vec<f64>| paths.iter().flat_map(|p| f(p)).collect::<Vec<f64>>();
        vec![
            of(&|p| vec![1.0; p.time_s.len()]),
            of(&|p| p.angle.iter().map(|q| q.cos()).collect()),
            of(&|p| p.angle.iter().map(|q| q.sin()).collect()),
            of(&|p| p.acceleration.clone()),
        ]
    };
    let torque =
        |path: &Path, sum: &Sum| -> Vec<f64> { path.rigid_nm.iter().zip(&sum.total).map(|(a, b)| a + b).collect() };
    let recorded: Vec<f64> = draft.paths.iter().zip(&draft.sums).flat_map(|(p, s)| torque(p, s)).collect();
    let weights = linear::weights(&columns(&draft.paths.iter().collect::<Vec<_>>()), &recorded);
    let here = columns(&[path]);
    let total = torque(path, sum);
    (0..total.len()).map(|i| total[i] - here.iter().zip(&weights).map(|(c, w)| w * c[i]).sum::<f64>()).collect()
}

fn entry(draft: &Draft, index: usize, left_out: f64, noise: &Noise) -> HiddenEffect {
    let effect = &draft.effects[index];
    let before_nm = deviation(&draft.sums[0].parts[index]);
    let size_nm = before_nm * draft.own[index];
    let rows = draft.paths.iter().map(|p| p.time_s.len()).sum::<usize>() as f64;
    // In noise of one pole an effect of low frequency has so much less evidence.
    let pole: f64 = noise.autoregression.iter().sum::<f64>().clamp(0.0, 0.999);
    let evidence = rows * (size_nm / noise.rms_nm).powi(2) * (1.0 - pole) / (1.0 + pole);
    let share = before_nm / left_out;
    let class = class(draft, index, left_out);
    // What nobody could tell from Coulomb friction is called that.
    let kind = class.last().unwrap_or(&effect.kind).clone();
    HiddenEffect {
        coordinates: coordinate_names(&kind),
        made_as: (effect.kind != kind).then(|| effect.kind.clone()),
        kind,
        listed: true,
        shape: format!("{}: {}", effect.kind, effect.shape),
        size_nm,
        before_nm,
        share: Some(share),
        evidence,
        visible: share >= LARGE_SHARE && evidence >= INDISTINGUISHABLE,
        class,
        pieces: vec![format!("{:.1} % off the textbook", 100.0 * effect.off_textbook)],
        ..HiddenEffect::default()
    }
}

/// Kinds that come as near to an effect as the textbook of its own kind does, or leave so little that it would be no large effect alone: Coulomb friction where the dip of
/// Stribeck friction beside its viscous part, or the distance of presliding, hardly shows.
fn class(draft: &Draft, index: usize, left_out: f64) -> Vec<String> {
    let effect = &draft.effects[index];
    let mut class = vec![effect.kind.clone()];
    if parts(&effect.kind).contains(&"coulomb_friction") {
        let (path, part) = (&draft.paths[0], &draft.sums[0].parts[index]);
        let fastest = path.velocity.iter().fold(1e-9_f64, |most, v| most.max(v.abs()));
        let mut beside = vec![vec![1.0; part.len()]];
        if parts(&effect.kind).contains(&"viscous_friction") {
            beside.push(path.velocity.clone());
        }
        let left = |width: f64| {
            let sign = path.velocity.iter().map(|v| (v / (width * fastest)).tanh()).collect();
            let columns: Vec<Vec<f64>> = beside.iter().cloned().chain([sign]).collect();
            rms(&linear::residual(&columns, part))
        };
        let least = [0.003, 0.01, 0.03, 0.1].map(left).into_iter().fold(f64::INFINITY, f64::min);
        if least <= (effect.off_textbook * deviation(part)).max(LARGE_SHARE * left_out) {
            class.push("coulomb_friction".to_owned());
        }
    }
    class
}
