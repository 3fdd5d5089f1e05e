//! A chip by probe-rs, whichever probe and maker.

use std::time::Duration;

use probe_rs::config::TargetSelector;
use probe_rs::flashing::{DownloadOptions, FlashProgress, ProgressEvent, ProgressOperation};
use probe_rs::probe::list::Lister;
use probe_rs::{MemoryInterface, Permissions, Session, Target};

use super::Chip;
use super::error::ProbeError;
use super::sector::Sectors;

/// How long the core may take to halt.
const HALTING: Duration = Duration::from_millis(500);

/// A chip that the one attached probe has found.
pub struct Attached {
    session: Session,
}

fn failed<E: std::error::Error + Send + Sync + 'static>(doing: &'static str) -> impl Fn(E) -> ProbeError {
    move |error| ProbeError::Failed { doing, error: Box::new(error) }
}

impl Attached {
    /// Attaches to a chip by its name, or to the one that is found.
    ///
    /// # Errors
    /// No probe, several, or one that does not reach a chip of this name.
    pub fn to(name: Option<&str>) -> Result<Self, ProbeError> {
        let found = Lister::new().list_all();
        let [probe] = found.as_slice() else {
            let found: Vec<String> = found.iter().map(ToString::to_string).collect();
            return Err(if found.is_empty() { ProbeError::NoneAttached } else { ProbeError::Several(found) });
        };
        let target = name.map_or(TargetSelector::Auto, |name| TargetSelector::Unspecified(name.to_owned()));
        let probe = probe.open().map_err(failed("open"))?;
        let session = probe.attach(target, Permissions::default()).map_err(failed("attach to the chip"))?;
        Ok(Self { session })
    }
}

/// The sectors of a target's flash at an address.
fn sectors(target: &Target, address: u64) -> Option<Sectors> {
    let properties = target.flash_algorithms.iter().map(|algorithm| &algorithm.flash_properties);
    let flash = properties.clone().find(|flash| flash.address_range.contains(&address))?;
    let sizes = flash.sectors.iter().map(|sector| (sector.address, sector.size)).collect();
    Some(Sectors { flash: flash.address_range.clone(), sizes })
}

impl Chip for Attached {
    fn sectors(&self, address: u64) -> Option<Sectors> {
        sectors(self.session.target(), address)
    }

    fn read(&mut self, address: u64, bytes: &mut [u8]) -> Result<(), ProbeError> {
        let mut core = self.session.core(0).map_err(failed("reach the core"))?;
        core.halt(HALTING).map_err(failed("halt the core"))?;
        core.read(address, bytes).map_err(failed("read memory"))
    }

    fn program(&mut self, address: u64, bytes: &[u8], progress: &mut dyn FnMut(usize)) -> Result<(), ProbeError> {
        let mut loader = self.session.target().flash_loader();
        loader.add_data(address, bytes).map_err(failed("find flash for the block"))?;
        let mut done = 0;
        let mut options = DownloadOptions::default();
        options.verify = true;
        options.keep_unwritten_bytes = true;
        options.progress = FlashProgress::new(|event| {
            if let ProgressEvent::Progress { operation: ProgressOperation::Program, size, .. } = event {
                done += size as usize;
                progress(done);
            }
        });
        loader.commit(&mut self.session, options).map_err(failed("program the flash"))
    }

    fn restart(&mut self) -> Result<(), ProbeError> {
        let mut core = self.session.core(0).map_err(failed("reach the core"))?;
        core.reset().map_err(failed("reset the chip"))
    }
}

#[cfg(test)]
mod tests {
    use probe_rs::config::Registry;

    use super::*;

    #[test]
    fn chips_are_known_by_name_with_their_sectors() {
        let registry = Registry::from_builtin_families();
        for (chip, address, sector) in [
            ("nRF51822_xxAA", 0x3_F900, 0x3_F800..0x3_FC00),
            ("STM32G431CB", 0x801_F800, 0x801_F800..0x802_0000),
            ("STM32F405RG", 0x804_0000, 0x804_0000..0x806_0000),
        ] {
            let target = registry.get_target_by_name(chip).expect("a chip");
            let found = sectors(&target, address).and_then(|sectors| sectors.at(address));
            assert_eq!(found, Some(sector), "{chip}");
            assert_eq!(sectors(&target, 0x2000_0000), None, "{chip}: RAM");
        }
    }
}
