//! Refusing a contact problem that cannot be one: the first wrong entry is named with its value. Passing says
//! that the solvers can work on it, not that it has a solution.

use crate::prepared::{PreparedContact, Row};
use crate::problem::{ContactProblem, ProblemError};
use carom_math::{Column, Inertia, Space};

fn refuse(place: String, problem: String, remedy: &str) -> Result<(), ProblemError> {
    Err(ProblemError { place, problem, remedy: remedy.into() })
}

/// See [`ContactProblem::check`].
pub fn check<S: Space>(p: &ContactProblem<S>) -> Result<(), ProblemError> {
    if p.space != S::NAME {
        return refuse(
            "space".into(),
            format!("got {:?}, wanted {:?}", p.space, S::NAME),
            "load it with the other space",
        );
    }
    if p.inverse_masses.len() != p.velocities.len() {
        let (m, v) = (p.inverse_masses.len(), p.velocities.len());
        return refuse(
            "velocities".into(),
            format!("{v} velocities for {m} bodies"),
            "give one velocity per body",
        );
    }
    check_bodies(p)?;
    check_contacts(p)?;
    check_rows(p)?;
    check_resistances(p)
}

fn check_resistances<S: Space>(p: &ContactProblem<S>) -> Result<(), ProblemError> {
    let mut next = 0;
    for (i, r) in p.resistances.iter().enumerate() {
        let at = |field: &str| format!("resistances[{i}].{field}");
        if r.contact < next || r.contact >= p.contacts.len() {
            let problem = format!("{} of {} contacts", r.contact, p.contacts.len());
            return refuse(at("contact"), problem, "name contacts that exist, each once, in ascending order");
        }
        next = r.contact + 1;
        for (field, value) in [("rolling", r.rolling), ("spinning", r.spinning)] {
            if !(value.is_finite() && value >= 0.0) {
                return refuse(at(field), format!("got {value}"), "give a finite length >= 0");
            }
        }
    }
    Ok(())
}

fn check_bodies<S: Space>(p: &ContactProblem<S>) -> Result<(), ProblemError> {
    for (i, m) in p.inverse_masses.iter().enumerate() {
        if !(m.linear >= 0.0 && m.linear.is_finite()) {
            return refuse(
                format!("inverse_masses[{i}].linear"),
                format!("got {}", m.linear),
                "give a finite number >= 0",
            );
        }
        if !m.angular.is_finite() {
            return refuse(
                format!("inverse_masses[{i}].angular"),
                "not finite".into(),
                "give finite entries",
            );
        }
        let (principal, _) = S::principal(&m.angular);
        let floor = -1e-12 * principal.max_abs();
        if principal.as_slice().iter().any(|&x| x < floor) {
            return refuse(
                format!("inverse_masses[{i}].angular"),
                format!("principal values {:?}", principal.as_slice()),
                "an inverse inertia has no negative principal value",
            );
        }
    }
    match p.velocities.iter().position(|v| !v.is_finite()) {
        Some(i) => refuse(format!("velocities[{i}]"), "not finite".into(), "give finite velocities"),
        None => Ok(()),
    }
}

fn check_contacts<S: Space>(p: &ContactProblem<S>) -> Result<(), ProblemError> {
    let bodies = p.inverse_masses.len();
    for (i, c) in p.contacts.iter().enumerate() {
        let at = |field: &str| format!("contacts[{i}].{field}");
        if c.a >= bodies || c.b >= bodies || c.a == c.b {
            return refuse(
                at("a, b"),
                format!("{} and {} of {bodies} bodies", c.a, c.b),
                "give two different bodies",
            );
        }
        if p.inverse_masses[c.a].is_fixed() && p.inverse_masses[c.b].is_fixed() {
            return refuse(
                at("a, b"),
                "both bodies are fixed".into(),
                "leave contacts between obstacles out",
            );
        }
        let length = c.normal.norm();
        if length.is_nan() || (length - 1.0).abs() > 1e-9 {
            return refuse(at("normal"), format!("length {length}"), "give a unit vector");
        }
        if !(c.arm_a.is_finite() && c.arm_b.is_finite()) {
            return refuse(at("arm_a, arm_b"), "not finite".into(), "give finite arms");
        }
        let own = PreparedContact::new(c, &p.inverse_masses).normal.inverse_effective_mass;
        if !is_usable(own) {
            let problem = format!("inverse effective mass {own:e} along the normal");
            return refuse(at("a, b"), problem, "an impulse along the normal must move one of the bodies");
        }
        if !c.slip_target.is_finite() {
            return refuse(at("slip_target"), "not finite".into(), "give finite velocities");
        }
        for (field, value, low, high) in [
            ("gap", c.gap, f64::NEG_INFINITY, f64::INFINITY),
            ("target", c.target, f64::NEG_INFINITY, f64::INFINITY),
            ("restitution", c.restitution, 0.0, 1.0),
            ("friction", c.friction, 0.0, f64::INFINITY),
        ] {
            if !(value.is_finite() && value >= low && value <= high) {
                return refuse(
                    at(field),
                    format!("got {value}"),
                    &format!("give a finite number in [{low}, {high}]"),
                );
            }
        }
    }
    Ok(())
}

fn check_rows<S: Space>(p: &ContactProblem<S>) -> Result<(), ProblemError> {
    let bodies = p.inverse_masses.len();
    for (i, r) in p.rows.iter().enumerate() {
        let at = |field: &str| format!("rows[{i}].{field}");
        if r.a >= bodies || r.b >= bodies {
            return refuse(
                at("a, b"),
                format!("{} and {} of {bodies} bodies", r.a, r.b),
                "give bodies that exist",
            );
        }
        if !(r.on_a.is_finite() && r.on_b.is_finite()) {
            return refuse(at("on_a, on_b"), "not finite".into(), "give finite coefficients");
        }
        if !r.target.is_finite() {
            return refuse(at("target"), format!("got {}", r.target), "give a finite number");
        }
        let own = Row::new(r.a, r.b, r.on_a, r.on_b, &p.inverse_masses).inverse_effective_mass;
        if !is_usable(own) {
            let problem = format!("inverse effective mass {own:e}");
            return refuse(at("on_a, on_b"), problem, "give coefficients on a body that can move");
        }
        if r.lo.is_nan() || r.hi.is_nan() || r.lo > r.hi || r.lo == f64::INFINITY || r.hi == f64::NEG_INFINITY
        {
            let remedy = "give lo <= hi, of which lo may be -inf and hi inf";
            return refuse(at("lo, hi"), format!("got [{}, {}]", r.lo, r.hi), remedy);
        }
    }
    Ok(())
}

/// True for an inverse mass that a solver can divide by.
fn is_usable(inverse_mass: f64) -> bool {
    inverse_mass.is_finite() && inverse_mass > 0.0 && (1.0 / inverse_mass).is_finite()
}
