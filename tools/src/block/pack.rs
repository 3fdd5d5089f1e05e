//! From a model to the bytes of its block.

use clap::ValueEnum;
use gmhm::block::{
    Block, BlockError, FIRST_TERM, GEAR, Header, INVERSE, Identity, Joint, MASING, MOST_BYTES, PREPARED, Parameters,
    PreparedLaw, SELF_TEST, ScalarKind, TorqueUnit, Word, Writer, verify,
};
use gmhm::memory::AnyLaw;
use gmhm::memory::masing::Masing;
use gmhm::memory::time::Time;
use gmhm::scalar::{Fixed, Scalar};
use gmhm::terms::{KeyInfo, Source, Stack, Value};
use gmhm::{Gear, Inverse, Law, Params};

use super::error::PackError;
use crate::model::{Model, Term, TermValue, TorqueSide};
use crate::recording;

/// The most terms of a drive.
pub const DRIVE_TERMS: usize = 8;

/// What a drive in single precision loads a block as.
type InF32 = Parameters<f32, AnyLaw<f32>, Stack<f32, DRIVE_TERMS>>;

/// What the drive computes in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Arithmetic {
    /// Single precision
    #[default]
    F32,
    /// Fixed point, 28 bits after the point, for cores without FPU: laws masing and time, no terms
    Fixed,
}

impl Arithmetic {
    fn kind(self) -> ScalarKind {
        match self {
            Self::F32 => ScalarKind::F32,
            Self::Fixed => ScalarKind::Fixed,
        }
    }
}

/// How a model is packed.
#[derive(Debug, Clone, Default)]
pub struct PackOptions {
    /// What the drive computes in.
    pub arithmetic: Arithmetic,
    /// The control period, s; law `time` needs it.
    pub period_s: Option<f64>,
    /// Top speed of the deflection, rad/s: the drive quarantines samples that move faster. Needs the period.
    pub top_speed_rad_per_s: Option<f64>,
    /// A instead of the model's, rad.
    pub rated_deflection_rad: Option<f64>,
    /// Which gear the block is for; by default the one of the model's name.
    pub identity: Option<Identity>,
    /// Turning points that the drive remembers; by default 16.
    pub stack_depth: Option<u16>,
}

/// A block, and whether the drive can invert it.
#[derive(Debug, Clone, PartialEq)]
pub struct Packed {
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// Why it holds no inverse, where it holds none: the drive then predicts, but cannot feed a deflection forward.
    pub without_inverse: Option<String>,
}

/// The block of a model. It is loaded as the drive would before it is handed out.
///
/// # Errors
/// [`PackError`]: what the model lacks, or what the core refuses.
pub fn pack(model: &Model, options: &PackOptions) -> Result<Packed, PackError> {
    let params = params(model, options)?;
    if params.is_none() && model.terms.is_empty() {
        return Err(PackError::EmptyModel);
    }
    if model.terms.len() > DRIVE_TERMS {
        return Err(PackError::TooManyTerms(model.terms.len()));
    }
    if let (Arithmetic::Fixed, Some(term)) = (options.arithmetic, model.terms.first()) {
        return Err(PackError::FixedTerms(term.kind.clone()));
    }
    let period_s = options.period_s.unwrap_or(0.0);
    let mut header = Header {
        period_s: period_s as f32,
        torque_unit: match model.torque_unit {
            recording::TorqueUnit::NewtonMetre => TorqueUnit::NewtonMetre,
            recording::TorqueUnit::Ampere => TorqueUnit::Ampere,
        },
        ..Header::new(options.identity.unwrap_or_else(|| Identity::of_name(&model.name)), options.arithmetic.kind())
    };
    header.stack_depth = options.stack_depth.unwrap_or(header.stack_depth);

    let mut buffer = vec![0; MOST_BYTES];
    let mut writer = Writer::new(&mut buffer, header);
    let mut without_inverse = None;
    if let Some(params) = &params {
        let law = (options.arithmetic, params.memory().law);
        without_inverse = match law {
            (Arithmetic::F32, _) => write_gear(&mut writer, params, AnyLaw::<f32>::new(params, period_s), period_s)?,
            (Arithmetic::Fixed, Law::Masing) => {
                write_gear(&mut writer, params, Masing::<Fixed>::new(params), period_s)?
            }
            (Arithmetic::Fixed, Law::Time) => {
                write_gear(&mut writer, params, Time::<Fixed>::new(params, period_s), period_s)?
            }
            (Arithmetic::Fixed, Law::Phase) => return Err(PackError::FixedLaw),
        };
    }
    if let Some(top_speed) = options.top_speed_rad_per_s {
        let params = params.as_ref().ok_or(PackError::TopSpeedWithoutGear)?;
        let step_rad = top_speed * options.period_s.ok_or(PackError::NoPeriodOfTopSpeed)?;
        match options.arithmetic {
            Arithmetic::F32 => writer.largest_step(step_rad as f32)?,
            Arithmetic::Fixed => writer.largest_step(Fixed::from_f64(step_rad / params.rated_deflection_rad()))?,
        }
    }
    writer.joint(&Joint {
        ratio: model.gear.ratio,
        deflection_zero_rad: model.gear.deflection_zero_rad,
        motor_side: model.gear.torque_side == TorqueSide::Motor,
    })?;
    for term in &model.terms {
        writer.term(&term.kind, &Rounded::new(term)).map_err(|error| blamed(term, error))?;
    }
    if !model.name.is_empty() {
        writer.name(&model.name)?;
    }
    let length = writer.finish()?;
    buffer.truncate(length);
    check(&buffer, options.arithmetic, params.map(|params| params.memory().law))?;
    Ok(Packed { bytes: buffer, without_inverse })
}

