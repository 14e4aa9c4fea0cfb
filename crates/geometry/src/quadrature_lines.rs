//! Line integrals int rho J (1, x, x x^T) dw of many lines at once, each refined until its own error is small.
//! A jump of the density is found by bisection between two samples, one evaluation a halving, and the line is
//! cut there, so that a piecewise smooth density costs about a hundred evaluations a line at full precision.
//! Jumps found on a line are hints for its neighbours: a short stretch of another density that falls between
//! two samples of the whole line is seen by the samples between the hints. Knows no shape and no priorities.

use crate::geometry::ShapeError;
use crate::mass_moments::Moments;
use crate::quadrature::Cell;
use crate::quadrature_density::Sampler;
use crate::quadrature_error::{ErrorScale, Errors};
use crate::quadrature_rule::{Rule, SAFETY};
use carom_math::Tuple;

/// A straight line through a cell's cube along one axis.
pub(crate) struct Line<'a, const N: usize> {
    /// The cell's map.
    pub cell: &'a Cell<N>,
    /// Axis along which to integrate.
    pub axis: usize,
    /// A point of the line in the cube; its entry on `axis` does not matter.
    pub at: [f64; N],
    /// From where to where on `axis`.
    pub span: [f64; 2],
    /// Where a neighbour jumps, ascending, inside the span.
    pub hints: &'a [f64],
}

impl<const N: usize> Line<'_, N> {
    /// Point in shape axes and Jacobian at a place on the line.
    fn place(&self, w: f64) -> (Tuple<N>, f64) {
        let mut u = self.at;
        u[self.axis] = w;
        (self.cell)(u)
    }
}

/// What is known of a line in the end.
#[derive(Clone)]
pub(crate) struct LineIntegral<const N: usize> {
    pub value: Moments<N>,
    pub errors: Errors,
    /// Where the density jumps, ascending.
    pub jumps: Vec<f64>,
}

/// Pieces of a line that shrink below this share of the cube's edge are done \[1\].
const SHORTEST: f64 = 1e-14;

/// Halvings that pin a jump to rounding.
const HALVINGS: usize = 46;

/// A piece is cut at most so often; after that its error stands as it is.
const MOST_CUTS: u32 = 60;

#[derive(Clone, Copy)]
struct Piece {
    line: usize,
    from: f64,
    to: f64,
    cuts: u32,
}

/// A place on a line and the density there.
type Sample = (f64, f64);

/// Between two samples: a jump, perhaps.
struct Bracket {
    piece: Piece,
    low: Sample,
    high: Sample,
    /// Difference of density across the bracket at first.
    step: f64,
    state: State,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    Open,
    /// So narrow that all its mass is below the tolerance.
    Pinned,
    /// The difference shrank with the bracket: a slope.
    Lost,
}

