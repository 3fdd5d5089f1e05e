//! The firmware's ELF file: where it keeps its blocks.

use std::path::{Path, PathBuf};

use object::{Object, ObjectSection, ObjectSymbol, SectionFlags};

use super::error::ProbeError;
use super::sector::{Range, overlap};

/// An ELF file that was read.
#[derive(Debug)]
pub struct Elf {
    path: PathBuf,
    bytes: Vec<u8>,
}

impl Elf {
    /// Reads a file.
    ///
    /// # Errors
    /// It cannot be read, or is no ELF file.
    pub fn load(path: &Path) -> Result<Self, ProbeError> {
        let bytes = std::fs::read(path).map_err(|error| ProbeError::File { path: path.to_owned(), error })?;
        let elf = Self { path: path.to_owned(), bytes };
        elf.file().map(drop)?;
        Ok(elf)
    }

    fn file(&self) -> Result<object::File<'_>, ProbeError> {
        object::File::parse(&*self.bytes).map_err(|error| ProbeError::NoElf { path: self.path.clone(), error })
    }

    /// The address of a symbol.
    ///
    /// # Errors
    /// There is none of this name.
    pub fn address(&self, symbol: &str) -> Result<u64, ProbeError> {
        let file = self.file()?;
        let found = file.symbols().find(|other| !other.is_undefined() && other.name() == Ok(symbol));
        found.map(|symbol| symbol.address()).ok_or_else(|| {
            let names = file.symbols().filter_map(|symbol| symbol.name().ok().map(str::to_owned));
            let near = names.map(|name| (strsim::jaro_winkler(&name, symbol), name));
            let nearest = near.filter(|(likeness, _)| *likeness > 0.85).max_by(|a, b| a.0.total_cmp(&b.0));
            ProbeError::NoSymbol {
                path: self.path.clone(),
                symbol: symbol.to_owned(),
                nearest: nearest.map(|(_, name)| name),
            }
        })
    }

    /// Makes sure that nothing of the firmware lies in these sectors, but what lies in them whole: the places themselves.
    ///
    /// # Errors
    /// A section of the firmware would be erased in part.
    pub fn leaves(&self, sectors: &[Range]) -> Result<(), ProbeError> {
        for section in self.file()?.sections() {
            let size = section.file_range().map_or(0, |(_, size)| size);
            let loaded = matches!(section.flags(), SectionFlags::Elf { sh_flags } if sh_flags & u64::from(object::elf::SHF_ALLOC) != 0);
            let place = section.address()..section.address() + size;
            let within = |sector: &Range| sector.start <= place.start && place.end <= sector.end;
            let cut = sectors.iter().find(|sector| overlap(sector, &place) && !within(sector));
            if let Some(sector) = cut.filter(|_| loaded && size > 0) {
                let section = section.name().unwrap_or("?").to_owned();
                return Err(ProbeError::InUse { path: self.path.clone(), section, place, sector: sector.clone() });
            }
        }
        Ok(())
    }
}