/// The parameters of a block's gear in `f32`.
///
/// # Errors
/// A block that cannot be loaded, or that has no gear of law `masing`.
pub fn params_of(block: &Block<'_>) -> Result<Params, PackError> {
    let loaded = InF32::of_any_block(block, usize::MAX, block.header().torque_unit)?;
    loaded.params().ok_or(PackError::NotMasing)
}

/// A block in `f32` with other parameters of its gear, law `masing`; everything else as it was.
///
/// # Errors
/// [`PackError`]: the core refuses the parameters or what was made of them.
pub fn with_params(block: &Block<'_>, params: &Params) -> Result<Packed, PackError> {
    params_of(block)?;
    let period_s = f64::from(block.header().period_s);
    let mut buffer = vec![0; MOST_BYTES];
    let mut writer = Writer::new(&mut buffer, *block.header());
    let without_inverse = write_gear(&mut writer, params, AnyLaw::<f32>::new(params, period_s), period_s)?;
    let of_gear = [&GEAR, &MASING, &INVERSE, &SELF_TEST, &PREPARED].map(|info| info.tag);
    for record in block.records().filter(|record| !of_gear.contains(&record.tag)) {
        let words: Vec<u32> = record.words().collect();
        writer.record(record.tag, &words)?;
    }
    let length = writer.finish()?;
    buffer.truncate(length);
    check(&buffer, Arithmetic::F32, Some(Law::Masing))?;
    Ok(Packed { bytes: buffer, without_inverse })
}

/// Writes gear and inverse with what their set-up comes to; why there is no inverse where there is none.
fn write_gear<S: Word, L: PreparedLaw<S>>(
    writer: &mut Writer<'_>,
    params: &Params,
    law: L,
    period_s: f64,
) -> Result<Option<String>, BlockError> {
    let gear = Gear::with_law(params, law);
    writer.gear(&gear, params)?;
    let inverse = Inverse::of(params, law, period_s);
    if inverse.is_ok() {
        writer.inverse::<S>(params, period_s)?;
    }
    writer.self_test(&gear, inverse.as_ref().ok())?;
    if let Ok(inverse) = &inverse {
        writer.prepared(inverse)?;
    }
    Ok(inverse.err().map(|error| error.to_string()))
}

/// Loads a block as a drive would: what the drive's numbers cannot hold shows here, the model itself was checked in `f64`.
fn check(block: &[u8], arithmetic: Arithmetic, law: Option<Law>) -> Result<(), PackError> {
    let block = verify(block)?;
    let unit = block.header().torque_unit;
    let loaded = match (arithmetic, law) {
        (Arithmetic::F32, _) => InF32::of_any_block(&block, usize::MAX, unit).map(drop),
        (Arithmetic::Fixed, Some(Law::Time)) => {
            Parameters::<Fixed, Time<Fixed>, ()>::of_any_block(&block, usize::MAX, unit).map(drop)
        }
        (Arithmetic::Fixed, _) => {
            Parameters::<Fixed, Masing<Fixed>, ()>::of_any_block(&block, usize::MAX, unit).map(drop)
        }
    };
    loaded.map_err(|error| match error {
        BlockError::Term { tag, error } => {
            let kind = gmhm::terms::kind_of_tag(tag - FIRST_TERM).map_or("?", |info| info.name);
            PackError::Term { kind: kind.to_owned(), error }
        }
        error => error.into(),
    })
}

fn blamed(term: &Term, error: BlockError) -> PackError {
    match error {
        BlockError::Term { error, .. } => PackError::Term { kind: term.kind.clone(), error },
        other => other.into(),
    }
}

fn params(model: &Model, options: &PackOptions) -> Result<Option<Params>, PackError> {
    if model.elastic.is_none() || model.memory.is_none() {
        return Ok(None);
    }
    let rated = options.rated_deflection_rad.or(model.gear.rated_deflection_rad);
    let rated_deflection_rad = rated.ok_or(PackError::NoRatedDeflection)?;
    let params = model.drive_params(rated_deflection_rad).transpose();
    let params = params.map_err(|error| PackError::Params { rated_deflection_rad, error })?;
    let is_time = params.is_some_and(|params| params.memory().law == Law::Time);
    if is_time && options.period_s.is_none() { Err(PackError::NoPeriod) } else { Ok(params) }
}

/// The values of a term in single precision.
pub(crate) struct Rounded<'a> {
    term: &'a Term,
    lists: Vec<(&'a str, Vec<f32>)>,
}

impl<'a> Rounded<'a> {
    /// Those of a term.
    pub(crate) fn new(term: &'a Term) -> Self {
        let list = |(key, value): (&'a String, &TermValue)| match value {
            TermValue::List(list) => Some((key.as_str(), list.iter().map(|x| *x as f32).collect())),
            _ => None,
        };
        Self { term, lists: term.values.iter().filter_map(list).collect() }
    }
}

impl Source<f32> for Rounded<'_> {
    fn get(&self, key: &'static KeyInfo) -> Option<Value<'_, f32>> {
        Some(match Source::<f64>::get(self.term, key)? {
            Value::Number(x) => Value::Number(x as f32),
            Value::List(_) => {
                let (_, list) = self.lists.iter().find(|(name, _)| *name == key.name)?;
                Value::List(list)
            }
            Value::Choice(number) => Value::Choice(number),
            Value::NoChoice => Value::NoChoice,
        })
    }
}
