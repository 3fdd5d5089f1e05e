//! Why no block was made, or none read.

use std::path::PathBuf;

use gmhm::ParamError;
use gmhm::block::BlockError;
use gmhm::terms::TermError;

use super::pack::DRIVE_TERMS;
use crate::model::refusal;
use crate::number::trimmed;

/// Why no block was made of a model.
#[derive(Debug, thiserror::Error)]
pub enum PackError {
    /// The model does not say where the model is calibrated.
    #[error("the model has no rated_deflection_rad in [gear]")]
    NoRatedDeflection,
    /// The parameters are refused at the rated deflection in use.
    #[error("the model at the rated deflection {} rad: {}", trimmed(*rated_deflection_rad, 6), refusal::of_parameters(error))]
    Params {
        /// The rated deflection in use, rad.
        rated_deflection_rad: f64,
        /// Why the core refuses them.
        error: ParamError,
    },
    /// Law `time` without a control period.
    #[error("law time needs the control period of the drive")]
    NoPeriod,
    /// A top speed without a control period.
    #[error("the top speed needs the control period of the drive")]
    NoPeriodOfTopSpeed,
    /// A top speed for a model without a gear.
    #[error("the top speed bounds the deflection of a gear, and the model has none")]
    TopSpeedWithoutGear,
    /// A law that fixed point does not compute.
    #[error("law phase is not computed in fixed point")]
    FixedLaw,
    /// Terms, which fixed point does not compute.
    #[error("the model's term `{0}` is not computed in fixed point")]
    FixedTerms(String),
    /// The model holds neither gear nor terms.
    #[error("the model has neither [elastic] and [memory] nor any [[term]]: there is nothing to pack")]
    EmptyModel,
    /// A term that is refused.
    #[error("the model's term `{kind}`: {error}")]
    Term {
        /// Its kind.
        kind: String,
        /// Why the core refuses it.
        error: TermError,
    },
    /// More terms than a drive has room for.
    #[error("the model has {0} terms, and a drive has room for {DRIVE_TERMS}")]
    TooManyTerms(usize),
    /// A block without a gear of law `masing`.
    #[error("the block in force has no gear of law masing: nothing in it is adapted")]
    NotMasing,
    /// The core refuses what was made.
    #[error("the block is invalid: {0}")]
    Block(#[from] BlockError),
}

impl PackError {
    /// How to fix it.
    pub fn fix(&self) -> Option<String> {
        let text = match self {
            Self::NoRatedDeflection => "add rated_deflection_rad to [gear], or give --rated-deflection RAD",
            Self::NoPeriod | Self::NoPeriodOfTopSpeed => "add --period SECONDS",
            Self::TopSpeedWithoutGear => "leave --top-speed out",
            Self::FixedLaw => "pack it with --scalar f32, or fit the gear with law masing",
            Self::FixedTerms(_) => "pack it with --scalar f32, or leave the [[term]] tables out",
            Self::TooManyTerms(_) => "leave out the terms with the smallest share, or those of the measurement",
            Self::Params { .. } => "correct the model, fit the gear again, or give --rated-deflection",
            Self::Term { .. } => "correct the term, or remove it",
            Self::EmptyModel => "name a model that gmhm fit wrote",
            Self::NotMasing | Self::Block(_) => return None,
        };
        Some(text.to_owned())
    }
}

/// Why a file of a block was refused.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The system could not read it.
    #[error("{}: cannot be read: {error}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// A name that tells no form.
    #[error("{}: a block is written as .bin, .hex (Intel HEX) or .h (C)", .0.display())]
    Form(PathBuf),
    /// An address where no block fits.
    #[error("at the address {address:#x} a block of {length} bytes runs past the end of 32 bits")]
    Address {
        /// Where it should begin.
        address: u32,
        /// Its bytes.
        length: usize,
    },
    /// A line that is no Intel HEX.
    #[error("{}, line {line}: {error}", path.display())]
    Hex {
        /// The file.
        path: PathBuf,
        /// Its line, counted from 1.
        line: usize,
        /// What is wrong.
        error: String,
    },
    /// What the file holds is no block.
    #[error("{}: {error}", path.display())]
    Block {
        /// The file.
        path: PathBuf,
        /// Why.
        error: BlockError,
    },
}

impl FileError {
    /// How to fix it.
    pub fn fix(&self) -> Option<String> {
        let text = match self {
            Self::Form(_) => "end the name in .bin, .hex or .h",
            Self::Address { .. } => "give a lower --address",
            Self::Hex { .. } => "write it again with gmhm pack, or read the .bin",
            Self::Block { error: BlockError::Magic, .. } => {
                "name a block that gmhm pack wrote, .bin or .hex; a C header cannot be read back"
            }
            Self::Block { error: BlockError::Checksum | BlockError::Length { .. }, .. } => {
                "pack it again from its model, or copy it again"
            }
            Self::Block { error: BlockError::Version(_), .. } => "use the gmhm that packed it, or a newer one",
            Self::Unreadable { .. } => "check the path, and that the file may be read",
            Self::Block { .. } => return None,
        };
        Some(text.to_owned())
    }
}
