"""python -m bench_contact: the contact solvers of carom beside those of Siconos and Pinocchio.

Problems are the .npz or flat .bin files of a folder. Every solver starts from zero impulses; timed is the
solve alone, best of up to 100 repeats within half a second, by the clock on the wall below 10 ms and by the
CPU clock of the thread from there on. Ours and the fastest reference at each tolerance run again in turn, and
the best of all rounds counts: a machine may be faster in one second than in the next. The impulses are judged
by one program that is none of the solvers. A reference's own tolerance is tightened until the judge is
content.
"""

from __future__ import annotations

import argparse
import dataclasses
import os
import platform
import re
import sys
import tempfile
from pathlib import Path

from bench_contact import problems, table
from bench_contact.engines import Engine, Rules, Run, best_of, runs
from bench_contact.measure import Problem

HERE = Path(__file__).resolve().parent.parent


def machine() -> str:
    """The processor's name and the number of cores, in lower-case words joined by hyphens."""
    model = platform.machine()
    try:
        named = re.search(r"^model name\s*:\s*(.*)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
        model = named.group(1) if named else model
    except OSError:
        pass
    label = f"{model} {os.cpu_count()} cores".lower().replace("(r)", "").replace("(tm)", "")
    return "-".join(re.findall(r"[a-z0-9]+", label))


def engines(peers: Path, ours: Path, wanted: list[str]) -> tuple[list[Engine], list[str]]:
    """The programs that run here, ours last, and the names of those asked for that do not."""
    python = peers / "pinocchio" / "bin" / "python"
    known = {
        "siconos": Engine("siconos", (str(peers / "siconos-peer"),)),
        "pinocchio": Engine("pinocchio", (str(python), str(HERE / "pinocchio_peer.py"))),
        table.OURS: Engine(table.OURS, (str(ours), "time")),
    }
    asked = [known[name] for name in wanted] + [known[table.OURS]]
    running = [engine for engine in asked if any(engine.solvers(rows) for rows in (1, 2, 3))]
    return running, [engine.name for engine in asked if engine not in running]


def timed(
    problem: Problem,
    flat: Path,
    running: list[Engine],
    only: dict[bool, list[str]],
    rules: Rules,
    scratch: Path,
    full: bool,
) -> list[Run]:
    """All runs on a problem by the solvers of `only[True]`, ours, and `only[False]`, references; empty: all.

    A reference that cannot come near the fastest so far is cut short, unless `full`.
    """
    found: list[Run] = []
    for engine in running:
        for solver in engine.solvers(problem.rows_per_contact):
            ours = engine.name == table.OURS
            wanted = only[ours]
            if wanted and solver not in wanted:
                continue
            hardest = [
                r.seconds for r in found if r.engine != table.OURS and r.tolerance == rules.tolerances[-1]
            ]
            limit = rules.limit
            if hardest and not ours and not full:
                limit = min(limit, max(0.1, 3.0 * min(hardest)))
            limited = dataclasses.replace(own_rules(engine, rules), limit=limit)
            found += runs(engine, solver, problem, flat, limited, scratch)
    return found


def own_rules(engine: Engine, rules: Rules) -> Rules:
    """The rules for an engine: ours is given the tolerance that is asked for."""
    return dataclasses.replace(rules, first=1.0) if engine.name == table.OURS else rules


def in_turn(
    found: list[Run],
    problem: Problem,
    flat: Path,
    running: list[Engine],
    rules: Rules,
    scratch: Path,
    rounds: int,
) -> list[Run]:
    """The best of the runs and of so many rounds more of ours and the fastest reference at each tolerance."""
    row = table.Row.of(problem)
    row.runs = found
    fastest = [run for t in rules.tolerances if (run := row.best_reference(t))]
    rivals = {(run.engine, run.solver) for run in fastest + [r for r in found if r.engine == table.OURS]}
    by_name = {engine.name: engine for engine in running}
    for name, solver in sorted(rivals) * rounds:
        engine = by_name[name]
        found = best_of(found, runs(engine, solver, problem, flat, own_rules(engine, rules), scratch))
    return found


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(prog="bench_contact", description=__doc__)
    parser.add_argument("folder", type=Path, help="folder of .npz or .bin problems")
    parser.add_argument("--problems", default="*", help="glob over names of problems [*]")
    parser.add_argument("--tolerances", default="1e-4,1e-8", help="easiest first [1e-4,1e-8]")
    parser.add_argument("--solvers", default="", help="solvers of carom [all]")
    parser.add_argument("--references", default="siconos,pinocchio", help="or none [siconos,pinocchio]")
    parser.add_argument("--reference-solvers", default="", help="settings of the references [all]")
    parser.add_argument("--references-from", type=Path, help="take the references of an earlier CSV instead")
    parser.add_argument(
        "--first", type=float, default=1.0, help="references' own tolerance at first / asked [1]"
    )
    parser.add_argument("--limit", type=float, default=3.0, help="CPU seconds of one call [3]")
    parser.add_argument(
        "--full", action="store_true", help="do not cut short references that cannot be fastest"
    )
    parser.add_argument("--rounds", type=int, default=3, help="of ours and the fastest references [3]")
    parser.add_argument("--peers", type=Path, required=True, help="folder that setup.sh filled")
    parser.add_argument("--ours", type=Path, required=True, help="the program carom-contact")
    parser.add_argument("--out", type=Path, help="folder of results; OUT/MACHINE/contact.csv is written")
    parser.add_argument("--name", default="contact", help="name of the result file [contact]")
    return parser.parse_args()


def report(rows: list[table.Row], tolerances: tuple[str, ...], shown: list[str]) -> None:
    """Prints what the rows come to: friction and complementarity apart, all and usual settings."""
    for what, kept in (
        ("Friction", [row for row in rows if row.rows_per_contact > 1]),
        ("Complementarity", [row for row in rows if row.rows_per_contact == 1]),
    ):
        if kept:
            print(f"\n{what}, all settings of the references:")
            print(table.summary(kept, tolerances, shown))
            print(f"{what}, only the settings that published comparisons tried:")
            print(table.summary([row.usual() for row in kept], tolerances, shown))


def main() -> int:
    """Runs, prints, saves."""
    given = arguments()
    tolerances = tuple(given.tolerances.split(","))
    files = sorted(p for s in (".npz", ".bin") for p in given.folder.glob(f"{given.problems}{s}"))
    if not files:
        print(f"no problems {given.problems}.npz or .bin in {given.folder}", file=sys.stderr)
        return 2
    wanted = [name for name in given.references.split(",") if name not in ("", "none")]
    earlier = table.references(given.references_from) if given.references_from else {}
    running, missing = engines(given.peers, given.ours, [] if earlier else wanted)
    for name in missing:
        print(f"{name} does not run here: its figures are missing")
    only = [name for name in given.solvers.split(",") if name]
    wanted_solvers = {True: only, False: [n for n in given.reference_solvers.split(",") if n]}
    rules = Rules(tolerances, first=given.first, limit=given.limit)
    last = running[-1] if running and running[-1].name == table.OURS else None
    shown = [s for s in dict.fromkeys(s for d in (1, 2, 3) for s in (last.solvers(d) if last else []))]
    shown = [s for s in shown if not only or s in only]
    print(table.heading(tolerances, shown), flush=True)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        for file in files:
            problem = problems.read(file)
            flat = scratch / f"{problem.name}.bin"
            problems.to_flat(problem, flat)
            row = table.Row.of(problem)
            found = timed(problem, flat, running, wanted_solvers, rules, scratch, given.full)
            found = in_turn(found, problem, flat, running, rules, scratch, given.rounds - 1)
            row.runs = earlier.get(problem.name, []) + found
            flat.unlink()
            rows.append(row)
            print(table.line(row, tolerances, shown), flush=True)
            if given.out:
                table.save(given.out / machine() / f"{given.name}.csv", rows)
    report(rows, tolerances, shown)
    return 0


if __name__ == "__main__":
    sys.exit(main())
