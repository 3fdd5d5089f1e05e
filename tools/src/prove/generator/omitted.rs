//! What a joint's model leaves out: two to four effects, each of a shape that is some percent off every textbook.
//!
//! An effect is a textbook part and an odd part of the same coordinates. The odd part is scaled until what the textbook
//! part cannot follow of it is 3 to 10 % of the effect, so that no column of a library fits exactly.

use super::arm::{Arm, Path};
use super::linear;
use super::noise::rms;
use super::rng::Rng;

/// A response: torque along a path, given the torque of everything else there, N·m.
type Response = Box<dyn Fn(&Path, &[f64]) -> Vec<f64> + Send + Sync>;

/// One effect that the simulation lacks.
pub struct Omitted {
    /// Its kind in MODEL.md section 7.
    pub kind: String,
    /// Its shape, in the generator's words.
    pub shape: String,
    /// What of it the textbook cannot follow, as a share of its rms.
    pub off_textbook: f64,
    textbook: Response,
    odd: Response,
    scale: f64,
    odd_scale: f64,
    /// A delay acts on the torque of all others, so it comes last and is not scaled.
    delay: bool,
}

impl Omitted {
    /// Its torque along `path`, `others` being the torque of everything else, N·m.
    pub fn torque(&self, path: &Path, others: &[f64]) -> Vec<f64> {
        let (a, b) = ((self.textbook)(path, others), (self.odd)(path, others));
        a.iter().zip(b).map(|(a, b)| self.scale * (a + self.odd_scale * b)).collect()
    }
}

/// All effects of one joint along one path.
pub struct Sum {
    /// Each effect's torque, N·m.
    pub parts: Vec<Vec<f64>>,
    /// Their sum.
    pub total: Vec<f64>,
}

/// The torque of every effect along `path`.
pub fn along(effects: &[Omitted], path: &Path) -> Sum {
    let mut total = vec![0.0; path.time_s.len()];
    let mut parts = vec![Vec::new(); effects.len()];
    for delayed in [false, true] {
        for (part, effect) in parts.iter_mut().zip(effects).filter(|(_, e)| e.delay == delayed) {
            let others: Vec<f64> = path.rigid_nm.iter().zip(&total).map(|(a, b)| a + b).collect();
            *part = effect.torque(path, &others);
            total.iter_mut().zip(&*part).for_each(|(t, p)| *t += p);
        }
    }
    Sum { parts, total }
}

/// The kinds of one joint: friction first, for no joint is without, then others. With a `simulation` also what only shows
/// beside one that is not refitted.
pub fn kinds(rng: &mut Rng, count: usize, simulation: bool) -> Vec<&'static str> {
    let mut kinds: Vec<&'static str> = match rng.uniform(0.0, 1.0) {
        x if x < 0.45 => vec!["coulomb_friction", "viscous_friction"],
        x if x < 0.60 => vec!["coulomb_friction"],
        x if x < 0.75 => vec!["stribeck_friction"],
        x if x < 0.85 => vec!["presliding_friction", "viscous_friction"],
        _ => vec!["viscous_friction"],
    };
    kinds.truncate(count);
    let mut others = vec!["load_dependent_friction", "time_skew", "torque_ripple", "torque_ripple"];
    if simulation {
        others.extend(["gravity_load", "inertia", "torque_scale"]);
    }
    if kinds.contains(&"coulomb_friction") || kinds.contains(&"stribeck_friction") {
        others.push("position_dependent_friction");
    }
    while kinds.len() < count && !others.is_empty() {
        let kind = rng.pick(&others);
        // A gain of the whole simulation and a change of its largest part are nearly one effect.
        if matches!(kind, "torque_scale") {
            others.retain(|k| !matches!(*k, "gravity_load" | "inertia"));
        } else if matches!(kind, "gravity_load" | "inertia") {
            others.retain(|k| *k != "torque_scale");
        }
        others.retain(|k| *k != kind);
        kinds.push(kind);
    }
    kinds
}

