//! Adaptive quadrature of a density: int rho (1, x, x x^T) dx over cells that smooth maps draw from the unit
//! square or cube (theory chapter 1). A first pass samples every cell on a tensor grid. Where that is not
//! enough, a cell becomes a stack of lines along the axis that resolves worst: lines refine themselves and find
//! jumps (`quadrature_lines`), and the stack is halved across, largest error first. All orders are fixed, so the
//! answer depends on the arguments alone. Rejected: plain halving of cells, which needs 1e6 cells where cut
//! lines need 1e3, since a jump inside a cell costs its whole volume. Knows no shapes.

use crate::geometry::ShapeError;
use crate::mass_moments::Moments;
use crate::quadrature_lines::{Line, LineIntegral, integrate_lines};
use crate::quadrature_rule::{Rule, SAFETY};
use carom_math::{Column, Tuple};

/// Smooth map from the unit cube: point in shape axes \[m\] and Jacobian, negative where volume is taken away.
pub type Cell<const N: usize> = Box<dyn Fn([f64; N]) -> (Tuple<N>, f64)>;

/// Evaluations of the density after which the integration stops \[1\].
pub const EVALUATION_BUDGET: usize = 10_000_000;

/// Relative error that is still returned, honestly stated, when the budget ends above the tolerance \[1\].
pub const ACCEPTABLE_ERROR: f64 = 1e-3;

/// Tolerances below this are lost in rounding \[1\].
const SMALLEST_TOLERANCE: f64 = 1e-13;

/// Rounding of the sums, part of every stated error \[1\].
const ROUNDING: f64 = 1e-14;

/// Intervals per axis of the grid, and how many evaluations the first pass may take with them.
const GRIDS: [(usize, usize); 3] = [(16, 1_000_000), (8, 1_000_000), (4, 2_500_000)];

/// Cells are halved along every axis before the first pass when it then takes no more evaluations than this.
const FINE_START: usize = 50_000;

/// Lines refined together: few enough to follow the errors, many enough for large batches.
const BATCH: usize = 8192;

/// Points handed to the density at once.
const CHUNK: usize = 1 << 16;

/// What is integrated.
pub struct Integrand<'a, const N: usize> {
    /// Density at many points in shape axes: one number for each.
    pub density: &'a mut dyn FnMut(&[Tuple<N>]) -> Vec<f64>,
    /// Point about which moments are taken, near the centre \[m\].
    pub origin: Tuple<N>,
    /// Where given: false at points that cells reach outside the shape, where negative values may stand.
    pub is_inside: Option<&'a dyn Fn(Tuple<N>) -> bool>,
}

/// Evaluates and checks the density.
pub(crate) struct Sampler<'a, const N: usize> {
    integrand: Integrand<'a, N>,
    evaluations: usize,
}

impl<const N: usize> Sampler<'_, N> {
    pub fn origin(&self) -> Tuple<N> {
        self.integrand.origin
    }
    /// True when the budget of evaluations has been used.
    pub fn is_spent(&self) -> bool {
        self.evaluations >= EVALUATION_BUDGET
    }
    /// Densities at points.
    pub fn sample(&mut self, points: &[Tuple<N>]) -> Result<Vec<f64>, ShapeError> {
        let mut densities = Vec::with_capacity(points.len());
        for chunk in points.chunks(CHUNK) {
            let answer = (self.integrand.density)(chunk);
            if answer.len() != chunk.len() {
                return Err(ShapeError::new(
                    "density",
                    format!("the function returned {} numbers for {} points", answer.len(), chunk.len()),
                    "return one density for every point",
                ));
            }
            for (point, &density) in chunk.iter().zip(&answer) {
                if !(density >= 0.0 && density.is_finite()) {
                    self.refuse_unless_outside(*point, density)?;
                }
            }
            densities.extend(answer);
        }
        self.evaluations += points.len();
        Ok(densities)
    }
    fn refuse_unless_outside(&self, point: Tuple<N>, density: f64) -> Result<(), ShapeError> {
        let place = point.as_slice();
        if self.integrand.is_inside.is_none_or(|inside| inside(point)) {
            return Err(ShapeError::new(
                "density",
                format!("the function is {density} at {place:?} (shape axes, m)"),
                "return finite values >= 0 everywhere in the shape",
            ));
        }
        if density.is_finite() {
            return Ok(());
        }
        Err(ShapeError::new(
            "density",
            format!("the function is {density} at {place:?} (shape axes, m), outside the mesh"),
            "return finite values there too, or split the mesh into star-shaped parts of a compound",
        ))
    }
}

