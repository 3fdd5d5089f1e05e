//! What a column's name says: the quantity and its unit, as people write them.

use super::quantity::{Quantity, Unit};
use super::unit_text;

/// What a column's name says.
#[derive(Debug, Clone, PartialEq)]
pub enum Named {
    /// A quantity with a unit that is known.
    Known(Quantity, Unit),
    /// A quantity whose unit is missing (empty) or is none that is known.
    BadUnit(Quantity, String),
    /// A quantity whose unit stands in the name and beside it, and the two differ.
    TwoUnits(Quantity, String, String),
    /// Some other column.
    Other,
}

/// Reads a column's name. `torque_desired_nm` is some other column; `torque_lbs` is a torque in an unknown unit.
pub fn parse_name(name: &str) -> Named {
    for quantity in Quantity::ALL {
        let stem = name.get(..quantity.stem().len()).filter(|stem| stem.eq_ignore_ascii_case(quantity.stem()));
        let Some(rest) = stem.map(|stem| &name[stem.len()..]) else { continue };
        if rest.is_empty() {
            return Named::BadUnit(quantity, String::new());
        }
        let Some(suffix) = rest.strip_prefix('_') else { continue };
        if let Some(unit) = quantity.unit(suffix) {
            return Named::Known(quantity, unit);
        }
        if !suffix.contains('_') || suffix.contains("_per_") {
            return Named::BadUnit(quantity, suffix.to_owned());
        }
    }
    Named::Other
}

/// Reads a column's name as people write it: `Torque (Nm)`, `Time [s]`, `TIME_S`, `Theta Out / deg`; or a name and, beside it, its unit.
/// Of a nested name such as `log.torque_nm` the last part counts where the whole says nothing.
pub fn parse_head(name: &str, beside: Option<&str>) -> Named {
    match (parse_part(name, beside), name.rsplit_once(['.', '/'])) {
        (Named::Other, Some((_, last))) => parse_part(last, beside),
        (named, _) => named,
    }
}

fn parse_part(name: &str, beside: Option<&str>) -> Named {
    let (bare, bracketed) = split(name);
    let words = unit_text::words(bare);
    let said = bracketed.or(beside).filter(|unit| !unit_text::is_blank(unit));
    let alone = |name: &str| match parse_name(name) {
        Named::BadUnit(quantity, suffix) => {
            let unit = unit_text::suffix(&suffix).and_then(|suffix| quantity.unit(&suffix));
            unit.map_or(Named::BadUnit(quantity, suffix), |unit| Named::Known(quantity, unit))
        }
        named => named,
    };
    let named = match alone(bare) {
        Named::Other | Named::BadUnit(..) => alone(&words),
        known => known,
    };
    let Some(said) = said else { return named };
    let unit = |quantity: Quantity| unit_text::suffix(said).and_then(|suffix| quantity.unit(&suffix));
    match named {
        Named::Known(quantity, unit_of_name) => match unit(quantity) {
            Some(unit) if unit == unit_of_name => Named::Known(quantity, unit),
            None if !is_unit(said) => Named::Known(quantity, unit_of_name),
            _ => Named::TwoUnits(quantity, unit_of_name.spellings[0].to_owned(), said.to_owned()),
        },
        Named::BadUnit(quantity, suffix) if suffix.is_empty() => match unit(quantity) {
            Some(unit) => Named::Known(quantity, unit),
            None => Named::BadUnit(quantity, said.to_owned()),
        },
        // `Torque sensor [Nm]`: some torque, whose name has no unit to be wrong.
        Named::BadUnit(quantity, _) if unit(quantity).is_some() => Named::Other,
        named => named,
    }
}

/// Splits `Torque (Nm)`, `Torque [Nm]` and `Torque / Nm` into the name and its unit.
pub(super) fn split(name: &str) -> (&str, Option<&str>) {
    let name = name.trim();
    for (open, close) in [('[', ']'), ('(', ')'), ('{', '}')] {
        if let Some((before, unit)) = name.strip_suffix(close).and_then(|rest| rest.rsplit_once(open)) {
            return (before.trim_end(), Some(unit.trim()));
        }
    }
    match name.split_once('/') {
        Some((before, unit)) if is_unit(unit) && !before.trim().is_empty() => (before.trim_end(), Some(unit.trim())),
        _ => (name, None),
    }
}

