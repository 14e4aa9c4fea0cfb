/** Which quantities are plotted, with their units; the ledger's lines are those of `docs/theory`. */

import type { Replay } from "../data/replay";

/** A line of a chart. */
export interface Line {
  name: string;
  unit: string;
  /** What is drawn; null where the axis cannot show the value. */
  values: ArrayLike<number | null>;
  /** What is told in words where that is more than what is drawn. */
  told?: ArrayLike<number | null>;
  /** Drawn with gaps. */
  stroke?: "dashes" | "dots";
  /** Which of the theme's colours; its place among the chart's lines when absent. */
  colour?: number;
}

/** A chart over time. */
export interface Chart {
  name: string;
  unit: string;
  time: Float64Array;
  lines: Line[];
  /** Whether the axis is logarithmic. */
  logarithmic?: boolean;
}

/** Work below this share of the energy that moved is not drawn [1]. */
const NEGLIGIBLE = 1e-3;
const LEDGER = [
  ["gravity", "gravity"],
  ["applied", "applied forces"],
  ["driven", "driven bodies"],
  ["damping", "damping"],
  ["contact_normal", "contact, normal"],
  ["friction", "friction"],
  ["impact_normal", "impact, normal"],
  ["impact_friction", "impact, friction"],
  ["rest_cut", "rest cut"],
  ["fallback", "fallback"],
  ["constraint", "joints"],
  ["projection", "projection"],
  ["integrator", "integrator"],
  ["sleep", "sleep"],
] as const;

/** The charts of a run; lines of a run that it is compared with come as dashes. */
export function chartsOf(replay: Replay, other?: Replay): Chart[] {
  const charts = allCharts(replay);
  if (other) {
    compare(charts, allCharts(other));
    charts.unshift(...distance(other));
  }
  return charts.filter((chart) => chart.lines.length > 0);
}

/** All charts, also those without a line. */
function allCharts(replay: Replay): Chart[] {
  const time = replay.steps.time;
  if (replay.steps.count === 0) return [];
  return [
    { name: "Energy", unit: "J", time, lines: energies(replay) },
    { name: "Work by cause", unit: "J", time, lines: works(replay) },
    { name: "Closure of the books", unit: "J", time, lines: one(replay, "ledger_closure", "closure", "J") },
    { name: "Residual", unit: "m/s", time, lines: residuals(replay), logarithmic: true },
    { name: "Momentum", unit: "kg m/s", time, lines: components(replay, "momentum", "p", "kg m/s") },
    {
      name: "Angular momentum",
      unit: "kg m²/s",
      time,
      lines: components(replay, "angular_momentum", "L", "kg m²/s"),
    },
    { name: "Contacts", unit: "1", time, lines: one(replay, "contacts", "contacts", "1") },
    { name: "Iterations", unit: "1", time, lines: one(replay, "iterations", "iterations", "1") },
    { name: "Deepest overlap", unit: "m", time, lines: overlap(replay) },
  ];
}

/** Adds every line of the other run, in the colour of the line that it is compared with where there is one. */
function compare(charts: Chart[], others: Chart[]): void {
  for (const theirs of others) {
    let chart = charts.find(({ name }) => name === theirs.name);
    if (!chart) {
      chart = { ...theirs, lines: [] };
      charts.push(chart);
    }
    const ours = chart.lines.slice();
    let fresh = ours.length;
    for (const line of theirs.lines) {
      const same = ours.findIndex(({ name }) => name === line.name);
      const values = resampled(theirs.time, line.values, chart.time);
      chart.lines.push({
        ...line,
        name: `${line.name} (2)`,
        values,
        ...(line.told ? { told: resampled(theirs.time, line.told, chart.time) } : {}),
        stroke: line.stroke ? "dots" : "dashes",
        colour: same >= 0 ? (ours[same].colour ?? same) : fresh++,
      });
    }
  }
}

