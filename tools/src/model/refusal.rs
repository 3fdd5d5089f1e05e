//! What the core refuses, with its numbers as all messages write them.

use gmhm::ParamError;
use gmhm::inverse::InverseError;

use crate::number::trimmed;

/// Digits of a number that was given.
const DIGITS: usize = 6;

/// Why the core refuses parameters, in words.
pub fn of_parameters(error: &ParamError) -> String {
    let number = |value: f64| trimmed(value, DIGITS);
    match error {
        ParamError::NotPositive { parameter, value } => {
            format!("{parameter} = {} must be greater than zero", number(*value))
        }
        ParamError::Negative { parameter, value } => format!("{parameter} = {} must not be negative", number(*value)),
        ParamError::OutOfRange { parameter, value, least, most } => format!(
            "{parameter} = {} is outside {} to {}, the range of gears; check the units",
            number(*value),
            number(*least),
            number(*most)
        ),
        other => other.to_string(),
    }
}

/// Why the core cannot invert a model, in words.
pub fn of_inverse(error: &InverseError) -> String {
    match error {
        InverseError::NoRange { law, slope_nm_per_rad } if slope_nm_per_rad.is_finite() => format!(
            "law {} with these parameters has no inverse: the torque can fall while the deflection rises through zero (least slope {} N·m/rad)",
            law.name(),
            trimmed(*slope_nm_per_rad, 4)
        ),
        InverseError::NoRange { law, .. } => format!(
            "law {} with these parameters has no inverse: the torque can fall while the deflection rises through zero",
            law.name()
        ),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_whatever_their_size() {
        let parameter = "c1_nm_per_rad";
        let negative = of_parameters(&ParamError::Negative { parameter, value: -25000.0 });
        assert_eq!(negative, "c1_nm_per_rad = −25\u{202f}000 must not be negative");
        let huge = of_parameters(&ParamError::OutOfRange { parameter, value: 1e300, least: 1e-9, most: 2e9 });
        let expected = "c1_nm_per_rad = 1·10³⁰⁰ is outside 1·10⁻⁹ to 2·10⁹, the range of gears; check the units";
        assert_eq!(huge, expected);
    }
}
