//! A base model and a stack of terms over a whole recording, by the core's own code in `f64`.

use gmhm::terms::{Domain, Need, Resampled, Sample};
use gmhm::{Gear, Params};

use super::error::PredictError;
use super::signals::{Signals, rate};
use super::term::{Terms, has_given_base};
use crate::recording::{Recording, RecordingError, RecordingProblem};

/// Turning points that host commands remember.
pub const CAPACITY: usize = 256;

/// A recording with the signals of one gear.
#[derive(Debug)]
pub struct RecordingContext<'a> {
    /// Its name, for messages.
    pub file: &'a str,
    /// Its signals.
    pub signals: Signals<'a>,
    /// The gear; none for a joint log.
    pub params: Option<Params>,
    /// A in use, rad: for the gear, and for terms that refer to it.
    pub rated_deflection_rad: Option<f64>,
}

/// The base model's way through a recording.
#[derive(Debug, Clone, Default)]
pub struct Followed {
    /// θ, corrected; empty where there is none.
    pub deflection_rad: Vec<f64>,
    /// θ̇.
    pub rate_rad_per_s: Vec<f64>,
    /// f(θ); empty without a gear, as all that follows.
    pub elastic: Vec<f64>,
    /// z.
    pub hysteresis: Vec<f64>,
    /// T_sim where that is the base; empty otherwise.
    pub simulated: Vec<f64>,
    /// The rate of f + z, or of T_sim.
    pub base_rate: Vec<f64>,
    /// Rows outside the rated deflection.
    pub rows_out_of_range: usize,
    /// Pairs of turning points given up because more than [`CAPACITY`] were open.
    pub merged_pairs: u32,
    /// The path before the first row, its deflection corrected, with the base torque.
    pub past: Vec<Sample<f64>>,
}

impl<'a> RecordingContext<'a> {
    /// A recording and the gear that it is of.
    ///
    /// # Errors
    /// A gear without a deflection.
    pub fn new(recording: &'a Recording, signals: Signals<'a>, params: Option<Params>) -> Result<Self, PredictError> {
        if params.is_some() && signals.deflection_rad.is_none() {
            let angles = recording.theta_in_rad.is_some() && recording.theta_out_rad.is_some();
            let problem =
                if angles { RecordingProblem::NoRatio { shown: None } } else { RecordingProblem::NoDeflection };
            let file = recording.name.clone();
            return Err(RecordingError::of_file(&file, problem).into());
        }
        let rated_deflection_rad = params.map(|params| params.rated_deflection_rad());
        Ok(Self { file: &recording.name, signals, params, rated_deflection_rad })
    }

    /// Refuses terms that need what the recording does not tell.
    ///
    /// # Errors
    /// The first such term, and what it needs.
    pub fn check(&self, terms: &Terms) -> Result<(), PredictError> {
        for term in terms.terms() {
            let kind = || term.info().name.to_owned();
            let needs = term.info().needs.iter().chain(term.needs_besides());
            for &need in needs {
                if need == Need::Gear && self.params.is_none() {
                    return Err(PredictError::NoGear(kind()));
                }
                if !self.signals.tell(need) {
                    return Err(PredictError::MissingSignal { file: self.file.to_owned(), kind: kind(), need });
                }
            }
        }
        Ok(())
    }

