//! Hysteresis that remembers more than the base model: elements in parallel that slip one after the other (Maxwell slip, Prandtl–Ishlinskii).
//!
//! T += Σ w_i stop_{r_i}\[θ\] with w_i = torque_i/r_i: an element is a spring that slips at its torque. s ← clamp(s + Δθ, −r, r) from s = 0 at the start.

use heapless::Vec;

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

/// The most elements.
pub const MOST_ELEMENTS: usize = 16;

const RADIUS: KeyInfo =
    KeyInfo::shape_list("radius_rad", "rad", MOST_ELEMENTS, "r_i, the stroke at which an element slips")
        .positive()
        .within(1e-5, 2e-3);
const TORQUE: KeyInfo =
    KeyInfo::linear_list("torque_nm", "N·m", MOST_ELEMENTS, "torque at which an element slips").within(0.0, 20.0);

/// Slip elements in parallel.
#[derive(Debug, Clone, PartialEq)]
pub struct NonlocalMemory<S>(SlipElements<S>);

/// The elements, of this kind and of its load-dependent form.
#[derive(Debug, Clone, PartialEq)]
pub struct SlipElements<S>(Vec<Element<S>, MOST_ELEMENTS>);

#[derive(Debug, Clone, Copy, PartialEq)]
struct Element<S> {
    radius: S,
    /// w, N·m/rad.
    stiffness: S,
}

/// How far each element is strained, rad.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NonlocalState<S> {
    theta: Option<S>,
    strains: [S; MOST_ELEMENTS],
}

impl<S: Float> SlipElements<S> {
    /// Reads radii and torques.
    pub fn read(reader: &Reader<'_, S>, radius: &'static KeyInfo, torque: &'static KeyInfo) -> Result<Self, TermError> {
        let radii = reader.list::<MOST_ELEMENTS>(radius)?;
        let torques = reader.list_like(torque, &radii, radius)?;
        let mut elements = Vec::new();
        // An element without torque adds nothing.
        for (&radius, &torque) in radii.iter().zip(&torques).filter(|(_, torque)| **torque != S::ZERO) {
            // There is room: the lists are no longer.
            let _ = elements.push(Element { radius, stiffness: torque.over(radius) });
        }
        Ok(Self(elements))
    }

    /// Their torque after a step to a deflection, N·m.
    #[inline]
    pub fn torque(&self, state: &mut NonlocalState<S>, theta: S) -> S {
        let step = theta - state.theta.replace(theta).unwrap_or(theta);
        self.0.iter().zip(&mut state.strains).fold(S::ZERO, |sum, (element, strain)| {
            *strain = (*strain + step).clamp(-element.radius, element.radius);
            sum + element.stiffness * *strain
        })
    }

    #[cfg(test)]
    pub fn of(radii_and_torques: &[(S, S)]) -> Self {
        let element = |&(radius, torque): &(S, S)| Element { radius, stiffness: torque.over(radius) };
        Self(radii_and_torques.iter().map(element).collect())
    }
}

impl<S: Float> Physics<S> for NonlocalMemory<S> {
    const INFO: KindInfo = KindInfo {
        name: "nonlocal_memory",
        side: Side::Plant,
        domain: Domain::Torque,
        equation: "T += Σ w_i stop_{r_i}[θ]",
        coordinates: &[Coordinate::Reversal],
        needs: &[Need::Deflection],
        keys: &[RADIUS, TORQUE],
        hides_behind: "h, e on one amplitude",
        instructions: 171,
    };
    type State = NonlocalState<S>;

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        SlipElements::read(reader, &RADIUS, &TORQUE).map(Self)
    }

    #[inline]
    fn torque(&self, state: &mut NonlocalState<S>, sample: &Sample<S>) -> S {
        self.0.torque(state, sample.deflection)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_slip_at_their_torque_and_come_back() {
        let memory = NonlocalMemory(SlipElements::of(&[(1.0, 3.0), (2.0, 4.0)]));
        let mut state = NonlocalState::default();
        let path = [5.0, 5.5, 8.0, 7.0, 3.0];
        let torque = path.map(|deflection| memory.torque(&mut state, &Sample { deflection, ..Sample::default() }));
        assert_eq!(torque, [0.0, 2.5, 7.0, 0.0 + 2.0, -3.0 - 4.0]);
    }
}
