//! Why a step is as accurate as it is, in plain words: what the residual is and where, what made the problem hard
//! (mass ratio, redundant contacts, condition, iterations spent, overlap at the start, a refusal), each with the
//! bodies' names and what to do. Knows no solver's inside: it looks at the problem, the impulses and the report.

use crate::bodies::Bodies;
use crate::error::StepError;
use crate::narrow_phase::Touch;
use crate::observe::report::{ImpactReport, SolveReport, StepReport};
use crate::settings::{EnergyGuard, Settings};
use crate::world::Phase;
use carom_geometry::Geometry;
use carom_solver::{ContactProblem, Entry, Impulses, Islands, Part, SolverKind, Stop, diagnose};
use serde::{Deserialize, Serialize};

/// Mass ratio across a contact from which sweeps slow down \[1\]: each sweep carries about the light share on.
const MASS_RATIO: f64 = 10.0;
/// Condition from which sweeps are slow \[1\]: they gain a digit in about as many iterations.
const CONDITION: f64 = 1e3;
/// Overlap that is worth telling, as a share of the smaller body's size \[1\].
const OVERLAP: f64 = 1e-3;
/// Residuals below this share of the island's velocities are rounding \[1\].
const ROUNDING: f64 = 1e-14;

/// What a finding is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Topic {
    /// The residual of a solve against the tolerance. Value: residual \[m/s\].
    Residual,
    /// Masses that touch. Value: their ratio \[1\].
    MassRatio,
    /// More pressed rows than degrees of freedom. Value: surplus rows \[1\].
    RedundantContacts,
    /// The condition of the scaled contact matrix. Value: a lower bound of it \[1\].
    Conditioning,
    /// Iterations spent against the budget. Value: iterations \[1\].
    Iterations,
    /// Overlap at the step's start. Value: depth \[m\].
    Penetration,
    /// Rounding: the tolerance is below it. Value: residual over the velocities \[1\].
    Rounding,
    /// How far an island that is not solved is from losing its solutions. Value: the largest t with
    /// u_N >= mu |u_T| + t at every contact for some impulses \[m/s\]; at or below 0 no solution need exist.
    StrictFeasibility,
    /// A solver refused, or the bodies jam. Value: contacts \[1\].
    Refusal,
    /// The impact law gains energy. Value: what it gains \[J\].
    EnergyGain,
}

/// One thing found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// What it is about; states the unit of `value`.
    pub topic: Topic,
    /// Its figure.
    pub value: f64,
    /// Names of the bodies meant.
    pub bodies: Vec<String>,
    /// The finding as a sentence.
    pub text: String,
    /// What to do about it; empty when nothing need be done.
    pub remedy: String,
}

/// The findings of a step.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Explanation {
    /// True when every solve of the step is within the tolerance.
    pub accurate: bool,
    /// The findings, the residual first.
    pub findings: Vec<Finding>,
}

impl Explanation {
    /// All findings as text, a line each, remedies where there are any.
    pub fn text(&self) -> String {
        let line = |f: &Finding| {
            if f.remedy.is_empty() { f.text.clone() } else { format!("{}; {}", f.text, f.remedy) }
        };
        self.findings.iter().map(line).collect::<Vec<_>>().join("\n")
    }
    fn add(
        &mut self,
        topic: Topic,
        value: f64,
        bodies: Vec<String>,
        text: String,
        remedy: impl Into<String>,
    ) {
        self.findings.push(Finding { topic, value, bodies, text, remedy: remedy.into() });
    }
}

/// What an explanation looks at.
pub struct Scene<'a, S: Geometry> {
    /// The bodies.
    pub bodies: &'a Bodies<S>,
    /// The settings of the step.
    pub settings: &'a Settings<S>,
    /// Contacts at the step's start.
    pub touches: &'a [Touch<S>],
    /// The impact problem and its impulses.
    pub impact: (&'a ContactProblem<S>, &'a Impulses<S>),
    /// The kick's problem and its impulses.
    pub contact: (&'a ContactProblem<S>, &'a Impulses<S>),
    /// False leaves out the estimate of the condition, which costs as much as some fifty sweeps.
    pub thorough: bool,
}

