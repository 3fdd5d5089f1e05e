//! Frictions whose refitted shape is that of another friction.
//!
//! Coulomb friction that changes its sign over much of the speed, or is small beside viscous friction, makes of that one of a lower exponent; alone the former stands for such viscous friction.
//!
//! Friction of the position is the same friction at another angle, so both change their sign over the same velocities. Where a fit smooths it over far higher ones, it
//! follows over a part of a turn the dip of the friction at low velocity: it predicts the motion recorded, and fails at other angles.

use super::build::{number, number_of, term};
use super::coulomb_friction::CoulombFriction;
use super::position_dependent_friction::PositionDependentFriction;
use super::stribeck_friction::StribeckFriction;
use super::viscous_friction::{ViscousFriction, viscous_friction};
use super::{Kind, SMOOTHING, of_term, saturates};
use crate::model::{Model, Term};

/// Coulomb friction changes its sign over much of the speed from this share of the largest velocity on.
const MUCH_OF_SPEED: f64 = 0.08;
/// Coulomb friction is small up to this part of the viscous friction at the largest velocity.
const SMALL: f64 = 0.25;
/// The key of the exponent of viscous friction.
const EXPONENT_KEY: &str = "exponent";
/// The key of its size.
const DAMPING: &str = "damping_nms_per_rad";
/// Exponent of viscous friction to start from.
const LOWER_EXPONENT: f64 = 0.8;

/// Friction of the position is smoothed over far higher velocities from so many times the smoothing of the Coulomb friction on.
const FAR_HIGHER: f64 = 3.0;
/// Velocities of the dip to start from, over the largest.
const VELOCITIES: [f64; 3] = [0.04, 0.1, 0.25];
/// Exponent to start from.
const EXPONENT: f64 = 1.5;
/// The dip to start from, over the Coulomb friction.
const DIP: f64 = 0.5;

/// The Coulomb friction of a model, and the places of the terms from `from` on of friction of the position that is smoothed over far higher velocities.
fn smoothed_apart(model: &Model, from: usize) -> Option<(&Term, Vec<usize>)> {
    let coulomb = model.terms.iter().find(|term| term.kind == CoulombFriction.name())?;
    let smoothing = number_of(coulomb, SMOOTHING);
    let is_apart = |at: &usize| {
        let own = &model.terms[*at];
        own.kind == PositionDependentFriction.name() && number_of(own, SMOOTHING) > FAR_HIGHER * smoothing
    };
    let apart: Vec<usize> = (from..model.terms.len()).filter(is_apart).collect();
    (!apart.is_empty()).then_some((coulomb, apart))
}

/// Whether friction of the position among the terms from `from` on is smoothed over far higher velocities than the Coulomb friction of a model.
pub fn is_smoothed_apart(model: &Model, from: usize) -> bool {
    smoothed_apart(model, from).is_some()
}

/// The kind of a dip, and models with one, which start from several velocities and from one smoothing of all friction. None where the friction of the position among the terms from
/// `from` on is smoothed like the Coulomb friction, or a dip is there.
pub fn with_dip(model: &Model, from: usize, fastest_rad_per_s: f64) -> (&'static str, Vec<Model>) {
    let kind = StribeckFriction.name();
    let open = smoothed_apart(model, from).filter(|_| !model.has_term(kind));
    let Some((coulomb, apart)) = open else { return (kind, Vec::new()) };
    let (smoothing, dip) = (number_of(coulomb, SMOOTHING), DIP * number_of(coulomb, "torque_nm"));
    let with = |share: &f64| {
        let mut model = model.clone();
        for at in &apart {
            model.terms[*at].values.insert(SMOOTHING.to_owned(), number(smoothing));
        }
        let mut values = vec![
            ("coulomb_nm", number(0.0)),
            ("static_nm", number(dip)),
            ("stribeck_velocity_rad_per_s", number(share * fastest_rad_per_s)),
            ("exponent", number(EXPONENT)),
            (SMOOTHING, number(smoothing)),
        ];
        if !model.has_term(ViscousFriction.name()) {
            values.push((DAMPING, number(0.0)));
        }
        model.terms.push(term(kind, &values));
        model
    };
    (kind, VELOCITIES.iter().map(with).collect())
}

