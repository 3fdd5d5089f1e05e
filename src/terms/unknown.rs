//! Structure that no kind explains: an empirical curve over one coordinate.
//!
//! T += curve(coordinate), linear between knots and constant beyond them. Motor and output angle are reduced to the turn that begins at the first knot, and the curve
//! closes over that turn.

use core::f64::consts::TAU;

use heapless::Vec;

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::{Sample, sign};
use crate::scalar::Float;

/// The most knots.
pub const MOST_KNOTS: usize = 32;

const COORDINATE: KeyInfo = KeyInfo::choice("coordinate", &Coordinate::NAMES, "what the curve is over");
const KNOTS: KeyInfo =
    KeyInfo::shape_list("knots", "unit of the coordinate", MOST_KNOTS, "coordinates of the knots, increasing")
        .decided();
const VALUES: KeyInfo = KeyInfo::linear_list("values_nm", "N·m", MOST_KNOTS, "torque at the knots").within(-20.0, 20.0);

/// A curve over a coordinate.
#[derive(Debug, Clone, PartialEq)]
pub struct Unknown<S> {
    coordinate: Coordinate,
    knots: Vec<(S, S), MOST_KNOTS>,
}

/// The last reversal of the deflection.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Reversal<S> {
    last: Option<S>,
    direction: S,
    turning_point: S,
}

impl<S: Float> Reversal<S> {
    /// The travel since the last reversal, or since the start, after a step to `theta`.
    fn travel(&mut self, theta: S) -> S {
        let last = self.last.replace(theta).unwrap_or_else(|| {
            self.turning_point = theta;
            theta
        });
        let direction = sign(theta - last);
        if direction != S::ZERO && direction != self.direction {
            if self.direction != S::ZERO {
                self.turning_point = last;
            }
            self.direction = direction;
        }
        (theta - self.turning_point).abs()
    }
}

impl<S: Float> Physics<S> for Unknown<S> {
    const INFO: KindInfo = KindInfo {
        name: "unknown",
        side: Side::Instrument,
        domain: Domain::Torque,
        equation: "T += curve(coordinate)",
        coordinates: &Coordinate::ALL,
        needs: &[],
        keys: &[COORDINATE, KNOTS, VALUES],
        hides_behind: "",
        instructions: 130,
    };
    type State = Reversal<S>;

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        let choice = reader.choice(&COORDINATE)?;
        let named = Coordinate::ALL.get(choice).copied();
        let coordinate = named.ok_or(TermError::WrongForm { key: COORDINATE.name, form: COORDINATE.form })?;
        let at = reader.list::<MOST_KNOTS>(&KNOTS)?;
        let values = reader.list_like(&VALUES, &at, &KNOTS)?;
        if at.iter().zip(at.iter().skip(1)).any(|(a, b)| a >= b) {
            return Err(TermError::NotIncreasing { key: KNOTS.name });
        }
        let mut knots = Vec::new();
        for (at, value) in at.iter().zip(&values) {
            // There is room: the lists are no longer.
            let _ = knots.push((*at, *value));
        }
        Ok(Self { coordinate, knots })
    }

    fn needs_besides(&self) -> &'static [Need] {
        self.coordinate.needs()
    }

    fn follows_base(&self) -> bool {
        matches!(self.coordinate, Coordinate::Torque | Coordinate::TorqueRate)
    }

    fn torque(&self, state: &mut Reversal<S>, sample: &Sample<S>) -> S {
        match self.coordinate {
            Coordinate::Reversal => self.open(state.travel(sample.deflection)),
            Coordinate::MotorAngle | Coordinate::OutputAngle => self.closed(sample.coordinate(self.coordinate)),
            other => self.open(sample.coordinate(other)),
        }
    }
}

impl<S: Float> Unknown<S> {
    fn open(&self, x: S) -> S {
        let mut below: Option<(S, S)> = None;
        for &(knot, value) in &self.knots {
            if x < knot {
                return below.map_or(value, |below| between(below, (knot, value), x));
            }
            below = Some((knot, value));
        }
        below.map_or(S::ZERO, |(_, value)| value)
    }

    fn closed(&self, angle: S) -> S {
        let (Some(&first), Some(&last)) = (self.knots.first(), self.knots.last()) else { return S::ZERO };
        let turn = S::from_f64(TAU);
        let mut x = angle.wrap_turn() - first.0;
        x = x - turn * (x * S::from_f64(1.0 / TAU) - S::HALF).round();
        // Rounding may leave the turn by a little on either side.
        if x < S::ZERO {
            x = x + turn;
        } else if x >= turn {
            x = x - turn;
        }
        x = x + first.0;
        let again = (first.0 + turn, first.1);
        if x > last.0 && again.0 > last.0 { between(last, again, x) } else { self.open(x) }
    }
}

fn between<S: Float>(below: (S, S), above: (S, S), x: S) -> S {
    below.1 + (above.1 - below.1) * (x - below.0).over(above.0 - below.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(coordinate: Coordinate, points: &[(f64, f64)]) -> Unknown<f64> {
        let mut knots = Vec::new();
        points.iter().for_each(|p| knots.push(*p).unwrap());
        Unknown { coordinate, knots }
    }

    #[test]
    fn the_curve_is_linear_between_knots_and_constant_beyond() {
        let unknown = curve(Coordinate::Temperature, &[(20.0, 1.0), (30.0, 3.0), (50.0, -1.0)]);
        let at = |temperature| unknown.torque(&mut Reversal::default(), &Sample { temperature, ..Sample::default() });
        assert_eq!([10.0, 20.0, 25.0, 30.0, 40.0, 60.0].map(at), [1.0, 1.0, 2.0, 3.0, 1.0, -1.0]);
    }

    #[test]
    fn an_angle_closes_over_its_turn() {
        let quarter = TAU / 4.0;
        let unknown = curve(Coordinate::MotorAngle, &[(-quarter, 2.0), (0.0, 4.0), (2.0 * quarter, 6.0)]);
        let at = |angle| unknown.torque(&mut Reversal::default(), &Sample { motor_angle: angle, ..Sample::default() });
        for turns in [-300.0, 0.0, 2.0] {
            let values = [-0.5, 1.0, 2.5].map(|q| at(turns * TAU + q * quarter));
            for (value, expected) in values.into_iter().zip([3.0, 5.0, 4.0]) {
                assert!(libm::fabs(value - expected) < 1e-9, "{values:?}");
            }
        }
    }

    #[test]
    fn travel_counts_from_the_last_reversal() {
        let mut reversal = Reversal::default();
        let travel = [1.0, 1.0, 3.0, 4.0, 2.0, 1.5, 1.5, 2.5].map(|theta| reversal.travel(theta));
        assert_eq!(travel, [0.0, 0.0, 2.0, 3.0, 2.0, 2.5, 2.5, 1.0]);
    }
}