/// Integrates every line until the errors of its pieces, relative by `scale`, are below `tolerance`. Stops where
/// it stands when the budget is spent.
pub(crate) fn integrate_lines<const N: usize>(
    sampler: &mut Sampler<'_, N>,
    rule: &Rule,
    lines: &[Line<'_, N>],
    scale: &ErrorScale,
    tolerance: f64,
) -> Result<Vec<LineIntegral<N>>, ShapeError> {
    let origin = sampler.origin();
    let empty = LineIntegral { value: Moments::zero(origin), errors: Errors::default(), jumps: Vec::new() };
    let mut sums = vec![empty; lines.len()];
    let mut pending = first_pieces(lines);
    while !pending.is_empty() {
        let spent = sampler.is_spent();
        let (points, jacobians) = nodes_of(rule, lines, &pending);
        let densities = sampler.sample(&points)?;
        let mut brackets = Vec::new();
        let mut next = Vec::new();
        for (k, piece) in pending.iter().enumerate() {
            let own = k * rule.len()..(k + 1) * rule.len();
            let densities = &densities[own.clone()];
            let masses =
                jacobians[own.clone()].iter().zip(densities).map(|(j, d)| (piece.to - piece.from) * j * d);
            let (value, errors) = weighted(rule, origin, &points[own], masses);
            let is_fine = scale.relative(&errors) <= tolerance || piece.to - piece.from <= SHORTEST;
            if is_fine || spent || piece.cuts >= MOST_CUTS {
                sums[piece.line].value.add_scaled(1.0, &value);
                sums[piece.line].errors.add(1.0, &errors);
            } else if let Some(bracket) = widest_step(rule, *piece, densities) {
                brackets.push(bracket);
            } else {
                let middle = 0.5 * (piece.from + piece.to);
                next.extend(cut(*piece, middle, middle));
            }
        }
        pin(sampler, lines, &mut brackets, (scale, 0.1 * tolerance))?;
        for bracket in &brackets {
            next.extend(cut_out(bracket, &lines[bracket.piece.line], &mut sums[bracket.piece.line]));
        }
        pending = next;
    }
    for sum in &mut sums {
        sum.jumps.sort_by(f64::total_cmp);
    }
    Ok(sums)
}

/// The lines' spans, cut at the hints.
fn first_pieces<const N: usize>(lines: &[Line<'_, N>]) -> Vec<Piece> {
    let mut pieces = Vec::with_capacity(lines.len());
    for (line, l) in lines.iter().enumerate() {
        let mut from = l.span[0];
        for &to in l.hints.iter().chain(&l.span[1..]) {
            if to - from > SHORTEST {
                pieces.push(Piece { line, from, to, cuts: 0 });
                from = to;
            }
        }
    }
    pieces
}

/// What is left of a piece when the part between two places is taken out.
fn cut(piece: Piece, low: f64, high: f64) -> impl Iterator<Item = Piece> {
    let cuts = piece.cuts + 1;
    let halves = [Piece { to: low, cuts, ..piece }, Piece { from: high, cuts, ..piece }];
    halves.into_iter().filter(|half| half.to - half.from > SHORTEST)
}

/// Points and Jacobians of all nodes of all pieces.
fn nodes_of<const N: usize>(
    rule: &Rule,
    lines: &[Line<'_, N>],
    pieces: &[Piece],
) -> (Vec<Tuple<N>>, Vec<f64>) {
    pieces
        .iter()
        .flat_map(|p| rule.nodes.iter().map(|t| lines[p.line].place(p.from + (p.to - p.from) * t)))
        .unzip()
}

/// The full rule's sum over masses at points, and the difference to the embedded rule as error.
fn weighted<const N: usize>(
    rule: &Rule,
    origin: Tuple<N>,
    points: &[Tuple<N>],
    masses: impl Iterator<Item = f64>,
) -> (Moments<N>, Errors) {
    let mut value = Moments::zero(origin);
    let mut difference = value;
    for (j, mass) in masses.enumerate() {
        value.add_point(mass * rule.fine[j], points[j]);
        difference.add_point(mass * rule.difference[j], points[j]);
    }
    (value, Errors::of(&difference, SAFETY))
}

/// The gap between samples that holds most of the change, when one gap stands out.
fn widest_step(rule: &Rule, piece: Piece, densities: &[f64]) -> Option<Bracket> {
    let steps: Vec<f64> = densities.windows(2).map(|d| (d[1] - d[0]).abs()).collect();
    let total: f64 = steps.iter().sum();
    let widest = (0..steps.len()).max_by(|&i, &j| steps[i].total_cmp(&steps[j]).then(j.cmp(&i)))?;
    let largest = densities.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
    // a smooth density spreads its change; up to four equal jumps still stand out; rounding is no jump
    if steps[widest] <= 1e-9 * largest || steps[widest] < 0.25 * total {
        return None;
    }
    let at = |j: usize| (piece.from + (piece.to - piece.from) * rule.nodes[j], densities[j]);
    let (low, high) = (at(widest), at(widest + 1));
    Some(Bracket { piece, low, high, step: steps[widest], state: State::Open })
}

/// Halves all brackets together, keeping the half with the larger step, until their masses are below the
/// tolerance.
fn pin<const N: usize>(
    sampler: &mut Sampler<'_, N>,
    lines: &[Line<'_, N>],
    brackets: &mut [Bracket],
    (scale, tolerance): (&ErrorScale, f64),
) -> Result<(), ShapeError> {
    for _ in 0..HALVINGS {
        let mut open: Vec<&mut Bracket> = brackets.iter_mut().filter(|b| b.state == State::Open).collect();
        if open.is_empty() {
            return Ok(());
        }
        let middle = |b: &Bracket| 0.5 * (b.low.0 + b.high.0);
        let (points, jacobians): (Vec<_>, Vec<_>) =
            open.iter().map(|b| lines[b.piece.line].place(middle(b))).unzip();
        let densities = sampler.sample(&points)?;
        for (k, b) in open.iter_mut().enumerate() {
            let sample = (middle(b), densities[k]);
            if (sample.1 - b.low.1).abs() >= (b.high.1 - sample.1).abs() {
                b.high = sample;
            } else {
                b.low = sample;
            }
            let step = (b.high.1 - b.low.1).abs();
            let mut inside = Moments::zero(sampler.origin());
            inside.add_point(
                b.high.1.abs().max(b.low.1.abs()) * jacobians[k] * (b.high.0 - b.low.0),
                points[k],
            );
            if step < 0.3 * b.step {
                b.state = State::Lost;
            } else if scale.relative(&Errors::of(&inside, 1.0)) <= tolerance {
                b.state = State::Pinned;
            }
        }
    }
    Ok(())
}

/// Adds what lies in the bracket to the line, with the step as error, and returns the pieces beside it; a slope
/// is halved instead.
fn cut_out<const N: usize>(
    bracket: &Bracket,
    line: &Line<'_, N>,
    sum: &mut LineIntegral<N>,
) -> impl Iterator<Item = Piece> + use<N> {
    let &Bracket { piece, low, high, state, .. } = bracket;
    if state == State::Lost {
        let middle = 0.5 * (piece.from + piece.to);
        return cut(piece, middle, middle);
    }
    let middle = 0.5 * (low.0 + high.0);
    let (point, jacobian) = line.place(middle);
    let width = jacobian * (high.0 - low.0);
    let mut doubt = Moments::zero(sum.value.origin);
    doubt.add_point(0.5 * width * (high.1 - low.1), point);
    sum.value.add_point(0.5 * width * (high.1 + low.1), point);
    sum.errors.add(1.0, &Errors::of(&doubt, 1.0));
    sum.jumps.push(middle);
    cut(piece, low.0, high.0)
}