/// Draws an effect that leaves `size_nm` rms along `path`.
pub fn draw(kind: &str, rng: &mut Rng, arm: &Arm, path: &Path, size_nm: f64) -> Omitted {
    let (shape, textbook, odd) = responses(kind, rng, arm, path);
    let off = rng.uniform(0.03, 0.10);
    let ones = vec![1.0; path.time_s.len()];
    let (a, b) = (textbook(path, &path.rigid_nm), odd(path, &path.rigid_nm));
    let beyond = rms(&linear::residual(&[ones.clone(), a.clone()], &b));
    let own = rms(&linear::residual(std::slice::from_ref(&ones), &a));
    let odd_scale = rng.sign() * off * own / beyond.max(1e-12);
    let whole: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a + odd_scale * b).collect();
    let delay = kind == "time_skew";
    let sign = if matches!(kind, "gravity_load" | "inertia" | "torque_scale") { rng.sign() } else { 1.0 };
    let scale = if delay { 1.0 } else { sign * size_nm / rms(&linear::residual(&[ones], &whole)).max(1e-12) };
    Omitted { kind: kind.to_owned(), shape, off_textbook: off, textbook, odd, scale, odd_scale, delay }
}

fn map(path: &[f64], f: impl Fn(f64) -> f64) -> Vec<f64> {
    path.iter().map(|x| f(*x)).collect()
}