/** How far the runs are apart, as the page was told. */
function distance(other: Replay): Chart[] {
  if (!other.payload.has("difference_time")) return [];
  const lines = ["largest", "mean"].map((name) => {
    const told = other.payload.array(`difference_${name}`);
    return { name, unit: "m", told, values: Array.from(told, shown) };
  });
  const apart = lines.some(({ told }) => highest(told) > 0);
  return [
    {
      name: "Distance between the runs",
      unit: "m",
      time: other.payload.array("difference_time") as Float64Array,
      // runs that are equal have nothing that a logarithmic axis could show
      logarithmic: apart,
      lines: lines.map(({ values, ...line }) => ({ ...line, values: apart ? values : line.told })),
    },
  ];
}

/** Values at other moments: those of the nearest moment at or before. */
function resampled(
  from: Float64Array,
  values: ArrayLike<number | null>,
  to: Float64Array,
): (number | null)[] {
  let at = 0;
  return Array.from(to, (time) => {
    while (at + 1 < from.length && from[at + 1] <= time + 1e-12) at += 1;
    return time > from[from.length - 1] + 1e-9 ? null : values[at];
  });
}

function one(replay: Replay, column: string, name: string, unit: string): Line[] {
  const values = replay.steps.column(column);
  return values ? [{ name, unit, values }] : [];
}

function energies(replay: Replay): Line[] {
  const kinetic = replay.steps.column("kinetic");
  const potential = replay.steps.column("potential");
  if (!kinetic || !potential) return [];
  const sum = Float32Array.from(kinetic, (value, i) => value + potential[i]);
  return [
    { name: "total", unit: "J", values: sum },
    { name: "kinetic", unit: "J", values: kinetic },
    { name: "potential", unit: "J", values: potential },
  ];
}

/** Cumulated works that matter. */
function works(replay: Replay): Line[] {
  const lines = LEDGER.flatMap(([column, name]) => one(replay, `ledger_${column}`, name, "J"));
  const largest = Math.max(...lines.map(({ values }) => highest(values)), 0);
  return lines.filter(({ values }) => highest(values) > NEGLIGIBLE * largest && largest > 0);
}

function highest(values: ArrayLike<number | null>): number {
  let found = 0;
  for (let i = 0; i < values.length; i++) {
    const size = Math.abs(values[i] ?? 0);
    if (size > found && Number.isFinite(size)) found = size;
  }
  return found;
}

/** Residuals and the tolerance. */
function residuals(replay: Replay): Line[] {
  const values = replay.steps.column("residual");
  if (!values || !highest(values)) return [];
  const lines: Line[] = [{ name: "residual", unit: "m/s", values: Array.from(values, shown), told: values }];
  const tolerance = Number(replay.table.settings.tolerance);
  if (tolerance > 0) {
    lines.push({
      name: "tolerance",
      unit: "m/s",
      values: new Float32Array(values.length).fill(tolerance),
      stroke: "dashes",
    });
  }
  return lines;
}

/** A value that a logarithmic axis can show. */
function shown(value: number): number | null {
  return value > 0 && Number.isFinite(value) ? value : null;
}

function components(replay: Replay, column: string, symbol: string, unit: string): Line[] {
  const values = replay.steps.column(column);
  if (!values) return [];
  const width = replay.steps.width(column);
  const axes = width === 1 ? [""] : [..."xyz"].slice(0, width);
  return axes.map((axis, k) => ({
    name: `${symbol}${axis}`,
    unit,
    values: Float32Array.from({ length: replay.steps.count }, (_, i) => values[i * width + k]),
  }));
}

/** How deep bodies overlap: the negative part of the smallest gap. */
function overlap(replay: Replay): Line[] {
  const gap = replay.steps.column("deepest_gap");
  if (!gap) return [];
  const values = Float32Array.from(gap, (value) => (value < 0 ? -value : 0));
  return highest(values) > 0 ? [{ name: "overlap", unit: "m", values }] : [];
}
