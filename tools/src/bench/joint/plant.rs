//! The joint: motor inertia, gear, link. Everything is counted on the output side: p = q_m/N, motor torque times N, motor inertia times N².

use std::f64::consts::TAU;

use gmhm::Params;

use super::gear::JointGear;

/// What the link may do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Output {
    /// Swings under gravity.
    Free,
    /// Held.
    Blocked,
}

/// Inertias, friction and gravity that suit a gear.
///
/// J_l so that the link on the gear resonates at 18 Hz, J_p = J_l/4, gravity of 0.65 T_A, motor friction of 1 % of T_A and 5 % of T_A a rad/s, a gear damping
/// of 2 % of critical.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Masses {
    pub link_kgm2: f64,
    pub motor_kgm2: f64,
    pub gravity_nm: f64,
    coulomb_nm: f64,
    viscous_nms: f64,
    damping_nms: f64,
}

impl Masses {
    pub fn of(params: &Params) -> Self {
        let rated_nm = params.rated_torque_nm();
        let stiffness = rated_nm / params.rated_deflection_rad();
        let resonance = TAU * 18.0;
        let link_kgm2 = stiffness / (resonance * resonance);
        Self {
            link_kgm2,
            motor_kgm2: 0.25 * link_kgm2,
            gravity_nm: 0.65 * rated_nm,
            coulomb_nm: 0.01 * rated_nm,
            viscous_nms: 0.05 * rated_nm,
            damping_nms: 0.04 * (stiffness * link_kgm2).sqrt(),
        }
    }

    /// Friction of the motor at a speed, N·m.
    pub fn friction_nm(&self, motor_rad_per_s: f64) -> f64 {
        self.coulomb_nm * (motor_rad_per_s / 1e-3).tanh() + self.viscous_nms * motor_rad_per_s
    }

    /// Torque that the gear has to carry for a motion of the link, N·m.
    pub fn load_nm(&self, angle_rad: f64, acceleration: f64) -> f64 {
        self.link_kgm2 * acceleration + self.gravity_nm * angle_rad.sin()
    }
}

/// The joint in motion.
#[derive(Debug, Clone)]
pub(super) struct Joint {
    masses: Masses,
    output: Output,
    gear: JointGear,
    /// p = q_m/N, rad.
    pub motor_rad: f64,
    /// ṗ, rad/s.
    pub motor_rad_per_s: f64,
    /// q_o, rad.
    pub link_rad: f64,
    /// q̇_o, rad/s.
    pub link_rad_per_s: f64,
    /// Torque in the gear, N·m.
    pub torque_nm: f64,
}

impl Joint {
    pub fn at_rest(masses: Masses, output: Output, gear: JointGear) -> Self {
        Self {
            masses,
            output,
            gear,
            motor_rad: 0.0,
            motor_rad_per_s: 0.0,
            link_rad: 0.0,
            link_rad_per_s: 0.0,
            torque_nm: 0.0,
        }
    }

    /// The same joint, its gear without hysteresis.
    pub fn without_hysteresis(self, rated_deflection_rad: f64) -> Self {
        Self { gear: self.gear.middle(rated_deflection_rad), ..self }
    }

    /// θ = p − q, rad.
    pub fn deflection_rad(&self) -> f64 {
        self.motor_rad - self.link_rad
    }

    /// Moves on by `step_s` under a motor torque (times N), N·m: symplectic Euler.
    pub fn step(&mut self, motor_nm: f64, step_s: f64) {
        let m = &self.masses;
        let damping = m.damping_nms * (self.motor_rad_per_s - self.link_rad_per_s);
        let friction = m.friction_nm(self.motor_rad_per_s);
        let gear_nm = self.torque_nm + damping;
        self.motor_rad_per_s += step_s * (motor_nm - friction - gear_nm) / m.motor_kgm2;
        self.motor_rad += step_s * self.motor_rad_per_s;
        if self.output == Output::Free {
            let gravity = m.gravity_nm * self.link_rad.sin();
            self.link_rad_per_s += step_s * (gear_nm - gravity) / m.link_kgm2;
            self.link_rad += step_s * self.link_rad_per_s;
        }
        self.torque_nm = self.gear.step(self.deflection_rad());
    }
}