/// Absolute errors of the measure, the first and the second moment (norms, about the origin).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Errors([f64; 3]);

impl Errors {
    /// Size of a difference, times a factor.
    pub fn of<const N: usize>(difference: &Moments<N>, factor: f64) -> Self {
        Errors(difference.sizes().map(|x| factor * x))
    }
    /// Adds a multiple.
    pub fn add(&mut self, k: f64, other: &Self) {
        for i in 0..3 {
            self.0[i] += k * other.0[i];
        }
    }
    /// Raises every error to at least another's.
    fn raise(&mut self, least: &Self) {
        for i in 0..3 {
            self.0[i] = self.0[i].max(least.0[i]);
        }
    }
}

/// What errors are measured against.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ErrorScale {
    /// Mass \[kg\].
    mass: f64,
    /// Distance of the centre from the origin \[m\].
    offset: f64,
    /// Radius of gyration \[m\].
    gyration: f64,
}

impl ErrorScale {
    fn of<const N: usize>(total: &Moments<N>) -> Option<Self> {
        let trace = |m: &[[f64; N]; N]| (0..N).map(|i| m[i][i]).sum::<f64>() / total.measure;
        if !(total.measure > 0.0) {
            return None;
        }
        // a mass drawn together in a point keeps a scale
        let gyration = trace(&total.central_second()).max(1e-12 * trace(&total.second)).max(f64::MIN_POSITIVE);
        let offset = (total.center() - total.origin).norm();
        Some(ErrorScale { mass: total.measure, offset, gyration: gyration.sqrt() })
    }
    /// The largest of the relative errors of mass, centre (over the radius of gyration k) and inertia (over
    /// m k^2), as they follow from the moments' errors when the centre is moved to.
    pub fn relative(&self, Errors([zeroth, first, second]): &Errors) -> f64 {
        let (c, k) = (self.offset, self.gyration);
        let center = first + c * zeroth;
        let inertia = second + 2.0 * c * first + c * c * zeroth;
        zeroth.max(center / k).max(inertia / (k * k)) / self.mass
    }
}

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

/// An integral over some axes of a box.
struct TensorSum<const N: usize> {
    integral: Moments<N>,
    /// The rules' differences with their signs, over all axes.
    difference: Moments<N>,
    /// What every axis contributes to the errors; zero for axes that were not summed over.
    by_axis: [Errors; N],
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
    let mut sampler = Sampler { integrand, evaluations: 0 };
    let grid = grid_for::<N>(cells.len())?;
    // lines must resolve smooth densities by themselves
    let along = Rule::clenshaw_curtis((grid.len() - 1).max(8));
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
        let rules = [&grid, &along];
        let mut refined = line_pass(&mut sampler, rules, cells, (&tasks, &regions), (&scale, piece_tolerance))?;
        // lines that the end of the budget broke off are worse than what they would replace
        if tasks.is_empty() || sampler.is_spent() {
            return end_of_budget(total, error, relative_tolerance, sampler.evaluations);
        }
        doubt_halves(&tasks, &regions, &mut refined);
        let mut index = 0;
        regions.retain(|_| {
            index += 1;
            tasks.iter().all(|task| task.parent != index - 1)
        });
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
fn grid_for<const N: usize>(cells: usize) -> Result<Rule, ShapeError> {
    let cost = |intervals: usize| cells.saturating_mul((intervals + 1).pow(N as u32));
    if let Some((intervals, _)) = GRIDS.iter().find(|(intervals, limit)| cost(*intervals) <= *limit) {
        return Ok(Rule::clenshaw_curtis(*intervals));
    }
    if cost(2) <= EVALUATION_BUDGET {
        return Ok(Rule::clenshaw_curtis(2));
    }
    Err(ShapeError::new(
        "shape",
        format!("its {cells} pieces need more than {EVALUATION_BUDGET} evaluations of the density"),
        "integrate the density over a coarser shape, or use a constant density",
    ))
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
        "make the function smoother, or split the shape into parts of a compound along its jumps",
    ))
}

