//! Adaptive quadrature of a density: int rho (1, x, x x^T) dx over cells that smooth maps draw from the unit
//! square or cube (theory chapter 1). A first pass samples every cell on a tensor grid. Where that is not
//! enough, a cell becomes a stack of lines along the axis that resolves worst: lines refine themselves and find
//! jumps (`quadrature_lines`), and the stack is halved across, largest error first. All orders are fixed, so the
//! answer depends on the arguments alone. Rejected: plain halving of cells, which needs 1e6 cells where cut
//! lines need 1e3, since a jump inside a cell costs its whole volume. Knows no shapes.

use crate::geometry::ShapeError;
use crate::mass_moments::Moments;
use crate::quadrature_density::{CHUNK, Sampler};
use crate::quadrature_error::{ErrorScale, Errors};
use crate::quadrature_grid::{Grid, TensorSum};
use crate::quadrature_lines::{Line, LineIntegral, integrate_lines};
use crate::quadrature_rule::{Rule, SAFETY};
use carom_math::Tuple;

pub use crate::quadrature_density::{EVALUATION_BUDGET, EVALUATIONS_PER_CELL, Integrand};

/// Smooth map from the unit cube: point in shape axes \[m\] and Jacobian, negative where volume is taken away.
/// In a shape of many cells they are thin across axis 0.
pub type Cell<const N: usize> = Box<dyn Fn([f64; N]) -> (Tuple<N>, f64)>;

/// Relative error that is still returned, honestly stated, when the budget ends above the tolerance \[1\].
pub const ACCEPTABLE_ERROR: f64 = 1e-3;

/// Tolerances below this are lost in rounding \[1\].
const SMALLEST_TOLERANCE: f64 = 1e-13;

/// Rounding of the sums, part of every stated error \[1\].
const ROUNDING: f64 = 1e-14;

/// Intervals of the grid along axis 0 and along the others, and how many evaluations the first pass may take with
/// them: the more cells there are, the thinner they are.
const GRIDS: [(usize, usize, usize); 3] = [(16, 16, 1_000_000), (16, 8, 2_000_000), (16, 4, usize::MAX)];

/// Cells are halved along every axis before the first pass when it then takes no more evaluations than this.
const FINE_START: usize = 50_000;

/// Lines refined together: few enough to follow the errors, many enough for large batches.
const BATCH: usize = 8192;

/// A box of a cell's cube with its integral.
struct Region<const N: usize> {
    cell: usize,
    low: [f64; N],
    high: [f64; N],
    /// Axis of its lines; none after the first pass.
    lines: Option<usize>,
    /// Jumps on every line.
    jumps: Vec<Vec<f64>>,
    sum: TensorSum<N>,
    /// Errors across the lines, or of the whole grid.
    across: Errors,
    /// Errors along the lines.
    along: Errors,
}

impl<const N: usize> Region<N> {
    /// Relative error of the region alone.
    fn error(&self, scale: &ErrorScale) -> f64 {
        let mut errors = self.across;
        errors.add(1.0, &self.along);
        scale.relative(&errors)
    }
    /// Axis that resolves worst: along it lines will run, or the region is halved.
    fn worst_axis(&self, scale: &ErrorScale) -> usize {
        let usable = (0..N).filter(|&i| self.lines != Some(i));
        let size = |i: usize| scale.relative(&self.sum.by_axis[i]);
        usable.max_by(|&i, &j| size(i).total_cmp(&size(j)).then(j.cmp(&i))).unwrap_or(0)
    }
    /// False when halving would leave no room between nodes.
    fn can_shrink(&self, scale: &ErrorScale) -> bool {
        let axis = self.worst_axis(scale);
        self.lines.is_none() || self.high[axis] - self.low[axis] > 1e-13
    }
}

/// A box of a cell's cube still to be integrated along an axis.
struct Task<const N: usize> {
    cell: usize,
    low: [f64; N],
    high: [f64; N],
    axis: usize,
    /// The region it replaces.
    parent: usize,
}