/// A model with viscous friction of a lower exponent in place of Coulomb friction.
pub struct WithoutCoulomb {
    /// The kind of Coulomb friction.
    pub kind: &'static str,
    /// The model without it.
    pub model: Model,
    /// The kind that stands in its place, where none stood beside it.
    pub instead: Option<&'static str>,
    /// Whether the Coulomb friction changes its sign over much of the speed.
    pub wide: bool,
    /// Whether it comes near its torque within the speeds recorded.
    pub saturated: bool,
    /// Whether it is small beside the viscous friction.
    pub small: bool,
}

/// The exponents within the limits of a fit.
const INNER: std::ops::Range<f64> = 0.61..1.19;

/// Whether the exponent of the viscous friction of a model is within its limits, and not at one.
pub fn has_inner_exponent(model: &Model) -> bool {
    let viscous = model.terms.iter().find(|term| term.kind == ViscousFriction.name());
    viscous.is_some_and(|term| INNER.contains(&number_of(term, EXPONENT_KEY)))
}

/// A model without the Coulomb friction among the terms from `from` on, if that changes its sign over much of the speed or is small beside viscous friction, and no kind of the model refines it; with
/// viscous friction in its place where there is none.
pub fn without_coulomb(model: &Model, from: usize, fastest_rad_per_s: f64) -> Option<WithoutCoulomb> {
    let kind = CoulombFriction.name();
    let place = |kind: &str| (from..model.terms.len()).find(|at| model.terms[*at].kind == kind);
    let refines = |term: &Term| of_term(term).is_some_and(|other| other.refines().contains(&kind));
    let coulomb = place(kind).filter(|_| !model.terms.iter().any(refines))?;
    let wide = number_of(&model.terms[coulomb], SMOOTHING) > MUCH_OF_SPEED * fastest_rad_per_s;
    let saturated = saturates(&model.terms[coulomb], fastest_rad_per_s);
    let torque_nm = number_of(&model.terms[coulomb], "torque_nm");
    let viscous = ViscousFriction.name();
    let beside = place(viscous);
    let small = beside.is_some_and(|at| {
        let own = &model.terms[at];
        let exponent = if own.values.contains_key(EXPONENT_KEY) { number_of(own, EXPONENT_KEY) } else { 1.0 };
        torque_nm.abs() < SMALL * number_of(own, DAMPING) * fastest_rad_per_s.powf(exponent)
    });
    if !wide && !small {
        return None;
    }
    let mut model = model.clone();
    if beside.is_none() {
        if model.has_term(viscous) {
            return None;
        }
        model.terms[coulomb] = viscous_friction(torque_nm / fastest_rad_per_s);
    }
    let own = &mut model.terms[beside.unwrap_or(coulomb)];
    own.values.insert(EXPONENT_KEY.to_owned(), number(LOWER_EXPONENT));
    if beside.is_some() {
        model.terms.remove(coulomb);
    }
    let instead = beside.is_none().then_some(viscous);
    Some(WithoutCoulomb { kind, model, instead, wide, saturated, small })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::parse;

    #[test]
    fn a_dip_is_tried_where_friction_of_the_position_is_smoothed_over_far_higher_velocities() {
        let joint = |smoothing: f64| {
            let text = format!(
                "format = 1\n[gear]\n[[term]]\nkind = \"coulomb_friction\"\ntorque_nm = 2.0\nsmoothing_rad_per_s = 0.01\n\
                 [[term]]\nkind = \"position_dependent_friction\"\nangle = \"output\"\norders = [1.0]\ncos_nm = [0.5]\nsin_nm = [0.0]\n\
                 smoothing_rad_per_s = {smoothing}\n"
            );
            parse("joint.toml", &text).unwrap()
        };
        assert!(with_dip(&joint(0.02), 0, 1.0).1.is_empty());
        let tried = with_dip(&joint(0.2), 0, 1.0).1;
        assert_eq!(tried.len(), 3);
        for model in tried {
            assert!(!is_smoothed_apart(&model, 0));
            assert_eq!((model.terms.len(), number_of(&model.terms[2], "static_nm")), (3, 1.0));
            // The dip stays.
            assert!(with_dip(&model, 0, 1.0).1.is_empty());
        }
        // Of the model given, nothing is tried.
        assert!(with_dip(&joint(0.2), 2, 1.0).1.is_empty());
    }

    #[test]
    fn viscous_friction_is_tried_alone_where_coulomb_friction_changes_its_sign_over_much_of_the_speed() {
        let joint = |smoothing: f64, more: &str| {
            let text = format!(
                "format = 1\n[gear]\n[[term]]\nkind = \"coulomb_friction\"\ntorque_nm = 2.0\nsmoothing_rad_per_s = {smoothing}\n\
                 [[term]]\nkind = \"viscous_friction\"\ndamping_nms_per_rad = 3.0\n{more}"
            );
            parse("joint.toml", &text).unwrap()
        };
        assert!(without_coulomb(&joint(0.05, ""), 0, 1.0).is_none());
        // At 4 rad/s it is a sixth of the viscous friction.
        let small = without_coulomb(&joint(0.05, ""), 0, 4.0).unwrap();
        assert!(small.small && !small.wide && small.model.terms.len() == 1);
        for (smoothing, saturated) in [(0.2, true), (0.4, false)] {
            let alone = without_coulomb(&joint(smoothing, ""), 0, 1.0).unwrap();
            assert_eq!((alone.kind, alone.saturated, alone.instead), ("coulomb_friction", saturated, None));
            assert_eq!(alone.model.terms.len(), 1);
            assert_eq!(number_of(&alone.model.terms[0], "exponent"), LOWER_EXPONENT);
            assert!(has_inner_exponent(&alone.model));
            let mut at_limit = alone.model;
            at_limit.terms[0].values.insert("exponent".to_owned(), number(0.6));
            assert!(!has_inner_exponent(&at_limit));
        }
        // Friction of the model given stays, and so does what another kind refines.
        assert!(without_coulomb(&joint(0.2, ""), 1, 1.0).is_none());
        let refined = "[[term]]\nkind = \"position_dependent_friction\"\nangle = \"output\"\norders = [1.0]\ncos_nm = [0.5]\nsin_nm = [0.0]\n";
        assert!(without_coulomb(&joint(0.2, refined), 0, 1.0).is_none());
    }

    #[test]
    fn viscous_friction_is_tried_in_the_place_of_such_coulomb_friction_alone() {
        let text =
            "format = 1\n[gear]\n[[term]]\nkind = \"coulomb_friction\"\ntorque_nm = 2.0\nsmoothing_rad_per_s = 0.5\n";
        let other = without_coulomb(&parse("joint.toml", text).unwrap(), 0, 4.0).unwrap();
        assert_eq!((other.instead, other.model.terms.len()), (Some("viscous_friction"), 1));
        let viscous = &other.model.terms[0];
        assert_eq!((number_of(viscous, DAMPING), number_of(viscous, "exponent")), (0.5, LOWER_EXPONENT));
        // One of the model given takes no other beside it.
        let given = "[[term]]\nkind = \"viscous_friction\"\ndamping_nms_per_rad = 3.0\n";
        let text = text.replacen("[[term]]", &format!("{given}[[term]]"), 1);
        assert!(without_coulomb(&parse("joint.toml", &text).unwrap(), 1, 4.0).is_none());
    }
}