/// Sums over regions, in their order. Errors of regions that jumps cross at different places have random signs
/// and add as squares; what they have in common shows in the sum of the rules' differences, signs and all.
fn sum_of<const N: usize>(regions: &[Region<N>], origin: Tuple<N>) -> (Moments<N>, Errors) {
    let (mut total, mut common) = (Moments::zero(origin), Moments::zero(origin));
    let (mut squares, mut errors) = (Errors::default(), Errors::default());
    for region in regions {
        total.add_scaled(1.0, &region.sum.integral);
        common.add_scaled(1.0, &region.sum.difference);
        squares.add(1.0, &Errors(region.across.0.map(|e| e * e)));
        errors.add(1.0, &region.along);
    }
    errors.add(1.0, &Errors(squares.0.map(f64::sqrt)));
    errors.add(1.0, &Errors::of(&common, SAFETY));
    (total, errors)
}

/// Samples every cell, or its halves along every axis, on the tensor grid.
fn first_pass<const N: usize>(
    sampler: &mut Sampler<'_, N>,
    grid: &Rule,
    cells: &[Cell<N>],
) -> Result<Vec<Region<N>>, ShapeError> {
    let count = grid.len().pow(N as u32);
    let parts = if cells.len() * count << N <= FINE_START { 1usize << N } else { 1 };
    let mut regions = Vec::with_capacity(cells.len() * parts);
    for part in 0..cells.len() * parts {
        let (cell, corner) = (part / parts, part % parts);
        let low = std::array::from_fn(|i| if corner >> i & 1 == 1 { 0.5 } else { 0.0 });
        let high = low.map(|x| if parts > 1 { x + 0.5 } else { 1.0 });
        let (points, jacobians): (Vec<_>, Vec<_>) = (0..count)
            .map(|index| {
                let at = digits::<N>(index, grid.len());
                cells[cell](std::array::from_fn(|i| low[i] + (high[i] - low[i]) * grid.nodes[at[i]]))
            })
            .unzip();
        let densities = sampler.sample(&points)?;
        let values: Vec<Moments<N>> = (0..count)
            .map(|k| {
                let mut value = Moments::zero(sampler.origin());
                value.add_point(jacobians[k] * densities[k], points[k]);
                value
            })
            .collect();
        let axes: Vec<usize> = (0..N).collect();
        let sum = tensor_sum(grid, &values, (low, high), &axes);
        let (lines, jumps, across, along) = (None, Vec::new(), sum.errors(), Errors::default());
        regions.push(Region { cell, low, high, lines, jumps, sum, across, along });
    }
    Ok(regions)
}

/// Digits of an index to a base: which node on every axis.
fn digits<const N: usize>(index: usize, base: usize) -> [usize; N] {
    let mut rest = index;
    std::array::from_fn(|_| {
        let digit = rest % base;
        rest /= base;
        digit
    })
}

impl<const N: usize> TensorSum<N> {
    /// What all axes contribute.
    fn errors(&self) -> Errors {
        let mut errors = Errors::default();
        self.by_axis.iter().for_each(|own| errors.add(1.0, own));
        errors
    }
}

/// Integral over some axes of a box from values on the grid. An axis's error is the integral over the other axes
/// of the size of its rules' difference, so that errors of neighbouring lines do not cancel.
fn tensor_sum<const N: usize>(
    grid: &Rule,
    values: &[Moments<N>],
    (low, high): ([f64; N], [f64; N]),
    axes: &[usize],
) -> TensorSum<N> {
    let base = grid.len();
    let volume: f64 = axes.iter().map(|&i| high[i] - low[i]).product();
    let weight = |index: usize, skip: usize| -> f64 {
        let at = digits::<N>(index, base);
        volume * (0..axes.len()).filter(|&d| d != skip).map(|d| grid.fine[at[d]]).product::<f64>()
    };
    let mut integral = Moments::zero(values[0].origin);
    for (index, value) in values.iter().enumerate() {
        integral.add_scaled(weight(index, usize::MAX), value);
    }
    let (mut difference, mut by_axis) = (Moments::zero(integral.origin), [Errors::default(); N]);
    for (d, &axis) in axes.iter().enumerate() {
        let stride = base.pow(d as u32);
        for start in (0..values.len()).filter(|index| index / stride % base == 0) {
            let mut own = Moments::zero(integral.origin);
            for j in 0..base {
                own.add_scaled(grid.difference[j], &values[start + j * stride]);
            }
            difference.add_scaled(weight(start, d), &own);
            by_axis[axis].add(weight(start, d), &Errors::of(&own, SAFETY));
        }
    }
    TensorSum { integral, difference, by_axis }
}