/// Integrates a density over cells to a relative tolerance; returns the moments about the integrand's origin and
/// the estimated relative error (of mass, of the centre over the radius of gyration, of the inertia).
///
/// # Errors
/// [`ShapeError`] on `density` or `relative_tolerance`; see `mass_properties_of`.
pub fn integrate<const N: usize>(
    cells: &[Cell<N>],
    integrand: Integrand<'_, N>,
    relative_tolerance: f64,
) -> Result<(Moments<N>, f64), ShapeError> {
    check_tolerance(relative_tolerance)?;
    let budget = EVALUATION_BUDGET.max(cells.len().saturating_mul(EVALUATIONS_PER_CELL));
    let mut sampler = Sampler { integrand, evaluations: 0, budget };
    let grid = grid_for::<N>(cells.len());
    // lines must resolve smooth densities by themselves
    let along = grid.rule(0);
    let mut regions = first_pass(&mut sampler, &grid, cells)?;
    let rough = sum_of(&regions, sampler.origin()).0;
    if ErrorScale::of(&rough).is_some_and(|scale| scale.offset > 0.5 * scale.gyration) {
        // about the shape's centre the errors of a small heavy part far from it would count several times over
        sampler.integrand.origin = rough.center();
        regions = first_pass(&mut sampler, &grid, cells)?;
    }
    loop {
        let (total, errors) = sum_of(&regions, sampler.origin());
        let Some(scale) = ErrorScale::of(&total) else {
            return Err(massless(&total, sampler.evaluations));
        };
        let error = scale.relative(&errors) + ROUNDING;
        if error <= relative_tolerance {
            return Ok((total, error));
        }
        let tasks = next_tasks(&regions, &scale, &grid);
        // pieces of lines share a small part of the tolerance, so that halving across sees no noise
        let piece_tolerance = 0.02 * relative_tolerance / cells.len() as f64;
        let rules = (&grid, along);
        let mut refined =
            line_pass(&mut sampler, rules, cells, (&tasks, &regions), (&scale, piece_tolerance))?;
        // lines that the end of the budget broke off are worse than what they would replace
        if tasks.is_empty() || sampler.is_spent() {
            return end_of_budget(total, error, relative_tolerance, sampler.evaluations);
        }
        doubt_halves(&tasks, &regions, &mut refined);
        let mut stays = vec![true; regions.len()];
        tasks.iter().for_each(|task| stays[task.parent] = false);
        let mut stays = stays.into_iter();
        regions.retain(|_| stays.next().unwrap_or(true));
        regions.extend(refined);
    }
}

fn check_tolerance(relative_tolerance: f64) -> Result<(), ShapeError> {
    if (SMALLEST_TOLERANCE..=0.1).contains(&relative_tolerance) {
        return Ok(());
    }
    Err(ShapeError::new(
        "relative_tolerance",
        format!("must lie between {SMALLEST_TOLERANCE:e} and 0.1, got {relative_tolerance}"),
        "1e-9 suits smooth densities, 1e-5 densities with jumps in space",
    ))
}

/// The finest grid that leaves budget for refinement.
fn grid_for<const N: usize>(cells: usize) -> Grid<N> {
    let cost = |through: usize, aside: usize| {
        cells.saturating_mul(through + 1).saturating_mul((aside + 1).pow(N as u32 - 1))
    };
    let affordable = GRIDS.iter().find(|(through, aside, limit)| cost(*through, *aside) <= *limit);
    let (through, aside, _) = affordable.unwrap_or(&GRIDS[2]);
    Grid::new(*through, *aside)
}

fn massless<const N: usize>(total: &Moments<N>, evaluations: usize) -> ShapeError {
    ShapeError::new(
        "density",
        format!("the total mass over {evaluations} sampled points is {}", total.measure),
        "return positive values somewhere in the shape; check the function's units and axes",
    )
}

fn end_of_budget<const N: usize>(
    total: Moments<N>,
    error: f64,
    tolerance: f64,
    evaluations: usize,
) -> Result<(Moments<N>, f64), ShapeError> {
    if error <= ACCEPTABLE_ERROR {
        return Ok((total, error));
    }
    Err(ShapeError::new(
        "density",
        format!("after {evaluations} evaluations the relative error is {error:.1e}, above {tolerance:.1e}"),
        "ask for a larger tolerance, make the function smoother, or split the shape into parts of a compound along \
         its jumps",
    ))
}