impl<S: Geometry> Scene<'_, S> {
    fn name(&self, body: usize) -> String {
        self.bodies.names[body].clone()
    }

    fn names(&self, pair: Option<(usize, usize)>) -> Vec<String> {
        pair.map_or(Vec::new(), |(a, b)| vec![self.name(a), self.name(b)])
    }

    fn problem(&self, phase: Phase) -> (&ContactProblem<S>, &Impulses<S>) {
        match phase {
            Phase::Impact => self.impact,
            Phase::Contact => self.contact,
        }
    }

    /// Explains a step that was taken.
    pub fn explain(&self, report: &StepReport<S>) -> Explanation {
        let mut told = Explanation { accurate: report.is_accurate(), findings: Vec::new() };
        let solves = [(Phase::Impact, &report.impact_solve), (Phase::Contact, &report.contact_solve)];
        // what is wrong comes first
        for is_within in [false, true] {
            for (phase, solve) in &solves {
                if let Some(solve) =
                    solve.as_ref().filter(|s| s.is_within(self.settings.tolerance) == is_within)
                {
                    self.explain_solve(&mut told, *phase, solve);
                }
            }
        }
        if told.findings.is_empty() {
            let text = "nothing to solve: no contact pressed in this step".to_string();
            told.add(Topic::Residual, 0.0, Vec::new(), text, "");
        }
        if !told.accurate {
            self.add_penetration(&mut told);
        }
        if report.impacts.guarded > 0 {
            self.add_energy_gain(&mut told, &report.impacts);
        }
        told
    }

    fn add_energy_gain(&self, told: &mut Explanation, impacts: &ImpactReport) {
        let near = self.names(impacts.gaining);
        let (law, place, gain) = (self.settings.impact_law().name(), place(&near), impacts.gain);
        let (text, remedy) = if self.settings.energy_guard == EnergyGuard::Clamp {
            let text =
                format!("impact law {law} would gain {gain:.1e} J{place}: Moreau's law was taken there");
            (text, "")
        } else {
            let text = format!("impact law {law} gains {gain:.1e} J{place}");
            (text, "set energy_guard = \"clamp\", or impact = \"moreau\"")
        };
        told.add(Topic::EnergyGain, gain, near, text, remedy);
    }

    /// Explains a step that was refused because of a solve.
    pub fn explain_failure(&self, phase: Phase, solve: &SolveReport) -> Explanation {
        let mut told = Explanation::default();
        self.explain_solve(&mut told, phase, solve);
        self.add_penetration(&mut told);
        told
    }

    fn explain_solve(&self, told: &mut Explanation, phase: Phase, solve: &SolveReport) {
        let (solver, tolerance) = (self.settings.solver_kind().name(), self.settings.tolerance);
        let near = self.names(solve.worst);
        let place = place(&near);
        let kind = phase.name();
        if let Stop::Refused(reason) = &solve.stop {
            let text = format!(
                "solver {solver} refused the {kind} problem of {} contacts: {reason}",
                solve.contacts
            );
            let remedy = "where a solution exists, another solver may find it: see solver; bodies that friction jams \
                          need less friction or another shape";
            told.add(Topic::Refusal, solve.contacts as f64, near, text, remedy);
            self.add_feasibility(told, solve);
            self.add_causes(told, phase, solve);
            return;
        }
        let figures = format!(
            "the {kind} problem of {} contacts is solved to {:.1e} m/s ({:.1e} of what no impulses would leave){place}",
            solve.contacts, solve.residual, solve.relative_residual
        );
        if solve.is_within(tolerance) {
            let text = format!("accurate: {figures}, tolerance {tolerance:.1e} m/s");
            told.add(Topic::Residual, solve.residual, near, text, "");
            return;
        }
        let text = format!("inaccurate: {figures}, above the tolerance of {tolerance:.1e} m/s");
        told.add(Topic::Residual, solve.residual, near, text, self.stronger_solver());
        self.add_feasibility(told, solve);
        self.add_iterations(told, solve);
        self.add_causes(told, phase, solve);
    }

    /// The island nearest to having no solution, where a solver told how near.
    fn add_feasibility(&self, told: &mut Explanation, solve: &SolveReport) {
        let known = solve.islands.iter().filter_map(|i| i.strict_feasibility.map(|t| (t, i)));
        let Some((t, island)) = known.min_by(|a, b| a.0.total_cmp(&b.0)) else { return };
        let first = self.name(island.first_body);
        let which =
            format!("the island of '{first}' ({} contacts, {} bodies)", island.contacts, island.bodies);
        let (text, remedy) = if t > 0.0 {
            let text = format!(
                "{which} is strictly feasible: impulses exist that part all of its contacts by {t:.1e} m/s more than \
                 friction asks, so it has a solution, which no stage found"
            );
            (text, "")
        } else {
            let text = format!(
                "{which} is not strictly feasible: no impulses part all of its contacts with a margin, the best leave \
                 {t:.1e} m/s, so it need not have a solution"
            );
            let remedy = "look for bodies pressed between walls whose motion is prescribed, or wedged by friction: let \
                          a wall yield to a force, or take less friction or another shape";
            (text, remedy)
        };
        told.add(Topic::StrictFeasibility, t, vec![first], text, remedy);
    }

    /// What makes a solve exact whatever the cause.
    fn stronger_solver(&self) -> String {
        if self.settings.solver_kind().stronger().contains(&SolverKind::Exact) {
            let (auto, exact) = (SolverKind::Auto.name(), SolverKind::Exact.name());
            format!("set solver = \"{auto}\" or \"{exact}\", or on_inaccurate = \"escalate\"")
        } else {
            "raise tolerance to what the step needs, or take a smaller dt".into()
        }
    }

    fn add_iterations(&self, told: &mut Explanation, solve: &SolveReport) {
        let budget = self.settings.iterations;
        let worst_island = solve.islands.iter().max_by(|a, b| a.residual.total_cmp(&b.residual));
        let spent = worst_island.map_or(solve.iterations, |i| i.iterations());
        let further = worst_island.map_or(String::new(), |i| i.why_further(self.settings.tolerance));
        if !further.is_empty() {
            let text = format!("the worst island went further because {further}");
            told.add(Topic::Iterations, spent as f64, Vec::new(), text, "");
        } else if solve.stop == Stop::OutOfFactorisations {
            let most = self.settings.factorisations;
            let text = format!(
                "the budget of {most} factorisations per solve was spent; the best of all stages is kept"
            );
            let remedy = format!("set factorisations above {most}");
            told.add(Topic::Iterations, most as f64, Vec::new(), text, remedy);
        } else if spent >= budget {
            let text = format!("{spent} iterations were spent, of a budget of {budget} per solve");
            told.add(
                Topic::Iterations,
                spent as f64,
                Vec::new(),
                text,
                format!("set iterations above {budget}"),
            );
        }
    }

    /// What makes the island of the worst entry hard.
    fn add_causes(&self, told: &mut Explanation, phase: Phase, solve: &SolveReport) {
        let (problem, impulses) = self.problem(phase);
        let Some((part, whole)) = worst_part(problem, impulses, solve) else { return };
        let found = diagnose(&part.problem, &part.impulses, self.thorough);
        if let Some((ratio, heavy, light)) = found.mass_ratio.filter(|(ratio, _, _)| *ratio >= MASS_RATIO) {
            let (heavy, light) = (self.name(whole[heavy]), self.name(whole[light]));
            let text = format!(
                "'{heavy}' is {ratio:.3e} times as heavy as '{light}', which it touches: a sweep carries its weight on \
                 by small shares"
            );
            told.add(Topic::MassRatio, ratio, vec![heavy, light], text, self.stronger_solver());
        }
        if found.redundant() > 0 {
            let text = format!(
                "{} pressed rows act on {} degrees of freedom of {} bodies: at least {} are redundant, so single \
                 impulses are not unique (their resultants are) and sweeps drift among them",
                found.rows,
                found.freedom,
                found.bodies,
                found.redundant()
            );
            let remedy = "judge resultants, not single contacts; a stronger solver settles them";
            told.add(
                Topic::RedundantContacts,
                found.redundant() as f64,
                self.names(solve.worst),
                text,
                remedy,
            );
        }
        if found.condition >= CONDITION {
            let text = format!(
                "the island of {} contacts and {} bodies is ill-conditioned (at least {:.0e}): sweeps gain a digit in \
                 about as many iterations",
                found.contacts, found.bodies, found.condition
            );
            told.add(
                Topic::Conditioning,
                found.condition,
                self.names(solve.worst),
                text,
                self.stronger_solver(),
            );
        }
        let fastest = part.problem.velocities.iter().map(|v| v.dot(v).sqrt()).fold(0.0, f64::max);
        if solve.residual > 0.0 && solve.residual < ROUNDING * found.condition * fastest {
            let share = solve.residual / fastest;
            let text =
                format!("the residual is {share:.0e} of the bodies' velocities, which is rounding here");
            told.add(Topic::Rounding, share, Vec::new(), text, "set tolerance above it");
        }
    }

    fn add_penetration(&self, told: &mut Explanation) {
        let Some(deepest) = self.touches.iter().min_by(|a, b| a.gap.total_cmp(&b.gap)) else { return };
        let size = self.bodies.data[deepest.a].extent.min(self.bodies.data[deepest.b].extent);
        if -deepest.gap > OVERLAP * size {
            let near = vec![self.name(deepest.a), self.name(deepest.b)];
            let text = format!(
                "at the step's start '{}' and '{}' overlap by {:.2e} m",
                near[0], near[1], -deepest.gap
            );
            let remedy = "place bodies apart, or take a smaller dt; what inexact solves let sink is lifted again only \
                          slowly (correction_fraction)";
            told.add(Topic::Penetration, -deepest.gap, near, text, remedy);
        }
    }
}

