"""Tables of contact problems on stdout, and the facts that `carom problem show` tells."""

from __future__ import annotations

from typing import Any

import numpy as np
from rich.table import Table

from carom._friction_problem import FrictionProblem
from carom._friction_problem_certificate import diagonal_blocks, islands_of
from carom.cli.tables import stdout_console

#: Most rows of a W whose rank is found unasked, by its singular values: about a second.
MOST_FOR_RANK = 800


def facts_of(problem: FrictionProblem, wants_rank: bool = False) -> dict[str, Any]:
    """What a problem is, as plain values; None for what is not known or, unasked, would take long."""
    n, islands = problem.q.size, islands_of(problem)
    norms = np.linalg.norm(diagonal_blocks(problem), 2, axis=(1, 2)) if len(problem) else np.zeros(0)
    felt = norms[norms > 0]
    return {
        "name": problem.name, "source": problem.source, "kind": problem.kind, "dimension": problem.dimension,
        "contacts": len(problem), "rows": n, "entries": int(problem.data.size),
        "islands": len(islands), "largest_island": max((len(members) for members in islands), default=0),
        "rank": _rank(problem) if wants_rank or n <= MOST_FOR_RANK else None,
        "asymmetry": _asymmetry(problem),
        "largest_block": float(felt.max(initial=0.0)),
        "block_ratio": float(felt.max() / felt.min()) if felt.size else None,
        "contacts_between_obstacles": int(len(problem) - felt.size),
        "friction": [float(problem.mu.min()), float(problem.mu.max())] if len(problem) else None,
        "speed": float(np.abs(problem.q).max(initial=0.0)), "has_targets": problem.target is not None,
        "has_bodies": problem.body_form is not None, "mass_ratio": _mass_ratio(problem),
    }  # fmt: skip


def _rank(problem: FrictionProblem) -> int:
    """Count of singular values above 1e-10 of the largest."""
    dense = problem.matrix.toarray()
    sizes = np.linalg.svd(dense, compute_uv=False) if dense.size else np.zeros(0)
    return int((sizes > 1e-10 * sizes.max(initial=0.0)).sum())


def _asymmetry(problem: FrictionProblem) -> float:
    """Largest |W - W^T| over the largest |W|."""
    w = problem.matrix
    largest = float(np.abs(problem.data).max(initial=0.0))
    apart = (w - w.T).data if problem.data.size else np.zeros(0)
    return float(np.abs(apart).max(initial=0.0)) / largest if largest > 0 else 0.0


def _mass_ratio(problem: FrictionProblem) -> float | None:
    """Heaviest over lightest body; None where masses cannot be told from moments of inertia."""
    body, d = problem.body_form, problem.dimension
    freedoms = 3 if d == 2 else 6
    if body is None or not body.mass.shape[0] or body.mass.shape[0] % freedoms:
        return None
    masses = body.mass.matrix.diagonal().reshape(-1, freedoms)[:, :d]
    is_rigid = (masses == masses[:, :1]).all() and masses.min() > 0
    return float(masses.max() / masses.min()) if is_rigid else None


def problem_table(facts: dict[str, Any]) -> None:
    """The facts of `facts_of`."""
    table = _plain_table()
    rank, rows = facts["rank"], facts["rows"]
    table.add_row("problem", facts["name"], facts["source"])
    table.add_row("contacts", str(facts["contacts"]), f"{facts['kind']}, {facts['dimension']} rows each")
    table.add_row("islands", str(facts["islands"]), f"largest of {facts['largest_island']} contacts")
    table.add_row("entries of W", str(facts["entries"]), f"of {rows} rows")
    if rank is None:
        table.add_row("rank", "", f"more than {MOST_FOR_RANK} rows: found with --rank")
    else:
        redundant = "no redundant row" if rank == rows else f"{rows - rank} redundant rows"
        table.add_row("rank", str(rank), f"of {rows}, {redundant}")
    table.add_row("asymmetry", f"{facts['asymmetry']:.1e}", "largest |W - W^T| over the largest |W|")
    if facts["block_ratio"] is not None:
        words = "largest over smallest contact block: mass ratios, levers and thin bodies widen it"
        table.add_row("block ratio", f"{facts['block_ratio']:.3g}", words)
    if facts["mass_ratio"] is not None:
        table.add_row("mass ratio", f"{facts['mass_ratio']:.3g}", "heaviest over lightest body")
    if facts["contacts_between_obstacles"]:
        table.add_row("immovable", str(facts["contacts_between_obstacles"]), "contacts that no impulse moves")
    if facts["friction"] is not None and facts["kind"] == "friction":
        low, high = facts["friction"]
        table.add_row("friction", f"{low:g}" if low == high else f"{low:g} .. {high:g}", "")
    table.add_row("speed", f"{facts['speed']:.3g} m/s", "largest entry of q")
    stdout_console().print(table)


def solution_table(told: dict[str, Any]) -> None:
    """What a solve came to."""
    table = _plain_table()
    table.add_row("problem", told["problem"], f"{told['contacts']} contacts of {told['dimension']} rows")
    state = "solved" if told["solved"] else "not solved"
    table.add_row("solver", told["solver"], f"{state} at {told['tolerance']:g}")
    for stage in told["stages"]:
        table.add_row(f"  {stage['name']}", str(stage["iterations"]), "iterations")
    table.add_row("factorisations", str(told["factorisations"]), "")
    median = (
        f"best of {told['repeat']}, median {1e3 * told['seconds_median']:.4g} ms"
        if told["repeat"] > 1
        else ""
    )
    table.add_row("time", f"{1e3 * told['seconds']:.4g} ms", median)
    _add_errors(table, told)
    if told["reason"]:
        table.add_row("reason", "", told["reason"])
    if told["strict_feasibility"] is not None:
        words = "strict feasibility: at or below 0 no solution need exist"
        table.add_row("feasible by", f"{told['strict_feasibility']:.2e} m/s", words)
    if told["out"] is not None:
        table.add_row("impulses in", "", told["out"])
    stdout_console().print(table)


def measure_table(told: dict[str, Any]) -> None:
    """What impulses are worth."""
    table = _plain_table()
    state = "solved" if told["solved"] else "not solved"
    table.add_row(
        "problem", told["problem"], f"{told['contacts']} contacts, {state} at {told['tolerance']:g}"
    )
    _add_errors(table, told)
    stdout_console().print(table)


def _add_errors(table: Table, told: dict[str, Any]) -> None:
    table.add_row("err_nat", f"{told['err_nat']:.3e}", "natural map over |q|")
    table.add_row("err_scaled", f"{told['err_scaled']:.3e}", "the same in velocity units")
    table.add_row("cone", f"{told['cone']:.1e}", "impulse outside its cone, over the largest impulse")
    table.add_row("penetration", f"{told['penetration']:.1e}", "approach over the largest entry of q")
    table.add_row("complementarity", f"{told['complementarity']:.1e}", "")
    table.add_row("slip alignment", f"{told['slip_alignment']:.1e}", "friction against the slip")
    words = f"{told['take_off']} take off, {told['stick']} stick, {told['slip']} slip"
    table.add_row("contacts", str(told["contacts"]), words)


def _plain_table() -> Table:
    table = Table(show_header=False, box=None, pad_edge=False)
    table.add_column(style="bold")
    table.add_column(justify="right")
    table.add_column()
    return table
