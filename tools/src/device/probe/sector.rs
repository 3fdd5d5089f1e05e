//! Erase sectors: a block has its own.

use super::error::ProbeError;

/// Addresses from the first to before the last.
pub type Range = std::ops::Range<u64>;

/// The sectors of one flash.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sectors {
    /// The flash.
    pub flash: Range,
    /// From which offset in it on sectors have which size, ascending.
    pub sizes: Vec<(u64, u64)>,
}

impl Sectors {
    /// The sector at an address.
    pub fn at(&self, address: u64) -> Option<Range> {
        let offset = address.checked_sub(self.flash.start).filter(|_| address < self.flash.end)?;
        let (first, size) = *self.sizes.iter().rfind(|(first, size)| *first <= offset && *size > 0)?;
        let start = address - (offset - first) % size;
        Some(start..start + size)
    }

    /// The sectors of a block at an address, from the first to the last.
    fn of_block(&self, address: u64, length: u64) -> Result<Range, ProbeError> {
        let beyond = ProbeError::NoFlash(address);
        let (Some(first), Some(last)) = (self.at(address), self.at(address + length.max(1) - 1)) else {
            return Err(beyond);
        };
        if first.start == address {
            Ok(first.start..last.end)
        } else {
            Err(ProbeError::Unaligned { address, sector: first })
        }
    }
}

/// The sectors of each place that a block of so many bytes would take.
///
/// # Errors
/// No flash, a place that does not begin a sector, places that share one.
pub fn of_places(
    addresses: &[u64],
    length: u64,
    sectors: impl Fn(u64) -> Option<Sectors>,
) -> Result<Vec<Range>, ProbeError> {
    let place = |address: &u64| {
        let address = *address;
        sectors(address).ok_or(ProbeError::NoFlash(address))?.of_block(address, length)
    };
    let taken = addresses.iter().map(place).collect::<Result<Vec<_>, _>>()?;
    match taken.as_slice() {
        [a, b] if overlap(a, b) => Err(ProbeError::OnePlace { a: a.clone(), b: b.clone() }),
        _ => Ok(taken),
    }
}

/// Whether two ranges have an address in common.
pub(super) fn overlap(a: &Range, b: &Range) -> bool {
    a.start < b.end && b.start < a.end
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two small sectors, then large ones, as an STM32F4 has them.
    fn uneven(address: u64) -> Option<Sectors> {
        let flash = 0x800_0000..0x804_0000;
        flash.contains(&address).then(|| Sectors { flash, sizes: vec![(0, 0x4000), (0x8000, 0x1_0000)] })
    }

    #[test]
    fn a_block_takes_whole_sectors() {
        let of = |address, length| of_places(&[address], length, uneven).map(|taken| taken[0].clone());
        assert_eq!(of(0x800_4000, 200).ok(), Some(0x800_4000..0x800_8000));
        assert_eq!(of(0x800_4000, 0x4001).ok(), Some(0x800_4000..0x801_8000));
        assert_eq!(of(0x801_8000, 4096).ok(), Some(0x801_8000..0x802_8000));
        let told = |address, length| of(address, length).expect_err("no place").to_string();
        assert!(told(0x801_0000, 200).contains("0x8008000 to 0x8018000"), "{}", told(0x801_0000, 200));
        assert!(told(0x2000_0000, 200).contains("no flash"));
        // Its end would be beyond the last sector.
        assert!(told(0x803_8000, 0x1_0001).contains("no flash"));
    }

    #[test]
    fn two_places_have_sectors_of_their_own() {
        let of = |a, b| of_places(&[a, b], 200, uneven).map_err(|error| error.to_string());
        assert_eq!(of(0x800_0000, 0x800_4000), Ok(vec![0x800_0000..0x800_4000, 0x800_4000..0x800_8000]));
        assert!(of(0x800_4000, 0x800_4000).is_err_and(|told| told.contains("share")));
        // A block of more than a sector reaches into the next place.
        assert!(of_places(&[0x800_0000, 0x800_4000], 0x4004, uneven).is_err());
    }
}