fn place(near: &[String]) -> String {
    if near.len() == 2 { format!(", worst between '{}' and '{}'", near[0], near[1]) } else { String::new() }
}

/// The island of the worst entry, and the body of the world for each of its bodies; the first island when the report
/// names no entry.
fn worst_part<S: Geometry>(
    problem: &ContactProblem<S>,
    impulses: &Impulses<S>,
    solve: &SolveReport,
) -> Option<(Part<S>, Vec<usize>)> {
    let islands = Islands::of(problem);
    if islands.count() == 0 {
        return None;
    }
    let worst = carom_solver::residual(problem, impulses).worst;
    let named = |k: usize| solve.worst == Some((problem.contacts[k].a, problem.contacts[k].b));
    let island = match worst {
        Some(Entry::Row(k)) => islands.of_row(k),
        Some(Entry::Contact(k)) => islands.of_contact(k),
        None => (0..problem.contacts.len()).find(|k| named(*k)).map_or(0, |k| islands.of_contact(k)),
    };
    let mut part = Part::default();
    part.take(problem, impulses, &islands, island);
    let whole = part.bodies.clone();
    Some((part, whole))
}

/// The phase that an error of a solve names.
pub fn phase_of(error: &StepError) -> Option<Phase> {
    match error {
        StepError::Inaccurate { phase, .. } | StepError::SolverRefused { phase, .. } => {
            Some(if *phase == Phase::Impact.name() { Phase::Impact } else { Phase::Contact })
        }
        _ => None,
    }
}
