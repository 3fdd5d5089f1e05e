//! How far the parameters of two blocks are apart: their elastic torques up to the rated deflection of the one in force.

use crate::block::record::double;
use crate::block::{Block, GEAR, ScalarKind, Word};
use crate::elastic::{ElasticTorque, Polynomial};
use crate::scalar::Fixed;

/// What a gear transmits, of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rating {
    rated_deflection_rad: f64,
    torque_scale_nm: f64,
    elastic: ElasticTorque<f64>,
}

/// Shares of the rated deflection at which torques are compared.
const SHARES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

impl Rating {
    /// That of a block; `None` where it has no gear.
    pub(super) fn of(block: &Block<'_>) -> Option<Self> {
        match block.header().scalar {
            ScalarKind::F32 => Self::in_words::<f32>(block),
            ScalarKind::Fixed => Self::in_words::<Fixed>(block),
        }
    }

    fn in_words<S: Word>(block: &Block<'_>) -> Option<Self> {
        let [a0, a1, t0, t1, k1, k3, k5] = block.words::<S, 7>(&GEAR).ok()?;
        let [k1, k3, k5] = [k1, k3, k5].map(|word| S::of_word(word).unwrap_or(S::ZERO).to_f64());
        Some(Self {
            rated_deflection_rad: double([a0, a1]),
            torque_scale_nm: double([t0, t1]),
            elastic: ElasticTorque::new(Polynomial { k1, k3, k5 }),
        })
    }

    fn torque_nm(&self, deflection_rad: f64) -> f64 {
        self.elastic.torque(deflection_rad / self.rated_deflection_rad) * self.torque_scale_nm
    }

    /// Whether another gear gives the torques of this one within a share of its rated torque.
    pub(super) fn bounds(&self, other: &Self, share: f32) -> bool {
        let most = f64::from(share) * libm::fabs(self.torque_nm(self.rated_deflection_rad));
        SHARES.iter().all(|part| {
            let deflection_rad = part * self.rated_deflection_rad;
            // A NaN compares false.
            libm::fabs(other.torque_nm(deflection_rad) - self.torque_nm(deflection_rad)) <= most
        })
    }
}
