"""Tables of the page `docs/engines.md`, from the benchmarks' CSV files: written to `docs/_made`.

Every figure is a cell of a file in `crates/bench/results`, or a median over its rows that the table names.
Run by `make docs`.
"""

from __future__ import annotations

import csv
import statistics
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "crates/bench/results"
MADE = ROOT / "docs/_made"
Row = dict[str, str]


def rows(path: Path) -> list[Row]:
    """The rows of a file."""
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def shown(text: str, form: str = "{:.3g}") -> str:
    """A cell as a number, or a dash."""
    try:
        value = float(text)
    except ValueError:
        return "–"
    return "–" if value != value else form.format(value)


def table(headings: list[str], body: list[list[str]]) -> str:
    """A table in Markdown."""
    lines = ["| " + " | ".join(headings) + " |", "|" + "---|" * len(headings)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in body)]) + "\n"


def race(machine: str) -> str:
    """Engines on one thread without sleeping: cost and quality, scene by scene."""
    body = []
    last = ""
    for row in rows(RESULTS / machine / "peers.csv"):
        if row["threads"] != "1" or row["sleeping"] != "off":
            continue
        scene = f"{row['space']} {row['scene']} ({row['bodies']} bodies)"
        cut = "" if row["steps"] == row["steps_asked"] else f" ({row['steps']} of {row['steps_asked']} steps)"
        name = f"**{row['engine']}** `{row['solver']}`" if row["engine"] == "carom" else row["engine"]
        quality = [shown(row[key], "{:.1e}") for key in ("penetration_max", "drift_max", "energy_gain")]
        angle = shown(row["slip_direction_error"], "{:.1e}")
        body.append(["" if scene == last else scene, name + cut, shown(row["cpu_ms_per_step"]),
                     shown(row["ratio"]), *quality, angle])  # fmt: skip
        last = scene
    headings = [
        "scene", "engine", "processor time per step [ms]", "over the fastest peer [1]", "deepest overlap [m]",
        "largest drift [m]", "largest energy gain [1]", "slip direction error [rad]",
    ]  # fmt: skip
    return table(headings, body)


def contact(machine: str) -> str:
    """Contact solvers beside the best reference: medians over the problems that each solved."""
    found = rows(RESULTS / machine / "contact.csv")
    problems = {tolerance: len({row["problem"] for row in found if row["tolerance"] == tolerance})
                for tolerance in ("1e-4", "1e-8")}  # fmt: skip
    body = []
    for engine, solver in sorted({(row["engine"], row["solver"]) for row in found}):
        cells = [f"**{engine}** `{solver}`" if engine == "carom" else f"{engine} `{solver}`"]
        for tolerance, count in problems.items():
            wanted = (engine, solver, tolerance)
            mine = [row for row in found if (row["engine"], row["solver"], row["tolerance"]) == wanted]
            ratios = [float(row["ratio_to_best_reference"]) for row in mine if row["ratio_to_best_reference"]]
            cells += [f"{len(mine)} of {count}", f"{statistics.median(ratios):.2f}" if ratios else "–"]
        body.append(cells)
    return table(["solver", "solved to 1e-4", "median ratio", "solved to 1e-8", "median ratio"], body)


def simbenchmark(machine: str) -> str:
    """SimBenchmark's errors by engine and step."""
    found = rows(RESULTS / machine / "simbenchmark.csv")
    steps = sorted({row["dt"] for row in found}, key=float)
    body = []
    for task in dict.fromkeys(row["task"] for row in found):
        for engine in dict.fromkeys(row["engine"] for row in found if row["task"] == task):
            cells = {row["dt"]: shown(row["error"], "{:.1e}") for row in found
                     if (row["task"], row["engine"]) == (task, engine)}  # fmt: skip
            name = f"**{engine}**" if engine.startswith("carom") else engine
            body.append([task.replace("_", " "), name, *(cells.get(dt, "–") for dt in steps)])
    return table(["task", "engine", *(f"dt {dt} s" for dt in steps)], body)


def main() -> None:
    """All tables."""
    MADE.mkdir(exist_ok=True)
    machine = "amd-epyc-2-cores"
    for name, make in (("race", race), ("contact", contact), ("simbenchmark", simbenchmark)):
        (MADE / f"{name}.md").write_text(make(machine))


if __name__ == "__main__":
    main()