/// The textbook part and the odd part of `kind`, each of any size.
fn responses(kind: &str, rng: &mut Rng, arm: &Arm, path: &Path) -> (String, Response, Response) {
    let fastest = path.velocity.iter().fold(1e-9_f64, |m, v| m.max(v.abs()));
    let (low, high) = path.angle.iter().fold((f64::MAX, f64::MIN), |(a, b), q| (a.min(*q), b.max(*q)));
    let range = (high - low).max(1e-3);
    let end = path.time_s[path.time_s.len() - 1];
    let load = rms(&path.rigid_nm).max(1e-9);
    let width = fastest * rng.log_uniform(0.004, 0.03);
    let sharp = rng.pick(&[0, 0, 1, 2]);
    // A sign with a rounded corner: tanh, atan or root.
    let sgn = move |v: f64| match sharp {
        0 => (v / width).tanh(),
        1 => (v / width).atan() / std::f64::consts::FRAC_PI_2,
        _ => v / v.hypot(width),
    };
    let (middle, phase, harmonic) = (rng.uniform(low, high), rng.phase(), rng.pick(&[2.0, 3.0, 4.0]));
    let choice = rng.pick(&[0, 1, 2, 3]);
    match kind {
        "coulomb_friction" => {
            let textbook: Response = Box::new(move |p, _| map(&p.velocity, sgn));
            let odd: Response = match choice {
                // Another torque forwards than backwards, beside the mean.
                0 => Box::new(move |p, _| map2(&p.velocity, &p.angle, |v, q| sgn(v) * (harmonic * q + phase).sin())),
                // A share that grows with the root of the speed.
                1 => Box::new(move |p, _| map(&p.velocity, |v| sgn(v) * (v / fastest).abs().powf(0.3))),
                // A share that reverses over a distance, not at a speed.
                2 => Box::new(move |p, _| dahl(p, 0.01 * range)),
                // Running-in.
                _ => Box::new(move |p, _| map2(&p.velocity, &p.time_s, |v, t| sgn(v) * (-3.0 * t / end).exp())),
            };
            (format!("corner {sharp}, width {width:.2e} rad/s, odd {choice}"), textbook, odd)
        }
        "viscous_friction" => {
            let exponent = rng.pick(&[1.0, 1.0, 0.6, 0.7, 0.8, 0.9, 1.1, 1.2]);
            let power = move |v: f64, p: f64| v.signum() * v.abs().powf(p);
            let odd: Response = match choice {
                0 => Box::new(move |p, _| map(&p.velocity, |v| v * v.abs())),
                1 => Box::new(move |p, _| map(&p.velocity, |v| (3.0 * v / fastest).tanh())),
                2 => Box::new(move |p, _| map(&p.velocity, |v| v.max(0.0))),
                _ => Box::new(move |p, _| map2(&p.velocity, &p.time_s, |v, t| v * (-2.0 * t / end).exp())),
            };
            (
                format!("exponent {exponent}, odd {choice}"),
                Box::new(move |p, _| map(&p.velocity, |v| power(v, exponent))),
                odd,
            )
        }
        "stribeck_friction" => {
            let (velocity, drop) = (fastest * rng.uniform(0.06, 0.2), rng.uniform(0.3, 0.8));
            let exponent = rng.pick(&[0.7, 1.0, 1.0, 2.0]);
            let slope = rng.uniform(0.05, 0.5) / fastest;
            let dip = move |v: f64| drop * (-(v / velocity).abs().powf(exponent)).exp();
            let odd: Response = match choice {
                0 | 1 => Box::new(move |p, _| map(&p.velocity, |v| sgn(v) / (1.0 + (v / velocity).powi(2)))),
                2 => Box::new(move |p, _| map(&p.velocity, |v| v * v.abs())),
                _ => Box::new(move |p, _| map2(&p.velocity, &p.angle, |v, q| sgn(v) * (harmonic * q + phase).sin())),
            };
            (
                format!("dip {drop:.2} over {velocity:.2e} rad/s, exponent {exponent}, odd {choice}"),
                Box::new(move |p, _| map(&p.velocity, |v| sgn(v) * (1.0 + dip(v)) + slope * v)),
                odd,
            )
        }
        "presliding_friction" => {
            let radius = range * rng.log_uniform(4e-3, 3e-2);
            let odd: Response = match choice {
                0 | 1 => Box::new(move |p, _| dahl(p, 6.0 * radius)),
                2 => Box::new(move |p, _| stop(p, 2.0 * radius)),
                _ => Box::new(move |p, _| map(&p.velocity, sgn)),
            };
            (format!("over {radius:.2e} rad, odd {choice}"), Box::new(move |p, _| dahl(p, radius)), odd)
        }
        "load_dependent_friction" => {
            let odd: Response = match choice {
                // Another efficiency where the load drives.
                0 | 1 => Box::new(move |p, _| {
                    map2(&p.velocity, &p.rigid_nm, |v, t| sgn(v) * t.abs() * (4.0 * v * t / (fastest * load)).tanh())
                }),
                2 => Box::new(move |p, _| map2(&p.velocity, &p.rigid_nm, |v, t| sgn(v) * t * t)),
                _ => Box::new(move |p, _| map2(&p.velocity, &p.rigid_nm, |v, t| sgn(v) * t.abs().sqrt())),
            };
            (
                format!("odd {choice}"),
                Box::new(move |p, _| map2(&p.velocity, &p.rigid_nm, |v, t| sgn(v) * t.abs())),
                odd,
            )
        }
        "position_dependent_friction" => {
            let order = rng.pick(&[1.0, 1.0, 2.0]);
            let around = move |p: &Path, k: f64, a: f64| map2(&p.velocity, &p.angle, |v, q| sgn(v) * (k * q + a).sin());
            let odd: Response = match choice {
                0 | 1 => Box::new(move |p, _| around(p, harmonic + order, phase)),
                _ => Box::new(move |p, _| {
                    let near = |q: f64| (-((q - middle) / (0.1 * range)).powi(2)).exp();
                    p.velocity.iter().zip(&p.angle).map(|(v, q)| sgn(*v) * near(*q)).collect()
                }),
            };
            let start = rng.phase();
            (format!("output order {order}, odd {choice}"), Box::new(move |p, _| around(p, order, start)), odd)
        }
        "gravity_load" => {
            let start = rng.phase();
            (
                format!("order {harmonic} beside it"),
                Box::new(move |p, _| map(&p.angle, |q| (q + start).sin())),
                Box::new(move |p, _| map(&p.angle, |q| (harmonic * q + phase).sin())),
            )
        }
        "inertia" => {
            let odd: Response = match choice {
                0 | 1 => Box::new(move |p, _| map2(&p.acceleration, &p.angle, |a, q| a * (harmonic * q + phase).cos())),
                _ => Box::new(move |p, _| map(&p.velocity, |v| v * v)),
            };
            (format!("odd {choice}"), Box::new(move |p, _| p.acceleration.clone()), odd)
        }
        "torque_scale" => {
            let odd: Response = if choice < 2 {
                // Saturation.
                Box::new(move |p, _| map(&p.rigid_nm, |t| t * t * t / (load * load)))
            } else {
                Box::new(move |p, _| map(&p.rigid_nm, f64::abs))
            };
            (format!("odd {choice}"), Box::new(move |p, _| p.rigid_nm.clone()), odd)
        }
        "time_skew" => {
            let delay = rng.sign() * rng.log_uniform(4e-3, 2e-2);
            (
                format!("delay {delay:.2e} s, part of it a lag"),
                Box::new(move |p, torque| shifted(p, torque, delay)),
                Box::new(move |p, torque| lagged(p, torque, 2.0 * delay.abs())),
            )
        }
        "torque_ripple" => {
            let turns = range / std::f64::consts::TAU;
            let nyquist = 0.2 / path.period_s;
            let motor = [1.0, 2.0, 4.0].map(|k| k * arm.ratio);
            let mut orders: Vec<f64> = motor.to_vec();
            orders.extend([12.0, 18.0, 24.0, 30.0, 36.0].iter().filter(|k| **k * turns > 4.0));
            orders.retain(|k| k * fastest / std::f64::consts::TAU < nyquist);
            let order = if orders.is_empty() { 12.0 } else { rng.pick(&orders) };
            let start = rng.phase();
            let odd: Response = match choice {
                0 => Box::new(move |p, _| map(&p.angle, |q| (3.0 * order * q + phase).sin())),
                1 => Box::new(move |p, _| {
                    map2(&p.angle, &p.velocity, |q, v| (order * q + start).sin() * v.abs() / fastest)
                }),
                _ => Box::new(move |p, _| map2(&p.angle, &p.rigid_nm, |q, t| (order * q + start).sin() * t / load)),
            };
            let name = if motor.contains(&order) {
                format!("order {} of the motor turn, odd {choice}", order / arm.ratio)
            } else {
                format!("order {order} of the output turn, odd {choice}")
            };
            (name, Box::new(move |p, _| map(&p.angle, |q| (order * q + start).sin())), odd)
        }
        other => unreachable!("{other} is not left out of a joint"),
    }
}