    /// Takes the deflection terms out of the measured deflection and follows it with the gear. The first row is the start: y = 0, m = 0 there.
    ///
    /// # Errors
    /// A deflection that is absurd for the gear.
    pub fn follow(&self, terms: &Terms) -> Result<Followed, PredictError> {
        let mut followed = Followed::default();
        if let (true, Some(simulated)) = (terms.has_simulation(), self.signals.torque_sim_nm) {
            followed.simulated = simulated.to_vec();
            followed.base_rate = rate(simulated, self.signals.time_s);
        }
        if self.signals.deflection_rad.is_none() {
            return Ok(followed);
        }
        let mut state = terms.start();
        match &self.params {
            None => {
                let mut correct = |sample: &Sample<f64>| terms.correct(&mut state, sample, &|_| 0.0);
                let corrected = |sample: &Sample<f64>| Sample { deflection: correct(sample), ..*sample };
                followed.past = self.signals.past.iter().map(corrected).collect();
                followed.deflection_rad =
                    (0..self.signals.len()).map(|row| correct(&self.signals.sample(row))).collect();
            }
            Some(params) => {
                let gear = Gear::<f64>::new(params);
                let mut path = None;
                let before = self.signals.past.len();
                for step in 0..before + self.signals.len() {
                    let row = step.checked_sub(before);
                    let sample = row.map_or_else(|| self.signals.past[step], |row| self.signals.sample(row));
                    let out = match &mut path {
                        None => {
                            let start = |theta| gear.output(&gear.start::<CAPACITY>(theta)).torque;
                            let theta = terms.correct(&mut state, &sample, &start);
                            gear.output(path.insert(gear.start::<CAPACITY>(theta)))
                        }
                        Some(path) => {
                            let before = &*path;
                            let step = |theta| gear.step_after(&mut before.clone(), theta, sample.period).torque;
                            let theta = terms.correct(&mut state, &sample, &step);
                            gear.step_after(path, theta, sample.period)
                        }
                    };
                    let Some(path) = &path else { continue };
                    if path.status().refused {
                        return Err(PredictError::Absurd {
                            file: self.file.to_owned(),
                            row: row.map_or(0, |row| row + 1),
                            deflection_rad: sample.deflection,
                            rated_deflection_rad: params.rated_deflection_rad(),
                        });
                    }
                    if row.is_none() {
                        followed.past.push(Sample { deflection: path.theta(), base_torque: out.torque, ..sample });
                        continue;
                    }
                    followed.deflection_rad.push(path.theta());
                    followed.elastic.push(out.elastic);
                    followed.hysteresis.push(out.hysteresis);
                    followed.rows_out_of_range += usize::from(path.status().out_of_range);
                    followed.merged_pairs = gear.merged_pairs(path);
                }
                followed.base_rate = rate(&followed.base(), self.signals.time_s);
            }
        }
        followed.rate_rad_per_s = rate(&followed.deflection_rad, self.signals.time_s);
        Ok(followed)
    }

    /// The torque of base model and terms on a way that was followed with the same deflection terms.
    pub fn total(&self, followed: &Followed, terms: &Terms) -> Vec<f64> {
        self.delayed(self.undelayed(followed, terms), terms.delay())
    }

    /// The same before any delay.
    pub fn undelayed(&self, followed: &Followed, terms: &Terms) -> Vec<f64> {
        let sum = self.torque(followed, terms).into_iter().enumerate();
        sum.map(|(row, terms)| terms + followed.base_at(row)).collect()
    }

    /// What the torque terms add, before any delay.
    pub fn torque(&self, followed: &Followed, terms: &Terms) -> Vec<f64> {
        let adds_none = |domain| matches!(domain, Domain::Deflection | Domain::FrictionScale | Domain::Delay);
        if terms.terms().iter().all(|term| adds_none(term.info().domain)) {
            return vec![0.0; self.signals.len()];
        }
        let mut state = terms.start();
        for sample in &followed.past {
            terms.torque(&mut state, sample);
        }
        let load_rate = if has_given_base(terms) { Vec::new() } else { self.load_rate(terms) };
        (0..self.signals.len())
            .map(|row| {
                let at = |values: &[f64]| values.get(row).copied().unwrap_or(0.0);
                let sample = Sample {
                    deflection: at(&followed.deflection_rad),
                    deflection_rate: at(&followed.rate_rad_per_s),
                    base_torque: followed.base_at(row),
                    base_torque_rate: at(&followed.base_rate) + at(&load_rate),
                    ..self.signals.sample(row)
                };
                terms.torque(&mut state, &sample)
            })
            .collect()
    }

    /// The rate of gravity and inertia, T_base of a joint log.
    fn load_rate(&self, terms: &Terms) -> Vec<f64> {
        if !terms.terms().iter().any(|term| term.info().domain == Domain::Load) {
            return Vec::new();
        }
        let mut state = terms.start();
        let load: Vec<f64> =
            (0..self.signals.len()).map(|row| terms.load(&mut state, &self.signals.sample(row))).collect();
        rate(&load, self.signals.time_s)
    }

    /// A torque as it is recorded with a delay.
    pub fn delayed(&self, torque: Vec<f64>, delay_s: f64) -> Vec<f64> {
        if delay_s == 0.0 {
            return torque;
        }
        let mut signal = Resampled::new(self.signals.time_s, &torque);
        self.signals.time_s.iter().map(|t| signal.at(t - delay_s)).collect()
    }
}

impl Followed {
    /// f + z of every row, or T_sim; empty with neither.
    pub fn base(&self) -> Vec<f64> {
        if !self.simulated.is_empty() {
            return self.simulated.clone();
        }
        self.elastic.iter().zip(&self.hysteresis).map(|(f, z)| f + z).collect()
    }

    fn base_at(&self, row: usize) -> f64 {
        match self.simulated.get(row) {
            Some(simulated) => *simulated,
            None => self.elastic.get(row).map_or(0.0, |f| f + self.hysteresis[row]),
        }
    }
}