/// Whether a text is a unit.
pub(super) fn is_unit(text: &str) -> bool {
    unit_text::suffix(text).is_some_and(|suffix| Quantity::ALL.iter().any(|quantity| quantity.unit(&suffix).is_some()))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn units_convert_to_si() {
        let si = |name: &str, number: f64| match parse_name(name) {
            Named::Known(_, unit) => unit.to_si(number),
            other => panic!("{name}: {other:?}"),
        };
        assert_eq!(si("time_ms", 7.0), 0.007);
        assert_eq!(si("deflection_deg", 180.0), PI);
        assert_eq!(si("deflection_arcmin", 60.0), PI / 180.0);
        assert_eq!(si("torque_nmm", 1234.0), 1.234);
        assert_eq!(si("torque_kNm", 2.0), 2000.0);
        assert!((si("torque_lbft", 1.0) - 1.355_817_948_331_400_4).abs() < 1e-15);
        assert!((si("torque_ozin", 1.0) - 7.061_551_814_226_04e-3).abs() < 1e-17);
        assert!((si("temperature_f", 212.0) - 100.0).abs() < 1e-12);
        assert!((si("velocity_out_rpm", 60.0) - 2.0 * PI).abs() < 1e-15);
    }

    #[test]
    fn names_are_told_apart() {
        assert!(matches!(parse_name("torque_sim_nm"), Named::Known(Quantity::TorqueSim, _)));
        assert_eq!(parse_name("torque_MNm"), Named::BadUnit(Quantity::Torque, "MNm".to_owned()));
        assert_eq!(parse_name("time"), Named::BadUnit(Quantity::Time, String::new()));
        assert!(matches!(parse_name("velocity_out_m_per_s"), Named::BadUnit(Quantity::VelocityOut, _)));
        assert_eq!(parse_name("torque_desired_nm"), Named::Other);
        assert_eq!(parse_name("timestamp"), Named::Other);
        assert_eq!(parse_name("torque_model_nm"), Named::Other);
    }

    #[test]
    fn names_are_read_as_people_write_them() {
        let si = |name: &str, beside: Option<&str>| match parse_head(name, beside) {
            Named::Known(quantity, unit) => (quantity, unit.to_si(1.0)),
            other => panic!("{name}: {other:?}"),
        };
        let one = [
            ("Time [s]", Quantity::Time, 1.0),
            ("TIME_S", Quantity::Time, 1.0),
            ("Time(ms)", Quantity::Time, 1e-3),
            ("time [µs]", Quantity::Time, 1e-6),
            ("Torque (Nm)", Quantity::Torque, 1.0),
            ("Torque / N·m", Quantity::Torque, 1.0),
            ("TORQUE_NM", Quantity::Torque, 1.0),
            ("torque [N.mm]", Quantity::Torque, 1e-3),
            ("Torque [mNm]", Quantity::Torque, 1e-3),
            ("Deflection [µrad]", Quantity::Deflection, 1e-6),
            ("deflection (arc min)", Quantity::Deflection, PI / 10_800.0),
            ("Theta Out [°]", Quantity::ThetaOut, PI / 180.0),
            ("theta-in (deg)", Quantity::ThetaIn, PI / 180.0),
            ("Velocity Out [deg/s]", Quantity::VelocityOut, PI / 180.0),
            ("velocity_out [rad/s]", Quantity::VelocityOut, 1.0),
            ("Velocity Out [1/min]", Quantity::VelocityOut, PI / 30.0),
            ("Temperature [°C]", Quantity::Temperature, 1.0),
            ("Current (A)", Quantity::Current, 1.0),
        ];
        for (name, quantity, value) in one {
            assert_eq!(si(name, None), (quantity, value), "{name}");
        }
        assert_eq!(si("Torque", Some("[mNm]")), (Quantity::Torque, 1e-3));
        assert_eq!(si("torque_nm", Some("Nm")), (Quantity::Torque, 1.0));
        assert!(matches!(parse_head("time_s", Some("ms")), Named::TwoUnits(Quantity::Time, ..)));
        assert!(matches!(parse_head("Torque [MNm]", None), Named::BadUnit(Quantity::Torque, _)));
        assert!(matches!(parse_head("TORQUE_MNM", None), Named::BadUnit(Quantity::Torque, _)));
        assert!(matches!(parse_head("Torque", None), Named::BadUnit(Quantity::Torque, _)));
        assert_eq!(parse_head("Motor torque [Nm]", None), Named::Other);
    }
}