/// Sums over regions, in their order. Errors of regions that a jump crosses at different places have random
/// signs, those of neighbours that it crosses alike have the same: n equal errors count as n^(3/4), between the
/// two, the geometric mean of their sum and of the root of their squares' sum. What all have in common shows in
/// the sum of the rules' differences, signs and all.
fn sum_of<const N: usize>(regions: &[Region<N>], origin: Tuple<N>) -> (Moments<N>, Errors) {
    let (mut total, mut common) = (Moments::zero(origin), Moments::zero(origin));
    let (mut plain, mut squares, mut errors) = (Errors::default(), Errors::default(), Errors::default());
    for region in regions {
        total.add_scaled(1.0, &region.sum.integral);
        common.add_scaled(1.0, &region.sum.difference);
        plain.add(1.0, &region.across);
        squares.add(1.0, &Errors(region.across.0.map(|e| e * e)));
        errors.add(1.0, &region.along);
    }
    errors.add(1.0, &Errors(std::array::from_fn(|i| (plain.0[i] * squares.0[i].sqrt()).sqrt())));
    errors.add(1.0, &Errors::of(&common, SAFETY));
    (total, errors)
}

/// Samples every cell, or its halves along every axis, on the tensor grid.
fn first_pass<const N: usize>(
    sampler: &mut Sampler<'_, N>,
    grid: &Grid<N>,
    cells: &[Cell<N>],
) -> Result<Vec<Region<N>>, ShapeError> {
    let axes: [usize; N] = std::array::from_fn(|i| i);
    let count = grid.count(&axes);
    let parts = if (cells.len() * count) << N <= FINE_START { 1usize << N } else { 1 };
    let boxes: Vec<(usize, [f64; N], [f64; N])> = (0..cells.len() * parts)
        .map(|part| {
            let corner = part % parts;
            let low = std::array::from_fn(|i| if corner >> i & 1 == 1 { 0.5 } else { 0.0 });
            (part / parts, low, low.map(|x| if parts > 1 { x + 0.5 } else { 1.0 }))
        })
        .collect();
    let mut regions = Vec::with_capacity(boxes.len());
    // many boxes at once, so that the density is asked seldom
    for group in boxes.chunks((CHUNK / count).max(1)) {
        let (points, jacobians): (Vec<_>, Vec<_>) = group
            .iter()
            .flat_map(|(cell, low, high)| {
                (0..count).map(move |index| {
                    let at = grid.digits(&axes, index);
                    let node = |i: usize| grid.rule(i).nodes[at[i]];
                    cells[*cell](std::array::from_fn(|i| low[i] + (high[i] - low[i]) * node(i)))
                })
            })
            .unzip();
        let densities = sampler.sample(&points)?;
        for (k, &(cell, low, high)) in group.iter().enumerate() {
            let value = |j: usize| {
                let mut value = Moments::zero(sampler.origin());
                value.add_point(jacobians[j] * densities[j], points[j]);
                value
            };
            let values: Vec<Moments<N>> = (k * count..(k + 1) * count).map(value).collect();
            let sum = TensorSum::new(grid, &values, volume_of(&low, &high, &axes), &axes);
            let (across, along) = (sum.errors(), Errors::default());
            regions.push(Region { cell, low, high, lines: None, jumps: Vec::new(), sum, across, along });
        }
    }
    Ok(regions)
}

/// Picks the regions with the largest errors and says what replaces them: after the first pass lines along the
/// worst axis, after that two halves.
fn next_tasks<const N: usize>(regions: &[Region<N>], scale: &ErrorScale, grid: &Grid<N>) -> Vec<Task<N>> {
    let relative: Vec<f64> = regions.iter().map(|r| r.error(scale)).collect();
    let mut order: Vec<usize> = (0..regions.len()).filter(|&i| regions[i].can_shrink(scale)).collect();
    order.sort_by(|&i, &j| relative[j].total_cmp(&relative[i]).then(i.cmp(&j)));
    let half = 0.5 * relative.iter().sum::<f64>();
    let most = (BATCH / grid.count(&other_axes::<N>(0))).max(2);
    let mut covered = 0.0;
    let mut tasks = Vec::new();
    for parent in order {
        if covered >= half || relative[parent] == 0.0 || tasks.len() >= most {
            break;
        }
        covered += relative[parent];
        let Region { cell, low, high, lines, .. } = regions[parent];
        let worst = regions[parent].worst_axis(scale);
        let Some(axis) = lines else {
            tasks.push(Task { cell, low, high, axis: worst, parent });
            continue;
        };
        let middle = 0.5 * (low[worst] + high[worst]);
        let with = |mut corner: [f64; N]| {
            corner[worst] = middle;
            corner
        };
        tasks.push(Task { cell, low, high: with(high), axis, parent });
        tasks.push(Task { cell, low: with(low), high, axis, parent });
    }
    tasks
}

