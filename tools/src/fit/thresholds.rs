//! The thresholds that decide in a fit, in one place. Numbers of steps and sizes of grids, which only cost time, stand beside their methods.
//!
//! Where no source is named, a threshold was set on the synthetic gears of `tests/fit_*.rs` and on real recordings, and the tests fail where it is far off.

/// The thresholds of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thresholds {
    /// About so many rows, spread over all recordings, decide on the structure and on the zeros. Set by time: 10 structures take 2 s.
    pub selection_rows: usize,
    /// About so many rows, spread over all recordings, are compared with other models.
    pub comparison_rows: usize,
    /// Structures whose mean held-out squares differ by less than this share of the best's do not differ.
    pub same_heldout_share: f64,
    /// A recording left with more than this share of its torque's standard deviation is compared with a fit of the first recording alone.
    pub missed_share: f64,
    /// A start other than from rest has to explain a recording better by this many variances of the residual (5 σ).
    pub other_start_variances: f64,
    /// The loop has settled, whatever came before, where the deflection has reached this share of the rated one,
    pub settled_tip_share: f64,
    /// or has been within this share of its range of both its extremes: noise decides which cycle holds the very extreme.
    pub settled_margin_share: f64,
    /// Rows before that are left out where at least this share of the recording stays,
    pub settled_rows_share: f64,
    /// and at least so many rows.
    pub settled_rows: usize,
    /// Rows before that leave less than so many times the variance of the others are not left out.
    pub unsettled_ratio: f64,
    /// Probability at which rows before the loop has settled are left out although a start from rest is true (Chow's test).
    pub unsettled_probability: f64,
    /// A zero, or a start, counts where it is this many standard deviations from none.
    pub zero_significance: f64,
    /// Zeros elsewhere, or zeros of each recording, have to leave less than this share of the squares.
    pub zeros_squares_share: f64,
    /// Deflections whose middle lies within this share of half their range suggest no zero elsewhere.
    pub centred_share: f64,
    /// A zero that is refined has to leave less than this share of the held-out rms.
    pub zero_heldout_share: f64,
    /// Recordings whose noise differs from the mean by this factor are weighted by it.
    pub unequal_noise_ratio: f64,
    /// Recordings whose largest deflections differ by more than this factor are perhaps in different units.
    pub other_size_ratio: f64,
    /// What a deflection in rad and a torque in N·m or A may vary by: far more and far less than those of any gear, in whatever units they are taken.
    pub believable: [f64; 2],
    /// The widest reversal play that is tried, in rated deflections.
    pub widest_play_share: f64,
    /// A fit against coloured noise whose held-out rms is this many times that of plain least squares took physics for noise.
    pub physics_as_noise_ratio: f64,
    /// Parameters are held where feed-forward has an inverse unless that costs this many squared standard deviations (3 σ).
    pub inverse_cost_variances: f64,
    /// A rated deflection that is off the largest recorded by more than this share is tried beside it: as much moves e of the published gear by 4 %.
    pub rated_off_share: f64,
    /// The largest recorded deflection has to leave less than this share of the held-out rms that the given rated deflection leaves.
    pub rated_better_share: f64,
    /// The other side of the gear has to leave less than this share of a joint's held-out rms. Of three real joint logs on the wrong side it leaves 0.04, 0.47 and 0.77; of one on the right side 1.3.
    pub side_better_share: f64,
    /// What a free zero of the deflection has to gain of −2 ln L beyond the Bayesian information criterion, in a model with terms.
    pub zero_likelihood_gain: f64,
    /// Held-out rms over peak torque: from the first on with care, from the second on not good enough. A drive's torque sensor is good to about 3 %.
    pub error_shares: [f64; 2],
    /// Held-out rms over that of the rows fitted, likewise.
    pub overfit_ratios: [f64; 2],
    /// Part of ±A that has to be recorded in both load directions.
    pub reach_share: f64,
    /// Less of ±A than this is one load direction.
    pub one_sided_share: f64,
    /// Part of ±A up to which feed-forward has an inverse: below the first with care, below the second not good enough.
    pub inverse_shares: [f64; 2],
    /// The longest sample period of a drive for which the inverse is asked, s. Matters to law `time` only.
    pub drive_period_s: f64,
    /// Share of the residual's power that may repeat at the same place and direction.
    pub repeated_share: f64,
    /// Another model predicts better where it leaves less than this share of the held-out rms.
    pub better_model_share: f64,
    /// A linear spring predicts as well where it leaves less than this many times the held-out rms.
    pub spring_ratio: f64,
}

/// The thresholds in use.
pub const THRESHOLDS: Thresholds = Thresholds {
    selection_rows: 20_000,
    comparison_rows: 20_000,
    same_heldout_share: 0.01,
    missed_share: 0.3,
    other_start_variances: 25.0,
    settled_tip_share: 0.98,
    settled_margin_share: 0.02,
    settled_rows_share: 0.4,
    settled_rows: 24,
    unsettled_ratio: 2.0,
    unsettled_probability: 1e-4,
    zero_significance: 5.0,
    zeros_squares_share: 0.8,
    centred_share: 0.05,
    zero_heldout_share: 0.98,
    unequal_noise_ratio: 1.25,
    other_size_ratio: 10.0,
    believable: [1e-15, 1e15],
    widest_play_share: 0.1,
    physics_as_noise_ratio: 1.05,
    inverse_cost_variances: 9.0,
    rated_off_share: 1e-4,
    rated_better_share: 0.97,
    side_better_share: 0.9,
    zero_likelihood_gain: 12.0,
    error_shares: [0.03, 0.10],
    overfit_ratios: [1.25, 2.0],
    reach_share: 0.8,
    one_sided_share: 0.02,
    inverse_shares: [0.995, 0.5],
    drive_period_s: 1e-3,
    repeated_share: 0.1,
    better_model_share: 0.9,
    spring_ratio: 1.02,
};
