//! What recordings span: what the candidates of a kind follow, and what its terms have to lie in.

/// What recordings span, and the orders that a residual holds.
#[derive(Debug, Clone, Default)]
pub struct Ranges {
    /// The rated deflection, rad; 0 where there is none.
    pub rated_rad: f64,
    /// The largest velocity, rad/s.
    pub velocity_rad_per_s: f64,
    /// The largest torque, N·m.
    pub torque_nm: f64,
    /// The first time, s.
    pub start_s: f64,
    /// The last time, s.
    pub end_s: f64,
    /// The sample period, s.
    pub period_s: f64,
    /// The mean temperature, °C.
    pub temperature_c: Option<f64>,
    /// Orders of the motor angle that the residual holds.
    pub motor_orders: Vec<f64>,
    /// Orders of the motor angle that it holds times the sign of the velocity.
    pub friction_orders: Vec<f64>,
    /// Orders of the output angle, where the motor's is not known.
    pub output_orders: Vec<f64>,
    /// Turns of the motor.
    pub motor_turns: f64,
    /// Turns of the output.
    pub output_turns: f64,
}

/// An angle that turns no more than this shows nothing of what turns with it, turns.
const FEWEST_MOTOR_TURNS: f64 = 0.16;
const FEWEST_OUTPUT_TURNS: f64 = 0.016;

/// The largest speeds recorded.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Speeds {
    /// Of the output, rad/s.
    pub output_rad_per_s: f64,
    /// Of the motor, rad/s.
    pub motor_rad_per_s: f64,
}

impl Ranges {
    /// Whether the motor turns far enough to show what turns with it.
    pub fn motor_turns_enough(&self) -> bool {
        self.motor_turns > FEWEST_MOTOR_TURNS
    }

    /// Whether the output turns far enough to show what turns with it.
    pub fn output_turns_enough(&self) -> bool {
        self.output_turns > FEWEST_OUTPUT_TURNS
    }

    /// The part that a fitted term has to lie in.
    pub fn extent(&self) -> Extent {
        Extent { fastest_rad_per_s: self.velocity_rad_per_s, start_s: self.start_s, end_s: self.end_s }
    }
}

/// Speed and time that recordings span.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// The largest velocity, rad/s.
    pub fastest_rad_per_s: f64,
    /// The first time, s.
    pub start_s: f64,
    /// The last time, s.
    pub end_s: f64,
}