/// Picks the regions with the largest errors and says what replaces them: after the first pass lines along the
/// worst axis, after that two halves.
fn next_tasks<const N: usize>(regions: &[Region<N>], scale: &ErrorScale, grid: &Rule) -> Vec<Task<N>> {
    let relative: Vec<f64> = regions.iter().map(|r| r.error(scale)).collect();
    let mut order: Vec<usize> = (0..regions.len()).filter(|&i| regions[i].can_shrink(scale)).collect();
    order.sort_by(|&i, &j| relative[j].total_cmp(&relative[i]).then(i.cmp(&j)));
    let half = 0.5 * relative.iter().sum::<f64>();
    let most = (BATCH / grid.len().pow(N as u32 - 1)).max(2);
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

/// Integrates boxes along lines and across them.
fn line_pass<const N: usize>(
    sampler: &mut Sampler<'_, N>,
    [grid, along]: [&Rule; 2],
    cells: &[Cell<N>],
    (tasks, regions): (&[Task<N>], &[Region<N>]),
    (scale, tolerance): (&ErrorScale, f64),
) -> Result<Vec<Region<N>>, ShapeError> {
    let count = grid.len().pow(N as u32 - 1);
    let mut lines = Vec::with_capacity(tasks.len() * count);
    for task in tasks {
        for index in 0..count {
            let digits: [usize; N] = digits(index, grid.len());
            let mut at = [0.0; N];
            for (d, i) in (0..N).filter(|&i| i != task.axis).enumerate() {
                at[i] = task.low[i] + (task.high[i] - task.low[i]) * grid.nodes[digits[d]];
            }
            let span = [task.low[task.axis], task.high[task.axis]];
            let hints = nearby_jumps(grid, &regions[task.parent], &at);
            lines.push(Line { cell: &cells[task.cell], axis: task.axis, at, span, hints });
        }
    }
    let integrals = integrate_lines(sampler, along, &lines, scale, tolerance)?;
    Ok(tasks.iter().zip(integrals.chunks(count)).map(|(task, own)| stacked(grid, task, own)).collect())
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

/// Jumps of a region's lines around a place, ascending.
fn nearby_jumps<const N: usize>(grid: &Rule, region: &Region<N>, at: &[f64; N]) -> Vec<f64> {
    let Some(axis) = region.lines else {
        return Vec::new();
    };
    let mut around = vec![0];
    for (d, i) in (0..N).filter(|&i| i != axis).enumerate() {
        let local = (at[i] - region.low[i]) / (region.high[i] - region.low[i]);
        let after = grid.nodes.partition_point(|&t| t < local).clamp(1, grid.len() - 1);
        let stride = grid.len().pow(d as u32);
        around = around.iter().flat_map(|&k| [k + (after - 1) * stride, k + after * stride]).collect();
    }
    let mut jumps: Vec<f64> = around.into_iter().flat_map(|k| region.jumps[k].iter().copied()).collect();
    jumps.sort_by(f64::total_cmp);
    jumps
}

/// A region from the integrals of its lines: their errors add to those across.
fn stacked<const N: usize>(grid: &Rule, task: &Task<N>, lines: &[LineIntegral<N>]) -> Region<N> {
    let &Task { cell, low, high, axis, .. } = task;
    let axes: Vec<usize> = (0..N).filter(|&i| i != axis).collect();
    let values: Vec<Moments<N>> = lines.iter().map(|line| line.value).collect();
    let sum = tensor_sum(grid, &values, (low, high), &axes);
    let (across, mut along) = (sum.errors(), Errors::default());
    let area: f64 = axes.iter().map(|&i| high[i] - low[i]).product();
    for (index, line) in lines.iter().enumerate() {
        let at: [usize; N] = digits(index, grid.len());
        let weight: f64 = (0..axes.len()).map(|d| grid.fine[at[d]]).product();
        along.add(area * weight, &line.errors);
    }
    let jumps = lines.iter().map(|line| line.jumps.clone()).collect();
    Region { cell, low, high, lines: Some(axis), jumps, sum, across, along }
}
