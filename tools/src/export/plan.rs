//! What of a model is exported.

use clap::ValueEnum;
use gmhm::memory::AnyLaw;
use gmhm::terms::{Domain, KindInfo, Need, Setting, Side, Term as CoreTerm};
use gmhm::{Inverse, Law, Params};

use super::kinds::KindSource;
use super::{ExportError, ExportOptions};
use crate::model::{Model, Term};
use crate::physics::term::sigma;

/// What the source computes in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Precision {
    /// Single precision
    #[default]
    F32,
    /// Double precision
    F64,
}

/// A term that is exported.
pub(super) struct PlannedTerm<'a> {
    pub(super) term: &'a Term,
    pub(super) info: &'static KindInfo,
    pub(super) source: KindSource,
    /// Its member of the structures: the kind, and which of its kind it is.
    pub(super) member: String,
    pub(super) needs_besides: &'static [Need],
}

/// What of a model is exported.
pub(super) struct Plan<'a> {
    pub(super) model: &'a Model,
    pub(super) params: Params,
    pub(super) law: Law,
    pub(super) sigma: f64,
    pub(super) period_s: f64,
    pub(super) precision: Precision,
    pub(super) turning_points: u16,
    pub(super) prefix: String,
    pub(super) terms: Vec<PlannedTerm<'a>>,
    pub(super) left_out: Vec<String>,
    pub(super) without_inverse: Option<String>,
}

impl<'a> Plan<'a> {
    /// Checks a model and everything that is asked of it.
    pub(super) fn new(model: &'a Model, options: &ExportOptions) -> Result<Self, ExportError> {
        if model.is_simulation() {
            return Err(ExportError::OnSimulation);
        }
        let rated = options.rated_deflection_rad.or(model.gear.rated_deflection_rad);
        if model.elastic.is_none() || model.memory.is_none() {
            return Err(ExportError::NoGear);
        }
        let rated_deflection_rad = rated.ok_or(ExportError::NoRatedDeflection)?;
        let params = match options.precision {
            Precision::F32 => model.drive_params(rated_deflection_rad),
            Precision::F64 => model.params(rated_deflection_rad),
        };
        let refused = |error| ExportError::Params { rated_deflection_rad, error };
        let params = params.ok_or(ExportError::NoGear)?.map_err(refused)?;
        let law = params.memory().law;
        if law == Law::Time && options.period_s.is_none() {
            return Err(ExportError::NoPeriod);
        }
        let period_s = options.period_s.unwrap_or(0.0);
        let inverse = Inverse::<f64>::of(&params, AnyLaw::new(&params, period_s), period_s);
        let setting = Setting {
            sigma: sigma(&model.gear),
            c1: params.elastic().c1_nm_per_rad,
            rated_deflection: rated_deflection_rad,
        };
        let (mut terms, mut left_out) = (Vec::new(), Vec::new());
        for term in &model.terms {
            let refused = |error| ExportError::Term { kind: term.kind.clone(), error };
            let core = CoreTerm::<f64>::read(&term.kind, term, setting).map_err(refused)?;
            let info = core.info();
            if info.side == Side::Instrument {
                left_out.push(term.kind.clone());
                continue;
            }
            let no_source = || ExportError::Kind(term.kind.clone());
            let source = KindSource::of(info.name).ok_or_else(no_source)?;
            let same = |other: &&PlannedTerm| other.info.name == info.name;
            let number = 1 + terms.iter().filter(same).count();
            let member = format!("{}_{number}", info.name);
            terms.push(PlannedTerm { term, info, source, member, needs_besides: core.needs_besides() });
        }
        // A factor on friction without any friction changes nothing.
        if !terms.iter().any(|planned| planned.info.domain == Domain::Friction) {
            terms.retain(|planned| planned.info.domain != Domain::FrictionScale);
        }
        Ok(Self {
            model,
            params,
            law,
            sigma: setting.sigma,
            period_s,
            precision: options.precision,
            turning_points: options.turning_points,
            prefix: prefix(options.prefix.as_deref(), &model.name)?,
            terms,
            left_out,
            without_inverse: inverse.err().map(|error| error.to_string()),
        })
    }
}

/// The longest prefix.
const LONGEST_PREFIX: usize = 24;

/// The prefix asked for, else what a name has of letters and digits.
fn prefix(asked: Option<&str>, name: &str) -> Result<String, ExportError> {
    let begins = |text: &str| text.starts_with(|c: char| c.is_ascii_alphabetic());
    if let Some(asked) = asked {
        let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let accepted = begins(asked) && asked.len() <= LONGEST_PREFIX && asked.chars().all(is_name);
        let refused = || ExportError::Prefix(asked.to_owned());
        return accepted.then(|| asked.to_owned()).ok_or_else(refused);
    }
    let mut prefix = String::new();
    for c in name.chars().map(|c| c.to_ascii_lowercase()) {
        if c.is_ascii_alphanumeric() {
            prefix.push(c);
        } else if !prefix.is_empty() && !prefix.ends_with('_') {
            prefix.push('_');
        }
    }
    prefix.truncate(LONGEST_PREFIX);
    let prefix = prefix.trim_end_matches('_');
    Ok(if begins(prefix) { prefix.to_owned() } else { "gear".to_owned() })
}

#[cfg(test)]
mod tests {
    use super::prefix;

    #[test]
    fn a_prefix_is_a_name_of_c() {
        let of = |name: &str| prefix(None, name).unwrap();
        assert_eq!((of("Joint 3 (left)"), of("3"), of("")), ("joint_3_left".into(), "gear".into(), "gear".into()));
        assert_eq!(prefix(Some("J3"), "x").unwrap(), "J3");
        assert!(["3j", "a-b", "", "abcdefghijklmnopqrstuvwxyz"].iter().all(|asked| prefix(Some(asked), "x").is_err()));
    }
}
