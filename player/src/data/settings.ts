/** How a run was computed, in words: its scheme, solver and law, and what tells two runs apart. */

import type { Table } from "./payload";

/** Settings by which runs are told apart, the first ones first; others follow. */
const TELLING = ["scheme", "solver", "impact", "dt", "tolerance", "iterations"];
/** Most settings that name a run. */
const MOST = 2;

/** What solves the contacts of a run; pages from before tell it only where it was asked for. */
export function solverOf({ solver, settings }: Table): string {
  return solver ?? String(settings.solver ?? "the scheme's own solver");
}

/** The law of impacts of a run. */
export function impactOf({ impact, settings }: Table): string {
  return impact ?? String(settings.impact ?? "the scheme's own");
}

/** Whether a run's contacts were softened instead of solved: it has no iterations. Rigid ones in lanes are swept by a solver. */
export function isSoft({ settings }: Table): boolean {
  return settings.scheme === "soft_step" && !settings.solver;
}

/** Scheme and solver. */
export function wayOf(table: Table): string {
  const scheme = String(table.settings.scheme ?? "");
  return [scheme, isSoft(table) ? "" : solverOf(table)].filter(Boolean).join(", ");
}

/** Names for two runs that are compared: by what is different, or by their numbers alone. */
export function namesOf(...tables: [Table, Table]): [string, string] {
  const all = tables.map(told);
  const names = new Set([...TELLING, ...Object.keys(all[0]), ...Object.keys(all[1])]);
  const different = [...names].filter((name) => all[0][name] !== all[1][name]);
  const [first, second] = all.map((settings, i) => {
    const parts = different.map((name) => phrase(name, settings[name])).filter(Boolean);
    return `${i + 1}: ${parts.slice(0, MOST).join(", ") || "the same settings"}`;
  });
  return [first, second];
}

/** Settings with what stands for those that were not asked for. */
function told(table: Table): Record<string, string> {
  const given = Object.entries(table.settings).map(([name, value]) => [name, String(value)]);
  return {
    ...Object.fromEntries(given),
    solver: solverOf(table),
    impact: impactOf(table),
    dt: String(table.dt),
  };
}

/** A setting in a few words: names stand for themselves. */
function phrase(name: string, value: string | undefined): string {
  if (["scheme", "solver", "impact"].includes(name)) return value?.endsWith("own") ? "" : (value ?? "");
  const text = value ?? "none";
  return text.length > 24 ? `other ${name}` : `${name} ${text}`;
}
