//! An entry of the object dictionary.

/// What a value is, by its data type of CiA 301.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u16)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum DataType {
    /// One byte.
    Unsigned8 = 0x05,
    /// Two bytes.
    Unsigned16 = 0x06,
    /// Four bytes.
    Unsigned32 = 0x07,
    /// IEEE 754 single precision.
    Real32 = 0x08,
    /// Text of up to 16 bytes, padded with zeros.
    VisibleString = 0x09,
    /// Any bytes.
    Domain = 0x0F,
}

impl DataType {
    /// Its number.
    #[must_use]
    pub const fn number(self) -> u16 {
        self as u16
    }

    /// How many bytes a value takes; `None` where they vary.
    #[must_use]
    pub const fn bytes(self) -> Option<usize> {
        match self {
            Self::Unsigned8 => Some(1),
            Self::Unsigned16 => Some(2),
            Self::Unsigned32 | Self::Real32 => Some(4),
            Self::VisibleString | Self::Domain => None,
        }
    }
}

/// Who may do what.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Access {
    /// It is read.
    ReadOnly,
    /// It is written.
    WriteOnly,
    /// Both.
    ReadWrite,
}

/// An entry of the dictionary.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Object {
    /// Its index.
    pub index: u16,
    /// Its sub-index; entries of one index with sub-indices above 0 are a record.
    pub sub: u8,
    /// Its name, its unit at the end.
    pub name: &'static str,
    /// What its value is.
    pub data_type: DataType,
    /// Its unit, empty for none.
    pub unit: &'static str,
    /// Who may do what.
    pub access: Access,
    /// The least and the largest value that may be written.
    pub range: Option<[f32; 2]>,
}