/// A function of two signals.
fn map2(a: &[f64], b: &[f64], f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| f(*a, *b)).collect()
}

/// Dahl's friction of torque 1: dD = (sgn v − D)·abs(dq)/r.
fn dahl(path: &Path, radius: f64) -> Vec<f64> {
    let mut state = 0.0;
    let mut before = path.angle[0];
    path.angle
        .iter()
        .map(|q| {
            let step = q - before;
            before = *q;
            if step != 0.0 {
                state = step.signum() + (state - step.signum()) * (-step.abs() / radius).exp();
            }
            state
        })
        .collect()
}

/// A spring that slips at `radius`.
fn stop(path: &Path, radius: f64) -> Vec<f64> {
    let mut play = path.angle[0];
    path.angle
        .iter()
        .map(|q| {
            play = play.clamp(q - radius, q + radius);
            (q - play) / radius
        })
        .collect()
}

/// T(t − δ) − T(t), by linear interpolation.
fn shifted(path: &Path, torque: &[f64], delay_s: f64) -> Vec<f64> {
    let last = torque.len() - 1;
    (0..torque.len())
        .map(|i| {
            let x = (i as f64 - delay_s / path.period_s).clamp(0.0, last as f64);
            let (k, part) = (x.floor() as usize, x.fract());
            torque[k] + (torque[(k + 1).min(last)] - torque[k]) * part - torque[i]
        })
        .collect()
}

/// The torque through a lag, less itself.
fn lagged(path: &Path, torque: &[f64], lag_s: f64) -> Vec<f64> {
    let keep = (-path.period_s / lag_s).exp();
    let mut slow = torque[0];
    torque
        .iter()
        .map(|t| {
            slow = t + keep * (slow - t);
            slow - t
        })
        .collect()
}