/// The axes across lines that run along one.
fn other_axes<const N: usize>(axis: usize) -> Vec<usize> {
    (0..N).filter(|&i| i != axis).collect()
}

/// Measure of a box over some axes.
fn volume_of<const N: usize>(low: &[f64; N], high: &[f64; N], axes: &[usize]) -> f64 {
    axes.iter().map(|&i| high[i] - low[i]).product()
}

/// Integrates boxes along lines and across them.
fn line_pass<const N: usize>(
    sampler: &mut Sampler<'_, N>,
    (grid, along): (&Grid<N>, &Rule),
    cells: &[Cell<N>],
    (tasks, regions): (&[Task<N>], &[Region<N>]),
    (scale, tolerance): (&ErrorScale, f64),
) -> Result<Vec<Region<N>>, ShapeError> {
    let mut lines = Vec::new();
    for task in tasks {
        let axes = other_axes::<N>(task.axis);
        for index in 0..grid.count(&axes) {
            let digits = grid.digits(&axes, index);
            let mut at = [0.0; N];
            for &i in &axes {
                at[i] = task.low[i] + (task.high[i] - task.low[i]) * grid.rule(i).nodes[digits[i]];
            }
            let span = [task.low[task.axis], task.high[task.axis]];
            let hints = nearby_jumps(grid, &regions[task.parent], &at);
            lines.push(Line { cell: &cells[task.cell], axis: task.axis, at, span, hints });
        }
    }
    let mut integrals = integrate_lines(sampler, along, &lines, scale, tolerance)?.into_iter();
    Ok(tasks.iter().map(|task| stacked(grid, task, &mut integrals)).collect())
}

/// Keeps the errors of two halves from falling, by chance, far below what halving just changed: for a kink the
/// rules' difference is less than the error at one place in eight, and the halves' error is about a quarter of
/// the whole's.
fn doubt_halves<const N: usize>(tasks: &[Task<N>], regions: &[Region<N>], refined: &mut [Region<N>]) {
    let mut rest = refined;
    for pair in tasks.chunk_by(|a, b| a.parent == b.parent) {
        let (halves, others) = rest.split_at_mut(pair.len());
        rest = others;
        let whole = &regions[pair[0].parent];
        if whole.lines.is_none() {
            continue;
        }
        let mut change = whole.sum.integral;
        halves.iter().for_each(|half| change.add_scaled(-1.0, &half.sum.integral));
        let least = Errors::of(&change, 0.125);
        halves.iter_mut().for_each(|half| half.across.raise(&least));
    }
}

/// Of a region's lines around a place, the jumps of the one that has most.
fn nearby_jumps<'a, const N: usize>(grid: &Grid<N>, region: &'a Region<N>, at: &[f64; N]) -> &'a [f64] {
    let Some(axis) = region.lines else {
        return &[];
    };
    let (mut around, mut stride) = (vec![0], 1);
    for i in other_axes::<N>(axis) {
        let nodes = &grid.rule(i).nodes;
        let local = (at[i] - region.low[i]) / (region.high[i] - region.low[i]);
        let after = nodes.partition_point(|&t| t < local).clamp(1, nodes.len() - 1);
        around = around.iter().flat_map(|&k| [k + (after - 1) * stride, k + after * stride]).collect();
        stride *= nodes.len();
    }
    let all = around.into_iter().map(|k| region.jumps[k].as_slice());
    all.reduce(|most, own| if own.len() > most.len() { own } else { most }).unwrap_or(&[])
}

/// A region from the integrals of its lines: their errors add to those across.
fn stacked<const N: usize>(
    grid: &Grid<N>,
    task: &Task<N>,
    integrals: &mut impl Iterator<Item = LineIntegral<N>>,
) -> Region<N> {
    let &Task { cell, low, high, axis, .. } = task;
    let axes = other_axes::<N>(axis);
    let area = volume_of(&low, &high, &axes);
    let (mut values, mut jumps, mut along) = (Vec::new(), Vec::new(), Errors::default());
    for (index, line) in integrals.take(grid.count(&axes)).enumerate() {
        along.add(area * grid.weight_of(&axes, index), &line.errors);
        values.push(line.value);
        jumps.push(line.jumps);
    }
    let sum = TensorSum::new(grid, &values, area, &axes);
    let across = sum.errors();
    Region { cell, low, high, lines: Some(axis), jumps, sum, across, along }
}
