//! After an outlier the hysteresis torque of a joint is off by at most the uncertainty in its status.

use crate::common::{A, at, block, block_in_time, gmhm_get_status, gmhm_step, joint_of};
use gmhm_c::Joint;

const TORQUE_SCALE_NM: f32 = 29.0;

/// A swing of two amplitudes, in A.
fn swing(k: u32) -> f32 {
    let angle = k as f32;
    0.6 * (0.11 * angle).sin() + 0.4 * (0.037 * angle).sin()
}

fn step(joint: &mut Joint, u: f32) -> f32 {
    gmhm_step(Some(joint), Some(&at(u * A))).hysteresis_nm
}

#[test]
fn what_an_outlier_leaves_is_within_the_uncertainty_of_the_status() {
    for block in [block(), block_in_time()] {
        for (case, spike) in [1.3, -1.3, 1.5, -1.5, 2.0, -3.0, 8.0, -500.0].into_iter().enumerate() {
            let (mut struck, mut twin) = (joint_of(&block), joint_of(&block));
            let first = 200 + 37 * case as u32;
            let mut most = 0.0_f32;
            for k in 0..600 {
                let is_spike = (first..=first + case as u32 % 3).contains(&k);
                // Both tips, so that the past is known.
                let u = if k < 120 { (0.1 * k as f32).sin() } else { swing(k) };
                let found = step(&mut struck, if is_spike { spike } else { u });
                let off = (found - step(&mut twin, u)).abs();
                if is_spike {
                    continue;
                }
                let [stated, of_twin] = [&struck, &twin].map(|joint| gmhm_get_status(Some(joint)).start_uncertainty_nm);
                assert!(
                    off <= stated + of_twin + 1e-4 * TORQUE_SCALE_NM,
                    "{spike} at {first}, at {k}: {off}, {stated}"
                );
                most = most.max(off);
            }
            assert!(most > 0.01 * TORQUE_SCALE_NM, "{spike} leaves {most} N·m");
        }
    }
}
